/* The type TSHHT3: registration, creation, options, set-up, view, destruction. Its setters and getters are in api.cpp. */
#include "integrator/checkpoint/checkpoint.h"
#include "integrator/step/corrector.h"
#include "integrator/step/dense.h"
#include "integrator/equations/equations.h"
#include "integrator/step/estimate.h"
#include "integrator/equations/jacobian.h"
#include "integrator/step/order.h"
#include "integrator/proofs/proofs.h"
#include "integrator/equations/roles.h"
#include "integrator/coordinates/rotations.h"
#include "settings.h"
#include "integrator/equations/solver.h"
#include "integrator/start/start.h"
#include "integrator/step/step.h"
#include "unused.h"
#include <petscdm.h>

const char *const TSHHT3Forms[]  = {"paper", "second_order", "TSHHT3Form", "TSHHT3_FORM_", NULL};
const char *const TSHHT3Roles[]  = {"coordinate", "state", "holonomic", "nonholonomic", "variable", "force", "TSHHT3Role", "TSHHT3_", NULL};
const char *const TSHHT3Starts[] = {"off", "report", "project", "TSHHT3Start", "TSHHT3_START_", NULL};

namespace hht3
{

Events events;

namespace
{

PetscBool  registered = PETSC_FALSE;
PetscBool  cited      = PETSC_FALSE;
const char citation[] = "@article{Negrut2007,\n"
                        "  title   = {On an Implementation of the {Hilber-Hughes-Taylor} Method in the Context of Index 3\n"
                        "             Differential-Algebraic Equations of Multibody Dynamics},\n"
                        "  author  = {Negrut, D. and Rampalli, R. and Ottarsson, G. and Sajdak, A.},\n"
                        "  journal = {Journal of Computational and Nonlinear Dynamics},\n"
                        "  volume  = {2},\n  number  = {1},\n  pages   = {73--85},\n  year    = {2007}\n}\n"
                        "@article{ArnoldBruels2007,\n"
                        "  title   = {Convergence of the generalized-$\\alpha$ scheme for constrained mechanical systems},\n"
                        "  author  = {Arnold, M. and Br{\\\"u}ls, O.},\n"
                        "  journal = {Multibody System Dynamics},\n"
                        "  volume  = {18},\n  pages   = {185--202},\n  year    = {2007}\n}\n";

PetscErrorCode DuplicateAll(TS ts)
{
  Integrator &I = Get(ts);

  PetscFunctionBegin;
  for (Vec *v : {&I.U0, &I.V0, &I.A0, &I.X0, &I.X, &I.U1, &I.V1, &I.A1, &I.ymax, &I.weight, &I.base[0], &I.base[1], &I.base[2], &I.predictor.X[0]})
    if (!*v) PetscCall(VecDuplicate(ts->vec_sol, v));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Vectors that only some problems need */
PetscErrorCode AllocateForRoles(TS ts)
{
  Integrator &I = Get(ts);

  PetscFunctionBegin;
  if (I.constraints() && !I.gamma) PetscCall(VecDuplicate(ts->vec_sol, &I.gamma));
  if (!I.coordinatesAlone() && !I.work) PetscCall(VecDuplicate(ts->vec_sol, &I.work));
  if (I.form == TSHHT3_FORM_PAPER && I.alpha != 0 && !I.F0) PetscCall(VecDuplicate(ts->vec_sol, &I.F0));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode CheckProblem(TS ts)
{
  DM   dm;
  DMTS tdm;

  PetscFunctionBegin;
  PetscCall(TSGetDM(ts, &dm));
  PetscCall(DMGetDMTS(dm, &tdm));
  PetscCheck(tdm->ops->i2function || tdm->ops->ifunction /* TSComputeI2Function() then calls it as F(t,U,U'') */, PetscObjectComm((PetscObject)ts), PETSC_ERR_ARG_WRONGSTATE,
             "TSHHT3 integrates second-order systems F(t,U,U',U'') = 0: call TSSetI2Function() (and TSSetI2Jacobian()); this TS has none%s",
             tdm->ops->rhsfunction ? ", but a first-order one U' = G(t,U) of TSSetRHSFunction(): give it as U' - G(t,U) = 0 of first-order states, or take another -ts_type" : "");
  PetscCheck(ts->vec_dot, PetscObjectComm((PetscObject)ts), PETSC_ERR_ARG_WRONGSTATE,
             "TSHHT3 needs initial velocities: call TS2SetSolution() with both vectors%s",
             tdm->ops->i2function ? "" : ". It integrates second-order systems F(t,U,U',U'') = 0 of TSSetI2Function(), and this TS has TSSetIFunction() alone: is its system of first order?");
  PetscCheck(ts->vec_sol != ts->vec_dot, PetscObjectComm((PetscObject)ts), PETSC_ERR_ARG_IDN, "TS2SetSolution() was given one vector for both the solution and its time derivative: give two (VecDuplicate())");
  for (Vec x : {ts->vec_sol, ts->vec_dot}) { /* the entries of a VECNEST are not in one array */
    PetscBool nest;
    PetscCall(PetscObjectTypeCompare((PetscObject)x, VECNEST, &nest));
    PetscCheck(!nest, PetscObjectComm((PetscObject)ts), PETSC_ERR_SUP,
               "The %s is a vector of type %s, which TSHHT3 does not take: use type %s (VecSetType(), VecConcatenate()) in TS2SetSolution(), and index sets for its parts (VecGetSubVector())",
               x == ts->vec_sol ? "solution" : "time derivative of the solution", VECNEST, VECSTANDARD);
  }
  PetscInt n, m;
  PetscCall(VecGetSize(ts->vec_sol, &n));
  PetscCall(VecGetSize(ts->vec_dot, &m));
  PetscCheck(n == m, PetscObjectComm((PetscObject)ts), PETSC_ERR_ARG_SIZ, "The solution has %" PetscInt_FMT " entries and its time derivative %" PetscInt_FMT, n, m);
  PetscCheck(n > 0, PetscObjectComm((PetscObject)ts), PETSC_ERR_ARG_SIZ, "The problem has no unknowns");
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode UpdateParameters(TS ts)
{
  Integrator &I = Get(ts);

  PetscFunctionBegin;
  if (I.radius >= 0) {
    PetscCheck(I.form == TSHHT3_FORM_SECOND_ORDER, PetscObjectComm((PetscObject)ts), PETSC_ERR_ARG_INCOMP,
               "A spectral radius (%g) belongs to the second-order form; the paper's form takes alpha (-ts_hhtdae_alpha)", (double)I.radius);
    I.p = RadiusParameters(I.radius);
  } else I.p = HHTParameters(I.alpha, I.form == TSHHT3_FORM_PAPER);
  I.hht = I.p;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode TSSetUp_HHT(TS ts)
{
  Integrator &I = Get(ts);

  PetscFunctionBegin;
  if (!I.U0) I.t_begin = ts->ptime;
  PetscCall(PetscCitationsRegister(citation, &cited));
  PetscCall(CheckProblem(ts));
  PetscCall(TSGetAdapt(ts, &ts->adapt));
  PetscCall(CheckSettings(ts));
  PetscCall(CheckCheckpointFile(ts));
  PetscCall(UpdateParameters(ts));
  PetscCall(DuplicateAll(ts));
  PetscCall(SetUpJacobian(ts));
  PetscCall(CheckMatrices(ts));
  PetscCall(SetUpRoles(ts));
  PetscCall(CheckDependence(ts));
  PetscCall(SetUpRotations(ts));
  PetscCall(SetUpOrder(ts));
  PetscCall(AllocateForRoles(ts));
  PetscCall(SetUpSolvers(ts));
  I.auto_h = (PetscBool)(ts->time_step == unset_step);
  if (!I.auto_h) I.h_given = ts->time_step; /* before TSSolve() shortens it to the end of the run */
  if (I.constraints() && I.p.rho == 1)
    PetscCall(PetscPrintf(PetscObjectComm((PetscObject)ts), "hhtdae: alpha = 0 has no numerical damping and is weakly unstable on index-3 systems; "
                                                            "with constraints use alpha < 0 (-ts_hhtdae_alpha -0.05 is enough)\n"));
  PetscCall(TSAdaptCandidatesClear(ts->adapt));
  if (I.resume_file[0]) {
    PetscCall(CheckpointLoad(ts, I.resume_file));
    I.resume_file[0] = 0;
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode TSReset_HHT(TS ts)
{
  Integrator &I = Get(ts);

  PetscFunctionBegin;
  PetscCall(HooksRemove(ts));
  for (Vec *v : {&I.U0, &I.V0, &I.A0, &I.X0, &I.F0, &I.dV, &I.normal_jerk, &I.X, &I.U1, &I.V1, &I.A1, &I.before, &I.work, &I.gamma, &I.excitation, &I.ymax, &I.weight, &I.base[0], &I.base[1], &I.base[2], &I.verify.inertia, &I.verify.claim, &I.verify.noise, &I.verify.model, &I.verify.work, &I.verify.where, &I.verify.unproved, &I.verify.driven}) PetscCall(VecDestroy(v));
  for (Vec &v : I.spare) PetscCall(VecDestroy(&v));
  I.spare.clear();
  for (Vec &x : I.predictor.X) PetscCall(VecDestroy(&x));
  for (Vec &u : I.order.U) PetscCall(VecDestroy(&u));
  for (Vec &v : I.order.V) PetscCall(VecDestroy(&v));
  PetscCall(MatDestroy(&I.second));
  PetscCall(DifferencesDestroy(ts));
  PetscCall(SamplerDestroy(I));
  for (int r = 0; r < TSHHT3_NUM_ROLES; r++)
    if (!I.is_set || (r == TSHHT3_COORDINATE && I.made_coordinates)) PetscCall(ISDestroy(&I.is[r]));
  I.made_coordinates = PETSC_FALSE;
  if (I.h_chosen && ts->time_step == I.h_next) ts->time_step = unset_step; /* chosen again, unless the user has set h since */
  ForStates(I, [](auto &state) { state = {}; });
  I.p               = I.hht;
  I.linear.chosen   = PETSC_FALSE;
  I.linear.scaled   = 0;
  I.linear.failed   = PC_NOERROR;
  I.scaled_operator = 0;
  I.stage_id        = 0;
  I.timed           = PETSC_FALSE;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode TSDestroy_HHT(TS ts)
{
  PetscFunctionBegin;
  PetscCall(TSReset_HHT(ts));
  PetscCall(LeaveSolver(ts));
  if (ts->time_step == unset_step) ts->time_step = petsc_default_step;
  if (ts->max_snes_failures == HHT3_UNLIMITED && Get(ts).failures_unlimited) ts->max_snes_failures = 1;
  for (IS &is : Get(ts).is) PetscCall(ISDestroy(&is));
  PetscCall(VecDestroy(&Get(ts).checkpoint_vec));
  PetscCall(ISDestroy(&Get(ts).rotations.is));
  delete static_cast<Integrator *>(ts->data);
  ts->data = NULL;
  PetscCall(ComposeSetters(ts, false));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode MethodOptions(TS ts, HHT3OptionItems PetscOptionsObject)
{
  Integrator &I = Get(ts);
  TSHHT3Form  form = I.form;
  TSHHT3Start start = I.start_policy;
  PetscReal   alpha = I.alpha, rho = I.radius, c = I.corrector.c, reuse[4] = {I.corrector.ratio, I.corrector.slow_rate, I.corrector.hold}; /* 4: to detect a number too many */
  PetscInt    degree = I.predictor.fixed ? I.predictor.degree_max : -1, numbers = 4, order = I.order.wanted;
  const char *const orders[] = {"2", "3", "4", "5", "auto"};
  PetscBool   flg;

  PetscFunctionBegin;
  PetscCall(PetscOptionsEnum("-ts_hhtdae_form", "How inertia forces are averaged", "TSHHT3SetForm", TSHHT3Forms, (PetscEnum)form, (PetscEnum *)&form, &flg));
  if (flg) PetscCall(TSHHT3SetForm(ts, form));
  PetscCall(PetscOptionsReal("-ts_hhtdae_alpha", "HHT parameter in [-1/3, 0]", "TSHHT3SetAlpha", alpha, &alpha, &flg));
  if (flg) PetscCall(TSHHT3SetAlpha(ts, alpha));
  PetscCall(PetscOptionsReal("-ts_hhtdae_radius", "Spectral radius at infinite frequency (Chung and Hulbert)", "TSHHT3SetRadius", rho, &rho, &flg));
  if (flg) PetscCall(TSHHT3SetRadius(ts, rho));
  PetscCall(PetscOptionsEList("-ts_hhtdae_order", "Largest order: that of HHT, of backward differentiation, or as the motion allows", "TSHHT3SetOrder", orders, 5, orders[order < 0 ? 4 : order - 2], &order, &flg));
  if (flg) PetscCall(TSHHT3SetOrder(ts, order == 4 ? TSHHT3_ORDER_AUTO : order + 2));
  PetscCall(PetscOptionsReal("-ts_hhtdae_corrector_tolerance", "Error left by the corrector, relative to the tolerance", "TSHHT3SetCorrectorTolerance", c, &c, &flg));
  if (flg) PetscCall(TSHHT3SetCorrectorTolerance(ts, c));
  PetscCall(PetscOptionsInt("-ts_hhtdae_predictor_degree", "Degree 0..3 of the predictor, -1 to choose it in each step", "TSHHT3SetPredictorDegree", degree, &degree, &flg));
  if (flg) PetscCall(TSHHT3SetPredictorDegree(ts, degree));
  PetscCall(PetscOptionsRealArray("-ts_hhtdae_reuse", "Matrix reuse: ratio of h, rate, growth of h not taken", "TSHHT3SetReuse", reuse, &numbers, &flg));
  if (flg) {
    PetscCheck(numbers == 3, PetscObjectComm((PetscObject)ts), PETSC_ERR_ARG_WRONG, "-ts_hhtdae_reuse takes three numbers, ratio,rate,hold; %" PetscInt_FMT "%s were given", numbers, numbers > 3 ? " or more" : "");
    PetscCall(TSHHT3SetReuse(ts, reuse[0], reuse[1], reuse[2]));
  }
  PetscCall(PetscOptionsEnum("-ts_hhtdae_start", "What to do about inconsistent initial values", "TSHHT3SetStart", TSHHT3Starts, (PetscEnum)start, (PetscEnum *)&start, &flg));
  if (flg) PetscCall(TSHHT3SetStart(ts, start));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode OutputOptions(TS ts, HHT3OptionItems PetscOptionsObject)
{
  Integrator &I = Get(ts);
  PetscBool   flg, on = PETSC_FALSE;
  char        file[PETSC_MAX_PATH_LEN] = "";

  PetscFunctionBegin;
  PetscCall(PetscOptionsBool("-ts_hhtdae_progress", "Show time, step size and time left on the terminal", "TSHHT3GetStatistics", on, &on, NULL));
  if (on) PetscCall(TSMonitorSet(ts, MonitorProgress, NULL, NULL));
  on = PETSC_FALSE;
  PetscCall(PetscOptionsBool("-ts_hhtdae_summary", "Print the counters at the end of the run", "TSHHT3GetStatistics", on, &on, NULL));
  if (on) PetscCall(TSMonitorSet(ts, MonitorSummary, NULL, NULL));
  PetscCall(PetscOptionsString("-ts_hhtdae_checkpoint", "File to write a checkpoint to", "TSHHT3CheckpointSave", I.checkpoint_file, I.checkpoint_file, sizeof(I.checkpoint_file), NULL));
  PetscCall(PetscOptionsInt("-ts_hhtdae_checkpoint_every", "Accepted steps from one checkpoint to the next", "TSHHT3CheckpointSave", I.checkpoint_every, &I.checkpoint_every, NULL));
  PetscCheck(I.checkpoint_every >= 0, PetscObjectComm((PetscObject)ts), PETSC_ERR_ARG_OUTOFRANGE, "-ts_hhtdae_checkpoint_every %" PetscInt_FMT ": a number of steps, or 0 for the end of the run alone", I.checkpoint_every);
  if (I.checkpoint_file[0]) PetscCall(TSMonitorSet(ts, MonitorCheckpoint, NULL, NULL));
  PetscCall(PetscOptionsString("-ts_hhtdae_resume", "Checkpoint to go on from", "TSHHT3CheckpointLoad", file, file, sizeof(file), &flg));
  if (flg && file[0]) PetscCall(PetscStrncpy(I.resume_file, file, sizeof(I.resume_file)));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* For TSSetFromOptions() after a run: takes the hooks out of the SNES, so that options act on it as before the first
   run; the next step treats it as a new SNES. Factors are destroyed, since PETSc cannot change the package of an
   existing factor. */
PetscErrorCode LetOptionsIn(TS ts)
{
  Integrator &I = Get(ts);
  KSP         ksp;
  PC          pc;
  PetscBool   factors;

  PetscFunctionBegin;
  PetscCall(HooksRemove(ts));
  PetscCall(SNESGetKSP(ts->snes, &ksp));
  PetscCall(KSPGetPC(ksp, &pc));
  PetscCall(PetscObjectTypeCompareAny((PetscObject)pc, &factors, PCLU, PCCHOLESKY, ""));
  if (factors) PetscCall(PCReset(pc));
  I.linear.chosen = PETSC_FALSE;
  I.corrector.matrix.forget();
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode TSSetFromOptions_HHT(TS ts, HHT3OptionItems PetscOptionsObject)
{
  SNES        snes;
  KSP         ksp;
  Mat         J, P;

  PetscFunctionBegin;
  PetscOptionsHeadBegin(PetscOptionsObject, "HHT integrator for index-3 DAEs");
  PetscCall(MethodOptions(ts, PetscOptionsObject));
  PetscCall(OutputOptions(ts, PetscOptionsObject));
  PetscOptionsHeadEnd();
  /* TSSetFromOptions() calls SNESSetFromOptions() next, whose options override these defaults */
  PetscCall(TSGetSNES(ts, &snes));
  if (Get(ts).hooks.snes) PetscCall(LetOptionsIn(ts));
  PetscCall(SNESGetKSP(snes, &ksp));
  PetscCall(SNESGetJacobian(snes, &J, &P, NULL, NULL));
  if (J && P) PetscCall(KSPSetOperators(ksp, J, P)); /* as SNESSetFromOptions() will; SolverDefaults() reads the type of P: MATSBAIJ has no LU */
  PetscCall(SolverDefaults(ts, ksp));
  PetscCall(HooksLineSearch(ts));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* U is null if TSSolve(ts, NULL) interpolates at the final time; TSSolve() would pass the null vector to the monitors
   next */
PetscErrorCode TSInterpolate_HHT(TS ts, PetscReal t, Vec U)
{
  PetscFunctionBegin;
  PetscCheck(U, PetscObjectComm((PetscObject)ts), PETSC_ERR_ARG_NULL,
             "There is no vector for the solution at t = %g: where -ts_exact_final_time interpolate asks for it, call TSSolve(ts, U), or use matchstep or stepover", (double)t);
  PetscCall(Interpolate(ts, t, U, NULL, NULL));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode TSView_HHT(TS ts, PetscViewer viewer)
{
  Integrator      &I = Get(ts);
  const Corrector &c = I.corrector;
  const Parameters &p = I.hht;
  PetscInt         n;
  PetscBool        ascii;

  PetscFunctionBegin;
  PetscCall(PetscObjectTypeCompare((PetscObject)viewer, PETSCVIEWERASCII, &ascii));
  if (!ascii) PetscFunctionReturn(PETSC_SUCCESS);
  if (I.radius < 0) PetscCall(PetscViewerASCIIPrintf(viewer, "form %s, alpha=%g (spectral radius %g)\n", TSHHT3Forms[I.form], (double)I.alpha, (double)p.rho));
  else PetscCall(PetscViewerASCIIPrintf(viewer, "form %s, spectral radius %g: alpha_m=%g, alpha_f=%g\n", TSHHT3Forms[I.form], (double)p.rho, (double)p.am, (double)p.af));
  PetscCall(PetscViewerASCIIPrintf(viewer, "gamma=%g, beta=%g, local error %g h^2 (a_{n+1} - a_n)\n", (double)p.gamma, (double)p.beta, (double)p.k));
  PetscCall(ViewOrder(ts, viewer));
  if (I.predictor.fixed) PetscCall(PetscViewerASCIIPrintf(viewer, "predictor of degree %" PetscInt_FMT "\n", I.predictor.degree_max));
  else PetscCall(PetscViewerASCIIPrintf(viewer, "predictor of degree up to %" PetscInt_FMT ", chosen in each step (now %" PetscInt_FMT ")\n", I.predictor.degree_max, I.predictor.degree));
  const PetscReal tol = CorrectorTolerance(I);
  PetscCall(PetscViewerASCIIPrintf(viewer, "corrector: error left below %g of the tolerance%s, at most %" PetscInt_FMT " iterations\n", (double)tol,
                                   tol < c.c ? " (small, as little of the multipliers' oscillation is damped)" : "", c.max_it));
  if (I.constraints() && p.rho == 1) PetscCall(PetscViewerASCIIPrintf(viewer, "the multipliers' oscillation is not damped at all\n"));
  if (c.user_lag) PetscCall(PetscViewerASCIIPrintf(viewer, "matrix renewed by -snes_lag_jacobian\n"));
  else PetscCall(PetscViewerASCIIPrintf(viewer, "matrix reused while h changes by less than a factor %g and the rate is below %g; growth of h below %g not taken\n", (double)c.ratio, (double)c.of(I.linear.constraint).slow_rate, (double)c.hold));
  if (MayHideForces(I)) PetscCall(PetscViewerASCIIPrintf(viewer, "small corrections are proved by a residual: the matrix claims up to %g times the inertia of an unknown%s\n", (double)I.verify.largest,
                                                  I.count[TSHHT3_VARIABLE] || I.count[TSHHT3_FORCE] ? ", and definitions may hide more" : ""));
  PetscCall(CountDriven(I, &n));
  if (n) PetscCall(PetscViewerASCIIPrintf(viewer, "forces of %" PetscInt_FMT " coordinates whose motion is given are judged by the residual\n", n));
  PetscCall(PetscViewerASCIIPrintf(viewer, "initial values against constraints: %s\n", TSHHT3Starts[I.start_policy]));
  if (ts->setupcalled) PetscCall(ViewRoles(ts, viewer));
  if (I.rotations.is) {
    PetscCall(ISGetSize(I.rotations.is, &n));
    PetscCall(PetscViewerASCIIPrintf(viewer, "local rotation vectors: %" PetscInt_FMT "\n", n));
  }
  if (I.linear.chosen) PetscCall(PetscViewerASCIIPrintf(viewer, "linear solver: %s\n", I.linear.text));
  const TSHHT3Statistics &s = I.stat;
  if (s.steps) {
    PetscCall(PetscViewerASCIIPrintf(viewer, "steps=%" PetscInt_FMT ", rejected=%" PetscInt_FMT ", failed corrections=%" PetscInt_FMT " (+%" PetscInt_FMT " repeated with a new matrix), restarts=%" PetscInt_FMT "\n",
                                     s.steps, s.rejected, s.corrector_fails, s.retries, s.restarts));
    PetscCall(PetscViewerASCIIPrintf(viewer, "iterations=%" PetscInt_FMT ", residuals=%" PetscInt_FMT ", Jacobians=%" PetscInt_FMT ", factorizations=%" PetscInt_FMT ", h in [%g, %g]\n", s.newton, s.residuals, s.jacobians, s.factorizations,
                                     (double)s.h_min, (double)s.h_max));
  }
  if (s.changes)
    PetscCall(PetscViewerASCIIPrintf(viewer, "coordinates changed at t=%g, step %" PetscInt_FMT ", the last of %" PetscInt_FMT " changes\n", (double)I.change.t, I.change.step, s.changes));
  PetscFunctionReturn(PETSC_SUCCESS);
}

} // namespace

/* Called by PetscFinalize(); the program may call PetscInitialize() again */
static PetscErrorCode Finalize(void)
{
  PetscFunctionBegin;
  PetscCall(ReportUnusedOptions());
  PetscCall(ForgetOptions());
  registered = cited = PETSC_FALSE;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*MC
  TSHHT3 - Hilber-Hughes-Taylor integrator for index-3 differential-algebraic equations of multibody dynamics

  M(q) q'' + Phi_q^T lambda = Q(q, q', t), Phi(q, t) = 0, with velocity-level constraints, first-order states, user-defined
  variables and force states, given by TSSetI2Function() and TSSetI2Jacobian().

  Options Database Keys:
+ -ts_hhtdae_form <paper,second_order>   - how inertia forces are averaged, default second_order, `TSHHT3SetForm()`
. -ts_hhtdae_alpha <alpha>               - numerical damping in [-1/3, 0], default -0.3, `TSHHT3SetAlpha()`
. -ts_hhtdae_radius <rho>                - spectral radius at infinity in place of alpha, `TSHHT3SetRadius()`
. -ts_hhtdae_order <2,3,4,5,auto>        - the order, default 2, `TSHHT3SetOrder()`
. -ts_hhtdae_corrector_tolerance <c>     - where the Newton iteration stops, default 0.001 or less, `TSHHT3SetCorrectorTolerance()`
. -ts_hhtdae_predictor_degree <d>        - degree of the predictor, default -1, to choose it, `TSHHT3SetPredictorDegree()`
. -ts_hhtdae_reuse <ratio,rate,hold>     - when the matrix is renewed, default 1.4,0.25,1.2, `TSHHT3SetReuse()`
. -ts_hhtdae_start <off,report,project>  - inconsistent initial values, default report, `TSHHT3SetStart()`
. -ts_hhtdae_summary                     - print the counters at the end of the run
. -ts_hhtdae_progress                    - show the progress of the run on the terminal
. -ts_hhtdae_checkpoint <file>           - write checkpoints, `TSHHT3CheckpointSave()`
. -ts_hhtdae_checkpoint_every <n>        - ... every n steps; without it one at the end of `TSSolve()`
- -ts_hhtdae_resume <file>               - go on from a checkpoint, `TSHHT3CheckpointLoad()`

  Level: beginner

  Notes:
  The error test, `TSSetTolerances()`, judges positions (and first-order states) only: weight_i = max(atol_i,
  rtol_i Y_i) with Y_i the largest |q_i| so far. The Newton matrix is factored by a direct solver chosen by the work it
  takes. Where half of the unknowns or more are those of nodes of finite elements (`TSHHT3SetNodes()`) and the factor
  would have more than 1e7 entries, a Krylov method with the preconditioner hhtconstraint takes its place, as it does
  where there is no room for a factor. All options of `SNES`, `KSP` and `PC` override the defaults. A correction that
  fails reduces h; it does not end the run.

  The corrector stops by its measured rate of convergence. -snes_rtol, -snes_atol, -snes_stol, -snes_max_funcs and
  -snes_divergence_tolerance (`SNESSetTolerances()`) therefore have no effect, and a message says so if they are set;
  they take effect if -snes_convergence_test <default,skip> or `SNESSetConvergenceTest()` replaces the corrector's test
  by the user's. The corrector makes full steps without a line search: -snes_linesearch_<damping,...> need a
  -snes_linesearch_type. -snes_max_it, the largest number of iterations of a correction, always takes effect; its
  default is 10, and two more for each successful bisection between corrections of opposite direction. If the program
  sets PETSc's default values, 50 iterations, `SNESConvergedDefault()` or a lag of 1, they cannot be told from values
  that nobody has set; set these by option.

  A linear solve ends by -ksp_rtol alone: -ksp_atol has no effect, and a message says so if it is set. A solve counts as
  failed, too, if its result for a nonzero residual is zero, or shorter than any solution can be.

  -snes_fd, -snes_fd_color and -ts_fd_color make the Jacobian from differences of the application's residual.

  The default type of `TSAdapt`, also called hhtdae, differs from basic in the growth of h: a small growth is not taken,
  since it costs a new matrix; growth after failures is slow; and growth while nothing moves is limited if loads and
  motions set in later. A step size chosen by another type is taken as it is. TSADAPTGLEE and types of `SNES` for
  variational inequalities, adjoints or without a test of convergence are refused.

  `TSReset()`, `TSDestroy()` and a change of type take out of the `SNES` what the integrator has put into it. A change of
  type also unsets the types of `KSP` and `PC` and the factorization package that were chosen by default.

  If the function of an event is zero at the beginning of a step, as it is after the event, the step ends before the
  function returns to zero: `TSEvent` does not detect a zero that lies within its tolerance of the previous one. A ball
  that bounces lower than the tolerance therefore falls through the floor, unless the handler of the event brings it to
  rest.

  Call `TSRestartStep()` if forces jump where the integrator cannot detect it, between two calls of `TSSolve()` or in a
  monitor: the integrator's history belongs to the forces before the jump. After an event the integrator restarts in any
  case.

  If no step size is set, the first one is chosen from the third derivative of the positions. TSSetTimeStep(ts, 0.1), PETSc's
  default, counts as set only if it is called after `TSSetType()`; an earlier call cannot be told from none.

  The integrator scales the Newton matrix by rows and columns. If `TSSetI2Jacobian()` is given two matrices, both are
  scaled. Amat may be a `MATSHELL`, whose product is that of the unscaled Jacobian; the integrator assembles it after each
  evaluation, which removes the former scaling. Pmat has to support `MatGetRow()`: `MATAIJ`, `MATBAIJ`, `MATSBAIJ`, on one
  rank `MATDENSE`.

  Holonomic constraints may depend on coordinates and time only. Constraints at velocity level may also depend on
  first-order states, and on variables and force states defined by V - v(...) = 0 with a v of positions, states and
  time. The set-up refuses constraints with other dependences, since consistent accelerations need the derivatives of
  the constraints.

  With -ts_exact_final_time interpolate `TSSolve()` gives positions at the final time, but velocities at the end of the
  last step, as all types of second order do; `TSHHT3Interpolate()` gives both.

  A start looks for loads and motions that set in later: it evaluates the I2Function in its initial state at times up to
  `TSGetMaxTime()`. A function that is defined for a shorter time, such as a table, has to return a value or NaN there,
  not an error.

  If strong damping decelerates the initial velocities within less than a tenth of the first step, the run starts with
  the velocities that remain after this transient; -info says so, and the vector of velocities (`TS2GetSolution()`)
  holds them.

  References:
+ * - D. Negrut, R. Rampalli, G. Ottarsson, A. Sajdak, J. Comput. Nonlinear Dyn. 2(1), 2007
- * - M. Arnold, O. Bruels, Multibody Syst. Dyn. 18, 2007

.seealso: `TSCreate()`, `TSSetType()`, `TSSetI2Function()`, `TSSetI2Jacobian()`, `TS2SetSolution()`, `TSHHT3SetIS()`
M*/
PetscErrorCode TSCreate_HHT(TS ts)
{
  PetscFunctionBegin;
  ts->data                = new Integrator();
  Get(ts).p = Get(ts).hht = HHTParameters(Get(ts).alpha, false);
  ts->ops->setup          = TSSetUp_HHT;
  ts->ops->reset          = TSReset_HHT;
  ts->ops->destroy        = TSDestroy_HHT;
  ts->ops->view           = TSView_HHT;
  ts->ops->setfromoptions = TSSetFromOptions_HHT;
  ts->ops->step           = TSStep_HHT;
  ts->ops->evaluatewlte   = TSEvaluateWLTE_HHT;
  ts->ops->rollback       = TSRollBack_HHT;
  ts->ops->interpolate    = TSInterpolate_HHT;
  ts->ops->snesfunction   = FormFunction;
  ts->ops->snesjacobian   = FormJacobian;
  ts->default_adapt_type  = TSHHT3;
  ts->usessnes            = PETSC_TRUE;
  NoteRanks(PetscObjectComm((PetscObject)ts));
  if (ts->time_step == petsc_default_step) ts->time_step = unset_step;
  Get(ts).failures_unlimited = (PetscBool)(ts->max_snes_failures == 1); /* PETSc's default, with which the first failure ends the run */
  if (Get(ts).failures_unlimited) ts->max_snes_failures = HHT3_UNLIMITED;
  PetscCall(ComposeSetters(ts, true));
  PetscFunctionReturn(PETSC_SUCCESS);
}

} // namespace hht3

/*@C
  TSHHT3Initialize - Registers `TSHHT3` and the ordering "metisnd"

  Not Collective

  Level: beginner

  Note:
  Programs that link the library call it once after `PetscInitialize()`, on all ranks or on some. With -dll_append libhhtdae.so PETSc calls it itself.

.seealso: `TSHHT3`, `TSRegister()`
@*/
PetscErrorCode TSHHT3Initialize(void)
{
  PetscClassId id;

  PetscFunctionBegin;
  if (hht3::registered) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(HHT3CheckPetscVersion());
  hht3::registered = PETSC_TRUE;
  PetscCall(PetscRegisterFinalize(hht3::Finalize));
  PetscCall(TSRegister(TSHHT3, hht3::TSCreate_HHT));
  PetscCall(TSAdaptRegister(TSHHT3, hht3::TSAdaptCreate_HHT));
  PetscCall(LinearRegister());
  PetscCall(PetscClassIdRegister("hhtdae", &id));
  PetscCall(PetscLogEventRegister("HHT3Start", id, &hht3::events.start));
  PetscCall(PetscLogEventRegister("HHT3Predict", id, &hht3::events.predict));
  PetscCall(PetscLogEventRegister("HHT3Matrix", id, &hht3::events.matrix));
  PetscCall(PetscLogEventRegister("HHT3Estimate", id, &hht3::events.estimate));
  PetscCall(PetscLogEventRegister("HHT3Sample", id, &hht3::events.sample));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The name by which PETSc's plugin loader looks for libhhtdae.so */
PETSC_EXTERN PetscErrorCode PetscDLLibraryRegister_hhtdae(void)
{
  PetscFunctionBegin;
  PetscCall(TSHHT3Initialize());
  hht3::NoteRanks(PETSC_COMM_WORLD);
  PetscFunctionReturn(PETSC_SUCCESS);
}
