/*
  How fast loads and motions are that depend on time alone. Velocities tell the time scale of what moves. Of what is at rest they tell nothing, and the
  length of the run is no measure for a load of 100 Hz in a run of 100 s: differences over parts of it meet whole periods, and so does a first step.

  The residual is sampled at t + tau with everything else as it is, for ever shorter parts tau of the run. A row follows time within the shortest tau
  up to which it changes by a tenth of its largest change from one sample to the next: of sin(w t) 0.08/w to 0.6/w. (From t itself a load that
  sets in there would change within nothing.)
*/
#include "consistent.h"
#include "integrator/entries.h"
#include "integrator/equations/equations.h"
#include "start.h"
#include "integrator/work_vec.h"

namespace hht3
{

namespace
{

/* The first sample's part of what is left of the run, and a sample's of the one before: powers of the golden section, since simple fractions meet whole
   periods one after the other (Excitation.ManyFrequencies) */
constexpr PetscReal first_sample      = 0.618034, sample_ratio = 0.236068;
constexpr PetscReal noticeable_change = 0.1;   /* of a row's largest change */
constexpr int       min_samples       = 9, max_samples = 60; /* samples */
constexpr int       quiet_samples     = 3;       /* samples in a row in which nothing changes any more: one of them may meet a whole period */
constexpr PetscReal falling_ratio     = 0.5;     /* and each of them less than this times the one before: several may, in a run of 10^9 periods (Units.MotionsInLongRuns) */
constexpr int       changes_of_swing  = 4;     /* noticeable changes of what swings all along the run; of a ramp there are fewer (Excitation.UnfollowedIsTold) */
/* Changes within the first samples alone, longer than this part of what is left of the run, are those of a ramp, which tell of no time but that: at least so much of it, or what was known before a restart
   shortly before the end (Events.ShortlyBeforeTheEnd) */
constexpr PetscReal ramp_spread    = 0.03, ramp_time = 1000;
constexpr PetscReal steps_of_swing = 30;    /* steps in units of what is found of a swing, 0.08/w to 0.6/w: fewer than three a period */

/* Of the largest change of any row of its kind: less may be what rounding leaves of loads that cancel, with lever arms of up to 1e6 (Excitation.OfLoadsThatCancel) */
constexpr PetscReal cancelled_change = 1e-9;

/* What is found of a row's changes with time */
struct Changes {
  WorkVec   largest, number;
  Vec       shortest = nullptr; /* I.excitation */
  PetscReal of_kind[TSHHT3_NUM_ROLES] = {};
};

PetscErrorCode NoteLargest(const Integrator &I, Vec before, Vec after, Changes &c)
{
  PetscReal most[TSHHT3_NUM_ROLES] = {};

  PetscFunctionBegin;
  PetscCall(ForEntries(
    [&](PetscInt i, PetscScalar f0, PetscScalar f) {
      const PetscReal change = PetscAbsScalar(f - f0);
      if (change > most[RoleOf(I, i)] && change < PETSC_MAX_REAL) most[RoleOf(I, i)] = change;
    },
    Read(before), Read(after)));
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, most, TSHHT3_NUM_ROLES, MPIU_REAL, MPIU_MAX, PetscObjectComm((PetscObject)before)));
  for (int r = 0; r < TSHHT3_NUM_ROLES; r++) c.of_kind[r] = PetscMax(c.of_kind[r], most[r]);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* From one sample to the next, at tau: each row's largest change so far, and tau where it changes noticeably; the largest change of any row, as a part of its largest one */
PetscErrorCode NoteChanges(const Integrator &I, PetscReal tau, Vec before, Vec after, Changes &c, PetscReal *part)
{
  PetscReal most_of_all = 0;

  PetscFunctionBegin;
  PetscCall(NoteLargest(I, before, after, c));
  PetscCall(ForEntries(
    [&](PetscInt i, PetscScalar f0, PetscScalar f, PetscScalar &most, PetscScalar &number, PetscScalar &shortest) {
      const PetscReal change = PetscAbsScalar(f - f0);
      if (change <= cancelled_change * c.of_kind[RoleOf(I, i)]) return;
      if (change > most_of_all * PetscRealPart(most)) most_of_all = PetscRealPart(most) > 0 ? PetscMin(change / PetscRealPart(most), 1) : 1;
      if (!(change > noticeable_change * PetscRealPart(most))) return; /* also for what is not a number beyond the end of a table */
      most     = PetscMax(change, PetscRealPart(most));
      shortest = tau;
      number += 1;
    },
    Read(before), Read(after), Write(c.largest), Write(c.number), Write(c.shortest)));
  PetscCallMPI(MPI_Allreduce(&most_of_all, part, 1, MPIU_REAL, MPIU_MAX, PetscObjectComm((PetscObject)before)));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* At U0, V0, t_n: the time within which each row follows time, sought up to `stop` from there, PETSC_MAX_REAL where it does not depend on it. Of ramps it is `of_ramps`, and at least
   what is `known` of a row. Returned, too: the least of those that change all along. */
PetscErrorCode FollowTime(TS ts, PetscReal stop, PetscReal of_ramps, Vec known, Vec within, PetscReal *swing)
{
  Integrator     &I    = Get(ts);
  const PetscReal step = ts->time_step != unset_step && ts->time_step > 0 ? ts->time_step : PETSC_MAX_REAL; /* of the user's, and those later: what it may follow is looked for */
  WorkVec         zero, F[2];
  Changes         c;
  PetscReal       least = PETSC_MAX_REAL, part = 1, last;

  PetscFunctionBegin;
  for (WorkVec *v : {&zero, &F[0], &F[1], &c.largest, &c.number}) PetscCall(v->like(I.U0));
  c.shortest = within;
  PetscCall(VecSet(within, PETSC_MAX_REAL));
  PetscCall(EvaluateResidual(ts, ts->ptime + first_sample * stop, I.U0, I.V0, zero, F[0]));
  PetscReal tau = first_sample * stop;
  for (int sample = 1, still = 0; sample < min_samples || (sample < max_samples && (still < quiet_samples || (tau > step && step < stop))); sample++) {
    tau *= sample_ratio;
    PetscCall(EvaluateResidual(ts, ts->ptime + tau, I.U0, I.V0, zero, F[sample % 2]));
    last = part;
    PetscCall(NoteChanges(I, tau, F[0], F[1], c, &part));
    still = part > noticeable_change || (part > falling_ratio * last && part > PETSC_SQRT_MACHINE_EPSILON) ? 0 : still + 1;
  }
  PetscCall(ForEntries(
    [&](PetscInt, PetscScalar number, PetscScalar of_old, PetscScalar &T) {
      const PetscReal old = PetscRealPart(of_old) < PETSC_MAX_REAL ? PetscRealPart(of_old) : 0;
      if (PetscRealPart(number) > 0 && PetscRealPart(T) >= ramp_spread * stop) T = PetscMax(of_ramps, old);
    },
    Read(c.number), Read(known), Write(within)));
  PetscCall(ForEntries([&](PetscInt, PetscScalar number, PetscScalar T) { if (PetscRealPart(number) >= changes_of_swing) least = PetscMin(least, PetscRealPart(T)); }, Read(c.number), Read(within)));
  PetscCallMPI(MPI_Allreduce(&least, swing, 1, MPIU_REAL, MPIU_MIN, PetscObjectComm((PetscObject)ts)));
  PetscFunctionReturn(PETSC_SUCCESS);
}

} // namespace

/* I.excitation: the time within which each row follows time; none: no row does. In a run without end ramps are such as long as they have been looked at, and no longer
   (Analyses.KinematicsAfterVelocitiesNearZero). The velocities say how long that is, but may be those of another time, or nearly zero: what happens within the unit of time is looked for, too
   (the same test, and Analyses.KinematicsWhereAMotionHasStoodStill). */
PetscErrorCode FindExcitation(TS ts)
{
  Integrator     &I    = Get(ts);
  PetscReal       stop = ts->max_time - ts->ptime, swing;
  const bool      ends = ts->max_time < PETSC_MAX_REAL / 2 && stop > 0;
  WorkVec         before;

  PetscFunctionBegin;
  I.ahead = Ahead::Unknown;
  if (!ends) PetscCall(TimeScale(ts, &stop));
  PetscCall(before.like(I.U0));
  if (I.excitation && ts->ptime > I.t_begin) PetscCall(VecCopy(I.excitation, before));
  if (!I.excitation) PetscCall(VecDuplicate(I.U0, &I.excitation));
  PetscCall(FollowTime(ts, stop, ends ? ramp_time * stop : stop, before, I.excitation, &I.swing));
  if (!ends && stop > unit_of_time) {
    PetscCall(VecCopy(I.excitation, before));
    PetscCall(FollowTime(ts, unit_of_time, unit_of_time, before, I.excitation, &swing));
    PetscCall(VecPointwiseMin(I.excitation, I.excitation, before));
    I.swing = PetscMin(I.swing, swing);
  }
  PetscCall(VecMin(I.excitation, NULL, &I.fastest));
  if (I.fastest >= PETSC_MAX_REAL) PetscCall(VecDestroy(&I.excitation));
  else PetscCall(PetscInfo(ts, "start: loads or motions follow time within %g\n", (double)I.fastest));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* I.ahead: whether the rest of the run, from U and V at t, has loads or motions that set in, of which the start has seen nothing. Samples at multiples of the
   golden section, nowhere further apart than coasting of the run: of one that goes on, as many as what is new takes of it (BetweenRuns.SolvedInParts) */
PetscErrorCode LookAhead(TS ts, PetscReal t, Vec U, Vec V)
{
  constexpr int   most_samples = 89;
  Integrator     &I    = Get(ts);
  const PetscReal from = I.ahead == Ahead::Nothing ? PetscMax(t, I.ahead_to) : t;
  const PetscReal rest = ts->max_time - from, run = ts->max_time - (from > t ? I.t_begin : t);
  PetscReal       part = 0, change = 0;
  WorkVec         zero, now, then;

  PetscFunctionBegin;
  I.ahead    = Ahead::Nothing;
  I.ahead_to = ts->max_time;
  if (!(ts->max_time < PETSC_MAX_REAL / 2 && rest > 0)) PetscFunctionReturn(PETSC_SUCCESS); /* a run without end (Excitation.RunsWithoutEnd) */
  const int samples_ahead = (int)PetscMin(PetscCeilReal(most_samples * (rest / run)), most_samples);
  for (WorkVec *v : {&zero, &now, &then}) PetscCall(v->like(U));
  PetscCall(EvaluateResidual(ts, t, U, V, zero, now));
  for (int sample = 0; sample < samples_ahead && !(change > 0); sample++) {
    part = part + first_sample < 1 ? part + first_sample : part + first_sample - 1;
    PetscCall(EvaluateResidual(ts, samples_ahead > 1 ? from + part * rest : ts->max_time, U, V, zero, then));
    PetscCall(VecAXPY(then, -1, now));
    PetscCall(VecNorm(then, NORM_INFINITY, &change));
  }
  if (change > 0) I.ahead = Ahead::Loads;
  PetscCall(PetscInfo(ts, "%s loads or motions set in between t = %g and the end of the run\n", change > 0 ? "some" : "no", (double)t));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* After an accepted step: loads that swing faster than steps follow are said, once. Where positions move by less than the tolerance, the error test lets
   velocities that they leave pass. */
PetscErrorCode WarnOfUnfollowedLoads(TS ts)
{
  Integrator &I = Get(ts);

  PetscFunctionBegin;
  if (I.told || !(I.h / steps_of_swing > I.swing)) PetscFunctionReturn(PETSC_SUCCESS); /* swing may be the largest number, of which there is no multiple */
  I.told = PETSC_TRUE;
  PetscCall(PetscPrintf(PetscObjectComm((PetscObject)ts),
                        "hhtdae: the step of %g at t = %g does not follow loads or motions that depend on time alone, some of which swing within %.1g or so. Where they matter, "
                        "set a largest step (-ts_adapt_dt_max) or a smaller tolerance.\n",
                        (double)I.h, (double)I.t0, (double)(6 * I.swing)));
  PetscFunctionReturn(PETSC_SUCCESS);
}

} // namespace hht3
