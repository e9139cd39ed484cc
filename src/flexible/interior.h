/*
  The interior problem of a body whose attachments are held.

  The nodes of rigid attachments are eliminated. Averages add multipliers: with C u the motions of all averages,

      [ K_II  C^T ] [ u ]   [ f ]
      [ C      0  ] [ l ] = [ q ]

  gives constraint modes (q a unit vector or zero, f from the nodes of rigid attachments) and, with f = omega^2 M_II u and q = 0,
  normal modes. One factorization of this matrix is used for both, and for the residuals of the modes.
*/
#ifndef HHTDAE_FLEXIBLE_INTERIOR_H
#define HHTDAE_FLEXIBLE_INTERIOR_H

#include "diagnose.h"
#include "modes.h"

namespace hhtdae
{

/* K and M of the dofs that belong to no rigid attachment, with the multipliers of averages */
struct Interior {
  std::vector<PetscInt> dof; /* own free dofs, counted from the first own dof; the first rows of the pencil on this rank */
  Pencil                pencil;
  PetscInt              rows = 0; /* rows of this rank, multipliers included */
  VectorXd              scale;    /* scale factors of the rows of C, 6 for each average; on all ranks */
  std::vector<PetscInt> row;      /* local rows of the multipliers, 6 for each average; -1: on another rank */

  ~Interior()
  {
    PetscCallAbort(PETSC_COMM_SELF, MatDestroy(&pencil.K));
    PetscCallAbort(PETSC_COMM_SELF, MatDestroy(&pencil.M));
  }
};

/* Own dofs, counted from the first own one, that belong to no rigid attachment */
std::vector<PetscInt> FreeDofs(const FeModel &model, const std::vector<Tied> &tied);
/* An AIJ matrix with these numbers of own rows and columns, not preallocated */
PetscErrorCode CreateEmpty(MPI_Comm comm, PetscInt rows, PetscInt cols, Mat *A);

PetscErrorCode CreateInterior(const FeModel &model, const std::vector<Tied> &tied, const BodyScales &scales,
                              Interior *in);
/* Factors the interior stiffness; if it is singular, the error names the nodes of the mechanism */
PetscErrorCode FactorInterior(const FeModel &model, const Interior &in, const BodyScales &scales, KSP *ksp);
/* Sets the first columns of *modes, 6 for each attachment */
PetscErrorCode ConstraintModes(const FeModel &model, const std::vector<Tied> &tied, const Interior &in, KSP ksp,
                               MatrixXd *modes);

} // namespace hhtdae

#endif
