/* Shared by the sources of this folder: scales of rows (from stiffness.cpp), and the comparison of the residual with the linear model
   of a correction. */
#ifndef HHTDAE_VERIFY_H
#define HHTDAE_VERIFY_H

#include "integrator/entries.h"
#include "integrator/state.h"

namespace hht3
{

/* A residual has followed a correction if it is below this part of its former size. At 0.3 this held for friction that starts to slip
   within a step. */
constexpr PetscReal unanswered_fraction = 0.1;

/* d s'/d w: the factor of inertia for first-order states, as ca() is for coordinates */
inline PetscReal StateInertia(const Parameters &p) { return p.gamma_s * p.gamma / p.beta; }

inline bool HasDefinitions(const Integrator &I) { return I.count[TSHHT3_VARIABLE] || I.count[TSHHT3_FORCE]; }

/* The scales of a row, in units of the tolerance:
     answer     size of the correction that a residual of 1 would make if there were only inertia
     claimed    the same for a residual that has been divided by its inertia (times ca() or StateInertia())
     rounding   size of the correction that rounding of the residual would make if there were only inertia
   and steps, the time since the row was last proved, this step included, as a multiple of h */
struct RowScale {
  PetscReal answer, claimed, rounding, steps;
};

/* The scales of row i, which has the inertia m > 0, the weight w of its unknown, rounding `noise` of its residual, and the time
   `unproved` of Verification */
class RowScales {
public:
  explicit RowScales(const Integrator &I) : I(I), claimed{PetscAbsReal(I.p.k) * I.h * I.h, I.p.gamma_s * I.h}, answer{claimed[0] / I.p.ca(), claimed[1] / StateInertia(I.p)} {}
  RowScale operator()(PetscInt i, PetscScalar m, PetscScalar w, PetscScalar noise, PetscScalar unproved) const
  {
    const int       k = RoleOf(I, i) == TSHHT3_STATE;
    const PetscReal a = answer[k] * PetscRealPart(w / m);
    return {a, claimed[k] * PetscRealPart(w), a * PetscRealPart(noise), 1 + (I.verify.since + PetscRealPart(unproved)) / I.h};
  }

private:
  const Integrator &I;
  const PetscReal   claimed[2], answer[2]; /* of coordinates, and of states */
};

/* Calls entry(scale, sum, x...), which adds to both sums, for all rows with inertia on all ranks; x: entries of further vectors */
template <class Entry, class... More>
PetscErrorCode SumRows(TS ts, PetscReal sum[2], Entry entry, More... more)
{
  Integrator         &I        = Get(ts);
  const Verification &v        = I.verify;
  PetscReal           local[2] = {0, 0};
  const RowScales     scale(I);

  PetscFunctionBegin;
  PetscCall(ForEntries(
    [&](PetscInt i, PetscScalar m, PetscScalar w, PetscScalar noise, PetscScalar unproved, auto... x) {
      if (PetscRealPart(m) > 0) entry(scale(i, m, w, noise, unproved), local, PetscRealPart(x)...);
    },
    Read(v.inertia), Read(I.weight), Read(v.noise), Read(v.unproved), more...));
  PetscCallMPI(MPI_Allreduce(local, sum, 2, MPIU_REAL, MPIU_SUM, PetscObjectComm((PetscObject)ts)));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The residual that a correction was to remove and has not, as the change of positions that it makes, in units of the tolerance */
struct Imbalance {
  PetscReal all  = 0; /* of all rows, within this step */
  PetscReal stay = 0; /* of rows whose residual has stayed about as it was, over the time since they were proved */
};

/* stiffness.cpp */
PetscErrorCode MeasureRowsAtStage(TS ts, Vec X, Vec F);
PetscErrorCode AddRounding(TS ts, Vec X, Vec F, unsigned salt, Vec noise);
/* verify.cpp */
PetscErrorCode SubstituteDefinitions(TS ts, Vec R);
PetscErrorCode ModelResidual(TS ts, Vec dX);
PetscErrorCode CompareAboveRounding(TS ts, Vec X, Vec F, PetscReal enough, Imbalance *left);
/* wrong_jacobian.cpp */
PetscErrorCode CheckJacobian(TS ts, Vec dX, PetscBool *wrong);

} // namespace hht3

#endif
