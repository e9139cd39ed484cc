/* Whether the interiors of "kluparts" are regular enough, and which unknowns should leave them if not */
#if defined(HHTDAE_HAVE_KLU)
#include "kluparts_data.h"
#include <algorithm>
#include <petsc/private/matimpl.h>

/* An inverse of the interior, its rows and columns scaled to one, as large as this takes half of the digits away */
static const PetscReal NEARLY_SINGULAR = 1e8;

/* Between 1/2 and 1 in size, of either sign, the same in every run */
static PetscScalar Number(PetscInt i)
{
  const double x = (double)((unsigned long long)i * 2654435761ULL % 4294967296ULL) / 4294967296.0;
  return x < 0.5 ? -0.5 - x : x;
}

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

PetscErrorCode PartsResidual(KluParts *p, PetscReal *residual)
{
  const PartsSplit            &s = p->split;
  const PetscInt               n = (PetscInt)s.inner_row.size(), N = (PetscInt)s.interface.size();
  const std::vector<PetscReal> size = RowSizes(s);
  std::vector<PetscScalar>     b(s.number.size(), 0), x(s.number.size(), 0), left(N);
  Sums inner{{}, std::vector<PetscReal>(n, 0)}, top{std::vector<PetscScalar>(N, 0), std::vector<PetscReal>(N, 0)};

  PetscFunctionBegin;
  for (PetscInt i = 0; i < n; ++i) {
    b[s.inner_row[i]] = size[i] * Number(s.begin + s.inner_row[i]);
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

/* Inverse iteration with the interior alone, rows scaled by their largest entries and columns, too */
PetscErrorCode PartsNearNull(KluParts *p, PetscInt *row)
{
  PartsSplit    &s = p->split;
  const PetscInt n = (PetscInt)s.inner_row.size();
  KluPair       *k = p->klu;

  PetscFunctionBegin;
  *row = -1;
  if (!k || !k->numeric) PetscFunctionReturn(0);
  std::vector<PetscReal>   rows(n, 0), cols(n, 0);
  std::vector<PetscScalar> z(n), w(n);
  for (PetscInt i = 0; i < n; ++i)
    for (PetscInt e = s.start[i]; e < s.start[i + 1]; ++e) rows[i] = PetscMax(rows[i], PetscAbsScalar(s.val[e]));
  for (PetscInt i = 0; i < n; ++i)
    for (PetscInt e = s.start[i]; e < s.start[i + 1]; ++e)
      cols[s.col[e]] = PetscMax(cols[s.col[e]], PetscAbsScalar(s.val[e]) / rows[i]);
  for (PetscInt i = 0; i < n; ++i) w[i] = Number(s.begin + s.inner_row[i]);
  for (int sweep = 0; sweep < 3; ++sweep) {
    for (PetscInt i = 0; i < n; ++i) z[i] = rows[i] * w[i];
    PetscCheck(KLU(tsolve)(k->symbolic, k->numeric, (KluInt)n, 1, z.data(), &k->common), PETSC_COMM_SELF, PETSC_ERR_LIB,
               "KLU's solve with %" PetscInt_FMT " rows failed with status %d", n, (int)k->common.status);
    PetscInt largest = 0;
    for (PetscInt i = 0; i < n; ++i) {
      w[i] = cols[i] * z[i];
      if (!(PetscAbsScalar(w[i]) <= PetscAbsScalar(w[largest]))) largest = i;
    }
    const PetscReal growth = PetscAbsScalar(w[largest]);
    if (!(growth <= NEARLY_SINGULAR)) *row = s.inner_row[largest];
    if (PetscIsInfOrNanReal(growth) || growth == 0) break;
    for (PetscInt i = 0; i < n; ++i) w[i] /= growth;
  }
  PetscFunctionReturn(0);
}

/* Rows and columns that no pivot can be found for, or else the row that KLU met a zero pivot in */
PetscErrorCode PartsUnmatched(KluParts *p, std::vector<PetscInt> *unmatched)
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
    unmatched->push_back(s.inner_row[i]);
    if (j != i) unmatched->push_back(s.inner_row[j]);
  }
  PetscCall(KluPairRestoreRows(p->inner, &rows));
  if (unmatched->empty()) {
    PetscInt row = p->factor->factorerror_zeropivot_row;
    if (row >= 0 && row < (PetscInt)s.inner_row.size()) unmatched->push_back(s.inner_row[row]);
  }
  PetscFunctionReturn(0);
}

#endif
