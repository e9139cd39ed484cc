#include "carrier.h"
#include "bodies.h"

namespace hhtdae
{

SmallTurn::SmallTurn(const Vector3 &p) : phi(p)
{
  const double s = p.squaredNorm();
  if (s < 1e-2) {
    a   = 1. / 2 - s * (1. / 24 - s * (1. / 720 - s * (1. / 40320 - s / 3628800)));
    b   = 1. / 6 - s * (1. / 120 - s * (1. / 5040 - s * (1. / 362880 - s / 39916800)));
    as  = -1. / 24 + s * (1. / 360 - s * (1. / 13440 - s / 907200));
    bs  = -1. / 120 + s * (1. / 2520 - s * (1. / 120960 - s / 9979200));
    ass = 1. / 360 - s * (1. / 6720 - s / 302400);
    bss = 1. / 2520 - s * (1. / 60480 - s / 3326400);
    return;
  }
  const double angle = std::sqrt(s), sine = std::sin(angle) / angle, cosine = std::cos(angle), c = (cosine - sine) / s, cs = (-sine / 2 - 1.5 * c) / s;
  a   = (1 - cosine) / s;
  b   = (1 - sine) / s;
  as  = (0.5 * sine - a) / s;
  bs  = (-0.5 * c - b) / s;
  ass = (0.25 * c - 2 * as) / s;
  bss = (-0.5 * cs - 2 * bs) / s;
}

Matrix3 SmallTurn::momentGradient(const Vector3 &n) const
{
  const Vector3 pn = phi.cross(n);
  return a * Cross<double>(n) - 2 * as * pn * phi.transpose() + 2 * bs * phi.cross(pn) * phi.transpose() +
         b * (phi.dot(n) * Matrix3::Identity() + phi * n.transpose() - 2 * n * phi.transpose());
}

/* Uses J(phi) = J(-phi)^T */
Matrix3 SmallTurn::rateGradient(const Vector3 &y) const
{
  SmallTurn back = *this;
  back.phi       = -phi;
  return -back.momentGradient(y);
}

Matrix3 SmallTurn::rate(const Vector3 &c) const
{
  const double s = 2 * phi.dot(c);
  return as * s * Cross<double>(phi) + a * Cross<double>(c) + bs * s * square() + b * (phi * c.transpose() + c * phi.transpose() - s * Matrix3::Identity());
}

/* Derivative of J' c = as (|phi|^2)' phi x c + bs (|phi|^2)' phi x (phi x c) + b c x (phi x c) */
Matrix3 SmallTurn::rateOfRateGradient(const Vector3 &c) const
{
  const double  s  = 2 * phi.dot(c);
  const Vector3 pc = phi.cross(c), ppc = phi.cross(pc);
  const Matrix3 C = Cross<double>(c), P = Cross<double>(phi);
  return (2 * as * pc + 2 * bs * ppc) * c.transpose() + (2 * ass * s * pc + 2 * bss * s * ppc + 2 * bs * c.cross(pc)) * phi.transpose() - as * s * C -
         bs * s * (Cross<double>(pc) + P * C) - b * C * C;
}

AttachedPoint::AttachedPoint(const ModalAttachment &a, const Eigen::Ref<const Eigen::VectorXd> &eta) : by_modes(6, a.translation.cols())
{
  by_modes << a.translation, a.rotation;
  motion = by_modes * eta;
  for (int c = 0; c < 6 && a.stiffening[0].size(); c++) {
    const Eigen::VectorXd bend = a.stiffening[c] * eta;
    motion(c) -= 0.5 * eta.dot(bend);
    by_modes.row(c) -= bend.transpose();
  }
}

void Carrier::finish(int modes)
{
  const int n = count();
  modes_      = modes;
  shapes.setZero(ModalProducts::padded(modes), 6 * n);
  for (Eigen::VectorXd *x : {&scratch_, &modes_now_, &rates_now_}) x->setZero(shapes.rows());
  for (Eigen::VectorXd *x : {&motion_, &rate_, &load_}) x->setZero(6 * n);
  for (int k = 0; k < n; k++) {
    const ModalAttachment &a                          = *attached[k].attachment;
    shapes.middleCols<3>(column(k, 0)).topRows(modes) = a.translation.transpose();
    shapes.middleCols<3>(column(k, 1)).topRows(modes) = a.rotation.transpose();
    if (!a.stiffening[0].size()) continue;
    stiffening_.resize(6 * n);
    for (int c = 0; c < 6; c++) stiffening_[column(k, c / 3) + c % 3] = &a.stiffening[c];
  }
  if (!stiffens()) return;
  rest_ = shapes;
  bend.setZero(modes, 6 * n);
  bend_rate.setZero(modes, 6 * n);
}

/* Subtracts (eta^T B eta)/2 from the motions and (B eta)^T from their derivatives by the modes */
void Carrier::bendShapes(const double *eta)
{
  const Eigen::Map<const Eigen::VectorXd> x(eta, modes_);
  for (std::size_t k = 0; k < stiffening_.size(); k++) {
    if (!stiffening_[k]) continue;
    scratch_.head(modes_).noalias() = *stiffening_[k] * x;
    motion_(k) -= 0.5 * scratch_.head(modes_).dot(x);
    shapes.col(k).head(modes_) = rest_.col(k).head(modes_) - scratch_.head(modes_);
  }
}

void Carrier::move(Bodies &B, const double *u, const double *v)
{
  const BodyMotion &b = B.now[body];
  const double *eta = u + B.body[body].first + 6, *rate = v + B.body[body].first + 6, *const x[2] = {modes_now_.data(), rates_now_.data()};
  double *const y[2] = {motion_.data(), rate_.data()};
  const int     rows = (int)shapes.rows(), columns = (int)shapes.cols();
  std::copy(eta, eta + modes_, modes_now_.data());
  std::copy(rate, rate + modes_, rates_now_.data());
  if (stiffens()) {
    ModalProducts::transposedTimes(rows, columns, rest_.data(), x[0], y[0]);
    bendShapes(eta);
    ModalProducts::transposedTimes(rows, columns, shapes.data(), x[1], y[1]);
  } else {
    ModalProducts::transposedTimes(rows, columns, shapes.data(), x, y);
  }
  for (int k = 0; k < count(); k++) {
    Attached   &f = attached[k];
    BodyMotion &i = B.now[f.body];
    f.turn        = SmallTurn(motion(k, 1));
    f.arm         = b.A * (f.s + motion(k, 0));
    f.velocity    = b.A * rate_.segment<3>(column(k, 0));
    f.spin        = b.A * (f.turn.J() * rate_.segment<3>(column(k, 1)));
    i.r           = b.r + f.arm;
    i.A           = b.A * f.turn.rotation();
    i.v           = b.v + b.w.cross(f.arm) + f.velocity;
    i.w           = b.w + f.spin;
  }
}

void Carrier::load(Bodies &B)
{
  BodyMotion &b = B.now[body];
  for (int k = 0; k < count(); k++) {
    const Attached   &f = attached[k];
    const BodyMotion &i = B.now[f.body];
    b.f += i.f;
    b.m += i.m + f.arm.cross(i.f);
    load_.segment<3>(column(k, 0)) = b.A.transpose() * i.f;
    load_.segment<3>(column(k, 1)) = f.turn.J().transpose() * (b.A.transpose() * i.m);
  }
  ModalProducts::times((int)shapes.rows(), (int)shapes.cols(), shapes.data(), load_.data(), scratch_.data());
  B.modal[B.body[body].modal].load += scratch_.head(modes_);
}

void Carrier::stiffen(Eigen::MatrixXd &K) const
{
  K.setZero(modes_, modes_);
  for (std::size_t k = 0; k < stiffening_.size(); k++)
    if (stiffening_[k]) K += load_(k) * *stiffening_[k];
}

/* Second time derivative of xi (part 0) or phi (part 1) of attachment k: shapes^T eta'' - eta'^T B eta' */
Vector3 Carrier::secondOf(const double *v, const double *a, int k, int part) const
{
  const Eigen::Map<const Eigen::VectorXd> rate(v, modes_), acceleration(a, modes_);
  const int                               at = column(k, part);
  Vector3                                 y  = shapes.middleCols<3>(at).topRows(modes_).transpose() * acceleration;
  for (int c = 0; c < 3 && stiffens(); c++)
    if (stiffening_[at + c]) y(c) -= rate.dot(*stiffening_[at + c] * rate);
  return y;
}

void Carrier::acceleration(const Bodies &B, int k, const double *v, const double *a, Vector3 &linear, Vector3 &angular) const
{
  const BodyMotion &b     = B.now[body];
  const Attached   &f     = attached[k];
  const PetscInt    first = B.body[body].first;
  const Vector3     alpha = B.angularAcceleration(body, v, a), xi = secondOf(v + first + 6, a + first + 6, k, 0), phi = secondOf(v + first + 6, a + first + 6, k, 1),
                turning = rate_.segment<3>(column(k, 1));
  linear                = Vector3(a[first], a[first + 1], a[first + 2]) + alpha.cross(f.arm) + b.w.cross(b.w.cross(f.arm)) + 2 * b.w.cross(f.velocity) + b.A * xi;
  angular               = alpha + b.w.cross(f.spin) + b.A * (f.turn.J() * phi + f.turn.rate(turning) * turning);
}

/* Derivatives of a = a_b + alpha_b x e + w_b x (w_b x e) + 2 w_b x (A xi') + A xi'' and alpha = alpha_b + w_b x (A J
   phi') + A (J phi'' + J' phi'), where e is Attached::arm and the index b stands for the body */
void Carrier::linearizeAcceleration(const Bodies &B, int k, const double *v, const double *a, double sv, double sa)
{
  const BodyMotion             &b     = B.now[body];
  Attached                     &f     = attached[k];
  FrameGradient                &g     = f.gradient;
  const Bodies::AngularGradient by    = B.byAngles(body, v, a, sv, sa);
  const PetscInt                first = B.body[body].first;
  const Vector3                 alpha = B.angularAcceleration(body, v, a), xi = secondOf(v + first + 6, a + first + 6, k, 0), phi = secondOf(v + first + 6, a + first + 6, k, 1),
                c = rate_.segment<3>(column(k, 1));
  const Matrix3 W = Cross<double>(b.w), E = Cross<double>(f.arm), J = f.turn.J(), D = f.turn.rateGradient(c), dJ = f.turn.rate(c);
  const Matrix3 V = Cross<double>(f.velocity), S = Cross<double>(f.spin);
  g.angles[4] = -E * by.alpha - (Cross<double>(Vector3(b.w.cross(f.arm))) + W * E + 2 * V) * by.w -
                (Cross<double>(alpha) * E + W * W * E + 2 * W * V + Cross<double>(Vector3(b.A * xi))) * by.G;
  g.angles[5] = by.alpha - S * by.w - (W * S + Cross<double>(Vector3(b.A * (J * phi + dJ * c)))) * by.G;
  /* derivatives by xi or phi, its rate and its second rate */
  const Matrix3 x[3]     = {(Cross<double>(alpha) + W * W) * b.A, 2 * W * b.A, b.A};
  const Matrix3 theta[3] = {W * b.A * D + b.A * (f.turn.rateGradient(phi) + f.turn.rateOfRateGradient(c)), W * b.A * J + b.A * (D + dJ), b.A * J};
  for (int part = 0; part < 2; part++) {
    const Matrix3 *d      = part ? theta : x;
    g.motion[4 + part]    = d[0] + sv * d[1] + sa * d[2];
    g.bend[4 + part]      = -d[1] - 2 * sv * d[2];
    g.bend_rate[4 + part] = -d[2];
  }
}

void Carrier::linearize(const Bodies &B, const double *v, const double *a, double sv, double sa, bool accelerations)
{
  const BodyMotion             &b     = B.now[body];
  const Bodies::AngularGradient by    = B.byAngles(body, v, a, sv, sa);
  const PetscInt                first = B.body[body].first;
  const Matrix3                 W     = Cross<double>(b.w);
  for (int k = 0; k < count(); k++) {
    Attached      &f = attached[k];
    FrameGradient &g = f.gradient;
    const Matrix3  E = Cross<double>(f.arm), AJ = b.A * f.turn.J(), EG = E * by.G;
    g.angles[0] = -EG;
    g.angles[1] = by.G;
    g.angles[2] = -E * by.w - W * EG - Cross<double>(f.velocity) * by.G;
    g.angles[3] = by.w - Cross<double>(f.spin) * by.G;
    g.motion[0] = b.A;
    g.motion[1] = AJ;
    g.motion[2] = W * b.A + sv * b.A;
    g.motion[3] = b.A * f.turn.rateGradient(rate_.segment<3>(column(k, 1))) + sv * AJ;
    g.bend[2]   = -b.A;
    g.bend[3]   = -AJ;
    if (accelerations) linearizeAcceleration(B, k, v, a, sv, sa);
  }
  for (std::size_t k = 0; k < stiffening_.size(); k++) {
    if (!stiffening_[k]) continue;
    bend.col(k).noalias() = *stiffening_[k] * Eigen::Map<const Eigen::VectorXd>(v + first + 6, modes_);
    if (accelerations) bend_rate.col(k).noalias() = *stiffening_[k] * Eigen::Map<const Eigen::VectorXd>(a + first + 6, modes_);
  }
}

Eigen::Matrix<double, 6, Eigen::Dynamic> Carrier::jacobian(const Bodies &B, int k) const
{
  const BodyMotion                        &b = B.now[body];
  const Attached                          &f = attached[k];
  Eigen::Matrix<double, 6, Eigen::Dynamic> J(6, 6 + modes_);
  J.leftCols<6>().setIdentity();
  J.block<3, 3>(0, 3) = -Cross<double>(f.arm);
  J.rightCols(modes_) << b.A * shapes.middleCols<3>(column(k, 0)).topRows(modes_).transpose(),
      b.A * f.turn.J() * shapes.middleCols<3>(column(k, 1)).topRows(modes_).transpose();
  return J;
}

} // namespace hhtdae
