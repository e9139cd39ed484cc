/*
  Attachments of a body to be reduced: node sets tied to a point with six degrees of freedom, rigidly (RBE2) or on average (RBE3).

  Both ties need nodes that are not collinear: otherwise the rotation about the line would have no stiffness (rigid) or be
  undefined (average).
*/
#ifndef HHTDAE_FLEXIBLE_ATTACHMENTS_H
#define HHTDAE_FLEXIBLE_ATTACHMENTS_H

#include "hhtdae/flexible.h"
#include "scene/products.h"
#include "scene/small_matrix.h"
#include <Eigen/Dense>

namespace hhtdae
{

struct Tied {
  std::string           name;
  Tie                   tie;
  Vector3               position; /* axes and origin of the FE model */
  PetscInt              count;    /* number of nodes on all ranks */
  PetscMPIInt           owner;    /* a rank with most of the nodes */
  std::vector<PetscInt> node;     /* own nodes, counted from the first own node */
  std::vector<Eigen::Matrix<double, 6, 3>>
      row; /* average only, for each own node: motion of the point per displacement of the node */
};

inline Vector3 NodePosition(const FeModel &model, PetscInt i)
{
  return Eigen::Map<const Vector3>(&model.coordinates[3 * i]);
}

inline PetscInt NodeLabel(const FeModel &model, PetscInt i)
{
  return (PetscInt)model.label.size() == model.own ? model.label[i] : model.first + i;
}

/* v x w = Cross(v) w */
inline Matrix3 Cross(const Vector3 &v)
{
  return (Matrix3() << 0, -v[2], v[1], v[2], 0, -v[0], -v[1], v[0], 0).finished();
}

/* Displacements at X of the three translations and the three rotations about `point` of a rigid body */
inline Eigen::Matrix<double, 3, 6> RigidMotion(const Vector3 &X, const Vector3 &point)
{
  Eigen::Matrix<double, 3, 6> u;
  u << Matrix3::Identity(), -Cross(X - point);
  return u;
}

/* Own nodes of a set, counted from the first own node; who: the user of the set in error messages, as "Attachment hub". Collective */
PetscErrorCode OwnNodesOf(const FeModel &model, const std::string &set, const std::string &who, std::vector<PetscInt> *node);

PetscErrorCode ResolveAttachments(const FeModel &model, const std::vector<Attachment> &attachments,
                                  std::vector<Tied> *tied);

/* Motions of the averaging attachments for displacements u at own dofs, on all ranks: six rows for each attachment, zero for rigid ones */
PetscErrorCode AverageMotions(const FeModel &model, const std::vector<Tied> &tied, const Eigen::MatrixXd &u,
                              Eigen::MatrixXd *motion);

} // namespace hhtdae

#endif
