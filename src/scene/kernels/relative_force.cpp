#include "relative_force.h"

namespace hhtdae
{

namespace
{

/* Transforms derivatives L from the axes E to space axes, and from relative motion to the motion of both markers */
void ToSpace(const Mat3<double> &E, const Matrix<9, 9> &L, Matrix<12, 12> &J)
{
  for (int col = 0; col < 3; col++) {
    const int to = col == 0 ? 0 : col == 1 ? 3 : 9;
    for (int row = 0; row < 3; row++) {
      const Mat3<double> B = E * L.block<3, 3>(3 * row, 3 * col) * E.transpose();
      if (row < 2) J.block<3, 3>(3 * row, to) = B;
      if (row == 0) J.block<3, 3>(6, to) = -B;
      if (row == 2) J.block<3, 3>(9, to) = -B;
    }
  }
  J.middleCols<3>(6) = -J.leftCols<3>();
}

} // namespace

void Spread(const Mat3<double> &E, const Relative<double> &r, const RelativeDerivatives &by, Matrix<12, 12> &frames, Matrix<12, 12> *twists)
{
  const Vec3<double>  cf(by.c[0], by.c[1], by.c[2]), cm(by.c[3], by.c[4], by.c[5]), cj = cm + r.d.cross(cf);
  const Mat3<double> &S = by.spin, D = Cross<double>(r.d), F = Cross<double>(cf);

  /* columns: theta_x, theta_i, theta_j; rows: force on i, moment on i, minus the moment on j */
  Matrix<9, 9> L;
  Matrix<6, 3> by_axes = by.frame.leftCols<3>() * D; /* derivatives of the components by e, the rotation of the axes E */
  if (twists)
    by_axes += by.motion.leftCols<3>() * Cross<double>(r.v) + by.motion.middleCols<3>(3) * Cross<double>(r.wi) +
               by.motion.rightCols<3>() * Cross<double>(r.wj);
  const Matrix<6, 3> turned = by.frame.rightCols<3>() * by.turn;
  L.block<6, 3>(0, 0)       = by.frame.leftCols<3>();
  L.block<6, 3>(0, 3)       = turned + by_axes * S;
  L.block<6, 3>(0, 6)       = by_axes - by_axes * S - turned;
  /* Third block of rows: cm + d x cf. The variation dd = theta_x + [d] e of d contributes -[cf] dd */
  L.bottomRows<3>() = L.middleRows<3>(3) + D * L.topRows<3>();
  L.block<3, 3>(6, 0) -= F;
  const Mat3<double> FD = F * D;
  L.block<3, 3>(6, 3) -= FD * S;
  L.block<3, 3>(6, 6) -= FD - FD * S;
  /* Rotation of the axes E, with which the components turn */
  Matrix<9, 3> with_axes;
  with_axes << F, Cross<double>(cm), Cross<double>(cj);
  const Matrix<9, 3> carried_i = with_axes * S;
  L.middleCols<3>(3) -= carried_i;
  L.rightCols<3>() -= with_axes - carried_i;
  ToSpace(E, L, frames);
  if (!twists) return;
  L.topRows<6>()    = by.motion;
  L.bottomRows<3>() = by.motion.bottomRows<3>() + D * by.motion.topRows<3>();
  ToSpace(E, L, *twists);
}

} // namespace hhtdae
