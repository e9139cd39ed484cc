#include "contact.h"

namespace hhtdae
{

namespace
{

/* Returns F; L: its derivatives by depth, normal and slip velocity */
Vector3 LawDerivatives(const ContactLaw &law, const Touch<double> &t, const Vector3 &v, Matrix<3, 7> &L)
{
  using T = Dual<7>;
  Vec3<T> n, slip;
  Vector3 value;
  for (int k = 0; k < 3; k++) {
    n(k)    = T(t.n(k), 1 + k);
    slip(k) = T(v(k), 4 + k);
  }
  const Vec3<T> force = ContactForce<T>(law, T(t.depth, 0), n, slip);
  for (int k = 0; k < 3; k++) {
    value(k) = force(k).value();
    L.row(k) = DerivativeRow(force(k));
  }
  return value;
}

} // namespace

Vector3 ContactDerivatives(const ContactLaw &law, const Touch<double> &t, const Vector3 &v, const ContactMovement &by, const Frame<double> *f,
                           const Twist<double> *w, Matrix<12, 12> &frames, Matrix<12, 12> &twists)
{
  Matrix<3, 7>  L;
  Matrix<3, 12> slide, F, Fw;
  const Vector3 ri = t.p - f[0].x, rj = t.p - f[1].x, force = LawDerivatives(law, t, v, L);
  const Matrix3 Lv = L.rightCols<3>(), cross = Cross<double>(force), arm_i = Cross<double>(ri), arm_j = Cross<double>(rj);
  slide            = Cross<double>(w[0].w - w[1].w) * by.point;
  slide.middleCols<3>(0) -= Cross<double>(w[0].w);
  slide.middleCols<3>(6) += Cross<double>(w[1].w);
  F = L.col(0) * by.depth + L.middleCols<3>(1) * by.normal + Lv * slide;
  Fw << Lv, -Lv * arm_i, -Lv, Lv * arm_j;

  frames.middleRows<3>(0) = F;
  frames.middleRows<3>(3) = arm_i * F - cross * by.point;
  frames.block<3, 3>(3, 0) += cross;
  frames.middleRows<3>(6) = -F;
  frames.middleRows<3>(9) = cross * by.point - arm_j * F;
  frames.block<3, 3>(9, 6) -= cross;
  twists.middleRows<3>(0) = Fw;
  twists.middleRows<3>(3) = arm_i * Fw;
  twists.middleRows<3>(6) = -Fw;
  twists.middleRows<3>(9) = -arm_j * Fw;
  return force;
}

} // namespace hhtdae
