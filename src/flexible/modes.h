/*
  Blocks of distributed vectors, factorizations and eigenvalues for the reduction of a body.

  A block of vectors is an Eigen matrix of the rows that this rank owns. All functions are collective.
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

#define REDUCE_PREFIX "reduce_" /* of all options of solvers */

/* SLEPc, for programs that started PETSc alone */
PetscErrorCode StartSlepc();

/* ---- blocks ---- */

constexpr PetscInt block_columns = 32; /* multiplied or solved at a time */

/* Y = A X */
PetscErrorCode Multiply(Mat A, const MatrixXd &X, MatrixXd *Y);
/* Y = A X for the columns [from, from + count) of X */
PetscErrorCode MultiplyColumns(Mat A, const MatrixXd &X, PetscInt from, PetscInt count, MatrixXd *Y);
PetscErrorCode SumOverRanks(MPI_Comm comm, MatrixXd *A);

/* ---- progress and time ---- */

/* One phase of the reduction: a stage of PETSc's log, an event, and a line of rank 0 with time and memory */
class Phase
{
public:
  Phase(MPI_Comm comm, bool print) : comm_(comm), print_(print) {}
  Phase(const Phase &) = delete;
  ~Phase(); /* takes the stage of the log away that an error has left (ReductionErrors.LeaveNoStageOfTheLog) */
  PetscErrorCode begin(const char name[]);
  PetscErrorCode end(const std::string &result); /* what is said of it */

private:
  MPI_Comm       comm_;
  bool           print_;
  std::string    name_;
  PetscLogDouble start_ = 0;
  bool           begun_ = false;
};

/* ---- factorizations and eigenvalues of K x = lambda M x ---- */

/*
  K and M symmetric. K may have rows of multipliers (M is zero there): each brings one negative pivot. With rigid-body
  modes K is singular, and they are given in `rigid`, orthonormal in M.
*/
struct Pencil {
  Mat      K = nullptr, M = nullptr;
  PetscInt multipliers = 0, modes = 0; /* modes: how many there are, rigid ones included */
  MatrixXd rigid;                      /* own rows; no columns: none */
};

/* A solver that goes with its scope, which an error may end too */
struct ScopedSolver {
  KSP ksp = nullptr;

  ScopedSolver() = default;
  ~ScopedSolver() { PetscCallAbort(PETSC_COMM_SELF, KSPDestroy(&ksp)); }
  ScopedSolver(const ScopedSolver &) = delete;
};

/* A solver with the defaults of the reduction (L D L^T by MUMPS), -reduce_... on top */
PetscErrorCode CreateSolver(MPI_Comm comm, KSP *ksp);
/* Factors A; *singular where the factorization met null pivots or failed. *negative: pivots, -1 if the solver does not
 * tell */
PetscErrorCode Factor(KSP ksp, Mat A, PetscBool *singular, PetscInt *negative);
/* A X = F for a block of right-hand sides */
PetscErrorCode SolveBlock(KSP ksp, const MatrixXd &F, MatrixXd *X);
/* K - lambda M, a new matrix */
PetscErrorCode Shifted(const Pencil &pencil, double lambda, Mat *S);

/* Modes below lambda without the rigid ones by an inertia count; -1: not known */
PetscErrorCode CountBelow(const Pencil &pencil, double lambda, PetscInt *count);

/* A few more than wanted may be there, found on the way */
struct NormalModes {
  PetscInt    wanted = 0;
  VectorXd    lambda; /* ascending */
  MatrixXd    x;      /* own rows, orthonormal in M */
  std::string how;    /* for the progress display */
};

struct WantedModes {
  PetscInt count = 0; /* the lowest */
  double   below = 0; /* if positive: all below it; count was found by CountBelow() */
  double   shift = 0;
};

/* The type of the eigensolver, in block_krylov.cpp; -reduce_eps_type takes any other of SLEPc's */
#define EPS_BLOCK_KRYLOV "blockkrylovschur"
PetscErrorCode RegisterBlockKrylov();

/* What needs the factorization of K - shift M once modes are found. Called again, with more modes, if some were missing;
   may lower modes->wanted. The solver is null only if nothing was searched and none was given. */
using WhileFactored = std::function<PetscErrorCode(KSP ksp, NormalModes *modes)>;

/* Consumes *ksp (may be null): if it holds a factorization of K and the shift is 0, that one is used */
PetscErrorCode FindModes(const Pencil &pencil, const WantedModes &wanted, const WhileFactored &use, KSP *ksp,
                         NormalModes *modes);

} // namespace hhtdae

#endif
