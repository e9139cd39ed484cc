#include "euler.h"

namespace hhtdae
{

Matrix3 ChooseAxes(const Matrix3 &A, const Vector3 &w)
{
  const Vector3 z(0, 0, 1);
  const double  speed = w.norm(), level = std::hypot(w(0), w(1));
  Vector3       third;
  if (level > std::abs(w(2))) third = w / speed;
  else if (level > 1e-12 * speed) third = w.cross(z) / level;
  else third = Vector3(1, 0, 0);
  /* The first axis is horizontal and normal to the third, so that psi = 0 */
  const Vector3 first = z.cross(third).normalized();
  Matrix3       B;
  B << first, third.cross(first), third;
  return B.transpose() * A;
}

} // namespace hhtdae
