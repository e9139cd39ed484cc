/*
  A start in the middle of a transient that is over long before the first step ends: strong damping holds what moves. The consistent q''_0
  is that of the transient, and (2) takes a part of h^2 of it into q_1, far beyond rest: with h a hundred time constants, more than the way
  of the whole transient. Where the error test lets that pass it leaves velocities that are far larger than those of the motion,
  which nothing takes back where they have turned bodies that nothing damps.

  What the transient leaves of the velocities follows from the equations of motion, with constraints differentiated as for every start,
  for q' = q'_0 + h q'' and q = q_0 + h q' in place of q'_0 and q_0, with h ten and a hundred time constants: the implicit Euler method, which damps
  what is faster than h. Slower motion has the same accelerations in both, and their difference tells the velocities that go. The run starts at the same time
  and place without these, if the way that they would have gone is less than the tolerance: a transient that moves bodies farther is
  resolved. That it was one shows in its accelerations, which are gone; those of an oscillation would be as before.
*/
#include "integrator/equations/equations.h"
#include "integrator/step/estimate.h"
#include "start.h"
#include "integrator/work_vec.h"

namespace hht3
{

namespace
{

constexpr PetscReal step_in_time_constants = 10;   /* time constants of the implicit step, in which the motion goes on */
constexpr PetscReal noticeable_velocity    = 1e-6; /* part of the velocities, at rest of the tolerance: what is left of a transient grows with h in the first steps */
constexpr PetscReal second_step_ratio      = 10;   /* times that: the second step */
constexpr PetscReal damped_accelerations   = 0.5;  /* part of its accelerations that this step leaves of a transient: an eleventh. Of rounding it leaves all. */
constexpr PetscReal opposing_cosine        = 0.5;  /* cosine of the angle between what accelerations are and what they lose */

/* The time constant |q''|/|q'''| of what may be a transient: within a tenth of the step accelerations change by more than they are. 0: none.
   What starts at rest may have large rates where damping spreads a load that has just set in, as over a body of finite elements: there they are not
   against the accelerations, and three matrices are saved. */
PetscErrorCode TimeConstant(TS ts, PetscReal h, Vec rate, PetscReal *tau)
{
  Integrator &I = Get(ts);
  PetscReal   v, a, j;
  PetscScalar aj, aa;
  WorkVec     weighted;

  PetscFunctionBegin;
  PetscCall(CorrectionNorm(ts, I.V0, 1, &v));
  PetscCall(CorrectionNorm(ts, I.A0, 1, &a));
  PetscCall(CorrectionNorm(ts, rate, 1, &j));
  *tau = a > 0 && h * j > step_in_time_constants * a && h * h * j > noticeable_velocity * (v > 0 ? v : 1 / h) ? a / j : 0;
  if (*tau <= 0 || v > 0) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(weighted.like(I.A0));
  PetscCall(WeightCorrection(I, I.A0, weighted));
  PetscCall(VecDot(I.A0, weighted, &aa));
  PetscCall(VecDot(rate, weighted, &aj));
  if (*tau * -PetscRealPart(aj) < opposing_cosine * PetscRealPart(aa)) *tau = 0;
  PetscFunctionReturn(PETSC_SUCCESS);
}

} // namespace

PetscErrorCode RemoveTransient(TS ts, PetscReal h, Vec rate, Prepared &have, PetscReal *tau, PetscBool *leaves)
{
  Integrator &I = Get(ts);
  PetscReal   before, after, way;
  WorkVec     gone;

  PetscFunctionBegin;
  *leaves = PETSC_FALSE;
  PetscCall(TimeConstant(ts, h, rate, tau));
  if (*tau <= 0) PetscFunctionReturn(PETSC_SUCCESS);
  const PetscReal euler = step_in_time_constants * *tau;
  PetscCall(gone.like(I.V0));
  PetscCall(ConsistentAccelerations(ts, ts->ptime, euler, I.U0, I.V0, have, leaves));
  PetscCall(VecNorm(I.A0, NORM_2, &before));
  PetscCall(VecNorm(I.A1, NORM_2, &after));
  if (after >= damped_accelerations * before) *leaves = PETSC_FALSE;
  if (*leaves) {
    PetscCall(VecCopy(I.A1, gone));
    PetscCall(ConsistentAccelerations(ts, ts->ptime, second_step_ratio * euler, I.U0, I.V0, have, leaves));
    PetscCall(VecAXPY(gone, -1, I.A1));
    PetscCall(VecScale(gone, euler / (1 - 1 / second_step_ratio)));
    PetscCall(CorrectionNorm(ts, gone, 1, &way));
    way *= *tau / PetscAbsReal(I.p.k); /* of velocities that decay with this time constant, in tolerances of positions */
    if (!(way < 1)) *leaves = PETSC_FALSE;
  }
  if (*leaves) PetscCall(VecAXPY(I.V0, 1, gone));
  else PetscCall(VecCopy(I.X0, I.X));
  PetscFunctionReturn(PETSC_SUCCESS);
}

} // namespace hht3
