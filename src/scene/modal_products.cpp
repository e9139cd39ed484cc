/*
  Loops over the packed invariants.

  A panel is four columns of the lower triangle, from the 4 x 4 block on the diagonal downwards. The entries of that block are stored multiplied
  by 1/2, so that it needs no special treatment in loops that use each entry both at its place and at the mirrored place. Panels
  with the same columns are contiguous: first those of the symmetric matrices, then those of the skew-symmetric ones.

  A library for many processors is compiled for the instructions of the oldest one. These loops are compiled twice, also with newer
  instructions, and the version is chosen at run time.
*/
#include "modal_products.h"
#include <algorithm>

#define ALWAYS_INLINE inline __attribute__((always_inline))
#if defined(__x86_64__) && defined(__GNUC__)
#define TWO_VERSIONS 1
#define NEWER __attribute__((target("avx2,fma")))
#endif

namespace hhtdae
{

namespace
{

typedef double Four __attribute__((vector_size(32), aligned(8), may_alias));

struct Packed {
  int           n, symmetric, skew;
  const double *value;
};

ALWAYS_INLINE Four       &At(double *p) { return *reinterpret_cast<Four *>(p); }
ALWAYS_INLINE const Four &At(const double *p) { return *reinterpret_cast<const Four *>(p); }

/* ---- products with vectors ---- */

/* Products with a panel A of `rows` rows and its mirror image: y += A x for the lower triangle, y += sign A^T x for the
   upper one; x and y begin at the first column of the panel */
ALWAYS_INLINE void Mirrored(int rows, const double *a, const double *x, double *y, double sign)
{
  const Four x0 = {x[0], x[0], x[0], x[0]}, x1 = {x[1], x[1], x[1], x[1]}, x2 = {x[2], x[2], x[2], x[2]}, x3 = {x[3], x[3], x[3], x[3]};
  Four       s0 = {0, 0, 0, 0}, s1 = s0, s2 = s0, s3 = s0;
  for (int i = 0; i < rows; i += 4) {
    const Four a0 = At(a + i), a1 = At(a + rows + i), a2 = At(a + 2 * rows + i), a3 = At(a + 3 * rows + i), xi = At(x + i);
    At(y + i) += (a0 * x0 + a1 * x1) + (a2 * x2 + a3 * x3);
    s0 += a0 * xi;
    s1 += a1 * xi;
    s2 += a2 * xi;
    s3 += a3 * xi;
  }
  y[0] += sign * ((s0[0] + s0[1]) + (s0[2] + s0[3]));
  y[1] += sign * ((s1[0] + s1[1]) + (s1[2] + s1[3]));
  y[2] += sign * ((s2[0] + s2[1]) + (s2[2] + s2[3]));
  y[3] += sign * ((s3[0] + s3[1]) + (s3[2] + s3[3]));
}

ALWAYS_INLINE void ApplyPanels(const Packed &p, const ModalProducts::Task *task, int count, int zz)
{
  const double *a = p.value;
  for (int first = 0; first < p.n; first += 4) {
    const int rows = p.n - first;
    for (int k = 0; k < p.symmetric; k++, a += 4 * rows) {
      const int to = (k < 2 ? k : k + zz) * p.n + first;
      for (int t = 0; t < count; t++)
        if (task[t].symmetric) Mirrored(rows, a, task[t].x + first, task[t].symmetric + to, 1);
    }
    for (int k = 0; k < p.skew; k++, a += 4 * rows)
      for (int t = 0; t < count; t++) Mirrored(rows, a, task[t].x + first, task[t].skew + k * p.n + first, -1);
  }
}

/* ---- sums ---- */

struct Sum {
  double        symmetric[6], skew[3]; /* factors */
  const double *left, *right;
  int           rank;
  const int    *column; /* numbers of the `rank` columns of left and right that are used */
  double       *out;
  long          ld;
};

/* Combines 4 blocks rows of a panel, from row i on, in both triangles */
template <int blocks> ALWAYS_INLINE void CombineRows(const Packed &p, const Sum &sum, const double *a, int first, int i)
{
  const int    rows = p.n - first;
  const double part = i ? 1 : 0.5;
  Four         s[blocks][4], k[blocks][4];
  for (int b = 0; b < blocks; b++)
    for (int c = 0; c < 4; c++) s[b][c] = k[b][c] = Four{0, 0, 0, 0};
  for (int r = 0; r < sum.rank; r++) {
    const double *x = sum.left + (long)sum.column[r] * p.n + first + i, *y = sum.right + (long)sum.column[r] * p.n + first;
    for (int b = 0; b < blocks; b++)
      for (int c = 0; c < 4; c++) s[b][c] += At(x + 4 * b) * y[c];
  }
  for (int b = 0; b < blocks && !i; b++)
    for (int c = 0; c < 4; c++) s[b][c] *= part;
  for (int m = 0; m < p.symmetric; m++, a += 4 * rows)
    for (int b = 0; b < blocks; b++)
      for (int c = 0; c < 4; c++) s[b][c] += sum.symmetric[m] * At(a + c * rows + i + 4 * b);
  for (int m = 0; m < p.skew; m++, a += 4 * rows)
    for (int b = 0; b < blocks; b++)
      for (int c = 0; c < 4; c++) k[b][c] += sum.skew[m] * At(a + c * rows + i + 4 * b);
  for (int b = 0; b < blocks; b++) {
    const int row = first + i + 4 * b;
    Four      t[4];
    for (int c = 0; c < 4; c++) t[c] = s[b][c] + k[b][c];
    for (int r = 0; r < 4; r++) At(sum.out + (row + r) * sum.ld + first) += Four{t[0][r], t[1][r], t[2][r], t[3][r]};
    for (int c = 0; c < 4; c++) At(sum.out + (first + c) * sum.ld + row) += s[b][c] - k[b][c];
  }
}

ALWAYS_INLINE void CombinePanels(const Packed &p, const Sum &sum)
{
  const double *a = p.value;
  for (int first = 0; first < p.n; first += 4) {
    const int rows = p.n - first;
    int       i    = 4;
    CombineRows<1>(p, sum, a, first, 0);
    for (; i + 8 <= rows; i += 8) CombineRows<2>(p, sum, a, first, i);
    if (i < rows) CombineRows<1>(p, sum, a, first, i);
    a += 4l * rows * (p.symmetric + p.skew);
  }
}

/* ---- products with a matrix that is not packed ---- */

template <int columns> ALWAYS_INLINE void Dots(int rows, const double *A, const double *x, double *y)
{
  Four s[columns];
  for (int c = 0; c < columns; c++) s[c] = Four{0, 0, 0, 0};
  for (int i = 0; i < rows; i += 4)
    for (int c = 0; c < columns; c++) s[c] += At(A + (long)c * rows + i) * At(x + i);
  for (int c = 0; c < columns; c++) y[c] = (s[c][0] + s[c][1]) + (s[c][2] + s[c][3]);
}

ALWAYS_INLINE void AllDots(int rows, int columns, const double *A, const double *x, double *y)
{
  int c = 0;
  for (; c + 6 <= columns; c += 6) Dots<6>(rows, A + (long)c * rows, x, y + c);
  for (; c < columns; c++) Dots<1>(rows, A + (long)c * rows, x, y + c);
}

/* The same for two vectors, with one pass over A */
template <int columns> ALWAYS_INLINE void DotsOfTwo(int rows, const double *A, const double *const x[2], double *const y[2], int first)
{
  Four s[columns], t[columns];
  for (int c = 0; c < columns; c++) s[c] = t[c] = Four{0, 0, 0, 0};
  for (int i = 0; i < rows; i += 4) {
    const Four u = At(x[0] + i), v = At(x[1] + i);
    for (int c = 0; c < columns; c++) {
      const Four a = At(A + (long)c * rows + i);
      s[c] += a * u;
      t[c] += a * v;
    }
  }
  for (int c = 0; c < columns; c++) {
    y[0][first + c] = (s[c][0] + s[c][1]) + (s[c][2] + s[c][3]);
    y[1][first + c] = (t[c][0] + t[c][1]) + (t[c][2] + t[c][3]);
  }
}

ALWAYS_INLINE void AllDotsOfTwo(int rows, int columns, const double *A, const double *const x[2], double *const y[2])
{
  int c = 0;
  for (; c + 6 <= columns; c += 6) DotsOfTwo<6>(rows, A + (long)c * rows, x, y, c);
  for (; c < columns; c++) DotsOfTwo<1>(rows, A + (long)c * rows, x, y, c);
}

template <int columns> ALWAYS_INLINE void AddColumns(int rows, const double *A, const double *x, double *y)
{
  for (int i = 0; i < rows; i += 4) {
    Four t = At(y + i);
    for (int c = 0; c < columns; c++) t += At(A + (long)c * rows + i) * x[c];
    At(y + i) = t;
  }
}

ALWAYS_INLINE void AddAll(int rows, int columns, const double *A, const double *x, double *y)
{
  int c = 0;
  for (; c + 6 <= columns; c += 6) AddColumns<6>(rows, A + (long)c * rows, x + c, y);
  for (; c < columns; c++) AddColumns<1>(rows, A + (long)c * rows, x + c, y);
}

/* ---- versions ---- */

void ApplyPlain(const Packed &p, const ModalProducts::Task *task, int count, int zz) { ApplyPanels(p, task, count, zz); }
void CombinePlain(const Packed &p, const Sum &sum) { CombinePanels(p, sum); }
void DotsPlain(int rows, int columns, const double *A, const double *x, double *y) { AllDots(rows, columns, A, x, y); }
void DotsOfTwoPlain(int rows, int columns, const double *A, const double *const x[2], double *const y[2]) { AllDotsOfTwo(rows, columns, A, x, y); }
void AddPlain(int rows, int columns, const double *A, const double *x, double *y) { AddAll(rows, columns, A, x, y); }

#if defined(TWO_VERSIONS)
NEWER void ApplyNewer(const Packed &p, const ModalProducts::Task *task, int count, int zz) { ApplyPanels(p, task, count, zz); }
NEWER void CombineNewer(const Packed &p, const Sum &sum) { CombinePanels(p, sum); }
NEWER void DotsNewer(int rows, int columns, const double *A, const double *x, double *y) { AllDots(rows, columns, A, x, y); }
NEWER void DotsOfTwoNewer(int rows, int columns, const double *A, const double *const x[2], double *const y[2]) { AllDotsOfTwo(rows, columns, A, x, y); }
NEWER void AddNewer(int rows, int columns, const double *A, const double *x, double *y) { AddAll(rows, columns, A, x, y); }

bool Newer()
{
  static const bool newer = __builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma");
  return newer;
}
#else
bool Newer() { return false; }
void ApplyNewer(const Packed &p, const ModalProducts::Task *task, int count, int zz) { ApplyPanels(p, task, count, zz); }
void CombineNewer(const Packed &p, const Sum &sum) { CombinePanels(p, sum); }
void DotsNewer(int rows, int columns, const double *A, const double *x, double *y) { AllDots(rows, columns, A, x, y); }
void DotsOfTwoNewer(int rows, int columns, const double *A, const double *const x[2], double *const y[2]) { AllDotsOfTwo(rows, columns, A, x, y); }
void AddNewer(int rows, int columns, const double *A, const double *x, double *y) { AddAll(rows, columns, A, x, y); }
#endif

/* Stores a panel of a square matrix; the entries of its block on the diagonal are halved. Returns the position after the panel */
double *Store(const Eigen::MatrixXd &M, int n, int first, double *to)
{
  const int m = (int)M.rows();
  for (int c = first; c < first + 4; c++)
    for (int r = first; r < n; r++) *to++ = r >= m || c >= m ? 0 : r < first + 4 ? 0.5 * M(r, c) : M(r, c);
  return to;
}

} // namespace

ModalProducts::ModalProducts(int modes, const std::array<Eigen::MatrixXd, 6> *quadratic) : padded_(padded(modes))
{
  if (quadratic) pack(*quadratic);
}

void ModalProducts::pack(const std::array<Eigen::MatrixXd, 6> &N)
{
  const Eigen::Index           m = N[0].rows();
  std::vector<Eigen::MatrixXd> part;
  identity_ = m && (N[0] + N[1] + N[2] - Eigen::MatrixXd::Identity(m, m)).cwiseAbs().maxCoeff() < 1e-10;
  for (int p = 0; p < 6; p++)
    if (p != 2 || !identity_) part.push_back(0.5 * (N[p] + N[p].transpose()));
  symmetric_ = (int)part.size();
  for (int p = 3; p < 6; p++) part.push_back(0.5 * (N[p] - N[p].transpose()));
  skew_ = 3;
  std::size_t size = 0;
  for (int first = 0; first < padded_; first += 4) size += 4 * (std::size_t)(padded_ - first);
  value_.resize(size * part.size());
  double *to = value_.data();
  for (int first = 0; first < padded_; first += 4)
    for (const Eigen::MatrixXd &M : part) to = Store(M, padded_, first, to);
}

void ModalProducts::apply(const Task *task, int count) const
{
  (Newer() ? ApplyNewer : ApplyPlain)({padded_, symmetric_, skew_, value_.data()}, task, count, identity_ ? 1 : 0);
  if (!identity_) return;
  for (int t = 0; t < count; t++)
    if (double *s = task[t].symmetric)
      for (int i = 0; i < padded_; i++) s[2 * padded_ + i] += task[t].x[i] - s[i] - s[padded_ + i];
}

void ModalProducts::combine(const Eigen::Matrix3d &L, const double *left, const double *right, int rank, double *out, int ld) const
{
  std::vector<int> used;
  for (int r = 0; r < rank; r++)
    if (!std::all_of(right + (long)r * padded_, right + (long)(r + 1) * padded_, [](double x) { return x == 0; })) used.push_back(r);
  Sum       sum  = {{}, {}, left, right, (int)used.size(), used.data(), out, ld};
  double   *s    = sum.symmetric;
  const int pair = symmetric_ - 3; /* index of xy in `symmetric` */
  if (!symmetric_ && used.empty()) return;
  if (symmetric_) {
    const double zz = identity_ ? L(2, 2) : 0;
    s[0] = L(0, 0) - zz;
    s[1] = L(1, 1) - zz;
    if (!identity_) s[2] = L(2, 2);
    for (int c = 0; c < 3; c++) {
      const int d   = (c + 1) % 3;
      s[pair + c]   = L(c, d) + L(d, c);
      sum.skew[c]   = L(c, d) - L(d, c);
    }
    for (int i = 0; i < padded_; i++) out[i * (long)ld + i] += zz;
  }
  (Newer() ? CombineNewer : CombinePlain)({padded_, symmetric_, skew_, value_.data()}, sum);
}

void ModalProducts::transposedTimes(int rows, int columns, const double *A, const double *x, double *y)
{
  (Newer() ? DotsNewer : DotsPlain)(rows, columns, A, x, y);
}

void ModalProducts::transposedTimes(int rows, int columns, const double *A, const double *const x[2], double *const y[2])
{
  (Newer() ? DotsOfTwoNewer : DotsOfTwoPlain)(rows, columns, A, x, y);
}

void ModalProducts::times(int rows, int columns, const double *A, const double *x, double *y)
{
  std::fill(y, y + rows, 0.0);
  (Newer() ? AddNewer : AddPlain)(rows, columns, A, x, y);
}

} // namespace hhtdae
