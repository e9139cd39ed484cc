/*
  A Jacobian from differences of the residual, for applications that give none: dF/dU, dF/dU' and dF/dU'' apart, each in its
  own scale and by MatFDColoring, then combined with the shifts. The pattern is the DM's matrix or is found by moving one
  unknown at a time, which takes as many evaluations as there are unknowns; both are said with -info.
*/
#include "integrator/entries.h"
#include "equations.h"
#include "jacobian.h"
#include "integrator/random.h"
#include "rows.h"
#include "integrator/work_vec.h"
#include <algorithm>
#include <cstdint>

namespace hht3
{

struct Differences {
  MatFDColoring coloring = nullptr;
  Mat           part     = nullptr; /* the colored matrix: dF/dU, dF/dU' or dF/dU'' */
  TS            ts       = nullptr;
  /* where the residual is evaluated, and which of the three vectors varies */
  PetscReal t = 0;
  Vec       at[3] = {};
  int       which = 0;
  PetscReal size = 1; /* steps in U'' are no smaller than for accelerations of this size */
  /* the user's, in place of ours; 0: none is given */
  PetscReal relative = 0, least = 0;
};

namespace
{

/* Of U, U', U''. F is affine in q'' but for definitions that need not be, and small entries of M must show beside forces */
constexpr PetscReal relative_step[3] = {1.5e-8, 1.5e-8, 1e-4};

PetscErrorCode EvaluateProbe(void *, Vec x, Vec F, void *ctx)
{
  Differences *d = (Differences *)ctx;
  Vec          v[3] = {d->at[0], d->at[1], d->at[2]};

  PetscFunctionBegin;
  v[d->which] = x;
  PetscCall(EvaluateResidual(d->ts, d->t, v[0], v[1], v[2], F));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A state off the initial one */
PetscErrorCode StateOffTheStart(TS ts, WorkVec (&x)[3])
{
  PetscFunctionBegin;
  for (WorkVec &v : x) PetscCall(v.like(ts->vec_sol));
  PetscCall(StateOffStart(ts, 21, 0.1, x[0], x[1], x[2]));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* An entry for another one, which comes back: residuals are compared to the last bit, so that a state has to be the same again to the last bit */
PetscErrorCode ExchangeEntry(Vec v, PetscInt i, PetscScalar *other)
{
  PetscScalar *x;

  PetscFunctionBegin;
  PetscCall(VecGetArray(v, &x));
  std::swap(x[i], *other);
  PetscCall(VecRestoreArray(v, &x));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The residual at x with some of U_j, U'_j, U''_j moved by d on the rank that has them */
PetscErrorCode ResidualMoved(TS ts, WorkVec (&x)[3], PetscInt j, PetscReal d, std::initializer_list<int> which, Vec F)
{
  PetscInt    start, end;
  PetscScalar other[3] = {};

  PetscFunctionBegin;
  PetscCall(VecGetOwnershipRange(ts->vec_sol, &start, &end));
  const bool here = j >= start && j < end;
  for (int k : which) {
    if (!here) continue;
    PetscCall(VecGetValues(x[k], 1, &j, &other[k]));
    other[k] += d;
    PetscCall(ExchangeEntry(x[k], j - start, &other[k]));
  }
  PetscCall(EvaluateResidual(ts, ts->ptime, x[0], x[1], x[2], F));
  if (here)
    for (int k : which) PetscCall(ExchangeEntry(x[k], j - start, &other[k]));
  PetscFunctionReturn(PETSC_SUCCESS);
}

constexpr PetscReal move_of_probe   = 1e-3;
constexpr PetscReal large_positions = 1e3;  /* in whatever unit: squares of them have the rounding of small moves (Differences.LargePositions) */
constexpr PetscReal hardly_seen     = 1e-9; /* of the largest force: a multiplier that changes rows by less may be lost in their rounding (Differences.MultipliersBesideLargeForces) */

/* Moves U_j, U'_j, U''_j at once, one j after another, by so much of scale_j, and adds the rows that change. most: the largest change of any row */
PetscErrorCode AddPattern(TS ts, WorkVec (&x)[3], const std::vector<PetscReal> &scale, std::vector<std::vector<PetscInt>> &rows, std::vector<PetscReal> *most)
{
  WorkVec        F0, F;
  const PetscInt N = (PetscInt)scale.size();
  PetscInt       start;

  PetscFunctionBegin;
  PetscCall(VecGetOwnershipRange(ts->vec_sol, &start, NULL));
  PetscCall(F0.like(ts->vec_sol));
  PetscCall(F.like(ts->vec_sol));
  PetscCall(EvaluateResidual(ts, ts->ptime, x[0], x[1], x[2], F0));
  most->assign(N, 0);
  for (PetscInt j = 0; j < N; j++) {
    PetscCall(ResidualMoved(ts, x, j, move_of_probe * scale[j], {0, 1, 2}, F));
    PetscCall(ForEntries(
      [&](PetscInt i, PetscScalar f0, PetscScalar f) {
        if (f0 != f || start + i == j) rows[i].push_back(j);
        (*most)[j] = PetscMax((*most)[j], PetscAbsScalar(f - f0));
      },
      Read(F0), Read(F)));
  }
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, most->data(), (PetscMPIInt)N, MPIU_REAL, MPIU_MAX, PetscObjectComm((PetscObject)ts)));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Whether neither U'_j nor U''_j moves any row: the unknown is algebraic, as multipliers are */
PetscErrorCode IsAlgebraic(TS ts, WorkVec (&x)[3], PetscInt j, Vec F0, bool *yes)
{
  WorkVec   F;
  PetscBool same;

  PetscFunctionBegin;
  PetscCall(F.like(F0));
  PetscCall(ResidualMoved(ts, x, j, 1, {1, 2}, F));
  PetscCall(VecEqual(F0, F, &same));
  *yes = same;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The largest initial value of an unknown that is not algebraic: multipliers may be guessed as large as forces are */
PetscErrorCode SizeOfPositions(TS ts, WorkVec (&x)[3], Vec F0, PetscReal *size)
{
  std::vector<PetscReal> value;
  PetscInt               N, start;
  bool                   algebraic = false;

  PetscFunctionBegin;
  PetscCall(VecGetSize(ts->vec_sol, &N));
  PetscCall(VecGetOwnershipRange(ts->vec_sol, &start, NULL));
  value.assign(N, 0);
  PetscCall(ForEntries([&](PetscInt i, PetscScalar u) { value[start + i] = PetscAbsScalar(u); }, Read(ts->vec_sol)));
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, value.data(), (PetscMPIInt)N, MPIU_REAL, MPIU_MAX, PetscObjectComm((PetscObject)ts)));
  *size = 1;
  for (PetscInt j = 0; j < N; j++) {
    if (!(value[j] > PetscMax(large_positions, *size))) continue;
    PetscCall(IsAlgebraic(ts, x, j, F0, &algebraic));
    if (!algebraic) *size = value[j];
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Where probes of the size of one lose products in rounding: multipliers get the size of the forces, and where positions are large all unknowns get their size. Base values
   are moved, too. */
PetscErrorCode SizesOfProbes(TS ts, WorkVec (&x)[3], const std::vector<PetscReal> &most, std::vector<PetscReal> *scale, bool *larger)
{
  const PetscInt N = (PetscInt)scale->size();
  PetscInt       start;
  PetscReal      force, size;
  WorkVec        F0;
  bool           algebraic = false;

  PetscFunctionBegin;
  PetscCall(VecGetOwnershipRange(ts->vec_sol, &start, NULL));
  PetscCall(F0.like(ts->vec_sol));
  PetscCall(EvaluateResidual(ts, ts->ptime, x[0], x[1], x[2], F0));
  PetscCall(VecNorm(F0, NORM_INFINITY, &force));
  PetscCall(SizeOfPositions(ts, x, F0, &size));
  *larger = size > 1;
  scale->assign(N, size);
  for (PetscInt j = 0; j < N; j++) {
    if (!(most[j] > 0 && most[j] < hardly_seen * force && force < PETSC_MAX_REAL)) continue;
    PetscCall(IsAlgebraic(ts, x, j, F0, &algebraic));
    if (!algebraic) continue;
    (*scale)[j] = PetscMax(size, force / most[j]);
    *larger     = true;
  }
  PetscCall(ForEntries([&](PetscInt i, PetscScalar &u) { if ((*scale)[start + i] > 1) u += move_of_probe * (*scale)[start + i] * RandomNumber(start + i, 24); }, Write(x[0])));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The rows that change with each unknown */
PetscErrorCode FindPattern(TS ts, std::vector<std::vector<PetscInt>> &rows)
{
  WorkVec                x[3];
  PetscInt               N, n;
  std::vector<PetscReal> scale, most;
  bool                   larger = false;

  PetscFunctionBegin;
  PetscCall(VecGetSize(ts->vec_sol, &N));
  PetscCall(VecGetLocalSize(ts->vec_sol, &n));
  PetscCall(StateOffTheStart(ts, x));
  rows.assign(n, {});
  scale.assign(N, 1);
  PetscCall(AddPattern(ts, x, scale, rows, &most));
  PetscCall(SizesOfProbes(ts, x, most, &scale, &larger));
  if (!larger) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(AddPattern(ts, x, scale, rows, &most));
  for (std::vector<PetscInt> &row : rows) {
    std::sort(row.begin(), row.end());
    row.erase(std::unique(row.begin(), row.end()), row.end());
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode CreateMatrix(TS ts, Mat *P)
{
  std::vector<std::vector<PetscInt>> rows;
  PetscInt                           n, N, start, end;

  PetscFunctionBegin;
  PetscCall(FindPattern(ts, rows));
  PetscCall(VecGetSize(ts->vec_sol, &N));
  PetscCall(VecGetLocalSize(ts->vec_sol, &n));
  PetscCall(VecGetOwnershipRange(ts->vec_sol, &start, &end));
  std::vector<PetscInt> diag(n, 0), off(n, 0);
  for (PetscInt i = 0; i < n; i++)
    for (PetscInt j : rows[i]) (j >= start && j < end ? diag : off)[i]++;
  PetscCall(MatCreateAIJ(PetscObjectComm((PetscObject)ts), n, n, N, N, 0, diag.data(), 0, off.data(), P));
  for (PetscInt i = 0; i < n; i++) {
    const PetscInt               row = start + i;
    const std::vector<PetscScalar> ones(rows[i].size(), 1);
    PetscCall(MatSetValues(*P, 1, &row, (PetscInt)rows[i].size(), rows[i].data(), ones.data(), INSERT_VALUES));
  }
  PetscCall(MatAssemblyBegin(*P, MAT_FINAL_ASSEMBLY));
  PetscCall(MatAssemblyEnd(*P, MAT_FINAL_ASSEMBLY));
  PetscCall(PetscInfo(ts, "no I2Jacobian: pattern of the matrix found by %" PetscInt_FMT " evaluations of the residual\n", N + 1));
  PetscFunctionReturn(PETSC_SUCCESS);
}

constexpr int color_halvings = 4; /* of each color: of two of its unknowns that a row follows one is alone in some half, but for a sixteenth of the pairs */

/* A half of the unknowns, another one for each bit */
bool InHalf(PetscInt index, int half) { return ((uint32_t)index * 2654435761u >> (31 - half / 2) & 1) == (uint32_t)(half % 2); }

/* The first row that follows unknowns of this half of a color though the pattern has none of them there; -1: none */
PetscErrorCode RowBeside(TS ts, Mat ones, IS color, int half, const WorkVec (&x)[3], Vec F0, PetscInt *row)
{
  WorkVec         moved[3], mark, F, places;
  const PetscInt *index;
  PetscInt        n;

  PetscFunctionBegin;
  for (WorkVec *v : {&mark, &F, &places}) PetscCall(v->like(F0));
  PetscCall(ISGetLocalSize(color, &n));
  PetscCall(ISGetIndices(color, &index));
  for (PetscInt k = 0; k < n; k++)
    if (InHalf(index[k], half)) PetscCall(VecSetValue(mark, index[k], 1, INSERT_VALUES));
  PetscCall(ISRestoreIndices(color, &index));
  PetscCall(VecAssemblyBegin(mark));
  PetscCall(VecAssemblyEnd(mark));
  for (int k = 0; k < 3; k++) {
    PetscCall(moved[k].like(F0));
    PetscCall(VecWAXPY(moved[k], 1e-3, mark, x[k]));
  }
  PetscCall(EvaluateResidual(ts, ts->ptime, moved[0], moved[1], moved[2], F));
  PetscCall(MatMult(ones, mark, places));
  PetscCall(FirstWhere(
    [](PetscInt, PetscScalar place, PetscScalar f, PetscScalar f0) {
      return place == 0. && PetscAbsScalar(f - f0) > 1e-12 * (PetscAbsScalar(f) + PetscAbsScalar(f0)); /* sums over all may round otherwise */
    },
    row, Read(places), Read(F), Read(F0)));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A matrix that comes from elsewhere may have no place for some derivatives: differences by colors put them in others' places, and roles are read from those */
PetscErrorCode CheckPattern(TS ts, Mat ones, ISColoring colors)
{
  PetscInt n, row = -1;
  IS      *color;
  RowLabel label;
  WorkVec  x[3], F0;

  PetscFunctionBegin;
  PetscCall(StateOffTheStart(ts, x));
  PetscCall(F0.like(ts->vec_sol));
  PetscCall(EvaluateResidual(ts, ts->ptime, x[0], x[1], x[2], F0));
  PetscCall(ISColoringGetIS(colors, PETSC_USE_POINTER, &n, &color));
  for (PetscInt c = 0; c < n; c++)
    for (int half = 0; half < 2 * color_halvings && row < 0; half++) PetscCall(RowBeside(ts, ones, color[c], half, x, F0, &row));
  PetscCall(ISColoringRestoreIS(colors, PETSC_USE_POINTER, &color));
  if (row < 0) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(LabelRow(ts, row, &label));
  PetscCheck(Get(ts).is_set, PetscObjectComm((PetscObject)ts), PETSC_ERR_ARG_WRONG,
             "The matrix for differences of the residual (the DM's, or yours) has no place for derivatives of row %s"
             ", so that the roles of unknowns cannot be read from it. Use -snes_fd, which finds all places, give a matrix that has them (TSSetI2Jacobian()), or set the roles (TSHHT3SetIS())", label.text);
  PetscCall(PetscPrintf(PetscObjectComm((PetscObject)ts), "hhtdae: the matrix for differences of the residual (the DM's, or yours) has no place for derivatives of row %s: it is an approximation; -snes_fd finds all places\n", label.text));
  PetscFunctionReturn(PETSC_SUCCESS);
}

} // namespace

/* -mat_fd_coloring_err and -mat_fd_coloring_umin, which would be lost with the scales of the three parts */
static PetscErrorCode TakeSteps(Differences *d)
{
  const PetscObject of = (PetscObject)d->coloring;

  PetscFunctionBegin;
  PetscCall(PetscOptionsGetReal(of->options, of->prefix, "-mat_fd_coloring_err", &d->relative, NULL));
  PetscCall(PetscOptionsGetReal(of->options, of->prefix, "-mat_fd_coloring_umin", &d->least, NULL));
  PetscFunctionReturn(PETSC_SUCCESS);
}

namespace
{

constexpr PetscReal visible_change     = 1e-6;  /* change of a row, relative to its value, that leaves ten digits of an inertia */
constexpr PetscReal hidden_inertia     = 1e-6;  /* of the largest inertia: what may be lost in rounding */
constexpr PetscReal size_ratio         = 1e4;   /* the next size */
constexpr PetscReal largest_size       = 1e16;

/* Whether steps in U'' of this size let no row hide an inertia behind its forces */
PetscErrorCode TrySize(TS ts, const WorkVec (&x)[3], PetscReal size, Vec F0, Vec A, Vec F, bool *enough, bool *finite)
{
  const PetscReal step   = relative_step[2] * size;
  PetscReal       max;
  bool            hidden = false;

  PetscFunctionBegin;
  PetscCall(VecCopy(x[2], A));
  PetscCall(ForEntries([&](PetscInt, PetscScalar &a) { a += step; }, Write(A)));
  PetscCall(EvaluateResidual(ts, ts->ptime, x[0], x[1], A, F));
  PetscCall(LargestOf([](PetscInt, PetscScalar f0, PetscScalar f) { return PetscIsInfOrNanScalar(f - f0) ? PETSC_MAX_REAL : PetscAbsScalar(f - f0); }, &max, Read(F0), Read(F)));
  *finite = max < PETSC_MAX_REAL;
  PetscCall(ForEntries(
    [&](PetscInt, PetscScalar f0, PetscScalar f) {
      const PetscReal d = PetscAbsScalar(f - f0), size0 = PetscAbsScalar(f0);
      if (d < visible_change * size0 && PETSC_MACHINE_EPSILON * size0 > hidden_inertia * max) hidden = true;
    },
    Read(F0), Read(F)));
  PetscCall(OnAllRanks(ts, !hidden, enough));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* F is affine in q'', so that a step may be as large as it takes for inertia to show beside large forces: a stiff coordinate whose inertia is lost would be
   taken for a variable (Differences.InertiaBesideStiffSprings) */
PetscErrorCode SizeOfAccelerations(TS ts, Differences *d)
{
  WorkVec x[3], F0, A, F;
  bool    enough = false, finite = false;

  PetscFunctionBegin;
  for (WorkVec *v : {&x[0], &x[1], &x[2], &F0, &A, &F}) PetscCall(v->like(ts->vec_sol));
  PetscCall(VecCopy(ts->vec_sol, x[0]));
  PetscCall(VecCopy(ts->vec_dot, x[1]));
  PetscCall(EvaluateResidual(ts, ts->ptime, x[0], x[1], x[2], F0));
  for (PetscReal size = 1; size <= largest_size && !enough; size *= size_ratio) { /* never enough where there is no inertia */
    PetscCall(TrySize(ts, x, size, F0, A, F, &enough, &finite));
    if (!finite) break;
    if (enough) d->size = size;
  }
  if (d->size > 1) PetscCall(PetscInfo(ts, "dF/dU'' by differences: forces are large, steps are those of accelerations of %g\n", (double)d->size));
  PetscFunctionReturn(PETSC_SUCCESS);
}

} // namespace

PetscErrorCode DifferencesCreate(TS ts, Mat *P)
{
  Integrator  &I = Get(ts);
  MatColoring  mc;
  ISColoring   colors;
  PetscBool    triangle = PETSC_FALSE, assembled = PETSC_TRUE;

  PetscFunctionBegin;
  if (*P) PetscCall(LinearStoresTriangle(*P, &triangle));
  PetscCheck(!triangle, PetscObjectComm((PetscObject)ts), PETSC_ERR_ARG_INCOMP,
             "A Jacobian from differences of the residual comes by columns, the matrix holds one triangle: use type %s, or give an I2Jacobian", MATAIJ);
  if (*P) PetscCall(MatAssembled(*P, &assembled));
  PetscCheck(assembled, PetscObjectComm((PetscObject)ts), PETSC_ERR_ORDER,
             "The matrix for differences of the residual has never been assembled, so that its places are not known: put zeros where derivatives may be and assemble it, or use -snes_fd");
  Differences *d = new Differences;
  I.differences                = d;
  const TSHHT3Statistics saved = I.stat;
  const bool             found = !*P;
  d->ts                        = ts;
  if (found) PetscCall(CreateMatrix(ts, P));
  PetscCall(MatDuplicate(*P, MAT_DO_NOT_COPY_VALUES, &d->part));
  PetscCall(MatColoringCreate(d->part, &mc));
  PetscCall(MatColoringSetDistance(mc, 2));
  PetscCall(MatColoringSetType(mc, MATCOLORINGSL));
  PetscCall(MatColoringSetFromOptions(mc));
  PetscCall(MatColoringApply(mc, &colors));
  PetscCall(MatColoringDestroy(&mc));
  PetscCall(MatFDColoringCreate(d->part, colors, &d->coloring));
  PetscCall(MatFDColoringSetFunction(d->coloring, reinterpret_cast<HHT3ColoringFunction>(reinterpret_cast<void *>(EvaluateProbe)), d));
  PetscCall(MatFDColoringSetFromOptions(d->coloring));
  PetscCall(TakeSteps(d));
  PetscCall(MatFDColoringSetUp(d->part, colors, d->coloring));
  if (!found) {
    std::vector<PetscScalar> ones;
    std::vector<PetscInt>    col, offset;
    PetscCall(LocalValues(*P, false, ones, col, offset));
    ones.assign(ones.size(), 1);
    PetscCall(SetLocalValues(d->part, ones, col, offset));
    PetscCall(CheckPattern(ts, d->part, colors));
  }
  PetscCall(SizeOfAccelerations(ts, d));
  PetscInt n;
  PetscCall(ISColoringGetColors(colors, NULL, &n, NULL));
  PetscCall(ISColoringDestroy(&colors));
  PetscCall(PetscInfo(ts, "no I2Jacobian: dF/dU, dF/dU', dF/dU'' by differences in %" PetscInt_FMT " colors\n", n));
  I.stat = saved;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode DifferencesDestroy(TS ts)
{
  Integrator &I = Get(ts);

  PetscFunctionBegin;
  if (!I.differences) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(MatFDColoringDestroy(&I.differences->coloring));
  PetscCall(MatDestroy(&I.differences->part));
  delete I.differences;
  I.differences = nullptr;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode DifferencesJacobian(TS ts, PetscReal t, Vec U, Vec V, Vec A, PetscReal sv, PetscReal sa, Mat P)
{
  Differences    *d        = Get(ts).differences;
  const PetscReal shift[3] = {1, sv, sa};
  Vec             at[3]    = {U, V, A};

  PetscFunctionBegin;
  d->t = t;
  for (int k = 0; k < 3; k++) d->at[k] = at[k];
  PetscCall(MatZeroEntries(P));
  for (d->which = 0; d->which < 3; d->which++) {
    if (shift[d->which] == 0) continue;
    PetscCall(MatZeroEntries(d->part));
    PetscCall(MatFDColoringSetParameters(d->coloring, d->relative > 0 ? d->relative : relative_step[d->which] * (d->which == 2 ? d->size : 1), d->least > 0 ? d->least : 1));
    PetscCall(MatFDColoringApply(d->part, d->coloring, at[d->which], NULL));
    PetscCall(MatAXPY(P, shift[d->which], d->part, SAME_NONZERO_PATTERN));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

} // namespace hht3
