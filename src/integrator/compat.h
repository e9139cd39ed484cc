/* The differences between PETSc 3.18 and later releases, in one place. */
#ifndef HHTDAE_COMPAT_H
#define HHTDAE_COMPAT_H

#include <algorithm>
#include <initializer_list>
#include <petsc/private/snesimpl.h>
#include <petsc/private/tsimpl.h>
#include <vector>

#if PETSC_VERSION_LT(3, 19, 0)
  #define PETSC_SUCCESS 0
#endif

#if PETSC_VERSION_LT(3, 20, 0)
  #define PetscAssertPointer(p, arg) PetscValidPointer(p, arg)
#endif

#if PETSC_VERSION_LT(3, 21, 0)
  #define SNESLineSearchShellSetApply SNESLineSearchShellSetUserFunc
  #define SNESLineSearchShellGetApply SNESLineSearchShellGetUserFunc
#endif

/* setfromoptions() takes the options object by pointer until 3.22, by value since */
#if PETSC_VERSION_LT(3, 23, 0)
typedef PetscOptionItems *HHT3OptionItems;
#else
typedef PetscOptionItems HHT3OptionItems;
#endif

#if PETSC_VERSION_LT(3, 22, 0)
  #define HHT3_INT_MAX PETSC_MAX_INT
#else
  #define HHT3_INT_MAX PETSC_INT_MAX
#endif

/* Of max_snes_failures: any negative number before */
#if PETSC_VERSION_LT(3, 22, 0)
  #define HHT3_UNLIMITED (-1)
#else
  #define HHT3_UNLIMITED PETSC_UNLIMITED
#endif

/* MatFDColoringSetFunction() took a function of no particular type */
#if PETSC_VERSION_LT(3, 24, 0)
typedef PetscErrorCode (*HHT3ColoringFunction)(void);
#else
typedef MatFDColoringFn *HHT3ColoringFunction;
#endif

/* An error unless the PETSc that runs is one that this library was built for; version.cpp */
PetscErrorCode HHT3CheckPetscVersion(void);

/* The first point after t that a step has to end at with TS_EXACTFINALTIME_MATCHSTEP: of a time span, or the final time */
static inline PetscReal HHT3StopAfter(TS ts, PetscReal t)
{
  const PetscReal  least = t + 16 * PETSC_MACHINE_EPSILON * PetscAbsReal(t);
  PetscInt         n = 0, k = 0;
  const PetscReal *point = NULL;
#if PETSC_VERSION_LT(3, 23, 0)
  if (ts->tspan) n = ts->tspan->num_span_times, k = ts->tspan->spanctr, point = ts->tspan->span_times;
#else
  if (ts->eval_times) n = ts->eval_times->num_time_points, k = ts->eval_times->time_point_idx, point = ts->eval_times->time_points;
#endif
  while (k < n && point[k] <= least) k++;
  return k < n ? point[k] : ts->max_time;
}

/* Points of a time span that a run has behind it where it begins or is resumed, so that TSAdaptChoose() does not aim at them. Their solutions are not known to it: not a number
   (Checkpoint.ResumesInATimeSpan, BetweenRuns.BeginInATimeSpan) */
static inline PetscErrorCode HHT3PassStops(TS ts, PetscBool *passed)
{
  PetscFunctionBegin;
  *passed = PETSC_FALSE;
#if PETSC_VERSION_LT(3, 23, 0)
  if (!ts->tspan) PetscFunctionReturn(PETSC_SUCCESS);
  for (PetscInt &k = ts->tspan->spanctr; k < ts->tspan->num_span_times && ts->tspan->span_times[k] <= ts->ptime; k++) {
    *passed = PETSC_TRUE;
    if (!ts->tspan->vecs_sol) continue;
    if (ts->tspan->span_times[k] == ts->ptime) PetscCall(VecCopy(ts->vec_sol, ts->tspan->vecs_sol[k]));
    else PetscCall(VecSet(ts->tspan->vecs_sol[k], NAN));
  }
#else
  if (!ts->eval_times) PetscFunctionReturn(PETSC_SUCCESS);
  for (PetscInt &k = ts->eval_times->time_point_idx; k < ts->eval_times->num_time_points && ts->eval_times->time_points[k] <= ts->ptime; k++) *passed = PETSC_TRUE;
#endif
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Since 3.21 TSRollBack() restores the solution from a copy made at the beginning of the step: it has to follow a change of
   coordinates of vec_sol within the step */
static inline PetscErrorCode HHT3KeepForRollBack(TS ts)
{
  PetscFunctionBegin;
#if PETSC_VERSION_GE(3, 21, 0)
  if (ts->vec_sol0) PetscCall(VecCopy(ts->vec_sol, ts->vec_sol0));
#else
  (void)ts;
#endif
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Whether TSEvent is bracketing a zero, and so sets the steps itself */
static inline PetscBool HHT3EventActive(TS ts)
{
#if PETSC_VERSION_LT(3, 21, 0)
  return (PetscBool)(ts->event && ts->event->status != TSEVENT_NONE);
#else
  return (PetscBool)(ts->event && ts->event->processing);
#endif
}

/* Whether the step to come is the first one behind an event. Where it ends at the final time TSEvent takes that for the place of any zero within it: it looks for it with a step of what is
   left until then, which is nothing */
static inline PetscBool HHT3BehindEvent(TS ts)
{
#if PETSC_VERSION_LT(3, 21, 0)
  return (PetscBool)(ts->event && ts->event->status == TSEVENT_RESET_NEXTSTEP);
#else
  (void)ts;
  return PETSC_FALSE;
#endif
}

/* Whether an event has been located at the present time, and whether it is a zero of this function */
static inline bool HHT3IsLocated(TS ts) { return ts->event && ts->event->recorder.ctr > 0 && ts->event->recorder.time[ts->event->recorder.ctr - 1] == ts->ptime; }
static inline bool HHT3IsLocated(TS ts, PetscInt event)
{
  if (!HHT3IsLocated(ts)) return false;
  const auto    &r = ts->event->recorder;
  const PetscInt k = r.ctr - 1;
  return std::find(r.eventidx[k], r.eventidx[k] + r.nevents[k], event) != r.eventidx[k] + r.nevents[k];
}

/* Behind an event a zero that was located counts as one, if the function is still what it was there: within a long step TSEvent ends its search by the length of the interval, on the near side and
   beyond the tolerance, and would count the same zero again as soon as it is passed (Events.ForcesThatAreTurned) */
static inline void HHT3TakeLocatedForZero(TS ts)
{
#if PETSC_VERSION_LT(3, 21, 0)
  TSEvent e = ts->event;
  for (PetscInt i = 0; i < e->nevents; i++)
    if (HHT3IsLocated(ts, i) && PetscAbsScalar(e->fvalue_prev[i] - e->fvalue_right[i]) < e->vtol[i]) e->fvalue_prev[i] = 0;
#else
  (void)ts;
#endif
}

/* The functions whose zeros TSEvent looks for */
static inline PetscErrorCode HHT3EventFunctions(TS ts, PetscReal t, Vec U, std::vector<PetscScalar> &f)
{
  PetscErrorCode failed;

  PetscFunctionBegin;
  f.resize(ts->event->nevents);
  PetscCall(VecLockReadPush(U));
#if PETSC_VERSION_LT(3, 21, 0)
  failed = (*ts->event->eventhandler)(ts, t, U, f.data(), ts->event->ctx);
#else
  std::vector<PetscReal> real(f.size());
  failed = (*ts->event->indicator)(ts, t, U, real.data(), ts->event->ctx);
  std::copy(real.begin(), real.end(), f.begin());
#endif
  PetscCall(VecLockReadPop(U));
  PetscCall(failed);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* After the steps to an event TSEvent goes on with the step that it was begun with, unless the user sets another one: with h, where it is one of those that nobody has set */
static inline void HHT3StepAfterEvent(TS ts, std::initializer_list<PetscReal> unset, PetscReal h)
{
#if PETSC_VERSION_LT(3, 21, 0)
  if (!ts->event || (ts->event->status != TSEVENT_NONE && !HHT3BehindEvent(ts))) return;
  PetscReal &after = ts->event->timestep_posteventinterval;
  if (std::find(unset.begin(), unset.end(), after) != unset.end()) after = h;
#else
  (void)ts, (void)unset, (void)h;
#endif
}

#endif
