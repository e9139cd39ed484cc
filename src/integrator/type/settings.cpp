/*
  The user's settings of TS, TSAdapt and SNES: invalid ones are errors, and those without effect on this integrator are
  reported.
*/
#include "integrator/entries.h"
#include "settings.h"

namespace hht3
{

namespace
{

bool IsTolerance(PetscReal x) { return x >= 0 && !PetscIsInfReal(x); } /* false for NaN */

/* Error unless x, or every entry of v if the user has given a vector, is a finite number >= 0 */
PetscErrorCode CheckTolerance(TS ts, const char name[], PetscReal x, Vec v)
{
  PetscInt first;

  PetscFunctionBegin;
  if (!v) {
    PetscCheck(IsTolerance(x), PetscObjectComm((PetscObject)ts), PETSC_ERR_ARG_OUTOFRANGE,
               "The %s tolerance %g must be a number from 0 on (-ts_%ctol, TSSetTolerances())", name, (double)x, name[0]);
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  PetscInt n, entries, N, all;
  PetscCall(VecGetLocalSize(ts->vec_sol, &n));
  PetscCall(VecGetLocalSize(v, &entries));
  PetscCall(VecGetSize(ts->vec_sol, &N));
  PetscCall(VecGetSize(v, &all));
  bool same;
  PetscCall(OnAllRanks(ts, n == entries && N == all, &same));
  PetscCheck(same, PetscObjectComm((PetscObject)ts), PETSC_ERR_ARG_SIZ,
             "The vector of %s tolerances has %" PetscInt_FMT " entries and the solution %" PetscInt_FMT ", or they lie on other ranks: use VecDuplicate() of the solution (TSSetTolerances())", name, all, N);
  PetscCall(FirstWhere([](PetscInt, PetscScalar a) { return !IsTolerance(PetscRealPart(a)); }, &first, Read(v)));
  PetscCheck(first < 0, PetscObjectComm((PetscObject)ts), PETSC_ERR_ARG_OUTOFRANGE,
             "The %s tolerance of unknown %" PetscInt_FMT " must be a number from 0 on (TSSetTolerances())", name, first);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* TSADAPTGLEE uses an error estimate that only TSGLEE computes; without one it would accept every step and multiply h
   by ten */
PetscErrorCode CheckAdapt(TS ts)
{
  const TSAdapt a = ts->adapt;
  PetscBool     glee;

  PetscFunctionBegin;
  PetscCall(PetscObjectTypeCompare((PetscObject)a, TSADAPTGLEE, &glee));
  PetscCheck(!glee, PetscObjectComm((PetscObject)ts), PETSC_ERR_SUP, "-ts_adapt_type glee needs the error of TSGLEE, which %s does not compute; use basic or dsp", TSHHT3);
  PetscCheck(a->dt_min >= 0 && a->dt_max > 0 && a->dt_min <= a->dt_max, PetscObjectComm((PetscObject)ts), PETSC_ERR_ARG_OUTOFRANGE,
             "The limits of the time step, %g and %g, must be a range of positive numbers (-ts_adapt_dt_min, -ts_adapt_dt_max)", (double)a->dt_min, (double)a->dt_max);
  PetscCheck(a->safety > 0 && a->clip[0] >= 0 && a->clip[1] >= 1 && a->scale_solve_failed > 0 && a->scale_solve_failed <= 1, PetscObjectComm((PetscObject)ts), PETSC_ERR_ARG_OUTOFRANGE,
             "TSAdapt: safety %g, clip %g,%g, scale after a failed solve %g: all must be positive, the second number of clip at least 1, the scale at most 1", (double)a->safety, (double)a->clip[0],
             (double)a->clip[1], (double)a->scale_solve_failed);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Refuses types of SNES that do not solve F(X) = 0 with the Newton matrix of X */
PetscErrorCode CheckSNESType(TS ts)
{
  static constexpr char bounds[] = "solves variational inequalities: the unknowns of a step are accelerations, on which there are no bounds";
  static const struct {
    SNESType    type;
    const char *why;
  } unfit[] = {{SNESVINEWTONRSLS, bounds},
               {SNESVINEWTONSSLS, bounds},
               {SNESKSPTRANSPOSEONLY, "solves with the transposed matrix, which is for adjoints"},
               {SNESNGS, "solves row by row for the row's own unknown, which a constraint does not contain"},
               {SNESMS, "takes a few explicit stages, which smooth, and ends without asking for a test of convergence or asks it without a matrix"}};
  PetscBool is;

  PetscFunctionBegin;
  for (const auto &u : unfit) {
    PetscCall(PetscObjectTypeCompare((PetscObject)ts->snes, u.type, &is));
    PetscCheck(!is, PetscObjectComm((PetscObject)ts), PETSC_ERR_SUP, "-snes_type %s %s; use %s, or %s for linear problems", u.type, u.why, SNESNEWTONLS, SNESKSPONLY);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Refuses coarse matrices of the application: they would lack the scaling of (10), and to compute them PETSc would
   restrict the solution of the SNES to the coarse levels before there is a solution */
PetscErrorCode CheckMultigrid(TS ts)
{
  KSP              ksp;
  PC               pc;
  PetscBool        mg;
  PetscInt         levels;
  PCMGGalerkinType galerkin;

  PetscFunctionBegin;
  PetscCall(SNESGetKSP(ts->snes, &ksp));
  PetscCall(KSPGetPC(ksp, &pc));
  PetscCall(PetscObjectTypeCompare((PetscObject)pc, PCMG, &mg));
  if (!mg) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PCMGGetLevels(pc, &levels));
  PetscCall(PCMGGetGalerkin(pc, &galerkin));
  PetscCheck(levels < 2 || (galerkin != PC_MG_GALERKIN_NONE && galerkin != PC_MG_GALERKIN_EXTERNAL), PetscObjectComm((PetscObject)ts), PETSC_ERR_SUP,
             "-pc_type mg with %" PetscInt_FMT " levels needs matrices of the coarse levels that are made of the fine one's, which is scaled: -pc_mg_galerkin, or PCMGSetGalerkin()", levels);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Refuses options by which a linear solve depends on earlier solves, or changes the matrix. The corrector does not
   compute the norms of residuals that -snes_ksp_ew needs, and a start would use the tolerance of the last solve. After
   -ksp_diagonal_scale the matrix would no longer be the one by which corrections are proved. */
PetscErrorCode CheckSolves(TS ts)
{
  KSP       ksp;
  PetscBool ew, scales, guess;

  PetscFunctionBegin;
  PetscCall(SNESKSPGetUseEW(ts->snes, &ew));
  PetscCheck(!ew, PetscObjectComm((PetscObject)ts), PETSC_ERR_SUP, "-snes_ksp_ew sets the tolerance of a linear solve by norms of residuals, which the corrector does not take; use -ksp_rtol");
  PetscCall(SNESGetKSP(ts->snes, &ksp));
  PetscCall(KSPGetInitialGuessNonzero(ksp, &guess));
  PetscCheck(!guess, PetscObjectComm((PetscObject)ts), PETSC_ERR_SUP, "-ksp_initial_guess_nonzero begins a solve with the last correction, which is far larger than the next one: corrections have no better guess than zero");
  PetscCall(KSPGetDiagonalScale(ksp, &scales));
  PetscCheck(!scales, PetscObjectComm((PetscObject)ts), PETSC_ERR_SUP, "-ksp_diagonal_scale changes the Newton matrix, of which the corrector makes use after a solve; it is scaled already, and -pc_type jacobi scales a solve");
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* PETSc's default of -snes_max_it: the user has set any other value */
constexpr PetscInt petsc_max_it = 50;

/* Options that only the tests or the line searches of SNES read */
struct Unread {
  const char *name, *reader, *instead;
};

constexpr char test[] = "the test of SNES", line_search[] = "SNES' own line searches";
constexpr char use_test[]        = "-snes_convergence_test default enables it; the corrector's own test is set by -ts_hhtdae_corrector_tolerance";
constexpr char use_line_search[] = "-snes_linesearch_type basic, bt, l2 or cp enables one; the corrector makes full steps";

constexpr Unread unread[] = {
  {"-snes_rtol",                        test,        use_test       },
  {"-snes_atol",                        test,        use_test       },
  {"-snes_stol",                        test,        use_test       },
  {"-snes_divergence_tolerance",        test,        use_test       },
  {"-snes_max_funcs",                   test,        use_test       },
  {"-snes_max_fail",                    line_search, use_line_search},
  {"-snes_linesearch_damping",          line_search, use_line_search},
  {"-snes_linesearch_maxstep",          line_search, use_line_search},
  {"-snes_linesearch_minlambda",        line_search, use_line_search},
  {"-snes_linesearch_max_it",           line_search, use_line_search},
  {"-snes_linesearch_rtol",             line_search, use_line_search},
  {"-snes_linesearch_atol",             line_search, use_line_search},
  {"-snes_linesearch_ltol",             line_search, use_line_search},
  {"-snes_linesearch_order",            line_search, use_line_search},
  {"-snes_linesearch_monitor",          line_search, use_line_search},
  {"-snes_linesearch_precheck_picard",  line_search, use_line_search},
};

PetscErrorCode ReportUnreadOption(TS ts, const char name[], const Unread &what)
{
  PetscFunctionBegin;
  PetscCall(PetscPrintf(PetscObjectComm((PetscObject)ts), "%s: %s has no effect, as only %s would read it: %s\n", TSHHT3, name, what.reader, what.instead));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode ReportUnread(TS ts, bool own_test, bool own_line_search)
{
  const SNES snes = ts->snes;
  bool       reported = false;

  PetscFunctionBegin;
  for (const Unread &u : unread) {
    PetscBool given = PETSC_FALSE;
    if (u.reader == test ? own_test : own_line_search) PetscCall(OptionGiven((PetscObject)snes, u.name, &given));
    if (given) PetscCall(ReportUnreadOption(ts, u.name, u));
    reported = reported || (given && u.reader == test);
  }
  /* tolerances that the program has set */
  PetscBool newton; /* other types of SNES change their tolerances themselves */
  PetscCall(PetscObjectTypeCompare((PetscObject)snes, SNESNEWTONLS, &newton));
  const bool set = newton && (snes->rtol != (PetscReal)1e-8 || snes->abstol != (PetscReal)1e-50 || snes->stol != (PetscReal)1e-8);
  if (own_test && set && !reported) PetscCall(ReportUnreadOption(ts, "SNESSetTolerances()", unread[0]));
  if (ts->adapt->ignore_max > 0)
    PetscCall(PetscPrintf(PetscObjectComm((PetscObject)ts), "%s: -ts_adapt_max_ignore %g has no effect, as the error test scales each coordinate by its largest value so far; to exclude unknowns from the test give them large tolerances, TSSetTolerances() with vectors\n", TSHHT3, (double)ts->adapt->ignore_max));
  PetscFunctionReturn(PETSC_SUCCESS);
}

} // namespace

PetscErrorCode OptionGiven(PetscObject object, const char name[], PetscBool *given)
{
  PetscFunctionBegin;
  PetscCall(PetscOptionsHasName(object->options, object->prefix, name, given));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode CheckSettings(TS ts)
{
  PetscFunctionBegin;
  PetscCall(CheckTolerance(ts, "relative", ts->rtol, ts->vrtol));
  PetscCall(CheckTolerance(ts, "absolute", ts->atol, ts->vatol));
  PetscCheck(!PetscIsInfReal(ts->time_step), PetscObjectComm((PetscObject)ts), PETSC_ERR_ARG_OUTOFRANGE, "The time step %g must be positive and finite (-ts_dt, TSSetTimeStep())", (double)ts->time_step);
  PetscCheck(!PetscIsNanReal(ts->max_time) && !PetscIsInfOrNanReal(ts->ptime), PetscObjectComm((PetscObject)ts), PETSC_ERR_ARG_OUTOFRANGE,
             "The time of the start, %g, and of the end, %g, must be numbers (-ts_init_time, -ts_max_time)", (double)ts->ptime, (double)ts->max_time);
  PetscCall(CheckAdapt(ts));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode TakeSNESSettings(TS ts)
{
  Integrator &I = Get(ts);
  PetscBool   given;

  PetscFunctionBegin;
  PetscCall(CheckSNESType(ts));
  PetscCall(CheckMultigrid(ts));
  PetscCall(CheckSolves(ts));
  PetscCall(OptionGiven((PetscObject)ts->snes, "-snes_max_it", &given));
  if (given || ts->snes->max_its != petsc_max_it) I.corrector.max_it = ts->snes->max_its;
  else I.corrector.max_it = CorrectorOptions().max_it;
  if (!I.settings_reported) PetscCall(ReportUnread(ts, !HooksUserTest(ts), I.hooks.line_search));
  I.settings_reported = PETSC_TRUE;
  PetscFunctionReturn(PETSC_SUCCESS);
}

} // namespace hht3
