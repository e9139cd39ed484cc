#include "scene/output/page_mesh.h"
#include <Eigen/SVD>
#include <limits>

namespace hhtdae
{

RigidFit FitRigid(const Eigen::Matrix3Xd &X, const Eigen::Map<const Eigen::Matrix3Xd> &x)
{
  const Vector3 origin = x.rowwise().mean();
  if (!x.allFinite()) return {Vector3::Constant(std::numeric_limits<double>::quiet_NaN()), Matrix3::Identity()};
  const Eigen::Matrix3d             H = (x.colwise() - Eigen::Vector3d(origin)) * X.transpose();
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(H, Eigen::ComputeFullU | Eigen::ComputeFullV);
  Eigen::Vector3d                   turned(1, 1, (svd.matrixU() * svd.matrixV().transpose()).determinant() < 0 ? -1 : 1);
  return {origin, Matrix3(svd.matrixU() * turned.asDiagonal() * svd.matrixV().transpose())};
}

} // namespace hhtdae
