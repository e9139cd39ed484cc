/* Whether a checkpoint belongs to the run that reads it. */
#ifndef HHTDAE_CHECKPOINT_IDENTITY_H
#define HHTDAE_CHECKPOINT_IDENTITY_H

#include "formulas.h"
#include "state.h"
#include <cstdint>
#include <string>
#include <vector>

namespace hht3
{

/* What must be the same in both runs, rank by rank */
struct Identity {
  PetscInt      N, n, extra, extra_n; /* unknowns of all ranks and of this one; entries of the application's own likewise */
  PetscInt      form, forces;         /* forces: whether there is F0 */
  PetscInt      order;                /* the largest one */
  Parameters    p;
  std::uint64_t roles;
};

PetscErrorCode Identify(TS ts, Identity *id);
PetscErrorCode CheckIdentity(TS ts, const char file[], const Identity &was);

/* Options that the run may change, at the cost of repeating the uninterrupted one no more: for comparison and for the message */
PetscErrorCode OptionsInWords(TS ts, std::string *text);
PetscErrorCode CompareOptions(TS ts, const char file[], const std::vector<char> &words);

/* The residual by which a problem is told: at the last state, with accelerations that leave the inertia forces in it */
PetscErrorCode TellingResidual(TS ts, Vec F);
PetscErrorCode CheckTellingResidual(TS ts, const char file[], Vec was, Vec is);

/* A run writes no state that is not finite, and a residual that is NaN in both runs tells nothing. */
PetscErrorCode CheckFinite(TS ts, const char file[]);

/* An answer for all ranks */
PetscErrorCode Everywhere(TS ts, bool mine, bool *all);

} // namespace hht3

#endif
