/* Samples that need a solve give the same values on several ranks as on one */
#include "scene_output.h"

using namespace hhtest;

namespace
{

/* Reactions, accelerations and a variable between long steps, and the state at the end of the run; dt < 0: no samples */
void samples(MPI_Comm comm, double dt, const std::string &file, Array &end)
{
  Rods   rods(5, comm);
  Scene &s = rods.scene;
  Vec    U;
  SpringDamper spring{rods.tip[4], s.marker(s.ground(), {3, -3, 0}), 40, 1, 1};
  spring.state         = true;
  const Element  pull  = s.add("spring", spring);
  const Variable v     = s.variable("v", Expression({Measure::jointForce(rods.pin[1], 1), Measure::force(pull, 0)},
                                                    [](const Real *m) -> Real { return m[0] + 2. * m[1]; }));
  for (int k : {0, 2, 4}) {
    const std::string n = std::to_string(k);
    s.channel("f" + n, Measure::jointForce(rods.pin[k], 1), "N");
    s.channel("m" + n, Measure::multiplier(rods.pin[k], 0), "N");
    s.channel("a" + n, Measure::acceleration(rods.tip[k], 1, rods.tip[(k + 2) % 5]), "m/s^2");
  }
  s.channel("pull", Measure::force(pull, 0), "N");
  s.channel("v", Measure::value(v));
  SceneRun run(s, 0.5, tolerance(1e-4) + "-ts_hhtdae_corrector_tolerance 1e-6" +
                           (dt < 0 ? std::string() : text(" -scene_dt %g -scene_csv ", dt) + file));
  must(run.solve());
  must(TSGetSolution(run.ts, &U));
  end = whole(U);
}

} // namespace

TEST(SceneSamples, AsOnOneRank)
{
  PetscMPIInt rank;
  MPI_Comm_rank(PETSC_COMM_WORLD, &rank);
  TemporaryFile all("all.csv"), one("one.csv");
  Array         sampled, alone, serial;
  samples(PETSC_COMM_WORLD, 0.0037, all.name, sampled);
  samples(PETSC_COMM_WORLD, -1, "", alone);
  EXPECT_EQ(sampled, alone); /* sampling does not change the run */
  samples(PETSC_COMM_SELF, 0.0037, one.name, serial);
  if (rank) return;
  const CSV a(all.text()), b(one.text());
  ASSERT_EQ(a.name, b.name);
  ASSERT_EQ(a.row.size(), b.row.size());
  for (std::size_t c = 1; c < a.name.size(); c++) {
    double largest = 1, difference = 0;
    for (std::size_t k = 0; k < a.row.size(); k++) {
      widen(largest, std::abs(b.row[k][c]));
      widen(difference, std::abs(a.row[k][c] - b.row[k][c]));
    }
    EXPECT_LT(difference, 1e-6 * largest) << a.name[c];
  }
}
