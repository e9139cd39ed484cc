/* Sets velocities of one body in the state of a run. */
#include "euler.h"
#include "guard.h"
#include "hhtdae/analyses.h"
#include "runtime.h"

namespace hhtdae
{

namespace
{

PetscErrorCode CheckBody(const SceneData &s, Body body, const Vector3 *velocity, const Vector3 *angular)
{
  PetscFunctionBegin;
  PetscCheck(s.valid(body) && CoordinatesOf(s, s.bodies[body.id]) > 0, s.comm, PETSC_ERR_ARG_WRONG, "SetVelocity(): it takes a body of the scene that has coordinates, not the ground or an attachment");
  const BodyData &b = s.bodies[body.id];
  PetscCheck(!angular || !b.point, s.comm, PETSC_ERR_ARG_WRONG, "SetVelocity(): %s is a point mass and has no angular velocity", b.name.c_str());
  PetscCheck((!velocity || velocity->allFinite()) && (!angular || angular->allFinite()), s.comm, PETSC_ERR_ARG_OUTOFRANGE, "SetVelocity(): a velocity of %s is not finite", b.name.c_str());
  PetscCheck(!s.planar || ((!velocity || (*velocity)(2) == 0) && (!angular || ((*angular)(0) == 0 && (*angular)(1) == 0))), s.comm, PETSC_ERR_ARG_OUTOFRANGE,
             "SetVelocity(): %s leaves the plane: in a planar scene z of a velocity, x and y of an angular velocity are 0", b.name.c_str());
  PetscFunctionReturn(0);
}

/* v: the rates of the coordinates of a body with this velocity and angular velocity; null: as in `now` */
void WriteVelocity(const Runtime &R, const LocalBody &k, const BodyMotion &now, const double *u, const Vector3 *velocity, const Vector3 *angular, double *v)
{
  const Vector3 centre = velocity ? *velocity : now.v, w = angular ? *angular : now.w;
  const int     n = Coordinates(k.kind), directions = PlanarScene(k.kind) ? 2 : 3;
  for (int i = 0; i < directions; i++) v[i] = centre(i);
  if (k.kind == BodyKind::Planar) v[2] = w(2);
  if (!TurnsInSpace(k.kind)) return;
  Vector3 rate = w; /* those of local rotation vectors, rotation.h */
  if (!R.bodies.local) {
    Matrix3   A;
    EulerAxes e;
    EulerFrame(u + n - 3, A, e);
    rate = EulerRates(e, w);
  }
  for (int i = 0; i < 3; i++) v[n - 3 + i] = rate(i);
}

} // namespace

PetscErrorCode SetVelocity(TS ts, Body body, const Vector3 *velocity, const Vector3 *angular)
{
  Runtime      *R = RunOf(ts);
  Vec           U, V;
  const double *u, *local[3];
  double       *v;
  PetscFunctionBegin;
  PetscCheck(R, PetscObjectComm((PetscObject)ts), PETSC_ERR_ARG_WRONG, "SetVelocity(): the TS is not one of a scene, Scene::createTS() makes them");
  PetscCall(CheckBody(R->scene, body, velocity, angular));
  PetscCall(ReadCheckpoint(ts));
  PetscCall(TS2GetSolution(ts, &U, &V));
  PetscCall(VecGetArrayRead(U, &u));
  PetscCall(VecGetArray(V, &v));
  const PetscErrorCode failed = Guarded([&] {
    PetscFunctionBegin;
    PetscCall(LocalState(*R, u, v, v, local));
    R->bodies.move(local[0], local[1]);
    R->accepted_move = -1; /* the bodies may have other poses than those of the last accepted state */
    for (PetscInt b = 0; b < R->bodies.own; b++) {
      const LocalBody &k = R->bodies.body[b];
      if (k.id == body.id) WriteVelocity(*R, k, R->bodies.now[b], u + k.first, velocity, angular, v + k.first);
    }
    PetscFunctionReturn(PetscErrorCode(0));
  });
  PetscCall(VecRestoreArray(V, &v));
  PetscCall(VecRestoreArrayRead(U, &u));
  PetscCall(failed);
  PetscFunctionReturn(0);
}

} // namespace hhtdae
