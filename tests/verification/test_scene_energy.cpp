/* Energy and momentum of scenes, from their channels and from -scene_balance */
#include "scene_output.h"

using namespace hhtest;

namespace
{

double Spread(const Array &a)
{
  return *std::max_element(a.begin(), a.end()) - *std::min_element(a.begin(), a.end());
}

/* Value of key=... in a line */
double Figure(const std::string &text, const std::string &key)
{
  const std::size_t at = text.find(" " + key + "=");
  if (at == std::string::npos) throw std::runtime_error("no " + key + " in: " + text);
  return std::stod(text.substr(at + key.size() + 2));
}

const std::string conserving = " -ts_hhtdae_alpha -0.02 "; /* little damping; without any the method is weakly unstable with constraints */

} // namespace

/* A double pendulum: kinetic and potential energy exchange about 10 J, and the error of their sum decreases with the
   tolerance */
TEST(SceneEnergy, OfADoublePendulum)
{
  double before = 1e300;
  for (double eps : {1e-5, 1e-7}) {
    TemporaryFile file("energy.csv"), sheet("balance.csv");
    Rods          rods(2);
    rods.scene.channel("kinetic", energy(Measure::KineticEnergy), "J");
    rods.scene.channel("potential", energy(Measure::PotentialEnergy), "J");
    SceneRun run(rods.scene, 2, tolerance(eps) + conserving + "-scene_dt 0.01 -scene_csv " + file.name + " -scene_balance " + sheet.name);
    Printed  printed;
    must(run.solve());
    const CSV   table(file.text());
    const Array T = table.column("kinetic"), V = table.column("potential");
    Array       E;
    for (std::size_t k = 0; k < T.size(); k++) E.push_back(T[k] + V[k]);
    ASSERT_EQ(E.size(), 201u);
    EXPECT_EQ(T[0], 0);
    EXPECT_NEAR(V[0], 0, 1e-12);
    EXPECT_GT(Spread(T), 10);
    EXPECT_LT(Spread(E), eps == 1e-5 ? 0.1 : 0.005);
    EXPECT_LT(Spread(E), before);
    before = Spread(E);
    /* the file of -scene_balance has the same values at the ends of steps */
    const CSV balance(sheet.text());
    EXPECT_GT(balance.row.size(), 100u);
    EXPECT_NEAR(std::abs(Figure(printed.text(), "drift")), Spread(balance.column("total")), 2 * Spread(E));
    EXPECT_LE(Spread(balance.column("total")), 2 * Spread(E));
    MEASURED("double pendulum, tolerance %g: energy changes by %.2e J of %.1f J that are exchanged", eps, Spread(E), Spread(T));
  }
}

/* Two tumbling bodies connected by a spring, in free flight without gravity: momentum, angular momentum and energy are
   conserved */
TEST(SceneEnergy, OfBodiesThatTumbleOnASpring)
{
  TemporaryFile sheet("tumble.csv");
  Scene         scene(PETSC_COMM_SELF);
  RigidBody     a, b;
  a.mass = 2, b.mass = 3;
  a.inertia          = Vector3(0.4, 0.5, 0.7).asDiagonal();
  b.inertia          = Vector3(0.9, 0.3, 0.8).asDiagonal();
  b.position         = {2, 0.3, 0.1};
  a.velocity         = {0.1, 1, 0.2};
  a.angular_velocity = {1, 0.5, -0.7};
  b.angular_velocity = {-0.3, 0.8, 0.4};
  const Body A = scene.add("a", a), B = scene.add("b", b);
  scene.add("spring", SpringDamper{scene.marker(A, {0.2, 0.3, 0}), scene.marker(B, {-0.1, 0, 0.4}), 20, 0, 1});
  SceneRun run(scene, 3, tolerance(1e-8) + conserving + "-scene_balance " + sheet.name);
  {
    Printed printed;
    must(run.solve());
    EXPECT_LT(std::abs(Figure(printed.text(), "drift")), 3e-4);
  }
  const CSV balance(sheet.text());
  /* by hand: m v, and r x m v + A I A^T w of both */
  const Vector3 L = a.inertia * a.angular_velocity + b.inertia * b.angular_velocity;
  const char   *name[]  = {"px", "py", "pz", "Lx", "Ly", "Lz"};
  const double  start[] = {0.2, 2, 0.4, L(0), L(1), L(2)};
  for (int k = 0; k < 6; k++) {
    const Array c = balance.column(name[k]);
    EXPECT_NEAR(c[0], start[k], 1e-8) << name[k];
    EXPECT_LT(Spread(c), k < 3 ? 1e-7 : 1e-4) << name[k];
  }
  EXPECT_GT(Spread(balance.column("elastic")), 0.1);
  EXPECT_LT(Spread(balance.column("total")), 3e-4);
  MEASURED("tumbling pair: energy changes by %.2e J of %.2f J, angular momentum by %.2e", Spread(balance.column("total")),
           Spread(balance.column("kinetic")), Spread(balance.column("Lz")));
}

/* A damper decreases the total energy; without it no loss is reported */
TEST(SceneEnergy, ADamperTakesEnergy)
{
  TemporaryFile sheet("damper.csv");
  Rods          rods(1);
  rods.scene.add("damper", TorsionalSpringDamper{rods.centre[0], rods.scene.marker(rods.scene.ground()), 0, 2});
  SceneRun run(rods.scene, 2, tolerance(1e-6) + "-scene_balance " + sheet.name);
  Printed  printed;
  must(run.solve());
  const Array E = CSV(sheet.text()).column("total");
  for (std::size_t k = 1; k < E.size(); k++) EXPECT_LE(E[k], E[k - 1] + 1e-6);
  EXPECT_LT(E.back(), -3);
}
