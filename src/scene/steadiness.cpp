/*
  How far the state of a linearization is from being steady in its axes. In a steady motion velocities are constant vectors of these axes,
  a = W x v and w' = W x w for axes that turn with W, and modal coordinates, which are in axes of their bodies, have no accelerations.
*/
#include "extension.h"
#include "linearization.h"
#include <algorithm>

namespace hhtdae
{

namespace
{

/* What a part of the scene changes its velocities by, as seen from the axes */
struct Change {
  PetscInt part    = 0;     /* a body, or behind the bodies an extension */
  bool     elastic = false;
  Vector3  a = Vector3::Zero(), turn = Vector3::Zero(); /* of the centre of mass, and of the rotation */
  double   deformation = 0; /* root of the mean square over the mass of the acceleration by deformation; of a whole body over its nodes, that of all their motion */
  double   relative    = 0; /* mean square of velocities of a whole body as seen from the axes, but for their mean */
};

/* Of all parts that this rank knows; numbers of this rank until Agree() */
struct Changes {
  std::vector<Change> all;
  double   fall    = 0; /* largest difference of an acceleration and gravity */
  double   spin    = 0, speed = 0; /* squares of the largest */
  double   turning = 0;            /* of the flexible body that turns fastest relative to the axes */
  PetscInt turning_body = -1;
};

/* The largest on all ranks, and what it belongs to */
PetscErrorCode Largest(MPI_Comm comm, double *x, PetscInt *of)
{
  struct {
    double value;
    int    of;
  } pair = {*x, (int)*of};
  PetscFunctionBegin;
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &pair, 1, MPI_DOUBLE_INT, MPI_MAXLOC, comm));
  *x  = pair.value;
  *of = pair.of;
  PetscFunctionReturn(0);
}

std::string NameOf(const SceneData &s, PetscInt part)
{
  const PetscInt bodies = (PetscInt)s.bodies.size();
  return part < 0 ? std::string() : part < bodies ? s.bodies[part].name : s.extensions[part - bodies]->bodyName();
}

/* Own bodies. Modal coordinates belong to axes that turn with their body; differences of spins that chooseAxes() tolerates do not count. */
void OfBodies(const Linearization::Work &w, const Evaluation &at, Changes *x)
{
  const Bodies &bodies = w.R->bodies;
  for (PetscInt b = 0; b < bodies.own; b++) {
    const LocalBody  &body = bodies.body[b];
    const BodyData   &data = w.R->scene.bodies[body.id];
    const BodyMotion &m    = bodies.now[b];
    if (body.kind == BodyKind::Attached || data.massless) continue; /* frames of attachments: what they are attached to counts */
    Change c;
    c.part    = body.id;
    c.elastic = bodies.modes(b) > 0;
    c.a       = bodies.acceleration(b, at.v, at.a) - w.spin.cross(m.v);
    c.turn    = bodies.angularAcceleration(b, at.v, at.a) - w.spin.cross(m.w);
    if (c.elastic) { /* modes are orthonormal with respect to mass */
      const double relative = (m.w - w.spin).norm(), lowest = data.flexible->model->omega.minCoeff();
      c.deformation = Eigen::Map<const Eigen::VectorXd>(at.a + body.first + Coordinates(body.kind), bodies.modes(b)).norm() / std::sqrt(data.mass);
      if (relative > std::max({same_spin_tolerance * m.w.norm(), same_spin_tolerance * w.spin.norm(), slow_spin_ratio * lowest, x->turning})) {
        x->turning      = relative;
        x->turning_body = body.id;
      }
    }
    x->fall  = std::max(x->fall, (c.a - bodies.gravity).norm());
    x->spin  = std::max(x->spin, m.w.squaredNorm());
    x->speed = std::max(x->speed, m.v.squaredNorm());
    x->all.push_back(c);
  }
}

/* A whole body by sums over its nodes on all ranks. Its nodes are unknowns in the axes: what turns or deforms as seen from there is not steady even without forces, as at the start of a free body */
PetscErrorCode OfNodes(const Linearization::Work &w, PetscInt extension, Changes *x)
{
  const Extension &e     = *w.R->scene.extensions[extension];
  const PetscInt   first = e.start[w.R->rank] - w.R->start;
  const double    *state[3];
  double           sum[8] = {0, 0, 0, 0, 0, 0, 0, 0}; /* 1, squares of: change, its difference from gravity, v, v as seen from the axes; the last one itself */
  Change           c;
  PetscFunctionBegin;
  for (int k = 0; k < 3; k++) PetscCall(VecGetArrayRead(w.state[k], &state[k]));
  for (PetscInt i = first; i < first + e.coordinates(); i += 3) {
    const Vector3 r(state[0] + i), v(state[1] + i), change = Vector3(state[2] + i) - w.spin.cross(v), seen = v - w.spin.cross(r);
    sum[0] += 1;
    sum[1] += change.squaredNorm();
    sum[2] += (change - w.R->bodies.gravity).squaredNorm();
    sum[3] += v.squaredNorm();
    sum[4] += seen.squaredNorm();
    for (int k = 0; k < 3; k++) sum[5 + k] += seen(k);
  }
  for (int k = 0; k < 3; k++) PetscCall(VecRestoreArrayRead(w.state[k], &state[k]));
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, sum, 8, MPI_DOUBLE, MPI_SUM, w.comm()));
  const double nodes = std::max(1., sum[0]);
  for (double &y : sum) y /= nodes;
  c.part        = (PetscInt)w.R->scene.bodies.size() + extension;
  c.elastic     = true;
  c.deformation = std::sqrt(sum[1]);
  c.relative    = std::max(0., sum[4] - Vector3(sum + 5).squaredNorm());
  x->fall       = std::max(x->fall, std::sqrt(sum[2]));
  x->speed      = std::max(x->speed, sum[3]);
  x->all.push_back(c);
  PetscFunctionReturn(0);
}

PetscErrorCode Agree(MPI_Comm comm, Changes *x)
{
  double largest[3] = {x->fall, x->spin, x->speed};
  PetscFunctionBegin;
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, largest, 3, MPI_DOUBLE, MPI_MAX, comm));
  x->fall  = largest[0];
  x->spin  = largest[1];
  x->speed = largest[2];
  PetscCall(Largest(comm, &x->turning, &x->turning_body));
  PetscFunctionReturn(0);
}

/* The largest of the stiffnesses that hold one coordinate each, in units in which masses are 1: an upper estimate of the square of the fastest rate but for coordinates that work together */
PetscErrorCode LargestStiffness(const Linearization::Work &w, double *largest)
{
  Vec           diagonal;
  const double *k;
  PetscFunctionBegin;
  *largest = 0;
  PetscCall(MatCreateVecs(w.K, nullptr, &diagonal));
  PetscCall(MatGetDiagonal(w.K, diagonal));
  PetscCall(VecGetArrayRead(diagonal, &k));
  for (PetscInt i = 0; i < w.R->n; i++)
    if (w.role[i] == TSHHT3_COORDINATE) *largest = std::max(*largest, w.unit[i] * w.unit[i] * std::abs(k[i]));
  PetscCall(VecRestoreArrayRead(diagonal, &k));
  PetscCall(VecDestroy(&diagonal));
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, largest, 1, MPI_DOUBLE, MPI_MAX, w.comm()));
  PetscFunctionReturn(0);
}

constexpr double roundings = 100; /* sums of a few terms leave so many times the rounding of one (Steady.test_free_driveline) */

} // namespace

PetscErrorCode Linearization::steadiness(Steadiness *s) const
{
  const Work &w = *work_;
  Changes     x;
  PetscInt    part[2] = {-1, -1};
  PetscFunctionBegin;
  PetscCall(w.check("Linearization::steadiness()"));
  const SceneData &scene    = w.R->scene;
  const double     gravity  = w.R->bodies.gravity.norm();
  Vec              state[3] = {w.state[0], w.state[1], w.state[2]};
  PetscCall(w.setState(state));
  w.perturbed.work_->move();
  OfBodies(w, w.perturbed.work_->at(), &x);
  for (std::size_t k = 0; k < scene.extensions.size(); k++)
    if (scene.extensions[k]->vectors()) PetscCall(OfNodes(w, (PetscInt)k, &x));
  PetscCall(Agree(w.comm(), &x));
  const bool falls = gravity > 0 && x.fall <= 1e-9 * gravity; /* freely, all of it */
  s->change = s->elastic_change = 0;
  for (const Change &c : x.all) {
    const bool   whole  = c.part >= (PetscInt)scene.bodies.size();
    const double change = c.turn.norm() + ((falls ? 0 : c.a.norm()) + (falls && whole ? 0 : c.deformation) + c.relative / w.size) / w.size;
    for (int elastic = 0; elastic <= c.elastic; elastic++) {
      double &largest = elastic ? s->elastic_change : s->change;
      if (!(change > largest)) continue;
      largest       = change;
      part[elastic] = c.part;
    }
  }
  PetscCall(Largest(w.comm(), &s->change, &part[0]));
  PetscCall(Largest(w.comm(), &s->elastic_change, &part[1]));
  s->body        = NameOf(scene, part[0]);
  s->elastic     = NameOf(scene, part[1]);
  s->turning     = NameOf(scene, x.turning_body);
  s->spin        = std::sqrt(x.spin);
  s->square_rate = x.spin + x.speed / (w.size * w.size) + gravity / w.size;
  PetscCall(LargestStiffness(w, &s->rounding));
  s->rounding *= roundings * PETSC_MACHINE_EPSILON;
  PetscFunctionReturn(0);
}

} // namespace hhtdae
