/* Orders above two: their states, stages and changes of order (bdf.cpp; the formulas are in bdf.h), their error and the choice of the order (order.cpp). */
#ifndef HHTDAE_ORDER_H
#define HHTDAE_ORDER_H

#include "integrator/state.h"

namespace hht3
{

PetscErrorCode SetUpOrder(TS ts);
PetscErrorCode ViewOrder(TS ts, PetscViewer viewer);

/* At a start: order two, and no history */
void ResetOrder(TS ts);

/* Before an attempt of length I.h: the parameters of its order; then what PrepareStage() does at order two */
PetscErrorCode UseOrder(TS ts);
PetscErrorCode PrepareBDF(TS ts);

/* tau_1, tau_2, ... for a step to t1 */
void Spans(const Order &o, PetscReal t1, PetscReal tau[]);

/* Of the attempt: its local error in units of the tolerance */
PetscErrorCode ErrorOfOrder(TS ts, NormType type, PetscReal *wlte);

/* For the step after the accepted one. *next: the length that the controller has chosen for the present order, and that of the next one on return; NULL if
   another one than ours chooses it. */
PetscErrorCode ChooseOrder(TS ts, PetscReal *next);

/* The accepted step is about to become t_n, its beginning a part of the past */
void CommitOrder(Integrator &I);

/* Order two for a while: at once after a failed correction, or for the next step */
PetscErrorCode LowerAfterFailure(TS ts);
void           LowerToTwo(Order &o);

/* The past: n states of it are kept; it goes over to new coordinates */
PetscErrorCode CutPast(TS ts, PetscInt n);
PetscErrorCode MapPast(TS ts);

} // namespace hht3

#endif
