/*
  The state of a run, which every part of the integrator reads and writes: struct Integrator and its parts.

  Everything that changes during a run is kept in plain structs named ...State. checkpoint.cpp writes each of them as a whole, so that a field
  added to one of them is saved and restored without further code. Settings of the user are kept apart in structs named ...Options, which
  checkpoints do not contain: a resumed run has settings of its own.

  Unless a comment says otherwise, sizes of corrections and errors are "in units of the tolerance": 1 is what the error test just accepts.
*/
#ifndef HHTDAE_STATE_H
#define HHTDAE_STATE_H

#include "integrator/step/bdf.h"
#include "compat.h"
#include "hhtdae/hhtdae.h"
#include "linear/linear.h"
#include "integrator/step/policy.h"
#include <vector>

namespace hht3
{

/* Events of -log_view, registered in hht3.cpp */
struct Events {
  PetscLogEvent start, predict, matrix, estimate, sample;
};
extern Events events;

/* The stopping test and the reuse of the Newton matrix, section 5 of the paper */
struct CorrectorOptions : ReuseOptions {
  PetscReal c         = 1e-3; /* error left by the iteration, relative to the tolerance; see CorrectorTolerance() */
  PetscBool c_given   = PETSC_FALSE; /* the user has set c, which is then used without ConstrainedTolerance() */
  PetscInt  max_it    = 10;
  PetscBool user_lag  = PETSC_FALSE; /* the user has set -snes_lag_jacobian, which then decides when a matrix is made */
  PetscBool user_test = PETSC_FALSE; /* the user's convergence test of SNES decides; corrections are only measured */
};

/* The present run of the iteration (one SNESSolve()); BeginIteration() resets it */
struct Correction {
  PetscInt            it       = 0; /* corrections made so far */
  PetscInt            base     = 0; /* value of `it` when the present matrix came into use: it - base corrections were made with it */
  PetscInt            renewals = 0; /* matrices made because the iteration was slow */
  PetscInt            met      = 0; /* successful bisections between corrections of opposite direction, bisection.cpp */
  PetscReal           e        = 0; /* size of the last correction, in units of the tolerance */
  PetscReal           xi_max   = 0; /* largest measured rate of convergence */
  PetscReal           forces   = 0; /* residual in the rows of driven coordinates, in units of the tolerance, driven.cpp */
  SNESConvergedReason reason   = SNES_CONVERGED_ITERATING;
  PetscBool           wrong_jacobian = PETSC_FALSE; /* wrong_jacobian.cpp has found that the application's Jacobian is wrong */
  PetscBool           rounding       = PETSC_FALSE; /* the last correction was accepted because rounding makes one of its size */
};

/* What the corrector keeps from step to step */
struct CorrectorState : Correction {
  MatrixPolicy matrix;
  PetscBool no_solve    = PETSC_FALSE; /* the last failure was one of the linear solve */
  PetscBool from_rest   = PETSC_FALSE; /* the last step, of fixed length, converged from the values at its beginning and not from the prediction */
  PetscReal jacobian_faults = 0;       /* failures blamed on the Jacobian: each adds 1, each accepted step subtracts fault_decay (step.cpp) */
  PetscReal floor       = 0;           /* corrections below this, in units of the tolerance, are rounding of q */
  PetscReal wlte        = 1;           /* error estimate of the last accepted step, in units of the tolerance */
};

struct Corrector : CorrectorOptions, CorrectorState {
  PetscInt limit() const { return max_it + 2 * met; } /* largest number of iterations; -snes_max_it may be smaller */
};

/* Proof that the residual is small where a correction is, verify.cpp */
struct VerificationState {
  PetscReal largest = 0;            /* largest claim_i of the present matrix; 0: not known */
  PetscBool measured = PETSC_FALSE; /* inertia has been measured since the matrix was made */
  PetscBool looked   = PETSC_FALSE; /* the last proof has evaluated the residual after the correction */
  unsigned  sample = 3;              /* seed of the next random perturbation that samples rounding; MeasureRounding() uses 1 and 2 */
  PetscReal since = 0;              /* time since the last proof that evaluated the residual: errors of the forces may have lasted as long */
};

/* The vectors of verify.cpp and stiffness.cpp: M_ii and dF/ds', claim_i, rounding of each entry of the residual, P dX - P_lambda dlambda,
   P_lambda dlambda, and the X at which the matrix was made */
struct Verification : VerificationState {
  Vec inertia = nullptr, claim = nullptr, noise = nullptr, model = nullptr, work = nullptr, where = nullptr;
  Vec unproved = nullptr; /* per row, the time before `since` during which its residual stayed as it was each time it was evaluated */
  Vec driven = nullptr; /* 1 for coordinates that the constraints alone move, driven.cpp; null if there are none */
};

constexpr PetscInt max_degree     = max_order; /* largest degree of the predictor */
constexpr PetscInt default_degree = 3; /* largest degree that pays in steps of order two */

struct PredictorOptions {
  PetscInt  degree_max = default_degree; /* largest degree that the user allows */
  PetscBool fixed      = PETSC_FALSE; /* the degree is degree_max as soon as the history allows it, and is not chosen */
};

struct PredictorState {
  PetscInt  degree    = 0; /* of the next prediction */
  PetscInt  available = 0; /* number of values before t_n */
  PetscReal t[max_degree + 2] = {}; /* t_n, t_{n-1}, ... */
};

/* Unknowns at the ends of the accepted steps. For first-order states the true derivative s' is kept: the error test uses it, and the
   algorithmic w_n belongs to a time that depends on h. The algorithmic acceleration a_n does so, too, but is smoother than q'' and
   predicts better. */
struct Predictor : PredictorOptions, PredictorState {
  Vec X[max_degree + 2] = {}; /* a, s', lambda, V, F at t[k], allocated when first used */
};

/* What the choice of the order keeps from step to step, order.cpp */
struct OrderMemory {
  PetscReal S[max_order + 2] = {};     /* amplitudes of the scaled differences S_2 to S_6; 0: none yet */
  PetscReal ratio[max_order + 1] = {10, 10, 10, 10, 10, 10}; /* S_{m+1}/S_m, its growth limited by ratio_growth; the initial 10 limits nothing */
};

/* Orders above two, bdf.cpp and order.cpp. Not used if the largest order is two. */
struct OrderState {
  PetscInt  now = 2, next = 2;          /* order of the step from t_n, and of the step that follows when it is accepted */
  PetscInt  made = 0, accepted = 0;     /* order of the step that led to t_n, and of the accepted step from t_n; 0: none, or a tiny step */
  PetscInt  ready = 2;                  /* order for which X0, the predictor and the drift of the velocities are prepared, UseOrder() */
  PetscInt  past = 0;                   /* number of states before t_n that are kept in U and V */
  PetscInt  since = 0, above = 0;       /* steps since the order last changed, and since it rose above two */
  OrderMemory memory, after;            /* at t_n, and at the end of the present step, for its acceptance */
  PetscInt  wait = 0, penalty = 0;      /* after a failure of a higher order: steps of order two still to be made, and the last such number */
  PetscBool chosen = PETSC_FALSE;       /* `next` has been chosen for the accepted step */
  PetscReal spin = 0;                   /* fastest rotation of a body in the step that led to t_n, rad/time; 0: no history or no rotation vector */
  PetscReal drift_h = 0;                /* length of the step of order two at whose end dV was measured; 0: dV is no part of the history */
  PetscReal t[max_order + 1] = {};      /* t_n, t_{n-1}, ... */
  PetscReal hht[max_order + 1] = {};    /* length of the step that led to each of these times if it was of order two, else 0 */
};

struct Order : OrderState {
  PetscInt wanted = 2;        /* by the user; may be TSHHT3_ORDER_AUTO */
  PetscInt max    = 2;        /* largest order of this run */
  PetscBool measured = PETSC_FALSE; /* S holds the scaled differences of the present attempt in the norm `norm`, order.cpp */
  NormType norm = NORM_2;
  PetscReal S[max_order + 2] = {};
  Vec      U[max_order] = {}; /* U, U' at t_{n-1}, t_{n-2}, ... */
  Vec      V[max_order] = {};
};

struct ChangeState {
  PetscBool stale = PETSC_FALSE; /* the matrix has not been made in the new coordinates yet */
  PetscReal t     = 0;           /* time and step of the last change */
  PetscInt  step  = 0;
};

/* New generalized coordinates in the course of a run, change.cpp */
struct Change : ChangeState {
  TSHHT3ChangeTest   test   = nullptr;
  TSHHT3ChangeMap    map    = nullptr;
  TSHHT3ChangeCommit commit = nullptr;
  void              *ctx    = nullptr;
};

/* Local rotation vectors, rotations.cpp */
struct Rotations {
  IS                    is    = nullptr;
  TSHHT3Refer           refer = nullptr;
  TSHHT3ReferBack       back  = nullptr;
  void                 *ctx   = nullptr;
  std::vector<PetscInt> at;         /* local index of the first component of each vector */
  PetscReal             factor = 0; /* RotationFactor() while the matrix of a step is made, else 0 */
};

/* The longest step that the application allows, limit.cpp */
struct StepLimit {
  TSHHT3StepLimit limit = nullptr;
  void           *ctx   = nullptr;
};

/* The application's names of its rows, rows.cpp */
struct RowNames {
  TSHHT3RowName name = nullptr;
  void         *ctx  = nullptr;
};

/* A linear solver and its matrix */
struct LinearState : LinearChoice {
  PetscBool        chosen = PETSC_FALSE; /* LinearChoose() has been called */
  PetscObjectState scaled = 0;          /* state of the matrix after its scaling to (10); another one: the application has refilled it */
  PCFailedReason   failed = PC_NOERROR; /* why the last matrix could not be factored, the same on all ranks */
};

/* What the integrator has put into the SNES, its KSP and its DM, and what was there before, hooks.cpp */
struct Hooks {
  SNES      snes        = nullptr;     /* the SNES that was changed */
  PetscBool test        = PETSC_FALSE; /* the convergence test is the integrator's, or was so before the user set another */
  PetscBool line_search = PETSC_FALSE; /* the integrator has chosen the type of the line search */
  PetscBool jacobian    = PETSC_FALSE; /* the matrix is filled by the integrator's finite differences */
  Mat       J = nullptr, P = nullptr;  /* the matrices before that, and the function that filled them */
  decltype(_DMSNESOps::computejacobian) computejacobian = nullptr;
  PetscContainer jacobianctx = nullptr;
  void     *cnvP        = nullptr;     /* context of the convergence test before, and the function that destroys it */
  PetscErrorCode (*convergeddestroy)(void *) = nullptr;
  PetscInt  lag          = 1;           /* lag of the Jacobian and check of its domain error before */
  PetscBool check_domain = PETSC_FALSE;
  PetscReal abstol       = 0;           /* absolute tolerance of the KSP before it was set to 0; 0: it has not been changed */
  PetscBool abstol_told  = PETSC_FALSE; /* the user has been told so */
  PetscObjectId matrices[2] = {}; /* ids of J and P of the SNES, to notice between steps that the user has set others */
  decltype(_DMSNESOps::computejacobian) dm_jacobian     = nullptr; /* function in the DM at set-up, and its context */
  void                                 *dm_jacobian_ctx = nullptr;
  decltype(_DMSNESOps::computefunction) their_function  = nullptr; /* functions of another solver on the same DM, replaced during a step */
  decltype(_DMSNESOps::computejacobian) their_jacobian  = nullptr;
  PetscContainer                        their_ctx[2]    = {};
  PetscBool                             borrowed = PETSC_FALSE, borrowed_told = PETSC_FALSE; /* they are replaced; the user has been told so */
  PetscObjectState                      values[2] = {}; /* states of J and P after the last correction; others: someone else has changed their values */
};

/* What normal_jerk holds: nothing, the vector d of drift.cpp, or the part normal to the constraints of d or, after a start, of q''' */
enum class Jerk { None, Whole, Normal };

/* Whether loads or motions set in later in the run, excitation.cpp */
enum class Ahead { Unknown, Nothing, Loads };

/* The present step, and what is kept about the steps before it */
struct StepState {
  PetscReal        t0 = 0, t1 = 0, h = 0; /* beginning, end and length of the present attempt, or of the last accepted step between steps */
  PetscReal        h_last      = 0;       /* length of the step that led to t_n; after a start, of the first step */
  PetscReal        t_begin     = 0;       /* beginning of the run */
  TSStepStatus     status      = TS_STEP_INCOMPLETE;
  PetscBool        have_step   = PETSC_FALSE; /* U1, V1, A1, X hold an accepted step that has not been committed to U0, V0, A0, X0 yet */
  PetscBool        at_begin    = PETSC_FALSE; /* U0, V0, A0 hold the state at t_n, from which the next step starts if have_step is false (roll-back, error) */
  PetscReal        drift_removed = 0;         /* the step takes V0 - drift_removed dV for the velocities at t_n, drift.cpp */
  PetscBool        have_drift  = PETSC_FALSE; /* dV was measured at t_n */
  Jerk             jerk        = Jerk::None;
  PetscInt         norm_size   = 0;           /* number of entries in the error test on all ranks, p of (27) */
  PetscReal        of_atol = -1, of_rtol = -1; /* tolerances from which the weights were made */
  PetscReal        wlte_pending = -1; /* error estimate of the present step, -1 before anyone has asked for it */
  PetscReal        h_regular   = 0;   /* running maximum of the lengths of steps that went through the corrector, less 10 % with each step */
  PetscReal        h_rounded   = 0;   /* length below which rounding is too large a part of the accelerations, as last found; 0: never */
  PetscReal        h_limit     = 0;   /* what h may grow to after a failed correction; 0: no limit */
  PetscInt         tiny_row    = 0;   /* number of successive steps that failures have made too short for the corrector */
  PetscBool        auto_h      = PETSC_FALSE; /* the first step is still to be chosen */
  PetscBool        h_chosen    = PETSC_FALSE; /* the first step was chosen by the integrator */
  PetscReal        h_after_event = -1;        /* step size after an event that TSEvent was given, if h_chosen */
  PetscReal        h_next      = 0;           /* length planned for the next step when the last one was accepted */
  PetscReal        h_given     = 0;           /* step size that the user has set, at set-up or later, for steps of fixed length */
  PetscReal        fastest     = PETSC_MAX_REAL; /* least entry of excitation */
  PetscReal        swing       = PETSC_MAX_REAL; /* least entry of excitation among the rows that change all along the run */
  Ahead            ahead       = Ahead::Unknown; /* whether loads or motions set in that the start has not seen */
  PetscReal        ahead_to    = 0;              /* end of the run when they were looked for */
  PetscBool        told        = PETSC_FALSE;    /* the user has been told that the steps are too long to follow loads or motions */
  PetscBool        fixed_h     = PETSC_FALSE; /* steps of fixed length: the TSAdapt is TSADAPTNONE */
  TSHHT3Statistics stat        = {};
};

struct Integrator : StepState {
  /* the method */
  TSHHT3Form  form   = TSHHT3_FORM_SECOND_ORDER;
  PetscReal   alpha  = -0.3;
  PetscReal   radius = -1; /* spectral radius of Chung and Hulbert's parameters, in the second-order form; -1: HHT's parameters with alpha */
  Parameters  hht;         /* of order two */
  Parameters  p;           /* of the present step */
  TSHHT3Start start_policy = TSHHT3_START_REPORT;
  Corrector   corrector;
  Predictor   predictor;
  Order       order;
  Verification verify;

  /* the problem: which unknowns and rows have which role */
  IS                         is[TSHHT3_NUM_ROLES] = {};
  PetscBool                  is_set               = PETSC_FALSE; /* the application has given the roles, they are not detected */
  PetscBool              made_coordinates = PETSC_FALSE; /* ... but for the coordinates, whose index set holds all unknowns that it has not named */
  std::vector<unsigned char> role;   /* of local unknowns and rows; empty if every unknown of the problem is a coordinate */
  std::vector<float>         moves;  /* 1 for coordinates, 0 for others, for loops without branches; empty if `role` is */
  std::vector<PetscInt>      states, constrained; /* local unknowns that are first-order states, and those that are multipliers of constraints */
  PetscInt                   count[TSHHT3_NUM_ROLES] = {};       /* unknowns of each role on all ranks */
  PetscBool                  follow = PETSC_FALSE; /* velocity-level constraints depend on variables, see variables.cpp */
  PetscBool                  definitions_use_acceleration = PETSC_FALSE; /* a row other than an equation of motion depends on U'' */
  PetscInt                   constraints() const { return count[TSHHT3_HOLONOMIC] + count[TSHHT3_NONHOLONOMIC]; }
  /* By the global counts: `role` is empty, too, on a rank that has no unknowns, and the answer must be the same on all ranks */
  bool coordinatesAlone() const
  {
    for (int r = 0; r < TSHHT3_NUM_ROLES; r++)
      if (r != TSHHT3_COORDINATE && count[r]) return false;
    return true;
  }

  /* at t_n: U, U', U'' and the unknowns, as the accepted step of length h_last left them */
  Vec       U0 = nullptr, V0 = nullptr, A0 = nullptr, X0 = nullptr;
  Vec       dV = nullptr; /* drift of the velocities: the part of V0 that violates Phi_q q' + Phi_t = 0, drift.cpp */
  Vec       normal_jerk = nullptr; /* the drift that V0 lacks after a start or a change of coordinates, over -jerk_factor() h^2, drift.cpp; see Jerk */
  Vec       F0 = nullptr; /* f_n = F(t_n, U_n, U'_n, 0) of (9a); paper form with alpha != 0 only */
  /* at t_{n+1}: the unknowns a, w, lambda, V, F, and U, U', U'' that follow from them */
  Vec       X = nullptr, U1 = nullptr, V1 = nullptr, A1 = nullptr;
  Vec       base[3] = {}; /* the parts of U1, V1, A1 that do not depend on X, see PrepareStage() */
  PetscObjectId    stage_id = 0; /* id and state of the vector X from which U1, V1, A1 were computed; 0: they are out of date */
  PetscObjectState stage_state = 0;
  Vec       before = nullptr; /* iterate before a correction, for types of SNES that do not keep their corrections */
  std::vector<Vec> spare; /* free vectors for WorkVec */
  Vec       work = nullptr;  /* work space: second evaluation of (9a) where definitions use q'', products in the start */
  Vec       gamma = nullptr; /* right-hand side of the differentiated constraints (6b), (6c) */
  Vec       excitation = nullptr; /* per row, the time scale of loads and motions that depend on time alone, excitation.cpp; null: there are none */

  /* the error test: weights 1/max(atol, rtol Y) with running maxima Y, zero for unknowns that do not enter */
  Vec       ymax = nullptr, weight = nullptr;
  PetscBool        own_start   = PETSC_FALSE; /* the present start is from values that the integrator has computed, not from the user's */
  PetscBool        was_changed = PETSC_FALSE; /* the application has changed what forces and constraints depend on since the last step, NoteChange() */
  PetscBool        of_vectors  = PETSC_FALSE; /* of_id and of_state are set: the vectors of tolerances from which the weights were made */
  PetscObjectId    of_id[2]    = {};
  PetscObjectState of_state[2] = {};

  /* the matrix */
  Mat           second = nullptr;             /* rows of definitions that use q'', in the paper's form */
  struct Differences *differences = nullptr;  /* finite differences, if the application has no Jacobian */
  struct Sampler     *sampler = nullptr;      /* made when a time between the ends of a step is first asked for, evaluate_at.cpp */
  LinearState   linear;
  PetscObjectState scaled_operator = 0; /* as LinearState::scaled, for an operator J other than the matrix P */

  Change    change;
  StepLimit limit;
  Rotations rotations;
  RowNames  names;
  Hooks     hooks;
  PetscBool event_ahead        = PETSC_FALSE; /* event functions are being evaluated at a future state, which is in the solution of the TS, events.cpp */
  PetscBool failures_unlimited = PETSC_FALSE; /* -ts_max_snes_failures was set to unlimited in place of PETSc's default of one */
  PetscBool settings_reported  = PETSC_FALSE; /* the user has been told which settings have no effect */

  /* bookkeeping */
  char             failure[512] = ""; /* why the last attempt, start or sample has failed, for messages */
  char             cause[512] = "";   /* the failure of the last attempt from t_n whose h was well above rounding of the time */
  char             checkpoint_file[PETSC_MAX_PATH_LEN] = "";
  char             resume_file[PETSC_MAX_PATH_LEN] = "";
  PetscInt         checkpoint_every = 0;
  PetscInt         checkpoint_steps = 0; /* number of accepted steps when the last checkpoint was written or read */
  Vec              checkpoint_vec = nullptr; /* the application's vector, saved and restored with the state */
  PetscBool        timed = PETSC_FALSE; /* the clocks are running, since wall0 and cpu0 */
  PetscReal        wall0 = 0, cpu0 = 0;
  PetscReal        progress_last = 0;
};

/* f(state) for all that changes in the course of a run */
template <class F>
void ForStates(Integrator &I, F f)
{
  f(static_cast<StepState &>(I));
  f(static_cast<CorrectorState &>(I.corrector));
  f(static_cast<PredictorState &>(I.predictor));
  f(static_cast<OrderState &>(I.order));
  f(static_cast<ChangeState &>(I.change));
  f(static_cast<VerificationState &>(I.verify));
}

inline Integrator &Get(TS ts) { return *static_cast<Integrator *>(ts->data); }

/* (t + tau) - t with t + tau rounded, and never 0. Functions of time are evaluated at the rounded time, so that their differences have to be
   divided by this span and not by tau (Units.LateInTime). */
inline PetscReal SpanFrom(PetscReal t, PetscReal tau) { return t + PetscMax(tau, 4 * PETSC_MACHINE_EPSILON * PetscAbsReal(t)) - t; }
inline TSHHT3Role RoleOf(const Integrator &I, PetscInt i) { return I.role.empty() ? TSHHT3_COORDINATE : (TSHHT3Role)I.role[i]; }
inline bool IsCoordinate(const Integrator &I, PetscInt i) { return RoleOf(I, i) == TSHHT3_COORDINATE; }
inline bool IsConstraint(const Integrator &I, PetscInt i) { return RoleOf(I, i) == TSHHT3_HOLONOMIC || RoleOf(I, i) == TSHHT3_NONHOLONOMIC; }
inline bool IsDifferential(TSHHT3Role r) { return r == TSHHT3_COORDINATE || r == TSHHT3_STATE; }

/* The step size in the matrix (10), which is M + (gamma h)^2 K above order two */
inline PetscReal EffectiveStep(const Integrator &I) { return I.order.now > 2 ? I.p.gamma * I.h : I.h; }

} // namespace hht3

#endif
