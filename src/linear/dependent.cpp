/*
  Finds linearly dependent constraints by inverse iteration. P = [K B^T; B 0] is singular if B^T lambda = 0 for some
  lambda != 0. With -E in place of the zero block, E small and diagonal, a solve with right-hand side (0, -E lambda)
  gives

      lambda <- (S + E)^{-1} E lambda,   S = B K^{-1} B^T,

  which keeps the part of lambda in the null space of B^T and shrinks the rest by about E/S. All null directions are
  kept equally, so a vector without small entries converges to its projection on the null space. That is nonzero in exactly
  the rows that take part in some dependence (unless the vector is orthogonal to one by chance).
*/
#include "linear.h"
#include "vectors.h"
#include <algorithm>
#include <vector>

/* E relative to an estimate of the diagonal of S: small compared with the nonzero eigenvalues of S, large compared with rounding */
static const PetscReal REGULARIZATION = 1e-9;

/* A row takes part in a dependence if its entry of the null vector, relative to the largest one, is larger than this */
static const PetscReal MIN_COMPONENT = 1e-6;

/* Upper limit of the iterations, each of which shrinks the other components by about E/S */
static const PetscInt NULL_VECTOR_ITERATIONS = 12;

namespace
{

/* Vectors have all rows of P; s, lambda and mask vanish on rows of coordinates */
struct Dependence {
  Mat P, regularized;
  IS  multipliers;
  Vec d;      /* 1/sqrt|k_jj| */
  Vec s;      /* the estimate of S_ii: sum_j b_ij^2 / |k_jj| */
  Vec mask;   /* 1 on the multipliers */
  Vec lambda; /* the iterate */
  Vec work;
  KSP ksp;
};

} // namespace

/* d_j = 1/sqrt|k_jj|; for a zero diagonal entry the mean of |k_jj| is taken */
static PetscErrorCode FillD(Dependence *t)
{
  PetscReal    sum;
  PetscInt     n, local;
  PetscScalar *d;

  PetscFunctionBegin;
  PetscCall(MatGetDiagonal(t->P, t->d));
  PetscCall(VecNorm(t->d, NORM_1, &sum));
  PetscCall(VecGetSize(t->d, &n));
  PetscCall(VecGetLocalSize(t->d, &local));
  const PetscReal mean = sum > 0 ? sum / n : 1;
  PetscCall(VecGetArray(t->d, &d));
  for (PetscInt i = 0; i < local; ++i) d[i] = 1 / PetscSqrtReal(PetscAbsScalar(d[i]) > 0 ? PetscAbsScalar(d[i]) : mean);
  PetscCall(VecRestoreArray(t->d, &d));
  PetscFunctionReturn(0);
}

/* Sets the multipliers' entries of s, of the mask and of the first lambda, whose entries have similar sizes when scaled by sqrt(s) */
static PetscErrorCode FillMultipliers(Dependence *t)
{
  Mat             scaled;
  PetscInt        begin, end, n;
  const PetscInt *rows;

  PetscFunctionBegin;
  PetscCall(MatDuplicate(t->P, MAT_COPY_VALUES, &scaled));
  PetscCall(MatDiagonalScale(scaled, NULL, t->d));
  PetscCall(VecGetOwnershipRange(t->s, &begin, &end));
  PetscCall(ISGetLocalSize(t->multipliers, &n));
  PetscCall(ISGetIndices(t->multipliers, &rows));
  for (PetscInt i = 0; i < n; ++i) {
    PetscInt           count;
    const PetscScalar *vals;
    PetscReal          s = 0;
    PetscCheck(rows[i] >= begin && rows[i] < end, PETSC_COMM_SELF, PETSC_ERR_ARG_OUTOFRANGE,
               "Multiplier %" PetscInt_FMT " is not a row of this process, [%" PetscInt_FMT ", %" PetscInt_FMT ")",
               rows[i], begin, end);
    PetscCall(MatGetRow(scaled, rows[i], &count, NULL, &vals));
    for (PetscInt k = 0; k < count; ++k) s += PetscAbsScalar(vals[k]) * PetscAbsScalar(vals[k]);
    PetscCall(MatRestoreRow(scaled, rows[i], &count, NULL, &vals));
    if (s <= 0) s = 1; /* an empty row is linearly dependent by itself */
    PetscCall(VecSetValue(t->s, rows[i], s, INSERT_VALUES));
    PetscCall(VecSetValue(t->mask, rows[i], 1.0, INSERT_VALUES));
    PetscCall(VecSetValue(t->lambda, rows[i], LinearPseudoRandomValue((uint64_t)rows[i], 3) / PetscSqrtReal(s),
                          INSERT_VALUES));
  }
  PetscCall(ISRestoreIndices(t->multipliers, &rows));
  PetscCall(MatDestroy(&scaled));
  for (Vec v : {t->s, t->mask, t->lambda}) {
    PetscCall(VecAssemblyBegin(v));
    PetscCall(VecAssemblyEnd(v));
  }
  PetscFunctionReturn(0);
}

/* P - E, in a new pattern because rows of multipliers may have no diagonal entry */
static PetscErrorCode Regularize(Dependence *t)
{
  Mat      E;
  PetscInt m, begin, end;

  PetscFunctionBegin;
  PetscCall(MatGetLocalSize(t->P, &m, NULL));
  PetscCall(
      MatCreateAIJ(PetscObjectComm((PetscObject)t->P), m, m, PETSC_DETERMINE, PETSC_DETERMINE, 1, NULL, 0, NULL, &E));
  PetscCall(MatGetOwnershipRange(E, &begin, &end));
  for (PetscInt i = begin; i < end; ++i) PetscCall(MatSetValue(E, i, i, 0.0, INSERT_VALUES));
  PetscCall(MatAssemblyBegin(E, MAT_FINAL_ASSEMBLY));
  PetscCall(MatAssemblyEnd(E, MAT_FINAL_ASSEMBLY));
  PetscCall(MatDiagonalSet(E, t->s, INSERT_VALUES));
  PetscCall(MatDuplicate(t->P, MAT_COPY_VALUES, &t->regularized));
  PetscCall(MatAXPY(t->regularized, -REGULARIZATION, E, DIFFERENT_NONZERO_PATTERN));
  PetscCall(MatDestroy(&E));
  PetscFunctionReturn(0);
}

static PetscErrorCode Create(Dependence *t)
{
  LinearChoice choice;

  PetscFunctionBegin;
  PetscCall(MatCreateVecs(t->P, &t->d, &t->s));
  PetscCall(VecDuplicate(t->s, &t->mask));
  PetscCall(VecDuplicate(t->s, &t->lambda));
  PetscCall(VecDuplicate(t->s, &t->work));
  PetscCall(FillD(t));
  PetscCall(FillMultipliers(t));
  PetscCall(Regularize(t));
  PetscCall(KSPCreate(PetscObjectComm((PetscObject)t->P), &t->ksp));
  PetscCall(KSPSetOptionsPrefix(t->ksp, "hhtdae_dependent_"));
  PetscCall(LinearDefaults(t->ksp, &choice));
  PetscCall(KSPSetOperators(t->ksp, t->regularized, t->regularized));
  PetscCall(LinearChoose(t->ksp, t->regularized, PETSC_FALSE, &choice));
  PetscFunctionReturn(0);
}

static PetscErrorCode Destroy(Dependence *t)
{
  PetscFunctionBegin;
  PetscCall(KSPDestroy(&t->ksp));
  PetscCall(MatDestroy(&t->regularized));
  for (Vec *v : {&t->d, &t->s, &t->mask, &t->lambda, &t->work}) PetscCall(VecDestroy(v));
  PetscFunctionReturn(0);
}

/* Iterates; *residual is |B^T lambda| relative to |B| |lambda|, and infinite if the regularized matrix cannot be factored */
static PetscErrorCode Iterate(Dependence *t, PetscReal *residual)
{
  PetscReal   largest, norm;
  PetscScalar square;

  PetscFunctionBegin;
  *residual = PETSC_INFINITY;
  for (PetscInt k = 0; k<NULL_VECTOR_ITERATIONS && * residual> PETSC_MACHINE_EPSILON; ++k) {
    KSPConvergedReason reason;
    PetscCall(VecPointwiseMult(t->lambda, t->lambda, t->s));
    PetscCall(VecScale(t->lambda, -REGULARIZATION));
    PetscCall(KSPSolve(t->ksp, t->lambda, t->work));
    PetscCall(KSPGetConvergedReason(t->ksp, &reason));
    if (reason < 0) PetscFunctionReturn(0);
    PetscCall(VecPointwiseMult(t->lambda, t->work, t->mask));
    PetscCall(VecNorm(t->lambda, NORM_INFINITY, &largest));
    if (!(largest > 0) || PetscIsInfOrNanReal(largest)) PetscFunctionReturn(0);
    PetscCall(VecScale(t->lambda, 1 / largest));

    PetscCall(VecPointwiseMult(t->work, t->lambda, t->s));
    PetscCall(VecDot(t->work, t->lambda, &square));
    PetscCall(MatMult(t->P, t->lambda, t->work));
    PetscCall(VecPointwiseMult(t->work, t->work, t->d));
    PetscCall(VecNorm(t->work, NORM_2, &norm));
    *residual = norm / PetscSqrtReal(PetscAbsScalar(square));
  }
  PetscFunctionReturn(0);
}

/* Collects the rows with significant entries of lambda, scaled by sqrt(s), ascending; the same list on all ranks */
static PetscErrorCode Collect(Dependence *t, PetscInt max, PetscInt *n, PetscInt rows[])
{
  PetscReal                largest;
  PetscInt                 begin, end;
  PetscMPIInt              mine, size;
  const PetscScalar       *lambda;
  std::vector<PetscInt>    local, all;
  std::vector<PetscMPIInt> counts, starts;
  const MPI_Comm           comm = PetscObjectComm((PetscObject)t->P);

  PetscFunctionBegin;
  PetscCall(VecSqrtAbs(t->s));
  PetscCall(VecPointwiseMult(t->work, t->lambda, t->s));
  PetscCall(VecNorm(t->work, NORM_INFINITY, &largest));
  PetscCall(VecGetOwnershipRange(t->work, &begin, &end));
  PetscCall(VecGetArrayRead(t->work, &lambda));
  for (PetscInt i = 0; i < end - begin && (PetscInt)local.size() < max; ++i)
    if (PetscAbsScalar(lambda[i]) > MIN_COMPONENT * largest) local.push_back(begin + i);
  PetscCall(VecRestoreArrayRead(t->work, &lambda));

  PetscCallMPI(MPI_Comm_size(comm, &size));
  counts.resize(size);
  starts.assign(size + 1, 0);
  PetscCall(PetscMPIIntCast((PetscInt)local.size(), &mine));
  PetscCallMPI(MPI_Allgather(&mine, 1, MPI_INT, counts.data(), 1, MPI_INT, comm));
  for (PetscMPIInt r = 0; r < size; ++r) starts[r + 1] = starts[r] + counts[r];
  all.resize(starts[size]);
  PetscCallMPI(MPI_Allgatherv(local.data(), mine, MPIU_INT, all.data(), counts.data(), starts.data(), MPIU_INT, comm));
  *n = PetscMin(max, (PetscInt)all.size());
  std::copy(all.begin(), all.begin() + *n, rows);
  PetscFunctionReturn(0);
}

PetscErrorCode LinearNameDependent(Mat P, IS multipliers, PetscReal tolerance, PetscInt max, PetscInt *n, PetscInt rows[])
{
  Dependence t = {};
  PetscInt   count;
  PetscReal  residual;
  PetscBool  triangle;

  PetscFunctionBegin;
  *n = 0;
  PetscCall(ISGetSize(multipliers, &count));
  if (!count) PetscFunctionReturn(0);
  PetscCall(LinearStoresTriangle(P, &triangle)); /* complete rows are needed */
  if (triangle) PetscCall(MatConvert(P, MATAIJ, MAT_INITIAL_MATRIX, &t.P));
  else t.P = P;
  t.multipliers = multipliers;
  PetscCall(Create(&t));
  PetscCall(Iterate(&t, &residual));
  PetscCall(PetscInfo(P, "Null vector of the constraints: residual %g\n", (double)residual));
  if (residual <= tolerance) PetscCall(Collect(&t, max, n, rows));
  PetscCall(Destroy(&t));
  if (triangle) PetscCall(MatDestroy(&t.P));
  PetscFunctionReturn(0);
}
