/*
  An example problem, written once and used by the example programs, the tests and the adaptors to other integrators.

  The equations are F(t,U,U',U'') = 0 with U = q, first-order states, multipliers lambda, variables V, force states F:

    M(q) q'' + Phi_q^T lambda + Psi_q'^T mu - Q = 0      row of a coordinate, affine in q''
    Phi(q,t) = 0,  Psi(q,q',t) = 0                       row of a multiplier
    V - v(...) = 0,  F - f(...) = 0                      row of a variable, of a force state

  with the signs of the paper's (6), so that dF/dU is symmetric where the physics is.
*/
#ifndef HHTEX_PROBLEM_H
#define HHTEX_PROBLEM_H

#include <hhtdae/hhtdae.h>

#include <string>
#include <vector>

#if defined(PETSC_USE_COMPLEX) || !defined(PETSC_USE_REAL_DOUBLE)
#error "The example problems are written for PETSc with real scalars in double precision"
#endif

namespace hhtex
{

/* A sparse matrix as a list of (row, column, value); values of a repeated position add up */
struct Entries {
  std::vector<PetscInt> row, col;
  std::vector<double>   value;

  void add(PetscInt i, PetscInt j, double v)
  {
    row.push_back(i);
    col.push_back(j);
    value.push_back(v);
  }
  /* Keeps the memory, so that refilling allocates nothing */
  void clear()
  {
    row.clear();
    col.clear();
    value.clear();
  }
};

struct Problem {
  std::string name;
  PetscInt    n  = 0;           /* number of unknowns */
  double      t0 = 0.,          /* start */
      t1         = 1.;          /* end */
  std::vector<TSHHT3Role> role; /* of every unknown, and of its row */

  Problem()                           = default;
  Problem(const Problem &)            = delete; /* references may hold pointers into the object */
  Problem &operator=(const Problem &) = delete;
  virtual ~Problem()                  = default;

  /* q_0 and q'_0 satisfy Phi = 0, its time derivative and Psi = 0; multipliers may be zero */
  virtual void initial(double *u, double *v) const = 0;

  /* f = F(t,u,v,a); writes all n rows */
  virtual void residual(double t, const double *u, const double *v, const double *a, double *f) const = 0;

  /* Appends dF/dU + sv dF/dU' + sa dF/dU''. Every call gives the same sequence of positions, zeros included, whatever
     the arguments, so that the pattern of the matrix never changes. */
  virtual void jacobian(double t, const double *u, const double *v, const double *a, double sv, double sa,
                        Entries &J) const = 0;

  /* The exact or tabulated solution at t; unknown components are NaN. Returns false if there is no solution at t. */
  virtual bool reference(double, double *, double *, double *) const { return false; }

  /* Times at which reference() gives a solution, t0 first; a problem with an exact solution gives it at other times, too */
  virtual std::vector<double> referenceTimes() const { return {}; }

  /* True if reference() answers at any time between t0 and t1 */
  virtual bool referenceEverywhere() const { return false; }

protected:
  /* For reference(): sets all values to NaN (unknown) */
  void setUnknown(double *u, double *v, double *a) const;
  /* For referenceTimes() of a problem with an exact solution: t0, t1 and n - 1 times between */
  std::vector<double> equallySpaced(int intervals) const;
};

/* Largest errors of a state against the reference; negative where nothing is known */
struct ProblemErrors {
  double q = -1., v = -1.; /* coordinates, their velocities: |difference| / max(1, |reference|) */
  double lambda = -1.;     /* multipliers: |difference| / max |lambda_ref| */
  double other  = -1.;     /* states, variables, force states: as q */
};

PetscErrorCode ProblemCreateTS(MPI_Comm, const Problem &, TS *, Vec *U, Vec *V, bool setRoles = false);
PetscErrorCode ProblemComputeErrors(PetscReal t, const Problem &, Vec U, Vec V, ProblemErrors *);
PetscErrorCode ProblemReport(TS, const Problem &, Vec U, Vec V);
/* Integrates from t0 to t1 by TSHHT3 on all ranks, with this relative and absolute tolerance unless options set others, and prints the errors */
PetscErrorCode ProblemSolve(const Problem &, PetscReal tolerance);

/* Makes -ts_hhtdae_summary the default of a program; a value given by the user overrides it */
PetscErrorCode SummaryByDefault(void);

} // namespace hhtex

#endif
