static char help[] =
    "The all-terrain vehicle under hhtdae (both forms) and IDA as GSTIFF, against a reference at a much tighter "
    "tolerance: CPU time,\n"
    "counters, hot spots of the frame, a reaction, the engine's pitch rate, error against run time; one HTML page.\n"
    "  -frame <frame.h5>: the reduced frame, by atv_frame\n"
    "  -o <atv.html>: the page\n"
    "  -end <2>: s, a multiple of 0.02;  -repeats <3>: of the timed runs;  -sweep <true>: error against run time too\n"
    "  -fine <false>: runs of the sweep that take IDA 5 to 10 s each, too\n"
    "  -limit <120>: CPU seconds after which a run of IDA counts as failed\n"
    "  -jobs <1>: of the reference's and the sweep's runs at a time; the timed ones run alone\n";

#include "atv_page.h"
#include "side_by_side.h"
#include <hhtdae/flexible.h>
#include <petsctime.h>

using namespace hhtbench;
using Form = wp::FirstOrder::Form;

static PetscErrorCode Done(const AtvRun &run)
{
  PetscFunctionBegin;
  PetscCall(
      PetscPrintf(PETSC_COMM_SELF,
                  "%-34s eps %.0e, step at most %-7.3g %8.2f s CPU %7ld steps %7ld iterations %5ld factorizations %s\n",
                  run.name.c_str(), run.eps, run.step_max, run.cpu, run.count.steps, run.count.newton,
                  run.count.factorizations, run.failure.c_str()));
  fflush(stdout); /* progress, visible through pipes too */
  PetscFunctionReturn(0);
}

static PetscErrorCode Paper(TS ts) { return TSHHT3SetForm(ts, TSHHT3_FORM_PAPER); }

static PetscErrorCode LittleDamping(TS ts) { return TSHHT3SetAlpha(ts, -0.05); }

/* A run of the comparison: first timed without channels, then repeated for its samples */
struct Timed {
  const char                       *name;
  std::function<PetscErrorCode(TS)> configure;

  PetscErrorCode run(const AtvRuns &runs, AtvRuns::Of of, AtvRun *run) const { return runs.hht(name, 1e-5, 5e-4, configure, run, of); }
};
static const Timed timed[] = {{"hhtdae, second-order form", nullptr}, {"hhtdae, paper's form", Paper}};

/* hhtdae's forms and IDA alternately, `repeats` times; the median of the times counts */
static PetscErrorCode RunMain(const AtvRuns &runs, PetscInt repeats, std::vector<AtvRun> *all)
{
  std::vector<std::vector<double>> times;

  PetscFunctionBegin;
  for (PetscInt k = 0; k < repeats; k++) {
    all->clear();
    for (const Timed &t : timed) {
      all->emplace_back();
      PetscCall(t.run(runs, AtvRuns::Time, &all->back()));
    }
#if defined(HHTDAE_HAVE_IDA)
    all->emplace_back();
    PetscCall(runs.ida("IDA, index 3 (as GSTIFF)", 1e-4, 5e-4, Form::Index3, &all->back()));
#endif
    times.resize(all->size());
    for (size_t i = 0; i < all->size(); i++) {
      times[i].push_back((*all)[i].cpu);
      PetscCall(Done((*all)[i]));
    }
  }
  for (size_t i = 0; i < all->size(); i++) {
    std::sort(times[i].begin(), times[i].end());
    (*all)[i].cpu = times[i][times[i].size() / 2];
  }
  PetscFunctionReturn(0);
}

constexpr int sweep_samples = 5; /* errors are evaluated at every fifth sample time of the reference, because samples cost more than steps */

using Planned = std::function<PetscErrorCode(AtvRun *)>;

static std::vector<Planned> Sweep(AtvRuns runs, bool fine)
{
  struct Method {
    const char                            *name;
    std::function<PetscErrorCode(TS)>      configure;
    std::vector<std::pair<double, double>> grid;      /* tolerance, largest step */
    std::vector<std::pair<double, double>> fine = {}; /* only in the fine sweep */
  };
  const auto gridOf = [fine](const auto &m) {
    auto all = m.grid;
    if (fine) all.insert(all.end(), m.fine.begin(), m.fine.end());
    return all;
  };
  const Method methods[] = {
      {"hhtdae", nullptr, {{1e-4, 0}, {1e-5, 0}, {1e-6, 0}, {1e-7, 0}, {1e-8, 0}}},
      {"hhtdae, paper's form", Paper, {{1e-4, 0}, {1e-5, 0}, {1e-6, 0}, {1e-7, 0}, {1e-8, 0}}},
      {"hhtdae, steps limited", nullptr, {{1e-5, 2e-3}, {1e-5, 1e-3}, {1e-5, 5e-4}, {1e-5, 2e-4}}, {{1e-6, 1e-4}}}};
  std::vector<Planned> plan;

  runs.dt *= sweep_samples;
  for (const Method &m : methods)
    for (const auto &[eps, step] : gridOf(m))
      plan.push_back([=, e = eps, h = step](AtvRun *run) { return runs.hht(m.name, e, h, m.configure, run); });
#if defined(HHTDAE_HAVE_IDA)
  struct Foreign {
    const char                            *name;
    Form                                   form;
    std::vector<std::pair<double, double>> grid, fine;
  };
  const Foreign foreign[] = {
      {"IDA, index 3", Form::Index3, {{1e-3, 0}, {1e-4, 0}, {1e-5, 0}}, {{1e-6, 0}}},
      {"IDA, index 3, steps limited", Form::Index3, {{1e-4, 5e-4}}, {{1e-5, 5e-4}, {1e-5, 2e-4}, {1e-6, 1e-4}}},
      {"IDA, stabilized index 2", Form::Stabilized, {{1e-3, 0}, {1e-4, 0}}, {{1e-5, 0}}}};
  for (const Foreign &m : foreign)
    for (const auto &[eps, step] : gridOf(m))
      plan.push_back([=, e = eps, h = step](AtvRun *run) { return runs.ida(m.name, e, h, m.form, run); });
#endif
  return plan;
}

/* Work for a separate process, and how this process takes over its results */
struct Task {
  std::function<bool(FILE *)> run, read;
};

static Task TaskOf(const Planned &planned, AtvRun *run)
{
  return {[=](FILE *file) { return !planned(run) && Write(*run, file); }, [=](FILE *file) { return Read(file, run) && !Done(*run); }};
}

static Task Conditioning(const AtvRuns &runs, AtvResults *results)
{
  std::vector<hhtstab::Conditions> *list = &results->condition;
  return {[=, &runs](FILE *file) { return !runs.conditions(results->step, list) && WriteValues(*list, file); },
          [=](FILE *file) {
            if (!ReadValues(file, list)) return false;
            for (size_t k = 0; k < list->size(); k++)
              PetscCallAbort(PETSC_COMM_SELF, PetscPrintf(PETSC_COMM_SELF, "conditioning at h=%.0e: (a) %.1e, (b) %.1e, (c) %.1e\n", results->step[k],
                                                          (*list)[k].a, (*list)[k].b, (*list)[k].c));
            return true;
          }};
}

static Task Motion(const AtvRuns &runs, const ReducedBody &body, const std::string &page)
{
  return {[=, &runs, &body](FILE *) { return !runs.page(body, page); },
          [](FILE *) { return !PetscPrintf(PETSC_COMM_SELF, "the vehicle in motion\n"); }};
}

constexpr PetscInt hot_spots = 10;

/* Task for a run of the comparison: its samples, if `still` is given, and its hot spots */
static Task Spots(const AtvRuns &runs, const AtvStress &stress, const Timed *still, AtvRun *run, std::vector<HotSpot> *spots)
{
  return {[=, &runs, &stress](FILE *file) {
            AtvRun sampled = *run;
            return !(still && still->run(runs, AtvRuns::Samples, &sampled)) && !stress.spots(sampled, hot_spots, spots) && Write(sampled, file) && WriteValues(*spots, file);
          },
          [=](FILE *file) {
            AtvRun sampled;
            if (!Read(file, &sampled) || !ReadValues(file, spots)) return false;
            run->time = sampled.time;
            run->x    = sampled.x;
            return true;
          }};
}

/* Reference, reference with twice the step, condition numbers, the animated page, samples and hot spots of the timed
   runs, and the sweep */
static PetscErrorCode RunOthers(const AtvRuns &runs, const ReducedBody &body, const AtvStress &stress, const std::string &page, bool sweep, bool fine, AtvResults *results)
{
  const auto reference = [&runs](const char *name, double step) -> Planned {
    return [=, &runs](AtvRun *run) { return runs.hht(name, 1e-8, step, LittleDamping, run, AtvRuns::Samples); };
  };
  std::vector<Task> tasks = {TaskOf(reference("reference", 5e-5), &results->reference),
                             TaskOf(reference("reference at twice the step", 1e-4), &results->check), Conditioning(runs, results)};

  PetscFunctionBegin;
  if (!page.empty()) tasks.push_back(Motion(runs, body, page));
  results->found.resize(results->main.size());
  for (size_t i = 0; i < results->main.size(); i++) tasks.push_back(Spots(runs, stress, i < std::size(timed) ? &timed[i] : nullptr, &results->main[i], &results->found[i]));
  if (sweep) {
    const std::vector<Planned> plan = Sweep(runs, fine);
    results->sweep.resize(plan.size());
    for (size_t k = 0; k < plan.size(); k++) tasks.push_back(TaskOf(plan[k], &results->sweep[k]));
  }
  PetscCall(SideBySide(
      results->jobs, (int)tasks.size(), [&](int k, FILE *file) { return tasks[k].run(file); },
      [&](int k, FILE *file) { return tasks[k].read(file); }));
  PetscFunctionReturn(0);
}

static PetscErrorCode Run()
{
  char        frame[PETSC_MAX_PATH_LEN] = "frame.h5", out[PETSC_MAX_PATH_LEN] = "atv.html";
  AtvRuns     runs;
  AtvResults  results;
  ReducedBody body;
  PetscInt    repeats = 3, jobs = 1;
  PetscBool   sweep = PETSC_TRUE, fine = PETSC_FALSE;
  PetscReal   end = 2, limit = 120;

  PetscFunctionBeginUser;
  PetscCall(PetscOptionsGetString(nullptr, nullptr, "-frame", frame, sizeof(frame), nullptr));
  PetscCall(PetscOptionsGetString(nullptr, nullptr, "-o", out, sizeof(out), nullptr));
  PetscCall(PetscOptionsGetReal(nullptr, nullptr, "-end", &end, nullptr));
  PetscCall(PetscOptionsGetReal(nullptr, nullptr, "-limit", &limit, nullptr));
  PetscCall(PetscOptionsGetInt(nullptr, nullptr, "-repeats", &repeats, nullptr));
  PetscCall(PetscOptionsGetInt(nullptr, nullptr, "-jobs", &jobs, nullptr));
  PetscCall(PetscOptionsGetBool(nullptr, nullptr, "-sweep", &sweep, nullptr));
  PetscCall(PetscOptionsGetBool(nullptr, nullptr, "-fine", &fine, nullptr));
  const double intervals = end / (sweep_samples * runs.dt); /* distance of the sweep's sample times, which are a subset of the reference's */
  PetscCheck(end > 0 && repeats > 0 && jobs > 0, PETSC_COMM_SELF, PETSC_ERR_ARG_OUTOFRANGE, "-end, -repeats and -jobs must be positive");
  PetscCheck(std::fabs(intervals - std::round(intervals)) < 1e-9, PETSC_COMM_SELF, PETSC_ERR_ARG_OUTOFRANGE, "-end is %g s and must be a multiple of %g s",
             (double)end, sweep_samples * runs.dt);
  PetscCall(body.load(PETSC_COMM_SELF, frame));
  runs.model = std::make_shared<ModalBody>(body.modal);
  runs.end   = end;
  runs.limit = limit;
  PetscCall(RunMain(runs, repeats, &results.main));
  results.jobs = (int)jobs;
  results.step = {1e-2, 1e-3, 1e-4, 1e-5, 1e-6};
  hhtex::Atv atv(PETSC_COMM_SELF, runs.model);
  atv.watchFrame();
  PetscCall(atv.scene.setUp());
  const AtvStress stress(body, atv);
#if defined(HHTDAE_PAGE)
  const std::string scene = std::string(out) + ".scene.html";
#else
  const std::string scene;
#endif
  PetscCall(RunOthers(runs, body, stress, scene, sweep, fine, &results));

  PetscCall(stress.spots(results.reference, hot_spots, &results.spots));
  PetscCall(AtvPage(results, atv, body, stress, scene).write(out));
  if (!scene.empty()) std::remove(scene.c_str());
  PetscCall(PetscPrintf(PETSC_COMM_SELF, "page: %s\n", out));
  PetscFunctionReturn(0);
}

int main(int argc, char **argv)
{
  PetscFunctionBeginUser;
  PetscCall(PetscInitialize(&argc, &argv, nullptr, help));
  PetscCall(TSHHT3Initialize());
  PetscCall(Run());
  PetscCall(PetscFinalize());
  return 0;
}
