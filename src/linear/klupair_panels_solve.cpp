/*
  Solves with the panels of "klupair".

  With M = L U by blocks, where the pivots of a panel are P L_K U_K, the places of a panel and what it reaches are taken
  together into one dense vector; a range of columns at a time is solved entry by entry, and the rest of the range's
  columns is a product of a dense matrix with a vector.
*/
#if defined(HHTDAE_HAVE_KLU)
#include "klupair_panels.h"
#include <algorithm>
#include <petscblaslapack.h>

/* Columns solved entry by entry at a time; products with fewer entries than SMALL are made here */
static const PetscInt CHUNK = KLU_PANELS_NARROW, SMALL = 200;

/* ---- dense matrices times vectors ---- */

/* y -= A x; columns of A may be known to be zero */
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
  if (rows * cols > SMALL) {
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
  if (rows * cols > SMALL) {
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

struct Panel {
  PetscInt        width, ld, rows, cols;
  const double   *lower, *upper;
  const PetscInt *row, *col, *exchange;
  const char     *zero_lower, *zero_upper;
  double         *x, *y; /* its own part of the vector; scratch for what it reaches */
};

} // namespace

static Panel Look(const KluPanel &q, KluPanels *p)
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

/* Places without gaps: vectors are used where they are */
static bool Together(const PetscInt place[], PetscInt count) { return count && place[count - 1] - place[0] == count - 1; }

static void Gather(const double x[], const PetscInt place[], PetscInt count, double y[])
{
  for (PetscInt i = 0; i < count; ++i) y[i] = x[place[i]];
}

static void Scatter(const double y[], const PetscInt place[], PetscInt count, double x[])
{
  for (PetscInt i = 0; i < count; ++i) x[place[i]] += y[i];
}

/* Exchanges, L^-1, and what follows from it further on */
static PetscErrorCode LowerForward(const Panel &q, double x[])
{
  PetscFunctionBegin;
  for (PetscInt k = 0; k < q.width; ++k)
    if (q.exchange[k] != k) std::swap(q.x[k], q.x[q.exchange[k]]);
  for (PetscInt first = 0, last; first < q.width; first = last) {
    last = PetscMin(first + CHUNK, q.width);
    for (PetscInt j = first; j < last; ++j)
      for (PetscInt i = j + 1; i < last; ++i) q.x[i] -= q.lower[i + j * q.ld] * q.x[j];
    PetscCall(Subtract(q.width - last, last - first, q.lower + last + first * q.ld, q.ld, q.x + first, q.x + last));
  }
  const double *below = q.lower + q.width;
  if (Together(q.row, q.rows)) {
    PetscCall(Subtract(q.rows, q.width, below, q.ld, q.x, x + q.row[0], q.zero_lower));
    PetscFunctionReturn(0);
  }
  std::fill(q.y, q.y + q.rows, 0.0);
  PetscCall(Subtract(q.rows, q.width, below, q.ld, q.x, q.y, q.zero_lower));
  Scatter(q.y, q.row, q.rows, x);
  PetscFunctionReturn(0);
}

/* What is known further on goes in, L^-T, exchanges back */
static PetscErrorCode LowerBackward(const Panel &q, const double x[])
{
  PetscFunctionBegin;
  const double *known = Together(q.row, q.rows) ? x + q.row[0] : q.y;
  if (known == q.y) Gather(x, q.row, q.rows, q.y);
  PetscCall(SubtractTransposed(q.rows, q.width, q.lower + q.width, q.ld, known, q.x, q.zero_lower));
  for (PetscInt last = q.width, first; last > 0; last = first) {
    first = (last - 1) / CHUNK * CHUNK;
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

/* U^-T, and what follows from it further on */
static PetscErrorCode UpperForward(const Panel &q, double x[])
{
  PetscFunctionBegin;
  for (PetscInt first = 0, last; first < q.width; first = last) {
    last = PetscMin(first + CHUNK, q.width);
    PetscCall(SubtractTransposed(first, last - first, q.lower + first * q.ld, q.ld, q.x, q.x + first));
    for (PetscInt j = first; j < last; ++j) {
      double rest = q.x[j];
      for (PetscInt i = first; i < j; ++i) rest -= q.lower[i + j * q.ld] * q.x[i];
      q.x[j] = rest / q.lower[j + j * q.ld];
    }
  }
  if (Together(q.col, q.cols)) {
    PetscCall(Subtract(q.cols, q.width, q.upper, q.cols, q.x, x + q.col[0], q.zero_upper));
    PetscFunctionReturn(0);
  }
  std::fill(q.y, q.y + q.cols, 0.0);
  PetscCall(Subtract(q.cols, q.width, q.upper, q.cols, q.x, q.y, q.zero_upper));
  Scatter(q.y, q.col, q.cols, x);
  PetscFunctionReturn(0);
}

/* What is known further on goes in, U^-1 */
static PetscErrorCode UpperBackward(const Panel &q, const double x[])
{
  PetscFunctionBegin;
  const double *known = Together(q.col, q.cols) ? x + q.col[0] : q.y;
  if (known == q.y) Gather(x, q.col, q.cols, q.y);
  PetscCall(SubtractTransposed(q.cols, q.width, q.upper, q.cols, known, q.x, q.zero_upper));
  for (PetscInt last = q.width, first; last > 0; last = first) {
    first = (last - 1) / CHUNK * CHUNK;
    for (PetscInt j = last; j-- > first;) {
      q.x[j] /= q.lower[j + j * q.ld];
      for (PetscInt i = first; i < j; ++i) q.x[i] -= q.lower[i + j * q.ld] * q.x[j];
    }
    PetscCall(Subtract(first, last - first, q.lower + first * q.ld, q.ld, q.x + first, q.x));
  }
  PetscFunctionReturn(0);
}

/* ---- one diagonal block, and what lies between them ---- */

static PetscErrorCode SolveBlock(KluPanels *p, PetscInt b, bool transposed)
{
  double *x = p->x.data();

  PetscFunctionBegin;
  for (PetscInt k = p->block[b]; k < p->block[b + 1]; ++k) {
    const Panel q = Look(p->panel[k], p);
    PetscCall(transposed ? UpperForward(q, x) : LowerForward(q, x));
  }
  for (PetscInt k = p->block[b + 1]; k-- > p->block[b];) {
    const Panel q = Look(p->panel[k], p);
    PetscCall(transposed ? LowerBackward(q, x) : UpperBackward(q, x));
  }
  PetscFunctionReturn(0);
}

static void Places(const KluPanels &p, PetscInt b, PetscInt *first, PetscInt *last)
{
  const KluPanel &end = p.panel[p.block[b + 1] - 1];
  *first              = p.panel[p.block[b]].first;
  *last               = end.first + end.width;
}

/* The blocks that stand above this one lose its part */
static void TakeOut(KluPanels *p, PetscInt b)
{
  PetscInt first, last;
  Places(*p, b, &first, &last);
  for (PetscInt c = first; c < last; ++c)
    for (PetscInt e = p->outer_start[c]; e < p->outer_start[c + 1]; ++e)
      p->x[p->outer[e]] -= p->value[p->outer_values + (size_t)e] * p->x[c];
}

/* Of the transpose, this one loses the part of the blocks above it */
static void TakeOutTransposed(KluPanels *p, PetscInt b)
{
  PetscInt first, last;
  Places(*p, b, &first, &last);
  for (PetscInt c = first; c < last; ++c)
    for (PetscInt e = p->outer_start[c]; e < p->outer_start[c + 1]; ++e)
      p->x[c] -= p->value[p->outer_values + (size_t)e] * p->x[p->outer[e]];
}

PetscErrorCode KluPanelsSolve(KluPanels *p, bool transposed, double x[])
{
  const PetscInt               blocks = (PetscInt)p->block.size() - 1;
  const std::vector<PetscInt> &in = transposed ? p->col : p->row, &out = transposed ? p->row : p->col;

  PetscFunctionBegin;
  for (PetscInt k = 0; k < p->n; ++k) p->x[k] = x[in[k]];
  for (PetscInt b = 0; b < blocks; ++b) {
    const PetscInt now = transposed ? b : blocks - 1 - b;
    if (transposed) TakeOutTransposed(p, now);
    PetscCall(SolveBlock(p, now, transposed));
    if (!transposed) TakeOut(p, now);
  }
  for (PetscInt k = 0; k < p->n; ++k) x[out[k]] = p->x[k];
  PetscFunctionReturn(0);
}

#endif
