/* The lowest modes of a body by SLEPc, with a check by inertia that no mode, as one of a multiple eigenvalue, is missing. */
#include "modes.h"
#include "hhtdae/hhtdae.h"
#include <algorithm>
#include <cmath>
#include <slepceps.h>

namespace hhtdae
{

/* Deflates the rigid modes and the modes found before */
static PetscErrorCode Deflate(const Pencil &pencil, const MatrixXd &found, EPS eps)
{
  const PetscInt   n = (PetscInt)pencil.rigid.cols(), m = (PetscInt)found.cols();
  std::vector<Vec> v(n + m);

  PetscFunctionBegin;
  if (v.empty()) PetscFunctionReturn(0);
  for (PetscInt k = 0; k < n + m; k++) {
    const double *from = k < n ? pencil.rigid.data() + k * pencil.rigid.rows() : found.data() + (k - n) * found.rows();
    PetscInt      rows;
    PetscScalar  *values;
    PetscCall(MatCreateVecs(pencil.K, &v[k], nullptr));
    PetscCall(VecGetLocalSize(v[k], &rows));
    PetscCall(VecGetArray(v[k], &values));
    std::copy_n(from, rows, values);
    PetscCall(VecRestoreArray(v[k], &values));
  }
  PetscCall(EPSSetDeflationSpace(eps, n + m, v.data()));
  for (Vec &x : v) PetscCall(VecDestroy(&x));
  PetscFunctionReturn(0);
}

/* From this number of modes on, if their frequency is bounded, the spectrum is divided among several shifts (spectrum slicing); option -reduce_slices_from */
constexpr PetscInt default_slices_from = 400;

/* Sets the number of basis vectors before a restart, unless options do; the block method needs more of them than SLEPc's own */
static PetscErrorCode SetBasisSize(PetscInt count, PetscInt most, EPS eps)
{
  PetscInt  size;
  PetscBool blocks;

  PetscFunctionBegin;
  PetscCall(EPSGetDimensions(eps, nullptr, &size, nullptr));
  if (size > 0) PetscFunctionReturn(0);
  PetscCall(PetscObjectTypeCompare((PetscObject)eps, EPS_BLOCK_KRYLOV, &blocks));
  size = std::min(most, blocks ? (PetscInt)(2.5 * count) + 40 : std::max(count + 20, (PetscInt)(1.6 * count)));
  PetscCall(EPSSetDimensions(eps, count, size, PETSC_DEFAULT));
  PetscFunctionReturn(0);
}

static PetscErrorCode SetUpEps(const Pencil &pencil, const WantedModes &wanted, PetscInt count, bool slices,
                               const MatrixXd &found, KSP *ksp, EPS *eps)
{
  ST       st;
  MPI_Comm comm = PetscObjectComm((PetscObject)pencil.K);

  PetscFunctionBegin;
  PetscCall(EPSCreate(comm, eps));
  PetscCall(EPSSetOptionsPrefix(*eps, REDUCE_PREFIX));
  PetscCall(EPSSetOperators(*eps, pencil.K, pencil.M));
  PetscCall(EPSSetProblemType(*eps, EPS_GHEP));
  /* purification, one more solve for each mode, removes components in the null space of M, which is nonzero with multipliers only */
  PetscCall(EPSSetPurify(*eps, pencil.multipliers ? PETSC_TRUE : PETSC_FALSE));
  PetscCall(RegisterBlockKrylov());
  PetscCall(EPSSetType(*eps, slices ? EPSKRYLOVSCHUR : EPS_BLOCK_KRYLOV));
  PetscCall(EPSSetTolerances(*eps, 1e-11, 200));
  PetscCall(EPSGetST(*eps, &st));
  PetscCall(STSetType(st, STSINVERT));
  if (slices) {
    KSP slice;
    PC  pc;
    PetscCall(EPSSetWhichEigenpairs(*eps, EPS_ALL));
    PetscCall(EPSSetInterval(*eps, pencil.rigid.cols() ? 1e-3 * -wanted.shift : 0., wanted.below));
    PetscCall(EPSKrylovSchurGetKSP(*eps, &slice));
    PetscCall(KSPSetType(slice, KSPPREONLY));
    PetscCall(KSPGetPC(slice, &pc));
    PetscCall(PCSetType(pc, PCCHOLESKY));
    PetscCall(PCFactorSetMatSolverType(pc, "mumpsnd"));
  } else {
    if (!*ksp) PetscCall(CreateSolver(comm, ksp));
    PetscCall(STSetKSP(st, *ksp));
    PetscCall(EPSSetDimensions(*eps, count, PETSC_DEFAULT, PETSC_DEFAULT));
    PetscCall(EPSSetTarget(*eps, wanted.shift));
    PetscCall(EPSSetWhichEigenpairs(*eps, EPS_TARGET_MAGNITUDE));
    PetscCall(Deflate(pencil, found, *eps));
  }
  PetscCall(EPSSetFromOptions(*eps));
  if (!slices) PetscCall(SetBasisSize(count, pencil.modes - (PetscInt)(pencil.rigid.cols() + found.cols()), *eps));
  PetscFunctionReturn(0);
}

/* Copies all converged eigenpairs, which SLEPc returns M-orthonormal */
static PetscErrorCode CollectModes(EPS eps, Mat K, NormalModes *modes)
{
  PetscInt    n, rows;
  Vec         x;
  PetscScalar value;

  PetscFunctionBegin;
  PetscCall(EPSGetConverged(eps, &n));
  PetscCall(MatGetLocalSize(K, &rows, nullptr));
  PetscCall(MatCreateVecs(K, &x, nullptr));
  modes->lambda.resize(n);
  modes->x.resize(rows, n);
  for (PetscInt k = 0; k < n; k++) {
    const PetscScalar *values;
    PetscCall(EPSGetEigenpair(eps, k, &value, nullptr, x, nullptr));
    PetscCall(VecGetArrayRead(x, &values));
    std::copy_n(values, rows, modes->x.col(k).data());
    PetscCall(VecRestoreArrayRead(x, &values));
    modes->lambda[k] = value;
  }
  PetscCall(VecDestroy(&x));
  PetscFunctionReturn(0);
}

static void Merge(const NormalModes &more, NormalModes *modes)
{
  const PetscInt                           n = (PetscInt)modes->lambda.size(), m = (PetscInt)more.lambda.size();
  std::vector<std::pair<double, PetscInt>> order;
  for (PetscInt k = 0; k < n; k++) order.push_back({modes->lambda[k], k});
  for (PetscInt k = 0; k < m; k++) order.push_back({more.lambda[k], n + k});
  std::sort(order.begin(), order.end());
  NormalModes all;
  all.lambda.resize(n + m);
  all.x.resize(more.x.rows(), n + m);
  for (PetscInt k = 0; k < n + m; k++) {
    const PetscInt from = order[k].second;
    all.lambda[k]       = order[k].first;
    if (from < n)
      all.x.col(k) = modes->x.col(from);
    else
      all.x.col(k) = more.x.col(from - n);
  }
  modes->lambda.swap(all.lambda);
  modes->x.swap(all.x);
}

/* Takes the solver out of the EPS, because EPSDestroy() would reset it and lose its factors */
static PetscErrorCode ReleaseSolver(EPS eps)
{
  ST  st;
  KSP none;

  PetscFunctionBegin;
  PetscCall(EPSGetST(eps, &st));
  PetscCall(KSPCreate(PetscObjectComm((PetscObject)eps), &none));
  PetscCall(STSetKSP(st, none));
  PetscCall(KSPDestroy(&none));
  PetscFunctionReturn(0);
}

/* Runs the eigensolver for the `count` lowest modes other than those in *modes, and merges them into it in ascending order */
static PetscErrorCode RunEps(const Pencil &pencil, const WantedModes &wanted, PetscInt count, bool slices, KSP *ksp,
                             NormalModes *modes)
{
  EPS                eps;
  EPSConvergedReason reason;
  PetscInt           converged, iterations;
  NormalModes        more;

  PetscFunctionBegin;
  PetscCall(SetUpEps(pencil, wanted, count, slices, modes->x, ksp, &eps));
  PetscCall(EPSSolve(eps));
  PetscCall(EPSGetConvergedReason(eps, &reason));
  PetscCall(EPSGetConverged(eps, &converged));
  PetscCall(EPSGetIterationNumber(eps, &iterations));
  const bool good = reason > 0 || converged >= count;
  if (good) PetscCall(CollectModes(eps, pencil.K, &more));
  if (!slices) PetscCall(ReleaseSolver(eps));
  PetscCall(EPSDestroy(&eps));
  PetscCheck(good, PetscObjectComm((PetscObject)pencil.K), PETSC_ERR_CONV_FAILED,
             "Reduce(): %" PetscInt_FMT " of %" PetscInt_FMT " normal modes converged in %" PetscInt_FMT
             " restarts; raise -" REDUCE_PREFIX "eps_max_it or -" REDUCE_PREFIX "eps_ncv, or ask for fewer modes",
             converged, count, iterations);
  modes->how +=
      (modes->how.empty() ? "" : " + ") + std::to_string(iterations) + (slices ? " restarts in slices" : " restarts");
  Merge(more, modes);
  PetscFunctionReturn(0);
}

/* A value in the highest gap between two distinct eigenvalues; *below: the number of eigenvalues below it */
static double ValueInGap(const VectorXd &lambda, PetscInt *below)
{
  for (PetscInt p = (PetscInt)lambda.size(); p-- > 1;)
    if (lambda[p] > lambda[p - 1] * (1 + 1e-3)) {
      *below = p;
      return 0.5 * (lambda[p] + lambda[p - 1]);
    }
  *below = (PetscInt)lambda.size();
  return lambda[*below - 1] * (1 + 1e-5);
}

constexpr char none_missing[] = "none is missing";

/* Number of modes missing below the highest gap, by inertia: Krylov methods may miss copies of multiple eigenvalues, as symmetric bodies have them.
   0 where they are not counted, by option or because the solver does not tell the inertia; modes->count says so. */
static PetscErrorCode CountMissing(const Pencil &pencil, NormalModes *modes, PetscInt *missing)
{
  PetscBool verify = PETSC_TRUE;
  PetscInt  below, count;

  PetscFunctionBegin;
  *missing     = 0;
  modes->count = "not counted";
  PetscCall(PetscOptionsGetBool(nullptr, REDUCE_PREFIX, "-verify", &verify, nullptr));
  if (!verify || !modes->lambda.size()) PetscFunctionReturn(0);
  const double sigma = ValueInGap(modes->lambda, &below);
  PetscCall(CountBelow(pencil, sigma, &count));
  if (count >= 0) {
    *missing     = count - below;
    modes->count = none_missing;
  }
  PetscCall(PetscInfo(pencil.K, "%" PetscInt_FMT " modes below %g by inertia, %" PetscInt_FMT " found\n", count, sigma,
                      below));
  PetscFunctionReturn(0);
}

constexpr int      max_searches = 6; /* repeated searches for modes that are missing by inertia */
constexpr PetscInt extra_modes =
    2; /* modes computed beyond the wanted ones, to detect equal frequencies at the limit */

/* Factors K - shift M again after spectrum slicing, whose own solvers have been destroyed */
static PetscErrorCode FactorAgain(const Pencil &pencil, double shift, KSP *ksp)
{
  Mat       S = pencil.K;
  PetscBool singular;
  PetscInt  negative;

  PetscFunctionBegin;
  if (shift != 0)
    PetscCall(Shifted(pencil, shift, &S));
  else
    PetscCall(PetscObjectReference((PetscObject)S));
  PetscCall(CreateSolver(PetscObjectComm((PetscObject)pencil.K), ksp));
  PetscCall(Factor(*ksp, S, &singular, &negative));
  PetscCall(MatDestroy(&S));
  PetscCheck(!singular, PetscObjectComm((PetscObject)pencil.K), PETSC_ERR_MAT_LU_ZRPVT,
             "Reduce(): the stiffness is singular to the solver, though it had normal modes");
  PetscFunctionReturn(0);
}

/* Calls `use` for the lowest `count` modes while the factorization exists, then destroys it */
static PetscErrorCode Use(const WhileFactored &use, PetscInt count, KSP *ksp, NormalModes *modes)
{
  PetscFunctionBegin;
  modes->wanted = std::min(count, (PetscInt)modes->lambda.size());
  PetscCall(use(*ksp, modes));
  PetscCall(KSPDestroy(ksp));
  PetscFunctionReturn(0);
}

PetscErrorCode FindModes(const Pencil &pencil, const WantedModes &wanted, const WhileFactored &use, KSP *ksp,
                         NormalModes *modes)
{
  MPI_Comm       comm = PetscObjectComm((PetscObject)pencil.K);
  const PetscInt most = pencil.modes - (PetscInt)pencil.rigid.cols(), count = std::min(wanted.count, most);
  PetscInt       missing = 0, from = default_slices_from, rows;

  PetscFunctionBegin;
  PetscCall(PetscOptionsGetInt(nullptr, REDUCE_PREFIX, "-slices_from", &from, nullptr));
  PetscCall(MatGetLocalSize(pencil.K, &rows, nullptr));
  modes->lambda.resize(0);
  modes->x.resize(rows, 0);
  if (count <= 0) PetscFunctionReturn(Use(use, 0, ksp, modes));
  const bool slices = wanted.below > 0 && count >= from;
  if (slices) PetscCall(KSPDestroy(ksp)); /* spectrum slicing has its own solvers and counts by inertia itself */
  const PetscInt ask = slices ? count : std::min(count + extra_modes, most);
  PetscCall(RunEps(pencil, wanted, ask, slices, ksp, modes));
  if (slices) {
    PetscCall(FactorAgain(pencil, wanted.shift, ksp));
    modes->count = none_missing;
  }
  PetscCall(Use(use, count, ksp, modes));
  for (int search = 0; !slices; search++) {
    PetscCall(CountMissing(pencil, modes, &missing));
    if (missing <= 0 || search == max_searches) break;
    PetscCall(RunEps(pencil, wanted, std::min(missing, most - (PetscInt)modes->lambda.size()), slices, ksp, modes));
    PetscCall(Use(use, count, ksp, modes));
  }
  PetscCheck(missing <= 0, comm, PETSC_ERR_CONV_FAILED,
             "Reduce(): the eigensolver misses %" PetscInt_FMT
             " of the lowest normal modes, as the inertia of the shifted stiffness tells; "
             "raise -" REDUCE_PREFIX "eps_ncv",
             missing);
  PetscCheck(modes->lambda.size() >= count, comm, PETSC_ERR_CONV_FAILED,
             "Reduce(): only %d of %" PetscInt_FMT " normal modes converged; raise -" REDUCE_PREFIX
             "eps_max_it or -" REDUCE_PREFIX "eps_ncv",
             (int)modes->lambda.size(), count);
  PetscFunctionReturn(0);
}

} // namespace hhtdae
