/*
  What a step must not skip. Bodies that fly towards each other: none may be through the other at its end. Angles over full turns: it
  must not turn them so far that the turns cannot be told. Local rotation vectors: no body may turn so far that their series ends too
  soon. In free flight the error estimate finds nothing to object to, whatever the length of the step.
*/
#include "runtime.h"
#include <limits>

namespace hhtdae
{

namespace
{

constexpr double farthest = 1; /* of a body's rotation in a step, rad: the series of a rotation vector (rotation.h) is cut, and the error estimate knows its next term */

/* By elements */
PetscErrorCode LimitOfBatches(Runtime &R, PetscReal t, Vec U, Vec V, Vec A, double *least)
{
  const double       *u, *v, *a, *local[3];
  std::vector<double> acceleration;
  PetscFunctionBegin;
  PetscCall(VecGetArrayRead(U, &u));
  PetscCall(VecGetArrayRead(V, &v));
  PetscCall(VecGetArrayRead(A, &a));
  PetscCall(LocalMotion(R, u, v, a, acceleration, local));
  if (R.moved != R.bodies.moves) R.bodies.move(local[0], local[1]); /* else they have just been asked what to remember of this state */
  const Evaluation e{t, local[0], local[1], local[2], R.bodies, R.n};
  for (const auto &b : R.batches) *least = std::min(*least, b->longestStep(e));
  PetscCall(VecRestoreArrayRead(U, &u));
  PetscCall(VecRestoreArrayRead(V, &v));
  PetscCall(VecRestoreArrayRead(A, &a));
  PetscFunctionReturn(0);
}

PetscErrorCode LimitOfTurns(const Runtime &R, Vec V, double *least)
{
  const double *v;
  double        fastest = 0;
  PetscFunctionBegin;
  if (!R.turns || !R.bodies.local) PetscFunctionReturn(0);
  PetscCall(VecGetArrayRead(V, &v));
  for (PetscInt b = 0; b < R.bodies.own; b++) {
    const LocalBody &k = R.bodies.body[b];
    if (TurnsInSpace(k.kind)) fastest = std::max(fastest, Eigen::Map<const Vector3>(v + k.first + 3).norm());
  }
  PetscCall(VecRestoreArrayRead(V, &v));
  if (fastest > farthest / *least) *least = farthest / fastest; /* *least may be the largest number */
  PetscFunctionReturn(0);
}

PetscErrorCode Limit(TS, PetscReal t, Vec U, Vec V, Vec A, PetscReal *h, void *ctx)
{
  Runtime &R     = *static_cast<Runtime *>(ctx);
  double   least = *h;
  PetscFunctionBegin;
  if (R.steps_limited) PetscCall(LimitOfBatches(R, t, U, V, A, &least));
  PetscCall(LimitOfTurns(R, V, &least));
  if (R.size > 1) PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &least, 1, MPI_DOUBLE, MPI_MIN, R.scene.comm));
  *h = least;
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
  if (any || (R.turns && R.bodies.local)) PetscCall(TSHHT3SetStepLimit(ts, Limit, &R));
  PetscFunctionReturn(0);
}

} // namespace hhtdae
