static char help[] =
    "A beam on a hub that is spun up to 6 rad/s in 15 s (Simo and Vu-Quoc 1986): it lags behind, then the centrifugal\n"
    "force stiffens it, and in steady rotation it is straight again and 0.514 mm longer. Deflection of the tip as the "
    "hub\n"
    "sees it, against a linear beam with centrifugal stiffening in 8 modes, and a picture.\n"
    "  -body <all>: full (all finite elements, displacements at large), modal (one body in modal coordinates), stiffened (the same with geometric\n"
    "      stiffening), parts (a chain of modal bodies), beam (two-node beams between rigid pieces), all\n"
    "  One modal body goes wrong here, as it must: its displacement is linear in its modes, so that it is not shortened by bending and the\n"
    "  centrifugal force stiffens it only as far as its frame turns with the bending. It follows the others as long as the hub is slow, then bends\n"
    "  too far. More modes do not help; more bodies do, and geometric stiffening does at the cost of one.\n"
    "  -end <20>: s\n"
    "  -elements <20>: along the beam, for full and modal;  -tetrahedra: in place of bricks of 20 nodes\n"
    "  -pieces <40>: of the body of beams\n"
    "  -modes <10>: normal modes of a modal body;  -parts <4>: modal bodies in the chain\n"
    "  -plot <file.png>: deflection over time, by gnuplot\n";

#include "problem.h"
#include "scene_watch.h"
#include "spinbeam_model.h"

#include <hhtdae/flexible.h>

#include <cstdlib>
#include <slepcsys.h>

using namespace hhtdae;

/* Transverse deflection of a linear beam with centrifugal stiffening, 8 modes, 5 digits */
struct Point {
  double t, y;
};
static const Point reference[] = {{2, -.10238},    {4, -.34239}, {5, -.46878}, {6, -.54406},
                                  {6.75, -.57436}, {7, -.57184}, {8, -.54320}, {10, -.36284},
                                  {12, -.15084},   {15, .00130}, {18, -.00208}};

/* Steady extension of a rotating bar */
static double ExactExtension(const hhtex::SolidBeam &b)
{
  const double aL = hhtex::spin_speed * b.length * std::sqrt(b.material.density / b.material.young);
  return b.length * (std::tan(aL) / aL - 1);
}

/* ---- one run ---- */

struct Sample {
  double t, along, across; /* displacement of the tip in the hub's axes */
};

struct Curve {
  std::string         name;
  std::vector<Sample> samples;
  double              seconds = 0;
  PetscReal           end     = 0;
  PetscInt            steps = 0, unknowns = 0;

  const Sample *at(double t) const
  {
    for (const Sample &s : samples)
      if (std::fabs(s.t - t) < 1e-9) return &s;
    return nullptr;
  }
};

struct Settings {
  hhtex::SolidBeam arm    = hhtex::SpinningArm();
  PetscInt         pieces = 40, modes = 10, parts = 4;
  PetscReal        end = 20;
};

static PetscErrorCode AddBody(const std::string &kind, const Settings &s, const FeModel &model, Scene &scene,
                              FullFeBody *fe, hhtex::BeamEnds *ends)
{
  PetscFunctionBeginUser;
  if (kind == "full")
    PetscCall(AddFullBeam(scene, model, FeLaw::Large, fe, ends));
  else if (kind == "modal")
    PetscCall(AddModalBeam(scene, model, s.arm.length, 1, s.modes, ends));
  else if (kind == "stiffened")
    PetscCall(AddModalBeam(scene, model, s.arm.length, 1, s.modes, ends, Tie::Average, true));
  else if (kind == "parts") {
    hhtex::SolidBeam part = s.arm;
    part.length /= (double)s.parts;
    part.n[0] = (int)PetscMax(2, s.arm.n[0] / s.parts);
    FeModel one(PETSC_COMM_WORLD);
    PetscCall(ReadSolidBeam(part, &one));
    PetscCall(AddModalBeam(scene, one, part.length, (int)s.parts, s.modes, ends));
  } else
    hhtex::AddBeamElements(scene, s.arm, (int)s.pieces, ends);
  PetscFunctionReturn(0);
}

static PetscErrorCode Run(const std::string &kind, const Settings &s, const FeModel &model, Curve *curve)
{
  Scene            scene(PETSC_COMM_WORLD);
  FullFeBody       fe;
  hhtex::BeamEnds  ends;
  TS               ts;
  Vec              U;
  TSHHT3Statistics statistics;
  PetscFunctionBeginUser;
  curve->name = kind;
  PetscCall(AddBody(kind, s, model, scene, &fe, &ends));
  hhtex::SpinUp(scene, ends);

  PetscCall(scene.createTS(&ts));
  PetscCall(TSSetMaxTime(ts, s.end));
  PetscCall(TSSetMaxSteps(ts, 10000000));
  PetscCall(TSSetTolerances(ts, 1e-5, nullptr, 1e-5, nullptr));
  PetscCall(TSSetFromOptions(ts));
  hhtex::Watch watch(scene, 0.05, [&](double t, const std::vector<double> &c) {
    curve->samples.push_back({t, c[0] - s.arm.length, c[1]});
    if (std::hypot(c[0] - s.arm.length, c[1]) > s.arm.length / 2)
      PetscCallAbort(PETSC_COMM_WORLD, TSSetConvergedReason(ts, TS_CONVERGED_USER));
  });
  PetscCall(watch.attach(ts));
  PetscCall(PetscPrintf(PETSC_COMM_WORLD, "%s: ", kind.c_str()));
  PetscCall(scene.solve(ts));
  PetscCall(TSHHT3GetStatistics(ts, &statistics));
  PetscCall(TSGetSolution(ts, &U));
  PetscCall(VecGetSize(U, &curve->unknowns));
  PetscCall(TSGetTime(ts, &curve->end));
  curve->seconds = statistics.time;
  curve->steps   = statistics.steps;
  PetscCall(TSDestroy(&ts));
  PetscFunctionReturn(0);
}

/* ---- results ---- */

static PetscErrorCode Table(const Settings &s, const std::vector<Curve> &curves)
{
  PetscFunctionBeginUser;
  PetscCall(PetscPrintf(PETSC_COMM_WORLD, "\ndeflection of the tip across, m\n    t   linear"));
  for (const Curve &c : curves) PetscCall(PetscPrintf(PETSC_COMM_WORLD, " %10s", c.name.c_str()));
  PetscCall(PetscPrintf(PETSC_COMM_WORLD, "\n"));
  for (const Point &p : reference) {
    if (p.t > s.end) break;
    PetscCall(PetscPrintf(PETSC_COMM_WORLD, "%5.2f %8.5f", p.t, p.y));
    for (const Curve &c : curves) {
      const Sample *at = c.at(p.t);
      if (at)
        PetscCall(PetscPrintf(PETSC_COMM_WORLD, " %10.5f", at->across));
      else
        PetscCall(PetscPrintf(PETSC_COMM_WORLD, "    stopped"));
    }
    PetscCall(PetscPrintf(PETSC_COMM_WORLD, "\n"));
  }
  for (const Curve &c : curves)
    PetscCall(PetscPrintf(PETSC_COMM_WORLD, "%s: %d unknowns, %d steps, %.3g s, %.3g ms per step, ended at t = %g\n",
                          c.name.c_str(), (int)c.unknowns, (int)c.steps, c.seconds,
                          1e3 * c.seconds / PetscMax(c.steps, 1), c.end));
  PetscFunctionReturn(0);
}

/* Mean of the last samples in steady rotation: the value about which the remaining vibration oscillates */
static PetscErrorCode Extension(const Settings &s, const std::vector<Curve> &curves)
{
  const double exact = ExactExtension(s.arm);
  PetscFunctionBeginUser;
  for (const Curve &c : curves) {
    double sum = 0;
    int    n   = 0;
    for (const Sample &p : c.samples)
      if (p.t > PetscMax(hhtex::spin_ramp + 1, s.end - 3)) sum += p.along, n++;
    if (n > 0)
      PetscCall(PetscPrintf(PETSC_COMM_WORLD, "%s: steady extension %.4e m, exact bar %.4e: %+.3f %%\n", c.name.c_str(),
                            sum / n, exact, 100 * (sum / n / exact - 1)));
  }
  PetscFunctionReturn(0);
}

static PetscErrorCode Plot(const std::vector<Curve> &curves, const std::string &file)
{
  PetscMPIInt rank;
  PetscFunctionBeginUser;
  PetscCallMPI(MPI_Comm_rank(PETSC_COMM_WORLD, &rank));
  if (rank) PetscFunctionReturn(0);
  if (std::system("command -v gnuplot >/dev/null 2>&1")) {
    std::printf("no picture: gnuplot is not installed (Debian: gnuplot-nox)\n");
    PetscFunctionReturn(0);
  }
  FILE *g = popen("gnuplot", "w");
  PetscCheck(g, PETSC_COMM_SELF, PETSC_ERR_SYS, "gnuplot could not be started");
  std::fprintf(g,
               "set terminal png size 900,600\nset output '%s'\nset xlabel 't [s]'\nset ylabel 'deflection of the tip, "
               "hub axes [m]'\n"
               "set yrange [-0.8:0.1]\nset grid\nset key bottom right\nplot '-' w p pt 7 lc 'black' title 'linear with "
               "stiffening'",
               file.c_str());
  const char *colours[] = {"#c00000", "#0050c0", "#008040", "#a060c0", "#e08000"};
  for (std::size_t k = 0; k < curves.size(); k++)
    std::fprintf(g, ", '-' w l lw 2 dt %d lc '%s' title '%s'", (int)k + 1, colours[k % 5], curves[k].name.c_str());
  std::fprintf(g, "\n");
  for (const Point &p : reference) std::fprintf(g, "%g %g\n", p.t, p.y);
  std::fprintf(g, "e\n");
  for (const Curve &c : curves) {
    for (const Sample &p : c.samples) std::fprintf(g, "%g %g\n", p.t, p.across);
    std::fprintf(g, "e\n");
  }
  PetscCheck(pclose(g) == 0, PETSC_COMM_SELF, PETSC_ERR_LIB, "gnuplot failed to make %s", file.c_str());
  std::printf("picture: %s\n", file.c_str());
  PetscFunctionReturn(0);
}

static PetscErrorCode Spin(void)
{
  Settings           s;
  std::vector<Curve> curves;
  PetscInt           elements   = s.arm.n[0];
  PetscBool          tetrahedra = PETSC_FALSE, plot;
  char               body[16] = "all", file[PETSC_MAX_PATH_LEN] = "";
  PetscFunctionBeginUser;
  PetscCall(PetscOptionsGetString(nullptr, nullptr, "-body", body, sizeof body, nullptr));
  PetscCall(PetscOptionsGetReal(nullptr, nullptr, "-end", &s.end, nullptr));
  PetscCall(PetscOptionsGetInt(nullptr, nullptr, "-elements", &elements, nullptr));
  PetscCall(PetscOptionsGetInt(nullptr, nullptr, "-pieces", &s.pieces, nullptr));
  PetscCall(PetscOptionsGetInt(nullptr, nullptr, "-modes", &s.modes, nullptr));
  PetscCall(PetscOptionsGetInt(nullptr, nullptr, "-parts", &s.parts, nullptr));
  PetscCall(PetscOptionsGetBool(nullptr, nullptr, "-tetrahedra", &tetrahedra, nullptr));
  PetscCall(PetscOptionsGetString(nullptr, nullptr, "-plot", file, sizeof file, &plot));
  PetscCheck(elements > 0 && s.pieces > 0 && s.modes > 0 && s.parts > 0 && s.end > 0, PETSC_COMM_WORLD,
             PETSC_ERR_ARG_OUTOFRANGE, "-elements, -pieces, -modes, -parts and -end must be positive");
  s.arm.n[0] = (int)elements;
  if (tetrahedra) s.arm.element = hhtex::BeamElement::Tetrahedron10;
  const std::string which = body;
  PetscCheck(which == "all" || which == "full" || which == "modal" || which == "stiffened" || which == "parts" || which == "beam",
             PETSC_COMM_WORLD, PETSC_ERR_ARG_WRONG, "-body %s: must be full, modal, stiffened, parts, beam or all", body);

  FeModel model(PETSC_COMM_WORLD);
  if (which != "beam") PetscCall(ReadSolidBeam(s.arm, &model));
  for (const char *kind : {"full", "modal", "stiffened", "parts", "beam"})
    if (which == "all" || which == kind) {
      curves.emplace_back();
      PetscCall(Run(kind, s, model, &curves.back()));
    }
  PetscCall(Table(s, curves));
  PetscCall(Extension(s, curves));
  if (plot) PetscCall(Plot(curves, file));
  PetscFunctionReturn(0);
}

int main(int argc, char **argv)
{
  PetscCall(SlepcInitialize(&argc, &argv, nullptr, help));
  PetscCall(TSHHT3Initialize());
  PetscCall(hhtex::SummaryByDefault());
  PetscCall(Spin());
  PetscCall(SlepcFinalize());
  return 0;
}
