/* Checkpoints: a resumed run repeats the uninterrupted one bit for bit; bad files are refused */
#include "support.h"
#include <cstdint>
#include <cstring>

#include <fstream>
#include <iterator>
#include <unistd.h>

using namespace hhtest;

namespace
{

struct File {
  std::string name;
  explicit File(const char *what) : name(testing::TempDir() + "hhtdae-" + std::to_string((long)getpid()) + "-" + what)
  {
  }
  ~File()
  {
    std::remove(name.c_str());
    std::remove((name + ".info").c_str());
  }
  std::string read() const
  {
    std::ifstream f(name, std::ios::binary);
    return {std::istreambuf_iterator<char>(f), std::istreambuf_iterator<char>()};
  }
  void write(const std::string &bytes) const
  {
    std::ofstream f(name, std::ios::binary);
    f << bytes;
  }
};

struct Step {
  double t;
  Array  u, v, a;
  bool   operator==(const Step &o) const { return t == o.t && u == o.u && v == o.v && a == o.a; }
};

std::vector<Step> record(Simulation &run)
{
  std::vector<Step> steps;
  run.watch = [&](Simulation &r, PetscInt step, double t) {
    if (step) steps.push_back({t, r.u(), r.v(), r.a()});
  };
  must(run.solve());
  return steps;
}

void sameCounters(const TSHHT3Statistics &a, const TSHHT3Statistics &b)
{
  EXPECT_EQ(a.steps, b.steps);
  EXPECT_EQ(a.rejected, b.rejected);
  EXPECT_EQ(a.newton, b.newton);
  EXPECT_EQ(a.residuals, b.residuals);
  EXPECT_EQ(a.jacobians, b.jacobians);
  EXPECT_EQ(a.factorizations, b.factorizations);
  EXPECT_EQ(a.solves, b.solves);
  EXPECT_EQ(a.corrector_fails, b.corrector_fails);
  EXPECT_EQ(a.retries, b.retries);
  EXPECT_EQ(a.restarts, b.restarts);
  EXPECT_EQ(a.h_min, b.h_min);
  EXPECT_EQ(a.h_max, b.h_max);
}

/* A run that writes checkpoints gives the same digits and counters as one that does not */
void unchanged(const Problem &p, const std::string &options, int every)
{
  SCOPED_TRACE(p.name + " " + options);
  const File              file("unchanged");
  Simulation              plain(p, options);
  const std::vector<Step> steps = record(plain);
  Simulation              writing(p, options + text(" -ts_hhtdae_checkpoint %s -ts_hhtdae_checkpoint_every %d ", file.name.c_str(), every));
  EXPECT_TRUE(record(writing) == steps);
  sameCounters(plain.statistics(), writing.statistics());
  EXPECT_GT(file.read().size(), 100u);
}

/* Resumes from the checkpoint of each step from `first` to `last` and compares with the uninterrupted run */
void repeatEach(const Problem &p, const std::string &options, int first, int last)
{
  SCOPED_TRACE(p.name + " " + options);
  const File              running("each");
  std::vector<Step>       steps;
  std::vector<std::string> files(last + 2);
  Simulation              whole_run(p, options + text(" -ts_hhtdae_checkpoint %s -ts_hhtdae_checkpoint_every 1 ", running.name.c_str()));
  whole_run.watch = [&](Simulation &r, PetscInt step, double t) {
    if (step) steps.push_back({t, r.u(), r.v(), r.a()});
    if (step > first && step <= last + 1) files[step - 1] = running.read();
  };
  must(whole_run.solve());
  ASSERT_GT((int)steps.size(), last + 5);
  int different = 0;
  for (int k = first; k <= last; k++) {
    const File file("one");
    file.write(files[k]);
    Simulation              resumed(p, options + " -ts_hhtdae_resume " + file.name);
    const std::vector<Step> rest = record(resumed);
    const size_t            left = steps.size() - k;
    ASSERT_GE(rest.size(), left);
    if (!std::equal(steps.begin() + k, steps.end(), rest.end() - left)) different++;
  }
  EXPECT_EQ(different, 0) << "of " << last - first + 1;
}

void repeat(const Problem &p, const std::string &options, int every, int interrupted)
{
  SCOPED_TRACE(p.name + " " + options);
  const File        running("running"), kept("kept");
  const std::string write =
      text(" -ts_hhtdae_checkpoint %s -ts_hhtdae_checkpoint_every %d ", running.name.c_str(), every);
  Simulation        whole_run(p, options + write);
  std::vector<Step> steps;
  whole_run.watch = [&](Simulation &r, PetscInt step, double t) {
    if (step) steps.push_back({t, r.u(), r.v(), r.a()});
    if (step == interrupted + 1) kept.write(running.read()); /* written at the beginning of this step */
  };
  must(whole_run.solve());
  ASSERT_GT((int)steps.size(), interrupted + 5);

  Simulation              resumed(p, options + write + "-ts_hhtdae_resume " + kept.name);
  const std::vector<Step> rest = record(resumed);
  /* The step number continues, so that the first call of the monitor is at the checkpoint itself */
  ASSERT_GE(rest.size() + interrupted, steps.size());
  const size_t offset = rest.size() + interrupted - steps.size();
  ASSERT_LE(offset, (size_t)1);
  size_t different = 0;
  for (size_t k = offset; k < rest.size(); k++) different += !(rest[k] == steps[interrupted + k - offset]);
  EXPECT_EQ(different, (size_t)0) << "of " << rest.size();
  sameCounters(whole_run.statistics(), resumed.statistics());
  PetscInt na, nb;
  must(TSGetStepNumber(whole_run.ts, &na));
  must(TSGetStepNumber(resumed.ts, &nb));
  EXPECT_EQ(na, nb);
  MEASURED("%-14s %-40s resumed after step %d: %d steps repeated, %d of them with other bits", p.name.c_str(),
           options.c_str(), interrupted, (int)(rest.size() - offset), (int)different);
}

/* A pendulum with the same numbers of unknowns and roles, but with an additional force of 1e-6 N */
struct Blown : Pendulum {
  using Pendulum::Pendulum;
  void residual(double t, const double *u, const double *v, const double *a, double *f) const override
  {
    Pendulum::residual(t, u, v, a, f);
    f[0] -= 1e-6;
  }
};

/* The error message of resuming from a file with these bytes; empty if the file was accepted */
std::string refusal(const Problem &p, const std::string &bytes, const std::string &options = "")
{
  const File file("bad");
  file.write(bytes);
  ErrorTrap  trap;
  Simulation run(p, tolerance(1e-5) + options + "-ts_max_steps 100 -ts_hhtdae_resume " + file.name);
  return run.solve() ? trap.message.empty() ? "no message" : trap.message : "";
}

std::string goodFile(const Problem &p, const std::string &options = "")
{
  const File file("good");
  Simulation run(p, tolerance(1e-5) + options);
  for (int k = 0; k < 30; k++) must(run.step());
  must(TSHHT3CheckpointSave(run.ts, file.name.c_str()));
  return file.read();
}

} // namespace

TEST(Checkpoint, ResumedRunsRepeatBitForBit)
{
  repeat(Andrews(.02), tolerance(1e-6), 50, 100);
  repeat(UserVars(2.), tolerance(1e-5), 20, 60);
  repeat(Oscillators({1., 5.}, {0., .1}, true, 5.), tolerance(1e-5), 50, 100);
  repeat(Sleigh(5.), tolerance(1e-6), 20, 60);
  repeat(FourBar(2, 3.), tolerance(1e-5), 40, 80);
}

TEST(Checkpoint, PaperFormAndRadius)
{
  repeat(DoublePendulum(1.), tolerance(1e-6) + "-ts_hhtdae_form paper ", 20, 60);
  repeat(DoublePendulum(1.), tolerance(1e-6) + "-ts_hhtdae_radius 0.8 ", 20, 60);
}

TEST(Checkpoint, WritingChangesNothing)
{
  unchanged(Andrews(.02), tolerance(1e-6), 7);
  unchanged(UserVars(2.), tolerance(1e-5), 1);
  unchanged(Oscillators({1., 5.}, {0., .1}, true, 5.), tolerance(1e-5), 5);
  unchanged(Sleigh(5.), tolerance(1e-6), 3);
  unchanged(FourBar(2, 3.), tolerance(1e-5), 4);
  unchanged(DoublePendulum(1.), tolerance(1e-6) + "-ts_hhtdae_form paper ", 4);
  unchanged(Pendulum(-90., 0., 2.), fixedSteps(.01), 10);
}

/* A checkpoint after any step resumes exactly, whatever the state of the matrix, the corrector and the predictor */
TEST(Checkpoint, AfterEveryStep)
{
  repeatEach(Andrews(.02), tolerance(1e-6), 1, 120);
  repeatEach(UserVars(2.), tolerance(1e-5), 1, 60);
  repeatEach(FourBar(2, 3.), tolerance(1e-5), 1, 60);
  repeatEach(Sleigh(5.), tolerance(1e-6), 1, 60);
}

/* With every direct solver that supports checkpoints, and with an option that rules the reuse of matrices */
TEST(Checkpoint, OtherSolvers)
{
  for (const char *options : {"-pc_type lu -pc_factor_mat_solver_type mumpsnd ", "-pc_type lu -pc_factor_mat_solver_type mumpsmixed ", "-pc_type lu -pc_factor_mat_solver_type klupair ", "-pc_factor_mat_solver_type klupair ",
                              "-snes_lag_jacobian 3 ", "-ts_adapt_type none -ts_dt 1e-4 "}) {
    repeat(Andrews(.02), tolerance(1e-6) + options, 50, 100);
    unchanged(Andrews(.02), tolerance(1e-6) + options, 20);
  }
}

TEST(Checkpoint, FixedSteps) { repeat(Pendulum(-90., 0., 2.), fixedSteps(.01), 30, 90); }

/* Checkpoints by function calls in place of options */
TEST(Checkpoint, SaveAndLoad)
{
  const Pendulum p(-90., 0., 2.);
  const File     file("hand");
  Simulation     first(p, tolerance(1e-6)), second(p, tolerance(1e-6));
  for (int k = 0; k < 40; k++) must(first.step());
  must(TSHHT3CheckpointSave(first.ts, file.name.c_str()));
  const double t = first.t();
  must(TSHHT3CheckpointLoad(second.ts, file.name.c_str()));
  must(TSSetUp(second.ts));
  EXPECT_EQ(second.t(), t);
  EXPECT_EQ(second.u(), first.u());
  EXPECT_EQ(second.v(), first.v());
  EXPECT_EQ(second.a(), first.a());
  must(first.solve());
  must(second.solve());
  EXPECT_EQ(second.u(), first.u());
  EXPECT_EQ(second.v(), first.v());
}

/* A TS that has run already takes over the whole state of the file and keeps nothing of its own. Example: its own
   start found driven coordinates; in the run of the file, whose pendulum has turned, none are driven
   (Driven.FreeAfterAll) */
TEST(Checkpoint, LoadedIntoATSThatHasRun)
{
  const Pendulum p(-90., 2., 2.);
  const File     file("run");
  Simulation     first(p, tolerance(1e-6)), second(p, tolerance(1e-6));
  Printed        out;
  const auto     driven = [&](Simulation &run) {
    const std::string before = out.text();
    must(TSView(run.ts, PETSC_VIEWER_STDOUT_SELF));
    return out.text().find("whose motion is given", before.size()) != std::string::npos;
  };
  for (int k = 0; k < 40; k++) must(first.step());
  must(TSHHT3CheckpointSave(first.ts, file.name.c_str()));
  must(TSSetTimeStep(second.ts, 1e-9));
  must(second.step());
  EXPECT_TRUE(driven(second));
  must(TSHHT3CheckpointLoad(second.ts, file.name.c_str()));
  EXPECT_FALSE(driven(first));
  EXPECT_FALSE(driven(second));
  must(first.solve());
  must(second.solve());
  EXPECT_EQ(second.u(), first.u());
  sameCounters(second.statistics(), first.statistics());
}

/* -snes_lag_jacobian may be an option of the run that writes the checkpoint or of the run that resumes: the resumed
   run renews matrices according to its own options */
TEST(Checkpoint, LagOfTheRunThatGoesOn)
{
  const Pendulum p(-90., 0., 1.);
  const File     file("lag");
  for (const bool first : {true, false}) { /* which of the two runs has the option */
    Simulation run(p, tolerance(1e-6) + (first ? "-snes_lag_jacobian 3" : "")), next(p, tolerance(1e-6) + (first ? "" : "-snes_lag_jacobian 1"));
    SNES       snes;
    PetscInt   before, after;
    must(TSSetMaxTime(run.ts, .5));
    must(run.solve());
    must(TSHHT3CheckpointSave(run.ts, file.name.c_str()));
    must(TSSetUp(next.ts));
    must(TSGetSNES(next.ts, &snes));
    must(SNESGetLagJacobian(snes, &before));
    must(TSHHT3CheckpointLoad(next.ts, file.name.c_str()));
    must(SNESGetLagJacobian(snes, &after));
    EXPECT_EQ(after > 0, before > 0);
    EXPECT_TRUE(before < 0 || after == before) << after;
    must(next.solve());
    EXPECT_LT(next.errors().q, 1e-3);
  }
}

/* Times of a time span before the checkpoint are not visited again */
TEST(Checkpoint, ResumesInATimeSpan)
{
  const Pendulum p(-90., 0., 2.);
  const File     file("span");
  PetscReal      times[] = {0, 0.5, 1, 1.5, 2};
  Simulation     first(p, tolerance(1e-6)), second(p, tolerance(1e-6));
  for (Simulation *run : {&first, &second}) must(TSSetTimeSpan(run->ts, 5, times));
  bool saved  = false;
  first.watch = [&](Simulation &r, PetscInt, double t) {
    if (t > 0.7 && !saved) must(TSHHT3CheckpointSave(r.ts, file.name.c_str()));
    saved = t > 0.7;
  };
  must(first.solve());
  must(TSHHT3CheckpointLoad(second.ts, file.name.c_str()));
  must(second.solve());
  EXPECT_EQ(second.t(), 2);
  EXPECT_EQ(second.u(), first.u());
  PetscInt n, m;
  Vec     *x, *y;
  must(TSGetTimeSpanSolutions(first.ts, &n, &x));
  must(TSGetTimeSpanSolutions(second.ts, &m, &y));
  ASSERT_EQ(n, 5);
  ASSERT_EQ(m, 5);
  for (int k = 0; k < 2; k++) { /* times after the checkpoint */
    PetscReal norm;
    must(VecNorm(y[k], NORM_2, &norm));
    EXPECT_TRUE(std::isnan(norm)) << k;
  }
  for (int k = 2; k < 5; k++) {
    PetscBool same;
    must(VecEqual(x[k], y[k], &same));
    EXPECT_TRUE(same) << k;
  }
}

/* A program that calls TSSolve() for one interval after another may repeat the calls for the intervals before the
   checkpoint when it resumes */
TEST(Checkpoint, ResumesInALoopOfSolves)
{
  const Pendulum p(-90., 0., 2.);
  const File     file("loop");
  Simulation     first(p, tolerance(1e-6)), second(p, tolerance(1e-6));
  for (double end : {0.5, 1., 1.5, 2.}) {
    must(TSSetMaxTime(first.ts, end));
    must(first.solve());
    if (end == 1) {
      must(first.step());
      must(TSHHT3CheckpointSave(first.ts, file.name.c_str()));
    }
  }
  must(TSHHT3CheckpointLoad(second.ts, file.name.c_str()));
  for (double end : {0.5, 1., 1.5, 2.}) {
    must(TSSetMaxTime(second.ts, end));
    must(second.solve());
  }
  EXPECT_EQ(second.t(), 2);
  EXPECT_EQ(second.u(), first.u());
}

/* Corrects the checksum of a changed file: FNV-1a over all bytes but the last eight */
static void seal(std::string &file)
{
  std::uint64_t sum = 14695981039346656037ull;
  for (size_t i = 0; i + sizeof(sum) < file.size(); i++) sum = (sum ^ (unsigned char)file[i]) * 1099511628211ull;
  std::memcpy(&file[file.size() - sizeof(sum)], &sum, sizeof(sum));
}

TEST(Checkpoint, ForeignFilesAreRefused)
{
  const Pendulum    p(-90., 0., 2.);
  const std::string good = goodFile(p);
  EXPECT_NE(refusal(p, "This is not a checkpoint, but a text that somebody took for one by mistake.")
                .find("not a checkpoint"),
            std::string::npos);
  EXPECT_NE(refusal(UserVars(), good).find("3 unknowns"), std::string::npos);
  EXPECT_NE(refusal(p, good, "-ts_hhtdae_alpha -0.1 ").find("give the same options"), std::string::npos);
  EXPECT_NE(refusal(p, good, "-ts_hhtdae_form paper ").find("give the same options"), std::string::npos);
  EXPECT_NE(refusal(Blown(-90., 0., 2.), good).find("another problem"), std::string::npos);
  std::string other_version = good, other_ranks = good, old = good;
  other_version[8]++;
  seal(other_version);
  EXPECT_NE(refusal(p, other_version).find("version"), std::string::npos);
  other_ranks[12]++;
  seal(other_ranks);
  EXPECT_NE(refusal(p, other_ranks).find("ranks"), std::string::npos);
  old.replace(0, 8, std::string("\x00\x12\x7b\xaa\x00\x00\x00\x03", 8));
  seal(old);
  EXPECT_NE(refusal(p, old).find("version 3"), std::string::npos);
}

TEST(Checkpoint, MissingFileIsAnError)
{
  const Pendulum p;
  Simulation     run(p, "-ts_hhtdae_resume /no/such/file");
  ErrorTrap      trap;
  EXPECT_NE(run.solve(), 0);
  EXPECT_TRUE(trap.says("/no/such/file")) << trap.message;
}

TEST(Checkpoint, TruncatedFilesAreRefused)
{
  const Pendulum    p(-90., 0., 2.);
  const std::string good = goodFile(p);
  for (size_t length : {(size_t)0, (size_t)10, good.size() / 4, good.size() / 2, good.size() - 8, good.size() - 1}) {
    SCOPED_TRACE(length);
    EXPECT_NE(refusal(p, good.substr(0, length)), "");
  }
}

TEST(Checkpoint, DamagedFilesAreRefused)
{
  const Pendulum    p(-90., 0., 2.);
  const std::string good  = goodFile(p);
  int               taken = 0, tried = 0;
  for (size_t at = 3; at < good.size(); at += good.size() / 50, tried++) {
    std::string bad = good;
    bad[at] ^= 0x10;
    if (refusal(p, bad).empty()) taken++;
  }
  EXPECT_EQ(taken, 0) << "of " << tried << " files with one bit turned";
}

TEST(Checkpoint, BeforeTheFirstStepThereIsNone)
{
  const Pendulum p;
  const File     file("none");
  Simulation     run(p, "");
  must(TSSetUp(run.ts));
  ErrorTrap trap;
  EXPECT_NE(TSHHT3CheckpointSave(run.ts, file.name.c_str()), 0);
  EXPECT_TRUE(trap.says("no accepted step")) << trap.message;
}

TEST(Checkpoint, UnwritableDirectoryIsAnError)
{
  const Pendulum p;
  Simulation     run(p, "");
  must(run.step());
  ErrorTrap trap;
  EXPECT_NE(TSHHT3CheckpointSave(run.ts, "/no/such/directory/file"), 0);
}

namespace
{

/* The residual of a simulation that fails once, at a given call */
struct FailsOnce {
  TSI2Function f   = nullptr;
  void        *ctx = nullptr;
  long         calls = 0, at;

  FailsOnce(Simulation &run, long call) : at(call)
  {
    must(TSGetI2Function(run.ts, nullptr, &f, &ctx));
    must(TSSetI2Function(run.ts, nullptr, evaluate, this));
  }
  static PetscErrorCode evaluate(TS ts, PetscReal t, Vec U, Vec V, Vec A, Vec F, void *self)
  {
    auto &x = *static_cast<FailsOnce *>(self);
    return ++x.calls == x.at ? PETSC_ERR_USER : x.f(ts, t, U, V, A, F, x.ctx);
  }
};

} // namespace

/* After an error in a callback the last accepted state can be read, saved and continued from, with the digits of a run
   without the error */
TEST(Checkpoints, AfterAnErrorOfTheApplication)
{
  const Pendulum p(-90., 0., .5);
  const auto     options = tolerance(1e-6) + "-ts_max_time 0.5 ";
  Simulation     plain(p, options);
  const auto     expected = record(plain);
  ASSERT_GT(expected.size(), 30u);
  for (const long call : {200, 201, 202, 203, 204, 205}) {
    Simulation run(p, options), other(p, options);
    FailsOnce  residual(run, call);
    File       file("error");
    {
      ErrorTrap trap;
      EXPECT_EQ(run.solve(), PETSC_ERR_USER) << call;
    }
    PetscInt steps;
    must(TSGetStepNumber(run.ts, &steps));
    ASSERT_GT(steps, 3);
    const Step &reached = expected[steps - 1];
    EXPECT_EQ(reached, (Step{run.t(), run.u(), run.v(), run.a()})) << call;
    Vec x;
    must(VecDuplicate(run.U, &x));
    must(TSHHT3EvaluateAt(run.ts, run.t(), nullptr, nullptr, x));
    EXPECT_EQ(whole(x), reached.a) << call;
    must(VecDestroy(&x));
    must(TSHHT3CheckpointSave(run.ts, file.name.c_str()));
    must(run.solve());
    EXPECT_EQ(run.u(), plain.u()) << call;
    must(TSHHT3CheckpointLoad(other.ts, file.name.c_str()));
    must(other.solve());
    EXPECT_EQ(other.u(), plain.u()) << call;
  }
}
