/*
  What is wrong with a finite-element model, said before or after a factorization shows it, in terms of its nodes.
*/
#ifndef HHTDAE_FLEXIBLE_DIAGNOSE_H
#define HHTDAE_FLEXIBLE_DIAGNOSE_H

#include "attachments.h"
#include "scene/small_matrix.h"

namespace hhtdae
{

/* Size, mass and stiffness of the whole body */
struct BodyScales {
  double  mass    = 0;
  Vector3 center  = Vector3::Zero(); /* of mass */
  Matrix3 moments = Matrix3::Zero(); /* int X X^T dm from it */
  double  length  = 0;               /* greatest extent from the centre */
  double  volume  = 0;               /* of the box around the nodes */
  double  soft    = 0;   /* lowest elastic eigenvalue among quadratic displacements: an upper bound of the true one */
  double  stiff   = 0;   /* about the highest eigenvalue: largest K_ii / M_ii */
  Eigen::MatrixXd rigid; /* six rigid motions at own dofs, orthonormal in M */
  Eigen::Matrix<double, 6, 6>
      frame; /* the same as translation of the centre of mass and rotation, one motion a column */
};

/* diagnose_matrices.cpp: sizes, symmetry, finite entries; M = m_ij times identity(3) with positive diagonal; nodes without stiffness */
PetscErrorCode CheckMatrices(const FeModel &model);
/* diagnose_parts.cpp: one part, rigid attachments taken as links */
PetscErrorCode CheckConnected(const FeModel &model, const std::vector<Tied> &tied);

/* diagnose_scales.cpp */
PetscErrorCode ComputeScales(const FeModel &model, BodyScales *scales);
/* K r = 0 for rigid motions r: no supports, no springs to ground */
PetscErrorCode CheckUnsupported(const FeModel &model, const BodyScales &scales);
/* What may be wrong with the units; empty: nothing strikes */
std::string SuspectUnits(const FeModel &model, const BodyScales &scales);

/* diagnose_nodes.cpp: labels of the nodes that move most in u (own dofs), "17, 18 and 19"; on all ranks */
PetscErrorCode MostMoved(const FeModel &model, const Eigen::VectorXd &u, std::string *labels);
/* Raises the error of a mechanism which moves as u */
PetscErrorCode MechanismError(const FeModel &model, const Eigen::VectorXd &u, const char where[]);

} // namespace hhtdae

#endif
