/*
  What the integrator puts into the SNES of its TS, and how it is taken out again: the convergence test, the line search, the lag
  of the Jacobian, the check of its domain error and the function that fills a matrix made from differences. All of it points to
  this TS. It goes with TSReset(), TSDestroy() and a change of type, and what the user had set there before comes back.
*/
#include "integrator/step/corrector.h"
#include "settings.h"

namespace hht3
{

namespace
{

/* The test stands in the SNES of ts, put there by HooksInstall(): neither by the user since nor for another TS */
bool TestIsOurs(TS ts, SNES snes) { return snes->ops->converged == SNESConverged_HHT && snes->cnvP == (void *)ts; }

/* Unless the user has chosen one, by the option, also where it names the default, or by the program. By exchange of the fields: SNESSetConvergenceTest() would destroy the
   context of the user's test */
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
  } else if (H.convergeddestroy) PetscCall((*H.convergeddestroy)(H.cnvP)); /* the user has another test since */
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Functions of the user's that look at a correction before or after it is made are called by PETSc's line searches, not by a shell */
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

/* A line search cannot be made typeless again: backtracking is what SNESSetType() would have chosen, marked as nobody's choice */
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

/* Whether a type has been chosen: not so where backtracking is still what has been left behind, or a shell has no function yet, which a TS that has read its options has put into a SNES
   that it shares with its clone (Hooks.CloneBeforeTheFirstSolve) */
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

/* The absolute tolerance that Factor() has taken out, unless the user has set another one since */
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
    if (ts->snes && !sdm->ops->computejacobian) { /* SNESSetUp() makes matrices, and chooses who fills them, where there are none (Hooks.AnotherTypeWithoutAJacobian) */
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

/* A SNES that has served another TS evaluates that one's functions. One of the program's own around ours would not be called in starts and proofs; what another solver on
   the DM has left there comes without a vector for its values. */
PetscErrorCode TakeSNESFunctions(TS ts, SNES snes)
{
  DM     dm;
  DMSNES sdm;

  PetscFunctionBegin;
  PetscCall(SNESGetDM(snes, &dm));
  PetscCall(DMGetDMSNES(dm, &sdm));
  PetscCheck(!sdm->ops->computefunction || sdm->ops->computefunction == SNESTSFormFunction || !snes->vec_func || snes->setupcalled, PetscObjectComm((PetscObject)ts), PETSC_ERR_SUP,
             "The SNES of the TS has a function of the program's own (SNESSetFunction()), which TSHHT3 cannot call: starts evaluate the I2Function of TSSetI2Function() alone, where what that function adds belongs. If it is that of another SNES on the DM of the TS, give both a DM of their own (DMClone())");
  const bool jacobian = sdm->ops->computejacobian == SNESTSFormJacobian; /* asked before SNESSetFunction(), which frees what the DM has shared with another one */
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

/* Of several TS a SNES serves the one that steps. Before its matrices and its line search are looked at: those of the other one's choice are nobody's. */
PetscErrorCode HooksTakeOver(TS ts, SNES snes)
{
  PetscFunctionBegin;
  if (snes->ops->converged == SNESConverged_HHT && snes->cnvP != (void *)ts) PetscCall(HooksRemove((TS)snes->cnvP));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* At set-up */
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
    if (snes->lagjacobian != 1) I.corrector.user_lag = PETSC_TRUE; /* or the program asked for it */
    if (!I.corrector.user_lag) PetscCall(SNESSetLagJacobian(snes, -2));
  }
  DM dm;
  PetscCall(SNESGetDM(snes, &dm));
  PetscCall(DMSNESGetJacobian(dm, &H.dm_jacobian, &H.dm_jacobian_ctx));
  if (!TestIsOurs(ts, snes)) PetscCall(InstallTest(ts, snes));
  PetscCall(OptionGiven((PetscObject)snes, "-snes_check_jacobian_domain_error", &given));
  if (!given) PetscCall(SNESSetCheckJacobianDomainError(snes, PETSC_TRUE)); /* FormJacobian() says so of a singular matrix */
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

/* SNES asks the DM for its functions: where two solvers have one DM, those that were set last serve both (Hooks.TwoSolversOnOneDM) */
PetscErrorCode HooksBorrowDM(TS ts)
{
  Hooks                                &H = Get(ts).hooks;
  DM                                    dm;
  DMSNES                                sdm;
  void                                 *ctx;
  decltype(_DMSNESOps::computefunction) f;

  PetscFunctionBegin;
  if (ts->snes != H.snes) PetscFunctionReturn(PETSC_SUCCESS); /* functions of ours are put into another one */
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
  PetscCall(ForgetTheirs(H)); /* of a step that has ended in an error */
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
  if (!H.borrowed) { /* another solver on the DM that has no Jacobian would ask ours for its own */
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
  if (H.line_search && !H.snes && ts->snes) PetscCall(RemoveLineSearch(ts, ts->snes)); /* options were read, nothing set up */
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
