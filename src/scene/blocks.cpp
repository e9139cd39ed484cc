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

} // namespace hhtdae
