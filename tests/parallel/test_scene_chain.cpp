/* Scenes on all ranks together and on each rank alone: every body has the same motion */
#include "hhtdae/scene.h"
#include "scene/model.h"
#include "scene_output.h"

using namespace hhtest;

namespace
{

using Build = std::function<void(Scene &)>;

struct ChainEnd {
  Array            x, v; /* of markers at the centre and off the centre of all bodies, in their order */
  TSHHT3Statistics s;
};

Body addRod(Scene &scene, const Vector3 &from, const Vector3 &to)
{
  RigidBody     b;
  const Vector3 x = (to - from).normalized(), y = x.unitOrthogonal();
  b.inertia  = Vector3(0.01, 1. / 12, 1. / 12).asDiagonal();
  b.position = (from + to) / 2;
  b.rotation << x, y, x.cross(y);
  return scene.add("", b);
}

ChainEnd run(MPI_Comm comm, Space space, const Build &build, double end, const std::string &options)
{
  Scene scene(comm, space);
  build(scene);
  const int            directions = space == Space::Planar ? 2 : 3;
  const PetscInt       bodies     = (PetscInt)DataOf(scene).bodies.size();
  std::vector<Measure> velocity;
  for (PetscInt b = 0; b < bodies; b++)
    for (double side : {0., 0.3}) {
      const Body   body{b};
      const Marker m =
          scene.marker(body, DataOf(scene).bodies[b].point ? Vector3::Zero()
                                                          : Vector3(side, side, space == Space::Planar ? 0 : -side));
      for (int k = 0; k < directions; k++) {
        scene.channel("x" + std::to_string(velocity.size()), Measure::displacement(m, k));
        velocity.push_back(Measure::velocity(m, k));
      }
    }
  for (std::size_t k = 0; k < velocity.size(); k++) scene.channel("v" + std::to_string(k), velocity[k]);
  SceneRun            r(scene, end, options);
  ChainEnd                 e;
  std::vector<double> all;
  must(r.solve());
  must(scene.sample(r.ts, end, all));
  must(TSHHT3GetStatistics(r.ts, &e.s));
  e.x.assign(all.begin(), all.begin() + all.size() / 2);
  e.v.assign(all.begin() + all.size() / 2, all.end());
  return e;
}

ChainEnd compare(const char *what, Space space, const Build &build, double end, int steps, const char *more = "")
{
  constexpr double  q       = 1e-10;
  const std::string options = fixedSteps(end / steps) + "-ts_hhtdae_corrector_tolerance 1e-7 -ts_hhtdae_alpha -0.1 " + more;
  int               size, rank;
  MPI_Comm_size(PETSC_COMM_WORLD, &size);
  MPI_Comm_rank(PETSC_COMM_WORLD, &rank);
  const ChainEnd all   = run(PETSC_COMM_WORLD, space, build, end, options),
            self  = run(PETSC_COMM_SELF, space, build, end, options);
  const double dx = relativeDifference(all.x, self.x), dv = relativeDifference(all.v, self.v);
  if (rank == 0)
    MEASURED("%s on %d ranks: differs by %.1e in positions, %.1e in velocities; %d steps, %d changes of axes", what,
             size, dx, dv, (int)all.s.steps, (int)all.s.changes);
  EXPECT_EQ(all.s.steps, self.s.steps);
  EXPECT_EQ(all.s.changes, self.s.changes);
  EXPECT_LT(dx, q);
  EXPECT_LT(dv, 10 * q);
  /* the bodies have moved */
  const ChainEnd start = run(PETSC_COMM_SELF, space, build, end / steps, options);
  EXPECT_GT(relativeDifference(all.x, start.x), 1e-3);
  return all;
}

template <class Joint> Build hanging(int n)
{
  return [n](Scene &scene) {
    scene.gravity({0, -9.81, 0});
    Marker last = scene.marker(scene.ground());
    for (int k = 0; k < n; k++) {
      const Body b = addRod(scene, {1. * k, 0, 0}, {k + 1., 0, 0});
      scene.add("", Joint{scene.markerAt(b, {1. * k, 0, 0}), last});
      last = scene.markerAt(b, {k + 1., 0, 0});
    }
  };
}

/* Knots of point masses, connected by rods on ball joints and held along one side: rows x columns closed loops */
void net(Scene &scene, int rows, int columns)
{
  std::vector<Marker> knot(columns);
  scene.gravity({1, -9.81, 0.5});
  for (int r = 0; r <= rows; r++)
    for (int c = 0; c < columns; c++) {
      const Vector3 x(c, 0, r);
      const Marker  above = knot[c];
      if (r == 0) {
        knot[c] = scene.marker(scene.ground(), x);
        continue;
      }
      PointMass p;
      p.position     = x;
      knot[c]        = scene.marker(scene.add("", p));
      const auto tie = [&](const Vector3 &from, Marker to) {
        const Body b = addRod(scene, from, x);
        scene.add("", Spherical{scene.markerAt(b, from), to});
        scene.add("", Spherical{scene.markerAt(b, x), knot[c]});
      };
      tie(x - Vector3::UnitZ(), above);
      if (c > 0) tie(x - Vector3::UnitX(), knot[c - 1]);
    }
}

/* Joints of several kinds, a motion, springs across the scene (one as a force state), contact, a variable and a
   first-order state */
void mixed(Scene &scene)
{
  const Body ground = scene.ground();
  scene.gravity({0.2, 0.1, -9.81});
  const Marker floor = scene.marker(ground);
  const auto   box   = [&](const Vector3 &x, const Vector3 &w, const Vector3 &v = Vector3::Zero()) {
    RigidBody b;
    b.inertia          = Vector3(0.1, 0.2, 0.3).asDiagonal();
    b.position         = x;
    b.angular_velocity = w;
    b.velocity         = v;
    return scene.add("", b);
  };
  /* a driven crank, and a chain of three joints connected to it */
  const Body crank = box({0, 0, 5}, {0, 0, 2});
  scene.add("", Revolute{scene.marker(crank), scene.marker(ground, {0, 0, 5})});
  scene.add("", RotationalMotion{scene.marker(crank), scene.marker(ground, {0, 0, 5}),
                                 TimeFunction::polynomial({0, 2, 0.5})});
  const Body a = box({1.5, 0, 5}, {0, 0, 2}, {0, 3, 0}), b = box({2.5, 0, 5}, {0, 0, 2}, {0, 5, 0}),
             c  = box({3.5, 0, 5}, {0, 0, 2}, {0, 7, 0});
  const auto at = [&](Body i, double x, const Matrix3 &R = Matrix3::Identity()) {
    return scene.markerAt(i, {x, 0, 5}, R);
  };
  Matrix3 X;
  X << 0, 0, 1, 1, 0, 0, 0, 1, 0;
  scene.add("", Universal{at(a, 1), at(crank, 1, X)});
  scene.add("", Cylindrical{at(b, 2, X), at(a, 2, X)});
  scene.add("", Spherical{at(c, 3), at(b, 3)});
  const Element pull = scene.add("", SpringDamper{at(b, 2.5), at(a, 1.5), 200, 3, -1, 0, true});
  /* balls that fall onto each other and onto the floor */
  std::vector<Marker> balls;
  ContactLaw          law;
  law.stiffness     = 2e4;
  law.damping       = 0.2;
  law.friction      = 0.3;
  law.slip_velocity = 0.05;
  for (int k = 0; k < 4; k++) {
    const Body ball = box({0.05 * k, 0.02 * k, 0.55 + 1.05 * k}, {1, 0.3 * k, 0});
    balls.push_back(scene.marker(ball));
    scene.add("", SpherePlane{balls[k], floor, 0.5, law});
    if (k > 0) scene.add("", SphereSphere{balls[k], balls[k - 1], 0.5, 0.5, law});
  }
  /* springs across the scene, and a force that depends on a state */
  scene.add("", SpringDamper{at(c, 4), balls[3], 5, 0.1});
  scene.add("", SpringDamper{at(a, 1.7), balls[0], 3});
  const Variable d =
      scene.variable("stretch", Expression{{Measure::distance(at(c, 4), balls[1]), Measure::force(pull, 0)},
                                           [](const Real *m) -> Real { return m[0] + m[1] * 0.01; }});
  const State s =
      scene.state("lag", Expression{{Measure::value(d)}, [](const Real *m) -> Real { return (m[0] - 4.) * 0.5; }}, 0);
  scene.add("", UserScalarForce{at(c, 3.5), balls[2],
                                Expression{{Measure::value(s)}, [](const Real *m) -> Real { return m[0] * -2.; }}});
}

/* Bodies that turn over, connected by springs: new references of rotation vectors, or new axes of Euler angles, on one
   rank, which other ranks read */
void turning(Scene &scene)
{
  Marker last = scene.marker(scene.ground());
  for (int k = 0; k < 5; k++) {
    RigidBody b;
    b.inertia          = Vector3(0.1, 0.2, 0.3).asDiagonal();
    b.position         = {1. + k, 0, 0};
    b.angular_velocity = {0.4, 4 - 0.5 * k, 0.4};
    const Body B       = scene.add("", b);
    scene.add("", SpringDamper{scene.marker(B, {-0.3, 0.1, 0}), last, 4, 0.05});
    last = scene.marker(B, {0.3, 0, 0.2});
  }
}

} // namespace

TEST(SceneRanks, ChainOfRevolutes)
{
  compare("chain of 20 on revolutes", Space::Spatial, hanging<Revolute>(20), 0.4, 80);
}

TEST(SceneRanks, ChainOfBalls)
{
  compare("chain of 20 on ball joints", Space::Spatial, hanging<Spherical>(20), 0.4, 80);
}

TEST(SceneRanks, PlanarChain) { compare("planar chain of 30", Space::Planar, hanging<Revolute>(30), 0.4, 80); }

TEST(SceneRanks, Net)
{
  compare(
      "net of 4 x 5", Space::Spatial, [](Scene &s) { net(s, 4, 5); }, 0.5, 100);
}

/* Past attitudes of bodies on every rank; some bodies rotate too far for order 5 */
TEST(SceneRanks, HigherOrder)
{
  const ChainEnd e = compare("net of 4 x 5, order 5", Space::Spatial, [](Scene &s) { net(s, 4, 5); }, 0.5, 100, "-ts_hhtdae_order 5 ");
  EXPECT_GT(e.s.of_order[5], 80);
  const ChainEnd t = compare("bodies turning over, order 5", Space::Spatial, turning, 2.4, 160, "-ts_hhtdae_order 5 ");
  EXPECT_GT(t.s.of_order[3] + t.s.of_order[4] + t.s.of_order[5], 50);
}

TEST(SceneRanks, Mixed) { compare("mixed scene", Space::Spatial, mixed, 0.2, 400); }

TEST(SceneRanks, BodiesTurningOver)
{
  for (Rotations rotations : {Rotations::Local, Rotations::Euler313}) {
    const auto with = [=](Scene &s) {
      s.start().rotations = rotations;
      turning(s);
    };
    const ChainEnd e = compare(rotations == Rotations::Local ? "bodies turning over" : "the same in Euler angles", Space::Spatial, with, 2.4, 160);
    EXPECT_EQ(e.s.changes > 0, rotations == Rotations::Euler313);
  }
}

/* Under error control the sequence of steps may differ because of rounding: results agree to the tolerance, with the
   same axes of the angles */
TEST(SceneRanks, ChosenSteps)
{
  const std::string options = tolerance(1e-6);
  const ChainEnd         all     = run(PETSC_COMM_WORLD, Space::Spatial, hanging<Spherical>(8), 0.5, options),
            self            = run(PETSC_COMM_SELF, Space::Spatial, hanging<Spherical>(8), 0.5, options);
  EXPECT_NEAR((double)all.s.steps, (double)self.s.steps, 3);
  EXPECT_LT(relativeDifference(all.x, self.x), 1e-6);
}
