/* Frequency response: (K - w^2 M + i w C) x = b as a real system of twice the unknowns, the real parts before the imaginary ones on each rank. */
#include "linearization.h"
#include "start.h"
#include <algorithm>

namespace hhtdae
{

namespace
{

/* [S -w C; w C S], S = K - w^2 M */
PetscErrorCode DynamicStiffness(const Linearization::Work &w, double omega, Mat *all)
{
  Mat S, up, down, nest;
  PetscFunctionBegin;
  PetscCall(MatDuplicate(w.K, MAT_COPY_VALUES, &S));
  PetscCall(MatAXPY(S, -omega * omega, w.M, DIFFERENT_NONZERO_PATTERN));
  PetscCall(MatDuplicate(w.C, MAT_COPY_VALUES, &up));
  PetscCall(MatScale(up, -omega));
  PetscCall(MatDuplicate(w.C, MAT_COPY_VALUES, &down));
  PetscCall(MatScale(down, omega));
  Mat block[4] = {S, up, down, S};
  PetscCall(MatCreateNest(w.comm(), 2, nullptr, 2, nullptr, block, &nest));
  PetscCall(MatConvert(nest, MATAIJ, MAT_INITIAL_MATRIX, all));
  PetscCall(MatDestroy(&nest));
  for (Mat *x : {&S, &up, &down}) PetscCall(MatDestroy(x));
  PetscFunctionReturn(0);
}

PetscErrorCode Solve(const Linearization::Work &w, double omega, const std::vector<double> &load, std::vector<std::complex<double>> &x)
{
  Mat                A;
  Vec                b, y;
  KSP                ksp;
  PC                 pc;
  KSPConvergedReason reason;
  double            *put;
  const double      *get;
  const std::size_t  n = load.size();
  PetscFunctionBegin;
  PetscCall(DynamicStiffness(w, omega, &A));
  PetscCall(MatCreateVecs(A, &y, &b));
  PetscCall(VecGetArrayWrite(b, &put));
  std::copy(load.begin(), load.end(), put);
  std::fill(put + n, put + 2 * n, 0.);
  PetscCall(VecRestoreArrayWrite(b, &put));
  PetscCall(KSPCreate(w.comm(), &ksp));
  PetscCall(KSPSetOptionsPrefix(ksp, "scene_response_"));
  PetscCall(KSPSetType(ksp, KSPPREONLY));
  PetscCall(KSPSetOperators(ksp, A, A));
  PetscCall(KSPGetPC(ksp, &pc));
  PetscCall(PCSetType(pc, PCLU));
  PetscCall(ChoosePackage(A, pc, false));
  PetscCall(KSPSetFromOptions(ksp));
  PetscCall(KSPSolve(ksp, b, y));
  PetscCall(KSPGetConvergedReason(ksp, &reason));
  PetscCheck(reason > 0, w.comm(), PETSC_ERR_NOT_CONVERGED, "Linearization::response(): no solution at %g rad/s (%s): an undamped mode has that frequency, or a body that nothing holds is pushed at 0 rad/s",
             omega, KSPConvergedReasons[reason]);
  PetscCall(VecGetArrayRead(y, &get));
  x.resize(n);
  for (std::size_t i = 0; i < n; i++) x[i] = {get[i], get[n + i]};
  PetscCall(VecRestoreArrayRead(y, &get));
  PetscCall(KSPDestroy(&ksp));
  PetscCall(VecDestroy(&b));
  PetscCall(VecDestroy(&y));
  PetscCall(MatDestroy(&A));
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
  amplitude->resize(circular.size());
  for (std::size_t k = 0; k < circular.size(); k++) {
    std::vector<std::complex<double>> x;
    PetscCall(Solve(w, circular[k], load, x));
    PetscCall(AmplitudeOf(w, out, x, {0, circular[k]}, &(*amplitude)[k]));
  }
  PetscFunctionReturn(0);
}

} // namespace hhtdae
