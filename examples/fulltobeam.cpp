static char help[] =
    "A cantilever of steel under a load at its tip, three times: all finite elements with displacements at large, one\n"
    "body in modal coordinates, two-node beams between rigid pieces. Static deflection against the elastica, first\n"
    "frequency against beam theory, time of a step, for a small and a large load. All three agree under the small;\n"
    "under the large one the modal body is off, as it must be: its displacement is linear in its modes.\n"
    "  -length <1> -depth <0.02> -width <0.02>: m, the load acts along the depth\n"
    "  -E <2.1e11> -nu <0> -rho <7850>: N/m^2, none, kg/m^3; beam theory has no lateral contraction, which\n"
    "      the clamped end and coarse elements hinder: with nu = 0.3 and one element across they are 0.8 % too stiff\n"
    "  -loads <0.01,3>: P L^2/EI, the force in units of the beam's\n"
    "  -elements <20>: along the beam, of 20 nodes;  -across <1>: in each direction of the section\n"
    "  -modes <10>: normal modes of the modal body;  -pieces <20>: of the body of beams\n"
    "  -periods <10>: that the run goes on for;  -points <100>: steps in one\n";

#include "beam_bodies.h"
#include "problem.h"
#include "scene_watch.h"

#include <slepcsys.h>

using namespace hhtdae;

struct Settings {
  hhtex::SolidBeam beam;
  PetscInt         modes = 10, pieces = 20, periods = 10, points = 100;

  double EI() const { return beam.material.young * beam.Izz(); }
  double force(double load) const { return load * EI() / (beam.length * beam.length); }
  /* first frequency of the Euler-Bernoulli beam, Hz */
  double frequency() const
  {
    const double k = 1.875104068711961 / beam.length;
    return k * k * std::sqrt(EI() / (beam.material.density * beam.area())) / (2 * PETSC_PI);
  }
};

struct Deflection {
  double along, across; /* displacement of the tip, relative to the length */
};

/*
  The elastica: theta'' = -a cos theta, theta(0) = 0, theta'(1) = 0, in units of the length, a = P L^2/EI. Shooting for
  the curvature at the root by bisection: it is the smallest curvature for which theta' = 0 at the tip.
*/
static Deflection Elastica(double a)
{
  const int n   = 4000;
  double    low = 0, high = a, x = 0, y = 0;
  for (int k = 0; k < 100; k++) {
    const double curvature = 0.5 * (low + high), h = 1. / n;
    double       s[4] = {0, curvature, 0, 0}; /* theta, theta', x, y */
    const auto   rate = [a](const double *u, double *r) {
      r[0] = u[1], r[1] = -a * std::cos(u[0]), r[2] = std::cos(u[0]), r[3] = std::sin(u[0]);
    };
    for (int i = 0; i < n; i++) {
      double r[4][4], u[4];
      rate(s, r[0]);
      for (int stage = 1; stage < 4; stage++) {
        for (int c = 0; c < 4; c++) u[c] = s[c] + (stage < 3 ? h / 2 : h) * r[stage - 1][c];
        rate(u, r[stage]);
      }
      for (int c = 0; c < 4; c++) s[c] += h / 6 * (r[0][c] + 2 * r[1][c] + 2 * r[2][c] + r[3][c]);
    }
    (s[1] > 0 ? high : low) = curvature;
    x                       = s[2];
    y                       = s[3];
  }
  return {x - 1, y};
}

/* ---- one run ---- */

enum class Kind { Full, Modal, Beams };
static const char *const names[] = {"full", "modal", "beams"};

struct Result {
  Deflection tip;
  double     frequency = 0, step = 0; /* Hz; seconds */
  PetscInt   unknowns = 0;
};

/* A scene with the force on the tip, along y */
struct Cantilever {
  Scene      scene{PETSC_COMM_WORLD};
  FullFeBody fe;
  Marker     tip;

  PetscErrorCode build(const Settings &s, const FeModel &model, Kind kind, double force)
  {
    hhtex::BeamEnds ends;
    UserForce       load;
    PetscFunctionBeginUser;
    if (kind == Kind::Full) PetscCall(AddFullBeam(scene, model, FeLaw::Large, &fe, &ends));
    if (kind == Kind::Modal) PetscCall(AddModalBeam(scene, model, s.beam.length, 1, s.modes, &ends));
    if (kind == Kind::Beams) hhtex::AddBeamElements(scene, s.beam, (int)s.pieces, &ends);
    scene.add("clamp", Fixed{scene.marker(ends.root), scene.marker(scene.ground())});
    tip    = scene.marker(ends.tip);
    load.i = tip;
    for (int k = 0; k < 3; k++) {
      const double f = k == 1 ? force : 0;
      load.force.push_back(Expression({Measure::time()}, [f](const Real *t) -> Real { return 0. * t[0] + f; }));
    }
    scene.add("load", load);
    scene.channel("x", Measure::displacement(tip, 0), "m");
    scene.channel("y", Measure::displacement(tip, 1), "m");
    PetscFunctionReturn(0);
  }

  PetscErrorCode createTS(const Settings &s, double end, TS *ts)
  {
    TSAdapt adapt;
    PetscFunctionBeginUser;
    PetscCall(scene.createTS(ts));
    PetscCall(TSSetMaxTime(*ts, end));
    PetscCall(TSSetMaxSteps(*ts, 10000000));
    PetscCall(TSSetTimeStep(*ts, 1 / (s.frequency() * (double)s.points)));
    PetscCall(TSSetTolerances(*ts, 1e-6 * s.beam.length, nullptr, 1e-6, nullptr));
    PetscCall(TSGetAdapt(*ts, &adapt));
    PetscCall(TSAdaptSetType(adapt, TSADAPTNONE));
    PetscCall(TSSetFromOptions(*ts));
    PetscFunctionReturn(0);
  }
};

/* Reads the static equilibrium of the scene after a first step */
static PetscErrorCode Static(const Settings &s, const FeModel &model, Kind kind, double force, Result *r)
{
  Cantilever          c;
  TS                  ts;
  Vec                 U;
  std::vector<double> values;
  PetscFunctionBeginUser;
  PetscCall(c.build(s, model, kind, force));
  c.scene.start().equilibrium = true;
  /* The search for equilibrium uses the masses of bodies, and a whole finite-element model has no such mass. This body provides one; without
     gravity it has no effect on the equilibrium. */
  RigidBody pan;
  pan.mass     = s.beam.material.density * s.beam.area() * s.beam.length;
  pan.inertia  = pan.mass * s.beam.area() * Matrix3::Identity();
  pan.position = {s.beam.length, 0, 0};
  c.scene.add("pan hangs", Fixed{c.scene.marker(c.scene.add("pan", pan)), c.tip});
  PetscCall(c.createTS(s, 1e-3 / s.frequency(), &ts));
  PetscCall(TSSetTimeStep(ts, 1e-3 / s.frequency()));
  PetscCall(c.scene.solve(ts));
  PetscCall(c.scene.sample(ts, 0, values));
  r->tip = {values[0] / s.beam.length - 1, values[1] / s.beam.length};
  PetscCall(TSGetSolution(ts, &U));
  PetscCall(VecGetSize(U, &r->unknowns));
  PetscCall(TSDestroy(&ts));
  PetscFunctionReturn(0);
}

/* Time between the first and the last time that y rises through its mean value, by the number of periods in between */
static double FrequencyOf(const std::vector<double> &t, const std::vector<double> &y, double mean)
{
  double first = -1, last = -1;
  int    count = -1;
  for (std::size_t i = 1; i < y.size(); i++)
    if (y[i - 1] < mean && y[i] >= mean) {
      last = t[i - 1] + (t[i] - t[i - 1]) * (mean - y[i - 1]) / (y[i] - y[i - 1]);
      if (count < 0) first = last;
      count++;
    }
  return count > 0 ? count / (last - first) : 0;
}

/* The load is applied suddenly, and the beam swings about its static deflection */
static PetscErrorCode Swing(const Settings &s, const FeModel &model, Kind kind, double force, Result *r)
{
  Cantilever          c;
  TS                  ts;
  TSHHT3Statistics    statistics;
  std::vector<double> t, y;
  PetscFunctionBeginUser;
  PetscCall(c.build(s, model, kind, force));
  PetscCall(c.createTS(s, ((double)s.periods + 1) / s.frequency(), &ts));
  hhtex::Watch watch(c.scene, 1 / (200 * s.frequency()), [&](double time, const std::vector<double> &v) {
    t.push_back(time);
    y.push_back(v[1] / s.beam.length);
  });
  PetscCall(watch.attach(ts));
  PetscCall(c.scene.solve(ts));
  PetscCall(TSHHT3GetStatistics(ts, &statistics));
  r->frequency = FrequencyOf(t, y, r->tip.across);
  r->step      = statistics.time / (double)PetscMax(statistics.steps, 1);
  PetscCall(TSDestroy(&ts));
  PetscFunctionReturn(0);
}

/* ---- the program ---- */

static PetscErrorCode Table(const Settings &s, const FeModel &model, double load)
{
  const Deflection exact = Elastica(load);
  PetscFunctionBeginUser;
  PetscCall(PetscPrintf(
      PETSC_COMM_WORLD,
      "load P L^2/EI = %g, P = %g N\n"
      "                 tip across/L   off by   tip along/L    frequency   off by  unknowns  time of a step\n"
      "theory          %13.6e          %13.6e  %8.4f Hz (small displacements)\n",
      load, s.force(load), exact.across, exact.along, s.frequency()));
  for (Kind kind : {Kind::Full, Kind::Modal, Kind::Beams}) {
    Result r;
    PetscCall(Static(s, model, kind, s.force(load), &r));
    PetscCall(Swing(s, model, kind, s.force(load), &r));
    PetscCall(PetscPrintf(PETSC_COMM_WORLD,
                          "%-15s %13.6e %+7.3f%% %13.6e  %8.4f Hz %+7.3f%%  %8" PetscInt_FMT "  %9.3f ms\n",
                          names[(int)kind], r.tip.across, 100 * (r.tip.across / exact.across - 1), r.tip.along,
                          r.frequency, 100 * (r.frequency / s.frequency() - 1), r.unknowns, 1e3 * r.step));
  }
  PetscFunctionReturn(0);
}

static PetscErrorCode ReadSettings(Settings *s, std::vector<double> *loads)
{
  PetscInt          elements = 20, across = 1, n = 10;
  PetscBool         given;
  PetscReal         list[10];
  hhtex::SolidBeam &b = s->beam;
  PetscFunctionBeginUser;
  b.depth = b.width = 0.02;
  b.material        = {2.1e11, 0, 7850};
  for (auto &o : {std::make_pair("-length", &b.length),
                  {"-depth", &b.depth},
                  {"-width", &b.width},
                  {"-E", &b.material.young},
                  {"-nu", &b.material.poisson},
                  {"-rho", &b.material.density}})
    PetscCall(PetscOptionsGetReal(nullptr, nullptr, o.first, o.second, nullptr));
  for (auto &o : {std::make_pair("-elements", &elements),
                  {"-across", &across},
                  {"-modes", &s->modes},
                  {"-pieces", &s->pieces},
                  {"-periods", &s->periods},
                  {"-points", &s->points}}) {
    PetscCall(PetscOptionsGetInt(nullptr, nullptr, o.first, o.second, nullptr));
    PetscCheck(*o.second > 0, PETSC_COMM_WORLD, PETSC_ERR_ARG_OUTOFRANGE, "%s %" PetscInt_FMT ": must be positive",
               o.first, *o.second);
  }
  b.n[0] = (int)elements;
  b.n[1] = b.n[2] = (int)across;
  PetscCall(PetscOptionsGetRealArray(nullptr, nullptr, "-loads", list, &n, &given));
  if (given) loads->assign(list, list + n);
  for (double load : *loads)
    PetscCheck(load > 0 && load <= 20, PETSC_COMM_WORLD, PETSC_ERR_ARG_OUTOFRANGE,
               "-loads %g: must be between 0 and 20", load);
  PetscFunctionReturn(0);
}

static PetscErrorCode Compare(void)
{
  Settings            s;
  std::vector<double> loads = {0.01, 3};
  PetscFunctionBeginUser;
  PetscCall(ReadSettings(&s, &loads));
  FeModel model(PETSC_COMM_WORLD);
  PetscCall(ReadSolidBeam(s.beam, &model));
  for (double load : loads) PetscCall(Table(s, model, load));
  PetscFunctionReturn(0);
}

int main(int argc, char **argv)
{
  PetscCall(SlepcInitialize(&argc, &argv, nullptr, help));
  PetscCall(TSHHT3Initialize());
  PetscCall(Compare());
  PetscCall(SlepcFinalize());
  return 0;
}
