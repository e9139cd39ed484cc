/* The integrator's state, and the functions that its rooms offer one another. */
#ifndef HHTDAE_IMPL_H
#define HHTDAE_IMPL_H

#include "bdf.h"
#include "compat.h"
#include "hhtdae/hhtdae.h"
#include "linear/linear.h"
#include "policy.h"
#include "work_vec.h"
#include <initializer_list>
#include <vector>

namespace hht3
{

constexpr PetscInt max_degree = max_order; /* of the predictor */
constexpr PetscInt hht_degree = 3; /* that pays in steps of order two */

/*
  What a run is at any time is kept in plain structs, ...State: checkpoint.cpp writes them as they are, so that a field added to one of
  them is saved and restored without another line. What the user has set is kept apart, ...Options: it belongs to the run that resumes.
*/

/* The stopping test and the reuse ladder, section 5 of the paper */
struct CorrectorOptions : ReuseOptions {
  PetscReal c         = 1e-3; /* error left by the iteration, relative to the tolerance; see CorrectorTolerance() */
  PetscBool c_given   = PETSC_FALSE; /* by the user: taken as it is */
  PetscInt  max_it    = 10;
  PetscBool user_lag  = PETSC_FALSE; /* -snes_lag_jacobian: the user rules */
  PetscBool user_test = PETSC_FALSE; /* the user's test of SNES decides; corrections are only measured */
};

struct CorrectorState {
  MatrixPolicy matrix;
  PetscBool no_solve    = PETSC_FALSE; /* the last failure was one of the linear solve */
  PetscBool from_rest   = PETSC_FALSE; /* the last step went from where it began: at fixed steps a prediction may lead astray */
  PetscBool wrong_jacobian = PETSC_FALSE; /* as blame.cpp has seen in this correction */
  PetscBool rounding    = PETSC_FALSE; /* what is left of it is rounding */
  PetscReal blames      = 0;           /* how often of late: by one each time, down a little with every accepted step */
  PetscReal floor       = 0;           /* corrections below this are rounding of q */
  PetscReal wlte        = 1;           /* error estimate of the last accepted step, in units of the tolerance */

  PetscInt            it     = 0; /* of the present correction */
  PetscInt            base   = 0; /* iteration after which the present matrix came into use */
  PetscInt            renewals = 0; /* matrices made in the course of it */
  PetscInt            met    = 0; /* times that corrections have turned back and met */
  PetscReal           e      = 0; /* last correction, in units of the tolerance */
  PetscReal           xi_max = 0; /* worst rate of this correction */
  PetscReal           forces = 0; /* residual in the rows of driven coordinates, in units of the tolerance */
  SNESConvergedReason reason = SNES_CONVERGED_ITERATING;
};

/* One sample of rounding (rounding.cpp) may miss what the four-bars of tests/stability/test_stiff.cpp have by this factor */
constexpr PetscReal of_rounding = 16;

struct Corrector : CorrectorOptions, CorrectorState {
  PetscInt limit() const { return max_it + 2 * met; } /* of iterations; -snes_max_it ends them before */
};

struct VerificationState {
  PetscReal largest = 0;            /* claim of the present matrix; 0: not known */
  PetscBool measured = PETSC_FALSE; /* inertia has been measured since the matrix was made */
  PetscBool looked   = PETSC_FALSE; /* the residual after the last correction was needed for its proof */
  PetscReal since = 0;              /* time since the residual was looked at last: forces may have been missing for so long */
};

/* Whether small corrections prove anything, verify.cpp */
struct Verification : VerificationState {
  Vec inertia = nullptr, claim = nullptr, noise = nullptr, model = nullptr, work = nullptr, where = nullptr; /* where: X of the matrix */
  Vec unproved = nullptr; /* time before `since` in which a row's residual has stayed as it was, whenever it was looked at */
  Vec driven = nullptr; /* 1 for coordinates that the constraints alone move, driven.cpp; none where there are none */
};

struct PredictorOptions {
  PetscInt  degree_max = hht_degree; /* what the user allows */
  PetscBool fixed      = PETSC_FALSE;
};

struct PredictorState {
  PetscInt  degree    = 0; /* in use */
  PetscInt  available = 0; /* differences that exist */
  PetscReal t[max_degree + 2] = {}; /* t_n, t_{n-1}, ... */
};

/* Divided differences over the accepted steps. Of states those of the true s': the error test uses them, and w_n belongs to a
   time that shifts with h. a_n does too, but is smoother than q'' and predicts better. */
struct Predictor : PredictorOptions, PredictorState {
  Vec D[max_degree + 2] = {}; /* D[0]: a_n, s'_n, lambda_n, V_n, F_n; D[k] the k-th divided difference, allocated when first used. One beyond them is work space. */
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
  PetscInt  ready = 2;                  /* for which X0, D_0 and the misfit of velocities stand */
  PetscInt  past = 0;                   /* states before t_n that are kept */
  PetscInt  since = 0, above = 0;       /* steps since the order has changed, and since it is above two */
  OrderMemory memory, after;            /* at t_n, and when the step is accepted */
  PetscInt  wait = 0, penalty = 0;      /* steps of order two after a higher one has failed: still to be made, and the last time */
  PetscBool chosen = PETSC_FALSE;       /* next is */
  PetscReal spin = 0;                   /* fastest rotation of a body in the step that led to t_n, rad per time; 0 where there is no history or no rotation vector */
  PetscReal misfit_h = 0;               /* length of the step of order two to whose end dV belongs; 0: it belongs to none */
  PetscReal t[max_order + 1] = {};      /* t_n, t_{n-1}, ... */
  PetscReal hht[max_order + 1] = {};    /* length of the steps of order two that led there; 0 for others */
};

struct Order : OrderState {
  PetscInt wanted = 2;        /* by the user; may be TSHHT3_ORDER_AUTO */
  PetscInt max    = 2;        /* that is possible */
  PetscBool measured = PETSC_FALSE; /* S are the scaled differences of the attempt, order.cpp */
  PetscReal S[max_order + 2] = {};
  Vec      U[max_order] = {}; /* U, U' at t_{n-1}, t_{n-2}, ... */
  Vec      V[max_order] = {};
};

/* Of a body from a past attitude to that of the reference, rad: a rotation vector knows no more than half a turn */
constexpr PetscReal longest_turn = 3;

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

/* rotations.cpp */
struct Rotations {
  IS                    is    = nullptr;
  TSHHT3Refer           refer = nullptr;
  TSHHT3ReferBack       back  = nullptr;
  void                 *ctx   = nullptr;
  std::vector<PetscInt> at;         /* local indices of first components */
  PetscReal             factor = 0; /* RotationFactor() while the matrix of a step is made */
};

/* limit.cpp */
struct StepLimit {
  TSHHT3StepLimit limit = nullptr;
  void           *ctx   = nullptr;
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
};

/* ts->time_step as TSCreate() makes it, and what stands for "not set": a rounding error less, so that a 0.1 of the user's differs */
constexpr PetscReal petsc_step = 0.1;
constexpr PetscReal unset_step = petsc_step * (1 - PETSC_MACHINE_EPSILON);

/* Second derivatives of the constraints in time, gamma of (6c): to be made; to be made where they were a moment ago, by the same differences; made */
enum class Gamma { New, Near, Made };

/* What a consistent solve finds: its matrix, and gamma */
struct Prepared {
  bool  matrix = false;
  Gamma gamma  = Gamma::New;
};

/* What bend of the integrator holds: nothing, d of misfit.cpp, or the velocities that follow from it */
enum class Bend { None, Rates, Velocities };

/* Of the step and of the bookkeeping about steps */
struct StepState {
  PetscReal        t0 = 0, t1 = 0, h = 0; /* of the last accepted step, or of the attempt */
  PetscReal        h_last      = 0;       /* length of the step that led to t_n */
  PetscReal        t_begin     = 0;       /* of the run */
  TSStepStatus     status      = TS_STEP_INCOMPLETE;
  PetscBool        have_step   = PETSC_FALSE; /* U1... hold an accepted step not yet committed to U0... */
  PetscReal        misfit      = 0;           /* of the velocities at t_n, misfit.cpp; q_n' counts as V0 - misfit dV */
  PetscBool        have_misfit = PETSC_FALSE; /* dV belongs to t_n */
  Bend             bent        = Bend::None;
  PetscBool        repaired    = PETSC_FALSE; /* U0, V0 have been changed by Repair() */
  PetscInt         norm_size   = 0;           /* entries that enter the error test, global */
  PetscReal        wlte_pending = -1; /* estimate of the step at hand, -1 if nobody has asked */
  PetscReal        h_regular   = 0;   /* running maximum of steps that went through the corrector, forgetting a tenth in each */
  PetscReal        h_proven    = 0;   /* largest step accepted since the last failed correction */
  PetscReal        h_limit     = 0;   /* what h may grow to after a failed correction; 0: no limit */
  PetscInt         tiny_row    = 0;   /* tiny steps in a row to which failures have led */
  PetscBool        auto_h      = PETSC_FALSE; /* the first step is still to be chosen */
  PetscBool        h_chosen    = PETSC_FALSE; /* it was */
  PetscReal        h_next      = 0;           /* length foreseen for the next step when the last one was accepted */
  PetscBool        fixed_h     = PETSC_FALSE; /* TSADAPTNONE */
  PCFailedReason   unfactored  = PC_NOERROR;  /* why the last matrix could not be factored, the same on all ranks */
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
  std::vector<unsigned char> role;
  std::vector<float>         moves;  /* 1 for coordinates, 0 for others: for loops without branches. Empty where roles are. */
  std::vector<PetscInt>      states, holonomic; /* local unknowns that are first-order states, multipliers of holonomic constraints */
  PetscInt                   count[TSHHT3_NUM_ROLES] = {};       /* global */
  PetscBool                  follow = PETSC_FALSE; /* constraints of velocities depend on variables, see variables.cpp */
  PetscBool                  definitions_use_acceleration = PETSC_FALSE; /* a row other than of motion has d/dU'' */
  PetscInt                   constraints() const { return count[TSHHT3_HOLONOMIC] + count[TSHHT3_NONHOLONOMIC]; }
  /* the same answer on every rank, also on one without unknowns, whose list of roles is empty too */
  bool coordinatesAnd(TSHHT3Role other) const
  {
    for (int r = 0; r < TSHHT3_NUM_ROLES; r++)
      if (r != TSHHT3_COORDINATE && r != other && count[r]) return false;
    return true;
  }
  bool coordinatesAlone() const { return coordinatesAnd(TSHHT3_COORDINATE); }

  /* t_n: state, true second derivative (q) and the unknowns X0 as the accepted step of length h_last left them */
  Vec       U0 = nullptr, V0 = nullptr, A0 = nullptr, X0 = nullptr;
  Vec       dV = nullptr; /* misfit of V0 against Phi_q q' + Phi_t = 0, misfit.cpp */
  Vec       bend = nullptr; /* change of that misfit over k h^2 by a change of coordinates at t_n */
  Vec       accepted[2] = {}; /* U, U' as accepted, when Repair() has changed U0, V0 since */
  Vec       F0 = nullptr; /* f_n = F(t_n, U_n, U'_n, 0) of (9a); paper form with alpha != 0 only */
  /* t_{n+1}: unknowns a, w, lambda, V, F, and what follows from them */
  Vec       X = nullptr, U1 = nullptr, V1 = nullptr, A1 = nullptr;
  Vec       base[3] = {}; /* of U1, V1, A1: what does not depend on X, see BaseOfCoordinates */
  PetscObjectId    stage_id = 0; /* X to which U1, V1, A1 belong, and its state then; 0: to none */
  PetscObjectState stage_state = 0;
  Vec       before = nullptr; /* iterate before a correction, for types of SNES that do not keep their corrections */
  Vec       work = nullptr;  /* second evaluation of (9a) where definitions use q'', products in the start */
  Vec       gamma = nullptr; /* right-hand side of the differentiated constraints (6b), (6c) */
  std::vector<signed char> levels[2]; /* of differences in time that were the best ones of each row, differentiate.cpp */

  /* the error test: weights 1/max(atol, rtol Y) with running maxima Y, zero for unknowns that do not enter */
  Vec       ymax = nullptr, weight = nullptr;

  /* the matrix */
  Vec           row = nullptr, col = nullptr; /* scalings; only where roles differ */
  PetscReal     scaled_h = 0;                 /* for which row stands */
  Mat           second = nullptr;             /* definitions that use q'' in the paper's form */
  struct Differences *differences = nullptr;  /* the application has no Jacobian */
  struct Sampler     *sampler = nullptr;      /* once a time between the ends of a step was asked for, evaluate_at.cpp */
  LinearChoice  linear;
  PetscBool     linear_chosen = PETSC_FALSE;
  PetscObjectState scaled_state = 0; /* of the matrix after we scaled it, to see whether the application refilled it */

  Change    change;
  StepLimit limit;
  Rotations rotations;
  Hooks     hooks;
  PetscBool failures_unlimited = PETSC_FALSE; /* in place of PETSc's default of one */
  PetscBool settings_reported  = PETSC_FALSE; /* what has no meaning here, once */

  /* bookkeeping: vec_sol and vec_dot as the integrator left them */
  PetscObjectState sol_state = 0, dot_state = 0;
  PetscObjectId    sol_id = 0;
  char             failure[512] = "";
  char             checkpoint_file[PETSC_MAX_PATH_LEN] = "";
  char             resume_file[PETSC_MAX_PATH_LEN] = "";
  PetscInt         checkpoint_every = 0;
  PetscInt         checkpoint_steps = 0; /* accepted steps when the last one was written or read */
  Vec              checkpoint_vec = nullptr; /* the application's, saved and restored with the state */
  PetscReal        wall0 = 0, cpu0 = 0;
  PetscReal        progress_t0 = 0;
  PetscReal        progress_last = 0;
};

inline Integrator &Get(TS ts) { return *static_cast<Integrator *>(ts->data); }
inline TSHHT3Role RoleOf(const Integrator &I, PetscInt i) { return I.role.empty() ? TSHHT3_COORDINATE : (TSHHT3Role)I.role[i]; }
inline bool IsCoordinate(const Integrator &I, PetscInt i) { return RoleOf(I, i) == TSHHT3_COORDINATE; }
inline bool IsConstraint(const Integrator &I, PetscInt i) { return RoleOf(I, i) == TSHHT3_HOLONOMIC || RoleOf(I, i) == TSHHT3_NONHOLONOMIC; }
inline bool IsDifferential(TSHHT3Role r) { return r == TSHHT3_COORDINATE || r == TSHHT3_STATE; }

/* Shifts of the application's Jacobian and diagonal scalings that make it the Newton matrix */
struct Scales {
  PetscReal sv, sa;              /* d U'/dU, d U''/dU */
  PetscReal coordinate, state;   /* columns */
  PetscReal holonomic, velocity; /* rows */
};

/* c of (40) in force */
inline PetscReal CorrectorTolerance(const Integrator &I)
{
  return I.corrector.c_given || !I.constraints() ? I.corrector.c : ConstrainedTolerance(I.corrector.c, I.p.rho);
}

/* That of the matrix: M + gamma^2 h^2 K above order two */
inline PetscReal EffectiveStep(const Integrator &I) { return I.order.now > 2 ? I.p.gamma * I.h : I.h; }

/* log events, declared once in hht3.cpp */
struct Events {
  PetscLogEvent start, predict, matrix, estimate, sample;
};
extern Events events;

/* jacobian.cpp */
PetscErrorCode SetUpJacobian(TS ts);
PetscErrorCode SetUpSolvers(TS ts);
PetscErrorCode TakeSNES(TS ts);
/* settings.cpp */
PetscErrorCode OptionGiven(PetscObject object, const char name[], PetscBool *given);
PetscErrorCode CheckSettings(TS ts);
PetscErrorCode TakeSNESSettings(TS ts);
/* setters.cpp */
PetscErrorCode ComposeSetters(TS ts, bool attach);
/* roles.cpp */
PetscErrorCode SetUpRoles(TS ts);
PetscErrorCode CheckDependence(TS ts);
PetscErrorCode ResidualAlong(TS ts, PetscReal t, Vec U, Vec V, Vec A, Vec F);
PetscErrorCode ViewRoles(TS ts, PetscViewer viewer);
/* triangle.cpp: matrices of which one triangle is stored */
PetscErrorCode CheckTriangle(TS ts);
PetscErrorCode ScaleTriangle(Integrator &I, Mat A);
/* differences.cpp: a Jacobian from differences of the residual, for applications that have none */
PetscErrorCode DifferencesCreate(TS ts, Mat *P);
PetscErrorCode DifferencesDestroy(TS ts);
PetscErrorCode DifferencesJacobian(TS ts, PetscReal t, Vec U, Vec V, Vec A, PetscReal sv, PetscReal sa, Mat P);
/* stage.cpp */
PetscErrorCode PrepareStage(TS ts);
PetscErrorCode StageVectors(TS ts, Vec X);
PetscErrorCode SubtractCorrection(TS ts, Vec X, Vec dX, PetscReal *e);
/* equations.cpp */
PetscErrorCode EvaluateResidual(TS ts, PetscReal t, Vec U, Vec V, Vec A, Vec F);
PetscErrorCode EvaluateJacobian(TS ts, PetscReal t, Vec U, Vec V, Vec A, PetscReal sv, PetscReal sa, Mat J, Mat P);
PetscErrorCode HistoryForces(TS ts, PetscReal t);
PetscErrorCode ScaleMatrix(Integrator &I, const Scales &s, Mat A);
/* factor.cpp */
PetscErrorCode SolverDefaults(TS ts, KSP ksp);
PetscErrorCode ChooseSolver(KSP ksp, Mat P, LinearChoice *linear, PetscBool *chosen);
PetscErrorCode Factor(TS ts, KSP ksp, Mat J, Mat P, LinearChoice *linear, PCFailedReason *failed);
PetscErrorCode ExplainLinearFailure(TS ts, PetscReal t, PetscReal h);
PetscErrorCode MatrixHasNumbers(Mat P, PetscBool *numbers);
PetscErrorCode GiveUpKrylov(TS ts, PetscBool *other);
PetscErrorCode MatrixIsSingular(TS ts, PetscBool *yes);
/* equations.cpp */
PetscErrorCode FormFunction(SNES snes, Vec X, Vec F, TS ts);
PetscErrorCode FormJacobian(SNES snes, Vec X, Mat J, Mat P, TS ts);
/* corrector.cpp */
PetscErrorCode Correct(TS ts, PetscBool *converged);
/* iterate.cpp */
PetscErrorCode CorrectorSetUp(TS ts);
PetscErrorCode Iterate(TS ts, PetscBool *converged);
PetscErrorCode CheckNumbers(TS ts, PetscReal t, std::initializer_list<Vec> all, PetscBool *ok);
PetscErrorCode ConvergenceTest(SNES snes, PetscInt it, PetscReal xnorm, PetscReal ynorm, PetscReal fnorm, SNESConvergedReason *reason, void *ctx);
/* judge.cpp */
PetscErrorCode CountCorrection(TS ts, PetscReal e, Vec X, Vec dX, Vec F, PetscBool *evaluated);
/* hooks.cpp */
PetscErrorCode HooksLineSearch(TS ts);
PetscErrorCode HooksJacobian(TS ts);
PetscErrorCode HooksInstall(TS ts);
PetscErrorCode HooksRemove(TS ts);
PetscBool      HooksUserTest(TS ts);
/* between.cpp */
PetscErrorCode BetweenIterates(TS ts, Vec X, Vec dX, Vec F, PetscBool *found);
/* rounding.cpp */
PetscErrorCode RoundingOfCorrection(TS ts, Vec X, PetscReal *e);
PetscErrorCode AnswerOf(TS ts, Vec r, Vec dX, PetscBool *solved);
PetscErrorCode SizeOfAnswer(TS ts, Vec r, Vec dX, PetscReal *e);
/* claims.cpp */
PetscErrorCode NoteInertia(TS ts, Mat P);
PetscErrorCode NoteClaims(TS ts, Vec X, Mat P);
PetscErrorCode MeasureRounding(TS ts, Vec X, Vec F, Vec noise);
PetscErrorCode ViewClaims(TS ts, PetscViewer viewer);
/* nodes.cpp */
PetscErrorCode CopyNodes(Mat from, Mat to);
PetscErrorCode TellPositions(Mat P, Vec U);
/* verify.cpp */
PetscErrorCode Verify(TS ts, Vec X, Vec dX, Vec F, PetscBool *evaluated, PetscBool *proved);
/* driven.cpp */
PetscErrorCode NoteDriven(TS ts);
PetscErrorCode NoteForces(TS ts, Vec F, PetscBool evaluated);
PetscErrorCode ViewDriven(TS ts, PetscViewer viewer);
PetscErrorCode ForcesOfDriven(TS ts, PetscReal tolerance, Vec X, Vec F, PetscBool *evaluated, PetscBool *good);
/* blame.cpp */
PetscErrorCode BlameJacobian(TS ts, Vec X, Vec dX, Vec F, PetscBool *evaluated);
/* estimate.cpp */
PetscErrorCode CorrectionNorm(TS ts, Vec dX, PetscReal *e);
PetscErrorCode WeightCorrection(const Integrator &I, Vec dX, Vec to);
PetscErrorCode UpdateWeights(TS ts, Vec U);
PetscErrorCode WeightedSquares(const Integrator &I, Vec d, PetscReal *sum);
PetscErrorCode ReduceCorrection(TS ts, Vec dX, PetscReal sum, PetscReal *e);
PetscErrorCode EvaluateWLTE(TS ts, NormType type, PetscInt *order, PetscReal *wlte);
PetscErrorCode NoteError(TS ts);
/* adapt.cpp */
PetscErrorCode CreateAdapt(TSAdapt adapt);
/* bdf.cpp */
PetscErrorCode SetUpOrder(TS ts);
PetscErrorCode ViewOrder(TS ts, PetscViewer viewer);
void           ResetOrder(TS ts);
void           CommitOrder(Integrator &I);
PetscErrorCode UseOrder(TS ts);
PetscErrorCode PrepareBDF(TS ts);
PetscErrorCode MapPast(TS ts);
PetscErrorCode LowerAfterFailure(TS ts);
void           LowerToTwo(Order &o);
PetscErrorCode CutPast(TS ts, PetscInt n);
/* order.cpp */
PetscErrorCode ErrorOfOrder(TS ts, NormType type, PetscReal *wlte);
PetscErrorCode ChooseOrder(TS ts, PetscReal *next);
/* predictor.cpp */
PetscErrorCode PredictorReset(TS ts);
PetscErrorCode Predict(TS ts, Vec X);
PetscErrorCode PredictRest(const Integrator &, Vec X);
PetscErrorCode PredictorUpdate(TS ts);
/* start.cpp */
PetscErrorCode StartMatrix(TS ts, PetscReal t, Vec U, Vec V);
PetscErrorCode ConsistentAccelerations(TS ts, PetscReal t, PetscReal h, Vec U, Vec V, Prepared have, PetscBool *ok);
PetscErrorCode NameRedundant(TS ts);
PetscErrorCode Advance(const Integrator &I, PetscReal d, Vec U, Vec V);
PetscErrorCode StartFromState(TS ts, Prepared have);
PetscErrorCode Start(TS ts);
/* repair.cpp */
PetscErrorCode Repair(TS ts);
PetscErrorCode TinyStep(TS ts, PetscBool *ok);
PetscErrorCode IsTinyStep(TS ts, PetscReal h, PetscBool *tiny);
/* settle.cpp */
PetscErrorCode SettleTransient(TS ts, PetscReal h, Vec rate, PetscReal *tau, PetscBool *leaves);
/* project.cpp */
PetscErrorCode CheckInitialState(TS ts, Prepared *prepared);
PetscErrorCode ProjectVelocities(TS ts, Prepared *prepared);
PetscErrorCode TimeScale(TS ts, PetscReal *T);
/* differentiate.cpp */
PetscErrorCode ConstraintDerivatives(TS ts, PetscReal t, Vec U, Vec V, PetscReal T, bool again, Vec first, Vec second);
/* misfit.cpp */
PetscErrorCode AdaptVelocities(TS ts);
PetscErrorCode StartMisfit(TS ts, Vec rate);
PetscErrorCode MeasureMisfit(TS ts);
/* history.cpp: what a change of coordinates does to the state and the history */
PetscErrorCode MapStart(TS ts);
PetscErrorCode MapHistory(TS ts);
/* change.cpp */
PetscErrorCode ChangeCoordinates(TS ts, bool starting);
PetscErrorCode StepAfterChange(TS ts);
PetscErrorCode MatrixAfterChange(TS ts);
PetscErrorCode CommitChange(TS ts);
PetscErrorCode SetCoordinateChange(TS ts, TSHHT3ChangeTest test, TSHHT3ChangeMap map, TSHHT3ChangeCommit commit, void *ctx);
/* setters.cpp */
PetscErrorCode NotAfterSetUp(TS ts, const char *what);
/* rotations.cpp */
PetscErrorCode SetUpRotations(TS ts);
PetscErrorCode AddRotationErrors(const Integrator &I, NormType type, PetscReal *result);
PetscErrorCode GetRotationFactor(TS ts, PetscReal *factor, Vec *begin);
PetscErrorCode ViewRotations(TS ts, PetscViewer viewer);
PetscErrorCode StageOfRotations(const Integrator &I);
PetscReal      RotationFactor(const Integrator &I);
void           InterpolateCommutator(const Integrator &I, PetscReal x, PetscReal part, const PetscScalar *v0, const PetscScalar *v1, const PetscScalar *v, PetscScalar *u);
PetscErrorCode ReferToState(TS ts);
PetscErrorCode ReferTo(TS ts, Vec U, WorkVec &before);
PetscErrorCode ReferBack(TS ts, Vec U, const WorkVec &before);
PetscErrorCode SetRotations(TS ts, IS rotations, TSHHT3Refer refer, TSHHT3ReferBack back, void *ctx);
/* limit.cpp */
PetscErrorCode ApplyStepLimit(TS ts);
PetscErrorCode SetStepLimit(TS ts, TSHHT3StepLimit limit, void *ctx);
/* step.cpp */
PetscErrorCode NoteState(TS ts);
PetscErrorCode Step(TS ts);
PetscErrorCode RollBack(TS ts);
/* dense.cpp */
PetscReal      StepFraction(const Integrator &I, PetscReal t);
PetscErrorCode Interpolate(TS ts, PetscReal t, Vec U, Vec V, Vec A);
/* evaluate_at.cpp: accelerations and multipliers between the ends of a step */
PetscErrorCode EvaluateAt(TS ts, PetscReal t, Vec U, Vec V, Vec A);
PetscErrorCode SamplerDestroy(Integrator &I);
/* report.cpp */
void           ReadClocks(PetscReal *wall, PetscReal *cpu);
void           StopClocks(Integrator &I);
PetscErrorCode MonitorSummary(TS ts, PetscInt step, PetscReal t, Vec U, void *ctx);
PetscErrorCode MonitorProgress(TS ts, PetscInt step, PetscReal t, Vec U, void *ctx);
/* checkpoint.cpp */
PetscErrorCode CheckpointIfDue(TS ts);
PetscErrorCode CheckpointSave(TS ts, const char file[]);
PetscErrorCode CheckpointLoad(TS ts, const char file[]);
PetscErrorCode SetCheckpointVec(TS ts, Vec extra);
PetscErrorCode MonitorCheckpoint(TS ts, PetscInt step, PetscReal t, Vec U, void *ctx);
/* checkpoint_matrix.cpp */
PetscErrorCode SaveMatrix(TS ts, Archive &a);
PetscErrorCode LoadMatrix(TS ts, Archive &a);

} // namespace hht3

#endif
