/*
  The state of a run, which every part of the integrator reads and writes: struct Integrator, and what it is made of.

  What a run is at any time is kept in plain structs, ...State: checkpoint.cpp writes them as they are, so that a field added to one of them is saved and
  restored without another line. What the user has set is kept apart, ...Options: it belongs to the run that resumes.
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

/* The stopping test and the reuse ladder, section 5 of the paper */
struct CorrectorOptions : ReuseOptions {
  PetscReal c         = 1e-3; /* error left by the iteration, relative to the tolerance; see CorrectorTolerance() */
  PetscBool c_given   = PETSC_FALSE; /* by the user: taken as it is */
  PetscInt  max_it    = 10;
  PetscBool user_lag  = PETSC_FALSE; /* -snes_lag_jacobian: the user rules */
  PetscBool user_test = PETSC_FALSE; /* the user's test of SNES decides; corrections are only measured */
};

/* What is known of the present correction of a step */
struct Correction {
  PetscInt            it       = 0;
  PetscInt            base     = 0; /* iteration after which the present matrix came into use */
  PetscInt            renewals = 0; /* matrices made in the course of it */
  PetscInt            met      = 0; /* times that corrections have turned back and met */
  PetscReal           e        = 0; /* last correction, in units of the tolerance */
  PetscReal           xi_max   = 0; /* worst rate */
  PetscReal           forces   = 0; /* residual in the rows of driven coordinates, in units of the tolerance */
  SNESConvergedReason reason   = SNES_CONVERGED_ITERATING;
  PetscBool           wrong_jacobian = PETSC_FALSE; /* as wrong_jacobian.cpp has seen */
  PetscBool           rounding       = PETSC_FALSE; /* what is left is rounding */
};

/* What the corrector remembers of its matrix and of its corrections */
struct CorrectorState : Correction {
  MatrixPolicy matrix;
  PetscBool no_solve    = PETSC_FALSE; /* the last failure was one of the linear solve */
  PetscBool from_rest   = PETSC_FALSE; /* the last step went from where it began: at fixed steps a prediction may lead astray */
  PetscReal jacobian_faults = 0;       /* how often of late: by one each time, down a little with every accepted step */
  PetscReal floor       = 0;           /* corrections below this are rounding of q */
  PetscReal wlte        = 1;           /* error estimate of the last accepted step, in units of the tolerance */
};

struct Corrector : CorrectorOptions, CorrectorState {
  PetscInt limit() const { return max_it + 2 * met; } /* of iterations; -snes_max_it ends them before */
};

/* What is known of the forces that small corrections may hide */
struct VerificationState {
  PetscReal largest = 0;            /* claim of the present matrix; 0: not known */
  PetscBool measured = PETSC_FALSE; /* inertia has been measured since the matrix was made */
  PetscBool looked   = PETSC_FALSE; /* the residual after the last correction was needed for its proof */
  unsigned  sample = 3;              /* of rounding, the next one of its own random numbers */
  PetscReal since = 0;              /* time since the residual was looked at last: forces may have been missing for so long */
};

/* Whether small corrections prove anything, verify.cpp */
struct Verification : VerificationState {
  Vec inertia = nullptr, claim = nullptr, noise = nullptr, model = nullptr, work = nullptr, where = nullptr; /* where: X of the matrix */
  Vec unproved = nullptr; /* time before `since` in which a row's residual has stayed as it was, whenever it was looked at */
  Vec driven = nullptr; /* 1 for coordinates that the constraints alone move, driven.cpp; none where there are none */
};

constexpr PetscInt max_degree     = max_order; /* of the predictor */
constexpr PetscInt default_degree = 3; /* that pays in steps of order two */

struct PredictorOptions {
  PetscInt  degree_max = default_degree; /* what the user allows */
  PetscBool fixed      = PETSC_FALSE;
};

struct PredictorState {
  PetscInt  degree    = 0; /* in use */
  PetscInt  available = 0; /* values before t_n */
  PetscReal t[max_degree + 2] = {}; /* t_n, t_{n-1}, ... */
};

/* Unknowns at the ends of the accepted steps. Of states the true s': the error test uses them, and w_n belongs to a time that shifts with h. a_n does
   too, but is smoother than q'' and predicts better. */
struct Predictor : PredictorOptions, PredictorState {
  Vec X[max_degree + 2] = {}; /* a, s', lambda, V, F at t[k], allocated when first used */
};

/* What the choice of the order knows of the steps before */
struct OrderMemory {
  PetscReal S[max_order + 2] = {};     /* amplitudes of the scaled differences of orders 2 to 6; 0: none yet */
  PetscReal ratio[max_order + 1] = {10, 10, 10, 10, 10, 10}; /* of one to the one before it, as stability sees it; more than any where nothing is known */
};

/* Orders above two, bdf.cpp and order.cpp. Nothing of it is used where the largest order is two. */
struct OrderState {
  PetscInt  now = 2, next = 2;          /* of the step from t_n, and of the one after it when it is accepted */
  PetscInt  made = 0, accepted = 0;     /* of the step that led to t_n, and of the accepted one that leads away from it; 0: neither */
  PetscInt  ready = 2;                  /* for which X0, the predictor and the drift of the velocities stand */
  PetscInt  past = 0;                   /* states before t_n that are kept */
  PetscInt  since = 0, above = 0;       /* steps since the order has changed, and since it is above two */
  OrderMemory memory, after;            /* at t_n, and when the step is accepted */
  PetscInt  wait = 0, penalty = 0;      /* steps of order two after a higher one has failed: still to be made, and the last time */
  PetscBool chosen = PETSC_FALSE;       /* next is */
  PetscReal spin = 0;                   /* fastest rotation of a body in the step that led to t_n, rad per time; 0 where there is no history or no rotation vector */
  PetscReal drift_h = 0;                /* length of the step of order two to whose end dV belongs; 0: it belongs to none */
  PetscReal t[max_order + 1] = {};      /* t_n, t_{n-1}, ... */
  PetscReal hht[max_order + 1] = {};    /* length of the steps of order two that led there; 0 for others */
};

struct Order : OrderState {
  PetscInt wanted = 2;        /* by the user; may be TSHHT3_ORDER_AUTO */
  PetscInt max    = 2;        /* that is possible */
  PetscBool measured = PETSC_FALSE; /* S are the scaled differences of the attempt in this norm, order.cpp */
  NormType norm = NORM_2;
  PetscReal S[max_order + 2] = {};
  Vec      U[max_order] = {}; /* U, U' at t_{n-1}, t_{n-2}, ... */
  Vec      V[max_order] = {};
};

struct ChangeState {
  PetscBool stale = PETSC_FALSE; /* the matrix is still to be made in the new coordinates */
  PetscReal t     = 0;           /* of the last change */
  PetscInt  step  = 0;
};

/* New coordinates in the course of a run, change.cpp */
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
  std::vector<PetscInt> at;         /* local indices of first components */
  PetscReal             factor = 0; /* RotationFactor() while the matrix of a step is made */
};

/* The longest step that the application allows, limit.cpp */
struct StepLimit {
  TSHHT3StepLimit limit = nullptr;
  void           *ctx   = nullptr;
};

/* Names of rows, rows.cpp */
struct RowNames {
  TSHHT3RowName name = nullptr;
  void         *ctx  = nullptr;
};

/* A linear solver and its matrix */
struct LinearState : LinearChoice {
  PetscBool        chosen = PETSC_FALSE;
  PetscObjectState scaled = 0;          /* of the matrix after we scaled it, to see whether the application refilled it */
  PCFailedReason   failed = PC_NOERROR; /* why the last matrix could not be factored, the same on all ranks */
};

/* hooks.cpp: what stands in the SNES, and what stood there before */
struct Hooks {
  SNES      snes        = nullptr;     /* that has them */
  PetscBool test        = PETSC_FALSE; /* the convergence test is ours, or was before the user set another */
  PetscBool line_search = PETSC_FALSE; /* the type of the line search was ours to choose */
  PetscBool jacobian    = PETSC_FALSE; /* the matrix is filled by our differences */
  Mat       J = nullptr, P = nullptr;  /* the matrices before, and who filled them */
  decltype(_DMSNESOps::computejacobian) computejacobian = nullptr;
  PetscContainer jacobianctx = nullptr;
  void     *cnvP        = nullptr;     /* of the test before, with the function that destroys it */
  PetscErrorCode (*convergeddestroy)(void *) = nullptr;
  PetscInt  lag          = 1;
  PetscBool check_domain = PETSC_FALSE;
  PetscReal abstol       = 0;           /* of the KSP; 0: none has been taken out */
  PetscBool abstol_told  = PETSC_FALSE;
  PetscObjectId matrices[2] = {}; /* J and P of the SNES, as they are between steps */
  decltype(_DMSNESOps::computejacobian) dm_jacobian     = nullptr; /* in the DM at the set-up, with its context */
  void                                 *dm_jacobian_ctx = nullptr;
  decltype(_DMSNESOps::computefunction) their_function  = nullptr; /* of another solver on the DM, while a step has its own there */
  decltype(_DMSNESOps::computejacobian) their_jacobian  = nullptr;
  PetscContainer                        their_ctx[2]    = {};
  PetscBool                             borrowed = PETSC_FALSE, borrowed_told = PETSC_FALSE;
  PetscObjectState                      values[2] = {}; /* the states of J and P, as the last correction has left them */
};

/* What normal_jerk holds: nothing, q''' as it is known (d of drift.cpp), or its part normal to the constraints */
enum class Jerk { None, Whole, Normal };

/* What is known of loads and motions that set in later, excitation.cpp */
enum class Ahead { Unknown, Nothing, Loads };

/* Of the step and of the bookkeeping about steps */
struct StepState {
  PetscReal        t0 = 0, t1 = 0, h = 0; /* of the last accepted step, or of the attempt */
  PetscReal        h_last      = 0;       /* length of the step that led to t_n */
  PetscReal        t_begin     = 0;       /* of the run */
  TSStepStatus     status      = TS_STEP_INCOMPLETE;
  PetscBool        have_step   = PETSC_FALSE; /* U1... hold an accepted step not yet committed to U0... */
  PetscBool        at_begin    = PETSC_FALSE; /* U0, V0 and A0 are the state from which the next step goes: it has been taken back, or an error has ended it */
  PetscReal        drift_removed = 0;         /* part of dV that is taken from the velocities at t_n: q_n' counts as V0 - drift_removed dV, drift.cpp */
  PetscBool        have_drift  = PETSC_FALSE; /* dV belongs to t_n */
  Jerk             jerk        = Jerk::None;
  PetscInt         norm_size   = 0;           /* entries that enter the error test, global */
  PetscReal        of_atol = -1, of_rtol = -1; /* tolerances that the weights were made of */
  PetscReal        wlte_pending = -1; /* estimate of the step at hand, -1 if nobody has asked */
  PetscReal        h_regular   = 0;   /* running maximum of steps that went through the corrector, forgetting a tenth in each */
  PetscReal        h_rounded   = 0;   /* below which rounding is too large a part of the accelerations, as the last tiny step has found; 0: none has */
  PetscReal        h_limit     = 0;   /* what h may grow to after a failed correction; 0: no limit */
  PetscInt         tiny_row    = 0;   /* tiny steps in a row to which failures have led */
  PetscBool        auto_h      = PETSC_FALSE; /* the first step is still to be chosen */
  PetscBool        h_chosen    = PETSC_FALSE; /* it was */
  PetscReal        h_after_event = -1;        /* that TSEvent was told, where the step size is chosen */
  PetscReal        h_next      = 0;           /* length foreseen for the next step when the last one was accepted */
  PetscReal        h_given     = 0;           /* by the user, at the set-up or since, of steps of fixed length */
  PetscReal        fastest     = PETSC_MAX_REAL; /* least entry of excitation */
  PetscReal        swing       = PETSC_MAX_REAL; /* the same of rows that change all along the run */
  Ahead            ahead       = Ahead::Unknown; /* of what the start has not seen */
  PetscReal        ahead_to    = 0;              /* end of the run that it was looked for in */
  PetscBool        told        = PETSC_FALSE;    /* that steps do not follow them */
  PetscBool        fixed_h     = PETSC_FALSE; /* TSADAPTNONE */
  TSHHT3Statistics stat        = {};
};

struct Integrator : StepState {
  /* the method */
  TSHHT3Form  form   = TSHHT3_FORM_SECOND_ORDER;
  PetscReal   alpha  = -0.3;
  PetscReal   radius = -1; /* set: Chung and Hulbert's parameters in the second-order form */
  Parameters  hht;         /* of order two */
  Parameters  p;           /* of the step at hand */
  TSHHT3Start start_policy = TSHHT3_START_REPORT;
  Corrector   corrector;
  Predictor   predictor;
  Order       order;
  Verification verify;

  /* the problem: roles of local unknowns and rows; empty where every unknown is a coordinate */
  IS                         is[TSHHT3_NUM_ROLES] = {};
  PetscBool                  is_set               = PETSC_FALSE; /* by the application, not detected */
  PetscBool              made_coordinates = PETSC_FALSE; /* their set, beside those that were named */
  std::vector<unsigned char> role;
  std::vector<float>         moves;  /* 1 for coordinates, 0 for others: for loops without branches. Empty where roles are. */
  std::vector<PetscInt>      states, constrained; /* local unknowns that are first-order states, multipliers of constraints */
  PetscInt                   count[TSHHT3_NUM_ROLES] = {};       /* global */
  PetscBool                  follow = PETSC_FALSE; /* constraints of velocities depend on variables, see variables.cpp */
  PetscBool                  definitions_use_acceleration = PETSC_FALSE; /* a row other than of motion has d/dU'' */
  PetscInt                   constraints() const { return count[TSHHT3_HOLONOMIC] + count[TSHHT3_NONHOLONOMIC]; }
  /* the same answer on every rank, also on one without unknowns, whose list of roles is empty too */
  bool coordinatesAlone() const
  {
    for (int r = 0; r < TSHHT3_NUM_ROLES; r++)
      if (r != TSHHT3_COORDINATE && count[r]) return false;
    return true;
  }

  /* t_n: state, true second derivative (q) and the unknowns X0 as the accepted step of length h_last left them */
  Vec       U0 = nullptr, V0 = nullptr, A0 = nullptr, X0 = nullptr;
  Vec       dV = nullptr; /* drift of the velocities: what V0 is off Phi_q q' + Phi_t = 0, drift.cpp */
  Vec       normal_jerk = nullptr; /* change of that drift over k h^2 at t_n: a start has none as yet, and a change of coordinates bends what there is */
  Vec       F0 = nullptr; /* f_n = F(t_n, U_n, U'_n, 0) of (9a); paper form with alpha != 0 only */
  /* t_{n+1}: unknowns a, w, lambda, V, F, and what follows from them */
  Vec       X = nullptr, U1 = nullptr, V1 = nullptr, A1 = nullptr;
  Vec       base[3] = {}; /* of U1, V1, A1: what does not depend on X, see PrepareStage() */
  PetscObjectId    stage_id = 0; /* X to which U1, V1, A1 belong, and its state then; 0: to none */
  PetscObjectState stage_state = 0;
  Vec       before = nullptr; /* iterate before a correction, for types of SNES that do not keep their corrections */
  std::vector<Vec> spare; /* of WorkVec: they hold nothing that outlives a call */
  Vec       work = nullptr;  /* second evaluation of (9a) where definitions use q'', products in the start */
  Vec       gamma = nullptr; /* right-hand side of the differentiated constraints (6b), (6c) */
  Vec       excitation = nullptr; /* time within which each row follows loads and motions that depend on time alone, excitation.cpp; none: no row does */

  /* the error test: weights 1/max(atol, rtol Y) with running maxima Y, zero for unknowns that do not enter */
  Vec       ymax = nullptr, weight = nullptr;
  PetscBool        own_start   = PETSC_FALSE; /* the present start is from values that nobody but the integrator has made */
  PetscBool        of_vectors  = PETSC_FALSE; /* which vectors of tolerances they were made of is known: */
  PetscObjectId    of_id[2]    = {};
  PetscObjectState of_state[2] = {};

  /* the matrix */
  Mat           second = nullptr;             /* definitions that use q'' in the paper's form */
  struct Differences *differences = nullptr;  /* the application has no Jacobian */
  struct Sampler     *sampler = nullptr;      /* once a time between the ends of a step was asked for, evaluate_at.cpp */
  LinearState   linear;
  PetscObjectState scaled_operator = 0; /* the same of an operator beside the matrix */

  Change    change;
  StepLimit limit;
  Rotations rotations;
  RowNames  names;
  Hooks     hooks;
  PetscBool event_ahead        = PETSC_FALSE; /* functions of events are asked for a state to come, which stands in the solution of the TS, events.cpp */
  PetscBool failures_unlimited = PETSC_FALSE; /* in place of PETSc's default of one */
  PetscBool settings_reported  = PETSC_FALSE; /* what has no meaning here, once */

  /* bookkeeping */
  char             failure[512] = "";
  char             checkpoint_file[PETSC_MAX_PATH_LEN] = "";
  char             resume_file[PETSC_MAX_PATH_LEN] = "";
  PetscInt         checkpoint_every = 0;
  PetscInt         checkpoint_steps = 0; /* accepted steps when the last one was written or read */
  Vec              checkpoint_vec = nullptr; /* the application's, saved and restored with the state */
  PetscBool        timed = PETSC_FALSE; /* the clocks run, since then: */
  PetscReal        wall0 = 0, cpu0 = 0;
  PetscReal        progress_last = 0;
};

inline Integrator &Get(TS ts) { return *static_cast<Integrator *>(ts->data); }

/* About tau > 0, as what lies between t and t + tau once that is rounded: whatever follows time is where the rounded one puts it, and differences are over this span
   (Units.LateInTime) */
inline PetscReal SpanFrom(PetscReal t, PetscReal tau) { return t + PetscMax(tau, 4 * PETSC_MACHINE_EPSILON * PetscAbsReal(t)) - t; }
inline TSHHT3Role RoleOf(const Integrator &I, PetscInt i) { return I.role.empty() ? TSHHT3_COORDINATE : (TSHHT3Role)I.role[i]; }
inline bool IsCoordinate(const Integrator &I, PetscInt i) { return RoleOf(I, i) == TSHHT3_COORDINATE; }
inline bool IsConstraint(const Integrator &I, PetscInt i) { return RoleOf(I, i) == TSHHT3_HOLONOMIC || RoleOf(I, i) == TSHHT3_NONHOLONOMIC; }
inline bool IsDifferential(TSHHT3Role r) { return r == TSHHT3_COORDINATE || r == TSHHT3_STATE; }

/* The step size that stands in the matrix (10), which is M + (gamma h)^2 K above order two */
inline PetscReal EffectiveStep(const Integrator &I) { return I.order.now > 2 ? I.p.gamma * I.h : I.h; }

} // namespace hht3

#endif
