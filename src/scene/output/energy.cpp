#include "scene/output/energy.h"

namespace hhtdae
{

namespace
{

void AddFlexible(const Bodies &B, PetscInt i, const Evaluation &e, Balance &s)
{
  const BodyMotion &b = B.now[i];
  const ModalEnergy m = B.modal[B.body[i].modal].dynamics->energy(B.modalMotion(i, e.u, e.v, nullptr), b.v);
  s.kinetic += m.kinetic;
  s.elastic += m.elastic;
  s.gravity -= B.body[i].mass * B.gravity.dot(b.r + m.center);
  s.linear += m.momentum;
  s.angular += b.r.cross(m.momentum) + m.angular;
}

void AddBody(const LocalBody &k, const BodyMotion &b, const Vector3 &gravity, Balance &s)
{
  s.kinetic += 0.5 * k.mass * b.v.squaredNorm();
  s.gravity -= k.mass * gravity.dot(b.r);
  s.linear += k.mass * b.v;
  s.angular += k.mass * b.r.cross(b.v);
  if (k.kind == BodyKind::Planar) {
    s.kinetic += 0.5 * k.J(2, 2) * b.w(2) * b.w(2);
    s.angular(2) += k.J(2, 2) * b.w(2);
  }
  if (k.kind != BodyKind::Rigid) return;
  const Vector3 w = b.A.transpose() * b.w, h = k.J * w;
  s.kinetic += 0.5 * w.dot(h);
  s.angular += b.A * h;
}

} // namespace

PetscErrorCode MakeBalance(const Runtime &R, const Evaluation &e, Balance &b)
{
  PetscFunctionBegin;
  b = Balance();
  e.bodies.gravity = R.scene.gravity; /* without the ground's acceleration, which has no potential */
  for (PetscInt i = 0; i < R.bodies.own; i++) {
    if (R.bodies.body[i].kind == BodyKind::Flexible) AddFlexible(R.bodies, i, e, b);
    else AddBody(R.bodies.body[i], R.bodies.now[i], R.bodies.gravity, b);
  }
  for (const auto &batch : R.batches) {
    b.elastic += batch->energy(e);
    batch->addTo(b, e);
  }
  if (R.size == 1) PetscFunctionReturn(0);
  double all[9] = {b.kinetic, b.gravity, b.elastic, b.linear(0), b.linear(1), b.linear(2), b.angular(0), b.angular(1), b.angular(2)};
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, all, 9, MPI_DOUBLE, MPI_SUM, R.scene.comm));
  b = {all[0], all[1], all[2], Vector3(all[3], all[4], all[5]), Vector3(all[6], all[7], all[8])};
  PetscFunctionReturn(0);
}

} // namespace hhtdae
