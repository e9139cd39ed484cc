#include "blocks.h"

namespace hhtdae
{

Six PairBlock(const Evaluation &ev, PetscInt row, const Frame<double> &at_row, PetscInt column, const Frame<double> &at_column, const Six &A,
              const Six *V)
{
  Six right = Six::Zero(), both = Six::Zero();
  ev.bodies.columns(column, at_column, A, right);
  ev.bodies.inStep(column, right);
  if (V) ev.bodies.velocityColumns(column, at_column, ev.v, ev.sv, *V, right);
  ev.bodies.columns(row, at_row, Six(right.transpose()), both);
  return both.transpose();
}

void AddLever(const Bodies &B, PetscInt marker, const Frame<double> &at, const Vector3 &f, Six &H)
{
  const PetscInt b = B.marker[marker].body;
  const BodyKind k = B.body[b].kind;
  const Vector3  s = at.x - B.now[b].r;
  if (k == BodyKind::Planar) H(2, 2) -= f(0) * s(0) + f(1) * s(1);
  if (k != BodyKind::Rigid && k != BodyKind::Attached) return;
  const Matrix3 L = s * f.transpose() - f.dot(s) * Matrix3::Identity(); /* [f][s] = s f^T - (f.s) 1 */
  if (k == BodyKind::Attached) {
    H.bottomRightCorner<3, 3>() += L;
    return;
  }
  const Matrix3 G = B.now[b].G;
  H.bottomRightCorner<3, 3>().noalias() += G.transpose() * L * G * B.inStep(B.now[b]);
}

int RateBlocks(const Evaluation &ev, PetscInt row, const Frame<double> &at_row, PetscInt column, const Frame<double> &at_column, const Six &V, const Slot *slot,
               const bool *loads)
{
  const BodyKind k  = ev.bodies.body[ev.bodies.marker[row].body].kind;
  const Six      D  = PairBlock(ev, row, at_row, column, at_column, V);
  int            used = 0;
  for (int g = 0; g < Groups(k); g++)
    for (int h = 0; h < 2; h++)
      if (loads[g]) AddBlock(ev.sink, slot[used++], D, k, g, BodyKind::Attached, h);
  return used;
}

void AddBlock(const Sink &sink, const Slot &slot, const Six &D, BodyKind row, int g, BodyKind column, int h)
{
  const int rows = GroupSize(row, g), columns = GroupSize(column, h);
  sink.add(slot, D.block(GroupOffset(row, g), GroupOffset(column, h), rows, columns), rows, columns);
}

Six MinusBlock(const double *A, int leading, int k, int l)
{
  return -Eigen::Map<const Six, 0, Eigen::OuterStride<>>(A + 6 * leading * l + 6 * k, Eigen::OuterStride<>(leading));
}

template <int n>
void AddScalars(Evaluation &ev, PetscInt marker, const Frame<double> &at, const double *J, int leading, unsigned acts, PetscInt offset, const Slot *&slot)
{
  const BodyKind kind = ev.bodies.body[ev.bodies.marker[marker].body].kind;
  Matrix<n, 6>   rows, T = Matrix<n, 6>::Zero();
  for (int c = 0; c < n; c++)
    for (int r = 0; r < 6; r++) rows(c, r) = -J[c * leading + r];
  ev.bodies.columns(marker, at, rows, T);
  for (int g = 0; g < Groups(kind); g++) {
    if (!Reach(acts, kind, g)) continue;
    const int size = GroupSize(kind, g);
    ev.sink.add((slot++)->column(offset), T.middleCols(GroupOffset(kind, g), size).transpose(), size, n);
  }
}
template void AddScalars<1>(Evaluation &, PetscInt, const Frame<double> &, const double *, int, unsigned, PetscInt, const Slot *&);
template void AddScalars<2>(Evaluation &, PetscInt, const Frame<double> &, const double *, int, unsigned, PetscInt, const Slot *&);
template void AddScalars<3>(Evaluation &, PetscInt, const Frame<double> &, const double *, int, unsigned, PetscInt, const Slot *&);
template void AddScalars<6>(Evaluation &, PetscInt, const Frame<double> &, const double *, int, unsigned, PetscInt, const Slot *&);

void MinusTransposed(const double *H, int n, const double *y, double *out)
{
  Eigen::Map<Eigen::VectorXd>(out, n).noalias() =
      -Eigen::Map<const Eigen::MatrixXd>(H, n, n).transpose() * Eigen::Map<const Eigen::VectorXd>(y, n);
}

template <int R>
void AddGradient(Evaluation &ev, PetscInt marker, const Frame<double> &at, const double *gradient, const double *by_frame, unsigned active, unsigned used,
                 const Slot *&slot)
{
  const BodyKind kind = ev.bodies.body[ev.bodies.marker[marker].body].kind;
  if (!Groups(kind)) return;
  const Matrix<R, 6> J(gradient);
  Matrix<R, 6>       T, S; /* T^T: columns of lambda; S: rows of Phi */
  const int          n = ev.bodies.columns(marker, at, J, T);
  if (!by_frame) {
    S.leftCols(n) = T.leftCols(n);
    ev.bodies.inStep(marker, S);
  } else {
    S.leftCols(n).setZero();
    ev.bodies.columns(marker, at, Matrix<R, 6>(by_frame), S);
    ev.bodies.inStep(marker, S);
    ev.bodies.velocityColumns(marker, at, ev.v, ev.sv, J, S);
  }
  int rows = 0;
  for (int r = 0; r < R; r++)
    if (active >> r & 1) {
      for (int c = 0; c < n && rows < r; c++) {
        T(rows, c) = T(r, c);
        S(rows, c) = S(r, c);
      }
      rows++;
    }
  for (int g = 0; g < Groups(kind); g++) {
    if (!Reach(used, kind, g)) continue;
    const int size = GroupSize(kind, g), first = GroupOffset(kind, g);
    ev.sink.add(*slot++, S.middleCols(first, size), rows, size);
    ev.sink.add(*slot++, T.middleCols(first, size).transpose(), size, rows);
  }
  if (!by_frame || kind != BodyKind::Attached) return;
  for (int g = 0; g < 2; g++) /* the velocity of an attachment's frame has separate columns */
    if (Reach(used, kind, g)) ev.sink.add(*slot++, T.template middleCols<3>(3 * g), rows, 3);
}
template void AddGradient<1>(Evaluation &, PetscInt, const Frame<double> &, const double *, const double *, unsigned, unsigned, const Slot *&);
template void AddGradient<2>(Evaluation &, PetscInt, const Frame<double> &, const double *, const double *, unsigned, unsigned, const Slot *&);
template void AddGradient<3>(Evaluation &, PetscInt, const Frame<double> &, const double *, const double *, unsigned, unsigned, const Slot *&);

bool InPairs(unsigned pairs, BodyKind row, int g, BodyKind column, int h)
{
  return Reaches([&](int x, int y) { return (pairs >> (2 * x + y) & 1) != 0; }, row, g, column, h);
}

void AddCurvature(Evaluation &ev, const FramePair &p, const double *H, int leading, unsigned pairs, const Vector3 *lever, const Slot *&slot)
{
  const BodyKind row = ev.bodies.body[ev.bodies.marker[p.row].body].kind, column = ev.bodies.body[ev.bodies.marker[p.column].body].kind;
  Six            D;
  bool           made = false;
  for (int g = 0; g < Groups(row); g++)
    for (int h = 0; h < Groups(column); h++) {
      if (!(lever && Turns(row, g) && Turns(column, h)) && !InPairs(pairs, row, g, column, h)) continue;
      if (!made) {
        if (H) D = PairBlock(ev, p.row, p.at_row, p.column, p.at_column, Eigen::Map<const Six, 0, Eigen::OuterStride<>>(H, Eigen::OuterStride<>(leading)));
        else D.setZero();
        if (lever) AddLever(ev.bodies, p.row, p.at_row, *lever, D);
        made = true;
      }
      AddBlock(ev.sink, *slot++, D, row, g, column, h);
    }
}

} // namespace hhtdae
