#include "bodies.h"

namespace hhtdae
{

void Bodies::move(const double *u, const double *v)
{
  for (std::size_t i = 0; i < body.size(); i++) {
    const LocalBody &k = body[i];
    BodyMotion      &b = now[i];
    b.f.setZero();
    b.m.setZero();
    if (k.kind == BodyKind::Ground) continue;
    const double *q = u + k.first, *p = v + k.first;
    switch (k.kind) {
    case BodyKind::Rigid:
      b.r = Vector3(q[0], q[1], q[2]);
      b.v = Vector3(p[0], p[1], p[2]);
      {
        Matrix3 A;
        EulerFrame(q + 3, A, b.euler);
        b.A.noalias() = A * k.C;
      }
      b.w = AngularVelocity(b.euler, Vector3(p[3], p[4], p[5]));
      break;
    case BodyKind::Planar: {
      const double c = std::cos(q[2]), s = std::sin(q[2]);
      b.r << q[0], q[1], 0;
      b.v << p[0], p[1], 0;
      b.A << c, -s, 0, s, c, 0, 0, 0, 1;
      b.w << 0, 0, p[2];
      break;
    }
    case BodyKind::Point:
      b.r = Vector3(q[0], q[1], q[2]);
      b.v = Vector3(p[0], p[1], p[2]);
      break;
    default:
      b.r << q[0], q[1], 0;
      b.v << p[0], p[1], 0;
    }
  }
}

void Bodies::setAxes(PetscInt b, const Matrix3 &C, const Matrix3 &J)
{
  body[b].C = C;
  body[b].J = C * J * C.transpose();
}

void Bodies::residual(const double *v, const double *a, double *F) const
{
  for (PetscInt i = 0; i < own; i++) {
    const LocalBody  &k = body[i];
    const BodyMotion &b = now[i];
    const double     *acc = a + k.first;
    double           *row = F + k.first;
    const int         directions = k.kind == BodyKind::Planar || k.kind == BodyKind::PlanarPoint ? 2 : 3;
    for (int c = 0; c < directions; c++) row[c] = k.mass * (acc[c] - gravity(c)) - b.f(c);
    if (k.kind == BodyKind::Planar) row[2] = k.J(2, 2) * acc[2] - b.m(2);
    if (k.kind != BodyKind::Rigid) continue;
    const double *p = v + k.first + 3;
    /* in the axes of the Euler angles, where the inertia is constant */
    const Vector3 alpha = AngularVelocity(b.euler, Vector3(acc[3], acc[4], acc[5])) + Convective(b.euler, Vector3(p[0], p[1], p[2]), b.w);
    const Matrix3 A = b.A * k.C.transpose();
    const Vector3 wl = A.transpose() * b.w, al = A.transpose() * alpha;
    const Vector3 N = A * (k.J * al + wl.cross(k.J * wl)) - b.m;
    row[3]          = N(2);
    row[4]          = b.euler.g2.dot(N);
    row[5]          = b.euler.g3.dot(N);
  }
}

void Bodies::jacobian(PetscInt i, const double *v, const double *a, double sv, double sa, Eigen::Matrix<double, 6, 6, Eigen::RowMajor> &B) const
{
  const LocalBody  &k = body[i];
  const BodyMotion &b = now[i];
  B.setZero();
  for (int c = 0; c < 3; c++) B(c, c) = sa * k.mass;
  if (k.kind == BodyKind::Planar) B(2, 2) = sa * k.J(2, 2);
  if (k.kind != BodyKind::Rigid) return;
  const Eigen::Map<const Vector3> rate(v + k.first + 3), acc(a + k.first + 3);
  const EulerAxes                &e = b.euler;
  const Vector3 c  = Convective(e, rate, b.w), gacc = AngularVelocity(e, acc), alpha = gacc + c, p = e.p();
  const Matrix3 A  = b.A * k.C.transpose(), I = A * k.J * A.transpose(), G = e.G();
  const Matrix3 Xw = Cross<double>(b.w), XIw = Cross<double>(I * b.w);
  const Vector3 N  = I * alpha + b.w.cross(I * b.w);
  const Matrix3 Ntheta = I * Cross<double>(alpha) - Cross<double>(I * alpha) + Xw * (I * Xw - XIw);
  const Matrix3 Nw     = Xw * I - XIw;
  /* d alpha / d eps = d(G eps'')/d eps + d c / d eps */
  Matrix3 alpha_e = RateGradient(e, acc, gacc), alpha_r;
  alpha_e.col(0) += CrossZ(c);
  alpha_e.col(1) += rate(0) * rate(2) * CrossZ(p) - rate(1) * rate(2) * e.g3;
  alpha_r.col(0) = CrossZ(b.w);
  alpha_r.col(1) = rate(0) * CrossZ(e.g2) + rate(2) * p;
  alpha_r.col(2) = rate(0) * CrossZ(e.g3) + rate(1) * p;
  const Matrix3 D = Ntheta * G + Nw * (RateGradient(e, rate, b.w) + sv * G) + I * (alpha_e + sv * alpha_r + sa * G);
  B.block<3, 3>(3, 3).noalias() = G.transpose() * D;
  B.block<3, 3>(3, 3) += MomentGradient(e, N - b.m);
}

} // namespace hhtdae
