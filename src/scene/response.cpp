/* Frequency response: (K - w^2 M + i w C) x = b as a real system of twice the size; on each rank the real parts come before the imaginary ones. */
#include "linearization.h"
#include "start.h"
#include <algorithm>
#include <cmath>

namespace hhtdae
{

namespace
{

constexpr int scalings = 3, refinements = 5; /* number of passes of equilibration; largest number of steps of iterative refinement */
/* Refinement ends when the residual, relative to the largest terms of the equations, is below this; a final residual
   above 1e3 times this is an error */
constexpr double backward_error = 1e-13;
/* Of a singular system: added to the diagonal of the scaled matrix, whose entries are about 1; and the steps of refinement, each of which reduces the residual by shift/(shift + smallest singular value but zero) */
constexpr double singular_shift       = 1e-8;
constexpr int    singular_refinements = 50;

/* The pattern is the same for all frequencies, so that the symbolic factorization is done once */
struct Response {
  Mat K = nullptr, A = nullptr; /* K: stiffness matrix, with the pattern of M added; A: matrix of the system, scaled by D on both sides */
  Vec b = nullptr, x = nullptr, D = nullptr, residual = nullptr, change = nullptr;
  KSP ksp = nullptr;
};

/* A <- D A D with largest entries of rows and columns near one (Ruiz 2001): stiffness of bodies and entries 1 of constraints differ by orders of magnitude, and pivots are chosen
   by size (test_response_of_a_stiff_body of tests/python). */
PetscErrorCode EquilibrateResponse(Response &r)
{
  PetscFunctionBegin;
  PetscCall(VecSet(r.D, 1));
  for (int k = 0; k < scalings; k++) {
    PetscScalar *d;
    PetscInt     n;
    PetscCall(MatGetRowMaxAbs(r.A, r.change, nullptr));
    PetscCall(VecGetLocalSize(r.change, &n));
    PetscCall(VecGetArray(r.change, &d));
    for (PetscInt i = 0; i < n; i++) d[i] = d[i] > 0 ? 1 / std::sqrt(d[i]) : 1;
    PetscCall(VecRestoreArray(r.change, &d));
    PetscCall(MatDiagonalScale(r.A, r.change, r.change));
    PetscCall(VecPointwiseMult(r.D, r.D, r.change));
  }
  PetscFunctionReturn(0);
}

/* A = D [S -w C; w C S] D, S = K - w^2 M */
PetscErrorCode DynamicStiffness(const Linearization::Work &w, double omega, Response &r)
{
  Mat S, up, down, nest;
  PetscFunctionBegin;
  PetscCall(MatDuplicate(r.K, MAT_COPY_VALUES, &S));
  PetscCall(MatAXPY(S, -omega * omega, w.M, SUBSET_NONZERO_PATTERN));
  PetscCall(MatDuplicate(w.C, MAT_COPY_VALUES, &up));
  PetscCall(MatScale(up, -omega));
  PetscCall(MatDuplicate(w.C, MAT_COPY_VALUES, &down));
  PetscCall(MatScale(down, omega));
  Mat block[4] = {S, up, down, S};
  PetscCall(MatCreateNest(w.comm(), 2, nullptr, 2, nullptr, block, &nest));
  PetscCall(MatConvert(nest, MATAIJ, r.A ? MAT_REUSE_MATRIX : MAT_INITIAL_MATRIX, &r.A));
  PetscCall(MatDestroy(&nest));
  for (Mat *x : {&S, &up, &down}) PetscCall(MatDestroy(x));
  if (!r.D)
    for (Vec *x : {&r.b, &r.x, &r.D, &r.residual, &r.change}) PetscCall(MatCreateVecs(r.A, x, nullptr));
  PetscCall(EquilibrateResponse(r));
  PetscFunctionReturn(0);
}

PetscErrorCode CreateSolver(const Linearization::Work &w, Mat A, KSP *ksp)
{
  PC pc;
  PetscFunctionBegin;
  PetscCall(KSPCreate(w.comm(), ksp));
  PetscCall(KSPSetOptionsPrefix(*ksp, "scene_response_"));
  PetscCall(KSPSetType(*ksp, KSPPREONLY));
  PetscCall(KSPSetOperators(*ksp, A, A));
  PetscCall(KSPGetPC(*ksp, &pc));
  PetscCall(PCSetType(pc, PCLU));
  PetscCall(ChoosePackage(A, pc));
  PetscCall(KSPSetFromOptions(*ksp));
  PetscFunctionReturn(0);
}

PetscErrorCode BeginResponse(const Linearization::Work &w, double omega, const std::vector<double> &load, Response &r)
{
  double *put;
  PetscFunctionBegin;
  PetscCall(MatDuplicate(w.M, MAT_COPY_VALUES, &r.K));
  PetscCall(MatScale(r.K, 0));
  PetscCall(MatAXPY(r.K, 1, w.K, DIFFERENT_NONZERO_PATTERN));
  PetscCall(DynamicStiffness(w, omega, r));
  PetscCall(VecSet(r.b, 0));
  PetscCall(VecGetArray(r.b, &put));
  std::copy(load.begin(), load.end(), put);
  PetscCall(VecRestoreArray(r.b, &put));
  PetscCall(CreateSolver(w, r.A, &r.ksp));
  PetscFunctionReturn(0);
}

PetscErrorCode EndResponse(Response &r)
{
  PetscFunctionBegin;
  for (Mat *x : {&r.K, &r.A}) PetscCall(MatDestroy(x));
  for (Vec *x : {&r.b, &r.x, &r.D, &r.residual, &r.change}) PetscCall(VecDestroy(x));
  PetscCall(KSPDestroy(&r.ksp));
  PetscFunctionReturn(0);
}

/* x: of A x = D b, by iterative refinement with the factors of ksp; *left: what the residual is of the largest terms of the equations, infinite if the factors fail, *reason says why */
PetscErrorCode Refine(KSP ksp, int most, Response &r, double *left, KSPConvergedReason *reason)
{
  double norm, size, residual, largest_terms;
  PetscFunctionBegin;
  PetscCall(MatNorm(r.A, NORM_INFINITY, &norm));
  PetscCall(VecPointwiseMult(r.residual, r.D, r.b));
  PetscCall(VecNorm(r.residual, NORM_INFINITY, &largest_terms));
  PetscCall(VecSet(r.x, 0));
  *reason  = KSP_CONVERGED_ITS;
  residual = largest_terms;
  for (int k = 0; k <= most && residual > backward_error * largest_terms; k++) {
    PetscCall(KSPSolve(ksp, r.residual, r.change));
    PetscCall(KSPGetConvergedReason(ksp, reason));
    if (*reason <= 0) break;
    PetscCall(VecAXPY(r.x, 1, r.change));
    PetscCall(VecPointwiseMult(r.residual, r.D, r.b));
    PetscCall(VecNorm(r.residual, NORM_INFINITY, &largest_terms));
    PetscCall(MatMult(r.A, r.x, r.change));
    PetscCall(VecAXPY(r.residual, -1, r.change));
    PetscCall(VecNorm(r.residual, NORM_INFINITY, &residual));
    PetscCall(VecNorm(r.x, NORM_INFINITY, &size));
    largest_terms += norm * size;
  }
  *left = *reason <= 0 ? INFINITY : largest_terms > 0 ? residual / largest_terms : 0;
  PetscFunctionReturn(0);
}

/* A load that does not excite what nothing holds has a response nevertheless, the one without a part in it: the limit of that of the shifted matrix (test_response_beside_a_free_motion of
   tests/python). Any other load leaves a residual. */
PetscErrorCode SolveSingular(const Linearization::Work &w, Response &r, double *left)
{
  Mat                shifted;
  KSP                ksp;
  KSPConvergedReason reason;
  PetscFunctionBegin;
  PetscCall(MatDuplicate(r.A, MAT_COPY_VALUES, &shifted));
  PetscCall(MatShift(shifted, singular_shift));
  PetscCall(CreateSolver(w, shifted, &ksp));
  PetscCall(Refine(ksp, singular_refinements, r, left, &reason));
  PetscCall(KSPDestroy(&ksp));
  PetscCall(MatDestroy(&shifted));
  PetscFunctionReturn(0);
}

/* r.x: the solution of the system without its scaling */
PetscErrorCode SolveRefined(const Linearization::Work &w, double omega, Response &r)
{
  KSPConvergedReason reason;
  double             left;
  PetscFunctionBegin;
  PetscCall(Refine(r.ksp, refinements, r, &left, &reason));
  if (reason <= 0) {
    PetscCall(SolveSingular(w, r, &left));
    PetscCheck(left <= 1e3 * backward_error, w.comm(), PETSC_ERR_NOT_CONVERGED, "Linearization::response(): no solution at %g rad/s (%s): an undamped mode has that frequency, or a body that nothing holds is pushed at 0 rad/s",
               omega, KSPConvergedReasons[reason]);
  }
  PetscCheck(left <= 1e3 * backward_error, w.comm(), PETSC_ERR_NOT_CONVERGED,
             "Linearization::response(): the linear solver leaves %g of the load at %g rad/s; take another one, -scene_response_pc_factor_mat_solver_type mumps for example", left, omega);
  PetscCall(VecPointwiseMult(r.x, r.x, r.D));
  PetscFunctionReturn(0);
}

PetscErrorCode SolveResponse(const Linearization::Work &w, double omega, Response &r, std::vector<std::complex<double>> &x)
{
  const double     *get;
  const std::size_t n = (std::size_t)w.R->n;
  PetscFunctionBegin;
  PetscCall(SolveRefined(w, omega, r));
  x.resize(n);
  PetscCall(VecGetArrayRead(r.x, &get));
  for (std::size_t i = 0; i < n; i++) x[i] = {get[i], get[n + i]};
  PetscCall(VecRestoreArrayRead(r.x, &get));
  PetscFunctionReturn(0);
}

} // namespace

PetscErrorCode Linearization::response(const Excitation &in, const Measure &out, const std::vector<double> &circular, std::vector<std::complex<double>> *amplitude) const
{
  const Work         &w = *work_;
  std::vector<double> load;
  PetscFunctionBegin;
  PetscCall(w.check("Linearization::response()"));
  PetscCall(w.load(in, &load));
  for (double f : circular) PetscCheck(std::isfinite(f), w.comm(), PETSC_ERR_ARG_OUTOFRANGE, "Linearization::response(): a frequency is %g rad/s, all must be finite", f);
  amplitude->resize(circular.size());
  Response r;
  for (std::size_t k = 0; k < circular.size(); k++) {
    std::vector<std::complex<double>> x;
    PetscCall(k ? DynamicStiffness(w, circular[k], r) : BeginResponse(w, circular[0], load, r));
    PetscCall(SolveResponse(w, circular[k], r, x));
    PetscCall(AmplitudeOf(w, out, x, {0, circular[k]}, &(*amplitude)[k]));
  }
  PetscCall(EndResponse(r));
  PetscFunctionReturn(0);
}

} // namespace hhtdae
