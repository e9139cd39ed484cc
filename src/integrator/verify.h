/* Rooms of verify.cpp: what is known of rows (claims.cpp), and the comparison of the residual with what a correction has promised. */
#ifndef HHTDAE_VERIFY_H
#define HHTDAE_VERIFY_H

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

struct RowScales {
  PetscReal          answer[2], claimed[2]; /* of coordinates, of states */
  const PetscScalar *w, *c, *m, *noise;

  RowScale at(TSHHT3Role r, PetscInt i) const
  {
    const int       k = r == TSHHT3_STATE;
    const PetscReal a = answer[k] * PetscRealPart(w[i] / m[i]);
    return {a, claimed[k] * PetscRealPart(w[i]), a * PetscRealPart(noise[i])};
  }
};

PetscErrorCode GetRowScales(const Integrator &I, RowScales *s);
PetscErrorCode RestoreRowScales(const Integrator &I, RowScales *s);

/* The sums that entry(row, scale, sum) adds to, over all rows of which something is asked and all ranks */
template <class Entry>
PetscErrorCode SumRows(TS ts, PetscReal sum[4], Entry entry)
{
  Integrator &I        = Get(ts);
  PetscReal   local[4] = {0, 0, 0, 0};
  RowScales   s;
  PetscInt    n;

  PetscFunctionBegin;
  PetscCall(VecGetLocalSize(I.X, &n));
  PetscCall(GetRowScales(I, &s));
  for (PetscInt i = 0; i < n; i++) {
    const TSHHT3Role r = RoleOf(I, i);
    if (PetscRealPart(s.m[i]) > 0) entry(i, s.at(r, i), local);
  }
  PetscCall(RestoreRowScales(I, &s));
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
