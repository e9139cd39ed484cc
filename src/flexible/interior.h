/*
  The interior problem of a body whose attachments are held.

  Rigid attachments eliminate their nodes. Averages bring multipliers: with C u the motions of all averages,

      [ K_II  C^T ] [ u ]   [ f ]
      [ C      0  ] [ l ] = [ q ]

  gives constraint modes (q one unit, f from the nodes of rigid attachments) and, with f = omega^2 M_II u and q = 0,
  normal modes. One factorization of this matrix serves both, and the residuals of the modes in the end.
*/
#ifndef HHTDAE_FLEXIBLE_INTERIOR_H
#define HHTDAE_FLEXIBLE_INTERIOR_H

#include "diagnose.h"
#include "modes.h"

namespace hhtdae
{

/* K and M of the dofs which no rigid attachment holds, with the multipliers of averages */
struct Interior {
  std::vector<PetscInt> dof; /* own ones, counted from the first own dof; the first rows of the pencil on this rank */
  Pencil                pencil;
  PetscInt              rows = 0; /* of this rank, multipliers included */
  VectorXd              scale;    /* of the rows of averages, 6 each; on all ranks */
  std::vector<PetscInt> row;      /* of the multiplier in this rank's part, -1: on another rank; 6 for each average */

  ~Interior()
  {
    PetscCallAbort(PETSC_COMM_SELF, MatDestroy(&pencil.K));
    PetscCallAbort(PETSC_COMM_SELF, MatDestroy(&pencil.M));
  }
};

/* Own dofs, counted from the first own one, that no rigid attachment holds */
std::vector<PetscInt> FreeDofs(const FeModel &model, const std::vector<Tied> &tied);
/* A sparse matrix of these own rows and columns, nothing allocated */
PetscErrorCode CreateEmpty(MPI_Comm comm, PetscInt rows, PetscInt cols, Mat *A);

PetscErrorCode CreateInterior(const FeModel &model, const std::vector<Tied> &tied, const BodyScales &scales,
                              Interior *in);
/* An error names the mechanism if the interior stiffness is singular */
PetscErrorCode FactorInterior(const FeModel &model, const Interior &in, const BodyScales &scales, KSP *ksp);
/* The first 6 columns of *modes for each attachment */
PetscErrorCode ConstraintModes(const FeModel &model, const std::vector<Tied> &tied, const Interior &in, KSP ksp,
                               MatrixXd *modes);

} // namespace hhtdae

#endif
