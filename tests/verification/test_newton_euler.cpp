/* The laws of Newton and Euler for every body, computed from channels only: each type of joint, motion and force, and
   the scenes of the examples */
#include "balance_scenes.h"
#include "bricard_model.h"
#include "chain_model.h"
#include "doublependulum_model.h"
#include "flexcrank_model.h"
#include "flyball_model.h"
#include "heavytop_model.h"
#include "hhtdae/scene.h"
#include "quartercar_model.h"
#include "rollingball_model.h"
#include "scene_output.h"
#include "slidercrank3d_model.h"

using namespace hhtest;

namespace
{

const std::string sharp = tolerance(1e-6) + " -ts_hhtdae_corrector_tolerance 1e-9 ";

/* Result of a run: the worst balance at all ends of steps, the work of all loads by the trapezoidal rule over the
   steps, changes of the energies */
struct Judged {
  Imbalance           worst;
  double              at    = 0; /* time of the worst balance */
  int                 steps = 0;
  Powers              work;
  double              kinetic = 0, potential = 0; /* changes since the start */
  std::vector<double> acted;                      /* largest load of each element */
};

struct Watcher {
  Scene              &scene;
  NewtonEuler        &laws;
  int                 kinetic, potential; /* indices of channels */
  Judged              result;
  double              t = 0;
  Powers              before;
  std::vector<double> first;
};

void AddWork(Watcher &w, double h, const Powers &now)
{
  const auto add = [&](double Powers::*p) { w.result.work.*p += 0.5 * h * (w.before.*p + now.*p); };
  for (double Powers::*p :
       {&Powers::joints, &Powers::motions, &Powers::forces, &Powers::gravity, &Powers::of_joints, &Powers::absolute})
    add(p);
}

PetscErrorCode Watch(TS ts, PetscInt step, PetscReal t, Vec, void *ctx)
{
  Watcher            &w = *static_cast<Watcher *>(ctx);
  std::vector<double> values;
  PetscFunctionBegin;
  if (step == 0) PetscFunctionReturn(0);
  if (step == 1) { /* the start is the beginning of the first step */
    PetscCall(w.scene.sample(ts, 0, w.first));
    w.before       = w.laws.powers(w.first);
    w.result.acted = w.laws.magnitudes(w.first);
  }
  PetscCall(w.scene.sample(ts, t, values));
  const Imbalance now = w.laws.judge(values);
  if (now.largest > w.result.worst.largest) {
    w.result.worst = now;
    w.result.at    = t;
  }
  const Powers              power = w.laws.powers(values);
  const std::vector<double> acts  = w.laws.magnitudes(values);
  for (std::size_t e = 0; e < acts.size(); e++) w.result.acted[e] = std::max(w.result.acted[e], acts[e]);
  AddWork(w, t - w.t, power);
  w.result.kinetic   = values[(std::size_t)w.kinetic] - w.first[(std::size_t)w.kinetic];
  w.result.potential = values[(std::size_t)w.potential] - w.first[(std::size_t)w.potential];
  w.before           = power;
  w.t                = t;
  w.result.steps++;
  PetscFunctionReturn(0);
}

Judged judge(Scene &scene, const Specs &specs, double end, const std::string &options)
{
  NewtonEuler laws(scene, specs);
  EXPECT_TRUE(laws.unknown().empty()) << "no loads of a " << laws.unknown().front();
  EXPECT_GT(laws.judged(), 0);
  const int kinetic   = scene.channel("kinetic energy", energy(Measure::KineticEnergy)).id;
  const int potential = scene.channel("potential energy", energy(Measure::PotentialEnergy)).id;
  Watcher   w{scene, laws, kinetic, potential, {}, 0, {}, {}};
  SceneRun  run(scene, end, options);
  must(TSMonitorSet(run.ts, Watch, &w, nullptr));
  must(run.solve());
  EXPECT_GT(w.result.steps, 1); /* a ball that rolls uniformly needs two steps */
  return w.result;
}

/* Every body is in balance; the work of all loads together is the increase of kinetic energy; joints do no work */
Judged balances(const std::string &name, Scene &scene, const Specs &specs, double end)
{
  SCOPED_TRACE(name);
  const Judged j      = judge(scene, specs, end, sharp);
  const double left   = (j.work.all() - j.kinetic) / j.work.absolute,
               joints = j.work.of_joints > 0 ? j.work.joints / j.work.of_joints : 0;
  MEASURED("%s: %d steps, out of balance by %.1e (%s); work less energy %.1e, work of joints %.1e", name.c_str(),
           j.steps, j.worst.largest, j.worst.where.c_str(), left, joints);
  EXPECT_LT(j.worst.largest, 1e-6) << j.worst.where << " at t = " << j.at;
  EXPECT_LT(std::abs(left), 1e-3);
  EXPECT_LT(std::abs(joints), 1e-3);
  return j;
}

void balance(const std::vector<BalanceCase> &cases)
{
  for (const BalanceCase &c : cases) {
    BalanceScene s(c.planar);
    c.make(s);
    const Judged j = balances(c.name, *s.scene, s.specs, 0.5);
    for (std::size_t e = 0; e < j.acted.size(); e++)
      EXPECT_GT(j.acted[e], 1e-3) << DataOf(*s.scene).elements[e].type << " of " << c.name << " does not act";
  }
}

} // namespace

TEST(NewtonEuler, OfBodiesOnEveryJoint) { balance(JointCases()); }
TEST(NewtonEuler, OfBodiesUnderEveryForce) { balance(ForceCases()); }

/* The decrease of potential energy is the work of its forces */
TEST(NewtonEuler, WorkIsWhatThePotentialLoses)
{
  for (const BalanceCase &c : PotentialCases()) {
    SCOPED_TRACE(c.name);
    BalanceScene s(c.planar);
    c.make(s);
    const Judged j    = judge(*s.scene, s.specs, 0.5, sharp);
    const double left = (j.work.forces + j.work.gravity + j.potential) / j.work.absolute;
    MEASURED("%s: work and potential energy %.1e of the work", c.name.c_str(), left);
    EXPECT_LT(std::abs(left), 1e-3);
    EXPECT_GT(std::abs(j.potential), 0.01 * j.work.absolute);
  }
}

TEST(NewtonEuler, OfTheExamples)
{
  const Specs    none;
  const auto     look = [&](const std::string &name, Scene &scene, double end) { balances(name, scene, none, end); };
  hhtex::Bricard bricard(1, PETSC_COMM_SELF);
  look("bricard", bricard.scene, 1);
  for (bool spherical : {false, true}) {
    Scene chain(PETSC_COMM_SELF), net(PETSC_COMM_SELF);
    chain.gravity({1, -9.81, 2}); /* out of the plane too, so that the chain moves in space; hinges rotate about z */
    net.gravity({2, -9.81, 3});
    hhtex::AddChain(chain, 5, spherical);
    look(spherical ? "chain of balls" : "chain of hinges", chain, 0.5);
    hhtex::AddNet(net, 3, 3);
    if (spherical) look("net", net, 0.5);
    for (bool planar : {false, true})
      if (!planar || !spherical) {
        hhtex::DoublePendulumScene pendulum(spherical, planar, PETSC_COMM_SELF);
        look(planar ? "double pendulum, planar" : "double pendulum", pendulum.scene, 1);
      }
  }
  hhtex::Flyball flyball(8e5, 4e4, PETSC_COMM_SELF);
  look("flyball", flyball.scene, 0.3);
  hhtex::FastTop fast(PETSC_COMM_SELF);
  look("fast top", fast.scene, 0.1);
  hhtex::TumblingTop tumbling(PETSC_COMM_SELF);
  look("tumbling top", tumbling.scene, 1);
  hhtex::RollingBall ball(0.2, PETSC_COMM_SELF);
  look("rolling ball", ball.scene, 1);
  hhtex::LeaningDisc disc(0.2, 1, PETSC_COMM_SELF);
  look("leaning disc", disc.scene, 0.5);
  hhtex::SpatialSliderCrank crank(6, PETSC_COMM_SELF);
  look("slider-crank", crank.scene, 1);
}

/* No channel shows the inertia of a flexible body. The crank and the slider are judged, and that the massless frames
   of attachments transmit all forces to the flexible body */
TEST(NewtonEuler, OfAFlexibleCrank)
{
  hhtex::FlexCrank crank(ModalMass::Full, PETSC_COMM_SELF);
  const Judged     j = judge(crank.scene, Specs(), 0.01, sharp);
  MEASURED("flexible crank: %d steps, out of balance by %.1e (%s)", j.steps, j.worst.largest, j.worst.where.c_str());
  EXPECT_LT(j.worst.largest, 1e-6) << j.worst.where << " at t = " << j.at;
}

TEST(NewtonEuler, OfTheQuarterCar)
{
  hhtex::QuarterCarReference::Parameters p;
  p.road = TimeFunction::step(0.1, 0, 0.25, 0.05);
  for (bool torus : {false, true}) {
    hhtex::QuarterCar car(p, torus, PETSC_COMM_SELF);
    Specs             specs;
    const auto       &all = DataOf(car.scene).elements;
    for (std::size_t e = 0; e < all.size(); e++) {
      if (torus && all[e].name == "tire")
        specs.keep(Element{(PetscInt)e}, TorusPlane{all[e].i, all[e].j, car.radius - 0.1, 0.1, {}});
      if (!torus && all[e].name == "tire")
        specs.keep(Element{(PetscInt)e}, SpherePlane{all[e].i, all[e].j, car.radius, {}});
    }
    balances(torus ? "quarter car on a torus" : "quarter car on a sphere", car.scene, specs, 0.5);
  }
}
