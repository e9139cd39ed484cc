/*
  The subspace of a reduced body, the modes of the reduced matrices, and their residuals in the full model.

  The subspace is computed by craig_bampton.cpp (constraint modes of the attachments, interior.h, and fixed-interface normal
  modes) or by free_free.cpp. The reduced eigenproblem is solved and residuals are computed while the factorization for the
  normal modes still exists; then it is destroyed, and an inertia count, with another factorization, tells whether normal modes
  are missing. In this order only one of the two large factorizations exists at a time.
*/
#ifndef HHTDAE_FLEXIBLE_CRAIG_BAMPTON_H
#define HHTDAE_FLEXIBLE_CRAIG_BAMPTON_H

#include "diagnose.h"
#include "interior.h"
#include "modes.h"

namespace hhtdae
{

struct ReductionSpace {
  MatrixXd x;                  /* own dofs x vectors */
  MatrixXd motion;             /* motions of the attachments: 6 rows each, on all ranks; rows of averages are not set */
  bool     holds_rigid = true; /* the space contains the rigid-body motions; else it is orthogonal to them */
  PetscInt normal      = 0;    /* vectors that are normal modes */

  /* Modes of the reduced matrices, x Y and motion Y; the same on all ranks */
  PetscInt elastic = 0;      /* number of elastic modes */
  double   lowest  = 0;      /* their lowest eigenvalue. Those that are kept have: */
  VectorXd lambda, residual; /* eigenvalues, and residuals by ModeResiduals() */
  MatrixXd Y;
};

PetscErrorCode CraigBamptonSpace(const FeModel &model, const std::vector<Tied> &tied, const Reduction &reduction,
                                 const BodyScales &scales, ReductionSpace *space);
PetscErrorCode FreeFreeSpace(const FeModel &model, const std::vector<Tied> &tied, const Reduction &reduction,
                             const BodyScales &scales, ReductionSpace *space);

/* Converts forces at own dofs to right-hand sides of the interior problem; rows of multipliers are zero, because averages are held */
MatrixXd InteriorRows(const Interior &in, const MatrixXd &force);

/* ---- normal_modes.cpp ---- */

/* The number of modes that the reduction asks for; modes below a frequency are counted by the inertia of a factorization */
PetscErrorCode Want(const Pencil &pencil, const Reduction &reduction, MPI_Comm comm, WantedModes *wanted);
/* FindModes() with progress messages; found->wanted of the modes are below reduction.max_frequency */
PetscErrorCode FindNormalModes(const FeModel &model, const Pencil &pencil, const Reduction &reduction,
                               const WantedModes &wanted, const WhileFactored &use, KSP *ksp, NormalModes *found);
/* Removes all but the first modes.wanted of the normal modes, which are the last columns of the space */
PetscErrorCode CutModes(const FeModel &model, const BodyScales &scales, const NormalModes &modes,
                        ReductionSpace *space);

/* ---- reduced_pair.cpp ---- */

/* Solves the reduced eigenproblem: sets lambda and Y to the modes that the reduction keeps */
PetscErrorCode SolveSpace(const FeModel &model, const Reduction &reduction, const BodyScales &scales,
                          ReductionSpace *space);

/* ---- residuals.cpp ---- */

/* Converts forces at own dofs to right-hand sides of the solver */
using SolverRows = std::function<PetscErrorCode(const MatrixXd &force, MatrixXd *rows)>;
/* Sets `residual` for the modes x Y; ksp solves with K - shift M, shift <= 0, of the pencil that gave the normal modes */
PetscErrorCode ModeResiduals(const FeModel &model, const Reduction &reduction, double shift, KSP ksp,
                             const SolverRows &rows, ReductionSpace *space);

/* ---- choices.cpp ---- */

/* Whether two eigenvalues, lambda1 <= lambda2, are equal up to rounding, as for symmetric bodies: any combination of their modes is then a mode */
inline bool EqualFrequencies(double lambda1, double lambda2) { return lambda2 - lambda1 < 2e-7 * lambda2; }
/* Rotates columns [from, to) of X, modes of one frequency, and likewise of Y, to a choice that is the same on any number of ranks */
PetscErrorCode TurnEqual(const FeModel &model, const BodyScales &scales, PetscInt from, PetscInt to, MatrixXd *X,
                         MatrixXd *Y);
/* Makes the largest displacement of each mode positive; among equal ones, that of the node with the least label */
PetscErrorCode FixSigns(const FeModel &model, MatrixXd *X, MatrixXd *Y);

} // namespace hhtdae

#endif
