/* Rooms of verify.cpp: what is known of rows (claims.cpp), and the comparison of the residual with what a correction has promised. */
#ifndef HHTDAE_VERIFY_H
#define HHTDAE_VERIFY_H

#include "entries.h"
#include "impl.h"

namespace hht3
{

constexpr PetscReal followed   = 0.1; /* of what a residual was: at 0.3 friction that slips within a step passed for followed */

/* d s'/d w, which a row of a state has in place of ca */
inline PetscReal StateInertia(const Parameters &p) { return p.gamma_s * p.gamma / p.beta; }

inline bool HasDefinitions(const Integrator &I) { return I.count[TSHHT3_VARIABLE] || I.count[TSHHT3_FORCE]; }

/* Of a row, in units of the tolerance: a residual that inertia alone answers, the same of a residual over its inertia, and rounding */
struct RowScale {
  PetscReal answer, claimed, rounding;
};

/* The sums that entry(scale, sum, x...) adds to, over all rows of which something is asked and all ranks; x: entries of further vectors */
template <class Entry, class... More>
PetscErrorCode SumRows(TS ts, PetscReal sum[4], Entry entry, More... more)
{
  Integrator         &I          = Get(ts);
  const Verification &v          = I.verify;
  PetscReal           local[4]   = {0, 0, 0, 0};
  const PetscReal     claimed[2] = {PetscAbsReal(I.p.k) * I.h * I.h, I.p.gamma_s * I.h}; /* of coordinates, of states */
  const PetscReal     answer[2]  = {claimed[0] / I.p.ca(), claimed[1] / StateInertia(I.p)};

  PetscFunctionBegin;
  PetscCall(ForEntries(
    [&](PetscInt i, PetscScalar m, PetscScalar w, PetscScalar noise, auto... x) {
      if (!(PetscRealPart(m) > 0)) return;
      const int       k = RoleOf(I, i) == TSHHT3_STATE;
      const PetscReal a = answer[k] * PetscRealPart(w / m);
      entry(RowScale{a, claimed[k] * PetscRealPart(w), a * PetscRealPart(noise)}, local, PetscRealPart(x)...);
    },
    Read(v.inertia), Read(I.weight), Read(v.noise), more...));
  PetscCallMPI(MPI_Allreduce(local, sum, 4, MPIU_REAL, MPIU_SUM, PetscObjectComm((PetscObject)ts)));
  PetscFunctionReturn(PETSC_SUCCESS);
}

inline bool Followed(const RowScale &s, PetscReal now, PetscReal was)
{
  return PetscAbsReal(now) * s.answer <= followed * PetscAbsReal(was) * s.answer + s.rounding;
}

/* claims.cpp */
bool           Claims(const Integrator &I);
PetscErrorCode MeasureRows(TS ts, Vec X, Vec F);
/* verify.cpp */
PetscErrorCode PassDefinitionsOn(TS ts, Vec R);
PetscErrorCode Model(TS ts, Vec dX);
PetscErrorCode Compare(TS ts, Vec F, PetscReal *left, PetscReal *stay, PetscReal *part);
/* blame.cpp */
PetscErrorCode CheckJacobian(TS ts, Vec dX, Vec F, PetscBool *wrong);

} // namespace hht3

#endif
