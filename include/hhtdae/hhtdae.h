/*
  hhtdae: the Hilber-Hughes-Taylor integrator for index-3 differential-algebraic equations of multibody dynamics,
  as the PETSc time stepper TSHHT3 ("hhtdae").

  The application describes M(q) q'' + Phi_q^T lambda = Q, Phi(q,t) = 0 through PETSc's second-order interface,
  F(t,U,U',U'') = 0 with TSSetI2Function() and TSSetI2Jacobian(); U holds generalized coordinates q, first-order states,
  multipliers lambda, user-defined variables V and force states F in any order. Row i of F is the equation that belongs
  to unknown i: the equation of motion of a coordinate, the constraint of a multiplier, the definition of a variable.

  This is the only header an application needs. Every function is documented, with units and options, where it is defined.
*/
#ifndef HHTDAE_H
#define HHTDAE_H

#include <petscts.h>

#if defined(PETSC_USE_COMPLEX) || !defined(PETSC_USE_REAL_DOUBLE)
#error "hhtdae needs a PETSc with real scalars of double precision: set PETSC_DIR and PETSC_ARCH to one"
#endif

#if defined(__cplusplus)
extern "C" {
#endif

#define TSHHT3 "hhtdae"

/* METIS nested dissection as a PETSc ordering, -pc_factor_mat_ordering_type metisnd */
#define MATORDERINGMETISND "metisnd"

/* How the inertia forces are averaged over a step */
typedef enum {
  TSHHT3_FORM_PAPER,       /* Negrut et al. (9a): inertia at t_{n+1} over (1+alpha); first order where M varies and alpha != 0 */
  TSHHT3_FORM_SECOND_ORDER /* Arnold and Bruels: equations of motion exact at t_{n+1}; second order always */
} TSHHT3Form;
PETSC_EXTERN const char *const TSHHT3Forms[];

/* Role of an unknown; it determines what the unknown's row of the residual is */
typedef enum {
  TSHHT3_COORDINATE,   /* generalized coordinate q; its row is an equation of motion, affine in q'' */
  TSHHT3_STATE,        /* first-order state; its row has U' and no U'' of its own */
  TSHHT3_HOLONOMIC,    /* multiplier of a holonomic constraint Phi(q,t) = 0 */
  TSHHT3_NONHOLONOMIC, /* multiplier of a velocity-level constraint Psi(q,q',t) = 0 */
  TSHHT3_VARIABLE,     /* user-defined variable V, row V - v(...) = 0 */
  TSHHT3_FORCE,        /* force state F, row F - f(...) = 0 */
  TSHHT3_NUM_ROLES
} TSHHT3Role;
PETSC_EXTERN const char *const TSHHT3Roles[];

/* Treatment of initial values that violate the constraints */
typedef enum {
  TSHHT3_START_OFF,    /* use them as they are */
  TSHHT3_START_REPORT, /* measure the violation and report it where it matters (the default) */
  TSHHT3_START_PROJECT /* move q_0 and q'_0 to the nearest consistent values in the metric of the mass matrix */
} TSHHT3Start;
PETSC_EXTERN const char *const TSHHT3Starts[];

/* Argument of TSHHT3SetOrder(): order two (HHT), and orders three to five where the motion is smooth */
#define TSHHT3_ORDER_AUTO (-1)

/* Counters of a run, summed over all calls of TSSolve(), without the set-up. The summary line prints them in this order, except that
   `changes` comes last (and only if there were any) and that `of_order` is left out. */
typedef struct {
  PetscInt  steps;           /* accepted steps */
  PetscInt  rejected;        /* steps rejected by the error test */
  PetscInt  newton;          /* corrector iterations */
  PetscInt  residuals;       /* evaluations of the application's residual */
  PetscInt  jacobians;       /* evaluations of the application's Jacobian */
  PetscInt  factorizations;  /* set-ups of the preconditioner with a new matrix */
  PetscInt  solves;          /* linear solves */
  PetscReal time;            /* wall-clock seconds from the first step of a TSSolve() to its end (during a TSSolve(): up to now) */
  PetscReal cpu;             /* CPU seconds of this process over the same intervals */
  PetscInt  corrector_fails; /* corrections that did not converge */
  PetscInt  retries;         /* failed corrections that were repeated at the same h with a new matrix */
  PetscInt  restarts;        /* consistent starts: the first one, events, TSRestartStep() */
  PetscInt  changes;         /* changes of coordinates, TSHHT3SetCoordinateChange() */
  PetscInt  tiny_steps;      /* steps so short that rounding in q would swamp the accelerations; they are advanced by Taylor series */
  PetscReal h_min, h_max;    /* smallest and largest accepted step */
  PetscInt  of_order[6];     /* accepted steps of order 2, 3, 4, 5, at these indices */
} TSHHT3Statistics;

/* Registers TSHHT3 and the ordering "metisnd" with PETSc; PETSc calls it itself when the library is loaded as a plugin */
PETSC_EXTERN PetscErrorCode TSHHT3Initialize(void);

/* The method */
PETSC_EXTERN PetscErrorCode TSHHT3SetForm(TS, TSHHT3Form);
PETSC_EXTERN PetscErrorCode TSHHT3GetForm(TS, TSHHT3Form *);
PETSC_EXTERN PetscErrorCode TSHHT3SetAlpha(TS, PetscReal);
PETSC_EXTERN PetscErrorCode TSHHT3GetAlpha(TS, PetscReal *);
PETSC_EXTERN PetscErrorCode TSHHT3SetRadius(TS, PetscReal);
PETSC_EXTERN PetscErrorCode TSHHT3SetOrder(TS, PetscInt);
PETSC_EXTERN PetscErrorCode TSHHT3GetOrder(TS, PetscInt *);
PETSC_EXTERN PetscErrorCode TSHHT3SetCorrectorTolerance(TS, PetscReal);
PETSC_EXTERN PetscErrorCode TSHHT3SetPredictorDegree(TS, PetscInt);
PETSC_EXTERN PetscErrorCode TSHHT3SetReuse(TS, PetscReal, PetscReal, PetscReal);

/* The problem */
PETSC_EXTERN PetscErrorCode TSHHT3SetIS(TS, TSHHT3Role, IS);
PETSC_EXTERN PetscErrorCode TSHHT3GetIS(TS, TSHHT3Role, IS *);
PETSC_EXTERN PetscErrorCode TSHHT3SetStart(TS, TSHHT3Start);
PETSC_EXTERN PetscErrorCode TSHHT3SetNodes(TS, IS, Vec);

/* Change to other generalized coordinates during a run: the test whether it is due, the map of (U, U', U'') to the new coordinates, and
   the notice that the change has been made */
typedef PetscErrorCode (*TSHHT3ChangeTest)(TS ts, PetscReal t, Vec U, Vec V, PetscBool *change, void *ctx);
typedef PetscErrorCode (*TSHHT3ChangeMap)(TS ts, PetscReal t, Vec U, Vec V, Vec A, void *ctx);
typedef PetscErrorCode (*TSHHT3ChangeCommit)(TS ts, void *ctx);
PETSC_EXTERN PetscErrorCode TSHHT3SetCoordinateChange(TS, TSHHT3ChangeTest, TSHHT3ChangeMap, TSHHT3ChangeCommit, void *);

/* Local rotation vectors: the attitudes in U become the new reference attitudes, or the previous reference is restored */
typedef PetscErrorCode (*TSHHT3Refer)(TS ts, Vec U, void *ctx);
typedef PetscErrorCode (*TSHHT3ReferBack)(TS ts, void *ctx);
PETSC_EXTERN PetscErrorCode TSHHT3SetRotations(TS, IS, TSHHT3Refer, TSHHT3ReferBack, void *);
PETSC_EXTERN PetscErrorCode TSHHT3GetRotationFactor(TS, PetscReal *, Vec *);

/* Largest step size h that the application allows from the state (U, U', U'') at time t */
typedef PetscErrorCode (*TSHHT3StepLimit)(TS ts, PetscReal t, Vec U, Vec V, Vec A, PetscReal *h, void *ctx);
PETSC_EXTERN PetscErrorCode TSHHT3SetStepLimit(TS, TSHHT3StepLimit, void *);

/* The application's name of an unknown and of its row, for messages */
typedef PetscErrorCode (*TSHHT3RowName)(TS ts, PetscInt row, char name[], size_t len, void *ctx);
PETSC_EXTERN PetscErrorCode TSHHT3SetRowName(TS, TSHHT3RowName, void *);

/* The results */
PETSC_EXTERN PetscErrorCode TSHHT3GetAcceleration(TS, Vec *);
PETSC_EXTERN PetscErrorCode TSHHT3Interpolate(TS, PetscReal, Vec, Vec, Vec);
PETSC_EXTERN PetscErrorCode TSHHT3EvaluateAt(TS, PetscReal, Vec, Vec, Vec);
PETSC_EXTERN PetscErrorCode TSHHT3GetStatistics(TS, TSHHT3Statistics *);
PETSC_EXTERN PetscErrorCode TSHHT3CheckpointSave(TS, const char[]);
PETSC_EXTERN PetscErrorCode TSHHT3CheckpointLoad(TS, const char[]);
PETSC_EXTERN PetscErrorCode TSHHT3SetCheckpointVec(TS, Vec);

#if defined(__cplusplus)
}
#endif

#endif
