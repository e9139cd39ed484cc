/*
  What the integrator puts into the SNES of its TS, and how it is taken out again: the convergence test, the line
  search, the lag of the Jacobian, the check of its domain error and the function that fills a matrix made from
  differences. All of these point to this TS. TSReset(), TSDestroy() and a change of type remove them and restore what
  the user had set before.
*/
#include "integrator/step/corrector.h"
#include "settings.h"

namespace hht3
{

namespace
{

/* Whether the convergence test of the SNES is the one that HooksInstall() has set for this TS */
bool TestIsOurs(TS ts, SNES snes) { return snes->ops->converged == SNESConverged_HHT && snes->cnvP == (void *)ts; }

/* Installs the integrator's convergence test, unless the user has chosen one in the program or by the option, even if
   the option names the default. The fields of the SNES are exchanged, since SNESSetConvergenceTest() would destroy the
   context of the test before. */
PetscErrorCode InstallTest(TS ts, SNES snes)
{
  Hooks    &H = Get(ts).hooks;
  PetscBool users;

  PetscFunctionBegin;
  PetscCall(OptionGiven((PetscObject)snes, "-snes_convergence_test", &users));
  if (users || snes->ops->converged != SNESConvergedDefault) PetscFunctionReturn(PETSC_SUCCESS);
  H.test                      = PETSC_TRUE;
  H.cnvP                      = snes->cnvP;
  H.convergeddestroy          = snes->ops->convergeddestroy;
  snes->ops->converged        = SNESConverged_HHT;
  snes->ops->convergeddestroy = NULL;
  snes->cnvP                  = ts;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode RemoveTest(TS ts, SNES snes)
{
  Hooks &H = Get(ts).hooks;

  PetscFunctionBegin;
  if (!H.test) PetscFunctionReturn(PETSC_SUCCESS);
  H.test = PETSC_FALSE;
  if (TestIsOurs(ts, snes)) {
    snes->ops->converged        = SNESConvergedDefault;
    snes->ops->convergeddestroy = H.convergeddestroy;
    snes->cnvP                  = H.cnvP;
  } else if (H.convergeddestroy) PetscCall((*H.convergeddestroy)(H.cnvP)); /* the user has set another test since */
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* *checks: the user has set a pre-check or a post-check. PETSc's line searches call them, SNESLINESEARCHSHELL does not. */
PetscErrorCode ChecksCorrections(SNESLineSearch ls, PetscBool *checks)
{
  void *ctx;
  PetscErrorCode (*before)(SNESLineSearch, Vec, Vec, PetscBool *, void *);
  PetscErrorCode (*after)(SNESLineSearch, Vec, Vec, Vec, PetscBool *, PetscBool *, void *);

  PetscFunctionBegin;
  PetscCall(SNESLineSearchGetPreCheck(ls, &before, &ctx));
  PetscCall(SNESLineSearchGetPostCheck(ls, &after, &ctx));
  *checks = (PetscBool)(before || after);
  PetscFunctionReturn(PETSC_SUCCESS);
}

const char left_behind[] = "hhtdae: backtracking in place of no choice";

/* The type of a line search cannot be unset: sets backtracking, as SNESSetType() would have done, and marks that the
   user has not chosen it */
PetscErrorCode LeaveBacktracking(SNESLineSearch ls)
{
  PetscContainer mark;

  PetscFunctionBegin;
  PetscCall(SNESLineSearchSetType(ls, SNESLINESEARCHBT));
  PetscCall(PetscContainerCreate(PetscObjectComm((PetscObject)ls), &mark));
  PetscCall(PetscObjectCompose((PetscObject)ls, left_behind, (PetscObject)mark));
  PetscCall(PetscContainerDestroy(&mark));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* *chosen: the user has chosen a type. Two types do not count: backtracking with the mark of LeaveBacktracking(), which
   is removed here; and a shell without a function, which a TS that has read its options has set in a SNES that it
   shares with its clone (Hooks.CloneBeforeTheFirstSolve). */
PetscErrorCode LineSearchChosen(SNESLineSearch ls, PetscBool *chosen)
{
  PetscObject mark;
  PetscBool   bt, shell;
  void       *ctx;
  PetscErrorCode (*apply)(SNESLineSearch, void *) = NULL;

  PetscFunctionBegin;
  PetscCall(PetscObjectQuery((PetscObject)ls, left_behind, &mark));
  PetscCall(PetscObjectTypeCompare((PetscObject)ls, SNESLINESEARCHBT, &bt));
  PetscCall(PetscObjectTypeCompare((PetscObject)ls, SNESLINESEARCHSHELL, &shell));
  if (shell) PetscCall(SNESLineSearchShellGetApply(ls, &apply, &ctx));
  *chosen = (PetscBool)(((PetscObject)ls)->type_name && !(mark && bt) && !(shell && !apply));
  PetscCall(PetscObjectCompose((PetscObject)ls, left_behind, NULL));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode RemoveLineSearch(TS ts, SNES snes)
{
  SNESLineSearch ls;
  PetscBool      shell;

  PetscFunctionBegin;
  if (!Get(ts).hooks.line_search) PetscFunctionReturn(PETSC_SUCCESS);
  Get(ts).hooks.line_search = PETSC_FALSE;
  PetscCall(SNESGetLineSearch(snes, &ls));
  PetscCall(PetscObjectTypeCompare((PetscObject)ls, SNESLINESEARCHSHELL, &shell));
  if (shell) PetscCall(LeaveBacktracking(ls));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Restores the absolute tolerance of the KSP, which Factor() has set to 0, unless the user has set another one since */
PetscErrorCode RestoreTolerance(TS ts, SNES snes)
{
  Hooks    &H = Get(ts).hooks;
  KSP       ksp;
  PetscReal abstol;

  PetscFunctionBegin;
  if (H.abstol <= 0) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(SNESGetKSP(snes, &ksp));
  PetscCall(KSPGetTolerances(ksp, NULL, &abstol, NULL, NULL));
  if (abstol == 0) PetscCall(KSPSetTolerances(ksp, PETSC_DEFAULT, H.abstol, PETSC_DEFAULT, PETSC_DEFAULT));
  H.abstol = 0;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SetDMJacobian(DMSNES sdm, decltype(_DMSNESOps::computejacobian) f, PetscContainer ctx)
{
  PetscFunctionBegin;
  sdm->ops->computejacobian = f;
  sdm->jacobianctxcontainer = ctx;
  PetscCall(PetscObjectCompose((PetscObject)sdm, "jacobian ctx", (PetscObject)ctx));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode RemoveJacobian(TS ts)
{
  Hooks        &H = Get(ts).hooks;
  DMSNES        sdm;
  Mat           P  = NULL;
  PetscObjectId id = 0;

  PetscFunctionBegin;
  if (H.jacobian && ts->dm) {
    PetscCall(DMGetDMSNESWrite(ts->dm, &sdm));
    if (sdm->ops->computejacobian == SNESTSFormJacobian) PetscCall(SetDMJacobian(sdm, H.computejacobian, H.jacobianctx));
    if (ts->snes) PetscCall(SNESGetJacobian(ts->snes, NULL, &P, NULL, NULL));
    if (P) PetscCall(PetscObjectGetId((PetscObject)P, &id));
    if (ts->snes && H.J && id == H.matrices[1]) PetscCall(SNESSetJacobian(ts->snes, H.J, H.P, NULL, NULL)); /* unless the user has given others since */
    if (ts->snes && !sdm->ops->computejacobian) { /* SNESSetUp() then chooses anew who fills which matrices (Hooks.AnotherTypeWithoutAJacobian) */
      if (!H.J && id == H.matrices[1]) {
        PetscCall(MatDestroy(&ts->snes->jacobian));
        PetscCall(MatDestroy(&ts->snes->jacobian_pre));
      }
      ts->snes->setupcalled = PETSC_FALSE;
    }
  }
  H.jacobian = PETSC_FALSE;
  PetscCall(PetscContainerDestroy(&H.jacobianctx));
  PetscCall(MatDestroy(&H.J));
  PetscCall(MatDestroy(&H.P));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Sets the functions of this TS in the SNES, which may have those of another TS that used it before. A function that
   the program has set in the SNES is an error, since starts and proofs would not call it. A function that another
   solver on the same DM has set is replaced: the SNES then has no vec_func. */
PetscErrorCode TakeSNESFunctions(TS ts, SNES snes)
{
  DM     dm;
  DMSNES sdm;

  PetscFunctionBegin;
  PetscCall(SNESGetDM(snes, &dm));
  PetscCall(DMGetDMSNES(dm, &sdm));
  PetscCheck(!sdm->ops->computefunction || sdm->ops->computefunction == SNESTSFormFunction || !snes->vec_func || snes->setupcalled, PetscObjectComm((PetscObject)ts), PETSC_ERR_SUP,
             "The SNES of the TS has a function of the program's own (SNESSetFunction()), which TSHHT3 cannot call: starts evaluate the I2Function of TSSetI2Function() alone, where what that function adds belongs. If it is that of another SNES on the DM of the TS, give both a DM of their own (DMClone())");
  const bool jacobian = sdm->ops->computejacobian == SNESTSFormJacobian; /* before SNESSetFunction(), which may replace the DMSNES that the DM shares with another DM */
  PetscCall(SNESSetFunction(snes, NULL, SNESTSFormFunction, ts));
  if (jacobian) PetscCall(DMSNESSetJacobian(dm, SNESTSFormJacobian, ts));
  PetscFunctionReturn(PETSC_SUCCESS);
}

} // namespace

PetscErrorCode HooksLineSearch(TS ts)
{
  SNES           snes;
  SNESLineSearch ls;
  SNESType       now;
  char           type[256];
  PetscBool      newton, chosen = PETSC_FALSE, checks = PETSC_FALSE;

  PetscFunctionBegin;
  PetscCall(TSGetSNES(ts, &snes));
  PetscCall(SNESGetType(snes, &now));
  PetscCall(PetscStrncpy(type, now ? now : SNESNEWTONLS, sizeof(type)));
  PetscCall(PetscOptionsGetString(((PetscObject)snes)->options, ((PetscObject)snes)->prefix, "-snes_type", type, sizeof(type), NULL));
  PetscCall(PetscStrcmp(type, SNESNEWTONLS, &newton));
  PetscCall(SNESGetLineSearch(snes, &ls));
  if (!newton) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(LineSearchChosen(ls, &chosen));
  if (chosen) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(ChecksCorrections(ls, &checks));
  PetscCall(SNESLineSearchSetType(ls, checks ? SNESLINESEARCHBASIC : SNESLINESEARCHSHELL));
  Get(ts).hooks.line_search = (PetscBool)!checks;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HooksJacobian(TS ts)
{
  Hooks &H = Get(ts).hooks;
  DMSNES sdm;

  PetscFunctionBegin;
  PetscCall(SNESGetJacobian(ts->snes, &H.J, &H.P, NULL, NULL));
  PetscCall(PetscObjectReference((PetscObject)H.J));
  PetscCall(PetscObjectReference((PetscObject)H.P));
  PetscCall(DMGetDMSNESWrite(ts->dm, &sdm));
  H.computejacobian = sdm->ops->computejacobian;
  H.jacobianctx     = sdm->jacobianctxcontainer;
  PetscCall(PetscObjectReference((PetscObject)H.jacobianctx));
  H.jacobian        = PETSC_TRUE;
  PetscCall(DMSNESSetJacobian(ts->dm, SNESTSFormJacobian, ts));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* A SNES shared by several TS serves the one that steps. Its matrices and line search are examined after this call,
   since those that another TS has chosen do not count as the user's. */
PetscErrorCode HooksTakeOver(TS ts, SNES snes)
{
  PetscFunctionBegin;
  if (snes->ops->converged == SNESConverged_HHT && snes->cnvP != (void *)ts) PetscCall(HooksRemove((TS)snes->cnvP));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HooksInstall(TS ts)
{
  Integrator &I = Get(ts);
  Hooks      &H = I.hooks;
  SNES        snes;
  PetscBool   given;

  PetscFunctionBegin;
  PetscCall(TSGetSNES(ts, &snes));
  if (H.snes != snes) {
    PetscCall(TakeSNESFunctions(ts, snes));
    PetscCall(PetscObjectReference((PetscObject)snes));
    PetscCall(SNESDestroy(&H.snes));
    H.snes = snes;
    H.lag          = snes->lagjacobian;
    H.check_domain = snes->checkjacdomainerror;
    PetscCall(OptionGiven((PetscObject)snes, "-snes_lag_jacobian", &I.corrector.user_lag));
    if (snes->lagjacobian != 1) I.corrector.user_lag = PETSC_TRUE; /* the program has set a lag */
    if (!I.corrector.user_lag) PetscCall(SNESSetLagJacobian(snes, -2));
  }
  DM dm;
  PetscCall(SNESGetDM(snes, &dm));
  PetscCall(DMSNESGetJacobian(dm, &H.dm_jacobian, &H.dm_jacobian_ctx));
  if (!TestIsOurs(ts, snes)) PetscCall(InstallTest(ts, snes));
  PetscCall(OptionGiven((PetscObject)snes, "-snes_check_jacobian_domain_error", &given));
  if (!given) PetscCall(SNESSetCheckJacobianDomainError(snes, PETSC_TRUE)); /* by this FormJacobian() reports a singular matrix */
  PetscFunctionReturn(PETSC_SUCCESS);
}

namespace
{

PetscErrorCode ForgetTheirs(Hooks &H)
{
  PetscFunctionBegin;
  H.borrowed = PETSC_FALSE;
  for (PetscContainer &c : H.their_ctx) PetscCall(PetscContainerDestroy(&c));
  PetscFunctionReturn(PETSC_SUCCESS);
}

} // namespace

/* SNES takes its functions from its DM: if two solvers share one DM, both would call those that were set last
   (Hooks.TwoSolversOnOneDM) */
PetscErrorCode HooksBorrowDM(TS ts)
{
  Hooks                                &H = Get(ts).hooks;
  DM                                    dm;
  DMSNES                                sdm;
  void                                 *ctx;
  decltype(_DMSNESOps::computefunction) f;

  PetscFunctionBegin;
  if (ts->snes != H.snes) PetscFunctionReturn(PETSC_SUCCESS); /* HooksInstall() will set the functions in the new SNES */
  PetscCall(SNESGetDM(ts->snes, &dm));
  PetscCall(DMSNESGetFunction(dm, &f, &ctx));
  PetscCall(DMGetDMSNES(dm, &sdm));
  if (f == SNESTSFormFunction && ctx == ts && H.jacobian && sdm->ops->computejacobian == H.computejacobian) PetscCall(DMSNESSetJacobian(dm, SNESTSFormJacobian, ts));
  if (f == SNESTSFormFunction && ctx == ts) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscInfo(ts, "another solver has put its functions into the DM of the TS: those of the TS stand there during its steps\n"));
  if (f != SNESTSFormFunction && !H.borrowed_told) {
    PetscCall(PetscPrintf(PetscObjectComm((PetscObject)ts),
                          "%s: steps do not call the function that another SNES on the DM of the TS, or the program in its SNES, has set (SNESSetFunction()): give every solver a DM of its own (DMClone()), and all forces in TSSetI2Function().\n", TSHHT3));
    H.borrowed_told = PETSC_TRUE;
  }
  PetscCall(ForgetTheirs(H)); /* left by a step that has ended in an error */
  PetscCall(DMGetDMSNESWrite(dm, &sdm));
  H.borrowed       = PETSC_TRUE;
  H.their_function = sdm->ops->computefunction;
  H.their_jacobian = sdm->ops->computejacobian;
  H.their_ctx[0]   = sdm->functionctxcontainer;
  H.their_ctx[1]   = sdm->jacobianctxcontainer;
  for (PetscContainer c : H.their_ctx) PetscCall(PetscObjectReference((PetscObject)c));
  PetscCall(DMSNESSetFunction(dm, SNESTSFormFunction, ts));
  if (H.dm_jacobian) PetscCall(DMSNESSetJacobian(dm, H.dm_jacobian, H.dm_jacobian_ctx));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode HooksReturnDM(TS ts)
{
  Hooks &H = Get(ts).hooks;
  DM     dm;
  DMSNES sdm;

  PetscFunctionBegin;
  if (!H.borrowed && !H.jacobian) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(SNESGetDM(ts->snes, &dm));
  PetscCall(DMGetDMSNESWrite(dm, &sdm));
  if (!H.borrowed) { /* between steps another solver on the DM that has no Jacobian must not find this one */
    if (sdm->ops->computejacobian == SNESTSFormJacobian) PetscCall(SetDMJacobian(sdm, H.computejacobian, H.jacobianctx));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  sdm->ops->computefunction = H.their_function;
  sdm->functionctxcontainer = H.their_ctx[0];
  PetscCall(PetscObjectCompose((PetscObject)sdm, "function ctx", (PetscObject)H.their_ctx[0]));
  PetscCall(SetDMJacobian(sdm, H.their_jacobian, H.their_ctx[1]));
  PetscCall(ForgetTheirs(H));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscBool HooksUserTest(TS ts) { return (PetscBool)!TestIsOurs(ts, ts->snes); }

PetscErrorCode HooksRemove(TS ts)
{
  Hooks &H = Get(ts).hooks;

  PetscFunctionBegin;
  PetscCall(RemoveJacobian(ts));
  PetscCall(ForgetTheirs(H));
  if (H.line_search && !H.snes && ts->snes) PetscCall(RemoveLineSearch(ts, ts->snes)); /* options were read, but TSSetUp() was not called */
  if (!H.snes) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(RemoveTest(ts, H.snes));
  PetscCall(RemoveLineSearch(ts, H.snes));
  PetscCall(RestoreTolerance(ts, H.snes));
  if (!Get(ts).corrector.user_lag) PetscCall(SNESSetLagJacobian(H.snes, H.lag));
  PetscCall(SNESSetCheckJacobianDomainError(H.snes, H.check_domain));
  H.snes->jacobiandomainerror = PETSC_FALSE;
  PetscCall(SNESDestroy(&H.snes));
  PetscFunctionReturn(PETSC_SUCCESS);
}

} // namespace hht3
