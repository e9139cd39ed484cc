/* The public setters and getters. They call functions composed with the TS (setters.cpp), which is PETSc's way for
   types that may be plugins: on a TS of another type the setters do nothing, and the getters raise an error. */
#include "integrator/compat.h"
#include "hhtdae/hhtdae.h"

/*@
  TSHHT3SetForm - Chooses how `TSHHT3` averages inertia forces over a step

  Logically Collective

  Input Parameters:
+ ts   - the `TS` context
- form - `TSHHT3_FORM_SECOND_ORDER` (default) or `TSHHT3_FORM_PAPER`

  Options Database Key:
. -ts_hhtdae_form <paper,second_order> - the form

  Level: intermediate

  Notes:
  The paper's form (9a) divides M q'' at t_{n+1} by 1+alpha and averages all other forces between both ends of
  the step. Where M depends on q and alpha is not 0, this form is of first order. The second-order form satisfies the
  equations of motion at t_{n+1} and averages an algorithmic acceleration. For constant M and constant steps both give
  the same positions. The accelerations of the paper's form are of first order, and so are its positions at variable
  steps.

.seealso: `TSHHT3`, `TSHHT3SetAlpha()`, `TSHHT3SetRadius()`
@*/
PetscErrorCode TSHHT3SetForm(TS ts, TSHHT3Form form)
{
  PetscFunctionBegin;
  PetscValidHeaderSpecific(ts, TS_CLASSID, 1);
  PetscTryMethod(ts, "TSHHT3SetForm_C", (TS, TSHHT3Form), (ts, form));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*@
  TSHHT3GetForm - The form set by `TSHHT3SetForm()`

  Not Collective

  Input Parameter:
. ts - the `TS` context

  Output Parameter:
. form - the form

  Level: intermediate

.seealso: `TSHHT3`, `TSHHT3SetForm()`
@*/
PetscErrorCode TSHHT3GetForm(TS ts, TSHHT3Form *form)
{
  PetscFunctionBegin;
  PetscValidHeaderSpecific(ts, TS_CLASSID, 1);
  PetscAssertPointer(form, 2);
  PetscUseMethod(ts, "TSHHT3GetForm_C", (TS, TSHHT3Form *), (ts, form));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*@
  TSHHT3SetAlpha - Sets the numerical damping of `TSHHT3`

  Logically Collective

  Input Parameters:
+ ts    - the `TS` context
- alpha - in [-1/3, 0], default -0.3; gamma = (1 - 2 alpha)/2 and beta = (1 - alpha)^2/4, (5) of the paper

  Options Database Key:
. -ts_hhtdae_alpha <alpha> - the parameter

  Level: beginner

  Notes:
  alpha = 0 is the trapezoidal rule, without damping and weakly unstable on constrained systems. The smaller
  alpha, the stronger the damping of high frequencies: the spectral radius at infinity is (1+alpha)/(1-alpha). A value
  outside the range is an error.

.seealso: `TSHHT3`, `TSHHT3GetAlpha()`, `TSHHT3SetRadius()`
@*/
PetscErrorCode TSHHT3SetAlpha(TS ts, PetscReal alpha)
{
  PetscFunctionBegin;
  PetscValidHeaderSpecific(ts, TS_CLASSID, 1);
  PetscValidLogicalCollectiveReal(ts, alpha, 2);
  PetscTryMethod(ts, "TSHHT3SetAlpha_C", (TS, PetscReal), (ts, alpha));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*@
  TSHHT3GetAlpha - The parameter set by `TSHHT3SetAlpha()`

  Not Collective

  Input Parameter:
. ts - the `TS` context

  Output Parameter:
. alpha - the parameter; -alpha_f if a spectral radius was set

  Level: intermediate

.seealso: `TSHHT3`, `TSHHT3SetAlpha()`
@*/
PetscErrorCode TSHHT3GetAlpha(TS ts, PetscReal *alpha)
{
  PetscFunctionBegin;
  PetscValidHeaderSpecific(ts, TS_CLASSID, 1);
  PetscAssertPointer(alpha, 2);
  PetscUseMethod(ts, "TSHHT3GetAlpha_C", (TS, PetscReal *), (ts, alpha));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*@
  TSHHT3SetRadius - Sets the spectral radius at infinite frequency, with the parameters of Chung and Hulbert (1993)

  Logically Collective

  Input Parameters:
+ ts  - the `TS` context
- rho - in [0, 1]; 0 annihilates the highest frequencies in a step, 1 damps nothing

  Options Database Key:
. -ts_hhtdae_radius <rho> - the radius

  Level: intermediate

  Note:
  alpha_m = (2 rho - 1)/(rho + 1), alpha_f = rho/(rho + 1). The radius requires the second-order form and replaces alpha.

.seealso: `TSHHT3`, `TSHHT3SetAlpha()`, `TSHHT3SetForm()`
@*/
PetscErrorCode TSHHT3SetRadius(TS ts, PetscReal rho)
{
  PetscFunctionBegin;
  PetscValidHeaderSpecific(ts, TS_CLASSID, 1);
  PetscValidLogicalCollectiveReal(ts, rho, 2);
  PetscTryMethod(ts, "TSHHT3SetRadius_C", (TS, PetscReal), (ts, rho));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*@
  TSHHT3SetOrder - Sets the order of `TSHHT3`, or lets it be chosen in each step

  Logically Collective, before `TSSetUp()`

  Input Parameters:
+ ts    - the `TS` context
- order - 2 to 5, or `TSHHT3_ORDER_AUTO`

  Options Database Key:
. -ts_hhtdae_order <2,3,4,5,auto> - the order

  Level: intermediate

  Notes:
  Order 2, the default, is HHT. Orders 3 to 5 are backward differentiation of positions and of velocities over
  variable steps. They have the same unknowns and the same matrix, with other beta and gamma. The first steps, also
  those after events and other restarts, are of order 2; the order then rises as the history grows. A step whose
  correction fails is repeated with order 2.

  `TSHHT3_ORDER_AUTO` chooses in each step the order that allows the longest next step, as long as scaled differences of
  the positions decrease with their order. If they do not, the motion contains a frequency omega with h omega near or
  above one, for which orders above 2 are unstable at small damping: HHT is then used for a number of steps. A fixed
  order of 3 or more has no such guard: it suits smooth or well damped motion only.

  In smooth motion positions and velocities converge with the order k, and so do accelerations and multipliers at
  constant steps. This holds if error control chooses the first steps; first steps of a given length, which are of order
  2, leave an error of h^3. After a change of h the error of accelerations and multipliers is one order lower for k
  steps. Accelerations and multipliers do not enter the error test.

  Orders above 2 need the second-order form. With local rotation vectors (`TSHHT3SetRotations()`) order k needs the
  attitudes of the last k steps to lie within half a turn, so that the order is lower for fast spins.

.seealso: `TSHHT3`, `TSHHT3GetOrder()`, `TSHHT3SetAlpha()`, `TSHHT3GetStatistics()`
@*/
PetscErrorCode TSHHT3SetOrder(TS ts, PetscInt order)
{
  PetscFunctionBegin;
  PetscValidHeaderSpecific(ts, TS_CLASSID, 1);
  PetscValidLogicalCollectiveInt(ts, order, 2);
  PetscTryMethod(ts, "TSHHT3SetOrder_C", (TS, PetscInt), (ts, order));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*@
  TSHHT3GetOrder - The order set by `TSHHT3SetOrder()`

  Not Collective

  Input Parameter:
. ts - the `TS` context

  Output Parameter:
. order - 2 to 5, or `TSHHT3_ORDER_AUTO`

  Level: intermediate

.seealso: `TSHHT3`, `TSHHT3SetOrder()`
@*/
PetscErrorCode TSHHT3GetOrder(TS ts, PetscInt *order)
{
  PetscFunctionBegin;
  PetscValidHeaderSpecific(ts, TS_CLASSID, 1);
  PetscAssertPointer(order, 2);
  PetscUseMethod(ts, "TSHHT3GetOrder_C", (TS, PetscInt *), (ts, order));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*@
  TSHHT3SetCorrectorTolerance - Sets where the Newton iteration of a step stops

  Logically Collective

  Input Parameters:
+ ts - the `TS` context
- c  - error left by the iteration in units of the tolerance of a step, in (0, 1), default 0.001 and less for constrained systems
       with little damping; (41b) of the paper

  Options Database Key:
. -ts_hhtdae_corrector_tolerance <c> - the tolerance

  Level: advanced

  Notes:
  The error that the iteration leaves in q excites an oscillation of the multipliers, which grows by a factor of
  1/(1-rho)^2 before it decays, where rho = (1+alpha)/(1-alpha). Unless c is set, a system with constraints therefore
  takes 0.001 min(1, ((1-rho)/(1-rho_0))^2), where rho_0 is the rho of alpha = -0.05: 1.7e-4 at alpha = -0.02, 4.3e-5 at
  -0.01, and at least 1e-8. -ts_view shows the value.

  If c is set it is used unchanged.

.seealso: `TSHHT3`, `TSSetTolerances()`
@*/
PetscErrorCode TSHHT3SetCorrectorTolerance(TS ts, PetscReal c)
{
  PetscFunctionBegin;
  PetscValidHeaderSpecific(ts, TS_CLASSID, 1);
  PetscValidLogicalCollectiveReal(ts, c, 2);
  PetscTryMethod(ts, "TSHHT3SetCorrectorTolerance_C", (TS, PetscReal), (ts, c));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*@
  TSHHT3SetPredictorDegree - Sets the degree of the polynomial that predicts the unknowns of a step

  Logically Collective

  Input Parameters:
+ ts     - the `TS` context
- degree - 0 to 3, or -1 (default): in each step the degree that would have predicted the last step
           best, at most 3 or, above order two, the largest order

  Options Database Key:
. -ts_hhtdae_predictor_degree <degree> - the degree

  Level: advanced

.seealso: `TSHHT3`
@*/
PetscErrorCode TSHHT3SetPredictorDegree(TS ts, PetscInt degree)
{
  PetscFunctionBegin;
  PetscValidHeaderSpecific(ts, TS_CLASSID, 1);
  PetscValidLogicalCollectiveInt(ts, degree, 2);
  PetscTryMethod(ts, "TSHHT3SetPredictorDegree_C", (TS, PetscInt), (ts, degree));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*@
  TSHHT3SetReuse - Sets when a new Newton matrix is made

  Logically Collective

  Input Parameters:
+ ts    - the `TS` context
. ratio - factor by which h may differ from the h of the matrix, at least 1, default 1.4
. rate  - rate of convergence above which the next step gets a new matrix; 0 makes one in every step; default 0.25, or 0.1 with hhtconstraint
- hold  - h stays as it is if it could grow by less than this factor, so that the factorization can be reused; at least 1, default 1.2

  Options Database Key:
. -ts_hhtdae_reuse <ratio,rate,hold> - the three numbers

  Level: advanced

  Note:
  A correction that fails with an old matrix is repeated once with a new one before h is reduced.
  -snes_lag_jacobian, if given, replaces these rules.

.seealso: `TSHHT3`, `SNESSetLagJacobian()`
@*/
PetscErrorCode TSHHT3SetReuse(TS ts, PetscReal ratio, PetscReal rate, PetscReal hold)
{
  PetscFunctionBegin;
  PetscValidHeaderSpecific(ts, TS_CLASSID, 1);
  PetscValidLogicalCollectiveReal(ts, ratio, 2);
  PetscValidLogicalCollectiveReal(ts, rate, 3);
  PetscValidLogicalCollectiveReal(ts, hold, 4);
  PetscTryMethod(ts, "TSHHT3SetReuse_C", (TS, PetscReal, PetscReal, PetscReal), (ts, ratio, rate, hold));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*@
  TSHHT3SetIS - Sets the unknowns that have a role

  Collective

  Input Parameters:
+ ts   - the `TS` context
. role - the role, see `TSHHT3Role`
- is   - global indices of the unknowns in U that have it, each on the rank that owns it; `NULL` removes an earlier set

  Level: intermediate

  Notes:
  Row i of the residual is the equation of unknown i. Unknowns that are in no index set are coordinates. If no
  index set is given at all the roles are detected from dF/dU, dF/dU' and dF/dU'' at the start. `TSSetUp()` raises an
  error for overlapping sets, indices that the rank does not own, rows of constraints that depend on accelerations, and
  rows of holonomic constraints that depend on velocities; it evaluates the residual three times to find such rows.

.seealso: `TSHHT3`, `TSHHT3GetIS()`
@*/
PetscErrorCode TSHHT3SetIS(TS ts, TSHHT3Role role, IS is)
{
  PetscFunctionBegin;
  PetscValidHeaderSpecific(ts, TS_CLASSID, 1);
  if (is) {
    PetscValidHeaderSpecific(is, IS_CLASSID, 3);
    PetscCheckSameComm(ts, 1, is, 3);
  }
  PetscTryMethod(ts, "TSHHT3SetIS_C", (TS, TSHHT3Role, IS), (ts, role, is));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*@
  TSHHT3GetIS - The unknowns that have a role, as set or, after `TSSetUp()`, as detected

  Not Collective

  Input Parameters:
+ ts   - the `TS` context
- role - the role

  Output Parameter:
. is - the indices; `NULL`, or without entries, if there are none. Owned by the `TS`

  Level: intermediate

.seealso: `TSHHT3`, `TSHHT3SetIS()`
@*/
PetscErrorCode TSHHT3GetIS(TS ts, TSHHT3Role role, IS *is)
{
  PetscFunctionBegin;
  PetscValidHeaderSpecific(ts, TS_CLASSID, 1);
  PetscAssertPointer(is, 3);
  PetscUseMethod(ts, "TSHHT3GetIS_C", (TS, TSHHT3Role, IS *), (ts, role, is));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*@
  TSHHT3SetStart - Sets what is done if initial positions and velocities violate the constraints

  Logically Collective

  Input Parameters:
+ ts    - the `TS` context
- start - `TSHHT3_START_OFF`, `TSHHT3_START_REPORT` (default) or `TSHHT3_START_PROJECT`

  Options Database Key:
. -ts_hhtdae_start <off,report,project> - the choice

  Level: intermediate

  Note:
  The violation is measured as the distance to the nearest consistent state in the metric of the mass matrix, in
  units of the tolerance. `TSHHT3_START_REPORT` prints it if it exceeds 1 at the start of a run, or 100 at a restart
  within the run, where velocities are consistent to the order of the method only; `TSHHT3_START_PROJECT` prints
  nothing. -info always shows it. Accelerations and multipliers are made consistent in any case.

  A restart from values that the integrator has computed (`TSRestartStep()`, events) projects the velocities, unless the
  choice is `TSHHT3_START_OFF`: the velocities of a step satisfy the constraints to second order only, which would
  excite oscillations of first order in the multipliers. If an event has added constraints, the projection is a plastic
  impact.

.seealso: `TSHHT3`, `TSRestartStep()`
@*/
PetscErrorCode TSHHT3SetStart(TS ts, TSHHT3Start start)
{
  PetscFunctionBegin;
  PetscValidHeaderSpecific(ts, TS_CLASSID, 1);
  PetscTryMethod(ts, "TSHHT3SetStart_C", (TS, TSHHT3Start), (ts, start));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*@
  TSHHT3GetAcceleration - The second time derivative of the coordinates at the present time

  Not Collective

  Input Parameter:
. ts - the `TS` context

  Output Parameter:
. A - accelerations, zero for unknowns that are not coordinates; owned by the `TS`, not to be changed

  Level: intermediate

  Note:
  Multipliers, variables, force states are in the solution, `TSGetSolution()`; derivatives of states in the second vector of
  `TS2GetSolution()`. Valid from the first step on.

.seealso: `TSHHT3`, `TSHHT3Interpolate()`, `TS2GetSolution()`
@*/
PetscErrorCode TSHHT3GetAcceleration(TS ts, Vec *A)
{
  PetscFunctionBegin;
  PetscValidHeaderSpecific(ts, TS_CLASSID, 1);
  PetscAssertPointer(A, 2);
  PetscUseMethod(ts, "TSHHT3GetAcceleration_C", (TS, Vec *), (ts, A));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/*@
  TSHHT3Interpolate - Dense output within the last accepted step

  Collective

  Input Parameters:
+ ts - the `TS` context
- t  - a time between the ends of the last step

  Output Parameters:
+ U - coordinates, states, multipliers, variables and force states, or `NULL`
. V - velocities and derivatives of states, or `NULL`
- A - accelerations, or `NULL`

  Level: intermediate

  Notes:
  At both ends of the step the result is bitwise that of the step.

  Within a step of order two coordinates, velocities and states are cubic Hermite polynomials; accelerations,
  derivatives of states, multipliers, variables and force states are linear. The linear interpolation is accurate only
  if the step is short; `TSHHT3EvaluateAt()` solves for these values instead.

  Within a step of order k above two (`TSHHT3SetOrder()`) all of them are polynomials of degree k through values at the
  ends of the last steps. For accelerations, derivatives of states, multipliers, variables and force states the degree
  is lower where their history is shorter.

.seealso: `TSHHT3`, `TSHHT3EvaluateAt()`, `TSInterpolate()`, `TSHHT3GetAcceleration()`
@*/
PetscErrorCode TSHHT3Interpolate(TS ts, PetscReal t, Vec U, Vec V, Vec A)
{
  PetscFunctionBegin;
  PetscValidHeaderSpecific(ts, TS_CLASSID, 1);
  PetscUseMethod(ts, "TSHHT3Interpolate_C", (TS, PetscReal, Vec, Vec, Vec), (ts, t, U, V, A));
  PetscFunctionReturn(PETSC_SUCCESS);
}
