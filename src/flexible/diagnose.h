/*
  Diagnosis of faulty finite-element models, before a factorization or after it failed, in terms of the model's nodes.
*/
#ifndef HHTDAE_FLEXIBLE_DIAGNOSE_H
#define HHTDAE_FLEXIBLE_DIAGNOSE_H

#include "attachments.h"
#include "scene/small_matrix.h"

namespace hhtdae
{

/* Size, mass and stiffness of the whole body */
struct BodyScales {
  double          mass    = 0;
  Vector3         center  = Vector3::Zero(); /* of mass */
  Matrix3         moments = Matrix3::Zero(); /* int X X^T dm from it */
  double          length  = 0;               /* largest extent from the centre of mass along an axis */
  double          volume  = 0;               /* of the bounding box */
  double          soft    = 0;               /* lowest elastic Ritz value of quadratic displacement fields: an upper bound of the lowest elastic eigenvalue */
  double          stiff   = 0;               /* estimate of the highest eigenvalue: largest K_ii / M_ii */
  Eigen::MatrixXd rigid;                     /* six rigid motions at own dofs, M-orthonormal */
  Eigen::Matrix<double, 6, 6>
      frame; /* the same motions, one per column, as translation of the centre of mass and rotation */
};

/* diagnose_matrices.cpp: sizes, symmetry, finite entries; M = m_ij times identity(3) with positive diagonal; nodes without stiffness */
PetscErrorCode CheckMatrices(const FeModel &model);
/* diagnose_parts.cpp: the model is connected, rigid attachments being counted as connections */
PetscErrorCode DescribeParts(const FeModel &model, const std::vector<Tied> &tied, std::string *text); /* "2 parts ...", "" if it is connected; on all ranks */
PetscErrorCode CheckConnected(const FeModel &model, const std::vector<Tied> &tied);

/* diagnose_scales.cpp */
PetscErrorCode ComputeScales(const FeModel &model, BodyScales *scales);
/* Checks K r = 0 for rigid motions r, so that there are no supports or springs to ground */
PetscErrorCode CheckUnsupported(const FeModel &model, const BodyScales &scales);
/* A warning about improbable units, or "" */
std::string SuspectUnits(const FeModel &model, const BodyScales &scales);

/* diagnose_nodes.cpp: labels of the nodes with the largest displacements in u (own dofs), as "17, 18 and 19"; on all ranks */
PetscErrorCode MostMoved(const FeModel &model, const Eigen::VectorXd &u, std::string *labels);
/* Raises the error for a mechanism, whose motion is u */
PetscErrorCode MechanismError(const FeModel &model, const Eigen::VectorXd &u, const char where[]);

} // namespace hhtdae

#endif
