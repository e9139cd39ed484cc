/*
  Variables and states in constraints.

  Accelerations and multipliers at given positions and velocities need Phi'' and Psi' along the motion, with a matrix of q'' alone. So what else stands in a
  constraint has to be known along the motion without q'': first-order states by their rates, variables and force states by their definitions, where these
  depend on positions, states and time only. In rows of positions they would change with q'' in any case, and would take no part of the constraint's force.

  The residual tells what depends on what, at the set-up and where there are such unknowns beside constraints. Where the application has named the roles
  of unknowns, it also tells whether rows of constraints depend on rates that their role does not have: such a row would be scaled and differentiated as
  what it is not.
*/
#include "integrator/entries.h"
#include "equations.h"
#include "integrator/random.h"
#include "roles.h"
#include "rows.h"
#include "integrator/work_vec.h"

namespace hht3
{

namespace
{

constexpr int max_sweeps = 20; /* definitions that refer to one another, one after the other */

bool IsDefined(const Integrator &I, PetscInt i) { return RoleOf(I, i) == TSHHT3_VARIABLE || RoleOf(I, i) == TSHHT3_FORCE; }

constexpr PetscReal noise_factor = 1e3; /* noise, of the difference of two residuals: the next ones may differ by more (Roles.ResidualsThatRoundDifferently*) */

/* A state near the initial one, its residual, and others beside it */
struct Dependence {
  TS        ts;
  WorkVec   U, V, A, F, other, moved;
  PetscReal noise = 0; /* rows that change by less have not changed: sums in another order, by threads, make a residual that is not the same twice */

  explicit Dependence(TS t) : ts(t) {}

  PetscErrorCode begin()
  {
    PetscFunctionBegin;
    for (WorkVec *v : {&U, &V, &A, &F, &other, &moved}) PetscCall(v->like(ts->vec_sol));
    PetscCall(StateOffStart(ts, 11, 0, U, V, A));
    PetscCall(EvaluateResidual(ts, ts->ptime, U, V, A, F));
    PetscCall(EvaluateResidual(ts, ts->ptime, U, V, A, other));
    PetscCall(VecAXPY(other, -1, F));
    PetscCall(VecNorm(other, NORM_INFINITY, &noise));
    noise = noise < PETSC_MAX_REAL ? noise_factor * noise : 0; /* rows that are no numbers tell nothing */
    PetscFunctionReturn(PETSC_SUCCESS);
  }

  /* changed(i) for rows that are not what they were when unknowns `which` of x have others values; a residual that is not a number tells nothing */
  template <class Which, class Changed>
  PetscErrorCode vary(Vec x, const Which &which, const Changed &changed)
  {
    PetscFunctionBegin;
    PetscCall(VecCopy(x, moved));
    PetscCall(Shake(moved, 1e-3, 14, which));
    PetscCall(EvaluateResidual(ts, ts->ptime, x == (Vec)U ? moved : U, x == (Vec)V ? moved : V, x == (Vec)A ? moved : A, other));
    PetscCall(ForEntries([&](PetscInt i, PetscScalar f, PetscScalar g) { if (PetscAbsScalar(f - g) > noise && !PetscIsInfOrNanScalar(f) && !PetscIsInfOrNanScalar(g)) changed(i); }, Read(F), Read(other)));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
};

/* The first of rows marked on any rank, or -1 */
PetscErrorCode FirstRow(TS ts, const std::vector<char> &mark, PetscInt *row)
{
  PetscFunctionBegin;
  PetscCall(FirstWhere([&](PetscInt i, PetscScalar) { return (size_t)i < mark.size() && mark[(size_t)i]; }, row, Read(ts->vec_sol)));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* An error if there is one */
PetscErrorCode RefuseMarked(TS ts, const std::vector<char> &mark, PetscErrorCode code, const char before[], const char after[])
{
  PetscInt row;
  RowLabel label;

  PetscFunctionBegin;
  PetscCall(FirstRow(ts, mark, &row));
  PetscCall(LabelRow(ts, row, &label));
  PetscCheck(row < 0, PetscObjectComm((PetscObject)ts), code, "%s %s %s", before, label.text, after);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Rows of constraints must not depend on accelerations, holonomic ones not on velocities, and no row on derivatives of an unknown that by its role has none: the row that belongs to it may be
   the only one that tells (Roles.NamedAgainstTheirRows). Which they are said to be, which they are by what they depend on. */
PetscErrorCode RefuseRates(TS ts, Dependence &d)
{
  Integrator       &I = Get(ts);
  const std::size_t n = I.role.size();
  std::vector<char> velocity(n, 0), acceleration(n, 0), first(n, 0), second(n, 0);

  PetscFunctionBegin;
  PetscCall(d.vary(d.V, [&](PetscInt i) { return IsDifferential(RoleOf(I, i)); }, [&](PetscInt i) { velocity[i] = RoleOf(I, i) == TSHHT3_HOLONOMIC; }));
  PetscCall(d.vary(d.A, [&](PetscInt i) { return IsCoordinate(I, i); }, [&](PetscInt i) { acceleration[i] = IsConstraint(I, i); }));
  PetscCall(d.vary(d.V, [&](PetscInt i) { return !IsDifferential(RoleOf(I, i)); }, [&](PetscInt i) { first[i] = 1; }));
  PetscCall(d.vary(d.A, [&](PetscInt i) { return !IsCoordinate(I, i); }, [&](PetscInt i) { second[i] = 1; }));
  PetscCall(RefuseMarked(ts, acceleration, PETSC_ERR_ARG_WRONG, "Row",
                   "is that of a constraint by TSHHT3SetIS(), but depends on accelerations, which a constraint does not: integrate it, or name its unknown TSHHT3_VARIABLE if the row defines it"));
  PetscCall(RefuseMarked(ts, velocity, PETSC_ERR_ARG_WRONG, "Row", "is that of a holonomic constraint by TSHHT3SetIS(), but depends on velocities: name its multiplier TSHHT3_NONHOLONOMIC"));
  PetscCall(RefuseMarked(ts, second, PETSC_ERR_ARG_WRONG, "Row", "depends on the second derivative of an unknown that is no coordinate by TSHHT3SetIS(): its own one, or another one, is to be named TSHHT3_COORDINATE"));
  PetscCall(RefuseMarked(ts, first, PETSC_ERR_ARG_WRONG, "Row",
                   "depends on the first derivative of an unknown that is neither a coordinate nor a first-order state by TSHHT3SetIS(): its own one, or another one, is to be named TSHHT3_STATE or TSHHT3_COORDINATE"));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode RefuseHolonomic(TS ts, Dependence &d)
{
  Integrator       &I = Get(ts);
  std::vector<char> bad(I.role.size(), 0);

  PetscFunctionBegin;
  if (!I.count[TSHHT3_HOLONOMIC]) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(d.vary(d.U, [&](PetscInt i) { return IsDefined(I, i) || RoleOf(I, i) == TSHHT3_STATE; }, [&](PetscInt i) { if (RoleOf(I, i) == TSHHT3_HOLONOMIC) bad[i] = 1; }));
  PetscCall(RefuseMarked(ts, bad, PETSC_ERR_SUP, "The holonomic constraint of row",
                   "depends on a first-order state, a user-defined variable or a force state; constraints of positions are Phi(q,t) = 0. "
                   "Make it a coordinate without mass, with its equation as one more constraint"));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Definitions that change with q', q'' or multipliers, directly or by others, must not stand in a constraint of velocities */
PetscErrorCode RefuseFast(TS ts, Dependence &d)
{
  Integrator       &I = Get(ts);
  std::vector<char> fast(I.role.size(), 0), bad(I.role.size(), 0);
  const auto        defined = [&](PetscInt i) { if (IsDefined(I, i)) fast[i] = 1; };
  PetscInt          before = -1, now = 0;

  PetscFunctionBegin;
  PetscCall(d.vary(d.V, [&](PetscInt i) { return IsDifferential(RoleOf(I, i)); }, defined));
  PetscCall(d.vary(d.A, [&](PetscInt i) { return IsCoordinate(I, i); }, defined));
  PetscCall(d.vary(d.U, [&](PetscInt i) { return IsConstraint(I, i); }, defined));
  while (now != before) {
    before = now;
    PetscCall(d.vary(
      d.U, [&](PetscInt i) { return fast[i] != 0; },
      [&](PetscInt i) {
        defined(i);
        if (RoleOf(I, i) == TSHHT3_NONHOLONOMIC) bad[i] = 1;
      }));
    now = 0;
    for (char f : fast) now += f;
    PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &now, 1, MPIU_INT, MPI_SUM, PetscObjectComm((PetscObject)ts)));
  }
  PetscCall(RefuseMarked(ts, bad, PETSC_ERR_SUP, "The velocity-level constraint of row",
                   "depends on a variable or force state that itself depends on velocities, accelerations or multipliers. Write these velocities into the row instead"));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Sweeps of V - (V - v(...)) lead to the definitions, unless these are written with another factor */
PetscErrorCode CheckSweeps(TS ts, Dependence &d)
{
  Integrator       &I = Get(ts);
  std::vector<char> bad(I.role.size(), 0);

  PetscFunctionBegin;
  PetscCall(VecCopy(d.U, d.moved));
  PetscCall(ResidualAlong(ts, ts->ptime, d.moved, d.V, d.A, d.other));
  PetscCall(ForEntries([&](PetscInt i, PetscScalar u, PetscScalar f) { if (IsDefined(I, i) && PetscAbsScalar(f) > 1e-8 * (1 + PetscAbsScalar(u))) bad[i] = 1; }, Read(d.moved), Read(d.other)));
  PetscCall(RefuseMarked(ts, bad, PETSC_ERR_SUP, "Row",
                   "defines a variable or force state, some of which stand in velocity-level constraints, but not as V - v(...) = 0, from which its value could be taken: divide the row by the factor of V"));
  PetscFunctionReturn(PETSC_SUCCESS);
}

} // namespace

PetscErrorCode CheckDependence(TS ts)
{
  Integrator            &I     = Get(ts);
  const TSHHT3Statistics saved = I.stat;
  const PetscInt         defined = I.count[TSHHT3_VARIABLE] + I.count[TSHHT3_FORCE];
  Dependence             d(ts);
  std::vector<char>      uses(I.role.size(), 0);
  PetscInt               row = -1;

  PetscFunctionBegin;
  I.follow = PETSC_FALSE;
  if (I.coordinatesAlone() || (!I.is_set && (!I.constraints() || defined + I.count[TSHHT3_STATE] == 0))) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(d.begin());
  if (I.is_set) PetscCall(RefuseRates(ts, d));
  if (!I.constraints()) {
    I.stat = saved;
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  if (defined + I.count[TSHHT3_STATE]) PetscCall(RefuseHolonomic(ts, d));
  if (defined && I.count[TSHHT3_NONHOLONOMIC]) {
    PetscCall(d.vary(d.U, [&](PetscInt i) { return IsDefined(I, i); }, [&](PetscInt i) { if (RoleOf(I, i) == TSHHT3_NONHOLONOMIC) uses[i] = 1; }));
    PetscCall(FirstRow(ts, uses, &row));
  }
  if (row >= 0) {
    PetscCall(RefuseFast(ts, d));
    I.follow = PETSC_TRUE;
    PetscCall(CheckSweeps(ts, d));
    PetscCall(PetscInfo(ts, "velocity-level constraints depend on variables, first in row %" PetscInt_FMT ": these follow their definitions where constraints are differentiated\n", row));
  }
  I.stat = saved; /* no part of the run */
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode ResidualAlong(TS ts, PetscReal t, Vec U, Vec V, Vec A, Vec F)
{
  Integrator &I = Get(ts);
  bool        moved;

  PetscFunctionBegin;
  PetscCall(EvaluateResidual(ts, t, U, V, A, F));
  for (int sweep = 0; I.follow && sweep < max_sweeps; sweep++) {
    moved = false;
    PetscCall(ForEntries(
      [&](PetscInt i, PetscScalar &u, PetscScalar f) {
        if (!IsDefined(I, i) || !(PetscAbsScalar(f) > 2 * PETSC_MACHINE_EPSILON * PetscAbsScalar(u))) return;
        u -= f;
        moved = true;
      },
      Write(U), Read(F)));
    PetscCall(OnAnyRank(ts, moved, &moved));
    if (!moved) break;
    PetscCall(EvaluateResidual(ts, t, U, V, A, F));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

} // namespace hht3
