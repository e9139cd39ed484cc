#include "modal_dynamics.h"
#include "frames.h"

namespace hhtdae
{

namespace
{

constexpr int At(int c, int d) { return 3 * c + d; }

/* the vector a with a_i = M_(i+1, i+2) - M_(i+2, i+1): of int y z^T it makes int y x z */
Vector3 Axial(const Matrix3 &M) { return {M(1, 2) - M(2, 1), M(2, 0) - M(0, 2), M(0, 1) - M(1, 0)}; }

Matrix3 Inertia(const Matrix3 &I2) { return I2.trace() * Matrix3::Identity() - I2; }

} // namespace

ModalDynamics::ModalDynamics(std::shared_ptr<const ModalBody> body, ModalMass mass, const Eigen::VectorXd &damping)
    : body_(std::move(body)), m_((int)body_->modes()), linear_(mass != ModalMass::Constant && m_ > 0),
      quadratic_(mass == ModalMass::Full && m_ > 0), damping_(damping), stiffness_(body_->omega.cwiseAbs2())
{
  b_.setZero(m_, 9);
  n_rate_.setZero(m_, 9);
  n_acc_.setZero(m_, 9);
}

void ModalDynamics::products(const Eigen::Ref<const Eigen::VectorXd> &x, Eigen::Matrix<double, Eigen::Dynamic, 9> &out) const
{
  const auto &N = body_->quadratic; /* xx, yy, zz, xy, yz, zx */
  for (int c = 0; c < 3; c++) {
    const int d = (c + 1) % 3;
    out.col(At(c, c)).noalias() += N[c] * x;
    out.col(At(c, d)).noalias() += N[3 + c] * x;
    out.col(At(d, c)).noalias() += N[3 + c].transpose() * x;
  }
}

void ModalDynamics::addQuadratic(const Matrix3 &L, double factor, Eigen::MatrixXd &out) const
{
  const auto &N = body_->quadratic;
  for (int c = 0; c < 3; c++) {
    const int d = (c + 1) % 3;
    if (L(c, c) != 0) out.noalias() += (factor * L(c, c)) * N[c];
    out.noalias() += (factor * L(c, d)) * N[3 + c];
    out.noalias() += (factor * L(d, c)) * N[3 + c].transpose();
  }
}

void ModalDynamics::integrals(const ModalMotion &q)
{
  const ModalBody &B = *body_;
  I2_ = B.moments;
  for (Vector3 *x : {&c_, &p_, &pa_}) x->setZero();
  V_.setZero();
  W_.setZero();
  if (!linear_) return;
  c_.noalias()  = B.first * q.eta;
  p_.noalias()  = B.first * q.rate;
  pa_.noalias() = B.first * q.acceleration;
  for (int c = 0; c < 3; c++)
    for (int d = 0; d < 3; d++) b_.col(At(c, d)) = B.moment[d].row(c).transpose();
  for (int c = 0; c < 3; c++)
    for (int e = 0; e < 3; e++) I2_(c, e) += B.moment[c].row(e).dot(q.eta.transpose());
  if (quadratic_) products(q.eta, b_);
  for (int c = 0; c < 3; c++)
    for (int e = 0; e < 3; e++) {
      I2_(c, e) += b_.col(At(c, e)).dot(q.eta);
      V_(c, e) = b_.col(At(e, c)).dot(q.rate);
      W_(c, e) = b_.col(At(e, c)).dot(q.acceleration);
    }
  if (!quadratic_) return;
  n_rate_.setZero();
  products(q.rate, n_rate_);
}

void ModalDynamics::force(const ModalMotion &q, Vector3 &f, Vector3 &n, Eigen::Ref<Eigen::VectorXd> h)
{
  integrals(q);
  const Matrix3 At_ = q.A.transpose(), O = Cross<double>(At_ * q.w);
  const Vector3 a0 = At_ * q.a0;
  const Matrix3 L  = Cross<double>(At_ * q.alpha) + O * O;
  f.noalias() = q.A * (body_->mass * a0 + L * c_ + 2 * O * p_ + pa_);
  n.noalias() = q.A * Axial(c_ * a0.transpose() + I2_ * L.transpose() + 2 * V_ * O.transpose() + W_);
  h           = q.acceleration + damping_.cwiseProduct(q.rate) + stiffness_.cwiseProduct(q.eta);
  if (!linear_) return;
  h.noalias() += body_->first.transpose() * a0;
  for (int c = 0; c < 3; c++)
    for (int d = 0; d < 3; d++) {
      h += L(c, d) * b_.col(At(c, d));
      if (quadratic_ && c != d) h += (2 * O(c, d)) * n_rate_.col(At(c, d));
    }
}

void ModalDynamics::gradient(const ModalMotion &q, double sv, double sa, ModalGradient &G)
{
  const ModalBody &B = *body_;
  integrals(q);
  const Matrix3 At_ = q.A.transpose();
  const Vector3 w = At_ * q.w, a0 = At_ * q.a0, alpha = At_ * q.alpha;
  const Matrix3 O = Cross<double>(w), L = Cross<double>(alpha) + O * O, J = Inertia(I2_), X = Cross<double>(c_);
  const Vector3 f = q.A * (B.mass * a0 + L * c_ + 2 * O * p_ + pa_);
  const Vector3 n = q.A * Axial(c_ * a0.transpose() + I2_ * L.transpose() + 2 * V_ * O.transpose() + W_);

  /* rigid rows and columns: partial derivatives in body axes, turned into space; a turn of the body changes what is constant in space */
  const auto turned = [&](const Matrix3 &D) { return Matrix3(q.A * D * At_); };
  const Matrix3 fw = turned(-Cross<double>(w.cross(c_)) - O * X - 2 * Cross<double>(p_)), fa = turned(-X);
  const Matrix3 na = turned(X), nw = turned(O * J - Cross<double>(J * w) + 2 * (V_.trace() * Matrix3::Identity() - V_.transpose()));
  const Matrix3 nalpha = turned(J), turn[3] = {Cross<double>(q.a0), Cross<double>(q.w), Cross<double>(q.alpha)};
  G.rigid << B.mass * Matrix3::Identity(), B.mass * turn[0] + fw * turn[1] + fa * turn[2] - Cross<double>(f), fw, fa, na,
      na * turn[0] + nw * turn[1] + nalpha * turn[2] - Cross<double>(n), nw, nalpha;

  G.modal.setZero(m_, m_);
  G.modal.diagonal() = stiffness_ + sv * damping_ + Eigen::VectorXd::Constant(m_, sa);
  G.modal_rigid.setZero(m_, 12);
  G.rigid_modal.setZero(6, m_);
  if (!linear_) return;

  if (quadratic_) {
    addQuadratic(L + 2 * sv * O, 1, G.modal);
    n_acc_.setZero();
    products(q.acceleration, n_acc_);
  }

  /* modal rows by a0, w, alpha */
  Eigen::Matrix<double, Eigen::Dynamic, 3> hw(m_, 3), halpha(m_, 3);
  const auto                               trace = b_.col(At(0, 0)) + b_.col(At(1, 1)) + b_.col(At(2, 2));
  for (int a = 0; a < 3; a++) {
    const int i = (a + 1) % 3, j = (a + 2) % 3;
    halpha.col(a) = b_.col(At(j, i)) - b_.col(At(i, j));
    hw.col(a)     = -2 * w(a) * trace;
    for (int d = 0; d < 3; d++) hw.col(a) += w(d) * (b_.col(At(a, d)) + b_.col(At(d, a)));
    if (quadratic_) hw.col(a) += 2 * (n_rate_.col(At(j, i)) - n_rate_.col(At(i, j)));
  }
  G.modal_rigid.leftCols<3>().noalias()     = B.first.transpose() * At_;
  G.modal_rigid.middleCols<3>(6).noalias()  = hw * At_;
  G.modal_rigid.rightCols<3>().noalias()    = halpha * At_;
  G.modal_rigid.middleCols<3>(3).noalias()  = G.modal_rigid.leftCols<3>() * turn[0] + G.modal_rigid.middleCols<3>(6) * turn[1] +
                                             G.modal_rigid.rightCols<3>() * turn[2];

  /* rigid rows by modal coordinates: of int y_c (acceleration)_d, then its axial part */
  G.rigid_modal.topRows<3>().noalias() = q.A * (L + 2 * sv * O + sa * Matrix3::Identity()) * B.first;
  Eigen::Matrix<double, Eigen::Dynamic, 9> Y(m_, 9);
  for (int c = 0; c < 3; c++)
    for (int d = 0; d < 3; d++) {
      auto y = Y.col(At(c, d));
      y      = a0(d) * B.first.row(c).transpose() + sa * b_.col(At(d, c));
      for (int e = 0; e < 3; e++) {
        y += L(d, e) * (b_.col(At(c, e)) + b_.col(At(e, c))) + (2 * sv * O(d, e)) * b_.col(At(e, c));
        if (quadratic_) y += (2 * O(d, e)) * n_rate_.col(At(c, e));
      }
      if (quadratic_) y += n_acc_.col(At(c, d));
    }
  Eigen::Matrix<double, 3, Eigen::Dynamic> moment(3, m_);
  for (int a = 0; a < 3; a++) moment.row(a) = (Y.col(At((a + 1) % 3, (a + 2) % 3)) - Y.col(At((a + 2) % 3, (a + 1) % 3))).transpose();
  G.rigid_modal.bottomRows<3>().noalias() = q.A * moment;
}

ModalEnergy ModalDynamics::energy(const ModalMotion &q, const Vector3 &v)
{
  integrals(q);
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
