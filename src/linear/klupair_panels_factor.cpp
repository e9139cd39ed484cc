/* Numerical factorization by the panels of "klupair": contributions of earlier panels, factors of one panel, element growth */
#if defined(HHTDAE_HAVE_KLU)
#include "klupair_panels.h"
#include <algorithm>
#include <petscblaslapack.h>

/* Columns of earlier panels that one product multiplies: bounds the scratch memory */
static const PetscInt MAX_BATCH_COLUMNS = 256;

/* Costs in operations of a dense product: per entry copied to the batch, per entry of a product added to its target, per call of BLAS */
static const double COST_COPY = 15, COST_ADD = 20, COST_CALL = 5000;

/* Smaller products, in operations, are computed by loops in place of BLAS */
static const double MIN_BLAS_FLOPS = 1000;

/* BLAS' integers: they bound width + rows of a panel */
typedef PetscBLASInt Int;

/* ---- contributions ---- */

namespace
{

/* Range [first, last) of rows of `lower`, or of K and `upper`, of the active panel that receive contributions */
struct RowRange {
  Int first, last;
  Int count() const { return last - first; }
  void add(PetscInt begin, PetscInt end)
  {
    first = PetscMin(first, (Int)begin);
    last  = PetscMax(last, (Int)end);
  }
};

/* The panel to which contributions are added, and the batch of columns of earlier panels that KluPanels::left and right hold side by side */
struct ActivePanel {
  const KluPanel *q;
  Int             width, left, right, columns; /* left: rows of `lower`; right: width + rows of `upper`; columns: of the batch */
  RowRange        rows, cols;                  /* rows of left and right that the batch holds */
};

} // namespace

static PetscErrorCode Multiply(ActivePanel *w, KluPanels *p)
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

/* Copies `count` rows of a matrix to the rows row_of[places[i]] - reached.first of another one; sets its other rows to zero */
static void ScatterColumns(const double from[], PetscInt ld, PetscInt count, PetscInt columns, const PetscInt places[],
                           const PetscInt row_of[], const RowRange &reached, double to[])
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

/* The values of an earlier panel, and the sizes of its parts that contribute to the active one, whose places are K: rows after K contribute only
   together with columns of K, and columns after K only with rows of K */
struct SourceView {
  const KluPanelSource *s;
  PetscInt              width, ld_lower, ld_upper, rows, cols, inner_rows, inner_cols;
  const double         *lower, *upper;
  const PetscInt       *row, *col;
};

} // namespace

static SourceView ViewSource(const KluPanels &p, const KluPanelSource &s)
{
  const KluPanel &q = p.panel[s.panel];
  SourceView      v;
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

/* The contribution of a narrow panel to a part of the active panel: to(row_of[row], col) -= (a b^T)(row, col) */
struct NarrowProduct {
  const double   *a, *b;
  PetscInt        lda, ldb, rows, cols, width;
  const PetscInt *row, *col, *row_of;
};

} // namespace

static void SubtractLoop(const NarrowProduct &m, PetscInt first, PetscInt ld, double to[])
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

static PetscErrorCode Subtract(const NarrowProduct &m, PetscInt first, PetscInt ld, double to[], std::vector<double> *scratch)
{
  const Int         rows = (Int)m.rows, cols = (Int)m.cols, width = (Int)m.width, lda = (Int)m.lda, ldb = (Int)m.ldb;
  const PetscScalar zero = 0, one = 1;
  const size_t      size = (size_t)rows * (size_t)cols;

  PetscFunctionBegin;
  if (!size) PetscFunctionReturn(0);
  if (2 * (double)size * (double)width < MIN_BLAS_FLOPS) {
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

static PetscErrorCode SubtractDirectly(const SourceView &v, const ActivePanel &w, KluPanels *p)
{
  const NarrowProduct to_lower = {v.lower, v.upper, v.ld_lower, v.ld_upper, v.rows,
                                  v.inner_cols, v.width, v.row, v.col, p->row_of.data()};
  const NarrowProduct to_upper = {v.upper + v.inner_cols, v.lower, v.ld_upper, v.ld_lower, v.cols - v.inner_cols,
                                  v.inner_rows, v.width, v.col + v.inner_cols, v.row, p->col_of.data()};
  PetscFunctionBegin;
  PetscCall(Subtract(to_lower, w.q->first, w.left, p->value.data() + w.q->lower, &p->product));
  PetscCall(Subtract(to_upper, w.q->first, w.right - w.width, p->value.data() + w.q->upper - w.width, &p->product));
  PetscFunctionReturn(0);
}

static bool DirectIsFaster(const SourceView &v, const ActivePanel &w)
{
  const double columns = (double)v.width, copied = (double)w.left + (double)w.right, all = copied - (double)w.width;
  const double reached = (double)v.rows * (double)v.inner_cols + (double)(v.cols - v.inner_cols) * (double)v.inner_rows;
  return reached * (2 * columns + COST_ADD) + COST_CALL <
         columns * (all * 2 * (double)w.width + copied * COST_COPY);
}

/* Ranges of the active panel that the sources of the batch contribute to; places ascend, and so do their rows in it */
static void FindTargetRanges(ActivePanel *w, const KluPanels &p)
{
  w->rows = {w->left, 0};
  w->cols = {w->right, 0};
  for (PetscInt k = w->q->source; k < w->q->source + w->q->sources; ++k) {
    const SourceView v = ViewSource(p, p.source[k]);
    if (!v.rows || !v.cols || DirectIsFaster(v, *w)) continue;
    w->rows.add(p.row_of[v.row[0]], p.row_of[v.row[v.rows - 1]] + 1);
    w->cols.add(p.col_of[v.col[0]], p.col_of[v.col[v.cols - 1]] + 1);
  }
}

/* Number of columns from the first one on that all contribute, or all do not. A column contributes if its relevant parts of `lower` and of `upper`
   are both nonzero. */
static PetscInt ContributingRun(const SourceView &v, PetscInt first, PetscInt end, bool *contributing)
{
  const auto zero        = [](double e) { return e == 0; };
  const auto contributes = [&](PetscInt c) {
    const double *x = v.lower + (size_t)c * v.ld_lower, *y = v.upper + (size_t)c * v.ld_upper;
    return !std::all_of(x, x + v.rows, zero) && !std::all_of(y, y + v.cols, zero);
  };
  PetscInt last = first + 1;
  *contributing = contributes(first);
  while (last < end && contributes(last) == *contributing) ++last;
  return last - first;
}

static PetscErrorCode SubtractContributions(ActivePanel *w, KluPanels *p)
{
  PetscFunctionBegin;
  FindTargetRanges(w, *p);
  for (PetscInt k = w->q->source; k < w->q->source + w->q->sources; ++k) {
    const SourceView v = ViewSource(*p, p->source[k]);
    if (!v.rows || !v.cols) continue;
    if (DirectIsFaster(v, *w)) {
      PetscCall(SubtractDirectly(v, *w, p));
      continue;
    }
    for (PetscInt done = 0, count; done < v.width; done += count) {
      bool contributing;
      if (w->columns == MAX_BATCH_COLUMNS) PetscCall(Multiply(w, p));
      count = ContributingRun(v, done, PetscMin(v.width, done + MAX_BATCH_COLUMNS - (PetscInt)w->columns), &contributing);
      if (!contributing) continue;
      ScatterColumns(v.lower + (size_t)done * v.ld_lower, v.ld_lower, v.rows, count, v.row, p->row_of.data(), w->rows,
                     p->left.data() + (size_t)w->columns * w->rows.count());
      ScatterColumns(v.upper + (size_t)done * v.ld_upper, v.ld_upper, v.cols, count, v.col, p->col_of.data(), w->cols,
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

static PetscErrorCode FactorPanel(const ActivePanel &w, KluPanels *p, bool *good)
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

/* Updates the largest entry of each column of U in factor_size; false if a pivot is zero or not finite */
static bool MeasureEntries(const KluPanel &q, KluPanels *p)
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

/* ---- assembly and factorization ---- */

namespace
{

/* Two running maxima of absolute values: with a single one every comparison would wait for the result of the one before */
struct Largest {
  double even = 0, odd = 0;
  void   update(double a, double b)
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
    l.update(from[i], from[i + 1]);
  }
  if (i < count) {
    to[i] = from[i];
    l.update(from[i], 0);
  }
  *largest = l;
}

/* Copies entries to value[target[e]]. Entries with targets from `off_block` on lie between diagonal blocks and do not enter the maximum. */
template <bool has_off_block>
static void CopyEach(const double *PETSC_RESTRICT from, PetscInt count, const PetscInt *PETSC_RESTRICT target, size_t off_block,
                     double *PETSC_RESTRICT value, Largest *largest)
{
  const auto inner = [&](PetscInt e) { return !has_off_block || (size_t)target[e] < off_block ? from[e] : 0; };
  Largest    l     = *largest;
  PetscInt   e     = 0;
  for (; e + 2 <= count; e += 2) {
    value[target[e]]     = from[e];
    value[target[e + 1]] = from[e + 1];
    l.update(inner(e), inner(e + 1));
  }
  if (e < count) {
    value[target[e]] = from[e];
    l.update(inner(e), 0);
  }
  *largest = l;
}

/* Copies the entries of the matrix into the panels, and stores the largest of each column within diagonal blocks in matrix_size. Rows of the
   PETSc matrix are KLU's columns. */
template <bool has_off_block> static void Assemble(const LinearRows &rows, KluPanels *p)
{
  double         *value  = p->value.data();
  const PetscInt *target = p->target.data();
  std::fill(p->value.begin(), p->value.end(), 0.0);
  for (PetscInt k = 0; k < p->n; ++k) {
    Largest    largest;
    PetscInt   e         = rows.start[p->col[k]];
    const auto each_upto = [&](PetscInt end) { CopyEach<has_off_block>(rows.val + e, end - e, target + e, p->off_block_values, value, &largest); };
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

static ActivePanel Activate(const KluPanel &q, KluPanels *p)
{
  const ActivePanel w = {&q, (Int)q.width, (Int)(q.width + q.rows.count), (Int)(q.width + q.cols.count), 0, {0, 0}, {0, 0}};
  KluPanelsSetPlaces(q, p);
  const size_t left = (size_t)w.left * MAX_BATCH_COLUMNS, right = (size_t)w.right * MAX_BATCH_COLUMNS;
  if (p->left.size() < left) p->left.resize(left);
  if (p->right.size() < right) p->right.resize(right);
  return w;
}

PetscErrorCode KluPanelsFactor(const LinearRows &rows, KluPanels *p, double *reciprocal_growth)
{
  PetscFunctionBegin;
  *reciprocal_growth = 0;
  if (p->off_block.empty())
    Assemble<false>(rows, p);
  else
    Assemble<true>(rows, p);
  std::fill(p->factor_size.begin(), p->factor_size.end(), 0.0);
  for (const KluPanel &q : p->panel) {
    bool        good = false;
    ActivePanel w    = Activate(q, p);
    PetscCall(SubtractContributions(&w, p));
    PetscCall(FactorPanel(w, p, &good));
    if (!good || !MeasureEntries(q, p)) PetscFunctionReturn(0);
  }
  *reciprocal_growth = ReciprocalGrowth(*p);
  PetscFunctionReturn(0);
}

#endif
