/*
  The space in which a body moves after reduction: constraint modes of its attachments and normal modes.

  Rigid attachments eliminate their nodes. Averages bring multipliers: with C u the motions of all averages,

      [ K_II  C^T ] [ u ]   [ f ]
      [ C      0  ] [ l ] = [ q ]

  gives constraint modes (q one unit, f from the nodes of rigid attachments) and, with f = omega^2 M_II u and q = 0,
  normal modes. One factorization of this matrix serves both.
*/
#ifndef HHTDAE_FLEXIBLE_CRAIG_BAMPTON_H
#define HHTDAE_FLEXIBLE_CRAIG_BAMPTON_H

#include "diagnose.h"
#include "modes.h"

namespace hhtdae
{

struct ReductionSpace {
  MatrixXd x;                  /* own dofs x vectors */
  MatrixXd motion;             /* of the attachments: 6 rows each, on all ranks; those of averages are not filled */
  bool     holds_rigid = true; /* rigid-body motions are among its combinations; else all is orthogonal to them */
};

PetscErrorCode CraigBamptonSpace(const FeModel &model, const std::vector<Tied> &tied, const Reduction &reduction,
                                 const BodyScales &scales, ReductionSpace *space);
PetscErrorCode FreeFreeSpace(const FeModel &model, const std::vector<Tied> &tied, const Reduction &reduction,
                             const BodyScales &scales, ReductionSpace *space);

/* |P^T r| of residuals r at own dofs, P the ties of rigid attachments: what acts inside such an attachment is left out
 */
PetscErrorCode TiedNorms(const FeModel &model, const std::vector<Tied> &tied, double length, const MatrixXd &r,
                         VectorXd *norms);

} // namespace hhtdae

#endif
