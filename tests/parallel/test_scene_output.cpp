/* Results of a scene on several ranks equal those of one rank: channels with markers on different ranks, energies, frames */
#include "scene_output.h"

using namespace hhtest;

namespace
{

/* A chain of rods with every kind of channel, some of them between distant bodies */
void Record(MPI_Comm comm, const std::string &csv, const std::string &sheet, const std::string &film, std::string &said)
{
  Rods    rods(6, comm);
  Scene  &s = rods.scene;
  Element spring = s.add("spring", SpringDamper{rods.tip[5], s.marker(s.ground(), {3, -3, 0}), 40, 1, 1});
  for (int k : {0, 3, 5}) {
    const std::string n = std::to_string(k);
    s.channel("y" + n, Measure::displacement(rods.tip[k], 1), "m");
    s.channel("v" + n, Measure::velocity(rods.tip[k], 0, rods.centre[5 - k], rods.centre[2]), "m/s");
    s.channel("a" + n, Measure::acceleration(rods.tip[k], 1, rods.tip[(k + 3) % 6]), "m/s^2");
    s.channel("f" + n, Measure::jointForce(rods.pin[k], 1), "N");
    s.channel("m" + n, Measure::multiplier(rods.pin[k], 0), "N");
    s.channel("w" + n, Measure::angularVelocity(rods.tip[k], 2), "rad/s");
  }
  s.channel("far", Measure::distance(rods.tip[5], rods.tip[0]), "m");
  s.channel("angle", Measure::angle(rods.tip[5], rods.tip[0]), "rad");
  s.channel("tension", Measure::force(spring, 0), "N");
  s.channel("kinetic", energy(Measure::KineticEnergy), "J");
  s.channel("potential", energy(Measure::PotentialEnergy), "J");
  s.channel("time again", Measure::time());
  SceneRun run(s, 0.2, fixedSteps(0.004) + "-ts_hhtdae_corrector_tolerance 1e-6 -scene_dt 0.01 -scene_csv " + csv + " -scene_balance " + sheet +
                         " -scene_animation_dt 0.2 -scene_animation " + film);
  Printed  printed;
  must(run.solve());
  said = printed.text();
}

} // namespace

TEST(SceneOutput, AsOnOneRank)
{
  PetscMPIInt rank;
  MPI_Comm_rank(PETSC_COMM_WORLD, &rank);
  /* each rank has file names of its own; files with the first rank's names are written */
  TemporaryFile csv("all.csv"), one("one.csv"), sheet("all.sheet"), sheet_one("one.sheet");
  TemporaryFile pvd("all.pvd"), frame0("all_000000.vtp"), frame1("all_000001.vtp");
  TemporaryFile pvd1("one.pvd"), one0("one_000000.vtp"), one1("one_000001.vtp");
  std::string   said;
  Record(PETSC_COMM_WORLD, csv.name, sheet.name, pvd.name.substr(0, pvd.name.size() - 4), said);
  EXPECT_EQ(csv.exists(), rank == 0);
  Record(PETSC_COMM_SELF, one.name, sheet_one.name, pvd1.name.substr(0, pvd1.name.size() - 4), said);
  if (rank) return;
  const CSV a(csv.text()), b(one.text());
  EXPECT_EQ(a.name, b.name);
  ASSERT_EQ(a.row.size(), 21u);
  ASSERT_EQ(b.row.size(), 21u);
  for (std::size_t c = 0; c < a.name.size(); c++) {
    double largest = 1, difference = 0;
    for (std::size_t k = 0; k < a.row.size(); k++) {
      largest    = std::max(largest, std::abs(b.row[k][c]));
      difference = std::max(difference, std::abs(a.row[k][c] - b.row[k][c]));
    }
    EXPECT_LT(difference, 1e-6 * largest) << a.name[c];
    EXPECT_GT(largest, 0.) << a.name[c];
  }
  const CSV p(sheet.text()), q(sheet_one.text());
  ASSERT_FALSE(p.row.empty());
  for (std::size_t c = 1; c < p.name.size(); c++) EXPECT_NEAR(p.row.back()[c], q.row.back()[c], 1e-5) << p.name[c];
  /* the start is the same to the last bit of a float; later frames agree only to rounding, which makes base64 texts differ */
  EXPECT_EQ(frame0.text(), one0.text());
  EXPECT_EQ(frame1.text().size(), one1.text().size());
  EXPECT_EQ(pvd.text().size() > 200, true);
}
