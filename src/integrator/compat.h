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

/* The value of max_snes_failures that means no limit: before 3.22 any negative number */
#if PETSC_VERSION_LT(3, 22, 0)
  #define HHT3_UNLIMITED (-1)
#else
  #define HHT3_UNLIMITED PETSC_UNLIMITED
#endif

/* The type of function that MatFDColoringSetFunction() takes: before 3.24 a pointer to functions of any kind */
#if PETSC_VERSION_LT(3, 24, 0)
typedef PetscErrorCode (*HHT3ColoringFunction)(void);
#else
typedef MatFDColoringFn *HHT3ColoringFunction;
#endif

/* An error unless the PETSc that is loaded is one for which this library was built; version.cpp */
PetscErrorCode HHT3CheckPetscVersion(void);

/* The first time after t at which a step has to end with TS_EXACTFINALTIME_MATCHSTEP: a point of a time span, or the final time */
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

/* Marks the points of a time span that lie before the time at which a run begins or is resumed as passed, so that TSAdaptChoose()
   does not aim at them. Solutions at these points are not known and set to NAN (Checkpoint.ResumesInATimeSpan,
   BetweenRuns.BeginInATimeSpan). *passed: there are such points. */
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

/* Since 3.21 TSRollBack() restores the solution from a copy made at the beginning of the step. If the coordinates of vec_sol change within the
   step, so must the copy. */
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

/* Whether the next step is the first one after an event. It must not end at the final time: TSEvent would look for a zero within it
   with a step of the time left until then, which is zero. */
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

/* After an event, sets the functions whose zeros were located to zero, if they still have the values that they had there. Within a
   long step TSEvent ends its search by the length of the interval, before the zero and with a value above the tolerance, and would
   find the same zero again as soon as it is passed (Events.ForcesThatAreTurned). */
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

/* Evaluates the functions whose zeros TSEvent looks for */
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

/* After an event TSEvent goes on with the step size with which it was initialized, unless the user has set
   another one. Replaces this size by h if it is among `unset`, the values that no user has set. */
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
