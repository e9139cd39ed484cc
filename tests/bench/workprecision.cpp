static char help[] = "Error against run time: both forms of hhtdae, PETSc's ALPHA2 and BDF, and SUNDIALS IDA (where it "
                     "was found), in turn in\n"
                     "one process, on problems written by hand and on scenes. Error: largest weighted difference to "
                     "the reference over the\n"
                     "output points. Time: CPU time of the solve alone, median of the repeats. Results: tables, CSV, "
                     "pictures, report.html.\n"
                     "  -problems <a,b,...>: problems [all but heldout]; \"written\", \"scenes\", \"heldout\" are all of one kind\n"
                     "  -solvers <a,b,...>: solvers [all]; the first one is what the others are compared with\n"
                     "  -sweep <also>: variations of hhtdae's own settings: also, only (in full), no\n"
                     "  -eps_max <1e-2> -eps_min <1e-8>: range of tolerances, two per decade with -dense [one]\n"
                     "  -repeats <5>: runs of which the median counts, fewer of long ones\n"
                     "  -limit <1.5>: CPU seconds after which a run counts as failed\n"
                     "  -errors <q|v|lambda>: tables per problem for this error [q]\n"
                     "  -out <dir>: where CSV, pictures and page go [the directory above the program's]\n"
                     "Further options, such as -ts_hhtdae_predictor_degree, go to every TS.\n";

#include <hhtdae/flexible.h>
#include <hhtdae/scene.h>

#include "workprecision_heldout.h"
#include "workprecision_page.h"
#if defined(HHTDAE_HAVE_IDA)
#include "workprecision_ida.h"
#endif

#include <cstdlib>
#include <set>
#include <slepcsys.h>
#include <unistd.h>

using namespace wp;

/* Several BLAS threads would waste time by busy waiting, which would be counted; OpenBLAS reads its environment only
   when it is loaded, so the program is executed again */
static void runSingleThreaded(char **argv)
{
  if (getenv("OMP_NUM_THREADS") && getenv("OPENBLAS_NUM_THREADS")) return;
  setenv("OMP_NUM_THREADS", "1", 1);
  setenv("OPENBLAS_NUM_THREADS", "1", 1);
  execv("/proc/self/exe", argv);
}

/* Keeps the entries that the option -name lists, in that order */
template <class T> static PetscErrorCode Select(const char *option, std::vector<T> &list)
{
  char     *names[100];
  PetscInt  n = 100;
  PetscBool given;

  PetscFunctionBegin;
  PetscCall(PetscOptionsGetStringArray(nullptr, nullptr, option, names, &n, &given));
  if (!given) PetscFunctionReturn(0);
  std::vector<T> chosen;
  for (PetscInt k = 0; k < n; k++) {
    auto found = std::find_if(list.begin(), list.end(), [&](const T &x) { return x.name == names[k]; });
    PetscCheck(found != list.end(), PETSC_COMM_SELF, PETSC_ERR_USER, "%s: there is no \"%s\"", option, names[k]);
    chosen.push_back(*found);
    PetscCall(PetscFree(names[k]));
  }
  list = chosen;
  PetscFunctionReturn(0);
}

static bool IsHeldOut(const Case &c) { return c.name.rfind("held:", 0) == 0; }

/* The same for problems, with names for all of one kind */
static PetscErrorCode SelectCases(std::vector<Case> &list)
{
  char      name[16];
  PetscBool given;

  PetscFunctionBegin;
  PetscCall(PetscOptionsGetString(nullptr, nullptr, "-problems", name, sizeof(name), &given));
  const std::string kind = given ? name : "";
  if (given && kind != "written" && kind != "scenes" && kind != "heldout") {
    PetscCall(Select("-problems", list));
    PetscFunctionReturn(0);
  }
  const auto other = [&](const Case &c) { return IsHeldOut(c) != (kind == "heldout") || (kind == "written" && c.scene) || (kind == "scenes" && !c.scene); };
  list.erase(std::remove_if(list.begin(), list.end(), other), list.end());
  PetscFunctionReturn(0);
}

struct Grid {
  std::vector<double> eps;
  PetscInt            repeats = 5;
  Limits              limits;
};

static PetscErrorCode ReadGrid(Grid &grid)
{
  PetscReal from = 1e-2, to = 1e-8, limit = 1.5;
  PetscBool dense = PETSC_FALSE;

  PetscFunctionBegin;
  PetscCall(PetscOptionsGetReal(nullptr, nullptr, "-eps_max", &from, nullptr));
  PetscCall(PetscOptionsGetReal(nullptr, nullptr, "-eps_min", &to, nullptr));
  PetscCall(PetscOptionsGetReal(nullptr, nullptr, "-limit", &limit, nullptr));
  PetscCall(PetscOptionsGetInt(nullptr, nullptr, "-repeats", &grid.repeats, nullptr));
  PetscCall(PetscOptionsGetBool(nullptr, nullptr, "-dense", &dense, nullptr));
  PetscCheck(to > 0. && from >= to && grid.repeats > 0, PETSC_COMM_SELF, PETSC_ERR_ARG_OUTOFRANGE,
             "0 < -eps_min <= -eps_max and -repeats > 0 are needed");
  grid.limits.seconds = limit;
  for (double eps = from; eps > to * .99; eps *= dense ? std::sqrt(.1) : .1) grid.eps.push_back(eps);
  PetscFunctionReturn(0);
}

/* A solver that has reached the limit of time is not tried at smaller tolerances */
static const char *const gaveUp = "not tried: reached the limit at a looser tolerance";

static bool HasGivenUp(const Curve &c)
{
  if (c.runs.empty()) return false;
  const std::string &last = c.runs.back().failure;
  return last == tooLong || last == gaveUp;
}

/* A failed run is not repeated, and long runs are repeated less often */
static bool Enough(const Run &run, size_t repeats)
{
  return repeats > 0 && (!run.failure.empty() || run.time * (double)repeats > 0.15);
}

/* A short run is made twice, because during the first one the caches contain the data of another solver */
static PetscErrorCode RunOnce(const Solver &solver, const Case &c, const Problem &p, const Reference &ref, double eps,
                              const Limits &limits, Run *run)
{
  PetscFunctionBegin;
  PetscCall(solver.run(c, p, ref, eps, limits, run));
  if (run->failure.empty() && run->time < 0.02) PetscCall(solver.run(c, p, ref, eps, limits, run));
  PetscFunctionReturn(0);
}

/* All solvers at one tolerance, alternately, as often as asked */
static PetscErrorCode RunTolerance(const Case &c, const Problem &p, const Reference &ref, double eps, const Grid &grid,
                                   const std::vector<Solver> &solvers, std::vector<Curve> &curves)
{
  std::vector<std::vector<double>> times(solvers.size());
  std::vector<Run>                 runs(solvers.size());

  PetscFunctionBegin;
  for (PetscInt repeat = 0; repeat < grid.repeats; repeat++)
    for (size_t s = 0; s < solvers.size(); s++) {
      if (HasGivenUp(curves[s])) {
        runs[s].failure = gaveUp;
        continue;
      }
      if (Enough(runs[s], times[s].size())) continue;
      PetscCall(RunOnce(solvers[s], c, p, ref, eps, grid.limits, &runs[s]));
      times[s].push_back(runs[s].time);
    }
  for (size_t s = 0; s < solvers.size(); s++) {
    std::sort(times[s].begin(), times[s].end());
    if (!times[s].empty()) runs[s].time = times[s][times[s].size() / 2];
    curves[s].eps.push_back(eps);
    curves[s].runs.push_back(runs[s]);
  }
  PetscFunctionReturn(0);
}

static PetscErrorCode RunCase(const Case &c, const Problem &p, const Grid &grid, const std::vector<Solver> &solvers,
                              std::vector<Curve> &curves)
{
  const Reference ref(p);

  PetscFunctionBegin;
  curves.assign(solvers.size(), Curve());
  for (double eps : grid.eps) PetscCall(RunTolerance(c, p, ref, eps, grid, solvers, curves));
  PetscFunctionReturn(0);
}

/* Every problem with all solvers, then with the settings of the sweep; a problem without a reference is left out with
   a message */
static PetscErrorCode RunAll(Results &r, Results &sweep, const Grid &grid, const Grid &coarse)
{
  PetscFunctionBegin;
  for (Results *x : {&r, &sweep}) x->curve.resize(r.cases.size());
  r.origin.resize(r.cases.size());
  for (size_t i = 0; i < r.cases.size(); i++) {
    const double             start = ProcessorSeconds();
    std::unique_ptr<Problem> problem;
    PetscCall(r.cases[i].make(&problem, &r.origin[i]));
    const double found = ProcessorSeconds() - start;
    if (r.origin[i].failure.empty()) {
      if (!r.solvers.empty()) PetscCall(RunCase(r.cases[i], *problem, grid, r.solvers, r.curve[i]));
      if (!sweep.solvers.empty()) PetscCall(RunCase(r.cases[i], *problem, coarse, sweep.solvers, sweep.curve[i]));
    }
    fprintf(stderr, "%s: %d unknowns, %.1f s%s%s%s\n", r.cases[i].name.c_str(), (int)problem->n, ProcessorSeconds() - start,
            r.cases[i].scene ? Text(", reference %.1f s", found).c_str() : "",
            r.origin[i].failure.empty() ? "" : ", left out: ", r.origin[i].failure.c_str());
  }
  sweep.cases  = r.cases;
  sweep.origin = r.origin;
  PetscFunctionReturn(0);
}

static PetscErrorCode OutputDirectory(const char *program, std::string &out)
{
  char      text[PETSC_MAX_PATH_LEN];
  PetscBool given;

  PetscFunctionBegin;
  PetscCall(PetscOptionsGetString(nullptr, nullptr, "-out", text, sizeof(text), &given));
  out = program;
  out = given ? text : out.find('/') == std::string::npos ? "." : out.substr(0, out.rfind('/')) + "/..";
  PetscFunctionReturn(0);
}

static void PrintTables(const Results &r, int kind, bool problems)
{
  for (int scene = 0; scene < 2; scene++) {
    const Group       group = Scenes(r, scene);
    const std::string what  = scene ? "Scenes" : "Hand-written problems";
    if (group.empty()) continue;
    for (size_t i : group)
      if (problems) problemTable(r, i, kind).print();
    byProblemTable(r, group, kind, what).print();
    for (int k = 0; k < 3; k++) summaryTable(r, group, k, what).print();
    if (scene) summaryTable(r, group, 0, what, Time::WithoutAdapter).print();
    if (scene) originTable(r).print();
  }
  failureTable(r).print();
}

static PetscErrorCode Report(const Results &r, const Results &sweep, PageSetting page)
{
  char kindName[16] = "q";

  PetscFunctionBegin;
  PetscCall(PetscOptionsGetString(nullptr, nullptr, "-errors", kindName, sizeof(kindName), nullptr));
  const int kind = kindName[0] == 'v' ? 1 : kindName[0] == 'l' ? 2 : 0;
  if (!sweep.solvers.empty()) {
    PrintTables(sweep, kind, false);
    PetscCall(WriteCSV(sweep, page.out + "/sweep.csv"));
  }
  if (r.solvers.empty()) PetscFunctionReturn(0);
  PrintTables(r, kind, true);
  PetscCall(WriteCSV(r, page.out + "/workprecision.csv"));
  PetscCall(Plot(r, page.out, &page.pictures));
  PetscCall(WritePage(r, sweep, page));
  PetscFunctionReturn(0);
}

/* Reads the options of the sweep; without other runs it takes all tolerances */
static PetscErrorCode ReadSweep(Results &r, Results &sweep, const Grid &grid, Grid &coarse)
{
  char      text[16] = "also";
  PetscBool given;

  PetscFunctionBegin;
  PetscCall(PetscOptionsGetString(nullptr, nullptr, "-sweep", text, sizeof(text), &given));
  const std::string which = given && !text[0] ? "only" : text;
  PetscCheck(which == "also" || which == "only" || which == "no", PETSC_COMM_SELF, PETSC_ERR_ARG_WRONG,
             "-sweep %s: must be also, only or no", text);
  r.solvers = allSolvers();
  PetscCall(Select("-solvers", r.solvers));
  if (which != "no") sweep.solvers = sweepSolvers();
  coarse = grid;
  if (which == "only") r.solvers.clear();
  if (which != "also") PetscFunctionReturn(0);
  coarse.repeats = PetscMin(grid.repeats, 3);
  coarse.eps.clear();
  for (double eps : grid.eps)
    if (eps < 2e-3 && eps > 5e-7) coarse.eps.push_back(eps);
  PetscFunctionReturn(0);
}

static std::string CommandLine(int argc, char **argv)
{
  std::string line = "bin/workprecision";
  for (int k = 1; k < argc; k++) line += std::string(" ") + argv[k];
  return line;
}

int main(int argc, char **argv)
{
  Results     r, sweep;
  Grid        grid, coarse;
  PageSetting page;

  runSingleThreaded(argv);
  page.command = CommandLine(argc, argv);
  PetscFunctionBeginUser;
  PetscCall(SlepcInitialize(&argc, &argv, nullptr, help));
  PetscCall(TSHHT3Initialize());
  PetscCall(ReadGrid(grid));
  PetscCall(OutputDirectory(argv[0], page.out));
  r.cases = allCases();
  for (const std::vector<Case> &scenes : {allScenes(), heldOut()}) r.cases.insert(r.cases.end(), scenes.begin(), scenes.end());
  PetscCall(SelectCases(r.cases));
  PetscCall(ReadSweep(r, sweep, grid, coarse));
  PetscCall(RunAll(r, sweep, grid, coarse));
  page.repeats = (int)grid.repeats;
  page.limit   = grid.limits.seconds;
  page.seconds = ProcessorSeconds();
  PetscCall(Report(r, sweep, page));
  PetscCall(SlepcFinalize());
  return 0;
}
