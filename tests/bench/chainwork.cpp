static char help[] =
    "Work per step on a chain of N pinned rods that falls from rest: where the time of a step goes.\n"
    "  -models <hand>: of hand (written equations, planar), planar, spatial (scenes); several are compared, run by run\n"
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

#include "hhtdae/scene.h"
#include "problem.h"
#include "problems/chain.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <ctime>
#include <unistd.h>
#include <vector>

/* Several BLAS threads would waste time by busy waiting; OpenBLAS reads its environment only when it is loaded, so the
   program is executed again */
static void runSingleThreaded(char **argv)
{
  if (getenv("OMP_NUM_THREADS") && getenv("OPENBLAS_NUM_THREADS")) return;
  setenv("OMP_NUM_THREADS", "1", 1);
  setenv("OPENBLAS_NUM_THREADS", "1", 1);
  execv("/proc/self/exe", argv);
}

enum Part { Residual, Jacobian, Factor, Solve, Else, NumParts };

constexpr PetscInt BEGIN = 10; /* number of first steps that are not measured */

struct Sample {
  double   bytes = 0.;             /* resident memory after the run minus that before */
  double   begin = 0., total = 0.; /* CPU seconds of TSSolve() up to step BEGIN, and from there on */
  double   part[NumParts] = {};    /* wall-clock seconds of the parts after step BEGIN, as logged by PETSc */
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

/* Activates only the events that are read, because others cost time */
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

/* Clocks and counters at one moment of a run */
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

/* The same chain as a scene: rods of 1 kg and 1 m */
static void Describe(hhtdae::Scene &scene, PetscInt N, double angle)
{
  using namespace hhtdae;
  const Matrix3 turn = Eigen::AngleAxisd(angle * M_PI / 180, Vector3::UnitZ()).toRotationMatrix();
  Marker        last = scene.marker(scene.ground());
  for (PetscInt k = 0; k < N; k++) {
    RigidBody rod;
    rod.inertia  = Vector3(1e-3, 1. / 12, 1. / 12).asDiagonal();
    rod.rotation = turn;
    rod.position = turn * Vector3(k + 0.5, 0, 0);
    const Body b = scene.add("", rod);
    scene.add("", Revolute{scene.marker(b, {-0.5, 0, 0}), last});
    last = scene.marker(b, {0.5, 0, 0});
  }
  scene.gravity({0, -9.81, 0});
}

/* Resident bytes of this process */
static double memory()
{
  PetscLogDouble bytes = 0;
  PetscCallAbort(PETSC_COMM_SELF, PetscMemoryGetCurrentUsage(&bytes));
  return bytes;
}

static PetscErrorCode RunTS(TS ts, double eps, PetscInt steps, Sample *sample)
{
  Moment before = {}, first = {}, last = {};

  PetscFunctionBegin;
  PetscCall(TSSetMaxSteps(ts, steps));
  PetscCall(TSSetTolerances(ts, eps, nullptr, eps, nullptr));
  PetscCall(TSMonitorSet(ts, NoteBegin, &first, nullptr));
  PetscCall(TSSetFromOptions(ts));
  PetscCall(Now(ts, &before));
  PetscCall(TSSolve(ts, nullptr));
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
  PetscFunctionReturn(0);
}

enum Model { Hand, Planar, Spatial };
static const char *const models[] = {"hand", "planar", "spatial"};

static PetscErrorCode RunChain(Model model, PetscInt N, double angle, double eps, PetscInt steps, Sample *sample)
{
  TS           ts;
  Vec          U = nullptr, V = nullptr;
  const double before = memory();

  PetscFunctionBegin;
  if (model == Hand) {
    const hhtex::Chain problem(N, angle, 1e3);
    PetscCall(hhtex::ProblemCreateTS(PETSC_COMM_SELF, problem, &ts, &U, &V));
    PetscCall(TSSetTimeStep(ts, 0.1)); /* set before the type it does not count as set by the user: the first step is chosen */
    PetscCall(TSSetType(ts, TSHHT3));
    PetscCall(TS2SetSolution(ts, U, V));
    PetscCall(RunTS(ts, eps, steps, sample));
  } else {
    hhtdae::Scene scene(PETSC_COMM_SELF, model == Planar ? hhtdae::Space::Planar : hhtdae::Space::Spatial);
    Describe(scene, N, angle);
    PetscCall(scene.createTS(&ts));
    PetscCall(RunTS(ts, eps, steps, sample));
    sample->bytes = memory() - before;
    PetscCall(TSDestroy(&ts));
    PetscFunctionReturn(0);
  }
  sample->bytes = memory() - before;
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

/* From the run that other processes disturbed least, because PETSc logs wall-clock time */
static double share(const std::vector<Sample> &samples, int part)
{
  const Sample &s = *std::min_element(samples.begin(), samples.end(),
                                      [](const Sample &a, const Sample &b) { return wall(a) < wall(b); });
  return 100. * s.part[part] / wall(s);
}

struct Row {
  PetscInt N;
  double   step, other, assembly; /* us per accepted step; shares of everything else and of residual and Jacobian */
};

static Row PrintRow(Model model, PetscInt N, const std::vector<Sample> &plain, const std::vector<Sample> &events)
{
  const Sample &s     = plain[0];
  const double  steps = (double)s.steps, total = median(plain, [](const Sample &x) { return x.total; }),
               begin   = median(plain, [](const Sample &x) { return x.begin; }),
               logging = median(events, [](const Sample &x) { return x.total; }) / total - 1.;
  printf("%8s %6d %7d %6d %6d %9.2f %9.2f %8.1f %6.2f %7.3f %7.0f", models[model], (int)N, (int)((model == Spatial ? 11 : 5) * N),
         (int)s.steps, (int)s.rejected, 1e3 * begin, 1e6 * total / steps, 1e9 * total / steps / (double)N,
         (double)s.newton / steps, (double)s.factored / steps, plain[0].bytes / (double)N);
  for (int k = 0; k < NumParts; k++) printf(" %8.1f%%", share(events, k));
  printf(" %8.1f%%\n", 100. * logging);
  return {N, 1e6 * total / steps, share(events, Else), share(events, Residual) + share(events, Jacobian)};
}

/* Compares the results with the project's limits */
static void PrintVerdict(Model model, const std::vector<Row> &rows, const std::vector<Row> &hand)
{
  for (const Row &r : rows) {
    const double limit = r.N >= 1000 ? 15. : 25.;
    if (r.N < 100) continue;
    if (model == Hand)
      printf("%s, N = %d: everything else %.1f %%, at most %.0f %% wanted: %s\n", models[model], (int)r.N, r.other, limit,
             r.other <= limit ? "met" : "MISSED");
    if (model == Spatial && r.N == 10000)
      printf("%s, N = %d: residual and Jacobian %.1f %%, at most 50 %% wanted: %s\n", models[model], (int)r.N, r.assembly,
             r.assembly <= 50 ? "met" : "MISSED");
  }
  for (size_t k = 1; k < rows.size(); k++) {
    const double exponent = std::log(rows[k].step / rows[k - 1].step) / std::log((double)rows[k].N / rows[k - 1].N);
    printf("%s, N = %d to %d: time per step grows like N^%.2f\n", models[model], (int)rows[k - 1].N, (int)rows[k].N, exponent);
  }
  for (size_t k = 0; k < rows.size() && k < hand.size() && model == Planar; k++)
    printf("%s, N = %d: time per step over that of the written equations: %.2f, at most 1.50 wanted: %s\n", models[model],
           (int)rows[k].N, rows[k].step / hand[k].step, rows[k].step <= 1.5 * hand[k].step ? "met" : "MISSED");
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
  std::vector<Model> chosen;
  char              *names[3];
  PetscInt           number = 3;
  PetscBool          several;
  PetscCall(PetscOptionsGetStringArray(nullptr, nullptr, "-models", names, &number, &several));
  for (PetscInt k = 0; several && k < number; k++) {
    const auto found = std::find_if(models, models + 3, [&](const char *m) { return !strcmp(m, names[k]); });
    PetscCheck(found != models + 3, PETSC_COMM_SELF, PETSC_ERR_USER, "-models %s: not one of hand, planar, spatial", names[k]);
    chosen.push_back((Model)(found - models));
    PetscCall(PetscFree(names[k]));
  }
  if (!several) chosen.push_back(Hand);

  const PetscInt                   count = set ? given : 4;
  std::vector<std::vector<Sample>> plain[3], events[3];
  std::vector<Row>                 rows[3];
  for (int m = 0; m < 3; m++) {
    plain[m].resize(count);
    events[m].resize(count);
  }
  for (int log = 0; log < 2; log++) {
    if (log) PetscCall(StartLog());
    for (PetscInt k = 0; k < count; k++)
      for (PetscInt r = 0; r < repeats; r++)
        for (Model m : chosen) {
          Sample sample;
          PetscCall(RunChain(m, sizes[k], angle, eps, steps, &sample));
          (log ? events : plain)[m][k].push_back(sample);
        }
  }
  printf("Falling chain, tolerance %g, at most %d steps; CPU time per accepted step, shares of the solve\n\n",
         (double)eps, (int)steps);
  printf("%8s %6s %7s %6s %6s %9s %9s %8s %6s %7s %7s %9s %9s %9s %9s %9s %9s\n", "model", "N", "unknown", "steps", "failed",
         "begin/ms", "us/step", "ns/st/N", "it/st", "fac/st", "bytes/N", "residual", "Jacobian", "factor", "solve", "else", "logging");
  for (PetscInt k = 0; k < count; k++)
    for (Model m : chosen) rows[m].push_back(PrintRow(m, sizes[k], plain[m][k], events[m][k]));
  printf("\n");
  for (Model m : chosen) PrintVerdict(m, rows[m], rows[Hand]);
  PetscCall(PetscFinalize());
  return 0;
}
