#include "bodies.h"
#include <algorithm>

namespace hhtdae
{

void Bodies::move(const double *u, const double *v)
{
  moves++;
  for (std::size_t i = 0; i < body.size(); i++) {
    const LocalBody &k = body[i];
    BodyMotion      &b = now[i];
    b.f.setZero();
    b.m.setZero();
    if (k.modal >= 0) modal[k.modal].load.setZero();
    if (k.kind == BodyKind::Ground || k.kind == BodyKind::Attached) continue;
    const double *q = u + k.first, *p = v + k.first;
    switch (k.kind) {
    case BodyKind::Flexible:
    case BodyKind::Rigid:
      b.r = Vector3(q[0], q[1], q[2]);
      b.v = Vector3(p[0], p[1], p[2]);
      if (local) {
        LocalFrame(Vector3(q[3], q[4], q[5]), k.C, b.A, b.G);
        b.w = Vector3(p[3], p[4], p[5]);
      } else {
        Matrix3   A;
        EulerAxes e;
        EulerFrame(q + 3, A, e);
        b.A.noalias() = A * k.C;
        b.G           = e.G();
        b.w           = AngularVelocity(e, Vector3(p[3], p[4], p[5]));
      }
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
  for (Carrier &c : carriers) c.move(*this, u, v);
}

Vector3 Bodies::angularAcceleration(PetscInt b, const double *v, const double *a) const
{
  const LocalBody &k = body[b];
  if (k.kind == BodyKind::Planar) return {0, 0, a[k.first + 2]};
  if (k.kind == BodyKind::Attached) {
    Vector3 linear, angular;
    carriers[k.carrier].acceleration(*this, (int)k.place, v, a, linear, angular);
    return angular;
  }
  if (!TurnsInSpace(k.kind)) return Vector3::Zero();
  const double *acc = a + k.first + 3, *rate = v + k.first + 3;
  if (local) return {acc[0], acc[1], acc[2]};
  const EulerAxes e(now[b].G);
  return AngularVelocity(e, Vector3(acc[0], acc[1], acc[2])) + Convective(e, Vector3(rate[0], rate[1], rate[2]), now[b].w);
}

Vector3 Bodies::acceleration(PetscInt b, const double *v, const double *a) const
{
  const LocalBody &k = body[b];
  Vector3          linear = Vector3::Zero(), angular;
  if (k.kind == BodyKind::Attached) carriers[k.carrier].acceleration(*this, (int)k.place, v, a, linear, angular);
  else if (k.kind != BodyKind::Ground) std::copy(a + k.first, a + k.first + GroupSize(k.kind, 0), linear.data());
  return linear;
}

/* ---- flexible bodies ---- */

ModalMotion Bodies::modalMotion(PetscInt i, const double *u, const double *v, const double *a) const
{
  const LocalBody                        &k = body[i];
  const BodyMotion                       &b = now[i];
  const int                               m = modes(i);
  static const double                     none[6] = {0, 0, 0, 0, 0, 0};
  const double                           *acc = a ? a + k.first : none;
  const Vector3                           alpha = angularAcceleration(i, v, acc - k.first);
  const double                           *q = u + k.first + 6, *r = v + k.first + 6;
  return {b.A, b.w, alpha, Vector3(acc[0], acc[1], acc[2]) - gravity, {q, m}, {r, m}, {a ? acc + 6 : r, m}};
}

void Bodies::modalResidual(PetscInt i, const double *u, const double *v, const double *a, double *row)
{
  const BodyMotion &b = now[i];
  ModalPart        &p = modal[body[i].modal];
  Vector3           f, n;
  Eigen::Map<Eigen::VectorXd> h(row + 6, modes(i));
  p.dynamics->force(modalMotion(i, u, v, a), f, n, h);
  n -= b.m;
  for (int c = 0; c < 3; c++) row[c] = f(c) - b.f(c);
  Eigen::Map<Vector3>(row + 3).noalias() = b.G.transpose() * n;
  h -= p.load;
}

Bodies::AngularGradient Bodies::byAngles(PetscInt i, const double *v, const double *a, double sv, double sa) const
{
  const BodyMotion                &b = now[i];
  const Eigen::Map<const Vector3> rate(v + body[i].first + 3), acc(a + body[i].first + 3);
  AngularGradient                  g;
  Matrix3                          alpha_r;
  g.G = b.G * inStep(b);
  g.w = angularVelocityGradient(b, rate.data(), sv);
  if (local) {
    g.alpha = sa * Matrix3::Identity();
    return g;
  }
  const EulerAxes e(b.G);
  const Vector3   c = Convective(e, rate, b.w), gacc = AngularVelocity(e, acc), p = e.p();
  g.alpha = RateGradient(e, acc, gacc);
  g.alpha.col(0) += CrossZ(c);
  g.alpha.col(1) += rate(0) * rate(2) * CrossZ(p) - rate(1) * rate(2) * e.g3;
  alpha_r.col(0) = CrossZ(b.w);
  alpha_r.col(1) = rate(0) * CrossZ(e.g2) + rate(2) * p;
  alpha_r.col(2) = rate(0) * CrossZ(e.g3) + rate(1) * p;
  g.alpha += sv * alpha_r + sa * g.G;
  return g;
}

Matrix3 Bodies::momentGradient(PetscInt i, const double *u, const Vector3 &m) const
{
  if (!local) return MomentGradient(EulerAxes(now[i].G), m);
  const double *x = u + body[i].first + 3;
  return LocalMomentGradient(Vector3(x[0], x[1], x[2]), m) * inStep(now[i]);
}

void Bodies::modalJacobian(PetscInt i, const double *u, const double *v, const double *a, double sv, double sa)
{
  const LocalBody  &k = body[i];
  const BodyMotion &b = now[i];
  ModalPart        &p = modal[k.modal];
  ModalGradient    &D = p.gradient;
  const int         m = modes(i);
  const int         padded = 6 + p.dynamics->padded();
  auto             &B = p.block;
  B.setZero(padded, padded);
  p.dynamics->gradient(modalMotion(i, u, v, a), sv, sa, p.outer, D, &B.coeffRef(0, 0) + 6 * (std::ptrdiff_t)padded + 6, padded);
  if (p.stiffening.rows()) B.block(6, 6, m, m) += p.stiffening;
  if (p.unsymmetric.rows()) B.block(6, 6, m, m) += p.unsymmetric;
  const AngularGradient g = byAngles(i, v, a, sv, sa);
  const auto by_angles = [&](const auto &X) {
    return X.template middleCols<3>(3).lazyProduct(g.G) + X.template middleCols<3>(6).lazyProduct(g.w) + X.template rightCols<3>().lazyProduct(g.alpha);
  };
  Matrix<6, 6> R;
  R.leftCols<3>()    = sa * D.rigid.leftCols<3>();
  R.rightCols<3>()   = by_angles(D.rigid);
  R.bottomRows<3>()  = Matrix<3, 6>(b.G.transpose() * R.bottomRows<3>());
  R.bottomRightCorner<3, 3>() += momentGradient(i, u, D.n - b.m);
  B.topLeftCorner<6, 6>() = R;
  B.block(0, 6, 3, m)     = D.rigid_modal.leftCols<3>().transpose();
  B.block(3, 6, 3, m)     = D.rigid_modal.rightCols<3>().lazyProduct(b.G).transpose();
  B.block(6, 0, m, 3)     = sa * D.modal_rigid.leftCols<3>();
  B.block(6, 3, m, 3)     = by_angles(D.modal_rigid);
  if (!p.rigid_modal.rows()) return;
  B.topLeftCorner<6, 6>() += p.rigid;
  B.block(0, 6, 6, m) += p.rigid_modal.transpose();
  B.block(6, 0, m, 6) += p.modal_rigid;
}

void Bodies::residual(const double *u, const double *v, const double *a, double *F)
{
  for (PetscInt i = 0; i < own; i++) {
    const LocalBody  &k = body[i];
    const BodyMotion &b = now[i];
    const double     *acc = a + k.first;
    double           *row = F + k.first;
    if (k.kind == BodyKind::Attached) continue;
    if (k.kind == BodyKind::Flexible) {
      modalResidual(i, u, v, a, row);
      continue;
    }
    const int         directions = k.kind == BodyKind::Planar || k.kind == BodyKind::PlanarPoint ? 2 : 3;
    for (int c = 0; c < directions; c++) row[c] = k.mass * (acc[c] - gravity(c)) - b.f(c);
    if (k.kind == BodyKind::Planar) row[2] = k.J(2, 2) * acc[2] - b.m(2);
    if (k.kind != BodyKind::Rigid) continue;
    /* N is computed in body axes, in which the inertia is constant */
    const Vector3 wl = b.A.transpose() * b.w, al = b.A.transpose() * angularAcceleration(i, v, a);
    const Vector3 N = b.A * (k.J * al + wl.cross(k.J * wl)) - b.m;
    Eigen::Map<Vector3>(row + 3).noalias() = b.G.transpose() * N;
  }
}

void Bodies::jacobian(PetscInt i, const double *u, const double *v, const double *a, double sv, double sa, Eigen::Matrix<double, 6, 6, Eigen::RowMajor> &B) const
{
  const LocalBody  &k = body[i];
  const BodyMotion &b = now[i];
  B.setZero();
  for (int c = 0; c < 3; c++) B(c, c) = sa * k.mass;
  if (k.kind == BodyKind::Planar) B(2, 2) = sa * k.J(2, 2);
  if (k.kind != BodyKind::Rigid) return;
  const AngularGradient g     = byAngles(i, v, a, sv, sa);
  const Vector3         alpha = angularAcceleration(i, v, a);
  const Matrix3         I     = b.A * k.J * b.A.transpose();
  const Matrix3 Xw = Cross<double>(b.w), XIw = Cross<double>(I * b.w);
  const Vector3 N  = I * alpha + b.w.cross(I * b.w);
  const Matrix3 Ntheta = I * Cross<double>(alpha) - Cross<double>(I * alpha) + Xw * (I * Xw - XIw);
  const Matrix3 Nw     = Xw * I - XIw;
  const Matrix3 D = Ntheta * g.G + Nw * g.w + I * g.alpha;
  B.block<3, 3>(3, 3).noalias() = b.G.transpose() * D;
  B.block<3, 3>(3, 3) += momentGradient(i, u, N - b.m);
}

} // namespace hhtdae
