/*
  Narrow panels of "klupair": LU of their diagonal blocks, and the elimination of the columns below.

  Calls of LAPACK and BLAS cost more than the work in such blocks, which moreover consist mostly of zeros: the pivot block of
  coordinates with constraints of their own is a unit matrix. Zero factors, and in solves zero columns, are skipped. As in
  src/scene/modal_products.cpp the loops over long columns are compiled with and without AVX2, and the processor decides.
*/
#if defined(HHTDAE_HAVE_KLU)
#include "klupair_panels.h"
#include <algorithm>

#define ALWAYS_INLINE inline __attribute__((always_inline))
#if defined(__x86_64__) && defined(__GNUC__)
#define AVX2 __attribute__((target("avx2,fma")))
#endif

/* Smaller pivots count as zero, so that reciprocals are finite */
static const double SMALLEST_PIVOT = 1e-300;

typedef double Four __attribute__((vector_size(32), aligned(8), may_alias));

/* ---- products of long columns ---- */

namespace
{

/* to = (to - sum_k factor[k] column[k]) scale, for `rows` rows and `count` columns */
struct ColumnSum {
  PetscInt      rows, count;
  double       *to, scale;
  const double *column[KLU_PANELS_NARROW];
  double        factor[KLU_PANELS_NARROW];
};

} // namespace

template <int columns> ALWAYS_INLINE void SubtractColumns(const ColumnSum &s, PetscInt first, double scale)
{
  const double *x[4];
  double        f[4];
  double       *to = s.to;
  PetscInt      i  = 0;
  for (int c = 0; c < columns; ++c) {
    x[c] = s.column[first + c];
    f[c] = s.factor[first + c];
  }
  for (; i + 4 <= s.rows; i += 4) {
    Four t = *reinterpret_cast<const Four *>(to + i);
    for (int c = 0; c < columns; ++c) t -= *reinterpret_cast<const Four *>(x[c] + i) * f[c];
    *reinterpret_cast<Four *>(to + i) = t * scale;
  }
  for (; i < s.rows; ++i) {
    double t = to[i];
    for (int c = 0; c < columns; ++c) t -= x[c][i] * f[c];
    to[i] = t * scale;
  }
}

ALWAYS_INLINE void SubtractAllColumns(const ColumnSum &s)
{
  PetscInt k = 0;
  for (; k + 4 < s.count; k += 4) SubtractColumns<4>(s, k, 1);
  switch (s.count - k) {
  case 4: return SubtractColumns<4>(s, k, s.scale);
  case 3: return SubtractColumns<3>(s, k, s.scale);
  case 2: return SubtractColumns<2>(s, k, s.scale);
  case 1: return SubtractColumns<1>(s, k, s.scale);
  }
  if (s.scale != 1) SubtractColumns<0>(s, k, s.scale);
}

/* Dot products of `columns` columns, at most four, with x */
template <int columns> ALWAYS_INLINE void Dots(PetscInt rows, const double *const column[], const double x[], double dot[])
{
  Four     sum[columns] = {}, next[columns] = {}; /* two accumulators hide the latency of the addition */
  PetscInt i            = 0;
  for (; i + 8 <= rows; i += 8)
    for (int c = 0; c < columns; ++c) {
      sum[c] += *reinterpret_cast<const Four *>(column[c] + i) * *reinterpret_cast<const Four *>(x + i);
      next[c] += *reinterpret_cast<const Four *>(column[c] + i + 4) * *reinterpret_cast<const Four *>(x + i + 4);
    }
  for (int c = 0; c < columns; ++c) {
    sum[c] += next[c];
    dot[c] = (sum[c][0] + sum[c][1]) + (sum[c][2] + sum[c][3]);
    for (PetscInt k = i; k < rows; ++k) dot[c] += column[c][k] * x[k];
  }
}

ALWAYS_INLINE void AllDots(PetscInt rows, PetscInt count, const double *const column[], const double x[], double dot[])
{
  PetscInt k = 0;
  for (; k + 4 <= count; k += 4) Dots<4>(rows, column + k, x, dot + k);
  for (; k < count; ++k) Dots<1>(rows, column + k, x, dot + k);
}

typedef void SubtractKernel(const ColumnSum &);
typedef void DotKernel(PetscInt, PetscInt, const double *const[], const double[], double[]);

static void SubtractPlain(const ColumnSum &s) { SubtractAllColumns(s); }
static void DotsPlain(PetscInt n, PetscInt m, const double *const a[], const double x[], double y[]) { AllDots(n, m, a, x, y); }
#if defined(AVX2)
AVX2 static void SubtractAVX2(const ColumnSum &s) { SubtractAllColumns(s); }
AVX2 static void DotsAVX2(PetscInt n, PetscInt m, const double *const a[], const double x[], double y[]) { AllDots(n, m, a, x, y); }
static const bool            has_avx2         = __builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma");
static SubtractKernel *const subtract_columns = has_avx2 ? SubtractAVX2 : SubtractPlain;
static DotKernel *const      dot_products     = has_avx2 ? DotsAVX2 : DotsPlain;
#else
static SubtractKernel *const subtract_columns = SubtractPlain;
static DotKernel *const      dot_products     = DotsPlain;
#endif

/* ---- factors ---- */

bool KluPanelsFactorNarrow(PetscInt n, double a[], PetscInt ld, PetscInt exchange[])
{
  for (PetscInt k = 0; k < n; ++k) {
    double  *c = a + k * ld;
    PetscInt r = k;
    for (PetscInt i = k + 1; i < n; ++i)
      if (PetscAbsReal(c[i]) > PetscAbsReal(c[r])) r = i;
    exchange[k] = r;
    if (!(PetscAbsReal(c[r]) > SMALLEST_PIVOT)) return false;
    if (r != k)
      for (PetscInt j = 0; j < n; ++j) std::swap(a[k + j * ld], a[r + j * ld]);
    for (PetscInt i = k + 1; i < n; ++i) c[i] /= c[k];
    for (PetscInt j = k + 1; j < n; ++j) {
      const double factor = a[k + j * ld];
      if (factor == 0) continue;
      for (PetscInt i = k + 1; i < n; ++i) a[i + j * ld] -= c[i] * factor;
    }
  }
  return true;
}

/* Column c of X or Y: subtracts f(k) times each column k before it, and scales */
static void EliminateColumn(PetscInt c, double x[], PetscInt ld, PetscInt rows, const double f[], PetscInt step, double scale)
{
  ColumnSum s = ColumnSum();
  s.rows      = rows;
  s.to        = x + c * ld;
  s.scale     = scale;
  for (PetscInt k = 0; k < c; ++k) {
    if (f[k * step] == 0) continue;
    s.column[s.count]   = x + k * ld;
    s.factor[s.count++] = f[k * step];
  }
  subtract_columns(s);
}

void KluPanelsDivideNarrow(PetscInt n, const double a[], PetscInt ld, double x[], PetscInt rows, double y[],
                           PetscInt cols)
{
  for (PetscInt c = 0; c < n; ++c) {
    EliminateColumn(c, x, ld, rows, a + c * ld, 1, 1 / a[c + c * ld]);
    EliminateColumn(c, y, cols, cols, a + c, ld, 1);
  }
}

/* ---- solves ---- */

void KluPanelsSubtractNarrow(PetscInt rows, PetscInt cols, const double a[], PetscInt ld, const char zero[],
                             const double x[], double y[])
{
  ColumnSum s = ColumnSum();
  s.rows      = rows;
  s.to        = y;
  s.scale     = 1;
  for (PetscInt k = 0; k < cols; ++k) {
    if (zero && zero[k]) continue;
    s.column[s.count]   = a + k * ld;
    s.factor[s.count++] = x[k];
  }
  subtract_columns(s);
}

void KluPanelsSubtractTransposedNarrow(PetscInt rows, PetscInt cols, const double a[], PetscInt ld, const char zero[],
                                       const double x[], double y[])
{
  const double *column[KLU_PANELS_NARROW] = {};
  double        dot[KLU_PANELS_NARROW];
  PetscInt      column_number[KLU_PANELS_NARROW], count = 0;
  for (PetscInt k = 0; k < cols; ++k) {
    if (zero && zero[k]) continue;
    column[count]          = a + k * ld;
    column_number[count++] = k;
  }
  dot_products(rows, count, column, x, dot);
  for (PetscInt k = 0; k < count; ++k) y[column_number[k]] -= dot[k];
}

#endif
