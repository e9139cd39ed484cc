/*
  Narrow panels of "klupair": factors of their blocks, and what these make of the long columns below.

  Calls of LAPACK and BLAS cost more than the work in such blocks, which are mostly zeros besides: coordinates that
  constraints of their own hold have unit matrices for pivots. Zeros are looked for and left out, and so are, in solves,
  the long columns that have nothing else. As in
  src/scene/modal_products.cpp the loops over long columns are compiled twice, and the processor at hand decides.
*/
#if defined(HHTDAE_HAVE_KLU)
#include "klupair_panels.h"
#include <algorithm>

#define ALWAYS_INLINE inline __attribute__((always_inline))
#if defined(__x86_64__) && defined(__GNUC__)
#define NEWER __attribute__((target("avx2,fma")))
#endif

/* A pivot must have a reciprocal */
static const double SMALLEST_PIVOT = 1e-300;

typedef double Four __attribute__((vector_size(32), aligned(8), may_alias));

/* ---- products of long columns ---- */

namespace
{

/* Columns and their factors, in so many rows: to = (to - sum of them) scale */
struct Sum {
  PetscInt      rows, count;
  double       *to, scale;
  const double *column[KLU_PANELS_NARROW];
  double        factor[KLU_PANELS_NARROW];
};

} // namespace

template <int columns> ALWAYS_INLINE void TakeSome(const Sum &s, PetscInt first, double scale)
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

ALWAYS_INLINE void TakeAll(const Sum &s)
{
  PetscInt k = 0;
  for (; k + 4 < s.count; k += 4) TakeSome<4>(s, k, 1);
  switch (s.count - k) {
  case 4: return TakeSome<4>(s, k, s.scale);
  case 3: return TakeSome<3>(s, k, s.scale);
  case 2: return TakeSome<2>(s, k, s.scale);
  case 1: return TakeSome<1>(s, k, s.scale);
  }
  if (s.scale != 1) TakeSome<0>(s, k, s.scale);
}

/* Of up to four columns, what each makes of x */
template <int columns> ALWAYS_INLINE void Dots(PetscInt rows, const double *const column[], const double x[], double dot[])
{
  Four     sum[columns] = {}, next[columns] = {}; /* one would wait for itself */
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

typedef void Take(const Sum &);
typedef void Dot(PetscInt, PetscInt, const double *const[], const double[], double[]);

static void TakePlain(const Sum &s) { TakeAll(s); }
static void DotsPlain(PetscInt n, PetscInt m, const double *const a[], const double x[], double y[]) { AllDots(n, m, a, x, y); }
#if defined(NEWER)
NEWER static void TakeNewer(const Sum &s) { TakeAll(s); }
NEWER static void DotsNewer(PetscInt n, PetscInt m, const double *const a[], const double x[], double y[]) { AllDots(n, m, a, x, y); }
static const bool newer      = __builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma");
static Take *const take      = newer ? TakeNewer : TakePlain;
static Dot *const  make_dots = newer ? DotsNewer : DotsPlain;
#else
static Take *const take      = TakePlain;
static Dot *const  make_dots = DotsPlain;
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

/* Column c of X or Y: the columns before it with the factors f(k) */
static void TakeOut(PetscInt c, double x[], PetscInt ld, PetscInt rows, const double f[], PetscInt step, double scale)
{
  Sum s   = Sum();
  s.rows  = rows;
  s.to    = x + c * ld;
  s.scale = scale;
  for (PetscInt k = 0; k < c; ++k) {
    if (f[k * step] == 0) continue;
    s.column[s.count]   = x + k * ld;
    s.factor[s.count++] = f[k * step];
  }
  take(s);
}

void KluPanelsDivideNarrow(PetscInt n, const double a[], PetscInt ld, double x[], PetscInt rows, double y[],
                           PetscInt cols)
{
  for (PetscInt c = 0; c < n; ++c) {
    TakeOut(c, x, ld, rows, a + c * ld, 1, 1 / a[c + c * ld]);
    TakeOut(c, y, cols, cols, a + c, ld, 1);
  }
}

/* ---- solves ---- */

void KluPanelsSubtractNarrow(PetscInt rows, PetscInt cols, const double a[], PetscInt ld, const char zero[],
                             const double x[], double y[])
{
  Sum s   = Sum();
  s.rows  = rows;
  s.to    = y;
  s.scale = 1;
  for (PetscInt k = 0; k < cols; ++k) {
    if (zero && zero[k]) continue;
    s.column[s.count]   = a + k * ld;
    s.factor[s.count++] = x[k];
  }
  take(s);
}

void KluPanelsSubtractTransposedNarrow(PetscInt rows, PetscInt cols, const double a[], PetscInt ld, const char zero[],
                                       const double x[], double y[])
{
  const double *column[KLU_PANELS_NARROW] = {};
  double        dot[KLU_PANELS_NARROW];
  PetscInt      of[KLU_PANELS_NARROW], count = 0;
  for (PetscInt k = 0; k < cols; ++k) {
    if (zero && zero[k]) continue;
    column[count] = a + k * ld;
    of[count++]   = k;
  }
  make_dots(rows, count, column, x, dot);
  for (PetscInt k = 0; k < count; ++k) y[of[k]] -= dot[k];
}

#endif
