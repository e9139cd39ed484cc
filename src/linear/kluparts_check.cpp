/* Checks whether the interiors of "kluparts" are far enough from singular, and finds the unknowns that should leave them if not */
#if defined(HHTDAE_HAVE_KLU)
#include "kluparts_data.h"
#include "vectors.h"
#include <algorithm>
#include <petsc/private/matimpl.h>

/* The first iteration amplifies all null vectors of a nearly singular interior, the others reduce the remaining components */
static const int INVERSE_ITERATIONS = 3;

/* Relative perturbation of every entry that makes a singular interior regular */
static const PetscReal PERTURBATION = 1e-7;

/* Largest entry of each row of [A B] */
static std::vector<PetscReal> RowSizes(const PartsSplit &s)
{
  std::vector<PetscReal> size(s.inner_row.size(), 0);
  for (size_t i = 0; i < size.size(); ++i)
    for (PetscInt k = s.start[i]; k < s.start[i + 1]; ++k) size[i] = PetscMax(size[i], PetscAbsScalar(s.val[k]));
  for (size_t e = 0; e < s.right.size(); ++e)
    size[s.right[e].row] = PetscMax(size[s.right[e].row], PetscAbsScalar(s.right_val[e]));
  return size;
}

/* Largest entry of each column of [A; C] after dividing the rows by their sizes; the size of an interface row is taken from C */
static std::vector<PetscReal> ColumnSizes(const PartsSplit &s, const std::vector<PetscReal> &rows)
{
  std::vector<PetscReal> size(rows.size(), 0), at_interface(s.local.size(), 0);
  const auto             take = [&size](PetscInt j, PetscReal v) { size[j] = PetscMax(size[j], v); };
  for (size_t i = 0; i < rows.size(); ++i)
    for (PetscInt k = s.start[i]; k < s.start[i + 1]; ++k)
      take(s.col[k], rows[i] > 0 ? PetscAbsScalar(s.val[k]) / rows[i] : 0);
  for (size_t e = 0; e < s.below.size(); ++e)
    at_interface[s.below[e].row] = PetscMax(at_interface[s.below[e].row], PetscAbsScalar(s.below_val[e]));
  for (size_t e = 0; e < s.below.size(); ++e)
    if (at_interface[s.below[e].row] > 0) take(s.below[e].col, PetscAbsScalar(s.below_val[e]) / at_interface[s.below[e].row]);
  return size;
}

namespace
{

/* Residual of each row and the sum of the absolute values of its terms; b is 0 in the interface */
struct RowResiduals {
  std::vector<PetscScalar> remainder;
  std::vector<PetscReal>   size;

  void add(PetscInt row, PetscScalar term)
  {
    remainder[row] -= term;
    size[row] += PetscAbsScalar(term);
  }
  PetscReal largest() const
  {
    PetscReal r = 0;
    for (size_t i = 0; i < remainder.size(); ++i) {
      if (PetscIsInfOrNanScalar(remainder[i])) return 1;
      if (size[i] > 0) r = PetscMax(r, PetscAbsScalar(remainder[i]) / size[i]);
    }
    return r;
  }
};

} // namespace

PetscErrorCode PartsResidual(KluParts *p, PetscReal *residual)
{
  const PartsSplit            &s = p->split;
  const PetscInt               n = (PetscInt)s.inner_row.size(), N = (PetscInt)s.interface.size();
  const std::vector<PetscReal> size = RowSizes(s);
  std::vector<PetscScalar>     b(s.number.size(), 0), x(s.number.size(), 0);
  RowResiduals                 inner{{}, std::vector<PetscReal>(n, 0)}, at_interface{std::vector<PetscScalar>(N, 0), std::vector<PetscReal>(N, 0)};

  PetscFunctionBegin;
  for (PetscInt i = 0; i < n; ++i) {
    b[s.inner_row[i]] = size[i] * LinearPseudoRandomValue((uint64_t)(s.begin + s.inner_row[i]), 0);
    inner.remainder.push_back(b[s.inner_row[i]]);
    inner.size[i] = PetscAbsScalar(b[s.inner_row[i]]);
  }
  PetscCall(PartsSolve(p, b.data(), x.data()));
  for (PetscInt i = 0; i < n; ++i)
    for (PetscInt k = s.start[i]; k < s.start[i + 1]; ++k) inner.add(i, s.val[k] * x[s.inner_row[s.col[k]]]);
  for (size_t e = 0; e < s.right.size(); ++e)
    inner.add(s.right[e].row, s.right_val[e] * p->at_interface[s.local[s.right[e].col]]);
  for (size_t e = 0; e < s.below.size(); ++e)
    at_interface.add(s.local[s.below[e].row], s.below_val[e] * x[s.inner_row[s.below[e].col]]);
  for (size_t e = 0; e < s.corner.size(); ++e) at_interface.add(s.corner[e].row, s.corner_val[e] * p->at_interface[s.corner[e].col]);
  if (N) {
    PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, at_interface.remainder.data(), (PetscMPIInt)N, MPIU_SCALAR, MPI_SUM, p->comm));
    PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, at_interface.size.data(), (PetscMPIInt)N, MPIU_REAL, MPI_SUM, p->comm));
  }
  *residual = PetscMax(inner.largest(), at_interface.largest());
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, residual, 1, MPIU_REAL, MPI_MAX, p->comm));
  ++p->checks;
  PetscFunctionReturn(0);
}

/*
  Inverse iteration with the interior A, its rows divided by r and its columns by c: estimates the norm of the inverse and
  finds the index of the largest component of the vector. With the transpose the caller exchanges r and c.
*/
static PetscErrorCode Iterate(KluPair *k, bool transposed, const std::vector<PetscReal> &r,
                              const std::vector<PetscReal> &c, PetscReal *inverse, PetscInt *largest)
{
  const PetscInt           n = (PetscInt)r.size();
  std::vector<PetscScalar> z(n), w(n);

  PetscFunctionBegin;
  for (PetscInt i = 0; i < n; ++i) w[i] = LinearPseudoRandomValue((uint64_t)i, 0);
  for (int sweep = 0; sweep < INVERSE_ITERATIONS; ++sweep) {
    for (PetscInt i = 0; i < n; ++i) z[i] = r[i] * w[i];
    /* KLU has factored the transpose */
    const KluInt ok = transposed ? KLU(solve)(k->symbolic, k->numeric, (KluInt)n, 1, z.data(), &k->common)
                                 : KLU(tsolve)(k->symbolic, k->numeric, (KluInt)n, 1, z.data(), &k->common);
    PetscCheck(ok, PETSC_COMM_SELF, PETSC_ERR_LIB, "KLU's solve with %" PetscInt_FMT " rows failed with status %d", n,
               (int)k->common.status);
    *largest = 0;
    for (PetscInt i = 0; i < n; ++i) {
      w[i] = c[i] * z[i];
      if (!(PetscAbsScalar(w[i]) <= PetscAbsScalar(w[*largest]))) *largest = i;
    }
    const PetscReal growth = PetscAbsScalar(w[*largest]);
    *inverse               = PetscIsInfOrNanReal(growth) ? PETSC_MAX_REAL : growth;
    if (PetscIsInfOrNanReal(growth) || growth == 0) break;
    for (PetscInt i = 0; i < n; ++i) w[i] /= growth;
  }
  PetscFunctionReturn(0);
}

PetscErrorCode PartsNearNull(KluParts *p, PetscReal threshold, PetscReal *inverse, std::vector<PetscInt> *move)
{
  const PartsSplit &s = p->split;
  PetscInt          largest;

  PetscFunctionBegin;
  *inverse = 0;
  if (!p->klu || !p->klu->numeric) PetscFunctionReturn(0);
  const std::vector<PetscReal> rows = RowSizes(s), cols = ColumnSizes(s, rows);
  PetscCall(Iterate(p->klu, false, rows, cols, inverse, &largest));
  if (*inverse <= threshold) PetscFunctionReturn(0);
  move->push_back(s.inner_row[largest]);
  PetscReal transposed;
  PetscCall(Iterate(p->klu, true, cols, rows, &transposed, &largest));
  if (transposed > threshold) move->push_back(s.inner_row[largest]);
  PetscFunctionReturn(0);
}

/* ---- after KLU failed ---- */

/* Rows and columns of the interior without a pivot: it is structurally singular */
static PetscErrorCode FindUnmatched(KluParts *p, std::vector<PetscInt> *move)
{
  const PartsSplit &s = p->split;
  LinearPivots      pivots;
  LinearRows        rows;

  PetscFunctionBegin;
  PetscCall(KluPairGetRows(p->inner, &rows));
  LinearFindPivots(rows, &pivots);
  for (PetscInt i = 0; i < rows.n; ++i) {
    const PetscInt j    = pivots.col[i];
    bool           zero = true;
    for (PetscInt k = rows.start[i]; k < rows.start[i + 1]; ++k)
      if (rows.col[k] == j && PetscAbsScalar(rows.val[k]) > 0) zero = false;
    if (!zero) continue;
    move->push_back(s.inner_row[i]);
    if (j != i) move->push_back(s.inner_row[j]);
  }
  PetscCall(KluPairRestoreRows(p->inner, &rows));
  PetscFunctionReturn(0);
}

/* For an interior that is singular by its values, KLU's zero pivot may be far from the cause. A slightly perturbed interior can be factored, and inverse
   iteration with it converges to the null vector. */
static PetscErrorCode PerturbAndFactor(KluParts *p, std::vector<PetscInt> *move)
{
  MatFactorInfo  info;
  MatFactorError error;
  PetscReal      inverse;

  PetscFunctionBegin;
  for (size_t k = 0; k < p->split.val.size(); ++k) p->split.val[k] *= 1 + PERTURBATION * LinearPseudoRandomValue(k, 0);
  PetscCall(PetscObjectStateIncrease((PetscObject)p->inner));
  PetscCall(MatFactorInfoInitialize(&info));
  PetscCall(MatLUFactorNumeric(p->factor, p->inner, &info));
  PetscCall(MatFactorGetError(p->factor, &error));
  if (!error) PetscCall(PartsNearNull(p, 0, &inverse, move));
  PetscFunctionReturn(0);
}

PetscErrorCode PartsAfterFailure(KluParts *p, std::vector<PetscInt> *move)
{
  const PetscInt row = p->factor->factorerror_zeropivot_row;

  PetscFunctionBegin;
  PetscCall(FindUnmatched(p, move));
  if (move->empty()) PetscCall(PerturbAndFactor(p, move));
  if (move->empty() && row >= 0 && row < (PetscInt)p->split.inner_row.size()) move->push_back(p->split.inner_row[row]);
  PetscFunctionReturn(0);
}

#endif
