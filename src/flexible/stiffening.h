/*
  Geometric stiffening: how loads change the modal stiffness, to first order in them.

  A load makes stress sigma in the linear model, and stress makes work with what displacements have of second order,

      sigma : (grad u^T grad u) / 2,      K_G,kl = int grad phi_k^T : (sigma grad phi_l^T)

  (Geradin, Cardona, Flexible Multibody Dynamics, 2001, ch. 6; Wallrapp, Schwertassek, Int. J. Numer. Meth. Eng. 32, 1991). Loads are forces and
  moments on attachments and centrifugal forces. A body that nothing holds has no stress but with the inertia that these bring: every load is
  balanced by rigid accelerations (inertia relief), so that accelerations of the frame and gravity need no stiffness of their own. Inertia of
  the modes themselves is left out.

  The nodes of an attachment turn with it, by phi x d + phi x (phi x d)/2 at the distance d from its point. The forces t that they get from it make work
  with the second term, which K_G of displacements linear in the modes does not know: phi^T T phi/2 with T = sum (t d^T + d t^T)/2 - (t.d) 1. Without it
  moments would have a potential that depends on how the nodes share them (Argyris, Comp. Meth. Appl. Mech. Eng. 32, 1982).
*/
#ifndef HHTDAE_FLEXIBLE_STIFFENING_H
#define HHTDAE_FLEXIBLE_STIFFENING_H

#include "craig_bampton.h"

namespace hhtdae
{

/* Fills the stiffening of the body and of its attachments for modes x (own dofs) */
PetscErrorCode ComputeStiffening(const FeModel &model, const std::vector<Tied> &tied, const BodyScales &scales, const Reduction &reduction,
                                 const MatrixXd &x, ModalBody *body);

} // namespace hhtdae

#endif
