/* Converts the described initial state to the unknowns of a run. */
#include "extension.h"
#include "runtime.h"

namespace hhtdae
{

namespace
{

void SetInitialState(const Runtime &R, const LocalBody &k, double *U, double *V)
{
  if (k.kind == BodyKind::Attached) return;
  const BodyData &b = R.scene.bodies[k.id];
  double         *u = U + k.first, *v = V + k.first;
  const int       n = Coordinates(k.kind), directions = PlanarScene(k.kind) ? 2 : 3;
  for (int i = 0; i < directions; i++) {
    u[i] = b.r(i);
    v[i] = b.v(i);
  }
  if (k.kind == BodyKind::Planar) {
    u[2] = std::atan2(b.A(1, 0), b.A(0, 0));
    v[2] = b.w(2);
  }
  if (!TurnsInSpace(k.kind)) return;
  Vector3 angles = Vector3::Zero(), rate = b.w; /* local rotation vectors are zero, since their reference is the initial attitude */
  if (!R.bodies.local) {
    Matrix3   A;
    EulerAxes e;
    angles = EulerAngles(b.A * k.C.transpose());
    EulerFrame(angles.data(), A, e);
    rate = EulerRates(e, b.w);
  }
  for (int i = 0; i < 3; i++) {
    u[n - 3 + i] = angles(i);
    v[n - 3 + i] = rate(i);
  }
  if (!b.flexible) return;
  std::copy(b.flexible->deformation.begin(), b.flexible->deformation.end(), u + n);
  std::copy(b.flexible->deformation_rate.begin(), b.flexible->deformation_rate.end(), v + n);
}

} // namespace

PetscErrorCode InitialState(Runtime &R, Vec U, Vec V)
{
  double *u, *v;
  PetscFunctionBegin;
  PetscCall(VecSet(U, 0));
  PetscCall(VecSet(V, 0));
  PetscCall(VecGetArray(U, &u));
  PetscCall(VecGetArray(V, &v));
  for (PetscInt b = 0; b < R.bodies.own; b++) {
    const LocalBody &k = R.bodies.body[b];
    SetInitialState(R, k, u, v);
  }
  for (std::size_t i = 0; i < R.number.variable.size(); i++)
    if (R.number.variable_owner[i] == R.rank) u[R.number.variable[i] - R.start] = R.scene.variables[i].initial;
  for (std::size_t i = 0; i < R.number.state.size(); i++)
    if (R.number.state_owner[i] == R.rank) u[R.number.state[i] - R.start] = R.scene.states[i].initial;
  for (auto &x : R.scene.extensions) x->initial(u + x->start[R.rank] - R.start, v + x->start[R.rank] - R.start);
  PetscCall(VecRestoreArray(U, &u));
  PetscCall(VecRestoreArray(V, &v));
  PetscFunctionReturn(0);
}

} // namespace hhtdae
