/*
  Upper bounds on the next step, so that no contact is passed over, no counted angle turns by more than half a turn
  (Batch::longestStep()), and rotation vectors stay small enough for their truncated series. The error estimate does not
  ensure this, since it is zero in free flight for any step size.
*/
#include "runtime.h"
#include <limits>

namespace hhtdae
{

namespace
{

/* Largest rotation of a body in a step, rad: the integrator truncates Magnus' series of the rotation vector
   (src/integrator/coordinates/rotations.cpp), and the error estimate contains only the first neglected term */
constexpr double max_rotation_per_step = 1;

constexpr double radians_of_half_a_turn = M_PI, radians_of_longest_turn = 2; /* the latter: LongestTurn() */

/* Reduces *max_step to the upper bounds of the elements of this rank */
PetscErrorCode LimitOfElements(Runtime &R, PetscReal t, Vec U, Vec V, Vec A, const Horizon &horizon, double *max_step)
{
  const double       *u, *v, *a, *local[3];
  std::vector<double> acceleration;
  PetscFunctionBegin;
  PetscCall(VecGetArrayRead(U, &u));
  PetscCall(VecGetArrayRead(V, &v));
  PetscCall(VecGetArrayRead(A, &a));
  PetscCall(LocalMotion(R, u, v, a, acceleration, local));
  if (R.accepted_move != R.bodies.moves) R.bodies.move(local[0], local[1]); /* else the bodies are at this state already */
  const Evaluation e{t, local[0], local[1], local[2], R.bodies, R.n};
  for (const auto &b : R.batches) *max_step = std::min(*max_step, b->longestStep(e, horizon));
  PetscCall(VecRestoreArrayRead(U, &u));
  PetscCall(VecRestoreArrayRead(V, &v));
  PetscCall(VecRestoreArrayRead(A, &a));
  PetscFunctionReturn(0);
}

PetscErrorCode LimitOfRotations(const Runtime &R, Vec V, double *max_step)
{
  const double *v;
  double        fastest = 0;
  PetscFunctionBegin;
  if (!R.rotates_in_space || !R.bodies.local) PetscFunctionReturn(0);
  PetscCall(VecGetArrayRead(V, &v));
  for (PetscInt b = 0; b < R.bodies.own; b++) {
    const LocalBody &k = R.bodies.body[b];
    if (TurnsInSpace(k.kind)) fastest = std::max(fastest, Eigen::Map<const Vector3>(v + k.first + 3).norm());
  }
  PetscCall(VecRestoreArrayRead(V, &v));
  if (fastest > max_rotation_per_step / *max_step) *max_step = max_rotation_per_step / fastest; /* fastest times *max_step may overflow */
  PetscFunctionReturn(0);
}

PetscErrorCode Limit(TS ts, PetscReal t, Vec U, Vec V, Vec A, PetscReal *h, void *ctx)
{
  Runtime &R     = *static_cast<Runtime *>(ctx);
  double   max_step = *h;
  Horizon horizon;
  PetscFunctionBegin;
  PetscCall(TSGetTimeStep(ts, &horizon.time));
  PetscCall(TSGetTolerances(ts, &horizon.negligible, nullptr, nullptr, nullptr));
  if (R.steps_limited) PetscCall(LimitOfElements(R, t, U, V, A, horizon, &max_step));
  PetscCall(LimitOfRotations(R, V, &max_step));
  if (R.size > 1) PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &max_step, 1, MPI_DOUBLE, MPI_MIN, R.scene.comm));
  *h = max_step;
  PetscFunctionReturn(0);
}

} // namespace

PetscErrorCode AttachStepLimit(Runtime &R, TS ts)
{
  int any = 0;
  PetscFunctionBegin;
  for (const auto &b : R.batches) any |= b->limitsSteps();
  if (R.size > 1) PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &any, 1, MPI_INT, MPI_MAX, R.scene.comm));
  R.steps_limited = any;
  if (any || (R.rotates_in_space && R.bodies.local)) PetscCall(TSHHT3SetStepLimit(ts, Limit, &R));
  PetscFunctionReturn(0);
}

PetscErrorCode TellOfLostTurns(Runtime &R, TS ts, PetscReal h)
{
  TSAdapt   adapt;
  PetscBool fixed;
  PetscFunctionBegin;
  if (!R.has_memory || !R.steps_limited || R.told_of_lost_turns || h <= 0) PetscFunctionReturn(0);
  PetscCall(TSGetAdapt(ts, &adapt));
  PetscCall(PetscObjectTypeCompare((PetscObject)adapt, TSADAPTNONE, &fixed));
  if (!fixed) PetscFunctionReturn(0); /* else Limit() has bounded the step */
  const std::vector<double> zero(R.n + R.others.size(), 0.); /* accelerations: the speed alone says how far the step has turned */
  const Evaluation          e{0, zero.data(), zero.data(), zero.data(), R.bodies, R.n};
  double                    longest = std::numeric_limits<double>::infinity(), fastest = -1;
  PetscInt                  body    = -1;
  for (const auto &b : R.batches)
    if (b->memory()) longest = std::min(longest, b->longestStep(e, Horizon{0, 0})); /* no contacts are foreseen */
  if (h <= radians_of_half_a_turn / radians_of_longest_turn * longest) PetscFunctionReturn(0);
  R.told_of_lost_turns = true;
  for (std::size_t b = 0; b + 1 < R.bodies.body.size(); b++) {
    const double speed = R.bodies.now[b].w.norm();
    if (speed <= fastest) continue;
    fastest = speed;
    body    = R.bodies.body[b].id;
  }
  PetscCall(PetscPrintf(PETSC_COMM_SELF, "scene: fixed steps of %g are too long to count full turns: one has turned body %s by %.3g rad. Angles of channels, springs, gears and formulas lose turns where a step "
                        "turns them by more than half of one; take shorter steps, or those that the error chooses\n", (double)h, R.scene.bodyName(body).c_str(), fastest * (double)h));
  PetscFunctionReturn(0);
}

} // namespace hhtdae
