/*
  Angles between markers that have been queried, with full turns counted: Remember() updates them at every accepted state of the
  integrator or of an analysis.
*/
#include "kernels/angle.h"
#include "runtime.h"
#include <array>

namespace hhtdae
{

namespace
{

/* Axes x of marker i, x and y of marker j; in a planar scene also the difference of the angle coordinates of their bodies */
using Axes = std::array<double, 10>;

/* Adds the entries of one marker to `sum` on the owner of its body, or on the first rank for the ground. about: true for
   marker j, false for marker i */
void AddAxes(const Runtime &R, const double *u, PetscInt marker, bool about, Axes &sum)
{
  const MarkerData &m  = R.scene.markers[marker];
  const PetscInt    id = m.body;
  if (R.rank != (id < 0 || R.number.owner.empty() ? 0 : R.number.owner[id])) return;
  const LocalBody *body = id < 0 ? nullptr : &R.bodies.body[R.local_body[id]];
  const Matrix3    axes = body ? Matrix3(R.bodies.now[R.local_body[id]].A * m.R) : m.R;
  for (int c = 0; c < 3; c++) {
    sum[about ? 3 + c : c] = axes(c, 0);
    if (about) sum[6 + c] = axes(c, 1);
  }
  if (body && body->kind == BodyKind::Planar) sum[9] += (about ? -1 : 1) * u[body->first + 2];
}

PetscErrorCode GatherAxes(const Runtime &R, const double *u, const std::vector<CountedAngle> &all, std::vector<Axes> &axes)
{
  PetscFunctionBegin;
  axes.assign(all.size(), Axes{});
  for (std::size_t k = 0; k < all.size(); k++) {
    AddAxes(R, u, all[k].i, false, axes[k]);
    AddAxes(R, u, all[k].j, true, axes[k]);
  }
  if (R.size > 1 && !all.empty()) PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, axes[0].data(), (PetscMPIInt)(axes.size() * axes[0].size()), MPI_DOUBLE, MPI_SUM, R.scene.comm));
  PetscFunctionReturn(0);
}

double PrincipalOf(const Axes &x)
{
  const Eigen::Map<const Vector3> xi(x.data()), xj(x.data() + 3), yj(x.data() + 6);
  return std::atan2(yj.dot(xi), xj.dot(xi));
}

/* The marker's axes with its body in the described attitude, before assembly and equilibrium */
Frame<double> AsDescribed(const Model &M, Marker m)
{
  Frame<double>  f = M.scene.frame(m);
  const PetscInt b = M.scene.markers[m.id].body;
  if (b >= 0 && b < (PetscInt)M.described.size()) f.R = M.described[b] * M.scene.markers[m.id].R;
  return f;
}

/* Initial value of the angle coordinate of a planar body */
double InitialPlanarAngle(const SceneData &s, PetscInt marker)
{
  const PetscInt b = s.markers[marker].body;
  return b < 0 || s.bodies[b].point ? 0 : std::atan2(s.bodies[b].A(1, 0), s.bodies[b].A(0, 0));
}

/* The angle at t, with full turns since the start of the first run, that a motion prescribes; false if no motion prescribes it */
bool PrescribedAngle(const Model &M, double t, PetscInt i, PetscInt j, double *angle)
{
  double from, to;
  for (const StoreBase *store : M.scene.order)
    for (PetscInt e = 0; e < store->size(); e++) {
      if (!store->drivenAngle(e, M.continues ? M.first_begin : M.scene.start.time, &from) || store->marker(e, 0) != i || store->marker(e, 1) != j) continue;
      store->drivenAngle(e, t, &to);
      *angle = (M.continues ? std::remainder(from, 2 * M_PI) : StartAngle(M, Marker{i}, Marker{j})) + to - from;
      return true;
    }
  return false;
}

} // namespace

/* The described angle is in (-pi, pi]; it is assumed that assembly and equilibrium have changed it by less than half a turn */
double StartAngle(const Model &M, Marker i, Marker j)
{
  return Unwind<double>(PrincipalAngle<double>(M.scene.frame(i), M.scene.frame(j)), PrincipalAngle<double>(AsDescribed(M, i), AsDescribed(M, j)));
}

bool InstancesOf::joins(std::size_t n, std::array<int, 2> pair, PetscInt i, PetscInt j) const
{
  return pair[0] >= 0 && store->marker(number[n], pair[0]) == i && store->marker(number[n], pair[1]) == j;
}

PetscErrorCode CountAngles(const Runtime &R, const double *u, std::vector<CountedAngle> &all)
{
  std::vector<Axes> axes;
  PetscFunctionBegin;
  PetscCall(GatherAxes(R, u, all, axes));
  for (std::size_t k = 0; k < all.size(); k++) {
    CountedAngle &c = all[k];
    c.angle         = Unwind<double>(PrincipalOf(axes[k]), c.angle + (R.scene.planar ? axes[k][9] - c.turned : 0));
    c.turned        = axes[k][9];
  }
  PetscFunctionReturn(0);
}

PetscErrorCode FirstAngle(const Runtime &R, const double *u, double t, PetscInt i, PetscInt j, CountedAngle *first, bool *turns_known)
{
  const SceneData          &s    = R.scene;
  double                    largest = PETSC_NINFINITY, x;
  std::vector<CountedAngle> now{{i, j, 0, 0}};
  PetscFunctionBegin;
  *turns_known = true;
  for (const auto &b : R.batches)
    if (b->countedAngle(i, j, &x)) largest = std::max(largest, x);
  if (R.size > 1) PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &largest, 1, MPI_DOUBLE, MPI_MAX, s.comm));
  if (largest > PETSC_NINFINITY) {
    std::vector<Axes> axes;
    PetscCall(GatherAxes(R, u, now, axes));
    now[0].angle  = largest;
    now[0].turned = axes[0][9];
  } else if (s.planar) {
    now[0].angle  = StartAngle(*R.model, Marker{i}, Marker{j});
    now[0].turned = InitialPlanarAngle(s, i) - InitialPlanarAngle(s, j);
  } else if (PrescribedAngle(*R.model, t, i, j, &x)) now[0].angle = x;
  else *turns_known = false;
  PetscCall(CountAngles(R, u, now));
  *first = now[0];
  PetscFunctionReturn(0);
}

/* Adds the full turns of planar bodies' angles to X; the new description has these angles in (-pi, pi] */
static PetscErrorCode CarryPlanarAngles(const Runtime &from, Vec U, const Runtime &to, Vec X)
{
  const double *u;
  double       *x;
  PetscFunctionBegin;
  PetscCall(VecGetArrayRead(U, &u));
  PetscCall(VecGetArray(X, &x));
  for (PetscInt b = 0; b < to.bodies.own; b++) {
    const LocalBody &body = to.bodies.body[b];
    if (body.kind != BodyKind::Planar) continue;
    double &angle = x[body.first + 2];
    angle         = Unwind<double>(angle, u[from.bodies.body[from.local_body[body.id]].first + 2]);
  }
  PetscCall(VecRestoreArray(X, &x));
  PetscCall(VecRestoreArrayRead(U, &u));
  PetscFunctionReturn(0);
}

PetscErrorCode CarryAngles(Runtime &from, Vec U, Vec V, Runtime &to, Vec X, Vec Y)
{
  const double     *u;
  std::vector<Axes> axes;
  PetscFunctionBegin;
  to.queried_angles = from.queried_angles;
  if (to.scene.planar) PetscCall(CarryPlanarAngles(from, U, to, X));
  PetscCall(MoveBodies(from, U, V));
  PetscCall(VecGetArrayRead(U, &u));
  PetscCall(CountAngles(from, u, to.queried_angles));
  PetscCall(VecRestoreArrayRead(U, &u));
  PetscCall(MoveBodies(to, X, Y));
  PetscCall(VecGetArrayRead(X, &u));
  PetscCall(GatherAxes(to, u, to.queried_angles, axes));
  PetscCall(VecRestoreArrayRead(X, &u));
  for (std::size_t k = 0; k < axes.size(); k++) to.queried_angles[k].turned = axes[k][9];
  PetscFunctionReturn(0);
}

} // namespace hhtdae
