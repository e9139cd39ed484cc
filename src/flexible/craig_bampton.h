/*
  The space in which a body moves after reduction, its modes there, and how far these are from modes of the full model.

  A space is found by craig_bampton.cpp (constraint modes of the attachments, interior.h, and fixed-interface normal
  modes) or by free_free.cpp. The reduced pair is solved and residuals are taken while the factorization with which the
  normal modes were found is still there; then it goes, and an inertia count, by another one, tells whether normal modes
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
  MatrixXd motion;             /* of the attachments: 6 rows each, on all ranks; those of averages are not filled */
  bool     holds_rigid = true; /* rigid-body motions are among its combinations; else all is orthogonal to them */

  /* Modes of the reduced pair: x Y and motion Y. The same on all ranks */
  PetscInt elastic = 0;      /* how many there are; of these are kept: */
  VectorXd lambda, residual; /* residual: see ModeResiduals() */
  MatrixXd Y;
};

PetscErrorCode CraigBamptonSpace(const FeModel &model, const std::vector<Tied> &tied, const Reduction &reduction,
                                 const BodyScales &scales, ReductionSpace *space);
PetscErrorCode FreeFreeSpace(const FeModel &model, const std::vector<Tied> &tied, const Reduction &reduction,
                             const BodyScales &scales, ReductionSpace *space);

/* Forces at own dofs as right-hand sides of the interior problem; averages are held, so their rows are zero */
MatrixXd InteriorRows(const Interior &in, const MatrixXd &force);

/* ---- normal_modes.cpp ---- */

/* How many modes are asked for; counts those below a frequency by a factorization */
PetscErrorCode Want(const Pencil &pencil, const Reduction &reduction, MPI_Comm comm, WantedModes *wanted);
/* FindModes() as phases of the display; found->wanted of them are below reduction.max_frequency */
PetscErrorCode FindNormalModes(const FeModel &model, const Pencil &pencil, const Reduction &reduction,
                               const WantedModes &wanted, const WhileFactored &use, KSP *ksp, NormalModes *found);
/* The first `wanted` modes of those in the last columns of the space stay */
PetscErrorCode CutModes(const FeModel &model, const BodyScales &scales, const NormalModes &modes,
                        ReductionSpace *space);

/* ---- reduced_pair.cpp ---- */

/* Fills lambda and Y from x with the modes that the reduction keeps */
PetscErrorCode SolveSpace(const FeModel &model, const Reduction &reduction, const BodyScales &scales,
                          ReductionSpace *space);

/* ---- residuals.cpp ---- */

/* Forces at own dofs as right-hand sides of the solver */
using SolverRows = std::function<PetscErrorCode(const MatrixXd &force, MatrixXd *rows)>;
/* Fills `residual` for the modes in x Y; ksp solves with K - shift M, shift <= 0, of the body as it is tied and held */
PetscErrorCode ModeResiduals(const FeModel &model, const Reduction &reduction, double shift, KSP ksp,
                             const SolverRows &rows, ReductionSpace *space);

/* ---- choices.cpp ---- */

/* Eigenvalues that are equal but for rounding: symmetric bodies have them, and any combination of their modes is one */
inline bool EqualFrequencies(double lambda1, double lambda2) { return lambda2 - lambda1 < 2e-7 * lambda2; }
/* Columns [from, to) of X, modes of one frequency, and of Y which goes with it, turned to a choice that is the same on
 * any number of ranks */
PetscErrorCode TurnEqual(const FeModel &model, const BodyScales &scales, PetscInt from, PetscInt to, MatrixXd *X,
                         MatrixXd *Y);
/* The largest displacement of each mode is positive; among equal ones, that of the node with the least label */
PetscErrorCode FixSigns(const FeModel &model, MatrixXd *X, MatrixXd *Y);

} // namespace hhtdae

#endif
