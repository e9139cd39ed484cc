static char help[] =
    "Work per step on a planar chain of N pinned rods that falls from rest: where the time of a step goes.\n"
    "  -sizes <10,100,1000,10000>: numbers of rods\n"
    "  -eps <1e-6>: tolerance\n"
    "  -steps <300>: accepted steps after which a run ends\n"
    "  -angle <0>: start angle from the horizontal, degrees\n"
    "  -repeats <7>: runs of which the medians count\n"
    "Options of the integrator are taken, -ts_hhtdae_...\n\n"
    "The first ten steps, with the consistent start, the symbolic factorization and the growth of h, are left out and "
    "shown\n"
    "as 'begin'. Shares come from PETSc's log events of the application's functions, factorizations and triangular "
    "solves, with all\n"
    "other events switched off; 'else' is what is left of TSSolve(). Times per step come from runs without any "
    "logging,\n"
    "and 'logging' is what the events add to them.\n";

#include "problem.h"
#include "problems/chain.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <ctime>
#include <unistd.h>
#include <vector>

/* Threads of the BLAS would spin. The library reads its environment when it is loaded. */
static void runSingleThreaded(char **argv)
{
  if (getenv("OMP_NUM_THREADS") && getenv("OPENBLAS_NUM_THREADS")) return;
  setenv("OMP_NUM_THREADS", "1", 1);
  setenv("OPENBLAS_NUM_THREADS", "1", 1);
  execv("/proc/self/exe", argv);
}

enum Part { Residual, Jacobian, Factor, Solve, Else, NumParts };

constexpr PetscInt BEGIN = 10; /* steps that are left out */

struct Sample {
  double   begin = 0., total = 0.; /* CPU seconds of TSSolve() up to step BEGIN, and from there on */
  double   part[NumParts] = {};    /* from there on, wall-clock seconds, as PETSc logs them */
  PetscInt steps = 0, newton = 0, factored = 0, rejected = 0;
};

static const struct {
  const char *event;
  Part        part;
} logged[] = {{"TSFunctionEval", Residual}, {"TSJacobianEval", Jacobian}, {"MatLUFactorNum", Factor},
              {"MatLUFactorSym", Factor},   {"MatCholFctrNum", Factor},   {"MatCholFctrSym", Factor},
              {"MatGetOrdering", Factor},   {"MatSolve", Solve}};

static double clockSeconds(clockid_t clock)
{
  timespec t = {};
  clock_gettime(clock, &t);
  return t.tv_sec + 1e-9 * t.tv_nsec;
}

static bool logging = false;

/* Only the events that are read cost time */
static PetscErrorCode StartLog()
{
  PetscFunctionBegin;
  PetscCall(PetscLogDefaultBegin());
  logging = true;
  for (PetscClassId id : {VEC_CLASSID, MAT_CLASSID, PC_CLASSID, KSP_CLASSID, SNES_CLASSID, TS_CLASSID})
    PetscCall(PetscLogEventDeactivateClass(id));
  for (const auto &l : logged) {
    PetscLogEvent event;
    PetscCall(PetscLogEventGetId(l.event, &event));
    if (event >= 0) PetscCall(PetscLogEventActivate(event));
  }
  PetscFunctionReturn(0);
}

static PetscErrorCode ReadLog(double part[NumParts])
{
  PetscFunctionBegin;
  std::fill_n(part, (int)NumParts, 0.);
  for (const auto &l : logged) {
    PetscLogEvent      event;
    PetscEventPerfInfo info = {};
    PetscCall(PetscLogEventGetId(l.event, &event));
    if (event < 0 || !logging) continue;
    PetscCall(PetscLogEventGetPerfInfo(PETSC_DETERMINE, event, &info));
    part[l.part] += info.time;
  }
  PetscFunctionReturn(0);
}

/* The clocks and counters at one moment of a run */
struct Moment {
  double           cpu, wall, part[NumParts];
  TSHHT3Statistics stat;
};

static PetscErrorCode Now(TS ts, Moment *m)
{
  PetscFunctionBegin;
  m->cpu  = clockSeconds(CLOCK_PROCESS_CPUTIME_ID);
  m->wall = clockSeconds(CLOCK_MONOTONIC);
  PetscCall(ReadLog(m->part));
  PetscCall(TSHHT3GetStatistics(ts, &m->stat));
  PetscFunctionReturn(0);
}

static PetscErrorCode NoteBegin(TS ts, PetscInt step, PetscReal, Vec, void *ctx)
{
  PetscFunctionBegin;
  if (step == BEGIN) PetscCall(Now(ts, static_cast<Moment *>(ctx)));
  PetscFunctionReturn(0);
}

static PetscErrorCode RunChain(const hhtex::Problem &problem, double eps, PetscInt steps, Sample *sample)
{
  TS     ts;
  Vec    U, V;
  Moment before = {}, first = {}, last = {};

  PetscFunctionBegin;
  PetscCall(hhtex::ProblemCreateTS(PETSC_COMM_SELF, problem, &ts, &U, &V));
  PetscCall(TSSetType(ts, TSHHT3));
  PetscCall(TSSetTimeStep(ts, 0.1)); /* PETSc's default: the integrator chooses the first step */
  PetscCall(TSSetMaxSteps(ts, steps));
  PetscCall(TSSetTolerances(ts, eps, nullptr, eps, nullptr));
  PetscCall(TSMonitorSet(ts, NoteBegin, &first, nullptr));
  PetscCall(TSSetFromOptions(ts));
  PetscCall(Now(ts, &before));
  PetscCall(TSSolve(ts, U));
  PetscCall(Now(ts, &last));
  sample->begin    = first.cpu - before.cpu;
  sample->total    = last.cpu - first.cpu;
  sample->steps    = last.stat.steps - first.stat.steps;
  sample->newton   = last.stat.newton - first.stat.newton;
  sample->factored = last.stat.factorizations - first.stat.factorizations;
  sample->rejected = last.stat.rejected + last.stat.corrector_fails - first.stat.rejected - first.stat.corrector_fails;
  sample->part[Else] = last.wall - first.wall;
  for (int k = 0; k < Else; k++) {
    sample->part[k] = last.part[k] - first.part[k];
    sample->part[Else] -= sample->part[k];
  }
  PetscCall(TSDestroy(&ts));
  PetscCall(VecDestroy(&U));
  PetscCall(VecDestroy(&V));
  PetscFunctionReturn(0);
}

template <class F> static double median(const std::vector<Sample> &samples, F value)
{
  std::vector<double> x;
  for (const Sample &s : samples) x.push_back(value(s));
  std::sort(x.begin(), x.end());
  return x[x.size() / 2];
}

static double wall(const Sample &s)
{
  double sum = 0.;
  for (double p : s.part) sum += p;
  return sum;
}

/* In the run that other processes disturbed least: PETSc logs wall-clock time */
static double share(const std::vector<Sample> &samples, int part)
{
  const Sample &s = *std::min_element(samples.begin(), samples.end(),
                                      [](const Sample &a, const Sample &b) { return wall(a) < wall(b); });
  return 100. * s.part[part] / wall(s);
}

struct Row {
  PetscInt N;
  double   step, other; /* us per accepted step, share of everything else */
};

static Row PrintRow(PetscInt N, const std::vector<Sample> &plain, const std::vector<Sample> &events)
{
  const Sample &s     = plain[0];
  const double  steps = (double)s.steps, total = median(plain, [](const Sample &x) { return x.total; }),
               begin   = median(plain, [](const Sample &x) { return x.begin; }),
               logging = median(events, [](const Sample &x) { return x.total; }) / total - 1.;
  printf("%6d %7d %6d %6d %9.2f %9.2f %8.1f %6.2f %7.3f", (int)N, (int)(5 * N), (int)s.steps, (int)s.rejected,
         1e3 * begin, 1e6 * total / steps, 1e9 * total / steps / (double)N, (double)s.newton / steps,
         (double)s.factored / steps);
  for (int k = 0; k < NumParts; k++) printf(" %8.1f%%", share(events, k));
  printf(" %8.1f%%\n", 100. * logging);
  return {N, 1e6 * total / steps, share(events, Else)};
}

/* What the project asks of the chain */
static void PrintVerdict(const std::vector<Row> &rows)
{
  for (const Row &r : rows) {
    const double limit = r.N >= 1000 ? 15. : 25.;
    if (r.N < 100) continue;
    printf("N = %d: everything else %.1f %%, at most %.0f %% wanted: %s\n", (int)r.N, r.other, limit,
           r.other <= limit ? "met" : "MISSED");
  }
  for (size_t k = 1; k < rows.size(); k++) {
    const double exponent = std::log(rows[k].step / rows[k - 1].step) / std::log((double)rows[k].N / rows[k - 1].N);
    printf("N = %d to %d: time per step grows like N^%.2f\n", (int)rows[k - 1].N, (int)rows[k].N, exponent);
  }
}

int main(int argc, char **argv)
{
  PetscInt  sizes[20] = {10, 100, 1000, 10000}, given = 20, repeats = 7, steps = 300;
  PetscReal eps = 1e-6, angle = 0.;
  PetscBool set;

  runSingleThreaded(argv);
  PetscFunctionBeginUser;
  PetscCall(PetscInitialize(&argc, &argv, nullptr, help));
  PetscCall(TSHHT3Initialize());
  PetscCall(PetscOptionsGetIntArray(nullptr, nullptr, "-sizes", sizes, &given, &set));
  PetscCall(PetscOptionsGetInt(nullptr, nullptr, "-repeats", &repeats, nullptr));
  PetscCall(PetscOptionsGetInt(nullptr, nullptr, "-steps", &steps, nullptr));
  PetscCall(PetscOptionsGetReal(nullptr, nullptr, "-eps", &eps, nullptr));
  PetscCall(PetscOptionsGetReal(nullptr, nullptr, "-angle", &angle, nullptr));
  const PetscInt                   count = set ? given : 4;
  std::vector<std::vector<Sample>> plain(count), events(count);
  std::vector<Row>                 rows;

  for (int log = 0; log < 2; log++) {
    if (log) PetscCall(StartLog());
    for (PetscInt k = 0; k < count; k++) {
      const hhtex::Chain problem(sizes[k], angle, 1e3);
      auto              &samples = log ? events[k] : plain[k];
      samples.resize(repeats);
      for (Sample &s : samples) PetscCall(RunChain(problem, eps, steps, &s));
    }
  }
  printf("Falling chain, tolerance %g, at most %d steps; CPU time per accepted step, shares of the solve\n\n",
         (double)eps, (int)steps);
  printf("%6s %7s %6s %6s %9s %9s %8s %6s %7s %9s %9s %9s %9s %9s %9s\n", "N", "unknown", "steps", "failed", "begin/ms",
         "us/step", "ns/st/N", "it/st", "fac/st", "residual", "Jacobian", "factor", "solve", "else", "logging");
  for (PetscInt k = 0; k < count; k++) rows.push_back(PrintRow(sizes[k], plain[k], events[k]));
  printf("\n");
  PrintVerdict(rows);
  PetscCall(PetscFinalize());
  return 0;
}
