/* Scene::sample(): values of the channels at one time, without output files. */
#include "scene/guard.h"
#include "scene/output/channels.h"

namespace hhtdae
{

namespace
{

/* Gathers the ranks' own values; `values` has them in the order of the channels on every rank */
PetscErrorCode Share(const Runtime &R, const std::vector<double> &own, std::vector<double> &values)
{
  const std::vector<PetscMPIInt> &owner = ChannelOwners(R);
  std::vector<PetscMPIInt>        count(R.size, 0), first(R.size + 1, 0);
  std::vector<double>             all(owner.size());
  PetscFunctionBegin;
  for (PetscMPIInt r : owner) count[r]++;
  for (PetscMPIInt r = 0; r < R.size; r++) first[r + 1] = first[r] + count[r];
  PetscCallMPI(MPI_Allgatherv(own.data(), (PetscMPIInt)own.size(), MPI_DOUBLE, all.data(), count.data(), first.data(), MPI_DOUBLE, R.scene.comm));
  values.resize(owner.size());
  for (std::size_t c = 0; c < owner.size(); c++) values[c] = all[first[owner[c]]++];
  PetscFunctionReturn(0);
}

} // namespace

PetscErrorCode Scene::sample(TS ts, PetscReal t, std::vector<double> &values)
{
  Vec                 W[3];
  const double       *w[3], *local[3];
  std::vector<double> own, acceleration, parameters;
  PetscFunctionBegin;
  Runtime *run;
  TS       copy = nullptr; /* BeginCopy() of a run that has not begun, or whose constraints have been changed */
  PetscCall(FindRun(*this, ts, "Scene::sample()", &run));
  PetscCall(ReadCheckpoint(ts));
  for (Vec &x : W) {
    PetscCall(VecCreate(run->scene.comm, &x));
    PetscCall(VecSetSizes(x, run->n, PETSC_DETERMINE));
    PetscCall(VecSetType(x, VECSTANDARD));
  }
  PetscCall(StateAt(ts, t, ChannelsFollowFromEquations(*run), W, &copy));
  PetscCall(ParametersAt(*run, ts, t, &parameters));
  Runtime             &R = copy ? *RunOf(copy) : *run;
  const WithParameters then(R.scene, parameters);
  for (int k = 0; k < 3; k++) PetscCall(VecGetArrayRead(W[k], &w[k]));
  PetscCall(LocalMotion(R, w[0], w[1], w[2], acceleration, local));
  R.bodies.move(local[0], local[1]);
  PetscCall(Guarded([&] { return ChannelValues(R, Evaluation{t, local[0], local[1], local[2], R.bodies, R.n}, own); }));
  PetscCall(Share(R, own, values));
  for (int k = 0; k < 3; k++) {
    PetscCall(VecRestoreArrayRead(W[k], &w[k]));
    PetscCall(VecDestroy(&W[k]));
  }
  PetscCall(TSDestroy(&copy));
  PetscFunctionReturn(0);
}

} // namespace hhtdae
