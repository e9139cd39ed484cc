/*
  Slowest modes of a linearization: SLEPc's quadratic eigenvalue problem (value^2 M + value C + K) x = 0 over all unknowns, by TOAR (Lu, Su and
  Bai, SIAM J. Matrix Anal. Appl. 37, 2016) with shift and invert. Constraints and definitions have no rates, so that M is singular: their
  eigenvalues are infinite, farthest from any shift.
*/
#include "hhtdae/modes.h"
#include <algorithm>
#include <slepcpep.h>

namespace hhtdae
{

namespace
{

constexpr PetscReal accuracy = 1e-10;
constexpr int       sweeps   = 6; /* of balancing: each takes the root of how far rows are from a size of 1 */

/* The operators of D y = x, where D makes all rows of the matrix that is factored about as large (Ruiz, RAL-TR-2001-034): constraints have entries of 1
   beside stiffness, and the accuracy of slow modes would be lost between the two */
struct Balanced {
  Mat operators[3] = {nullptr, nullptr, nullptr}; /* K, C, M */
  Vec D            = nullptr;
};

PetscErrorCode Balance(const Mat given[3], PetscReal shift, Balanced *b)
{
  Mat T;
  Vec row;
  PetscFunctionBegin;
  PetscCall(MatDuplicate(given[0], MAT_COPY_VALUES, &T));
  PetscCall(MatAXPY(T, shift, given[1], DIFFERENT_NONZERO_PATTERN));
  PetscCall(MatAXPY(T, shift * shift, given[2], DIFFERENT_NONZERO_PATTERN));
  PetscCall(MatCreateVecs(T, &row, &b->D));
  PetscCall(VecSet(b->D, 1));
  for (int k = 0; k < sweeps; k++) {
    PetscScalar *x;
    PetscInt     n;
    PetscCall(MatGetRowMaxAbs(T, row, nullptr));
    PetscCall(VecGetLocalSize(row, &n));
    PetscCall(VecGetArray(row, &x));
    for (PetscInt i = 0; i < n; i++) x[i] = PetscAbsScalar(x[i]) > 0 ? 1 / PetscSqrtReal(PetscAbsScalar(x[i])) : 1;
    PetscCall(VecRestoreArray(row, &x));
    PetscCall(MatDiagonalScale(T, row, row));
    PetscCall(VecPointwiseMult(b->D, b->D, row));
  }
  for (int k = 0; k < 3; k++) {
    PetscCall(MatDuplicate(given[k], MAT_COPY_VALUES, &b->operators[k]));
    PetscCall(MatDiagonalScale(b->operators[k], b->D, b->D));
  }
  PetscCall(MatDestroy(&T));
  PetscCall(VecDestroy(&row));
  PetscFunctionReturn(0);
}

PetscErrorCode SetUp(PEP pep, Mat operators[3], PetscInt count, PetscReal shift)
{
  ST       st;
  KSP      ksp;
  PC       pc;
  PetscInt n;
  PetscFunctionBegin;
  PetscCall(MatGetSize(operators[0], &n, nullptr));
  PetscCall(PEPSetOptionsPrefix(pep, "scene_modes_"));
  PetscCall(PEPSetOperators(pep, 3, operators));
  PetscCall(PEPSetProblemType(pep, PEP_GENERAL));
  PetscCall(PEPSetType(pep, PEPTOAR));
  PetscCall(PEPSetWhichEigenpairs(pep, PEP_TARGET_MAGNITUDE));
  PetscCall(PEPSetTarget(pep, shift));
  PetscCall(PEPSetTolerances(pep, accuracy, PETSC_DEFAULT));
  const PetscInt wanted = 2 * count; /* pairs count twice */
  PetscCall(PEPSetDimensions(pep, PetscMin(wanted, n), PetscMin(2 * wanted + 20, n), PETSC_DEFAULT));
  PetscCall(PEPGetST(pep, &st));
  PetscCall(STSetType(st, STSINVERT));
  PetscCall(STSetTransform(st, PETSC_TRUE));
  PetscCall(STGetKSP(st, &ksp));
  PetscCall(KSPSetType(ksp, KSPPREONLY));
  PetscCall(KSPGetPC(ksp, &pc));
  PetscCall(PCSetType(pc, PCLU));
#if defined(PETSC_HAVE_MUMPS)
  PetscCall(PCFactorSetMatSolverType(pc, MATSOLVERMUMPS));
#endif
  PetscCall(PEPSetFromOptions(pep));
  PetscFunctionReturn(0);
}

/* Of pairs the one with a positive imaginary part */
PetscErrorCode Collect(const Linearization &of, PEP pep, Vec D, PetscInt converged, std::vector<Mode> *modes)
{
  Vec      re, im;
  PetscInt n;
  PetscFunctionBegin;
  PetscCall(VecDuplicate(D, &re));
  PetscCall(VecDuplicate(D, &im));
  PetscCall(VecGetLocalSize(re, &n));
  for (PetscInt k = 0; k < converged; k++) {
    PetscScalar        a, b;
    const PetscScalar *x, *y;
    Mode               m;
    PetscCall(PEPGetEigenpair(pep, k, &a, &b, re, im));
    if (PetscRealPart(b) < 0) continue;
    PetscCall(VecPointwiseMult(re, re, D));
    PetscCall(VecPointwiseMult(im, im, D));
    m.value = {PetscRealPart(a), PetscRealPart(b)};
    m.shape.resize(n);
    PetscCall(VecGetArrayRead(re, &x));
    PetscCall(VecGetArrayRead(im, &y));
    for (PetscInt i = 0; i < n; i++) m.shape[i] = {PetscRealPart(x[i]), PetscRealPart(y[i])};
    PetscCall(VecRestoreArrayRead(re, &x));
    PetscCall(VecRestoreArrayRead(im, &y));
    PetscCall(of.normalize(&m));
    modes->push_back(m);
  }
  PetscCall(VecDestroy(&re));
  PetscCall(VecDestroy(&im));
  std::stable_sort(modes->begin(), modes->end(), [](const Mode &a, const Mode &b) { return std::abs(a.value) < std::abs(b.value); });
  PetscFunctionReturn(0);
}

} // namespace

PetscErrorCode SlowestModes(const Linearization &of, PetscInt count, std::vector<Mode> *modes, PetscReal shift)
{
  Mat       given[3];
  Balanced  b;
  PEP       pep;
  PetscInt  converged;
  PetscBool ready;
  PetscFunctionBegin;
  PetscCall(of.operators(&given[2], &given[1], &given[0]));
  const MPI_Comm comm = PetscObjectComm((PetscObject)given[0]);
  PetscCheck(count > 0, comm, PETSC_ERR_ARG_OUTOFRANGE, "SlowestModes(): the number of modes is %" PetscInt_FMT ", it must be positive", count);
  PetscCall(SlepcInitialized(&ready));
  if (!ready) PetscCall(SlepcInitializeNoArguments());
  modes->clear();
  PetscCall(PEPCreate(comm, &pep));
  PetscCall(Balance(given, shift, &b));
  PetscCall(SetUp(pep, b.operators, count, shift));
  PetscCall(PEPSolve(pep));
  PetscCall(PEPGetConverged(pep, &converged));
  PetscCall(Collect(of, pep, b.D, converged, modes));
  PetscCall(PEPDestroy(&pep));
  for (Mat &x : b.operators) PetscCall(MatDestroy(&x));
  PetscCall(VecDestroy(&b.D));
  PetscCheck((PetscInt)modes->size() >= count, comm, PETSC_ERR_NOT_CONVERGED,
             "SlowestModes(): %d of %" PetscInt_FMT " modes about %g 1/s were found; a scene of few unknowns has all of them by Linearization::modes(), else try another shift or -scene_modes_pep_ncv",
             (int)modes->size(), count, (double)shift);
  modes->resize(count);
  PetscFunctionReturn(0);
}

} // namespace hhtdae
