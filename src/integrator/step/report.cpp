/* The summary line (-ts_hhtdae_summary) and the progress line (-ts_hhtdae_progress) of a run. Both are TS monitors. */
#include "step.h"
#include <chrono>
#include <ctime>

namespace hht3
{

namespace
{

PetscReal WallTime() { return std::chrono::duration<PetscReal>(std::chrono::steady_clock::now().time_since_epoch()).count(); }
PetscReal ProcessorTime() { return (PetscReal)std::clock() / CLOCKS_PER_SEC; }

} // namespace

/* The statistics contain the time that the run has taken before, in an earlier TSSolve() or in the process that wrote its checkpoint */
void StartClocks(Integrator &I)
{
  if (I.timed) return;
  I.wall0 = WallTime() - I.stat.time;
  I.cpu0  = ProcessorTime() - I.stat.cpu;
  I.timed = PETSC_TRUE;
}

void StopClocks(Integrator &I, bool stop)
{
  if (!I.timed) return;
  I.stat.time = WallTime() - I.wall0;
  I.stat.cpu  = ProcessorTime() - I.cpu0;
  I.timed     = (PetscBool)!stop;
}

/* Prints when TSSolve() calls its monitors the last time, which is with the reason set */
PetscErrorCode MonitorSummary(TS ts, PetscInt step, PetscReal, Vec, void *)
{
  PetscFunctionBegin;
  if (ts->ops->step != TSStep_HHT || !ts->reason || step < 0) PetscFunctionReturn(PETSC_SUCCESS);
  Integrator             &I = Get(ts);
  const TSHHT3Statistics &s = I.stat;
  StopClocks(I, true);
  PetscCall(PetscPrintf(PetscObjectComm((PetscObject)ts),
                        "summary: steps=%" PetscInt_FMT " rejected=%" PetscInt_FMT " newton=%" PetscInt_FMT " residuals=%" PetscInt_FMT
                        " jacobians=%" PetscInt_FMT " factorizations=%" PetscInt_FMT " solves=%" PetscInt_FMT " time=%.6g cpu=%.6g fails=%" PetscInt_FMT
                        " retries=%" PetscInt_FMT " restarts=%" PetscInt_FMT " tiny=%" PetscInt_FMT " h_min=%.3g h_max=%.3g form=%s alpha=%g reason=%s",
                        s.steps, s.rejected, s.newton, s.residuals, s.jacobians, s.factorizations, s.solves, (double)s.time, (double)s.cpu,
                        s.corrector_fails, s.retries, s.restarts, s.tiny_steps, (double)s.h_min, (double)s.h_max, TSHHT3Forms[I.form],
                        (double)(I.radius < 0 ? I.alpha : -I.hht.af), TSConvergedReasons[ts->reason]));
  if (s.changes) PetscCall(PetscPrintf(PetscObjectComm((PetscObject)ts), " changes=%" PetscInt_FMT, s.changes));
  PetscCall(PetscPrintf(PetscObjectComm((PetscObject)ts), "\n"));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* One line, rewritten four times a second, with the time that the rest of the run takes at its average rate */
PetscErrorCode MonitorProgress(TS ts, PetscInt step, PetscReal t, Vec, void *)
{
  FILE *out = PETSC_STDERR;

  PetscFunctionBegin;
  if (ts->ops->step != TSStep_HHT || step < 0) PetscFunctionReturn(PETSC_SUCCESS); /* the TS may be of another type by now */
  Integrator &I = Get(ts);
  const PetscReal now = WallTime();
  if (!ts->steps) PetscFunctionReturn(PETSC_SUCCESS);
  if (!ts->reason && now - I.progress_last < 0.25) PetscFunctionReturn(PETSC_SUCCESS);
  I.progress_last          = now;
  const PetscReal      spent = I.timed ? now - I.wall0 : I.stat.time;
  const PetscReal      done  = t - I.t_begin;
  const PetscReal      rate  = spent > 0 ? done / spent : 0;
  const PetscReal      left  = rate > 0 && ts->max_time < PETSC_MAX_REAL / 2 ? (ts->max_time - t) / rate : 0;
  PetscCall(PetscFPrintf(PetscObjectComm((PetscObject)ts), out, "\rt = %-12.6g h = %-10.3e step %-9" PetscInt_FMT " %.3e of time per second, %.0f s left   %s", (double)t, (double)I.h, step, (double)rate,
                         (double)PetscMax(left, 0), ts->reason ? "\n" : ""));
  if (!ts->reason) (void)fflush(out);
  PetscFunctionReturn(PETSC_SUCCESS);
}

} // namespace hht3

/*@
  TSHHT3GetStatistics - The counters of a `TSHHT3` run

  Not Collective

  Input Parameter:
. ts - the `TS` context

  Output Parameter:
. statistics - the cumulative counters since the first step, see `TSHHT3Statistics`

  Options Database Key:
. -ts_hhtdae_summary - print them as one line of key=value pairs at the end of `TSSolve()`

  Level: intermediate

  Note:
  Residuals, Jacobians, factorizations and solves are those of starts and steps. Not counted are evaluations at set-up, which find the roles of the unknowns (ten Jacobians; none after
  `TSHHT3SetIS()` in the second-order form) and what constraints depend on, those of checkpoints, and those of samples between steps, `TSHHT3EvaluateAt()`. The events TSFunctionEval and
  TSJacobianEval of -log_view contain them all.

.seealso: `TSHHT3`, `TSGetStepRejections()`, `TSGetSNESIterations()`
@*/
PetscErrorCode TSHHT3GetStatistics(TS ts, TSHHT3Statistics *statistics)
{
  PetscFunctionBegin;
  PetscValidHeaderSpecific(ts, TS_CLASSID, 1);
  PetscAssertPointer(statistics, 2);
  PetscUseMethod(ts, "TSHHT3GetStatistics_C", (TS, TSHHT3Statistics *), (ts, statistics));
  PetscFunctionReturn(PETSC_SUCCESS);
}
