/*
  Time derivatives of the constraints, where the application gives none: one-sided differences of its residual along q + tau q'. They are exact in
  q'' by construction, blind to what happened before t (a motion may start there), and each row takes the step tau at which it is most accurate:
  where its derivative changes least from one tau to the next.
*/
#include "consistent.h"
#include "entries.h"
#include "roles.h"
#include "work_vec.h"
#include <vector>

namespace hht3
{

namespace
{

constexpr int       levels = 9, points = 6; /* tau = T/10, T/40, ...; of fourth order in tau */
constexpr PetscReal first_weights[points]  = {-25. / 12, 4, -3, 4. / 3, -1. / 4, 0};
constexpr PetscReal second_weights[points] = {45. / 12, -154. / 12, 214. / 12, -13, 61. / 12, -10. / 12};

/* A derivative of each row: the best one so far, and the level that it is of */
struct Best {
  std::vector<PetscReal> last, value, change;
  std::vector<signed char> &level;
  bool                      known; /* the levels are those of an earlier call */
  Best(std::vector<signed char> &at, PetscInt n, bool again) : last(n, 0), value(n, 0), change(n, PETSC_MAX_REAL), level(at), known(again)
  {
    if (!known) level.assign((size_t)n, -1);
  }
  void take(PetscInt i, int l, PetscReal x)
  {
    const PetscReal d = PetscAbsReal(x - last[i]);
    if (known ? l == level[i] : l > 0 && d < change[i]) { /* false for NaN */
      change[i] = d;
      value[i]  = x;
      level[i]  = (signed char)l;
    }
    last[i] = x;
  }
};

/* Which levels any row on any rank takes its derivative from, those of order 0 or 1 */
PetscErrorCode LevelsInUse(TS ts, const Integrator &I, bool first, bool second, bool (&used)[levels])
{
  PetscBool any[levels] = {};

  PetscFunctionBegin;
  for (size_t i = 0; i < I.role.size(); i++) {
    if (!IsConstraint(I, (PetscInt)i)) continue;
    const bool holonomic = I.role[i] == TSHHT3_HOLONOMIC;
    const int  one = first && holonomic ? I.levels[0][i] : -1, two = second ? I.levels[holonomic ? 1 : 0][i] : -1;
    if (one >= 0) any[one] = PETSC_TRUE;
    if (two >= 0) any[two] = PETSC_TRUE;
  }
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, any, levels, MPIU_BOOL, MPI_LOR, PetscObjectComm((PetscObject)ts)));
  for (int l = 0; l < levels; l++) used[l] = any[l];
  PetscFunctionReturn(PETSC_SUCCESS);
}

} // namespace

/* First and second time derivatives of the constraint rows along U + tau V, t + tau, at tau = 0: Phi' and Phi'' of
   holonomic rows, Psi and Psi' of velocity-level ones. Other rows are zero. Either output may be NULL. T: the time scale of the motion.
   again: with the differences that were the best ones at the last call, near by. */
PetscErrorCode ConstraintDerivatives(TS ts, PetscReal t, Vec U, Vec V, PetscReal T, bool again, Vec first, Vec second)
{
  Integrator            &I = Get(ts);
  WorkVec                Ut, F, zero;
  PetscInt               n;
  bool                   used[levels];
  std::vector<PetscReal> f0, s1, s2;

  PetscFunctionBegin;
  PetscCall(VecGetLocalSize(U, &n));
  PetscCall(Ut.like(U));
  PetscCall(F.like(U));
  PetscCall(zero.like(U));
  PetscCall(VecZeroEntries(zero));
  for (bool &u : used) u = true;
  if (again) PetscCall(LevelsInUse(ts, I, first, second, used));
  f0.resize(n);
  Best d1(I.levels[0], n, again), d2(I.levels[1], n, again);
  PetscCall(VecCopy(U, Ut));
  PetscCall(ResidualAlong(ts, t, Ut, V, zero, F));
  PetscCall(ForEntries([&](PetscInt i, PetscScalar f) { f0[i] = PetscRealPart(f); }, Read(F)));
  for (int level = 0; level < levels; level++) {
    if (!used[level]) continue;
    const PetscReal tau = 0.1 * T * PetscPowRealInt(0.25, level);
    s1 = s2 = f0;
    for (PetscInt i = 0; i < n; i++) {
      s1[i] *= first_weights[0];
      s2[i] *= second_weights[0];
    }
    for (int j = 1; j < points; j++) {
      PetscCall(VecWAXPY(Ut, j * tau, V, U));
      PetscCall(ResidualAlong(ts, t + j * tau, Ut, V, zero, F));
      PetscCall(ForEntries(
        [&](PetscInt i, PetscScalar f) {
          s1[i] += first_weights[j] * PetscRealPart(f);
          s2[i] += second_weights[j] * PetscRealPart(f);
        },
        Read(F)));
    }
    for (PetscInt i = 0; i < n; i++) {
      if (!IsConstraint(I, i)) continue;
      d1.take(i, level, s1[i] / tau);
      d2.take(i, level, s2[i] / (tau * tau));
    }
  }
  for (int order = 1; order <= 2; order++) {
    Vec out = order == 1 ? first : second;
    if (!out) continue;
    PetscCall(ForEntries(
      [&](PetscInt i, PetscScalar &g) {
        g = 0;
        if (!IsConstraint(I, i)) return;
        if (I.role[i] == TSHHT3_HOLONOMIC) g = order == 1 ? d1.value[i] : d2.value[i];
        else g = order == 1 ? f0[i] : d1.value[i];
      },
      Write(out)));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

} // namespace hht3
