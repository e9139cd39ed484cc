/*
  Checks whether a file belongs to the run. It compares sizes, roles and method, and the residual at the state in the
  file with accelerations other than those of the state, at which the residual would be zero for any problem.
*/
#include "checkpoint_parts.h"
#include "integrator/step/corrector.h"
#include "integrator/entries.h"
#include "integrator/equations/equations.h"
#include "linear/hash.h"
#include "integrator/equations/rows.h"
#include "integrator/work_vec.h"

namespace hht3
{

namespace
{

/* Difference of two residuals at the state in the file, relative to the largest entry, above which they belong to
   different problems; rounding on another machine is far smaller. */
constexpr PetscReal residual_mismatch = 1e-11;

} // namespace

PetscErrorCode IdentifyRun(TS ts, Identity *id)
{
  Integrator &I = Get(ts);

  PetscFunctionBegin;
  std::memset(id, 0, sizeof(*id));
  PetscCall(VecGetSize(ts->vec_sol, &id->N));
  PetscCall(VecGetLocalSize(ts->vec_sol, &id->n));
  if (I.checkpoint_vec) {
    PetscCall(VecGetSize(I.checkpoint_vec, &id->extra));
    PetscCall(VecGetLocalSize(I.checkpoint_vec, &id->extra_n));
  }
  id->form  = I.form;
  id->p     = I.hht;
  id->order = I.order.max;
  id->roles = Hash().add(I.role.data(), I.role.size()).sum;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode CheckIdentity(TS ts, const char file[], const Identity &was)
{
  Identity   is;
  bool       same;
  MPI_Comm   comm = PetscObjectComm((PetscObject)ts);
  const auto form = [](PetscInt f) { return TSHHT3Forms[f == TSHHT3_FORM_PAPER ? 0 : 1]; };

  PetscFunctionBegin;
  PetscCall(IdentifyRun(ts, &is));
  PetscCheck(was.N == is.N, comm, PETSC_ERR_FILE_UNEXPECTED, "Checkpoint %s has %" PetscInt_FMT " unknowns, the problem %" PetscInt_FMT, file, was.N, is.N);
  PetscCheck(was.form == is.form && was.p.beta == is.p.beta && was.p.am == is.p.am && was.p.af == is.p.af, comm, PETSC_ERR_FILE_UNEXPECTED,
             "Checkpoint %s was written with form %s and alpha_f = %g, the run has %s and %g: give the same options", file, form(was.form), (double)was.p.af,
             form(is.form), (double)is.p.af);
  PetscCheck(was.order == is.order, comm, PETSC_ERR_FILE_UNEXPECTED, "Checkpoint %s was written with order up to %" PetscInt_FMT ", the run has %" PetscInt_FMT ": give the same -ts_hhtdae_order", file, was.order, is.order);
  PetscCall(OnAllRanks(ts, was.n == is.n && was.roles == is.roles, &same));
  PetscCheck(same, comm, PETSC_ERR_FILE_UNEXPECTED,
             "Checkpoint %s belongs to another problem: its unknowns have other roles, or are divided among the ranks in another way", file);
  PetscCall(OnAllRanks(ts, was.extra == is.extra && was.extra_n == is.extra_n, &same));
  PetscCheck(same, comm, PETSC_ERR_FILE_UNEXPECTED,
             "Checkpoint %s has %" PetscInt_FMT " entries of the application's own, the run expects %" PetscInt_FMT ", or has them on other ranks: give TSHHT3SetCheckpointVec() the vector of the run that wrote it",
             file, was.extra, is.extra);
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode OptionsInWords(TS ts, std::string *text)
{
  const Integrator       &I = Get(ts);
  const CorrectorOptions &c = I.corrector;
  KSP                     ksp;
  PC                      pc;
  TSAdaptType             adapt;
  SNESType                snes;
  KSPType                 method;
  PCType                  preconditioner;
  MatSolverType           package = NULL;
  char                    words[512];

  PetscFunctionBegin;
  PetscCall(SNESGetKSP(ts->snes, &ksp));
  PetscCall(KSPGetPC(ksp, &pc));
  PetscCall(TSAdaptGetType(ts->adapt, &adapt));
  PetscCall(SNESGetType(ts->snes, &snes));
  PetscCall(LinearUsersMethod(ksp, I.linear, &method));
  PetscCall(PCGetType(pc, &preconditioner));
  if (I.linear.user_package) PetscCall(PCFactorGetMatSolverType(pc, &package));
  PetscCall(PetscSNPrintf(words, sizeof(words), "rtol %g%s, atol %g%s, adapt %s, corrector %g, %" PetscInt_FMT " iterations, reuse %g,%g,%g%s, predictor %" PetscInt_FMT "%s, %s, %s, %s%s%s",
                          (double)ts->rtol, ts->vrtol ? " by entries" : "", (double)ts->atol, ts->vatol ? " by entries" : "", adapt ? adapt : "none", (double)CorrectorTolerance(I),
                          c.max_it, (double)c.ratio, (double)c.slow_rate, (double)c.hold, c.user_lag ? " by the user" : "", I.predictor.degree_max, I.predictor.fixed ? " fixed" : "",
                          snes ? snes : "", method ? method : "", I.linear.user_pc && preconditioner ? preconditioner : "own solver", package ? " of " : "", package ? package : ""));
  *text = words;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode TellingResidual(TS ts, Vec F)
{
  Integrator            &I     = Get(ts);
  const TSHHT3Statistics saved = I.stat;
  WorkVec                A;

  PetscFunctionBegin;
  PetscCall(A.like(I.A1));
  PetscCall(VecCopy(I.A1, A));
  PetscCall(VecScale(A, 2));
  PetscCall(VecShift(A, 1));
  PetscCall(EvaluateResidual(ts, I.t1, I.U1, I.V1, A, F));
  I.stat = saved;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode CheckTellingResidual(TS ts, const char file[], Vec was, Vec is)
{
  PetscReal   scale;
  PetscScalar there, here;
  PetscInt    row;
  RowLabel    label;

  PetscFunctionBegin;
  PetscCall(LargestOf([](PetscInt, PetscScalar x) { return PetscIsInfOrNanScalar(x) ? 0 : PetscAbsScalar(x); }, &scale, Read(was)));
  PetscCall(FirstWhere(
    [=](PetscInt, PetscScalar x, PetscScalar y) { return !(PetscIsInfOrNanScalar(x) && PetscIsInfOrNanScalar(y)) && !(PetscAbsScalar(x - y) <= residual_mismatch * scale); }, &row,
    Read(was), Read(is)));
  if (row < 0) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(EntryOf(was, row, &there));
  PetscCall(EntryOf(is, row, &here));
  PetscCall(LabelRow(ts, row, &label));
  SETERRQ(PetscObjectComm((PetscObject)ts), PETSC_ERR_FILE_UNEXPECTED,
          "Checkpoint %s belongs to another problem: in its state the residual of row %s was %g, in this run it is %g. Resume the problem that wrote it; "
          "what its residual depends on besides the state has to be in the vector of TSHHT3SetCheckpointVec()",
          file, label.text, (double)PetscRealPart(there), (double)PetscRealPart(here));
}

} // namespace hht3
