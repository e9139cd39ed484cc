/* Writes the state of a run to the description of a scene, on every rank; used after equilibrium, and for runs that continue others. */
#include "extension.h"
#include "runtime.h"
#include "start.h"
#include <algorithm>

namespace hhtdae
{

namespace
{

/* Writes deformations of flexible bodies and their rates, which their owners send to all ranks */
PetscErrorCode WriteModes(Model &M, const Runtime &R, const PetscScalar *u, const PetscScalar *v)
{
  SceneData &s = M.scene;
  PetscFunctionBegin;
  for (std::size_t b = 0; b < s.bodies.size(); b++) {
    if (!s.bodies[b].flexible) continue;
    auto              f     = std::make_shared<FlexibleData>(*s.bodies[b].flexible);
    const PetscMPIInt owner = R.number.owner.empty() ? 0 : R.number.owner[b];
    if (owner == R.rank) {
      const PetscInt at = R.number.body[b] - R.start + 6;
      std::copy(u + at, u + at + f->deformation.size(), f->deformation.begin());
      std::copy(v + at, v + at + f->deformation.size(), f->deformation_rate.begin());
    }
    for (std::vector<double> *x : {&f->deformation, &f->deformation_rate}) PetscCallMPI(MPI_Bcast(x->data(), (PetscMPIInt)x->size(), MPI_DOUBLE, owner, s.comm));
    s.bodies[b].flexible = f;
  }
  PetscFunctionReturn(0);
}

} // namespace

PetscErrorCode WriteState(Model &M, Runtime &R, Vec U, Vec V)
{
  SceneData               &s     = M.scene;
  const int                width = 19; /* number of values per body: index, position, attitude, velocities */
  const PetscScalar       *u, *v;
  const double            *local[3];
  std::vector<double>      mine, all, rest(V ? 0 : R.n, 0.0);
  std::vector<PetscMPIInt> count(R.size), from(R.size + 1, 0);
  PetscFunctionBegin;
  PetscCall(VecGetArrayRead(U, &u));
  v = rest.data();
  if (V) PetscCall(VecGetArrayRead(V, &v));
  PetscCall(LocalState(R, u, v, v, local));
  R.bodies.move(local[0], local[1]);
  for (PetscInt b = 0; b < R.bodies.own; b++) {
    const BodyMotion &m = R.bodies.now[b];
    mine.push_back((double)R.bodies.body[b].id);
    mine.insert(mine.end(), m.r.data(), m.r.data() + 3);
    const BodyKind kind  = R.bodies.body[b].kind;
    const bool     rotates = TurnsInSpace(kind) || kind == BodyKind::Planar || kind == BodyKind::Attached;
    const Matrix3  A       = rotates ? m.A : s.bodies[R.bodies.body[b].id].A;
    mine.insert(mine.end(), A.data(), A.data() + 9);
    mine.insert(mine.end(), m.v.data(), m.v.data() + 3);
    mine.insert(mine.end(), m.w.data(), m.w.data() + 3);
  }
  std::vector<double> scalars(s.variables.size() + s.states.size(), 0), sum(scalars.size());
  for (std::size_t i = 0; i < s.variables.size(); i++)
    if (R.number.variable_owner[i] == R.rank) scalars[i] = u[R.number.variable[i] - R.start];
  for (std::size_t i = 0; i < s.states.size(); i++)
    if (R.number.state_owner[i] == R.rank) scalars[s.variables.size() + i] = u[R.number.state[i] - R.start];
  PetscCall(WriteModes(M, R, u, v));
  for (std::size_t x = 0; x < s.extensions.size(); x++) {
    const PetscInt at = R.scene.extensions[x]->start[R.rank] - R.start;
    s.extensions[x]->startFrom(u + at, v + at);
  }
  if (V) PetscCall(VecRestoreArrayRead(V, &v));
  PetscCall(VecRestoreArrayRead(U, &u));
  const PetscMPIInt n = (PetscMPIInt)mine.size();
  PetscCallMPI(MPI_Allgather(&n, 1, MPI_INT, count.data(), 1, MPI_INT, s.comm));
  for (PetscMPIInt r = 0; r < R.size; r++) from[r + 1] = from[r] + count[r];
  all.resize(from[R.size]);
  PetscCallMPI(MPI_Allgatherv(mine.data(), n, MPI_DOUBLE, all.data(), count.data(), from.data(), MPI_DOUBLE, s.comm));
  for (std::size_t k = 0; k < all.size(); k += width) {
    BodyData &b = s.bodies[(std::size_t)all[k]];
    b.A         = Eigen::Map<const Matrix3>(&all[k + 4]);
    b.w         = Eigen::Map<const Vector3>(&all[k + 16]);
    /* If the new description has another centre of mass, the position of the body's origin is kept (Continue.AnotherCentreOfMass) */
    const Vector3 moved = b.A * (b.center - R.scene.bodies[(std::size_t)all[k]].center);
    b.r                 = Eigen::Map<const Vector3>(&all[k + 1]) + moved;
    b.v                 = Eigen::Map<const Vector3>(&all[k + 13]) + b.w.cross(moved);
  }
  if (!sum.empty())
    PetscCallMPI(MPI_Allreduce(scalars.data(), sum.data(), (PetscMPIInt)sum.size(), MPI_DOUBLE, MPI_SUM, s.comm));
  for (std::size_t i = 0; i < s.variables.size(); i++) {
    s.variables[i].initial = sum[i];
    s.variables[i].reached = true;
  }
  for (std::size_t i = 0; i < s.states.size(); i++) s.states[i].initial = sum[s.variables.size() + i];
  PetscFunctionReturn(0);
}

} // namespace hhtdae
