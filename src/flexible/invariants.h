/*
  Inertia invariants in nodal form, from M = m_ij times identity(3), the modes and the coordinates of the nodes.

      int phi dm            = sum_ij m_ij phi_j
      int X_c phi_d dm      = sum_ij X_i,c m_ij phi_j,d
      int phi_k,c phi_l,d dm = sum_ij phi_i,k,c m_ij phi_j,l,d
*/
#ifndef HHTDAE_FLEXIBLE_INVARIANTS_H
#define HHTDAE_FLEXIBLE_INVARIANTS_H

#include "diagnose.h"
#include "scene/small_matrix.h"

namespace hhtdae
{

/* Sets mass, center, moments, first, moment and quadratic of the body for modes x (own dofs), with one reduction over the ranks */
PetscErrorCode ComputeInvariants(const FeModel &model, const BodyScales &scales, const Eigen::MatrixXd &x,
                                 ModalBody *body);

} // namespace hhtdae

#endif
