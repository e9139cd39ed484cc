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
#include <Eigen/Eigenvalues>

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

/* Eigenvalues that are equal but for rounding: symmetric bodies have them, and any combination of their modes is one */
inline bool EqualFrequencies(double lambda1, double lambda2) { return lambda2 - lambda1 < 2e-7 * lambda2; }
/* Columns [from, to) of X, modes of one frequency, and of Y which goes with it, turned to a choice that is the same on
 * any number of ranks */
PetscErrorCode TurnEqual(const FeModel &model, const BodyScales &scales, PetscInt from, PetscInt to, MatrixXd *X,
                         MatrixXd *Y);

/* |P^T r| of residuals r at own dofs, P the ties of rigid attachments: what acts inside such an attachment is left out
 */
PetscErrorCode TiedNorms(const FeModel &model, const std::vector<Tied> &tied, double length, const MatrixXd &r,
                         VectorXd *norms);

} // namespace hhtdae

#endif
