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

PetscErrorCode SetUp(PEP pep, Mat M, Mat C, Mat K, PetscInt count, PetscReal shift)
{
  ST       st;
  KSP      ksp;
  PC       pc;
  PetscInt n;
  PetscFunctionBegin;
  Mat operators[3] = {K, C, M};
  PetscCall(MatGetSize(M, &n, nullptr));
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
PetscErrorCode Collect(const Linearization &of, PEP pep, Mat M, PetscInt converged, std::vector<Mode> *modes)
{
  Vec      re, im;
  PetscInt n;
  PetscFunctionBegin;
  PetscCall(MatCreateVecs(M, &re, &im));
  PetscCall(VecGetLocalSize(re, &n));
  for (PetscInt k = 0; k < converged; k++) {
    PetscScalar        a, b;
    const PetscScalar *x, *y;
    Mode               m;
    PetscCall(PEPGetEigenpair(pep, k, &a, &b, re, im));
    if (PetscRealPart(b) < 0) continue;
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
  Mat       M, C, K;
  PEP       pep;
  PetscInt  converged;
  PetscBool ready;
  PetscFunctionBegin;
  PetscCall(of.operators(&M, &C, &K));
  const MPI_Comm comm = PetscObjectComm((PetscObject)M);
  PetscCheck(count > 0, comm, PETSC_ERR_ARG_OUTOFRANGE, "SlowestModes(): the number of modes is %" PetscInt_FMT ", it must be positive", count);
  PetscCall(SlepcInitialized(&ready));
  if (!ready) PetscCall(SlepcInitializeNoArguments());
  modes->clear();
  PetscCall(PEPCreate(comm, &pep));
  PetscCall(SetUp(pep, M, C, K, count, shift));
  PetscCall(PEPSolve(pep));
  PetscCall(PEPGetConverged(pep, &converged));
  PetscCall(Collect(of, pep, M, converged, modes));
  PetscCall(PEPDestroy(&pep));
  PetscCheck((PetscInt)modes->size() >= count, comm, PETSC_ERR_NOT_CONVERGED,
             "SlowestModes(): %d of %" PetscInt_FMT " modes about %g 1/s were found; a scene of few unknowns has all of them by Linearization::modes(), else try another shift or -scene_modes_pep_ncv",
             (int)modes->size(), count, (double)shift);
  modes->resize(count);
  PetscFunctionReturn(0);
}

} // namespace hhtdae
