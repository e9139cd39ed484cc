#include "modal_dynamics.h"
#include "frames.h"

namespace hhtdae
{

namespace
{

constexpr int At(int c, int d) { return 3 * c + d; }

/* columns for each vector x: S x for xx, yy, zz, xy, yz, zx, then K x for xy, yz, zx; see modal_products.h */
constexpr int products_per_vector = 9;

/* The entries of L in the order of the columns of b */
Eigen::Matrix<double, 9, 1> ByColumns(const Matrix3 &L)
{
  return Eigen::Map<const Eigen::Matrix<double, 9, 1>>(Matrix3(L.transpose()).data());
}

/* The vector a with a_i = M_(i+1, i+2) - M_(i+2, i+1). For M = int y z^T it is int y x z */
Vector3 Axial(const Matrix3 &M) { return {M(1, 2) - M(2, 1), M(2, 0) - M(0, 2), M(0, 1) - M(1, 0)}; }

bool Stiffened(const ModalBody &body) { return body.stiffening[0].size() > 0; }

/* The invariants quadratic in the modes, including geometric stiffening by rotation. C_cd, ModalBody::stiffening, reduces
   the moments of inertia by K_cd = eta^T C_cd eta; this is equivalent to int y y^T + K - tr(K)/2 in place of int y y^T.
   Since the added matrices are symmetric, they do not change the part of the mass matrix between modes. */
ModalProducts Products(const ModalBody &body, bool full)
{
  const int                      m = (int)body.modes();
  std::array<Eigen::MatrixXd, 6> N;
  if (!Stiffened(body)) return {m, &body.quadratic};
  for (std::size_t p = 0; p < 6; p++)
    if (full) N[p] = body.quadratic[p];
    else N[p].setZero(m, m);
  const Eigen::MatrixXd half = 0.5 * (body.stiffening[0] + body.stiffening[1] + body.stiffening[2]);
  for (std::size_t p = 0; p < 6; p++) N[p] += body.stiffening[p];
  for (std::size_t p = 0; p < 3; p++) N[p] -= half;
  return {m, &N};
}

Matrix3 Inertia(const Matrix3 &I2) { return I2.trace() * Matrix3::Identity() - I2; }

} // namespace

ModalDynamics::ModalDynamics(std::shared_ptr<const ModalBody> body, ModalMass mass, const Eigen::VectorXd &damping)
    : body_(std::move(body)), m_((int)body_->modes()), linear_(mass != ModalMass::Constant && m_ > 0),
      quadratic_(m_ > 0 && (mass == ModalMass::Full || (mass == ModalMass::Partial && Stiffened(*body_)))), damping_(damping), stiffness_(body_->omega.cwiseAbs2()),
      products_(quadratic_ ? Products(*body_, mass == ModalMass::Full) : ModalProducts(m_, nullptr)), first_(body_->first.transpose())
{
  for (Columns *x : {&moment_, &b_, &rate_}) x->setZero(m_, 9);
  for (Vectors3 *x : {&skew_rate_, &skew_acc_}) x->setZero(m_, 3);
  for (int c = 0; c < 3; c++)
    for (int d = 0; d < 3 && linear_; d++) moment_.col(At(c, d)) = body_->moment[d].row(c).transpose();
  x_.setZero(padded(), 3);
  y_.setZero(padded(), 3 * products_per_vector);
}

void ModalDynamics::addProducts(int vector, Columns &to) const
{
  const auto y = y_.block(0, products_per_vector * vector, m_, products_per_vector);
  for (int c = 0; c < 3; c++) {
    const int d = (c + 1) % 3;
    to.col(At(c, c)) += y.col(c);
    to.col(At(c, d)) += y.col(3 + c) + y.col(6 + c);
    to.col(At(d, c)) += y.col(3 + c) - y.col(6 + c);
  }
}

/* Computes all products that `what` needs in one pass over the invariants */
void ModalDynamics::products(const ModalMotion &q, For what)
{
  const bool gradient = what == For::Gradient;
  const int  n = padded(), vectors = gradient ? 3 : what == For::Force ? 2 : 1;
  x_.col(0).head(m_) = q.eta;
  if (vectors > 1) x_.col(1).head(m_) = q.rate;
  if (vectors > 2) x_.col(2).head(m_) = q.acceleration;
  y_.leftCols(products_per_vector * vectors).setZero();
  ModalProducts::Task task[3];
  for (int k = 0; k < vectors; k++) {
    double *y = y_.data() + (std::ptrdiff_t)products_per_vector * k * n;
    task[k]   = {x_.data() + (std::ptrdiff_t)k * n, k == 0 || (k == 1 && gradient) ? y : nullptr, y + 6 * n};
  }
  products_.apply(task, vectors);
  addProducts(0, b_);
  if (vectors > 1) skew_rate_ = y_.block(0, products_per_vector + 6, m_, 3);
  if (!gradient) return;
  rate_.setZero();
  addProducts(1, rate_);
  skew_acc_ = y_.block(0, 2 * products_per_vector + 6, m_, 3);
}

void ModalDynamics::integrals(const ModalMotion &q, For what)
{
  I2_ = body_->moments;
  for (Vector3 *x : {&c_, &p_, &pa_}) x->setZero();
  V_.setZero();
  W_.setZero();
  if (!linear_) return;
  c_.noalias()  = first_.transpose() * q.eta;
  p_.noalias()  = first_.transpose() * q.rate;
  pa_.noalias() = first_.transpose() * q.acceleration;
  b_            = moment_;
  if (quadratic_) products(q, what);
  const Eigen::Matrix<double, 9, 1> x = b_.transpose() * q.eta, v = b_.transpose() * q.rate, w = b_.transpose() * q.acceleration,
                                    x0 = moment_.transpose() * q.eta;
  for (int c = 0; c < 3; c++)
    for (int e = 0; e < 3; e++) {
      I2_(c, e) += x0(At(e, c)) + x(At(c, e));
      V_(c, e) = v(At(e, c));
      W_(c, e) = w(At(e, c));
    }
}

void ModalDynamics::force(const ModalMotion &q, Vector3 &f, Vector3 &n, Eigen::Ref<Eigen::VectorXd> h)
{
  integrals(q, For::Force);
  const Matrix3 At_ = q.A.transpose(), O = Cross<double>(At_ * q.w);
  const Vector3 a0 = At_ * q.a0;
  const Matrix3 L  = Cross<double>(At_ * q.alpha) + O * O;
  f.noalias() = q.A * (body_->mass * a0 + L * c_ + 2 * O * p_ + pa_);
  n.noalias() = q.A * Axial(c_ * a0.transpose() + I2_ * L.transpose() + 2 * V_ * O.transpose() + W_);
  h           = q.acceleration + damping_.cwiseProduct(q.rate) + stiffness_.cwiseProduct(q.eta);
  if (!linear_) return;
  h.noalias() += first_ * a0;
  h.noalias() += b_ * ByColumns(L);
  if (quadratic_) h.noalias() += skew_rate_ * (4 * Vector3(O(0, 1), O(1, 2), O(2, 0)));
}

void ModalDynamics::gradient(const ModalMotion &q, double sv, double sa, const ModalOuter &more, ModalGradient &G, double *modal, int ld)
{
  using Factors    = Eigen::Matrix<double, 9, 3>;
  integrals(q, For::Gradient);
  const Matrix3 At_ = q.A.transpose();
  const Vector3 w = At_ * q.w, a0 = At_ * q.a0, alpha = At_ * q.alpha;
  const Matrix3 O = Cross<double>(w), L = Cross<double>(alpha) + O * O, J = Inertia(I2_), X = Cross<double>(c_);
  G.f = q.A * (body_->mass * a0 + L * c_ + 2 * O * p_ + pa_);
  G.n = q.A * Axial(c_ * a0.transpose() + I2_ * L.transpose() + 2 * V_ * O.transpose() + W_);

  /* Rigid rows and columns: partial derivatives in body axes, transformed to space axes. A rotation of the body also
     changes the body components of vectors that are constant in space. */
  const auto turned = [&](const Matrix3 &D) { return Matrix3(q.A * D * At_); };
  const Matrix3 fw = turned(-Cross<double>(w.cross(c_)) - O * X - 2 * Cross<double>(p_)), fa = turned(-X);
  const Matrix3 na = turned(X), nw = turned(O * J - Cross<double>(J * w) + 2 * (V_.trace() * Matrix3::Identity() - V_.transpose()));
  const Matrix3 nalpha = turned(J), turn[3] = {Cross<double>(q.a0), Cross<double>(q.w), Cross<double>(q.alpha)};
  G.rigid << body_->mass * Matrix3::Identity(), body_->mass * turn[0] + fw * turn[1] + fa * turn[2] - Cross<double>(G.f), fw, fa, na,
      na * turn[0] + nw * turn[1] + nalpha * turn[2] - Cross<double>(G.n), nw, nalpha;

  products_.combine(L + 2 * sv * O, more.left.data(), more.right.data(), (int)more.left.cols(), modal, ld);
  for (int k = 0; k < m_; k++) modal[k * (std::ptrdiff_t)(ld + 1)] += stiffness_(k) + sv * damping_(k) + sa;
  G.modal_rigid.setZero(m_, 12);
  G.rigid_modal.setZero(m_, 6);
  if (!linear_) return;

  /* Rows of the modes: derivatives by a0, w, alpha */
  Factors hw = Factors::Zero(), halpha = Factors::Zero();
  Matrix3 hs; /* factors of skew_rate_ */
  for (int a = 0; a < 3; a++) {
    const int i = (a + 1) % 3, j = (a + 2) % 3;
    halpha(At(j, i), a) += 1;
    halpha(At(i, j), a) -= 1;
    for (int d = 0; d < 3; d++) {
      hw(At(d, d), a) -= 2 * w(a);
      hw(At(a, d), a) += w(d);
      hw(At(d, a), a) += w(d);
    }
    hs.col(a) = -4 * Vector3::Unit(i);
  }
  const auto by = [&](int k) { return G.modal_rigid.middleCols<3>(3 * k); };
  by(0) = first_.lazyProduct(At_);
  by(2) = b_.lazyProduct(Factors(hw * At_)) + skew_rate_.lazyProduct(Matrix3(hs * At_));
  by(3) = b_.lazyProduct(Factors(halpha * At_));
  by(1) = by(0).lazyProduct(turn[0]) + by(2).lazyProduct(turn[1]) + by(3).lazyProduct(turn[2]);

  /* Rigid rows: derivatives by modal coordinates of int y_c (acceleration)_d, with the sign of (c, d) in Axial() */
  G.rigid_modal.leftCols<3>() = first_.lazyProduct(Matrix3((q.A * (L + 2 * sv * O + sa * Matrix3::Identity())).transpose()));
  Factors yb = Factors::Zero(), yr = Factors::Zero();
  Matrix3 yf = Matrix3::Zero(), ys; /* factors of first_ and skew_acc_ */
  for (int a = 0; a < 3; a++) {
    const int i = (a + 1) % 3, j = (a + 2) % 3;
    for (int sign : {1, -1}) {
      const int c = sign > 0 ? i : j, d = sign > 0 ? j : i;
      yf(c, a) += sign * a0(d);
      yb(At(d, c), a) += sign * sa;
      for (int e = 0; e < 3; e++) {
        yb(At(c, e), a) += sign * L(d, e);
        yb(At(e, c), a) += sign * (L(d, e) + 2 * sv * O(d, e));
        yr(At(c, e), a) += sign * 2 * O(d, e);
      }
    }
    ys.col(a) = 2 * Vector3::Unit(i);
  }
  auto moment = G.rigid_modal.rightCols<3>();
  moment = first_.lazyProduct(Matrix3(yf * At_)) + b_.lazyProduct(Factors(yb * At_));
  if (quadratic_) moment += rate_.lazyProduct(Factors(yr * At_)) + skew_acc_.lazyProduct(Matrix3(ys * At_));
}

ModalEnergy ModalDynamics::energy(const ModalMotion &q, const Vector3 &v)
{
  integrals(q, For::Energy);
  const Matrix3 J = Inertia(I2_);
  const Vector3 w = q.A.transpose() * q.w, vb = q.A.transpose() * v, relative = Axial(V_), p = w.cross(c_) + p_;
  ModalEnergy   e;
  e.kinetic  = 0.5 * body_->mass * v.squaredNorm() + vb.dot(p) + 0.5 * w.dot(J * w) + w.dot(relative) + 0.5 * q.rate.squaredNorm();
  e.elastic  = 0.5 * q.eta.dot(stiffness_.cwiseProduct(q.eta));
  e.momentum = body_->mass * v + q.A * p;
  e.angular  = q.A * (c_.cross(vb) + J * w + relative);
  e.center   = q.A * c_ / body_->mass;
  return e;
}

} // namespace hhtdae
