/*
  Inertia invariants in nodal form: M = m_ij times identity(3), the modes and the coordinates of the nodes are all they
  need.

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

/* Fills first, moment and quadratic of the body for modes x (own dofs), one reduction over the ranks */
PetscErrorCode ComputeInvariants(const FeModel &model, const BodyScales &scales, const Eigen::MatrixXd &x,
                                 ModalBody *body);

} // namespace hhtdae

#endif
