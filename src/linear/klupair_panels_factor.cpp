/* Numbers for the panels of "klupair": what the panels before contribute, the factors of each, how much entries grow */
#if defined(HHTDAE_HAVE_KLU)
#include "klupair_panels.h"
#include <algorithm>
#include <petscblaslapack.h>

/* Columns of panels before that are multiplied at a time */
static const PetscInt SIDE_BY_SIDE = 256;

/* Costs in operations of a dense product: per entry copied, per entry added somewhere, per call of BLAS */
static const double COPY = 15, ADD = 20, CALL = 5000;

/* Products with fewer operations are made by loops */
static const double FEW = 1000;

/* Largest allowed width + rows is that of a matrix with PETSc's indices for BLAS */
typedef PetscBLASInt Int;

/* ---- contributions ---- */

namespace
{

/* Rows of `lower` or of K and `upper` that others reach: before `last`, not before `first` */
struct Reached {
  Int first, last;
  Int count() const { return last - first; }
  void add(PetscInt begin, PetscInt end)
  {
    first = PetscMin(first, (Int)begin);
    last  = PetscMax(last, (Int)end);
  }
};

/* The panel at work, and how many columns of others stand side by side in left and right */
struct Work {
  const KluPanel *q;
  Int             width, left, right, columns; /* left: rows of `lower`; right: those of `upper` under K's own */
  Reached         rows, cols;                  /* what stands side by side, of these */
};

} // namespace

static PetscErrorCode Multiply(Work *w, KluPanels *p)
{
  const PetscScalar minus = -1, one = 1;
  const Int         rows = w->rows.count(), cols = w->cols.count(), below = w->right - w->width;
  const Int         inner_rows = PetscMin(w->rows.last, w->width) - w->rows.first;
  const Int         inner_cols = PetscMin(w->cols.last, w->width) - w->cols.first;
  const Int         skip = PetscMax(inner_cols, 0), outer_cols = cols - skip;
  const double     *left = p->left.data(), *right = p->right.data();

  PetscFunctionBegin;
  if (!w->columns) PetscFunctionReturn(0);
  if (inner_cols > 0) {
    double *to = p->value.data() + w->q->lower + w->rows.first + (size_t)w->cols.first * (size_t)w->left;
    PetscCallBLAS("BLASgemm", BLASgemm_("N", "T", &rows, &inner_cols, &w->columns, &minus, left, &rows, right, &cols,
                                        &one, to, &w->left));
  }
  if (inner_rows > 0 && outer_cols > 0) {
    double *to = p->value.data() + w->q->upper + (w->cols.first + skip - w->width) + (size_t)w->rows.first * (size_t)below;
    PetscCallBLAS("BLASgemm", BLASgemm_("N", "T", &outer_cols, &inner_rows, &w->columns, &minus, right + skip, &cols,
                                        left, &rows, &one, to, &below));
  }
  w->columns = 0;
  PetscFunctionReturn(0);
}

/* `count` rows of a matrix to the rows of another one with the given numbers, less the first it has; the rest of it is zero */
static void Spread(const double from[], PetscInt ld, PetscInt count, PetscInt columns, const PetscInt places[],
                   const PetscInt row_of[], const Reached &reached, double to[])
{
  const PetscInt rows = reached.count(), first = count ? row_of[places[0]] - reached.first : 0;
  if (count && row_of[places[count - 1]] - reached.first == first + count - 1) { /* without gaps */
    for (PetscInt c = 0; c < columns; ++c, to += rows, from += ld) {
      std::fill(to, to + first, 0.0);
      std::copy(from, from + count, to + first);
      std::fill(to + first + count, to + rows, 0.0);
    }
    return;
  }
  std::fill(to, to + (size_t)columns * rows, 0.0);
  for (PetscInt c = 0; c < columns; ++c, to += rows, from += ld)
    for (PetscInt i = 0; i < count; ++i) to[row_of[places[i]] - reached.first] = from[i];
}

namespace
{

/* Where the panel before lies in the values, and its parts that count: rows after those of K only together with columns
   of K, and the other way round */
struct Source {
  const KluPanelSource *s;
  PetscInt              width, ld_lower, ld_upper, rows, cols, inner_rows, inner_cols;
  const double         *lower, *upper;
  const PetscInt       *row, *col;
};

} // namespace

static Source Look(const KluPanels &p, const KluPanelSource &s)
{
  const KluPanel &q = p.panel[s.panel];
  Source          v;
  v.s          = &s;
  v.width      = q.width;
  v.ld_lower   = q.width + q.rows.count;
  v.ld_upper   = q.cols.count;
  v.inner_rows = s.row_last - s.row_first;
  v.inner_cols = s.col_last - s.col_first;
  v.rows       = v.inner_cols ? q.rows.count - s.row_first : v.inner_rows;
  v.cols       = v.inner_rows ? q.cols.count - s.col_first : v.inner_cols;
  v.lower      = p.value.data() + q.lower + q.width + s.row_first;
  v.upper      = p.value.data() + q.upper + s.col_first;
  v.row        = p.reached.data() + q.rows.start + s.row_first;
  v.col        = p.reached.data() + q.cols.start + s.col_first;
  return v;
}

namespace
{

/* Columns of a narrow panel that reach a part of the panel at work: to(row_of[row], col) -= (a b^T)(row, col) */
struct Product {
  const double   *a, *b;
  PetscInt        lda, ldb, rows, cols, width;
  const PetscInt *row, *col, *row_of;
};

} // namespace

static void SubtractLoop(const Product &m, PetscInt first, PetscInt ld, double to[])
{
  for (PetscInt j = 0; j < m.cols; ++j) {
    double *t = to + (size_t)(m.col[j] - first) * ld;
    for (PetscInt c = 0; c < m.width; ++c) {
      const double  factor = m.b[j + (size_t)c * m.ldb];
      const double *x      = m.a + (size_t)c * m.lda;
      for (PetscInt i = 0; i < m.rows; ++i) t[m.row_of[m.row[i]]] -= x[i] * factor;
    }
  }
}

static PetscErrorCode Subtract(const Product &m, PetscInt first, PetscInt ld, double to[], std::vector<double> *scratch)
{
  const Int         rows = (Int)m.rows, cols = (Int)m.cols, width = (Int)m.width, lda = (Int)m.lda, ldb = (Int)m.ldb;
  const PetscScalar zero = 0, one = 1;
  const size_t      size = (size_t)rows * (size_t)cols;

  PetscFunctionBegin;
  if (!size) PetscFunctionReturn(0);
  if (2 * (double)size * (double)width < FEW) {
    SubtractLoop(m, first, ld, to);
    PetscFunctionReturn(0);
  }
  if (scratch->size() < size) scratch->resize(size);
  const double *x = scratch->data();
  PetscCallBLAS("BLASgemm",
                BLASgemm_("N", "T", &rows, &cols, &width, &one, m.a, &lda, m.b, &ldb, &zero, scratch->data(), &rows));
  for (PetscInt j = 0; j < m.cols; ++j, x += rows) {
    double *t = to + (size_t)(m.col[j] - first) * ld;
    for (PetscInt i = 0; i < m.rows; ++i) t[m.row_of[m.row[i]]] -= x[i];
  }
  PetscFunctionReturn(0);
}

static PetscErrorCode Scatter(const Source &v, const Work &w, KluPanels *p)
{
  const Product to_lower = {v.lower,      v.upper, v.ld_lower, v.ld_upper, v.rows,
                            v.inner_cols, v.width, v.row,      v.col,      p->row_of.data()};
  const Product to_upper = {v.upper + v.inner_cols, v.lower, v.ld_upper,           v.ld_lower, v.cols - v.inner_cols,
                            v.inner_rows,           v.width, v.col + v.inner_cols, v.row,      p->col_of.data()};
  PetscFunctionBegin;
  PetscCall(Subtract(to_lower, w.q->first, w.left, p->value.data() + w.q->lower, &p->product));
  PetscCall(Subtract(to_upper, w.q->first, w.right - w.width, p->value.data() + w.q->upper - w.width, &p->product));
  PetscFunctionReturn(0);
}

static bool BetterScattered(const Source &v, const Work &w)
{
  const double columns = (double)v.width, copied = (double)w.left + (double)w.right, all = copied - (double)w.width;
  const double reached = (double)v.rows * (double)v.inner_cols + (double)(v.cols - v.inner_cols) * (double)v.inner_rows;
  return reached * (2 * columns + ADD) + CALL <
         columns * (all * 2 * (double)w.width + copied * COPY);
}

/* What the sources that are not scattered reach of this panel; places ascend, and so do their numbers in it */
static void FindReached(Work *w, const KluPanels &p)
{
  w->rows = {w->left, 0};
  w->cols = {w->right, 0};
  for (PetscInt k = w->q->source; k < w->q->source + w->q->sources; ++k) {
    const Source v = Look(p, p.source[k]);
    if (!v.rows || !v.cols || BetterScattered(v, *w)) continue;
    w->rows.add(p.row_of[v.row[0]], p.row_of[v.row[v.rows - 1]] + 1);
    w->cols.add(p.col_of[v.col[0]], p.col_of[v.col[v.cols - 1]] + 1);
  }
}

/* Columns from the first one on that do, or do not, contribute: the part that counts is zero neither in `lower` nor in
   `upper` */
static PetscInt Alike(const Source &v, PetscInt first, PetscInt end, bool *live)
{
  const auto zero        = [](double e) { return e == 0; };
  const auto contributes = [&](PetscInt c) {
    const double *x = v.lower + (size_t)c * v.ld_lower, *y = v.upper + (size_t)c * v.ld_upper;
    return !std::all_of(x, x + v.rows, zero) && !std::all_of(y, y + v.cols, zero);
  };
  PetscInt last = first + 1;
  *live         = contributes(first);
  while (last < end && contributes(last) == *live) ++last;
  return last - first;
}

static PetscErrorCode Collect(Work *w, KluPanels *p)
{
  PetscFunctionBegin;
  FindReached(w, *p);
  for (PetscInt k = w->q->source; k < w->q->source + w->q->sources; ++k) {
    const Source v = Look(*p, p->source[k]);
    if (!v.rows || !v.cols) continue;
    if (BetterScattered(v, *w)) {
      PetscCall(Scatter(v, *w, p));
      continue;
    }
    for (PetscInt done = 0, count; done < v.width; done += count) {
      bool live;
      if (w->columns == SIDE_BY_SIDE) PetscCall(Multiply(w, p));
      count = Alike(v, done, PetscMin(v.width, done + SIDE_BY_SIDE - (PetscInt)w->columns), &live);
      if (!live) continue;
      Spread(v.lower + (size_t)done * v.ld_lower, v.ld_lower, v.rows, count, v.row, p->row_of.data(), w->rows,
             p->left.data() + (size_t)w->columns * w->rows.count());
      Spread(v.upper + (size_t)done * v.ld_upper, v.ld_upper, v.cols, count, v.col, p->col_of.data(), w->cols,
             p->right.data() + (size_t)w->columns * w->cols.count());
      w->columns += (Int)count;
    }
  }
  PetscCall(Multiply(w, p));
  PetscFunctionReturn(0);
}

/* ---- factors of one panel ---- */

static PetscErrorCode FactorWide(Int n, double a[], Int ld, PetscInt exchange[], bool *good)
{
  std::vector<Int> ipiv(n);
  Int              info;

  PetscFunctionBegin;
  PetscCallBLAS("LAPACKgetrf", LAPACKgetrf_(&n, &n, a, &ld, ipiv.data(), &info));
  *good = info == 0;
  for (Int i = 0; i < n; ++i) exchange[i] = ipiv[i] - 1;
  PetscFunctionReturn(0);
}

static PetscErrorCode DivideWide(Int n, const double a[], Int ld, double x[], Int rows, double y[], Int cols)
{
  const PetscScalar one = 1;

  PetscFunctionBegin;
  if (rows) PetscCallBLAS("BLAStrsm", BLAStrsm_("R", "U", "N", "N", &rows, &n, &one, a, &ld, x, &ld));
  if (cols) PetscCallBLAS("BLAStrsm", BLAStrsm_("R", "L", "T", "U", &cols, &n, &one, a, &ld, y, &cols));
  PetscFunctionReturn(0);
}

static PetscErrorCode FactorPanel(const Work &w, KluPanels *p, bool *good)
{
  const PetscInt n = w.width, rows = w.q->rows.count, cols = w.q->cols.count;
  double        *a = p->value.data() + w.q->lower, *x = a + n, *y = p->value.data() + w.q->upper;
  PetscInt      *swap = p->exchange.data() + w.q->first;

  PetscFunctionBegin;
  if (n <= KLU_PANELS_NARROW)
    *good = KluPanelsFactorNarrow(n, a, w.left, swap);
  else
    PetscCall(FactorWide(w.width, a, w.left, swap, good));
  if (!*good) PetscFunctionReturn(0);
  for (PetscInt k = 0; k < n; ++k)
    if (swap[k] != k) std::swap_ranges(y + k * cols, y + (k + 1) * cols, y + swap[k] * cols);
  if (n <= KLU_PANELS_NARROW)
    KluPanelsDivideNarrow(n, a, w.left, x, rows, y, cols);
  else
    PetscCall(DivideWide(w.width, a, w.left, x, (Int)rows, y, (Int)cols));
  const auto zero = [](double e) { return e == 0; };
  for (PetscInt k = 0; k < n; ++k) {
    p->zero_lower[w.q->first + k] = std::all_of(x + k * w.left, x + k * w.left + rows, zero);
    p->zero_upper[w.q->first + k] = std::all_of(y + k * cols, y + (k + 1) * cols, zero);
  }
  PetscFunctionReturn(0);
}

/* ---- growth ---- */

static double Larger(double a, double b) { return a > b ? a : b; }

/* The largest entries of U in its columns; false where a pivot is not finite */
static bool MeasurePanel(const KluPanel &q, KluPanels *p)
{
  const double  *a = p->value.data() + q.lower, *y = p->value.data() + q.upper;
  const PetscInt ld = q.width + q.rows.count, cols = q.cols.count;
  double        *size = p->factor_size.data(), *largest = p->y.data();

  std::fill_n(largest, cols, 0.0);
  for (PetscInt k = 0; k < q.width; ++k, a += ld, y += cols) {
    if (!(PetscAbsReal(a[k]) > 0) || !(PetscAbsReal(a[k]) < PETSC_INFINITY)) return false;
    for (PetscInt i = 0; i <= k; ++i) size[q.first + k] = Larger(PetscAbsReal(a[i]), size[q.first + k]);
    for (PetscInt i = 0; i < cols; ++i) largest[i] = Larger(PetscAbsReal(y[i]), largest[i]);
  }
  const PetscInt *place = p->reached.data() + q.cols.start;
  for (PetscInt i = 0; i < cols; ++i) size[place[i]] = Larger(largest[i], size[place[i]]);
  return true;
}

static double ReciprocalGrowth(const KluPanels &p)
{
  double smallest = 1;
  for (PetscInt k = 0; k < p.n; ++k)
    if (p.factor_size[k] > 0) smallest = PetscMin(smallest, p.matrix_size[k] / p.factor_size[k]);
  return smallest;
}

/* ---- all together ---- */

namespace
{

/* The largest absolute values of two halves of what was looked at: one would wait for itself */
struct Largest {
  double even = 0, odd = 0;
  void   see(double a, double b)
  {
    even = Larger(PetscAbsReal(a), even);
    odd  = Larger(PetscAbsReal(b), odd);
  }
};

} // namespace

static void CopyRun(const double *PETSC_RESTRICT from, PetscInt count, double *PETSC_RESTRICT to, Largest *largest)
{
  Largest  l = *largest;
  PetscInt i = 0;
  for (; i + 2 <= count; i += 2) {
    to[i]     = from[i];
    to[i + 1] = from[i + 1];
    l.see(from[i], from[i + 1]);
  }
  if (i < count) {
    to[i] = from[i];
    l.see(from[i], 0);
  }
  *largest = l;
}

/* Entries from the number `outer` on are between diagonal blocks and do not count */
template <bool has_outer>
static void CopyEach(const double *PETSC_RESTRICT from, PetscInt count, const PetscInt *PETSC_RESTRICT target, size_t outer,
                     double *PETSC_RESTRICT value, Largest *largest)
{
  const auto inner = [&](PetscInt e) { return !has_outer || (size_t)target[e] < outer ? from[e] : 0; };
  Largest    l     = *largest;
  PetscInt   e     = 0;
  for (; e + 2 <= count; e += 2) {
    value[target[e]]     = from[e];
    value[target[e + 1]] = from[e + 1];
    l.see(inner(e), inner(e + 1));
  }
  if (e < count) {
    value[target[e]] = from[e];
    l.see(inner(e), 0);
  }
  *largest = l;
}

/* The entries go to their places, and the largest of each column is noted, of those inside of diagonal blocks. Rows of the
   PETSc matrix are columns for KLU. */
template <bool has_outer> static void Assemble(const LinearRows &rows, KluPanels *p)
{
  double         *value  = p->value.data();
  const PetscInt *target = p->target.data();
  std::fill(p->value.begin(), p->value.end(), 0.0);
  for (PetscInt k = 0; k < p->n; ++k) {
    Largest    largest;
    PetscInt   e         = rows.start[p->col[k]];
    const auto each_upto = [&](PetscInt end) { CopyEach<has_outer>(rows.val + e, end - e, target + e, p->outer_values, value, &largest); };
    for (PetscInt r = p->run_start[k]; r < p->run_start[k + 1]; ++r) {
      const KluRun &run = p->run[r];
      each_upto(run.entry);
      CopyRun(rows.val + run.entry, run.count, value + target[run.entry], &largest);
      e = run.entry + run.count;
    }
    each_upto(rows.start[p->col[k] + 1]);
    p->matrix_size[k] = Larger(largest.even, largest.odd);
  }
}

static Work Begin(const KluPanel &q, KluPanels *p)
{
  const Work w = {&q, (Int)q.width, (Int)(q.width + q.rows.count), (Int)(q.width + q.cols.count), 0, {0, 0}, {0, 0}};
  KluPanelsSetPlaces(q, p);
  const size_t left = (size_t)w.left * SIDE_BY_SIDE, right = (size_t)w.right * SIDE_BY_SIDE;
  if (p->left.size() < left) p->left.resize(left);
  if (p->right.size() < right) p->right.resize(right);
  return w;
}

PetscErrorCode KluPanelsFactor(const LinearRows &rows, KluPanels *p, double *growth)
{
  PetscFunctionBegin;
  *growth = 0;
  if (p->outer.empty())
    Assemble<false>(rows, p);
  else
    Assemble<true>(rows, p);
  std::fill(p->factor_size.begin(), p->factor_size.end(), 0.0);
  for (const KluPanel &q : p->panel) {
    bool good = false;
    Work w    = Begin(q, p);
    PetscCall(Collect(&w, p));
    PetscCall(FactorPanel(w, p, &good));
    if (!good || !MeasurePanel(q, p)) PetscFunctionReturn(0);
  }
  *growth = ReciprocalGrowth(*p);
  PetscFunctionReturn(0);
}

#endif
