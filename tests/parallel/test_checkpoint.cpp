/* Checkpoints on several ranks: writing does not change the run, a resumed run repeats it bit for bit, and another
   number of ranks is refused */
#include "hhtdae/scene.h"
#include "scene_output.h"
#include "shared_file.h"

using namespace hhtest;

namespace
{

struct Fallen {
  Array            u, v, sample; /* sample: accelerations in the middle of the last step */
  TSHHT3Statistics s;
};

/* In each step, so that the state of the samples' solver matters */
struct Samples {
  Vec       A     = nullptr;
  PetscReal begin = -1;
};

PetscErrorCode sampleStep(TS ts, PetscInt, PetscReal t, Vec U, void *ctx)
{
  Samples &x = *static_cast<Samples *>(ctx);
  PetscFunctionBegin;
  if (!x.A) PetscCall(VecDuplicate(U, &x.A));
  if (x.begin >= 0) PetscCall(TSHHT3EvaluateAt(ts, 0.5 * (x.begin + t), nullptr, nullptr, x.A));
  x.begin = t;
  PetscFunctionReturn(0);
}

Fallen fall(MPI_Comm comm, const std::string &options, int bodies = 12)
{
  Rods     rods(bodies, comm);
  SceneRun run(rods.scene, 0.4, " -ts_rtol 1e-6 -ts_atol 1e-6 " + options);
  Vec      U, V;
  Samples  samples;
  Fallen   e;
  must(TSMonitorSet(run.ts, sampleStep, &samples, nullptr));
  must(run.solve());
  must(TS2GetSolution(run.ts, &U, &V));
  must(TSHHT3GetStatistics(run.ts, &e.s));
  e.u      = whole(U);
  e.v      = whole(V);
  e.sample = whole(samples.A);
  must(VecDestroy(&samples.A));
  return e;
}

void repeat(const std::string &options)
{
  SCOPED_TRACE(options);
  const SharedFile  file(".checkpoint");
  const std::string every = " -ts_hhtdae_checkpoint " + file.name + " -ts_hhtdae_checkpoint_every ";
  const Fallen      plain = fall(PETSC_COMM_WORLD, options);
  ASSERT_GT(plain.s.steps, 30);
  const Fallen writing = fall(PETSC_COMM_WORLD, options + every + "1 ");
  EXPECT_EQ(plain.u, writing.u);
  EXPECT_EQ(plain.v, writing.v);
  for (int stop : {5, 17, 28}) {
    fall(PETSC_COMM_WORLD, options + every + std::to_string(stop) + " -ts_max_steps " + std::to_string(stop) + " ");
    const Fallen resumed = fall(PETSC_COMM_WORLD, options + " -ts_hhtdae_resume " + file.name + " ");
    EXPECT_EQ(plain.u, resumed.u) << stop;
    EXPECT_EQ(plain.v, resumed.v) << stop;
    EXPECT_EQ(plain.sample, resumed.sample) << stop;
    EXPECT_EQ(plain.s.newton, resumed.s.newton) << stop;
    EXPECT_EQ(plain.s.factorizations, resumed.s.factorizations) << stop;
  }
}

} // namespace

TEST(Checkpoint, RunsRepeatBitForBit)
{
  repeat("");
  repeat("-ts_adapt_type none -ts_dt 0.005 ");
}

TEST(Checkpoint, OtherNumbersOfRanksAreRefused)
{
  const SharedFile file(".checkpoint");
  int              size;
  MPI_Comm_size(PETSC_COMM_WORLD, &size);
  if (size == 1) GTEST_SKIP();
  fall(PETSC_COMM_WORLD, "-ts_hhtdae_checkpoint " + file.name + " -ts_hhtdae_checkpoint_every 10 -ts_max_steps 10 ");
  ErrorTrap trap;
  EXPECT_ANY_THROW(fall(PETSC_COMM_SELF, "-ts_hhtdae_resume " + file.name + " "));
  EXPECT_TRUE(trap.says("ranks")) << trap.message;
  MPI_Barrier(PETSC_COMM_WORLD);
}
