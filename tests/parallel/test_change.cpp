/* A change of coordinates on all ranks together and on each rank alone; the angles of one body are on several ranks */
#include "tumbling.h"

using namespace hhtest;

namespace
{

struct End {
  Array            u, v, a;
  TSHHT3Statistics s;
};

End run(MPI_Comm comm, const Tumbling &p, const std::string &options)
{
  Simulation   r(p, options, comm);
  FrameChanges changes(r, p, 10);
  must(r.solve());
  return {r.u(), r.v(), r.a(), r.statistics()};
}

} // namespace

TEST(ChangeOnRanks, SameAsOnOne)
{
  for (bool pivot : {false, true})
    for (const char *form : {"second_order", "paper"}) {
      const Tumbling    p(pivot, pivot ? .3 : 1.2);
      const std::string options =
          fixedSteps(p.t1 / 100) + "-ts_hhtdae_corrector_tolerance 1e-10 -ts_hhtdae_form " + form;
      const End    all = run(PETSC_COMM_WORLD, p, options), self = run(PETSC_COMM_SELF, p, options);
      const double du = relativeDifference(all.u, self.u), dv = relativeDifference(all.v, self.v),
                   da = relativeDifference(all.a, self.a);
      int rank;
      MPI_Comm_rank(PETSC_COMM_WORLD, &rank);
      if (!rank)
        MEASURED("%s, %s: differ by %.1e in U, %.1e in U', %.1e in U''; %d changes", p.name.c_str(), form, du, dv, da,
                 (int)all.s.changes);
      EXPECT_EQ(all.s.changes, self.s.changes);
      EXPECT_GE(all.s.changes, 9);
      EXPECT_LT(du, 1e-8);
      EXPECT_LT(dv, 1e-8);
      EXPECT_LT(da, 1e-8);
    }
}

TEST(ChangeOnRanks, Checkpoint)
{
  const Tumbling    p(true, .2);
  const std::string file = testing::TempDir() + "hhtdae-ranks-change", o = fixedSteps(.0025);
  Array             u[2], v[2];
  {
    Simulation   first(p, o, PETSC_COMM_WORLD);
    FrameChanges changes(first, p, 10);
    for (int k = 0; k < 25; k++) must(first.step());
    must(TSHHT3CheckpointSave(first.ts, file.c_str()));
    must(first.solve());
    u[0] = first.u();
    v[0] = first.v();
  }
  Simulation   second(p, o, PETSC_COMM_WORLD);
  FrameChanges changes(second, p, 10);
  must(TSHHT3CheckpointLoad(second.ts, file.c_str()));
  must(second.solve());
  u[1] = second.u();
  v[1] = second.v();
  EXPECT_EQ(u[0], u[1]);
  EXPECT_EQ(v[0], v[1]);
  int rank;
  MPI_Comm_rank(PETSC_COMM_WORLD, &rank);
  MPI_Barrier(PETSC_COMM_WORLD);
  if (!rank) std::remove(file.c_str());
}
