/* Transforms derivatives by perturbations of markers to coordinates of their bodies, for matrices of 1, 2, 3 and 6 rows, compiled once for all kernels. */
#include "bodies.h"

namespace hhtdae
{

namespace
{

/* Derivative by rotations of the body, J_theta - J_x [s], where s is the vector from the centre of mass to the marker */
template <int R> Matrix<R, 3> About(const Matrix<R, 6> &J, const Vector3 &s)
{
  Matrix<R, 3> A;
  A.col(0) = J.col(3) - s(2) * J.col(1) + s(1) * J.col(2);
  A.col(1) = J.col(4) - s(0) * J.col(2) + s(2) * J.col(0);
  A.col(2) = J.col(5) - s(1) * J.col(0) + s(0) * J.col(1);
  return A;
}

} // namespace

template <int R> int Bodies::columns(PetscInt m, const Frame<double> &f, const Matrix<R, 6> &J, Matrix<R, 6> &out) const
{
  const BodyMotion &b = now[marker[m].body];
  switch (body[marker[m].body].kind) {
  case BodyKind::Ground:
    return 0;
  case BodyKind::PlanarPoint:
    out.template leftCols<2>() = J.template leftCols<2>();
    return 2;
  case BodyKind::Point:
    out.template leftCols<3>() = J.template leftCols<3>();
    return 3;
  case BodyKind::Planar: {
    const double sx = f.x(0) - b.r(0), sy = f.x(1) - b.r(1);
    out.template leftCols<2>() = J.template leftCols<2>();
    out.col(2)                 = J.col(5) - sy * J.col(0) + sx * J.col(1);
    return 3;
  }
  case BodyKind::Attached: /* derivatives by x and theta of the frame */
    out.template leftCols<3>()  = J.template leftCols<3>();
    out.template rightCols<3>() = About<R>(J, f.x - b.r);
    return 6;
  case BodyKind::Flexible: /* the marker is fixed to the floating frame */
  case BodyKind::Rigid: /* dx = dr + dtheta x s, dtheta = G dU */
    out.template leftCols<3>()            = J.template leftCols<3>();
    out.template rightCols<3>().noalias() = About<R>(J, f.x - b.r) * b.G;
    return 6;
  }
  return 0;
}

template <int R> void Bodies::inStep(PetscInt m, Matrix<R, 6> &out) const
{
  if (commutator == 0 || !TurnsInSpace(body[marker[m].body].kind)) return;
  const Matrix<R, 3> by_turn            = out.template rightCols<3>();
  out.template rightCols<3>().noalias() = by_turn * inStep(now[marker[m].body]);
}

template <int R>
void Bodies::velocityColumns(PetscInt m, const Frame<double> &f, const double *v, double sv, const Matrix<R, 6> &J, Matrix<R, 6> &out) const
{
  const LocalBody  &k = body[marker[m].body];
  const BodyMotion &b = now[marker[m].body];
  const Vector3     s = f.x - b.r;
  switch (k.kind) {
  case BodyKind::Ground:
    return;
  case BodyKind::PlanarPoint:
    out.template leftCols<2>() += sv * J.template leftCols<2>();
    return;
  case BodyKind::Point:
    out.template leftCols<3>() += sv * J.template leftCols<3>();
    return;
  case BodyKind::Planar:
    out.template leftCols<2>() += sv * J.template leftCols<2>();
    out.col(2) += sv * (J.col(5) - s(1) * J.col(0) + s(0) * J.col(1)) + J.template leftCols<3>() * b.w.cross(CrossZ(s));
    return;
  case BodyKind::Attached: /* v and w of the frame have separate columns */
    out.template rightCols<3>() -= J.template leftCols<3>() * (Cross<double>(b.w) * Cross<double>(s));
    return;
  case BodyKind::Flexible:
  case BodyKind::Rigid: { /* dv = dv_r + dw x s + w x (dtheta x s) */
    const Matrix3 turned = Cross<double>(b.w) * Cross<double>(s) * b.G * inStep(b);
    out.template leftCols<3>() += sv * J.template leftCols<3>();
    out.template rightCols<3>() += About<R>(J, s) * angularVelocityGradient(b, v + k.first + 3, sv) - J.template leftCols<3>() * turned;
  }
  }
}

#define HHTDAE_ROWS(R)                                                                                                   \
  template int  Bodies::columns<R>(PetscInt, const Frame<double> &, const Matrix<R, 6> &, Matrix<R, 6> &) const;          \
  template void Bodies::inStep<R>(PetscInt, Matrix<R, 6> &) const;                                                       \
  template void Bodies::velocityColumns<R>(PetscInt, const Frame<double> &, const double *, double, const Matrix<R, 6> &, \
                                           Matrix<R, 6> &) const;
HHTDAE_ROWS(1)
HHTDAE_ROWS(2)
HHTDAE_ROWS(3)
HHTDAE_ROWS(6)
#undef HHTDAE_ROWS

} // namespace hhtdae
