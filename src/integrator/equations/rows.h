/* Rows in messages. */
#ifndef HHTDAE_ROWS_H
#define HHTDAE_ROWS_H

#include "integrator/state.h"

namespace hht3
{

/* "17", or "17 (x of body rod)" where the application names its rows */
struct RowLabel {
  char text[200] = "";
};

PetscErrorCode LabelRow(TS ts, PetscInt row, RowLabel *label);
PetscErrorCode NameBadRow(TS ts, PetscReal t, Vec F);
PetscErrorCode NameBadMatrix(TS ts, PetscReal t, Mat P, PetscBool *bad);
PetscErrorCode RefuseBadMatrix(TS ts, Mat P);
PetscErrorCode RefuseNoNumbers(TS ts, Mat P);
PetscErrorCode SetRowName(TS ts, TSHHT3RowName name, void *ctx);

} // namespace hht3

#endif
