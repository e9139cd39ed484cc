/* Scenes resumed from a checkpoint give the same bits and continue the same files; errors in users' functions */
#include "hhtdae/analyses.h"
#include "hhtdae/query.h"
#include "scene/model.h"
#include "scene_output.h"

using namespace hhtest;

namespace
{

const std::string accurate = " -ts_rtol 1e-7 -ts_atol 1e-7 ";

/* Names of the files of one run */
struct Files {
  TemporaryFile csv, balance, index, checkpoint;
  std::string   prefix;
#if defined(PETSC_HAVE_HDF5)
  TemporaryFile h5;
#endif

  explicit Files(const std::string &run)
      : csv(run + ".csv"), balance(run + ".balance"), index(run + ".pvd"), checkpoint(run + ".checkpoint"), prefix(index.name.substr(0, index.name.size() - 4))
#if defined(PETSC_HAVE_HDF5)
        ,
        h5(run + ".h5")
#endif
  {
  }
  ~Files()
  {
    for (int k = 0; k < 100; k++) {
      char number[16];
      std::snprintf(number, sizeof number, "_%06d", k);
      std::remove((prefix + number + ".vtp").c_str());
    }
  }
  std::string options(const std::string &dt) const
  {
    std::string all = accurate + "-scene_csv " + csv.name + " -scene_dt " + dt + " -scene_balance " + balance.name + " -scene_animation " + prefix + " -scene_animation_dt 0.05 ";
#if defined(PETSC_HAVE_HDF5)
    all += "-scene_output " + h5.name + " ";
#endif
    return all;
  }
};

struct Result {
  Array    u, v;
  PetscInt steps;
};

Result runRods(const std::string &options, int bodies = 2, double mass = 1, double end = 0.6)
{
  Rods rods(bodies);
  DataOf(rods.scene).bodies[0].mass = mass;
  rods.scene.channel("y", Measure::displacement(rods.tip[bodies - 1], 1), "m");
  rods.scene.channel("angle", Measure::angle(rods.tip[0], rods.scene.marker(rods.scene.ground())), "rad");
  rods.scene.shape(rods.body[0], Shape::box({0.5, 0.1, 0.1}));
  SceneRun run(rods.scene, end, options);
  must(run.solve());
  Vec    U, V;
  Result r;
  must(TS2GetSolution(run.ts, &U, &V));
  must(TSGetStepNumber(run.ts, &r.steps));
  r.u = whole(U);
  r.v = whole(V);
  return r;
}

std::string withoutNames(std::string text, const std::string &name)
{
  const std::string base = name.substr(name.find_last_of('/') + 1);
  for (std::size_t at; (at = text.find(base)) != std::string::npos;) text.erase(at, base.size());
  return text;
}

void breakAndResume(const std::string &dt)
{
  SCOPED_TRACE(dt);
  const Files  a("whole"), b("broken");
  const Result whole_run = runRods(a.options(dt));
  ASSERT_GT(whole_run.steps, 40);
  const std::string write = " -ts_hhtdae_checkpoint " + b.checkpoint.name + " -ts_hhtdae_checkpoint_every 10 ";
  runRods(b.options(dt) + write + "-ts_max_steps 27 ");
  const Result resumed = runRods(b.options(dt) + write + "-ts_hhtdae_resume " + b.checkpoint.name + " ");
  EXPECT_EQ(resumed.u, whole_run.u);
  EXPECT_EQ(resumed.v, whole_run.v);
  EXPECT_EQ(resumed.steps, whole_run.steps);
  EXPECT_EQ(a.csv.text(), b.csv.text());
  EXPECT_EQ(a.balance.text(), b.balance.text());
  EXPECT_EQ(withoutNames(a.index.text(), a.prefix), withoutNames(b.index.text(), b.prefix));
#if defined(PETSC_HAVE_HDF5)
  for (const char *name : {"time", "y", "angle"}) {
    std::string text[2];
    for (int k = 0; k < 2; k++) {
      PetscViewer viewer;
      Vec         x;
      must(PetscViewerCreate(PETSC_COMM_SELF, &viewer));
      must(PetscViewerSetType(viewer, PETSCVIEWERHDF5));
      must(PetscViewerFileSetMode(viewer, FILE_MODE_READ));
      must(PetscViewerFileSetName(viewer, (k ? b : a).h5.name.c_str()));
      must(VecCreate(PETSC_COMM_SELF, &x));
      must(PetscObjectSetName((PetscObject)x, name));
      must(VecLoad(x, viewer));
      for (double v : whole(x)) text[k] += std::to_string(v) + " ";
      must(VecDestroy(&x));
      must(PetscViewerDestroy(&viewer));
    }
    EXPECT_EQ(text[0], text[1]) << name;
    EXPECT_GT(text[0].size(), 100u);
  }
#endif
}

std::string refusal(const std::string &options, int bodies = 2, double mass = 1)
{
  ErrorTrap trap;
  try {
    runRods(options, bodies, mass, 0.3);
  } catch (const std::exception &) {
  }
  return trap.message;
}

} // namespace

TEST(SceneResume, FilesGoOn)
{
  breakAndResume("0.013");
  breakAndResume("0");
}

/* Snapshots between TSHHT3CheckpointLoad() and the first step show the state of the file */
TEST(SceneResume, QueriesSeeTheFile)
{
  TemporaryFile file("queried.checkpoint");
  Motion        m[4];
  Snapshot      now;
  Rods          rods(2), again(2), third(2);
  SceneRun      run(rods.scene, 0.6, accurate), next(again.scene, 1, accurate), last(third.scene, 1, accurate);
  TS            ts;
  PetscReal     t;
  must(run.solve());
  must(TSHHT3CheckpointSave(run.ts, file.name.c_str()));
  must(now.take(run.ts));
  must(now.motion(rods.tip[1], &m[0]));
  must(TSHHT3CheckpointLoad(next.ts, file.name.c_str()));
  must(now.take(next.ts));
  must(now.motion(again.tip[1], &m[1]));
  EXPECT_NEAR(now.time(), 0.6, 1e-12);
  EXPECT_LT((m[1].position - m[0].position).norm(), 1e-12);
  Rods                fourth(2);
  std::vector<double> values;
  fourth.scene.channel("x", Measure::displacement(fourth.tip[1], 0));
  SceneRun sampled(fourth.scene, 1, accurate);
  must(TSHHT3CheckpointLoad(sampled.ts, file.name.c_str()));
  must(fourth.scene.sample(sampled.ts, 0.6, values));
  EXPECT_NEAR(values[0], m[0].position(0), 1e-12);
  Rods     fifth(2);
  SceneRun begun(fifth.scene, 1, accurate);
  must(TSHHT3CheckpointLoad(begun.ts, file.name.c_str()));
  {
    ErrorTrap trap;
    EXPECT_NE(StaticEquilibrium(begun.ts, 0), 0);
    EXPECT_TRUE(trap.says("the run has begun")) << trap.message;
  }
  must(TSHHT3CheckpointLoad(last.ts, file.name.c_str()));
  must(third.scene.createTS(&ts, last.ts));
  must(TSGetTime(ts, &t));
  EXPECT_NEAR(t, 0.6, 1e-12);
  must(now.take(ts));
  must(now.motion(third.tip[1], &m[2]));
  EXPECT_LT((m[2].position - m[0].position).norm(), 1e-7);
  must(TSDestroy(&ts));
}

/* With a checkpoint after every step */
TEST(SceneResume, WritingChangesNothing)
{
  const Files  a("plain"), b("writing");
  const Result plain   = runRods(a.options("0.01"));
  const Result writing = runRods(b.options("0.01") + " -ts_hhtdae_checkpoint " + b.checkpoint.name + " -ts_hhtdae_checkpoint_every 1 ");
  EXPECT_EQ(plain.u, writing.u);
  EXPECT_EQ(plain.steps, writing.steps);
  EXPECT_EQ(a.csv.text(), b.csv.text());
  EXPECT_EQ(a.balance.text(), b.balance.text());
}

/* If the CSV file does not exist it begins where the run resumes, at times of the same grid; if it is too short the
   run is refused */
TEST(SceneResume, OtherFiles)
{
  const Files       a("first"), b("second");
  const std::string write = " -ts_hhtdae_checkpoint " + a.checkpoint.name + " -ts_hhtdae_checkpoint_every 10 ", resume = " -ts_hhtdae_resume " + a.checkpoint.name + " ";
  const std::string csv   = accurate + "-scene_dt 0.01 -scene_csv ";
  runRods(csv + a.csv.name + write + "-ts_max_steps 27 ");
  runRods(csv + b.csv.name + resume);
  const CSV table(b.csv.text());
  ASSERT_GT(table.row.size(), 5u);
  EXPECT_GT(table.row[0][0], 0.02);
  for (const Array &row : table.row) EXPECT_NEAR(row[0] / 0.01, std::round(row[0] / 0.01), 1e-6);
  std::ofstream(a.csv.name) << "time\n";
  EXPECT_NE(refusal(csv + a.csv.name + resume).find("shorter than when the checkpoint was written"), std::string::npos);
}

TEST(SceneResume, OtherScenesAreRefused)
{
  const Files       a("other");
  const std::string write = " -ts_hhtdae_checkpoint " + a.checkpoint.name + " -ts_hhtdae_checkpoint_every 10 ", resume = " -ts_hhtdae_resume " + a.checkpoint.name + " ";
  runRods(accurate + write + "-ts_max_steps 27 ");
  EXPECT_NE(refusal(accurate + resume, 2, 1.001).find("another scene"), std::string::npos);
  EXPECT_NE(refusal(accurate + resume, 3), "");
  EXPECT_EQ(refusal(accurate + resume), "");
}

TEST(SceneResume, FullDiskAndImpossibleDistances)
{
  EXPECT_NE(refusal(accurate + "-scene_balance /dev/full ").find("/dev/full"), std::string::npos);
  EXPECT_NE(refusal(accurate + "-scene_csv /dev/full ").find("/dev/full"), std::string::npos);
  const TemporaryFile file("close.csv");
  EXPECT_NE(refusal(accurate + "-scene_dt 1e-300 -scene_csv " + file.name).find("cannot be 1e-300 apart"), std::string::npos);
}

namespace
{

std::string userRun(const std::function<Real(const Real *)> &f)
{
  Rods rods(1);
  rods.scene.variable("user", Expression{{Measure::displacement(rods.tip[0], 1), Measure::time()}, f});
  ErrorTrap trap;
  try {
    SceneRun run(rods.scene, 0.1, accurate);
    return run.solve() ? trap.message : "";
  } catch (const std::exception &e) {
    return trap.message.empty() ? e.what() : trap.message;
  }
}

} // namespace

TEST(SceneResume, UsersFunctionsThatFail)
{
  EXPECT_EQ(userRun([](const Real *m) -> Real { return m[0] + m[1]; }), "");
  const std::string thrown = userRun([](const Real *m) -> Real {
    if (m[1].value() > 0.05) throw std::range_error("off the table");
    return m[0];
  });
  EXPECT_NE(thrown.find("off the table"), std::string::npos) << thrown;
  EXPECT_NE(thrown.find("user"), std::string::npos) << thrown;
}
