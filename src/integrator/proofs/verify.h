/* What the sources of this folder share: what is known of rows (stiffness.cpp), and the comparison of the residual with what a correction has promised. */
#ifndef HHTDAE_VERIFY_H
#define HHTDAE_VERIFY_H

#include "integrator/entries.h"
#include "integrator/state.h"

namespace hht3
{

constexpr PetscReal unanswered_fraction = 0.1; /* of what a residual was: at 0.3 friction that slips within a step passed for followed */

/* d s'/d w, which a row of a state has in place of ca */
inline PetscReal StateInertia(const Parameters &p) { return p.gamma_s * p.gamma / p.beta; }

inline bool HasDefinitions(const Integrator &I) { return I.count[TSHHT3_VARIABLE] || I.count[TSHHT3_FORCE]; }

/* Of a row, in units of the tolerance: a residual that inertia alone answers, the same of a residual over its inertia, and rounding; and how
   many times h has gone since the row was proved */
struct RowScale {
  PetscReal answer, claimed, rounding, steps;
};

/* Of row i with inertia m > 0, weight w of its unknown, rounding of its residual and the time for which it has not been proved */
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
  const PetscReal   claimed[2], answer[2]; /* of coordinates, of states */
};

/* The sums that entry(scale, sum, x...) adds to, over all rows of which something is asked and all ranks; x: entries of further vectors */
template <class Entry, class... More>
PetscErrorCode SumRows(TS ts, PetscReal sum[4], Entry entry, More... more)
{
  Integrator         &I        = Get(ts);
  const Verification &v        = I.verify;
  PetscReal           local[4] = {0, 0, 0, 0};
  const RowScales     scale(I);

  PetscFunctionBegin;
  PetscCall(ForEntries(
    [&](PetscInt i, PetscScalar m, PetscScalar w, PetscScalar noise, PetscScalar unproved, auto... x) {
      if (PetscRealPart(m) > 0) entry(scale(i, m, w, noise, unproved), local, PetscRealPart(x)...);
    },
    Read(v.inertia), Read(I.weight), Read(v.noise), Read(v.unproved), more...));
  PetscCallMPI(MPI_Allreduce(local, sum, 4, MPIU_REAL, MPIU_SUM, PetscObjectComm((PetscObject)ts)));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* What a correction has left of the residual that it was to take away, as changes of positions in units of the tolerance */
struct Imbalance {
  PetscReal all  = 0; /* within this step */
  PetscReal stay = 0; /* of entries that are about as they were, since they were proved */
  PetscReal part = 0; /* of the residual that is as it was */
};

/* stiffness.cpp */
PetscErrorCode MeasureRowsAtStage(TS ts, Vec X, Vec F);
PetscErrorCode AddRounding(TS ts, Vec X, Vec F, unsigned salt, Vec noise);
/* verify.cpp */
PetscErrorCode SubstituteDefinitions(TS ts, Vec R);
PetscErrorCode ModelResidual(TS ts, Vec dX);
PetscErrorCode CompareWithModel(TS ts, Vec F, Imbalance *left);
PetscErrorCode CompareAboveRounding(TS ts, Vec X, Vec F, PetscReal enough, Imbalance *left);
/* wrong_jacobian.cpp */
PetscErrorCode CheckJacobian(TS ts, Vec dX, Vec F, PetscBool *wrong);

} // namespace hht3

#endif
