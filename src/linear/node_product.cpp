/* The product in single precision of "hhtconstraint", node_product.h */
#include "node_product.h"
#include "vectors.h"
#include <algorithm>
#include <cmath>

namespace
{

/* Limits of the largest entry of the matrix: single precision ranges from 1e-38 to 1e38, and products of entries and vectors must not overflow or underflow.
   NodeProductTest.OutOfRange. */
constexpr float min_entry = 1e-20f, max_entry = 1e20f;

/* Largest unsymmetric part, relative to the Frobenius norm, that counts as rounding. NodeProduct.OneUnsymmetricEntry. */
constexpr double symmetry_tolerance = 1e-10;

/* ---- the pattern ---- */

/* For each local column of the matrix its place in the product */
struct ColumnPlaces {
  std::vector<PetscInt> of_column; /* number of its node, own nodes before those of other ranks, or -1 */
  std::vector<PetscInt> rest;      /* its number in NodeProduct::rest_column, if of_column is -1 */
};

void FindOwnNodes(const LocalRows &A, const std::vector<PetscInt> &node, NodeProduct *p)
{
  p->row.clear();
  for (PetscInt i = 0; i < A.own; i++)
    if (node[(size_t)i] == A.begin + i) p->row.push_back(i);
}

/* Relies on the columns of a node of another rank being consecutive */
ColumnPlaces FindPlaces(const LocalRows &A, const std::vector<PetscInt> &node, const NodeProduct &p)
{
  ColumnPlaces places;
  PetscInt     k = -1, others = 0;
  places.of_column.assign((size_t)(A.own + A.others), -1);
  places.rest.assign((size_t)(A.own + A.others), -1);
  for (PetscInt i = 0; i < A.own + A.others; i++) {
    if (i == A.own) k = (PetscInt)p.row.size() - 1;
    const PetscInt first = node[(size_t)i];
    if (first < 0) places.rest[(size_t)i] = i < A.own ? i : A.own + 3 * p.other_nodes + others++;
    else {
      if (i == A.own || i == 0 || node[(size_t)i - 1] != first) k++;
      places.of_column[(size_t)i] = k;
    }
  }
  return places;
}

PetscErrorCode CreateScatter(Mat A, const LocalRows &rows, const std::vector<PetscInt> &node, NodeProduct *p)
{
  std::vector<PetscInt> from, others;
  Vec                   x;
  IS                    is;

  PetscFunctionBegin;
  for (PetscInt i = rows.own; i < rows.own + rows.others; i++) {
    const PetscInt first = node[(size_t)i];
    if (first < 0) others.push_back(rows.global(i));
    else if (i == rows.own || node[(size_t)i - 1] != first)
      for (PetscInt c = 0; c < 3; c++) from.push_back(first + c);
  }
  p->other_nodes = (PetscInt)from.size() / 3;
  from.insert(from.end(), others.begin(), others.end());
  PetscCall(MatCreateVecs(A, &x, NULL));
  PetscCall(VecCreateSeq(PETSC_COMM_SELF, (PetscInt)from.size(), &p->fetched));
  PetscCall(ISCreateGeneral(PETSC_COMM_SELF, (PetscInt)from.size(), from.data(), PETSC_COPY_VALUES, &is));
  PetscCall(VecScatterCreate(x, is, p->fetched, NULL, &p->scatter));
  PetscCall(ISDestroy(&is));
  PetscCall(VecDestroy(&x));
  PetscFunctionReturn(0);
}

/* ---- the values ---- */

/* Fills NodeBlocks entry by entry, one row of blocks after the other */
class BlockFiller
{
public:
  NodeBlocks           &blocks;
  std::vector<PetscInt> at; /* for each node: the last block in its column */

  BlockFiller(NodeBlocks &to_fill, PetscInt columns, size_t expected) : blocks(to_fill), at((size_t)columns, -1)
  {
    blocks.first.assign(1, 0);
    blocks.column.clear();
    blocks.value.clear();
    blocks.column.reserve(expected);
    blocks.value.reserve(9 * expected + 1);
  }
  void add(PetscInt node, PetscInt row, PetscInt column, PetscScalar v)
  {
    PetscInt &k = at[(size_t)node];
    if (k < blocks.first.back()) {
      k = (PetscInt)blocks.column.size();
      blocks.column.push_back(node);
      blocks.value.resize(blocks.value.size() + 9, 0);
    }
    blocks.value[9 * (size_t)k + 3 * (size_t)column + (size_t)row] = (float)PetscRealPart(v);
  }
  void next() { blocks.first.push_back((PetscInt)blocks.column.size()); }
  void end() { blocks.value.push_back(0); /* a column is read as four values */ }
};

PetscErrorCode FillBlocks(const LocalRows &A, const std::vector<PetscInt> &node, const ColumnPlaces &places, NodeProduct *p)
{
  const PetscInt nodes = (PetscInt)p->row.size();
  MatInfo        entries;

  PetscFunctionBegin;
  PetscCall(MatGetInfo(A.diagonal, MAT_LOCAL, &entries));
  const size_t blocks = (size_t)entries.nz_used / 9;
  BlockFiller  own(p->own, nodes, p->symmetric ? (blocks + (size_t)nodes) / 2 : blocks), other(p->other, p->other_nodes, 0);
  for (PetscInt n = 0; n < nodes; n++, own.next(), other.next())
    for (PetscInt r = 0; r < 3; r++)
      PetscCall(A.forRow(p->row[(size_t)n] + r, [&](PetscInt c, PetscScalar v) {
        const PetscInt m = places.of_column[(size_t)c];
        if (m < 0 || (p->symmetric && m < n)) return;
        const PetscInt component = A.global(c) - node[(size_t)c];
        if (m < nodes) own.add(m, r, component, v);
        else other.add(m - nodes, r, component, v);
      }));
  own.end();
  other.end();
  PetscFunctionReturn(0);
}

PetscErrorCode FillRest(const LocalRows &A, const std::vector<PetscInt> &node, const ColumnPlaces &places, NodeProduct *p)
{
  PetscFunctionBegin;
  p->rest_row.clear();
  p->rest_first.assign(1, 0);
  p->rest_column.clear();
  p->rest_value.clear();
  for (PetscInt i = 0; i < A.own; i++) {
    PetscCall(A.forRow(i, [&](PetscInt c, PetscScalar v) {
      if (node[(size_t)i] >= 0 && node[(size_t)c] >= 0) return;
      PetscInt at = places.rest[(size_t)c];
      if (at < 0) { /* of a node */
        const PetscInt m = places.of_column[(size_t)c], nodes = (PetscInt)p->row.size();
        at               = m < nodes ? c : A.own + 3 * (m - nodes) + A.global(c) - node[(size_t)c];
      }
      p->rest_column.push_back(at);
      p->rest_value.push_back(PetscRealPart(v));
    }));
    if ((PetscInt)p->rest_column.size() == p->rest_first.back()) continue;
    p->rest_row.push_back(i);
    p->rest_first.push_back((PetscInt)p->rest_column.size());
  }
  PetscFunctionReturn(0);
}

/* Whether the largest entry is within the limits on all ranks */
PetscErrorCode InRange(Mat A, const NodeProduct &p, PetscBool *yes)
{
  float most = 0;

  PetscFunctionBegin;
  for (const NodeBlocks *b : {&p.own, &p.other})
    for (float v : b->value) most = std::max(most, std::abs(v));
  *yes = (PetscBool)(most == 0 || (most > min_entry && most < max_entry));
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, yes, 1, MPIU_BOOL, MPI_LAND, PetscObjectComm((PetscObject)A)));
  PetscFunctionReturn(0);
}

/* Whether couplings between own nodes are symmetric: z^T A w = w^T A z for pseudo-random z and w. The difference of the two is about the Frobenius norm of the
   unsymmetric part. It is compared with the Frobenius norm of A: comparison with the sum of all entries would hide a part far above the rounding of single precision. */
PetscErrorCode NodesAreSymmetric(const LocalRows &A, const std::vector<PetscInt> &node, bool *yes)
{
  double              one = 0, other = 0, squares = 0;
  std::vector<double> z((size_t)A.own), w((size_t)A.own);

  PetscFunctionBegin;
  for (size_t i = 0; i < z.size(); i++) {
    z[i] = LinearPseudoRandomValue((uint64_t)i, 1);
    w[i] = LinearPseudoRandomValue((uint64_t)i, 2);
  }
  for (PetscInt i = 0; i < A.own; i++) {
    if (node[(size_t)i] < 0) continue;
    double zA = 0, wA = 0;
    PetscCall(A.forRow(i, [&](PetscInt c, PetscScalar v) {
      if (c >= A.own || node[(size_t)c] < 0) return;
      const double a = PetscRealPart(v);
      zA += a * w[(size_t)c];
      wA += a * z[(size_t)c];
      squares += a * a;
    }));
    one += z[(size_t)i] * zA;
    other += w[(size_t)i] * wA;
  }
  *yes = std::abs(one - other) <= symmetry_tolerance * std::sqrt(squares);
  PetscFunctionReturn(0);
}

/* ---- the product ---- */

typedef float F4 __attribute__((vector_size(16), aligned(4), may_alias));

#if defined(__clang__)
  #define PICK(a, b, i, j, k, l) __builtin_shufflevector(a, b, i, j, k, l)
#else
typedef int I4 __attribute__((vector_size(16)));
  #define PICK(a, b, i, j, k, l) __builtin_shuffle(a, b, I4{i, j, k, l})
#endif

inline const F4 &Load(const float *p) { return *reinterpret_cast<const F4 *>(p); }
inline F4       &At(float *p) { return *reinterpret_cast<F4 *>(p); }

/* (sum of a, sum of b, sum of c, 0); the fourth entries of a, b and c are zero */
inline F4 Sums(const F4 &a, const F4 &b, const F4 &c)
{
  const F4 zero = {0, 0, 0, 0};
  const F4 ab = PICK(a, b, 0, 4, 1, 5) + PICK(a, b, 2, 6, 3, 7), c0 = PICK(c, zero, 0, 4, 1, 5) + PICK(c, zero, 2, 6, 3, 7);
  return PICK(ab, c0, 0, 1, 4, 5) + PICK(ab, c0, 2, 3, 6, 7);
}

/* y += B x. transposed: B is the upper triangle of a symmetric matrix, and y += B^T x is added for its off-diagonal blocks; xi is x then. */
template <bool transposed> void Multiply(const NodeBlocks &B, const float *x, const float *xi, float *y)
{
  const size_t nodes = B.first.size() - 1;
  for (size_t i = 0; i < nodes; i++) {
    F4 sum = {0, 0, 0, 0};
    const F4 mine = transposed ? Load(xi + 4 * i) : sum;
    for (PetscInt k = B.first[i]; k < B.first[i + 1]; k++) {
      const float *value = &B.value[9 * (size_t)k];
      const size_t j     = (size_t)B.column[(size_t)k];
      const F4     a = Load(value), b = Load(value + 3), c = Load(value + 6); /* fourth entries belong to the next column: the zero in x and the fourth component of y discard them */
      sum += a * x[4 * j] + b * x[4 * j + 1] + c * x[4 * j + 2];
      if (transposed && j != i) At(y + 4 * j) += Sums(a * mine, b * mine, c * mine);
    }
    At(y + 4 * i) += sum;
  }
}

void ToSingle(const PetscScalar *from, const std::vector<PetscInt> &row, std::vector<float> &to)
{
  for (size_t n = 0; n < row.size(); n++)
    for (size_t c = 0; c < 3; c++) to[4 * n + c] = (float)PetscRealPart(from[row[n] + (PetscInt)c]);
}

void MultiplyRest(const NodeProduct &p, PetscInt own, const PetscScalar *x, const PetscScalar *fetched, PetscScalar *y)
{
  for (size_t i = 0; i < p.rest_row.size(); i++) {
    PetscScalar sum = 0;
    for (PetscInt k = p.rest_first[i]; k < p.rest_first[i + 1]; k++) {
      const PetscInt c = p.rest_column[(size_t)k];
      sum += p.rest_value[(size_t)k] * (c < own ? x[c] : fetched[c - own]);
    }
    y[p.rest_row[i]] += sum;
  }
}

PetscErrorCode Product(Mat shell, Vec X, Vec Y)
{
  NodeProduct       *p;
  const PetscScalar *x, *fetched;
  PetscScalar       *y;
  PetscInt           n;

  PetscFunctionBegin;
  PetscCall(MatShellGetContext(shell, &p));
  PetscCall(VecScatterBegin(p->scatter, X, p->fetched, INSERT_VALUES, SCATTER_FORWARD));
  PetscCall(VecGetLocalSize(X, &n));
  PetscCall(VecGetArrayRead(X, &x));
  ToSingle(x, p->row, p->x);
  std::fill(p->y.begin(), p->y.end(), 0.f);
  if (p->symmetric) Multiply<true>(p->own, p->x.data(), p->x.data(), p->y.data());
  else Multiply<false>(p->own, p->x.data(), nullptr, p->y.data());
  PetscCall(VecScatterEnd(p->scatter, X, p->fetched, INSERT_VALUES, SCATTER_FORWARD));
  PetscCall(VecGetArrayRead(p->fetched, &fetched));
  for (size_t m = 0; m < (size_t)p->other_nodes; m++)
    for (size_t c = 0; c < 3; c++) p->other_x[4 * m + c] = (float)PetscRealPart(fetched[3 * m + c]);
  Multiply<false>(p->other, p->other_x.data(), nullptr, p->y.data());
  PetscCall(VecGetArrayWrite(Y, &y));
  std::fill_n(y, n, 0.);
  for (size_t i = 0; i < p->row.size(); i++)
    for (size_t c = 0; c < 3; c++) y[p->row[i] + (PetscInt)c] = p->y[4 * i + c];
  MultiplyRest(*p, n, x, fetched, y);
  PetscCall(VecRestoreArrayWrite(Y, &y));
  PetscCall(VecRestoreArrayRead(p->fetched, &fetched));
  PetscCall(VecRestoreArrayRead(X, &x));
  PetscCall(PetscLogFlops(2. * ((p->symmetric ? 18. : 9.) * (double)p->own.column.size() + 9. * (double)p->other.column.size() + (double)p->rest_value.size())));
  PetscFunctionReturn(0);
}

} // namespace

PetscErrorCode NodeProductDestroy(NodeProduct *p)
{
  PetscFunctionBegin;
  PetscCall(MatDestroy(&p->shell));
  PetscCall(VecDestroy(&p->fetched));
  PetscCall(VecScatterDestroy(&p->scatter));
  *p = NodeProduct();
  PetscFunctionReturn(0);
}

PetscErrorCode NodeProductFill(Mat A, const std::vector<PetscInt> &node, bool same_pattern, NodeProduct *p, PetscBool *usable)
{
  LocalRows rows;
  PetscInt  n, N;

  PetscFunctionBegin;
  PetscCall(LinearLocalRows(A, &rows));
  if (!same_pattern || !p->shell) {
    PetscCall(NodeProductDestroy(p));
    PetscCall(CreateScatter(A, rows, node, p));
    FindOwnNodes(rows, node, p);
    PetscCall(MatGetLocalSize(A, &n, NULL));
    PetscCall(MatGetSize(A, &N, NULL));
    PetscCall(MatCreateShell(PetscObjectComm((PetscObject)A), n, n, N, N, NULL, &p->shell));
    PetscCall(MatShellSetOperation(p->shell, MATOP_MULT, (void (*)(void))Product));
    p->x.assign(4 * p->row.size(), 0);
    p->y.assign(4 * p->row.size(), 0);
    p->other_x.assign(4 * (size_t)p->other_nodes, 0);
  }
  PetscCall(MatShellSetContext(p->shell, p));
  const ColumnPlaces places = FindPlaces(rows, node, *p);
  PetscCall(NodesAreSymmetric(rows, node, &p->symmetric));
  PetscCall(FillBlocks(rows, node, places, p));
  PetscCall(FillRest(rows, node, places, p));
  PetscCall(InRange(A, *p, usable));
  PetscFunctionReturn(0);
}
