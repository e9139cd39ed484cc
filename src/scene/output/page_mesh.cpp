#include "scene/output/page_mesh.h"
#include "scene/products.h"
#include "scene/symmetric.h"
#include <limits>

namespace hhtdae
{

/* The quaternion of the best rotation is an eigenvector of a symmetric matrix (Horn 1987, J. Opt. Soc. Am. A 4, sec. 4). */
RigidFit FitRigid(const Eigen::Matrix3Xd &X, const Eigen::Map<const Eigen::Matrix3Xd> &x)
{
  const Vector3 origin = x.rowwise().mean();
  if (!x.allFinite()) return {Vector3::Constant(std::numeric_limits<double>::quiet_NaN()), Matrix3::Identity()};
  const Matrix3   S = X * (x.colwise() - Eigen::Vector3d(origin)).transpose();
  Eigen::Matrix4d N;
  N(0, 0)                     = S.trace();
  N.bottomLeftCorner<3, 1>()  = Vector3(S(1, 2) - S(2, 1), S(2, 0) - S(0, 2), S(0, 1) - S(1, 0));
  N.bottomRightCorner<3, 3>() = S + S.transpose() - S.trace() * Matrix3::Identity();
  const Eigen::Vector4d q     = SymmetricEigen(N).vectors.col(3);
  return {origin, Matrix3(Eigen::Quaterniond(q(0), q(1), q(2), q(3)).toRotationMatrix())};
}

} // namespace hhtdae
