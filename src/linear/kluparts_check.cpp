/* Whether the interiors of "kluparts" are regular enough, and which unknowns should leave them if not */
#if defined(HHTDAE_HAVE_KLU)
#include "kluparts_data.h"
#include "vectors.h"
#include <algorithm>
#include <petsc/private/matimpl.h>

/* Of inverse iteration: the first meets every null vector, the others leave little else */
static const int SWEEPS = 3;

/* Of every entry, to make a singular matrix regular */
static const PetscReal DISTURBANCE = 1e-7;

/* Largest entries of the interior's rows, with what couples them to the interface */
static std::vector<PetscReal> RowSizes(const PartsSplit &s)
{
  std::vector<PetscReal> size(s.inner_row.size(), 0);
  for (size_t i = 0; i < size.size(); ++i)
    for (PetscInt k = s.start[i]; k < s.start[i + 1]; ++k) size[i] = PetscMax(size[i], PetscAbsScalar(s.val[k]));
  for (size_t e = 0; e < s.right.size(); ++e)
    size[s.right[e].row] = PetscMax(size[s.right[e].row], PetscAbsScalar(s.right_val[e]));
  return size;
}

/* Largest entries of its columns where the rows are divided by their sizes; interface rows by what is listed */
static std::vector<PetscReal> ColumnSizes(const PartsSplit &s, const std::vector<PetscReal> &rows)
{
  std::vector<PetscReal> size(rows.size(), 0), top(s.local.size(), 0);
  const auto             take = [&size](PetscInt j, PetscReal v) { size[j] = PetscMax(size[j], v); };
  for (size_t i = 0; i < rows.size(); ++i)
    for (PetscInt k = s.start[i]; k < s.start[i + 1]; ++k)
      take(s.col[k], rows[i] > 0 ? PetscAbsScalar(s.val[k]) / rows[i] : 0);
  for (size_t e = 0; e < s.below.size(); ++e)
    top[s.below[e].row] = PetscMax(top[s.below[e].row], PetscAbsScalar(s.below_val[e]));
  for (size_t e = 0; e < s.below.size(); ++e)
    if (top[s.below[e].row] > 0) take(s.below[e].col, PetscAbsScalar(s.below_val[e]) / top[s.below[e].row]);
  return size;
}

namespace
{

/* What every row leaves, and what it sums up; b is 0 in the interface */
struct Sums {
  std::vector<PetscScalar> left;
  std::vector<PetscReal>   size;

  void add(PetscInt row, PetscScalar term)
  {
    left[row] -= term;
    size[row] += PetscAbsScalar(term);
  }
  PetscReal largest() const
  {
    PetscReal r = 0;
    for (size_t i = 0; i < left.size(); ++i) {
      if (PetscIsInfOrNanScalar(left[i])) return 1;
      if (size[i] > 0) r = PetscMax(r, PetscAbsScalar(left[i]) / size[i]);
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
  std::vector<PetscScalar>     b(s.number.size(), 0), x(s.number.size(), 0), left(N);
  Sums inner{{}, std::vector<PetscReal>(n, 0)}, top{std::vector<PetscScalar>(N, 0), std::vector<PetscReal>(N, 0)};

  PetscFunctionBegin;
  for (PetscInt i = 0; i < n; ++i) {
    b[s.inner_row[i]] = size[i] * LinearPseudoRandomValue((uint64_t)(s.begin + s.inner_row[i]), 0);
    inner.left.push_back(b[s.inner_row[i]]);
    inner.size[i] = PetscAbsScalar(b[s.inner_row[i]]);
  }
  PetscCall(PartsSolve(p, b.data(), x.data()));
  for (PetscInt i = 0; i < n; ++i)
    for (PetscInt k = s.start[i]; k < s.start[i + 1]; ++k) inner.add(i, s.val[k] * x[s.inner_row[s.col[k]]]);
  for (size_t e = 0; e < s.right.size(); ++e)
    inner.add(s.right[e].row, s.right_val[e] * p->top[s.local[s.right[e].col]]);
  for (size_t e = 0; e < s.below.size(); ++e)
    top.add(s.local[s.below[e].row], s.below_val[e] * x[s.inner_row[s.below[e].col]]);
  for (size_t e = 0; e < s.corner.size(); ++e) top.add(s.corner[e].row, s.corner_val[e] * p->top[s.corner[e].col]);
  if (N) {
    PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, top.left.data(), (PetscMPIInt)N, MPIU_SCALAR, MPI_SUM, p->comm));
    PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, top.size.data(), (PetscMPIInt)N, MPIU_REAL, MPI_SUM, p->comm));
  }
  *residual = PetscMax(inner.largest(), top.largest());
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, residual, 1, MPIU_REAL, MPI_MAX, p->comm));
  ++p->checks;
  PetscFunctionReturn(0);
}

/*
  Inverse iteration with the interior alone, rows divided by r and columns by c: the size of the inverse, and the place
  of the largest number in the vector that it maps to that. With the transpose instead, r and c change places.
*/
static PetscErrorCode Iterate(KluPair *k, bool transposed, const std::vector<PetscReal> &r,
                              const std::vector<PetscReal> &c, PetscReal *inverse, PetscInt *largest)
{
  const PetscInt           n = (PetscInt)r.size();
  std::vector<PetscScalar> z(n), w(n);

  PetscFunctionBegin;
  for (PetscInt i = 0; i < n; ++i) w[i] = LinearPseudoRandomValue((uint64_t)i, 0);
  for (int sweep = 0; sweep < SWEEPS; ++sweep) {
    for (PetscInt i = 0; i < n; ++i) z[i] = r[i] * w[i];
    /* KLU holds the transpose */
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

/* Rows and columns that no pivot can be found for */
static PetscErrorCode Unmatched(KluParts *p, std::vector<PetscInt> *move)
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

/* Where it is a matter of values, KLU may meet its zero far from the cause. A matrix next to this one has factors, and
   the null vector of this one, nearly. */
static PetscErrorCode Disturb(KluParts *p, std::vector<PetscInt> *move)
{
  MatFactorInfo  info;
  MatFactorError error;
  PetscReal      inverse;

  PetscFunctionBegin;
  for (size_t k = 0; k < p->split.val.size(); ++k) p->split.val[k] *= 1 + DISTURBANCE * LinearPseudoRandomValue(k, 0);
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
  PetscCall(Unmatched(p, move));
  if (move->empty()) PetscCall(Disturb(p, move));
  if (move->empty() && row >= 0 && row < (PetscInt)p->split.inner_row.size()) move->push_back(p->split.inner_row[row]);
  PetscFunctionReturn(0);
}

#endif
