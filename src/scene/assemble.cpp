/*
  Checks initial poses and velocities against the constraints: names those that are violated and, with -scene_assemble project, moves the bodies so that they are satisfied.

  Flexible bodies are moved as rigid ones here. Violations that rigid motions cannot remove, as of a press fit or of a motion that drives one end of a beam, need deformations
  (LeftToDeform()): the first state of a run is then projected in the metric of its mass matrix.
*/
#include "start.h"
#include <algorithm>
#include <cmath>
#include <numeric>
#include <random>
#include <sstream>

namespace hhtdae
{

namespace
{

constexpr int    assembly_iterations = 100, max_named = 10;
/* largest rotation (rad) and displacement (part of the scene's size) in one iteration */
constexpr double max_iteration_turn = 0.3, max_iteration_move = 0.3;

/* Violation of an element's constraints at position and velocity level: Euclidean norms in the units of the rows, and the
   same relative to the size and speed of the mechanism */
struct Misfit {
  double position = 0, velocity = 0, relative_position = 0, relative_velocity = 0;
};

/* Largest speed of a body or motion, with angular velocities multiplied by `size`; violations at velocity level are
   relative to it. 0 if all speeds are rounding */
double Speed(const SceneData &s, const std::vector<RowBlock> &blocks, double size)
{
  double speed = 0;
  for (const BodyData &b : s.bodies) speed = std::max(speed, std::max(b.v.norm(), size * b.w.norm()));
  for (const RowBlock &b : blocks)
    for (int r = 0; r < b.rows; r++)
      if (b.has(r)) speed = std::max(speed, std::abs(b.rate(r)) * (b.length ? 1 : size));
  return speed > 1e-12 * size ? speed : 0;
}

std::vector<Misfit> Misfits(const SceneData &s, const std::vector<RowBlock> &blocks, double size)
{
  std::vector<Misfit> all(s.elements.size());
  const double        speed = s.started.speed;
  for (const RowBlock &b : blocks) {
    Misfit      &m      = all[b.element];
    const double length = b.length ? size : 1, velocity = speed > 0 ? (b.length ? speed : speed / size) : 1;
    for (int r = 0; r < b.rows; r++) {
      if (!b.has(r)) continue;
      m.position          = std::hypot(m.position, b.value(r));
      m.velocity          = std::hypot(m.velocity, b.speed(r));
      m.relative_position = std::hypot(m.relative_position, b.value(r) / length);
      m.relative_velocity = std::hypot(m.relative_velocity, b.speed(r) / velocity);
    }
  }
  return all;
}

/* Maximum of a member over all elements; NaN if a value is NaN */
double Largest(const std::vector<Misfit> &m, double Misfit::*of)
{
  double x = 0;
  for (const Misfit &e : m) x = e.*of > x || std::isnan(e.*of) ? e.*of : x;
  return x;
}

std::string Number(double x)
{
  std::ostringstream o;
  o.precision(3);
  o << x;
  return o.str();
}

/* Alike markers, as other joints have them, have parallel z axes, from where no direction leads to perpendicular ones */
std::string HintOnAxes(const SceneData &s, const ElementData &e)
{
  if (std::string(e.type) != "universal") return "";
  const auto z = [&](Marker m) {
    const MarkerData &k = s.markers[m.id];
    return Vector3(k.body < 0 ? Vector3(k.R.col(2)) : Vector3(s.bodies[k.body].A * k.R.col(2)));
  };
  return z(e.i).cross(z(e.j)).norm() > 1e-3 ? "" : ": z of marker i has to be perpendicular to z of marker j, and is parallel to it";
}

/* Lists the elements whose relative misfit is larger than `beyond`, the worst first, one per line, at most max_named */
std::string ListWorst(const SceneData &s, const std::vector<Misfit> &m, double Misfit::*relative, double Misfit::*absolute,
                      const char *what, double beyond)
{
  std::vector<PetscInt> order;
  for (std::size_t e = 0; e < m.size(); e++)
    if (!(m[e].*relative <= beyond)) order.push_back((PetscInt)e);
  std::stable_sort(order.begin(), order.end(), [&](PetscInt a, PetscInt b) { return m[a].*relative > m[b].*relative; });
  std::string text;
  for (std::size_t k = 0; k < order.size() && k < max_named; k++)
    text += "\n  " + std::string(s.elements[order[k]].type) + " " + s.elements[order[k]].name + ": " + what + " by " +
            Number(m[order[k]].*absolute) + HintOnAxes(s, s.elements[order[k]]);
  if (order.size() > max_named) text += "\n  and " + std::to_string(order.size() - max_named) + " more";
  return text;
}

std::string WorstPositions(const SceneData &s, const std::vector<Misfit> &m, double beyond)
{
  return ListWorst(s, m, &Misfit::relative_position, &Misfit::position, "not met", beyond);
}
std::string WorstVelocities(const SceneData &s, const std::vector<Misfit> &m, double beyond)
{
  return ListWorst(s, m, &Misfit::relative_velocity, &Misfit::velocity, "velocities violate it", beyond);
}

/* Moves all bodies by factor * d; d: translation and rotation vector, 6 numbers per body */
void MoveBodiesBy(SceneData &s, const std::vector<double> &d, double factor)
{
  for (std::size_t i = 0; i < s.bodies.size(); i++) {
    BodyData     &b = s.bodies[i];
    const Vector3 x(d[6 * i], d[6 * i + 1], d[6 * i + 2]), theta(d[6 * i + 3], d[6 * i + 4], d[6 * i + 5]);
    b.r += factor * x;
    const double angle = factor * theta.norm();
    if (angle > 0) b.A = Eigen::AngleAxisd(angle, theta.normalized()) * b.A;
  }
}

double StepLimit(const std::vector<double> &d, double size)
{
  double factor = 1;
  for (std::size_t i = 0; i < d.size(); i += 6) {
    const double x = std::hypot(d[i], d[i + 1], d[i + 2]), turn = std::hypot(d[i + 3], d[i + 4], d[i + 5]);
    if (factor * x > max_iteration_move * size) factor = max_iteration_move * size / x;
    if (factor * turn > max_iteration_turn) factor = max_iteration_turn / turn;
  }
  return factor;
}

/* Norm of all violations, each divided by the square root of its diagonal entry in Phi_q M^-1 Phi_q^T (weight), which makes rows of different units comparable between iterations */
double ViolationAsLength(const std::vector<RowBlock> &blocks, const std::vector<double> &weight)
{
  double      sum = 0;
  std::size_t row = 0;
  for (const RowBlock &b : blocks)
    for (int r = 0; r < b.rows; r++, row++)
      if (b.has(r) && weight[row] > 0) sum += b.value(r) * b.value(r) / weight[row];
  return std::sqrt(sum);
}

/* Groups of movable bodies, connected by joints, that contain a flexible body and are not connected to a body with
   fixed_start, which a deformation of the group could move. body, element: number of the group of each body and element,
   -1 if it is in none */
struct Deformable {
  std::vector<PetscInt> body, element;
  std::vector<char>     deforms, rigid; /* for each element: whether it is in such a group, and whether it is not */
};

Deformable FindDeformable(const SceneData &s, FixedBodies fixed_bodies)
{
  const std::vector<RowBlock> all = DescribeAll(s, s.start.time, FixedBodies::None);
  std::vector<PetscInt>       root(s.bodies.size());
  std::vector<char>           flexible(s.bodies.size(), 0), held(s.bodies.size(), 0);
  const auto                  ofNodes = [&](PetscInt b) { return s.bodies[b].massless && s.bodies[b].carrier < 0; };
  const auto                  isHeld  = [&](PetscInt b) { return fixed_bodies == FixedBodies::FixedStart && s.bodies[b].fixed_start && !ofNodes(b); };
  const auto                  rootOf  = [&](PetscInt b) {
    while (root[b] != b) b = root[b] = root[root[b]];
    return b;
  };
  std::iota(root.begin(), root.end(), 0);
  for (const RowBlock &b : all) {
    PetscInt last = -1;
    for (PetscInt k : b.body) {
      if (isHeld(k)) continue;
      if (last >= 0) root[rootOf(k)] = rootOf(last);
      last = k;
    }
  }
  for (PetscInt b = 0; b < (PetscInt)root.size(); b++)
    if (!isHeld(b) && (s.bodies[b].flexible || ofNodes(b))) flexible[rootOf(b)] = 1;
  for (const RowBlock &b : all)
    if (std::any_of(b.body.begin(), b.body.end(), isHeld))
      for (PetscInt k : b.body) held[rootOf(k)] = 1;
  Deformable d{std::vector<PetscInt>(s.bodies.size(), -1), std::vector<PetscInt>(s.elements.size(), -1), std::vector<char>(s.elements.size(), 0),
               std::vector<char>(s.elements.size(), 1)};
  for (PetscInt b = 0; b < (PetscInt)root.size(); b++)
    if (!isHeld(b) && flexible[rootOf(b)] && !held[rootOf(b)]) d.body[b] = rootOf(b);
  for (const RowBlock &b : all)
    for (PetscInt k : b.body)
      if (d.body[k] >= 0) {
        d.element[b.element] = d.body[k];
        d.deforms[b.element] = 1;
        d.rigid[b.element]   = 0;
      }
  return d;
}

std::vector<RowBlock> BlocksOf(const SceneData &s, FixedBodies fixed_bodies, const std::vector<char> *elements)
{
  std::vector<RowBlock> all = DescribeAll(s, s.start.time, fixed_bodies);
  if (elements) all.erase(std::remove_if(all.begin(), all.end(), [&](const RowBlock &b) { return !(*elements)[b.element]; }), all.end());
  return all;
}

void RightHandSide(const std::vector<RowBlock> &blocks, Eigen::VectorXd RowBlock::*of, std::vector<double> &rhs)
{
  rhs.clear();
  for (const RowBlock &b : blocks)
    for (int r = 0; r < b.rows; r++) rhs.push_back(-(b.*of)(r));
}

} // namespace

std::vector<Pose> Poses(const SceneData &s)
{
  std::vector<Pose> p;
  for (const BodyData &b : s.bodies) p.push_back({b.r, b.v, b.w, b.A, b.flexible});
  return p;
}

void SetPoses(SceneData &s, const std::vector<Pose> &p)
{
  for (std::size_t i = 0; i < p.size(); i++) {
    BodyData &b = s.bodies[i];
    b.r         = p[i].r;
    b.v         = p[i].v;
    b.w         = p[i].w;
    b.A         = p[i].A;
    b.flexible  = p[i].flexible;
  }
}

/* Reports the displacements of bodies, the largest first */
PetscErrorCode ReportMoves(SceneData &s, const std::vector<Pose> &before, const char *what)
{
  struct Displacement {
    PetscInt body;
    double   distance, angle;
  };
  const double      size = SceneSize(s);
  std::vector<Displacement> moves;
  PetscFunctionBegin;
  for (std::size_t i = 0; i < before.size(); i++) {
    const BodyData &b = s.bodies[i];
    const Displacement m{(PetscInt)i, (b.r - before[i].r).norm(),
                         std::abs(Eigen::AngleAxisd(Matrix3(b.A * before[i].A.transpose())).angle())};
    s.started.moved  = std::max(s.started.moved, m.distance);
    s.started.turned = std::max(s.started.turned, m.angle);
    if (m.distance > 1e-12 * size || m.angle > 1e-7) moves.push_back(m);
  }
  std::stable_sort(moves.begin(), moves.end(), [&](const Displacement &a, const Displacement &b) {
    return a.distance + size * a.angle > b.distance + size * b.angle;
  });
  if (s.start.view)
    PetscCall(PetscPrintf(s.comm, "scene: %s moved %zu of %zu bodies\n", what, moves.size(), before.size()));
  for (std::size_t k = 0; k < moves.size(); k++) {
    const char *name = s.bodies[moves[k].body].name.c_str();
    if (s.start.view && k < max_named)
      PetscCall(PetscPrintf(s.comm, "  %s by %.3g and by %.3g degrees\n", name, moves[k].distance,
                            moves[k].angle * 180 / M_PI));
    else
      PetscCall(PetscInfo(nullptr, "scene: %s moved %s by %.3g and by %.3g degrees\n", what, name, moves[k].distance,
                          moves[k].angle * 180 / M_PI));
  }
  PetscFunctionReturn(0);
}

/* Gauss-Newton iterations. Each step is the smallest one, in the metric of the masses, that satisfies the linearized
   constraints; it is halved until it reduces the violation */
PetscErrorCode ProjectPositions(Model &M, FixedBodies fixed_bodies, bool *ok, const std::vector<char> *elements)
{
  SceneData            &s    = M.scene;
  NearestSystem         system(M);
  std::vector<RowBlock> blocks = BlocksOf(s, fixed_bodies, elements);
  const double          size = MechanismSize(s, blocks), target = 1e-3 * s.start.tolerance;
  std::vector<double>   rhs, d, weight;
  double                misfit = Largest(Misfits(s, blocks, size), &Misfit::relative_position);
  PetscFunctionBegin;
  *ok = true;
  if (blocks.empty()) PetscFunctionReturn(0);
  for (int it = 0, stalled = 0; it < assembly_iterations && misfit > 1e-15 && stalled < 5; it++) {
    PetscCall(system.factor(blocks));
    RightHandSide(blocks, &RowBlock::value, rhs);
    PetscCall(system.solve(blocks, rhs, nullptr, d));
    weight                         = system.weights();
    const double            merit  = ViolationAsLength(blocks, weight);
    const std::vector<Pose> before = Poses(s);
    double                  factor = StepLimit(d, size), next = merit;
    for (int cut = 0; cut < 6; cut++, factor /= 2) {
      SetPoses(s, before);
      MoveBodiesBy(s, d, factor);
      blocks = BlocksOf(s, fixed_bodies, elements);
      next   = ViolationAsLength(blocks, weight);
      if (next < merit) break;
      if (misfit < target) break; /* only rounding is left */
    }
    if (misfit < target && !(next < merit)) {
      SetPoses(s, before);
      break;
    }
    stalled = next < 0.99 * merit ? 0 : stalled + 1;
    misfit = Largest(Misfits(s, blocks, size), &Misfit::relative_position);
    s.started.assembly_iterations++;
    PetscCall(
        PetscInfo(nullptr, "scene: assembly %d: misfit %g of the mechanism's size, step cut to %g\n", it, misfit, factor));
    if (!std::isfinite(misfit)) break;
  }
  *ok = misfit <= s.start.tolerance;
  PetscFunctionReturn(0);
}

namespace
{

PetscErrorCode ProjectVelocities(Model &M, FixedBodies fixed_bodies, const std::vector<char> *elements)
{
  SceneData          &s = M.scene;
  NearestSystem       system(M);
  std::vector<double> rhs, d;
  PetscFunctionBegin;
  for (int it = 0; it < 3; it++) {
    const std::vector<RowBlock> blocks = BlocksOf(s, fixed_bodies, elements);
    if (blocks.empty()) break;
    if (it == 0) PetscCall(system.factor(blocks));
    RightHandSide(blocks, &RowBlock::speed, rhs);
    PetscCall(system.solve(blocks, rhs, nullptr, d));
    for (std::size_t i = 0; i < s.bodies.size(); i++) {
      s.bodies[i].v += Vector3(d[6 * i], d[6 * i + 1], d[6 * i + 2]);
      s.bodies[i].w += Vector3(d[6 * i + 3], d[6 * i + 4], d[6 * i + 5]);
    }
  }
  PetscFunctionReturn(0);
}

PetscErrorCode MeasureMisfit(SceneData &s, std::vector<Misfit> &m)
{
  const std::vector<RowBlock> blocks = DescribeAll(s, s.start.time, FixedBodies::None);
  const double                size   = MechanismSize(s, blocks);
  PetscFunctionBegin;
  s.started.speed =
      std::max(s.started.speed, Speed(s, blocks, size)); /* the initial speed counts even if a projection has reduced it */
  m                         = Misfits(s, blocks, size);
  s.started.misfit          = Largest(m, &Misfit::relative_position);
  s.started.velocity_misfit = Largest(m, &Misfit::relative_velocity);
  PetscFunctionReturn(0);
}

PetscErrorCode CheckInitialValues(const SceneData &s, const std::vector<Misfit> &m, bool going_on, double left)
{
  const double tol = std::max(s.start.tolerance, left);
  PetscFunctionBegin;
  const std::string positions = WorstPositions(s, m, tol), velocities = going_on ? "" : WorstVelocities(s, m, tol);
  PetscCheck(positions.empty() && velocities.empty(), s.comm, PETSC_ERR_ARG_WRONG,
             "the initial values violate constraints by more than %g of the mechanism's size (%.3g) or the scene's speed:%s%s\n"
             "Give consistent values, or let the bodies be moved: -scene_assemble project",
             tol, MechanismSize(s, DescribeAll(s, s.start.time, FixedBodies::None)), positions.c_str(), velocities.c_str());
  if (s.started.misfit > 0 || s.started.velocity_misfit > 0)
    PetscCall(PetscInfo(nullptr, "scene: initial values within the tolerance, misfit %g, of velocities %g%s%s\n",
                        s.started.misfit, s.started.velocity_misfit, WorstPositions(s, m, 1e-3 * tol).c_str(),
                        WorstVelocities(s, m, 1e-3 * tol).c_str()));
  PetscFunctionReturn(0);
}

std::vector<Misfit> OnRigidElements(std::vector<Misfit> m, const Deformable &d)
{
  for (std::size_t e = 0; e < m.size(); e++)
    if (d.deforms[e]) m[e] = Misfit();
  return m;
}

/* Size of a random perturbation of the poses, rad and parts of the scene's size, from which assembly is repeated if the
   violation cannot be reduced along the gradient, for example when the shafts of a constant velocity joint are a quarter
   turn apart (SceneAssembly.AQuarterTurnOff) */
constexpr double perturbation = 1e-3;

void Perturb(SceneData &s, const std::vector<RowBlock> &blocks)
{
  std::mt19937                           random(1);
  std::uniform_real_distribution<double> uniform(-1, 1);
  const double                           size = SceneSize(s);
  std::vector<char>                      moves(s.bodies.size(), 0);
  std::vector<double>                    d(6 * s.bodies.size(), 0);
  for (const RowBlock &b : blocks)
    for (PetscInt k : b.body) moves[k] = 1;
  for (std::size_t i = 0; i < s.bodies.size(); i++)
    for (int k : Directions(KindOf(s, s.bodies[i]))) {
      /* also drawn for bodies that do not move, so that the random numbers of the other bodies do not depend on these */
      const double x = uniform(random);
      if (moves[i]) d[6 * i + k] = x * (k < 3 ? size : 1);
    }
  MoveBodiesBy(s, d, perturbation);
}

PetscErrorCode AssemblePositions(Model &M, FixedBodies fixed_bodies, const Deformable &d)
{
  SceneData              &s      = M.scene;
  const std::vector<Pose> before = Poses(s);
  std::vector<Misfit>     m;
  bool                    ok;
  PetscFunctionBegin;
  PetscCall(ProjectPositions(M, fixed_bodies, &ok, &d.rigid));
  if (!ok) {
    PetscCall(MeasureMisfit(s, m));
    const std::string left = WorstPositions(s, OnRigidElements(m, d), s.start.tolerance);
    SetPoses(s, before);
    Perturb(s, BlocksOf(s, fixed_bodies, &d.rigid));
    PetscCall(PetscInfo(nullptr, "scene: assembly is repeated from positions perturbed by %g\n", perturbation));
    PetscCall(ProjectPositions(M, fixed_bodies, &ok, &d.rigid));
    if (!ok) SetPoses(s, before);
    PetscCheck(ok, s.comm, PETSC_ERR_CONV_FAILED,
               "the scene cannot be assembled; after %d iterations these constraints are not met:%s\n"
               "Start nearer to positions that satisfy them, or release a body that is held by fixed_start",
               (int)s.started.assembly_iterations, left.c_str());
  }
  PetscCall(ProjectPositions(M, fixed_bodies, &ok, &d.deforms)); /* remaining violations are removed by deformations at the start of the run */
  PetscFunctionReturn(0);
}

/* In groups with flexible bodies, initial velocities that rigid motions cannot make consistent are left as given. The
   start of the run then computes the nearest consistent velocities, which are those after a plastic impact and excite
   vibrations. In a run that continues another one no velocities of such groups are changed here, since new joints may
   connect vibrating bodies. */
PetscErrorCode AssembleVelocities(Model &M, FixedBodies fixed_bodies, const Deformable &d)
{
  SceneData          &s = M.scene;
  std::vector<Misfit> m;
  std::vector<char>   impact(s.bodies.size(), 0); /* for each group */
  PetscFunctionBegin;
  PetscCall(ProjectVelocities(M, fixed_bodies, &d.rigid));
  if (M.continues) PetscFunctionReturn(0);
  const std::vector<Pose> before = Poses(s);
  PetscCall(ProjectVelocities(M, fixed_bodies, &d.deforms));
  PetscCall(MeasureMisfit(s, m));
  for (std::size_t e = 0; e < m.size(); e++)
    if (d.deforms[e] && !(m[e].relative_velocity <= s.start.tolerance)) impact[d.element[e]] = 1;
  for (std::size_t b = 0; b < before.size(); b++)
    if (d.body[b] >= 0 && impact[d.body[b]]) {
      s.bodies[b].v = before[b].v;
      s.bodies[b].w = before[b].w;
    }
  PetscFunctionReturn(0);
}

} // namespace

std::vector<char> RigidElements(const SceneData &s, FixedBodies fixed_bodies) { return FindDeformable(s, fixed_bodies).rigid; }

bool LeftToDeform(const SceneData &s)
{
  return s.start.assembly == Assembly::Project && !(s.started.misfit <= s.start.tolerance && s.started.velocity_misfit <= s.start.tolerance);
}

PetscErrorCode Assemble(Model &M)
{
  SceneData              &s      = M.scene;
  const std::vector<Pose> before = Poses(s);
  std::vector<Misfit>     m;
  PetscFunctionBegin;
  if (s.start.assembly == Assembly::Off) PetscFunctionReturn(0);
  PetscCall(MeasureMisfit(s, m));
  const FixedBodies fixed_bodies = M.continues ? FixedBodies::Nodes : FixedBodies::FixedStart; /* fixed_start applies to the first run only */
  if (s.start.assembly == Assembly::Report) {
    PetscCall(CheckInitialValues(s, m, M.continues, M.inherited_misfit));
    PetscFunctionReturn(0);
  }
  const Deformable d = FindDeformable(s, fixed_bodies);
  if (s.started.misfit > 0) PetscCall(AssemblePositions(M, fixed_bodies, d));
  PetscCall(MeasureMisfit(s, m));
  if (s.started.velocity_misfit > 0) PetscCall(AssembleVelocities(M, fixed_bodies, d));
  PetscCall(MeasureMisfit(s, m));
  const std::string left = WorstVelocities(s, OnRigidElements(m, d), s.start.tolerance);
  if (!left.empty()) SetPoses(s, before);
  PetscCheck(left.empty(), s.comm, PETSC_ERR_CONV_FAILED,
             "no initial velocities satisfy all constraints:%s\n"
             "Look for motions that contradict each other, or bodies held by fixed_start",
             left.c_str());
  if (LeftToDeform(s))
    PetscCall(PetscInfo(nullptr, "scene: flexible bodies have to deform for%s%s\n", WorstPositions(s, m, s.start.tolerance).c_str(),
                        WorstVelocities(s, m, s.start.tolerance).c_str()));
  PetscCall(ReportMoves(s, before, "assembly"));
  PetscFunctionReturn(0);
}

} // namespace hhtdae
