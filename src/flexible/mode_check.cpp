/* The balanced operators of slowest_modes.cpp, residuals of modes, and refinement of modes with large residuals */
#include "flexible/mode_check.h"
#include <algorithm>
#include <cmath>

namespace hhtdae
{

namespace
{

constexpr PetscReal rigid_motion_limit = 1e-2; /* modes slower than this part of the fastest mode's value, or of the shift, count as rigid motions (SmallBodies.SlowestModesOfAFreeBody) */
constexpr int       max_refinements    = 5;    /* steps of refinement of a shape */
constexpr PetscInt  workspace_percent  = 100;  /* ICNTL(14): workspace above MUMPS' estimate, which does not include the pivots delayed by constraints (FullBodyRanks.SlowestModes) */
constexpr int       balancing_sweeps   = 6;    /* each sweep takes the square root of the rows' deviation from size 1 */

} // namespace

PetscErrorCode BalanceOperators(const Mat given[3], PetscReal shift, Balanced *b)
{
  Mat T;
  Vec row;
  PetscFunctionBegin;
  PetscCall(MatDuplicate(given[0], MAT_COPY_VALUES, &T));
  PetscCall(MatAXPY(T, shift, given[1], DIFFERENT_NONZERO_PATTERN));
  PetscCall(MatAXPY(T, shift * shift, given[2], DIFFERENT_NONZERO_PATTERN));
  PetscCall(MatCreateVecs(T, &row, &b->D));
  PetscCall(VecSet(b->D, 1));
  for (int k = 0; k < balancing_sweeps; k++) {
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

PetscErrorCode DestroyBalanced(Balanced *b)
{
  PetscFunctionBegin;
  for (Mat &x : b->operators) PetscCall(MatDestroy(&x));
  PetscCall(VecDestroy(&b->D));
  PetscFunctionReturn(0);
}

PetscErrorCode GiveFactorWorkspace(KSP ksp, Mat A)
{
  PC            pc;
  MatSolverType package = nullptr;
  PetscBool     direct, mumps = PETSC_FALSE;
  Mat           F;
  PetscFunctionBegin;
  PetscCall(KSPGetPC(ksp, &pc));
  PetscCall(PetscObjectTypeCompareAny((PetscObject)pc, &direct, PCLU, PCCHOLESKY, ""));
  if (!direct) PetscFunctionReturn(0);
  PetscCall(PCFactorGetMatSolverType(pc, &package));
  if (package) PetscCall(PetscStrcmp(package, MATSOLVERMUMPS, &mumps));
  if (!mumps) PetscFunctionReturn(0);
  PetscCall(KSPSetOperators(ksp, A, A));
  PetscCall(PCFactorSetUpMatSolverType(pc));
  PetscCall(PCFactorGetMatrix(pc, &F));
#if defined(PETSC_HAVE_MUMPS)
  PetscCall(MatMumpsSetIcntl(F, 14, workspace_percent));
#endif
  PetscFunctionReturn(0);
}

namespace
{

/* sum: real and imaginary part of the residual (value^2 M + value C + K) x with the balanced operators; *part: its norm relative to that of the terms with M and C,
   inertia and damping forces and the rates of first-order states */
PetscErrorCode ResidualOf(const Balanced &by, const Mode &m, Vec sum[2], PetscReal *part)
{
  const std::complex<double> power[3] = {1, m.value, m.value * m.value};
  Vec                        x, product;
  PetscReal                  norm, residual = 0, rates = 0;
  PetscFunctionBegin;
  PetscCall(VecDuplicate(by.D, &x));
  PetscCall(VecDuplicate(by.D, &product));
  for (int imaginary = 0; imaginary < 2; imaginary++) PetscCall(VecSet(sum[imaginary], 0));
  for (int imaginary = 0; imaginary < 2; imaginary++) {
    PetscScalar *put;
    PetscCall(VecGetArrayWrite(x, &put));
    for (std::size_t i = 0; i < m.shape.size(); i++) put[i] = imaginary ? m.shape[i].imag() : m.shape[i].real();
    PetscCall(VecRestoreArrayWrite(x, &put));
    PetscCall(VecPointwiseDivide(x, x, by.D));
    for (int k = 0; k < 3; k++) {
      PetscCall(MatMult(by.operators[k], x, product));
      PetscCall(VecAXPY(sum[imaginary], power[k].real(), product));
      PetscCall(VecAXPY(sum[1 - imaginary], imaginary ? -power[k].imag() : power[k].imag(), product));
      PetscCall(VecNorm(product, NORM_2, &norm));
      if (k > 0) rates += std::norm(power[k]) * norm * norm;
    }
  }
  for (int imaginary = 0; imaginary < 2; imaginary++) {
    PetscCall(VecNorm(sum[imaginary], NORM_2, &norm));
    residual += norm * norm;
  }
  PetscCall(VecDestroy(&x));
  PetscCall(VecDestroy(&product));
  *part = PetscSqrtReal(residual / rates);
  PetscFunctionReturn(0);
}

/* Factors shift^2 M + shift C + K with the balanced operators */
PetscErrorCode Factor(const Balanced &by, PetscReal shift, KSP *ksp)
{
  Mat T;
  PC  pc;
  PetscFunctionBegin;
  PetscCall(MatDuplicate(by.operators[0], MAT_COPY_VALUES, &T));
  PetscCall(MatAXPY(T, shift, by.operators[1], DIFFERENT_NONZERO_PATTERN));
  PetscCall(MatAXPY(T, shift * shift, by.operators[2], DIFFERENT_NONZERO_PATTERN));
  PetscCall(KSPCreate(PetscObjectComm((PetscObject)T), ksp));
  PetscCall(KSPSetOptionsPrefix(*ksp, "scene_modes_st_"));
  PetscCall(KSPSetType(*ksp, KSPPREONLY));
  PetscCall(KSPGetPC(*ksp, &pc));
  PetscCall(PCSetType(pc, PCLU));
#if defined(PETSC_HAVE_MUMPS)
  PetscCall(PCFactorSetMatSolverType(pc, MATSOLVERMUMPS));
#endif
  PetscCall(KSPSetFromOptions(*ksp));
  PetscCall(GiveFactorWorkspace(*ksp, T));
  PetscCall(KSPSetOperators(*ksp, T, T));
  PetscCall(MatDestroy(&T));
  PetscFunctionReturn(0);
}

/* Residual inverse iteration (Neumaier, SIAM J. Numer. Anal. 22, 1985) with a fixed value: removes from a slow shape components of fast modes that the search has left,
   because 1e-10 of their stiffness exceeds the inertia of a stiff body on a soft spring. The residual of a wrong value does not decrease. */
PetscErrorCode Refine(const Balanced &by, KSP factor, Vec sum[2], Mode *m, PetscReal *part)
{
  Mode      better   = *m;
  PetscReal residual = *part;
  PetscFunctionBegin;
  for (int k = 0; k < max_refinements && residual <= *part && residual > max_residual; k++) {
    *m    = better;
    *part = residual;
    for (int imaginary = 0; imaginary < 2; imaginary++) {
      const PetscScalar *d;
      PetscCall(KSPSolve(factor, sum[imaginary], sum[imaginary]));
      PetscCall(VecPointwiseMult(sum[imaginary], sum[imaginary], by.D));
      PetscCall(VecGetArrayRead(sum[imaginary], &d));
      for (std::size_t i = 0; i < m->shape.size(); i++) better.shape[i] -= imaginary ? std::complex<double>(0, d[i]) : std::complex<double>(d[i], 0);
      PetscCall(VecRestoreArrayRead(sum[imaginary], &d));
    }
    PetscCall(ResidualOf(by, better, sum, &residual));
  }
  if (residual < *part) {
    *m    = better;
    *part = residual;
  }
  PetscFunctionReturn(0);
}

} // namespace

bool IsRigidMotion(const Mode &m, const std::vector<Mode> &modes, PetscReal shift) { return std::abs(m.value) < rigid_motion_limit * std::max(std::abs(modes.back().value), std::abs(shift)); }

PetscErrorCode CheckModes(const Mat given[3], PetscReal shift, std::vector<Mode> *modes, PetscReal *worst, PetscReal *frequency)
{
  Balanced  by;
  KSP       factor = nullptr;
  Vec       sum[2];
  PetscReal at = 0, residual = 0;
  PetscFunctionBegin;
  *worst = *frequency = 0;
  for (Vec &v : sum) PetscCall(MatCreateVecs(given[0], nullptr, &v));
  for (Mode &m : *modes) {
    const PetscReal here = std::abs(m.value);
    if (IsRigidMotion(m, *modes, shift)) continue;
    if (!(here <= max_value_per_shift * at)) {
      PetscCall(KSPDestroy(&factor));
      PetscCall(DestroyBalanced(&by));
      PetscCall(BalanceOperators(given, here, &by));
      at = here;
    }
    PetscCall(ResidualOf(by, m, sum, &residual));
    if (residual > max_residual) {
      if (!factor) PetscCall(Factor(by, at, &factor));
      PetscCall(Refine(by, factor, sum, &m, &residual));
    }
    if (residual <= *worst) continue;
    *worst     = residual;
    *frequency = m.frequency();
  }
  for (Vec &v : sum) PetscCall(VecDestroy(&v));
  PetscCall(KSPDestroy(&factor));
  PetscCall(DestroyBalanced(&by));
  PetscFunctionReturn(0);
}

} // namespace hhtdae
