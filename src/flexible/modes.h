/*
  Blocks of distributed vectors, factorizations and eigenvalues for the reduction of a body.

  A block of vectors is an Eigen matrix with the rows that this rank owns. All functions are collective.
*/
#ifndef HHTDAE_FLEXIBLE_MODES_H
#define HHTDAE_FLEXIBLE_MODES_H

#include "scene/products.h"
#include "scene/small_matrix.h"
#include <Eigen/Core>
#include <functional>
#include <petscksp.h>
#include <string>

namespace hhtdae
{

using Eigen::MatrixXd;
using Eigen::VectorXd;

#define REDUCE_PREFIX "reduce_" /* prefix of all options of solvers */

/* Initializes SLEPc if the program has initialized PETSc only */
PetscErrorCode StartSlepc();

/* ---- blocks ---- */

constexpr PetscInt block_columns = 32; /* columns multiplied, or solved for, at a time */

/* Y = A X */
PetscErrorCode Multiply(Mat A, const MatrixXd &X, MatrixXd *Y);
/* Y = A X for the columns [from, from + count) of X */
PetscErrorCode MultiplyColumns(Mat A, const MatrixXd &X, PetscInt from, PetscInt count, MatrixXd *Y);
PetscErrorCode SumOverRanks(MPI_Comm comm, MatrixXd *A);

/* ---- progress and time ---- */

/* One phase of the reduction: a stage of PETSc's log, and a line printed by rank 0 with time and memory */
class Phase
{
public:
  Phase(MPI_Comm comm, bool print) : comm_(comm), print_(print) {}
  Phase(const Phase &) = delete;
  ~Phase(); /* pops the stage of the log after an error (ReductionErrors.LeaveNoStageOfTheLog) */
  PetscErrorCode begin(const char name[]);
  PetscErrorCode end(const std::string &result); /* result: text for the printed line */

private:
  MPI_Comm       comm_;
  bool           print_;
  std::string    name_;
  PetscLogDouble start_ = 0;
  bool           begun_ = false;
};

/* ---- factorizations and eigenvalues of K x = lambda M x ---- */

/*
  K and M are symmetric. K may have rows of multipliers, where M is zero; each adds one negative pivot. If there are rigid-body
  modes, K is singular, and `rigid` contains them, M-orthonormal.
*/
struct Pencil {
  Mat      K = nullptr, M = nullptr;
  PetscInt multipliers = 0, modes = 0; /* modes: number of finite eigenvalues, including those of rigid modes */
  MatrixXd rigid;                      /* own rows; no columns if there are no rigid modes */
};

/* A solver that is destroyed with its scope, also after an error */
struct ScopedSolver {
  KSP ksp = nullptr;

  ScopedSolver() = default;
  ~ScopedSolver() { PetscCallAbort(PETSC_COMM_SELF, KSPDestroy(&ksp)); }
  ScopedSolver(const ScopedSolver &) = delete;
};

/* Creates a solver with the defaults of the reduction (L D L^T by MUMPS), which -reduce_... overrides */
PetscErrorCode CreateSolver(MPI_Comm comm, KSP *ksp);
/* Factors A; *singular: the factorization met null pivots or failed; *negative: number of negative pivots, -1 if the solver does not count them */
PetscErrorCode Factor(KSP ksp, Mat A, PetscBool *singular, PetscInt *negative);
/* Solves A X = F for a block of right-hand sides */
PetscErrorCode SolveBlock(KSP ksp, const MatrixXd &F, MatrixXd *X);
/* Creates K - lambda M */
PetscErrorCode Shifted(const Pencil &pencil, double lambda, Mat *S);

/* Number of elastic modes below lambda, by the inertia of K - lambda M; -1 if the solver does not count negative pivots */
PetscErrorCode CountBelow(const Pencil &pencil, double lambda, PetscInt *count);

/* Converged modes; there may be a few more than wanted */
struct NormalModes {
  PetscInt    wanted = 0;
  VectorXd    lambda; /* ascending */
  MatrixXd    x;      /* own rows, M-orthonormal */
  std::string how;    /* iterations, for the progress messages */
  std::string count = "none to count"; /* what the count by inertia found, for the progress messages */
};

struct WantedModes {
  PetscInt count = 0; /* number of lowest modes */
  double   below = 0; /* if positive: all modes below this eigenvalue, counted by CountBelow() */
  double   shift = 0;
};

/* Default type of the eigensolver (block_krylov.cpp); -reduce_eps_type selects another one of SLEPc's */
#define EPS_BLOCK_KRYLOV "blockkrylovschur"
PetscErrorCode RegisterBlockKrylov();

/* Called when modes have been found, while the factorization of K - shift M exists; called again, with more modes, if some were missing. It
   may reduce modes->wanted. ksp is null only if no modes were searched and no solver was given. */
using WhileFactored = std::function<PetscErrorCode(KSP ksp, NormalModes *modes)>;

/* Destroys *ksp, which may be null; if it contains a factorization of K and the shift is 0, this is used first */
PetscErrorCode FindModes(const Pencil &pencil, const WantedModes &wanted, const WhileFactored &use, KSP *ksp,
                         NormalModes *modes);

} // namespace hhtdae

#endif
