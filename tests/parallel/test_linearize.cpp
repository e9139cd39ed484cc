/* Modes, mode shapes and responses on all ranks are those of one rank */
#include "hhtdae/linearize.h"
#include "hhtdae/modes.h"
#include "scene_output.h"

using namespace hhtest;

namespace
{

/* Phases of mode shapes are arbitrary where modes nearly coincide, which is not the case for this chain */
std::vector<double> answers(MPI_Comm comm)
{
  Rods                rods(10, comm);
  std::vector<double> all;
  for (int i = 0; i < 10; i++) rods.scene.add("", TorsionalSpringDamper{rods.centre[i], i ? rods.centre[i - 1] : rods.scene.marker(rods.scene.ground()), 400. + 10 * i, 0.2, 0});
  const Variable                    v = rods.scene.variable("v", Measure::distance(rods.tip[9], rods.centre[0]));
  SceneRun                          run(rods.scene, 0.1, tolerance(1e-9) + " -ts_adapt_type none -ts_dt 2e-3 ");
  Linearization                     small;
  std::vector<Mode>                 dense, sparse;
  std::vector<std::complex<double>> h;
  StateSpace                        s;
  must(run.solve());
  must(small.take(run.ts));
  must(small.modes(&dense));
  must(SlowestModes(small, 4, &sparse));
  EXPECT_EQ(dense.size(), 10u);
  for (const auto *modes : {&dense, &sparse})
    for (int i = 0; i < 4; i++) {
      const Mode &m = (*modes)[i];
      BodyPart    p;
      must(small.part(m, rods.body[7], &p));
      for (double x : {m.value.real(), m.value.imag(), std::abs(p.displacement(1)), std::abs(p.rotation(2)), p.share}) all.push_back(x);
    }
  for (const Measure &out : {Measure::displacement(rods.tip[9], 1), Measure::value(v), Measure::jointForce(rods.pin[2], 0)}) {
    must(small.response(Excitation::force(rods.tip[4], {0, 1, 0}), out, {1, 10, 100}, &h));
    for (const auto &x : h) all.insert(all.end(), {x.real(), x.imag()});
  }
  must(small.stateSpace({Excitation::torque(rods.centre[3], {0, 0, 1})}, {Measure::velocity(rods.tip[0], 1)}, &s));
  EXPECT_EQ(s.states, 20);
  double trace = 0;
  for (int i = 0; i < 20; i++) trace += s.A[20 * i + i];
  all.push_back(trace);
  return all;
}

} // namespace

TEST(LinearizeRanks, TheSameAnswers)
{
  const auto one = answers(PETSC_COMM_SELF), all = answers(PETSC_COMM_WORLD);
  ASSERT_EQ(one.size(), all.size());
  for (std::size_t k = 0; k < one.size(); k++) EXPECT_NEAR(one[k], all[k], 1e-6 * std::max(1., std::abs(one[k]))) << k;
}

/* One body is on one rank, and the other ranks have no unknowns: SLEPc's search once waited forever */
TEST(LinearizeRanks, SlowestModesWhereRanksHaveNoUnknowns)
{
  std::vector<Mode> modes[2];
  for (int k = 0; k < 2; k++) {
    Rods rods(1, k ? PETSC_COMM_WORLD : PETSC_COMM_SELF);
    rods.scene.add("", TorsionalSpringDamper{rods.centre[0], rods.scene.marker(rods.scene.ground()), 400., 0.2, 0});
    SceneRun      run(rods.scene, 0.1, "");
    Linearization small;
    must(small.take(run.ts));
    must(SlowestModes(small, 1, &modes[k], 10));
    ASSERT_EQ(modes[k].size(), 1u);
    BodyPart p;
    must(small.part(modes[k][0], rods.body[0], &p));
    EXPECT_NEAR(p.share, 1, 1e-6);
    EXPECT_NEAR(std::abs(p.rotation(2)), 1, 1e-6);
  }
  EXPECT_NEAR(modes[1][0].frequency(), modes[0][0].frequency(), 1e-8 * modes[0][0].frequency());
}
