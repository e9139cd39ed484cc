/*
  What a step must not skip. Bodies that fly towards each other: none may be through the other at its end. Angles over full turns: it
  must not turn them so far that the turns cannot be told. In free flight the error estimate finds nothing to object to, whatever the
  length of the step.
*/
#include "runtime.h"
#include <limits>

namespace hhtdae
{

namespace
{

PetscErrorCode Limit(TS, PetscReal t, Vec U, Vec V, Vec A, PetscReal *h, void *ctx)
{
  Runtime            &R = *static_cast<Runtime *>(ctx);
  const double       *u, *v, *a, *local[3];
  std::vector<double> acceleration;
  double              least = *h;
  PetscFunctionBegin;
  PetscCall(VecGetArrayRead(U, &u));
  PetscCall(VecGetArrayRead(V, &v));
  PetscCall(VecGetArrayRead(A, &a));
  PetscCall(LocalMotion(R, u, v, a, acceleration, local));
  R.bodies.move(local[0], local[1]);
  const Evaluation e{t, local[0], local[1], local[2], R.bodies, R.n};
  for (const auto &b : R.batches) least = std::min(least, b->longestStep(e));
  PetscCall(VecRestoreArrayRead(U, &u));
  PetscCall(VecRestoreArrayRead(V, &v));
  PetscCall(VecRestoreArrayRead(A, &a));
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
  if (any) PetscCall(TSHHT3SetStepLimit(ts, Limit, &R));
  PetscFunctionReturn(0);
}

} // namespace hhtdae
