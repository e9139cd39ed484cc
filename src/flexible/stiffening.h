/*
  Geometric stiffening: the change of the modal stiffness with loads, to first order in them.

  A load causes stress sigma in the linear model, and this stress does work with the second-order part of the strains,

      sigma : (grad u^T grad u) / 2,      K_G,kl = int grad phi_k^T : (sigma grad phi_l^T)

  (Geradin, Cardona, Flexible Multibody Dynamics, 2001, ch. 6; Wallrapp, Schwertassek, Int. J. Numer. Meth. Eng. 32, 1991). Loads are forces and
  moments on attachments and centrifugal forces. Every load is balanced by the inertia of rigid accelerations (inertia relief), because the body is free;
  accelerations of the frame and gravity therefore need no stiffness terms of their own. Inertia of the modes is neglected.

  The nodes of an attachment rotate with it, by phi x d + phi x (phi x d)/2 at the position d from its point. The forces t on these nodes do work
  with the second term, which K_G of displacements linear in the modes does not contain: phi^T T phi/2 with T = sum (t d^T + d t^T)/2 - (t.d) 1. Without it
  the potential of moments would depend on their distribution over the nodes (Argyris, Comp. Meth. Appl. Mech. Eng. 32, 1982).
*/
#ifndef HHTDAE_FLEXIBLE_STIFFENING_H
#define HHTDAE_FLEXIBLE_STIFFENING_H

#include "craig_bampton.h"

namespace hhtdae
{

/* Sets the stiffening of the body and of its attachments for modes x (own dofs) */
PetscErrorCode ComputeStiffening(const FeModel &model, const std::vector<Tied> &tied, const BodyScales &scales, const Reduction &reduction,
                                 const MatrixXd &x, ModalBody *body);

} // namespace hhtdae

#endif
