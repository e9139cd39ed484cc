/* Redundant and nearly redundant constraints, and positions in which constraints lose rank */
#ifndef HHTDAE_BENCH_STABILITY_CONSTRAINTS_H
#define HHTDAE_BENCH_STABILITY_CONSTRAINTS_H

#include "../../examples/problems/fourbar.h"
#include "../../examples/scene_references.h"
#include "stability_stiff.h"

namespace hhtstab
{

/* ---- redundant ---- */

/* The effect of a nearly redundant constraint depends on the tolerance: within the tolerance the mechanism moves like
   one with an exactly redundant constraint, beyond it the mechanism is locked, as the equations say. Both are accepted
   if they hold for the whole run; a mixture is an error */
struct MovesOrStays {
  double moves = 0, stays = 0;
  void   operator()(const hhtdae::Vector3 &x, const hhtdae::Vector3 &moving, const hhtdae::Vector3 &start)
  {
    hhtex::Widen(moves, (x - moving).norm());
    hhtex::Widen(stays, (x - start).norm());
  }
  /* If exactly redundant it must move. Beyond 1e-6, the tolerance of the start, it must not move, or the run must end
     with an error as soon as the violation of the dropped row exceeds the tolerance */
  void judge(Run &run, double delta, bool error) const
  {
    run.judge(std::isnan(moves) || std::isnan(stays) ? NAN
              : delta == 0                           ? moves
              : delta > 1e-6 && !error               ? stays
                                                     : std::fmin(moves, stays));
    run.note("%s: %.1e from the motion, %.1e from rest", moves < stays ? "moves" : "locked", moves, stays);
  }
};

/* A coupler on three parallel cranks, from 60 degrees. Either the middle crank is longer by delta, which locks the
   mechanism only to second order (its rows are redundant at the start but not beside it); or the axis of the middle
   crank is tilted by delta, which locks it at once */
inline PetscErrorCode ThreeCranks(Run &run, double delta, bool askew)
{
  using namespace hhtdae;
  const double theta = -PETSC_PI / 3, w = std::sqrt(9.81 * 2.5 / 2);
  Scene        scene(PETSC_COMM_SELF, Space::Planar);
  MovesOrStays judge;
  RigidBody    coupler, crank;
  PetscFunctionBegin;
  const Matrix3 turn = Eigen::AngleAxisd(theta - PETSC_PI / 2, Vector3::UnitZ()).toRotationMatrix();
  const Vector3 e = turn.col(0), start = Vector3(1, 0, 0) + e;
  crank.inertia = coupler.inertia = Matrix3::Identity() / 12;
  crank.rotation                  = turn;
  coupler.position                = start;
  const Body C                    = scene.add("coupler", coupler);
  for (int k = 0; k < 3; k++) {
    const Vector3 foot(k, 0, 0),
        off = k == 1 ? Vector3(delta * (askew ? Vector3(-e(1), e(0), 0) : e)) : Vector3::Zero(), tip = foot + e + off;
    crank.position = foot + e / 2;
    const Body b   = scene.add("crank " + std::to_string(k), crank);
    scene.add("foot " + std::to_string(k), Revolute{scene.markerAt(b, foot), scene.marker(scene.ground(), foot)});
    scene.add("tip " + std::to_string(k), Revolute{scene.markerAt(b, tip), scene.markerAt(C, tip)});
  }
  scene.gravity({0, -9.81, 0});
  for (int c = 0; c < 3; c++) scene.channel("", Measure::displacement(scene.marker(C), c));
  const PetscErrorCode code = RunScene(run, scene, 2, 1e-6, 0.02, [&](double t, const std::vector<double> &c) {
    const hhtex::PendulumMotion p(w, theta, 0, t);
    judge({c[0], c[1], 0}, {1 + (double)p.sine, -(double)p.cosine, 0}, start);
  });
  judge.judge(run, delta, code);
  PetscFunctionReturn(code);
}

/* A door on two hinges; the axis of the second one is misaligned by an angle */
inline PetscErrorCode Door(Run &run, double angle, hhtdae::Redundant policy)
{
  using namespace hhtdae;
  const double theta = -PETSC_PI / 3, w = std::sqrt(9.81 * 0.5 / (1. / 3));
  Scene        scene(PETSC_COMM_SELF);
  RigidBody    leaf;
  MovesOrStays judge;
  PetscFunctionBegin;
  leaf.inertia         = Vector3(1. / 12, 1. / 12, 1. / 12).asDiagonal();
  leaf.rotation        = Eigen::AngleAxisd(theta - PETSC_PI / 2, Vector3::UnitZ()).toRotationMatrix();
  leaf.position        = 0.5 * leaf.rotation.col(0);
  const Body    b      = scene.add("leaf", leaf);
  const Matrix3 tilted = Eigen::AngleAxisd(angle, Vector3::UnitX()).toRotationMatrix();
  for (int k = 0; k < 2; k++) {
    const Vector3 at(0, 0, k ? 0.5 : -0.5);
    const Matrix3 axes = k ? tilted : Matrix3::Identity();
    scene.add(k ? "upper hinge" : "lower hinge",
              Revolute{scene.markerAt(b, at, axes), scene.marker(scene.ground(), at, axes)});
  }
  scene.gravity({0, -9.81, 0});
  scene.start().redundant = policy;
  for (int c = 0; c < 3; c++) scene.channel("", Measure::displacement(scene.marker(b), c));
  const PetscErrorCode code = RunScene(run, scene, 2, 1e-6, 0.02, [&](double t, const std::vector<double> &c) {
    const hhtex::PendulumMotion p(w, theta, 0, t);
    judge(Eigen::Map<const Vector3>(c.data()), Vector3(0.5 * (double)p.sine, -0.5 * (double)p.cosine, 0),
          leaf.position);
  });
  judge.judge(run, angle, code);
  PetscFunctionReturn(code);
}

/* The pendulum with its constraint given twice, without a scene that could drop a row */
struct TwoRods : hhtex::Pendulum {
  TwoRods() : Pendulum(-60, 1, 1)
  {
    n = 4;
    role.push_back(TSHHT3_HOLONOMIC);
  }
  void initial(double *u, double *v) const override
  {
    Pendulum::initial(u, v);
    u[3] = v[3] = 0;
  }
  void residual(double t, const double *u, const double *v, const double *a, double *f) const override
  {
    Pendulum::residual(t, u, v, a, f);
    for (int i = 0; i < 2; i++) f[i] += u[i] * u[3];
    f[3] = f[2];
  }
  void jacobian(double t, const double *u, const double *v, const double *a, double sv, double sa,
                hhtex::Entries &J) const override
  {
    Pendulum::jacobian(t, u, v, a, sv, sa, J);
    for (PetscInt i = 0; i < 2; i++) {
      J.add(i, i, u[3]);
      J.add(i, 3, u[i]);
      J.add(3, i, u[i]);
    }
  }
  bool reference(double, double *, double *, double *) const override { return false; }
};

inline PetscErrorCode TwoRodsCase(Run &run)
{
  const TwoRods p;
  PetscFunctionBegin;
  PetscCall(ErrorOf(run, p, 1e-6));
  PetscFunctionReturn(0);
}

inline void AddRedundant(Cases &cases)
{
  using hhtdae::Redundant;
  Add(cases, "redundant", "three cranks", "position, exact", 2e-3, [](Run &r) {
    return ThreeCranks(r, 0, false);
  }).test();
  for (double d : {1e-14, 1e-12, 1e-10, 1e-8, 1e-6, 1e-4, 1e-2}) {
    Add(cases, "redundant", Name("three cranks, one %.0e longer", d), "moves or locked, or error", 2e-3, [d](Run &r) {
      return ThreeCranks(r, d, false);
    }).orFail("redundant at the start");
    Add(cases, "redundant", Name("three cranks, one %.0e askew", d), "moves or locked, or error", 2e-3, [d](Run &r) {
      return ThreeCranks(r, d, true);
    }).orFail("redundant at the start");
  }
  for (double d : {0., 1e-14, 1e-12, 1e-9, 1e-6, 1e-3})
    Add(cases, "redundant", d == 0 ? "door on two hinges" : Name("door, hinges %.0e rad apart", d),
        "moves or locked, or error", 2e-3, [d](Run &r) { return Door(r, d, Redundant::Drop); }).orFail("redundant at the start");
  Add(cases, "redundant", "door, refused", "names the element", 2e-3,
      [](Run &r) { return Door(r, 0, Redundant::Refuse); })
      .mustFail("upper hinge")
      .test();
  Add(cases, "redundant", "door, kept", "names the rows", 2e-3, [](Run &r) { return Door(r, 0, Redundant::Keep); })
      .mustFail("depend on one another")
      .test();
  Add(cases, "redundant", "rod given twice, no scene", "names the rows", 2e-3, TwoRodsCase)
      .mustFail("depend on one another");
}

/* ---- singular positions ---- */

/* Judged by the energy that the passage through the flat position may change; the phase, which drifts with the energy,
   is only reported */
inline PetscErrorCode FourBarCase(Run &run, double tolerance)
{
  const hhtex::FourBar p(2, 10);
  ProblemRun           r(p);
  AgainstReference     error(p);
  double               start = 0, drift = 0, largest = 0, turns = 0;
  bool                 begun = false;
  PetscFunctionBegin;
  PetscCall(r.create(run, tolerance));
  r.look = [&](double t, const double *u, const double *v) {
    double T = 0, W = 0;
    for (PetscInt b = 0; b < p.pins(); b += 3) {
      T += (v[b] * v[b] + v[b + 1] * v[b + 1] + p.I * v[b + 2] * v[b + 2]) / 2;
      W += p.g * u[b + 1];
    }
    if (!begun) start = T + W;
    begun   = true;
    largest = std::fmax(largest, T);
    turns   = std::fabs(u[2]) / (2 * PETSC_PI);
    hhtex::Widen(drift, T + W, start);
    error(t, u, v);
  };
  const PetscErrorCode code = run.solve(r.ts);
  run.judge(drift / largest);
  run.note("%.2f turns; coordinates %.1e", turns, error.q);
  PetscFunctionReturn(code);
}

/* The four-bar mechanism as a scene that begins in its flat position, where the direction of motion is not determined */
inline PetscErrorCode FlatStart(Run &run)
{
  using namespace hhtdae;
  Scene     scene(PETSC_COMM_SELF, Space::Planar);
  RigidBody rod;
  PetscFunctionBegin;
  rod.inertia  = Matrix3::Identity() / 12;
  Body    last = scene.ground();
  Vector3 at   = Vector3::Zero();
  for (int k = 0; k < 3; k++) { /* crank to the right, coupler to the right, rocker back */
    const Vector3 step(k < 2 ? 1 : -1, 0, 0);
    rod.position    = at + step / 2;
    const Body next = scene.add("rod " + std::to_string(k), rod);
    scene.add("pin " + std::to_string(k), Revolute{scene.markerAt(next, at), scene.markerAt(last, at)});
    at += step;
    last = next;
  }
  scene.add("pin 3", Revolute{scene.markerAt(last, at), scene.marker(scene.ground(), at)});
  scene.gravity({0, -9.81, 0});
  PetscCall(RunScene(run, scene, 1, 1e-6, 0.1, [](double, const std::vector<double> &) {}));
  PetscFunctionReturn(0);
}

inline PetscErrorCode BricardCase(Run &run)
{
  using namespace hhtdae;
  using Reference = hhtex::BricardReference;
  Reference exact(0.1);
  Scene     scene(PETSC_COMM_SELF);
  Matrix3   axes[3];
  PetscFunctionBegin;
  axes[0] << 0, 0, 1, 1, 0, 0, 0, 1, 0;
  axes[1] << 0, 1, 0, 0, 0, 1, 1, 0, 0;
  axes[2].setIdentity();
  Body                before = scene.ground();
  std::vector<Marker> joints;
  for (int k = 0; k < 6; k++) {
    const Vector3 P    = Reference::point(k);
    Body          next = scene.ground();
    if (k < 5) {
      const Vector3 d = Reference::point(k + 1) - P, along = d.cwiseAbs();
      RigidBody     rod;
      rod.inertia  = (1.01 / 12 * (Vector3::Ones() - along) + 0.01 / 6 * along).asDiagonal();
      rod.position = P + d / 2;
      next         = scene.add("rod " + std::to_string(k), rod);
    }
    joints.push_back(scene.markerAt(before, P, axes[Reference::axis(k)]));
    scene.add("hinge " + std::to_string(k), Revolute{scene.markerAt(next, P, axes[Reference::axis(k)]), joints.back()});
    before = next;
  }
  scene.gravity({0, -9.81, 0});
  for (int k = 2; k < 6; k++)
    for (int c = 0; c < 3; c++) scene.channel("", Measure::displacement(joints[k], c));
  PetscCall(RunScene(run, scene, 10, 1e-6, 0.02, [&](double t, const std::vector<double> &x) {
    Vector3 P[6];
    Reference::points(exact.at(t), P);
    for (int k = 2; k < 6; k++) run.judge((Eigen::Map<const Vector3>(&x[3 * (k - 2)]) - P[k]).norm());
  }));
  PetscFunctionReturn(0);
}

inline void AddSingular(Cases &cases)
{
  for (double eps : {1e-5, 1e-6, 1e-7, 1e-8}) /* 20 rad of motion: global error proportional to eps^(2/3) */
    Add(cases, "singular", Name("four-bar lies flat, eps=%.0e", eps), "energy over the kinetic", Allowed(eps, 24),
        [eps](Run &r) { return FourBarCase(r, eps); });
  Add(cases, "singular", "slider-crank, dead centres", "position, exact", Allowed(1e-6, 60),
      [](Run &r) { return SliderCrankCase(r, 0.3, 1, 1, 12, 5, 1e-6); });
  Add(cases, "singular", "slider-crank, crank = rod", "position, exact", Allowed(1e-6, 12),
      [](Run &r) { return SliderCrankCase(r, 1, 1, 0.5, 6, 2, 1e-6); });
  Add(cases, "singular", "crank = 0.99 rod", "position, exact", Allowed(1e-6, 12),
      [](Run &r) { return SliderCrankCase(r, 0.99, 1, 0.5, 6, 2, 1e-6); });
  Add(cases, "singular", "Bricard, 10 s", "points, exact", 1e-2, BricardCase).paper(AllowedFirstOrder(1e-6, 10));
  Add(cases, "singular", "four-bar begins flat", "says what is singular", 0, FlatStart).mustFail("singular").test();
}

} // namespace hhtstab

#endif
