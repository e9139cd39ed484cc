/*
  Roles of unknowns and rows: set by the application, or read off dF/dU, dF/dU', dF/dU'' at the start.

  An unknown whose second derivative enters anywhere is a coordinate; one whose first derivative does is a first-order state;
  the others are algebraic. Row i belongs to unknown i: the row of an algebraic unknown that depends on it (or on q'')
  defines it; one that does not is a constraint, velocity-level if it depends on q'.

  The three matrices come from the application's Jacobian with shifts so large that a term with the shift cannot hide behind
  one without: an entry belongs to dF/dU'' if doubling sigma_a changes it. Two states are probed, the initial one and one
  moved off it, since at rest or in a symmetric position entries may vanish that are there otherwise.
*/
#include "integrator/entries.h"
#include "equations.h"
#include "jacobian.h"
#include "integrator/random.h"
#include "roles.h"
#include "rows.h"
#include "integrator/work_vec.h"

namespace hht3
{

namespace
{

constexpr PetscReal probe_shift = 1e20; /* shift of the probes */

struct Probe {
  std::vector<unsigned char> col_a, col_v, row_a, row_v, row_u, self; /* per local unknown or row */
  PetscBool                  triangle = PETSC_FALSE; /* the matrix is MATSBAIJ: an entry (i, j) stands for (j, i) too */
  explicit Probe(PetscInt n) : col_a(n), col_v(n), row_a(n), row_v(n), row_u(n), self(n) {}
};

bool DoublesWithShift(PetscScalar one, PetscScalar two) { return PetscAbsScalar(two - one) > 1e-10 * PetscMax(PetscAbsScalar(one), PetscAbsScalar(two)); }

/* Flags of the local unknowns that a vector marks with positive entries */
PetscErrorCode TakeMarks(Vec mark, std::vector<unsigned char> &flag)
{
  PetscFunctionBegin;
  PetscCall(VecAssemblyBegin(mark));
  PetscCall(VecAssemblyEnd(mark));
  PetscCall(ForEntries([&](PetscInt i, PetscScalar m) { if (PetscRealPart(m) > 0) flag[i] = 1; }, Read(mark)));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Marks rows and columns where the derivative that goes with one shift is not zero */
PetscErrorCode ProbeShift(TS ts, Mat J, Mat P, Vec U, Vec V, Vec A, bool acceleration, Probe &probe)
{
  std::vector<PetscScalar>    one, two;
  std::vector<PetscInt>       col, offset, col2, offset2;
  std::vector<unsigned char> &row_flag = acceleration ? probe.row_a : probe.row_v, &col_flag = acceleration ? probe.col_a : probe.col_v;
  const PetscReal             t = ts->ptime;
  WorkVec                     mark;
  PetscInt                    start;

  PetscFunctionBegin;
  PetscCall(EvaluateJacobian(ts, t, U, V, A, acceleration ? 0 : probe_shift, acceleration ? probe_shift : 0, J, P));
  PetscCall(LocalValues(P, probe.triangle, one, col, offset));
  PetscCall(EvaluateJacobian(ts, t, U, V, A, acceleration ? 0 : 2 * probe_shift, acceleration ? 2 * probe_shift : 0, J, P));
  PetscCall(LocalValues(P, probe.triangle, two, col2, offset2));
  PetscCheck(col == col2, PETSC_COMM_SELF, PETSC_ERR_ARG_WRONG, "The nonzero pattern of the Jacobian changes from call to call; insert explicit zeros, or set the roles by TSHHT3SetIS()");
  PetscCall(mark.like(U));
  PetscCall(VecGetOwnershipRange(U, &start, NULL));
  for (size_t i = 0; i < row_flag.size(); i++) {
    for (PetscInt k = offset[i]; k < offset[i + 1]; k++) {
      if (!DoublesWithShift(one[k], two[k])) continue;
      row_flag[i] = 1;
      PetscCall(VecSetValue(mark, col[k], 1, ADD_VALUES));
      if (probe.triangle) PetscCall(VecSetValue(mark, start + (PetscInt)i, 1, ADD_VALUES));
    }
  }
  PetscCall(TakeMarks(mark, col_flag));
  if (probe.triangle) row_flag = col_flag;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode ProbeState(TS ts, Mat J, Mat P, Vec U, Vec V, Vec A, Probe &probe)
{
  std::vector<PetscScalar> val;
  std::vector<PetscInt>    col, offset;
  PetscInt                 start;
  WorkVec                  mark;

  PetscFunctionBegin;
  PetscCall(ProbeShift(ts, J, P, U, V, A, true, probe));
  PetscCall(ProbeShift(ts, J, P, U, V, A, false, probe));
  PetscCall(EvaluateJacobian(ts, ts->ptime, U, V, A, 0, 0, J, P));
  PetscCall(LocalValues(P, probe.triangle, val, col, offset));
  PetscCall(VecGetOwnershipRange(U, &start, NULL));
  PetscCall(mark.like(U));
  for (size_t i = 0; i < probe.row_u.size(); i++)
    for (PetscInt k = offset[i]; k < offset[i + 1]; k++) {
      if (val[k] == (PetscScalar)0) continue;
      probe.row_u[i] = 1;
      if (probe.triangle) PetscCall(VecSetValue(mark, col[k], 1, ADD_VALUES));
      if (col[k] == start + (PetscInt)i) probe.self[i] = 1;
    }
  PetscCall(TakeMarks(mark, probe.row_u));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* One triangle does not show whether the rows of multipliers depend on q': the residual does, with U and A as they are */
PetscErrorCode ProbeRates(TS ts, Vec U, Vec V, Vec A, Probe &probe)
{
  WorkVec F[2];

  PetscFunctionBegin;
  for (int k = 0; k < 2; k++) {
    PetscCall(F[k].like(U));
    PetscCall(EvaluateResidual(ts, ts->ptime, U, V, A, F[k]));
    if (!k) PetscCall(Shake(V, 1e-3, 4));
  }
  PetscCall(ForEntries([&](PetscInt i, PetscScalar before, PetscScalar after) { if (before != after) probe.row_v[i] = 1; }, Read(F[0]), Read(F[1])));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode RunProbes(TS ts, Probe &probe)
{
  Integrator            &I = Get(ts);
  const TSHHT3Statistics saved = I.stat;
  Mat                    J, P;

  PetscFunctionBegin;
  PetscCall(SNESGetJacobian(ts->snes, &J, &P, NULL, NULL));
  PetscCall(LinearStoresTriangle(P, &probe.triangle));
  PetscCall(VecCopy(ts->vec_sol, I.U1));
  PetscCall(VecCopy(ts->vec_dot, I.V1));
  PetscCall(VecZeroEntries(I.A1));
  PetscCall(ProbeState(ts, J, P, I.U1, I.V1, I.A1, probe));
  PetscCall(RefuseBadMatrix(ts, P)); /* roles read from it would be wrong ones */
  PetscCall(StateOffStart(ts, 1, 0, I.U1, I.V1, I.A1));
  PetscCall(ProbeState(ts, J, P, I.U1, I.V1, I.A1, probe));
  if (probe.triangle) PetscCall(ProbeRates(ts, I.U1, I.V1, I.A1, probe));
  I.stat = saved; /* the probes are not part of the run */
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode DetectRoles(TS ts, const Probe &p)
{
  Integrator &I = Get(ts);
  PetscInt    start;
  RowLabel    label;

  PetscFunctionBegin;
  PetscCall(VecGetOwnershipRange(ts->vec_sol, &start, NULL));
  for (size_t i = 0; i < I.role.size(); i++) {
    const bool empty = !p.row_a[i] && !p.row_v[i] && !p.row_u[i], misplaced = p.col_a[i] && !p.row_a[i];
    if (empty || misplaced) PetscCall(LabelRow(ts, start + (PetscInt)i, &label));
    PetscCheck(!empty, PETSC_COMM_SELF, PETSC_ERR_ARG_WRONG, "Row %s of the residual depends on no unknown", label.text);
    PetscCheck(!misplaced, PETSC_COMM_SELF, PETSC_ERR_ARG_WRONG,
               "Unknown %s has inertia, but its row of the residual contains no acceleration: row i must be the equation that belongs to unknown i", label.text);
    if (p.col_a[i]) I.role[i] = TSHHT3_COORDINATE;
    else if (p.col_v[i]) I.role[i] = TSHHT3_STATE;
    else if (p.self[i] || p.row_a[i]) I.role[i] = TSHHT3_VARIABLE;
    else I.role[i] = p.row_v[i] ? TSHHT3_NONHOLONOMIC : TSHHT3_HOLONOMIC;
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Roles from the application's index sets */
PetscErrorCode TakeSets(TS ts)
{
  Integrator                &I = Get(ts);
  const PetscInt            *index;
  PetscInt                   start, end, n;
  std::vector<PetscInt>      set; /* a copy: an error would leave indices of the IS behind */
  std::vector<unsigned char> taken(I.role.size(), 0);

  PetscFunctionBegin;
  PetscCall(VecGetOwnershipRange(ts->vec_sol, &start, &end));
  for (int r = 0; r < TSHHT3_NUM_ROLES; r++) {
    if (!I.is[r]) continue;
    PetscCall(ISGetLocalSize(I.is[r], &n));
    PetscCall(ISGetIndices(I.is[r], &index));
    set.assign(index, index + n);
    PetscCall(ISRestoreIndices(I.is[r], &index));
    for (PetscInt i : set) {
      PetscCheck(i >= start && i < end, PETSC_COMM_SELF, PETSC_ERR_ARG_OUTOFRANGE, "Index %" PetscInt_FMT " of role \"%s\" is not among the unknowns %" PetscInt_FMT "..%" PetscInt_FMT " of its rank", i, TSHHT3Roles[r], start, end - 1);
      PetscCheck(!taken[i - start], PETSC_COMM_SELF, PETSC_ERR_ARG_WRONG, "Unknown %" PetscInt_FMT " is named twice, as \"%s\" and as \"%s\"", i, TSHHT3Roles[I.role[i - start]], TSHHT3Roles[r]);
      taken[i - start]  = 1;
      I.role[i - start] = (unsigned char)r;
    }
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Those that were detected, and coordinates that nobody has named among roles that were */
PetscErrorCode MakeSets(TS ts)
{
  Integrator &I = Get(ts);
  PetscInt    start;

  PetscFunctionBegin;
  PetscCall(VecGetOwnershipRange(ts->vec_sol, &start, NULL));
  for (int r = 0; r < TSHHT3_NUM_ROLES; r++) {
    if (!I.count[r] || (I.is_set && (r != TSHHT3_COORDINATE || I.is[r]))) continue;
    I.made_coordinates = I.is_set;
    std::vector<PetscInt> index;
    for (size_t i = 0; i < I.role.size(); i++)
      if (I.role[i] == r) index.push_back(start + (PetscInt)i);
    PetscCall(ISDestroy(&I.is[r]));
    PetscCall(ISCreateGeneral(PetscObjectComm((PetscObject)ts), (PetscInt)index.size(), index.data(), PETSC_COPY_VALUES, &I.is[r]));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

} // namespace

PetscErrorCode SetUpRoles(TS ts)
{
  Integrator &I = Get(ts);
  PetscInt    n, local[TSHHT3_NUM_ROLES + 1] = {}, global[TSHHT3_NUM_ROLES + 1];
  bool        probed = false;

  PetscFunctionBegin;
  PetscCall(VecGetLocalSize(ts->vec_sol, &n));
  I.role.assign(n, TSHHT3_COORDINATE);
  Probe probe(n);
  if (I.is_set) PetscCall(TakeSets(ts));
  if (!I.is_set || I.form == TSHHT3_FORM_PAPER) {
    PetscCall(RunProbes(ts, probe));
    probed = true;
  }
  if (!I.is_set) PetscCall(DetectRoles(ts, probe));
  for (PetscInt i = 0; i < n; i++) {
    local[I.role[i]]++;
    if (probed && I.role[i] != TSHHT3_COORDINATE && probe.row_a[i]) local[TSHHT3_NUM_ROLES]++;
  }
  PetscCallMPI(MPI_Allreduce(local, global, TSHHT3_NUM_ROLES + 1, MPIU_INT, MPI_SUM, PetscObjectComm((PetscObject)ts)));
  for (int r = 0; r < TSHHT3_NUM_ROLES; r++) I.count[r] = global[r];
  I.definitions_use_acceleration = (PetscBool)(global[TSHHT3_NUM_ROLES] > 0);
  PetscCall(MakeSets(ts));
  PetscCall(CheckTriangle(ts));
  PetscCall(VecGetSize(ts->vec_sol, &n));
  if (I.count[TSHHT3_COORDINATE] == n) I.role = std::vector<unsigned char>(); /* an ODE: no roles to look up */
  I.moves.resize(I.role.size());
  I.states.clear();
  I.constrained.clear();
  for (size_t i = 0; i < I.role.size(); i++) {
    I.moves[i] = I.role[i] == TSHHT3_COORDINATE ? 1 : 0;
    if (I.role[i] == TSHHT3_STATE) I.states.push_back((PetscInt)i);
    if (IsConstraint(I, (PetscInt)i)) I.constrained.push_back((PetscInt)i);
  }
  PetscCall(PetscInfo(ts, "roles %s: %" PetscInt_FMT " coordinates, %" PetscInt_FMT " states, %" PetscInt_FMT " holonomic, %" PetscInt_FMT " velocity-level constraints, %" PetscInt_FMT " variables, %" PetscInt_FMT " force states\n",
                      I.is_set ? "set" : "detected", I.count[0], I.count[1], I.count[2], I.count[3], I.count[4], I.count[5]));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode ViewRoles(TS ts, PetscViewer viewer)
{
  Integrator              &I = Get(ts);
  static const char *const names[] = {"coordinates", "first-order states", "holonomic constraints", "velocity-level constraints", "user-defined variables", "force states"};
  bool                     any = false;

  PetscFunctionBegin;
  PetscCall(PetscViewerASCIIPrintf(viewer, "unknowns (%s):", I.is_set ? "roles set by the application" : "roles detected"));
  PetscCall(PetscViewerASCIIUseTabs(viewer, PETSC_FALSE));
  for (int r = 0; r < TSHHT3_NUM_ROLES; r++)
    if (I.count[r]) PetscCall(PetscViewerASCIIPrintf(viewer, " %" PetscInt_FMT " %s", I.count[r], names[r]));
  PetscCall(PetscViewerASCIIPrintf(viewer, "; left out:"));
  for (int r = 0; r < TSHHT3_NUM_ROLES; r++)
    if (!I.count[r]) {
      PetscCall(PetscViewerASCIIPrintf(viewer, "%s %s", any ? "," : "", names[r]));
      any = true;
    }
  PetscCall(PetscViewerASCIIPrintf(viewer, "%s\n", any ? "" : " nothing"));
  PetscCall(PetscViewerASCIIUseTabs(viewer, PETSC_TRUE));
  PetscFunctionReturn(PETSC_SUCCESS);
}

} // namespace hht3
