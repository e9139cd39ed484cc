static char help[] = "Error against run time of every example problem with a reference: both forms of hhtdae, PETSc's "
                     "ALPHA2 and BDF, and\n"
                     "SUNDIALS IDA (where it was found), in turn in one process. Error: largest weighted difference to "
                     "the reference over\n"
                     "the output points. Time: CPU time of the solve alone, median of the repeats.\n"
                     "  -problems <a,b,...>: problems [all]\n"
                     "  -solvers <a,b,...>: solvers [all]; the first one is what the others are compared with\n"
                     "  -sweep: instead of other solvers, variations of hhtdae's own settings\n"
                     "  -eps_max <1e-2> -eps_min <1e-8>: range of tolerances, two per decade with -dense [one]\n"
                     "  -repeats <5>: runs of which the median counts\n"
                     "  -limit <5>: CPU seconds after which a run counts as failed\n"
                     "  -errors <q|v|lambda>: tables per problem for this error [q]\n"
                     "  -out <dir>: where CSV and pictures go [the directory above the program's]\n"
                     "Further options, such as -ts_hhtdae_predictor_degree, go to every TS.\n";

#include "workprecision_report.h"
#if defined(HHTDAE_HAVE_IDA)
#include "workprecision_ida.h"
#endif

#include <cstdlib>
#include <set>
#include <unistd.h>

using namespace wp;

/* Threads of the BLAS would spin, and their time would count. The library reads its environment when it is loaded. */
static void runSingleThreaded(char **argv)
{
  if (getenv("OMP_NUM_THREADS") && getenv("OPENBLAS_NUM_THREADS")) return;
  setenv("OMP_NUM_THREADS", "1", 1);
  setenv("OPENBLAS_NUM_THREADS", "1", 1);
  execv("/proc/self/exe", argv);
}

/* Keeps what -name lists, in that order */
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

struct Grid {
  std::vector<double> eps;
  PetscInt            repeats = 5;
  Limits              limits;
};

static PetscErrorCode ReadGrid(Grid &grid)
{
  PetscReal from = 1e-2, to = 1e-8, limit = 5.;
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

/* All solvers at one tolerance, in turn, as often as asked; a failure is not repeated */
static PetscErrorCode RunTolerance(const Case &c, const Problem &p, const Reference &ref, double eps, const Grid &grid,
                                   const std::vector<Solver> &solvers, std::vector<Curve> &curves)
{
  std::vector<std::vector<double>> times(solvers.size());
  std::vector<Run>                 runs(solvers.size());

  PetscFunctionBegin;
  for (PetscInt repeat = 0; repeat < grid.repeats; repeat++)
    for (size_t s = 0; s < solvers.size(); s++) {
      if (repeat && !runs[s].failure.empty()) continue;
      PetscCall(solvers[s].run(c, p, ref, eps, grid.limits, &runs[s]));
      times[s].push_back(runs[s].time);
    }
  for (size_t s = 0; s < solvers.size(); s++) {
    std::sort(times[s].begin(), times[s].end());
    runs[s].time = times[s][times[s].size() / 2];
    curves[s].eps.push_back(eps);
    curves[s].runs.push_back(runs[s]);
  }
  PetscFunctionReturn(0);
}

static PetscErrorCode RunCase(const Case &c, const Grid &grid, const std::vector<Solver> &solvers,
                              std::vector<Curve> &curves)
{
  const std::unique_ptr<Problem> problem = c.make();
  const Reference                ref(*problem);

  PetscFunctionBegin;
  curves.assign(solvers.size(), Curve());
  for (double eps : grid.eps) PetscCall(RunTolerance(c, *problem, ref, eps, grid, solvers, curves));
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

static PetscErrorCode Report(const Results &r, const std::string &out, bool sweep)
{
  char kindName[16] = "q";
  int  kind;

  PetscFunctionBegin;
  PetscCall(PetscOptionsGetString(nullptr, nullptr, "-errors", kindName, sizeof(kindName), nullptr));
  kind = kindName[0] == 'v' ? 1 : kindName[0] == 'l' ? 2 : 0;
  if (!sweep)
    for (size_t i = 0; i < r.cases.size(); i++) printProblem(r, i, kind);
  printByProblem(r, kind);
  for (int k = 0; k < 3; k++) printSummary(r, k);
  printFailures(r);
  PetscCall(WriteCSV(r, out + (sweep ? "/sweep.csv" : "/workprecision.csv")));
  if (!sweep) PetscCall(Plot(r, out));
  PetscFunctionReturn(0);
}

int main(int argc, char **argv)
{
  Results     r;
  Grid        grid;
  std::string out;
  PetscBool   sweep = PETSC_FALSE;

  runSingleThreaded(argv);
  PetscFunctionBeginUser;
  PetscCall(PetscInitialize(&argc, &argv, nullptr, help));
  PetscCall(TSHHT3Initialize());
  PetscCall(PetscOptionsGetBool(nullptr, nullptr, "-sweep", &sweep, nullptr));
  PetscCall(ReadGrid(grid));
  PetscCall(OutputDirectory(argv[0], out));
  r.cases   = allCases();
  r.solvers = sweep ? sweepSolvers() : allSolvers();
  PetscCall(Select("-problems", r.cases));
  PetscCall(Select("-solvers", r.solvers));
  r.curve.resize(r.cases.size());
  for (size_t i = 0; i < r.cases.size(); i++) {
    const double start = cpuSeconds();
    PetscCall(RunCase(r.cases[i], grid, r.solvers, r.curve[i]));
    fprintf(stderr, "%s: %.1f s\n", r.cases[i].name.c_str(), cpuSeconds() - start);
  }
  PetscCall(Report(r, out, sweep));
  PetscCall(PetscFinalize());
  return 0;
}
