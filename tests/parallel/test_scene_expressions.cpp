/* Variables, states and user's forces whose arguments are on other ranks: the same run on all ranks together and on
   each rank alone */
#include "hhtdae/scene.h"
#include "scene/runtime.h"
#include "support.h"

using namespace hhtdae;
using namespace hhtest;

namespace
{

constexpr int bodies = 7;

struct Chain {
  Scene                scene;
  std::vector<Marker>  tip;
  std::vector<Element> pin;

  explicit Chain(MPI_Comm comm) : scene(comm)
  {
    scene.gravity({0, -9.81, 0});
    Marker last = scene.marker(scene.ground());
    for (int k = 0; k < bodies; k++) {
      RigidBody b;
      b.inertia         = Vector3(.02, .1, .09).asDiagonal();
      b.position        = {k + .5, .1 * k, 0};
      const Body   body = scene.add("", b);
      const Marker root = scene.markerAt(body, {(double)k, .1 * k, 0});
      if (k) last = scene.markerAt(Body{body.id - 1}, {(double)k, .1 * k, 0});
      if (k % 2)
        pin.push_back(scene.add("", Spherical{root, last}));
      else
        pin.push_back(scene.add("", Revolute{root, last}));
      tip.push_back(scene.marker(body, {.4, .1, .1 * k}));
    }
    describe();
  }

private:
  void describe()
  {
    /* weak, because forces that depend on accelerations and multipliers have a unique solution only if the gain of
       this loop is smaller than the masses */
    const auto     wave = [](const Real *m) -> Real { return sin(.1 * m[0]) + .01 * m[1]; };
    const Variable far  = scene.variable(
         "far", Expression{{Measure::acceleration(tip[6], 1, tip[0], tip[3]), Measure::multiplier(pin[5], 1)}, wave});
    const State slow = scene.state("slow", Expression{{Measure::value(far), Measure::rate(tip[1], tip[5])}, wave}, .1);
    scene.variable("reaction", Measure::jointMoment(pin[3], 1, tip[6]));
    scene.variable("of multipliers",
                   Expression{{Measure::multiplier(pin[0], 2), Measure::multiplier(pin[6], 0)}, wave});
    for (bool state : {false, true}) {
      scene.add("", UserScalarForce{tip[0], tip[6],
                                    Expression{{Measure::distance(tip[2], tip[4]), Measure::value(slow)}, wave}, false,
                                    state});
      UserForce f;
      f.i = tip[5], f.j = tip[1], f.frame = tip[3], f.state = state;
      for (int c = 0; c < 3; c++)
        f.force.push_back(Expression{{Measure::velocity(tip[6], c), Measure::value(far)}, wave});
      const Element e = scene.add("", f);
      if (state) scene.variable("component", Measure::force(e, 1));
    }
  }
};

/* Coordinates, velocities and accelerations of the bodies, then variables and states, in the order of the description */
Array run(MPI_Comm comm)
{
  Chain c(comm);
  TS    ts;
  Vec   U, V, A;
  must(c.scene.createTS(&ts));
  must(TSSetMaxTime(ts, .2));
  Options in(fixedSteps(.002) + "-ts_hhtdae_corrector_tolerance 1e-10 ");
  must(TSSetFromOptions(ts));
  must(c.scene.solve(ts));
  must(TS2GetSolution(ts, &U, &V));
  must(TSHHT3GetAcceleration(ts, &A));
  const Numbering &N = ModelOf(c.scene).number;
  const Array      u = whole(U), v = whole(V), a = whole(A);
  Array            all;
  for (const Array *x : {&u, &v, &a})
    for (PetscInt first : N.body) all.insert(all.end(), x->begin() + first, x->begin() + first + 6);
  for (const auto *list : {&N.variable, &N.state})
    for (PetscInt number : *list) all.push_back(u[number]);
  must(TSDestroy(&ts));
  return all;
}

} // namespace

TEST(SceneExpressions, SameOnAnyNumberOfRanks)
{
  int size, rank;
  MPI_Comm_size(PETSC_COMM_WORLD, &size);
  MPI_Comm_rank(PETSC_COMM_WORLD, &rank);
  const Array all = run(PETSC_COMM_WORLD), alone = run(PETSC_COMM_SELF);
  ASSERT_EQ(all.size(), alone.size());
  const std::size_t n    = 6 * bodies;
  const auto        part = [&](const Array &x, std::size_t from, std::size_t to) {
    return Array(x.begin() + from, x.begin() + to);
  };
  const auto differ = [&](std::size_t from, std::size_t to) {
    return relativeDifference(part(all, from, to), part(alone, from, to));
  };
  const double q = differ(0, n), v = differ(n, 2 * n), a = differ(2 * n, 3 * n), other = differ(3 * n, all.size());
  if (rank == 0)
    MEASURED("%d ranks: differ by %.1e in q, %.1e in q', %.1e in q'', %.1e in variables and states", size, q, v, a,
             other);
  EXPECT_LT(q, 1e-9);
  EXPECT_LT(v, 1e-9);
  EXPECT_LT(a, 1e-7);
  EXPECT_LT(other, 1e-7);
}
