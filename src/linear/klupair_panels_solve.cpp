/*
  Solves with the panels of "klupair".

  M = L U by blocks; the diagonal block of a panel is P L_K U_K. The components of the vector at the places that a panel reaches are
  gathered into a dense vector. Within a panel BLOCK_COLUMNS columns at a time are solved entry by entry, and the rows
  outside of these columns by a product of a dense matrix with a vector.
*/
#if defined(HHTDAE_HAVE_KLU)
#include "klupair_panels.h"
#include <algorithm>
#include <petscblaslapack.h>

/* Columns solved entry by entry at a time; products of matrices with fewer than MIN_BLAS_ENTRIES entries are computed by loops in place of BLAS */
static const PetscInt BLOCK_COLUMNS = KLU_PANELS_NARROW, MIN_BLAS_ENTRIES = 200;

/* ---- dense matrices times vectors ---- */

/* y -= A x; zero[k]: column k of A is zero */
static PetscErrorCode Subtract(PetscInt rows, PetscInt cols, const double a[], PetscInt ld, const double x[],
                               double y[], const char zero[] = NULL)
{
  const PetscScalar  minus = -1, one = 1;
  const PetscBLASInt m = (PetscBLASInt)rows, n = (PetscBLASInt)cols, lda = (PetscBLASInt)ld, step = 1;

  PetscFunctionBegin;
  if (zero && cols <= KLU_PANELS_NARROW) {
    KluPanelsSubtractNarrow(rows, cols, a, ld, zero, x, y);
    PetscFunctionReturn(0);
  }
  if (rows * cols > MIN_BLAS_ENTRIES) {
    PetscCallBLAS("BLASgemv", BLASgemv_("N", &m, &n, &minus, a, &lda, x, &step, &one, y, &step));
    PetscFunctionReturn(0);
  }
  for (PetscInt j = 0; j < cols; ++j, a += ld)
    for (PetscInt i = 0; i < rows; ++i) y[i] -= a[i] * x[j];
  PetscFunctionReturn(0);
}

/* y -= A^T x */
static PetscErrorCode SubtractTransposed(PetscInt rows, PetscInt cols, const double a[], PetscInt ld, const double x[],
                                         double y[], const char zero[] = NULL)
{
  const PetscScalar  minus = -1, one = 1;
  const PetscBLASInt m = (PetscBLASInt)rows, n = (PetscBLASInt)cols, lda = (PetscBLASInt)ld, step = 1;

  PetscFunctionBegin;
  if (zero && cols <= KLU_PANELS_NARROW) {
    KluPanelsSubtractTransposedNarrow(rows, cols, a, ld, zero, x, y);
    PetscFunctionReturn(0);
  }
  if (rows * cols > MIN_BLAS_ENTRIES) {
    PetscCallBLAS("BLASgemv", BLASgemv_("T", &m, &n, &minus, a, &lda, x, &step, &one, y, &step));
    PetscFunctionReturn(0);
  }
  for (PetscInt j = 0; j < cols; ++j, a += ld) {
    double sum = 0;
    for (PetscInt i = 0; i < rows; ++i) sum += a[i] * x[i];
    y[j] -= sum;
  }
  PetscFunctionReturn(0);
}

/* ---- one panel ---- */

namespace
{

struct PanelView {
  PetscInt        width, ld, rows, cols;
  const double   *lower, *upper;
  const PetscInt *row, *col, *exchange;
  const char     *zero_lower, *zero_upper;
  double         *x, *y; /* the panel's part of the vector; scratch for the places that it reaches */
};

} // namespace

static PanelView ViewPanel(const KluPanel &q, KluPanels *p)
{
  return {q.width,
          q.width + q.rows.count,
          q.rows.count,
          q.cols.count,
          p->value.data() + q.lower,
          p->value.data() + q.upper,
          p->reached.data() + q.rows.start,
          p->reached.data() + q.cols.start,
          p->exchange.data() + q.first,
          p->zero_lower.data() + q.first,
          p->zero_upper.data() + q.first,
          p->x.data() + q.first,
          p->y.data()};
}

/* Consecutive places need no gathering */
static bool AreConsecutive(const PetscInt place[], PetscInt count) { return count && place[count - 1] - place[0] == count - 1; }

static void Gather(const double x[], const PetscInt place[], PetscInt count, double y[])
{
  for (PetscInt i = 0; i < count; ++i) y[i] = x[place[i]];
}

static void Scatter(const double y[], const PetscInt place[], PetscInt count, double x[])
{
  for (PetscInt i = 0; i < count; ++i) x[place[i]] += y[i];
}

/* Row exchanges and L_K^-1; subtracts L(R,K) x_K from the components R */
static PetscErrorCode LowerForward(const PanelView &q, double x[])
{
  PetscFunctionBegin;
  for (PetscInt k = 0; k < q.width; ++k)
    if (q.exchange[k] != k) std::swap(q.x[k], q.x[q.exchange[k]]);
  for (PetscInt first = 0, last; first < q.width; first = last) {
    last = PetscMin(first + BLOCK_COLUMNS, q.width);
    for (PetscInt j = first; j < last; ++j)
      for (PetscInt i = j + 1; i < last; ++i) q.x[i] -= q.lower[i + j * q.ld] * q.x[j];
    PetscCall(Subtract(q.width - last, last - first, q.lower + last + first * q.ld, q.ld, q.x + first, q.x + last));
  }
  const double *below = q.lower + q.width;
  if (AreConsecutive(q.row, q.rows)) {
    PetscCall(Subtract(q.rows, q.width, below, q.ld, q.x, x + q.row[0], q.zero_lower));
    PetscFunctionReturn(0);
  }
  std::fill(q.y, q.y + q.rows, 0.0);
  PetscCall(Subtract(q.rows, q.width, below, q.ld, q.x, q.y, q.zero_lower));
  Scatter(q.y, q.row, q.rows, x);
  PetscFunctionReturn(0);
}

/* Subtracts L(R,K)^T x_R from x_K, applies L_K^-T and the inverse row exchanges */
static PetscErrorCode LowerBackward(const PanelView &q, const double x[])
{
  PetscFunctionBegin;
  const double *later = AreConsecutive(q.row, q.rows) ? x + q.row[0] : q.y;
  if (later == q.y) Gather(x, q.row, q.rows, q.y);
  PetscCall(SubtractTransposed(q.rows, q.width, q.lower + q.width, q.ld, later, q.x, q.zero_lower));
  for (PetscInt last = q.width, first; last > 0; last = first) {
    first = (last - 1) / BLOCK_COLUMNS * BLOCK_COLUMNS;
    PetscCall(SubtractTransposed(q.width - last, last - first, q.lower + last + first * q.ld, q.ld, q.x + last,
                                 q.x + first));
    for (PetscInt j = last; j-- > first;) {
      double rest = q.x[j];
      for (PetscInt i = j + 1; i < last; ++i) rest -= q.lower[i + j * q.ld] * q.x[i];
      q.x[j] = rest;
    }
  }
  for (PetscInt k = q.width; k-- > 0;)
    if (q.exchange[k] != k) std::swap(q.x[k], q.x[q.exchange[k]]);
  PetscFunctionReturn(0);
}

/* U_K^-T; subtracts U(K,C)^T x_K from the components C */
static PetscErrorCode UpperForward(const PanelView &q, double x[])
{
  PetscFunctionBegin;
  for (PetscInt first = 0, last; first < q.width; first = last) {
    last = PetscMin(first + BLOCK_COLUMNS, q.width);
    PetscCall(SubtractTransposed(first, last - first, q.lower + first * q.ld, q.ld, q.x, q.x + first));
    for (PetscInt j = first; j < last; ++j) {
      double rest = q.x[j];
      for (PetscInt i = first; i < j; ++i) rest -= q.lower[i + j * q.ld] * q.x[i];
      q.x[j] = rest / q.lower[j + j * q.ld];
    }
  }
  if (AreConsecutive(q.col, q.cols)) {
    PetscCall(Subtract(q.cols, q.width, q.upper, q.cols, q.x, x + q.col[0], q.zero_upper));
    PetscFunctionReturn(0);
  }
  std::fill(q.y, q.y + q.cols, 0.0);
  PetscCall(Subtract(q.cols, q.width, q.upper, q.cols, q.x, q.y, q.zero_upper));
  Scatter(q.y, q.col, q.cols, x);
  PetscFunctionReturn(0);
}

/* Subtracts U(K,C) x_C from x_K and applies U_K^-1 */
static PetscErrorCode UpperBackward(const PanelView &q, const double x[])
{
  PetscFunctionBegin;
  const double *later = AreConsecutive(q.col, q.cols) ? x + q.col[0] : q.y;
  if (later == q.y) Gather(x, q.col, q.cols, q.y);
  PetscCall(SubtractTransposed(q.cols, q.width, q.upper, q.cols, later, q.x, q.zero_upper));
  for (PetscInt last = q.width, first; last > 0; last = first) {
    first = (last - 1) / BLOCK_COLUMNS * BLOCK_COLUMNS;
    for (PetscInt j = last; j-- > first;) {
      q.x[j] /= q.lower[j + j * q.ld];
      for (PetscInt i = first; i < j; ++i) q.x[i] -= q.lower[i + j * q.ld] * q.x[j];
    }
    PetscCall(Subtract(first, last - first, q.lower + first * q.ld, q.ld, q.x + first, q.x));
  }
  PetscFunctionReturn(0);
}

/* ---- one diagonal block, and the entries between diagonal blocks ---- */

static PetscErrorCode SolveBlock(KluPanels *p, PetscInt b, bool transposed)
{
  double *x = p->x.data();

  PetscFunctionBegin;
  for (PetscInt k = p->block[b]; k < p->block[b + 1]; ++k) {
    const PanelView q = ViewPanel(p->panel[k], p);
    PetscCall(transposed ? UpperForward(q, x) : LowerForward(q, x));
  }
  for (PetscInt k = p->block[b + 1]; k-- > p->block[b];) {
    const PanelView q = ViewPanel(p->panel[k], p);
    PetscCall(transposed ? LowerBackward(q, x) : UpperBackward(q, x));
  }
  PetscFunctionReturn(0);
}

static void BlockRange(const KluPanels &p, PetscInt b, PetscInt *first, PetscInt *last)
{
  const KluPanel &end = p.panel[p.block[b + 1] - 1];
  *first              = p.panel[p.block[b]].first;
  *last               = end.first + end.width;
}

/* Subtracts the product of the columns of block b with its solution from the blocks above it */
static void SubtractOffBlock(KluPanels *p, PetscInt b)
{
  PetscInt first, last;
  BlockRange(*p, b, &first, &last);
  for (PetscInt c = first; c < last; ++c)
    for (PetscInt e = p->off_block_start[c]; e < p->off_block_start[c + 1]; ++e)
      p->x[p->off_block[e]] -= p->value[p->off_block_values + (size_t)e] * p->x[c];
}

/* For the transpose: subtracts the contributions of the blocks above block b from its right-hand side */
static void SubtractOffBlockTransposed(KluPanels *p, PetscInt b)
{
  PetscInt first, last;
  BlockRange(*p, b, &first, &last);
  for (PetscInt c = first; c < last; ++c)
    for (PetscInt e = p->off_block_start[c]; e < p->off_block_start[c + 1]; ++e)
      p->x[c] -= p->value[p->off_block_values + (size_t)e] * p->x[p->off_block[e]];
}

PetscErrorCode KluPanelsSolve(KluPanels *p, bool transposed, double x[])
{
  const PetscInt               blocks = (PetscInt)p->block.size() - 1;
  const std::vector<PetscInt> &in = transposed ? p->col : p->row, &out = transposed ? p->row : p->col;

  PetscFunctionBegin;
  for (PetscInt k = 0; k < p->n; ++k) p->x[k] = x[in[k]];
  for (PetscInt b = 0; b < blocks; ++b) {
    const PetscInt current = transposed ? b : blocks - 1 - b;
    if (transposed) SubtractOffBlockTransposed(p, current);
    PetscCall(SolveBlock(p, current, transposed));
    if (!transposed) SubtractOffBlock(p, current);
  }
  for (PetscInt k = 0; k < p->n; ++k) x[out[k]] = p->x[k];
  PetscFunctionReturn(0);
}

#endif
