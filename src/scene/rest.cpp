/* A state at rest out of the unknowns back into the description of the scene, on every rank. */
#include "extension.h"
#include "start.h"
#include <algorithm>

namespace hhtdae
{

namespace
{

/* The deformation of flexible bodies, from their owners to every rank */
PetscErrorCode WriteBackModes(Runtime &R, const PetscScalar *u)
{
  SceneData &s = R.scene;
  PetscFunctionBegin;
  for (std::size_t b = 0; b < s.bodies.size(); b++) {
    if (!s.bodies[b].flexible) continue;
    auto              f     = std::make_shared<FlexibleData>(*s.bodies[b].flexible);
    const PetscMPIInt owner = R.number.owner.empty() ? 0 : R.number.owner[b];
    if (owner == R.rank) {
      const PetscScalar *eta = u + R.number.body[b] - R.start + 6;
      std::copy(eta, eta + f->deformation.size(), f->deformation.begin());
    }
    PetscCallMPI(MPI_Bcast(f->deformation.data(), (PetscMPIInt)f->deformation.size(), MPI_DOUBLE, owner, s.comm));
    std::fill(f->deformation_rate.begin(), f->deformation_rate.end(), 0.0);
    s.bodies[b].flexible = f;
  }
  PetscFunctionReturn(0);
}

} // namespace

PetscErrorCode WriteRest(Runtime &R, Vec U)
{
  SceneData               &s     = R.scene;
  const int                width = 13; /* body, position, attitude */
  const PetscScalar       *u;
  const double            *local[3];
  std::vector<double>      mine, all, v(R.n, 0.0);
  std::vector<PetscMPIInt> count(R.size), from(R.size + 1, 0);
  PetscFunctionBegin;
  PetscCall(VecGetArrayRead(U, &u));
  PetscCall(LocalState(R, u, v.data(), v.data(), local));
  R.bodies.move(local[0], local[1]);
  for (PetscInt b = 0; b < R.bodies.own; b++) {
    const BodyMotion &m = R.bodies.now[b];
    mine.push_back((double)R.bodies.body[b].id);
    mine.insert(mine.end(), m.r.data(), m.r.data() + 3);
    const BodyKind kind  = R.bodies.body[b].kind;
    const bool     turns = HasEulerAngles(kind) || kind == BodyKind::Planar;
    const Matrix3  A     = turns ? m.A : s.bodies[R.bodies.body[b].id].A;
    mine.insert(mine.end(), A.data(), A.data() + 9);
  }
  std::vector<double> scalars(s.variables.size() + s.states.size(), 0), sum(scalars.size());
  for (std::size_t i = 0; i < s.variables.size(); i++)
    if (R.number.variable_owner[i] == R.rank) scalars[i] = u[R.number.variable[i] - R.start];
  for (std::size_t i = 0; i < s.states.size(); i++)
    if (R.number.state_owner[i] == R.rank) scalars[s.variables.size() + i] = u[R.number.state[i] - R.start];
  PetscCall(WriteBackModes(R, u));
  for (auto &x : s.extensions) x->rest(u + x->start[R.rank] - R.start);
  PetscCall(VecRestoreArrayRead(U, &u));
  const PetscMPIInt n = (PetscMPIInt)mine.size();
  PetscCallMPI(MPI_Allgather(&n, 1, MPI_INT, count.data(), 1, MPI_INT, s.comm));
  for (PetscMPIInt r = 0; r < R.size; r++) from[r + 1] = from[r] + count[r];
  all.resize(from[R.size]);
  PetscCallMPI(MPI_Allgatherv(mine.data(), n, MPI_DOUBLE, all.data(), count.data(), from.data(), MPI_DOUBLE, s.comm));
  for (std::size_t k = 0; k < all.size(); k += width) {
    BodyData &b = s.bodies[(std::size_t)all[k]];
    b.r         = Eigen::Map<const Vector3>(&all[k + 1]);
    b.A         = Eigen::Map<const Matrix3>(&all[k + 4]);
    b.v.setZero();
    b.w.setZero();
  }
  if (!sum.empty())
    PetscCallMPI(MPI_Allreduce(scalars.data(), sum.data(), (PetscMPIInt)sum.size(), MPI_DOUBLE, MPI_SUM, s.comm));
  for (std::size_t i = 0; i < s.variables.size(); i++) s.variables[i].initial = sum[i];
  for (std::size_t i = 0; i < s.states.size(); i++) s.states[i].initial = sum[s.variables.size() + i];
  PetscFunctionReturn(0);
}

} // namespace hhtdae
