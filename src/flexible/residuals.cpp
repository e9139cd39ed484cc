/*
  Residuals of the modes of the reduced pair in the full model.

  The force residual r = K x - lambda M x is no useful measure: it is of high frequency, as large as K x in a
  fine mesh, and does hardly any work. The relevant measure is its work on the full model, the norm of K^-1:

      eta^2 = r^T K^-1 r / lambda,    x^T M x = 1

  K is that of the tied body, on the M-orthogonal complement of the six rigid motions. In the inner product
  (x, y) = x^T K y the operator T = K^-1 M is self-adjoint with eigenvalues 1 / lambda_j, |x|^2 = lambda, and x - lambda
  T x = K^-1 r, so that eta = |x - lambda T x| / |x| is the residual of the pair (1 / lambda, x) of T, relative to 1 /
  lambda. The theorem of Krylov and Weinstein (B. N. Parlett, The Symmetric Eigenvalue Problem, 4.5) puts an eigenvalue
  of T within eta / lambda of 1 / lambda:

      |lambda - lambda_j| <= eta lambda_j    for some lambda_j of the full model, without any assumption.

  x comes from a Ritz process, so 1 / lambda is its Rayleigh quotient in T, and the theorem of Temple and Kato (T. Kato, On
  the upper and lower bounds of eigenvalues, 1949; Parlett 11.7) gives a quadratic bound for an isolated mode:

      |lambda - lambda_j| <= eta^2 lambda_j / gap,    gap = least |1 - lambda / lambda_k| of all other lambda_k.

  The gap to other modes of the space hardly matters, because r is orthogonal to them: to first order the error of lambda is
  between eta^2 and eta^2 / (1 - lambda / nu), where nu is the first normal mode that was left out. The relative error of frequencies is half of it.

  Constraint modes do no work with any residual, because they are in the space and the reduced equations hold; all other
  motions are motions of the interior. So only the interior part of r contributes, and r^T K^-1 r = r_i^T K_ii^-1 r_i is
  computed with the factor of the interior stiffness, which exists anyhow. With averages K_ii^-1 is restricted to motions with zero averages.

  Modes of the free body are eigenvectors of the full model up to the eigensolver's tolerance. There K + s M, s > 0, is
  factored: eigenvalues are lambda_j + s, and |lambda - lambda_j| <= eta_s (lambda_j + s). The result is eta = eta_s
  (lambda + s) / lambda, the same bound to first order.
*/
#include "craig_bampton.h"
#include <algorithm>
#include <cmath>

namespace hhtdae
{

/* K x - lambda M x of modes [from, from + count) */
static PetscErrorCode ForceResidual(const FeModel &model, const ReductionSpace &space, PetscInt from, PetscInt count,
                                    MatrixXd *r)
{
  MatrixXd x, Mx;

  PetscFunctionBegin;
  x = space.x * space.Y.middleCols(from, count);
  PetscCall(Multiply(model.K, x, r));
  PetscCall(Multiply(model.M, x, &Mx));
  *r -= Mx * space.lambda.segment(from, count).asDiagonal();
  PetscFunctionReturn(0);
}

PetscErrorCode ModeResiduals(const FeModel &model, const Reduction &reduction, double shift, KSP ksp,
                             const SolverRows &rows, ReductionSpace *space)
{
  const PetscInt n    = (PetscInt)space->lambda.size();
  double         most = 0;
  MatrixXd       force, f, u, work = MatrixXd::Zero(1, n);
  Phase          phase(model.comm, reduction.progress);

  PetscFunctionBegin;
  PetscCall(phase.begin("residuals"));
  for (PetscInt from = 0; from < n; from += block_columns) {
    const PetscInt count = std::min(block_columns, n - from);
    PetscCall(ForceResidual(model, *space, from, count, &force));
    PetscCall(rows(force, &f));
    PetscCall(SolveBlock(ksp, f, &u));
    work.middleCols(from, count) = f.cwiseProduct(u).colwise().sum();
  }
  PetscCall(SumOverRanks(model.comm, &work));
  space->residual.resize(n);
  for (PetscInt k = 0; k < n; k++) {
    /* rounding may make a vanishing work negative */
    space->residual[k] = std::sqrt(std::abs(work(0, k)) * (space->lambda[k] - shift)) / space->lambda[k];
    most               = std::max(most, space->residual[k]);
  }
  char text[40];
  PetscCall(PetscSNPrintf(text, sizeof text, "%d modes, up to %.1e", (int)n, most));
  PetscCall(phase.end(text));
  PetscFunctionReturn(0);
}

} // namespace hhtdae
