/*
  The implementations of the setters and getters of api.cpp, and ComposeSetters(), which composes them with the TS.
*/
#include "integrator/coordinates/change.h"
#include "integrator/checkpoint/checkpoint.h"
#include "integrator/step/dense.h"
#include "integrator/step/estimate.h"
#include "integrator/step/step.h"
#include "integrator/coordinates/rotations.h"
#include "integrator/equations/rows.h"
#include "integrator/start/start.h"
#include "settings.h"
#include "linear/linear.h"

namespace hht3
{

PetscErrorCode NotAfterSetUp(TS ts, const char *what)
{
  PetscFunctionBegin;
  PetscCheck(!ts->setupcalled, PetscObjectComm((PetscObject)ts), PETSC_ERR_ARG_WRONGSTATE, "%s must be set before TSSetUp() or TSSolve(); TSReset() allows it again", what);
  PetscFunctionReturn(PETSC_SUCCESS);
}

namespace
{

PetscErrorCode SetForm(TS ts, TSHHT3Form form)
{
  PetscFunctionBegin;
  PetscCheck(form == TSHHT3_FORM_PAPER || form == TSHHT3_FORM_SECOND_ORDER, PetscObjectComm((PetscObject)ts), PETSC_ERR_ARG_OUTOFRANGE, "Unknown form %d", (int)form);
  if (form != Get(ts).form) PetscCall(NotAfterSetUp(ts, "The form of the method"));
  Get(ts).form = form;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode GetForm(TS ts, TSHHT3Form *form)
{
  PetscFunctionBegin;
  *form = Get(ts).form;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SetAlpha(TS ts, PetscReal alpha)
{
  PetscFunctionBegin;
  PetscCheck(alpha >= (PetscReal)-1 / 3 - 1e-12 && alpha <= 0, PetscObjectComm((PetscObject)ts), PETSC_ERR_ARG_OUTOFRANGE, "alpha = %g is not in [-1/3, 0]", (double)alpha);
  if (alpha != Get(ts).alpha || Get(ts).radius >= 0) PetscCall(NotAfterSetUp(ts, "alpha"));
  Get(ts).alpha  = alpha;
  Get(ts).radius = -1;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode GetAlpha(TS ts, PetscReal *alpha)
{
  PetscFunctionBegin;
  *alpha = Get(ts).radius < 0 ? Get(ts).alpha : -RadiusParameters(Get(ts).radius).af;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SetRadius(TS ts, PetscReal rho)
{
  PetscFunctionBegin;
  PetscCheck(rho >= 0 && rho <= 1, PetscObjectComm((PetscObject)ts), PETSC_ERR_ARG_OUTOFRANGE, "Spectral radius %g is not in [0, 1]", (double)rho);
  if (rho != Get(ts).radius) PetscCall(NotAfterSetUp(ts, "The spectral radius"));
  Get(ts).radius = rho;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SetOrder(TS ts, PetscInt order)
{
  PetscFunctionBegin;
  PetscCheck(order == TSHHT3_ORDER_AUTO || (order >= 2 && order <= max_order), PetscObjectComm((PetscObject)ts), PETSC_ERR_ARG_OUTOFRANGE,
             "Order %" PetscInt_FMT " is neither TSHHT3_ORDER_AUTO nor in 2..%" PetscInt_FMT, order, max_order);
  if (order != Get(ts).order.wanted) PetscCall(NotAfterSetUp(ts, "The order"));
  Get(ts).order.wanted = order;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode GetOrder(TS ts, PetscInt *order)
{
  PetscFunctionBegin;
  *order = Get(ts).order.wanted;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SetCorrectorTolerance(TS ts, PetscReal c)
{
  PetscFunctionBegin;
  PetscCheck(c > 0 && c < 1, PetscObjectComm((PetscObject)ts), PETSC_ERR_ARG_OUTOFRANGE, "Corrector tolerance %g is not in (0, 1)", (double)c);
  Get(ts).corrector.c       = c;
  Get(ts).corrector.c_given = PETSC_TRUE;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SetPredictorDegree(TS ts, PetscInt degree)
{
  Predictor      &p     = Get(ts).predictor;
  const PetscBool fixed = (PetscBool)(degree >= 0);
  const PetscInt  most  = fixed ? degree : default_degree;

  PetscFunctionBegin;
  PetscCheck(degree >= -1 && degree <= default_degree, PetscObjectComm((PetscObject)ts), PETSC_ERR_ARG_OUTOFRANGE, "Predictor degree %" PetscInt_FMT " is not in -1..%" PetscInt_FMT, degree, default_degree);
  if (fixed != p.fixed || (fixed && most != p.degree_max)) PetscCall(NotAfterSetUp(ts, "The degree of the predictor"));
  p.fixed = fixed;
  if (fixed || !ts->setupcalled) p.degree_max = most; /* after the set-up a degree that is not fixed has the limit of SetUpOrder() */
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SetReuse(TS ts, PetscReal ratio, PetscReal rate, PetscReal hold)
{
  Corrector &c = Get(ts).corrector;

  PetscFunctionBegin;
  PetscCheck(ratio >= 1 && rate >= 0 && hold >= 1, PetscObjectComm((PetscObject)ts), PETSC_ERR_ARG_OUTOFRANGE,
             "Reuse of the matrix: ratio %g and hold %g must be at least 1, rate %g at least 0", (double)ratio, (double)hold, (double)rate);
  c.ratio     = ratio;
  c.slow_rate = rate;
  c.hold      = hold;
  c.given     = PETSC_TRUE;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SetIS(TS ts, TSHHT3Role role, IS is)
{
  Integrator &I = Get(ts);

  PetscFunctionBegin;
  PetscCheck(role >= 0 && role < TSHHT3_NUM_ROLES, PetscObjectComm((PetscObject)ts), PETSC_ERR_ARG_OUTOFRANGE, "Unknown role %d", (int)role);
  PetscCall(NotAfterSetUp(ts, "The roles of unknowns"));
  PetscCall(PetscObjectReference((PetscObject)is));
  PetscCall(ISDestroy(&I.is[role]));
  I.is[role] = is;
  I.is_set   = PETSC_FALSE;
  for (IS set : I.is) I.is_set = (PetscBool)(I.is_set || set);
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode GetIS(TS ts, TSHHT3Role role, IS *is)
{
  PetscFunctionBegin;
  PetscCheck(role >= 0 && role < TSHHT3_NUM_ROLES, PetscObjectComm((PetscObject)ts), PETSC_ERR_ARG_OUTOFRANGE, "Unknown role %d", (int)role);
  *is = Get(ts).is[role];
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode SetStart(TS ts, TSHHT3Start start)
{
  PetscFunctionBegin;
  PetscCheck(start >= TSHHT3_START_OFF && start <= TSHHT3_START_PROJECT, PetscObjectComm((PetscObject)ts), PETSC_ERR_ARG_OUTOFRANGE, "Unknown start %d", (int)start);
  Get(ts).start_policy = start;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* What SetStart() has set; "TSHHT3GetStart_C" for what simulates a start */
PetscErrorCode GetStart(TS ts, TSHHT3Start *start)
{
  PetscFunctionBegin;
  *start = Get(ts).start_policy;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode GetAcceleration(TS ts, Vec *A)
{
  Integrator &I = Get(ts);

  PetscFunctionBegin;
  PetscCheck(I.have_step || I.stat.restarts, PetscObjectComm((PetscObject)ts), PETSC_ERR_ARG_WRONGSTATE, "There are no accelerations before the first step");
  *A = I.have_step ? I.A1 : I.A0;
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode GetStatistics(TS ts, TSHHT3Statistics *s)
{
  Integrator &I = Get(ts);

  PetscFunctionBegin;
  StopClocks(I, ts->reason != TS_CONVERGED_ITERATING);
  *s = I.stat;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* For libraries beside this one, whose messages name constraints that depend on one another */
PetscErrorCode NameDependent(TS, Mat P, IS multipliers, PetscReal tolerance, PetscInt max, PetscInt *n, PetscInt rows[])
{
  PetscFunctionBegin;
  PetscCall(LinearNameDependent(P, multipliers, tolerance, max, n, rows));
  PetscFunctionReturn(PETSC_SUCCESS);
}

} // namespace

PetscErrorCode ComposeSetters(TS ts, bool attach)
{
  PetscFunctionBegin;
#define HHT3_COMPOSE(name) PetscCall(PetscObjectComposeFunction((PetscObject)ts, "TSHHT3" #name "_C", attach ? name : NULL))
  HHT3_COMPOSE(SetForm);
  HHT3_COMPOSE(GetForm);
  HHT3_COMPOSE(SetAlpha);
  HHT3_COMPOSE(GetAlpha);
  HHT3_COMPOSE(SetRadius);
  HHT3_COMPOSE(SetOrder);
  HHT3_COMPOSE(GetOrder);
  HHT3_COMPOSE(SetCorrectorTolerance);
  HHT3_COMPOSE(SetPredictorDegree);
  HHT3_COMPOSE(SetReuse);
  HHT3_COMPOSE(SetIS);
  HHT3_COMPOSE(GetIS);
  HHT3_COMPOSE(SetStart);
  HHT3_COMPOSE(GetStart);
  HHT3_COMPOSE(GetAcceleration);
  HHT3_COMPOSE(GetStatistics);
  HHT3_COMPOSE(Interpolate);
  HHT3_COMPOSE(EvaluateAt);
  HHT3_COMPOSE(EvaluatePresent);
  HHT3_COMPOSE(NoteChange);
  HHT3_COMPOSE(NameDependent);
  HHT3_COMPOSE(CheckpointSave);
  HHT3_COMPOSE(CheckpointLoad);
  HHT3_COMPOSE(ReadCheckpoint);
  HHT3_COMPOSE(SetCheckpointVec);
  HHT3_COMPOSE(SetCoordinateChange);
  HHT3_COMPOSE(SetRotations);
  HHT3_COMPOSE(GetRotationFactor);
  HHT3_COMPOSE(SetStepLimit);
  HHT3_COMPOSE(SetRowName);
#undef HHT3_COMPOSE
  PetscFunctionReturn(PETSC_SUCCESS);
}

} // namespace hht3
