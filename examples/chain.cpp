static char help[] =
    "A chain of N bodies, or a net with closed loops, falls from the horizontal; for timing the work per body.\n"
    "Runs on any number of ranks with the same result.\n"
    "  -n <10>: number of rods, 1 kg and 1 m each\n"
    "  -joint <revolute>: revolute, about z, or spherical\n"
    "  -planar: a planar scene, 3 coordinates a rod\n"
    "  -net <rows,columns>: instead, a net of point masses and rods on ball joints, hung along one side\n"
    "  -end <1>: end time, s\n";

#include "chain_model.h"
#include "problem.h"
#include "scene_watch.h"

#include <hhtdae/scene.h>

#include <cstring>

using namespace hhtdae;

static PetscErrorCode Run(void)
{
  PetscInt         n = 10, net[2] = {0, 0}, given = 2, unknowns;
  PetscReal        end       = 1;
  char             joint[16] = "revolute";
  PetscBool        planar    = PETSC_FALSE, is_net;
  TS               ts;
  Vec              U;
  TSHHT3Statistics s;
  PetscLogDouble   before, after, all;

  PetscFunctionBeginUser;
  PetscCall(PetscOptionsGetInt(nullptr, nullptr, "-n", &n, nullptr));
  PetscCall(PetscOptionsGetIntArray(nullptr, nullptr, "-net", net, &given, &is_net));
  PetscCall(PetscOptionsGetString(nullptr, nullptr, "-joint", joint, sizeof joint, nullptr));
  PetscCall(PetscOptionsGetBool(nullptr, nullptr, "-planar", &planar, nullptr));
  PetscCall(PetscOptionsGetReal(nullptr, nullptr, "-end", &end, nullptr));
  const bool spherical = !std::strcmp(joint, "spherical");
  PetscCheck(spherical || !std::strcmp(joint, "revolute"), PETSC_COMM_WORLD, PETSC_ERR_ARG_WRONG,
             "-joint %s: must be revolute or spherical", joint);
  PetscCheck(n > 0, PETSC_COMM_WORLD, PETSC_ERR_ARG_OUTOFRANGE, "-n %d: number of rods, must be positive", (int)n);
  PetscCheck(!is_net || (given == 2 && net[0] > 0 && net[1] > 0), PETSC_COMM_WORLD, PETSC_ERR_ARG_OUTOFRANGE,
             "-net: give rows,columns, both positive");
  PetscCheck(!planar || (!is_net && !spherical), PETSC_COMM_WORLD, PETSC_ERR_ARG_INCOMP,
             "-planar is for a chain of revolute joints");
  PetscCall(PetscMemoryGetCurrentUsage(&before));

  Scene scene(PETSC_COMM_WORLD, planar ? Space::Planar : Space::Spatial);
  scene.gravity({0, -9.81, 0});
  const Marker   tip    = is_net ? hhtex::AddNet(scene, net[0], net[1]) : hhtex::AddChain(scene, n, spherical);
  const PetscInt bodies = is_net ? net[0] * (3 * net[1] - 1) : n;
  for (int k = 0; k < (planar ? 2 : 3); k++)
    scene.channel(std::string("tip.") + "xyz"[k], Measure::displacement(tip, k), "m");
  scene.channel("kinetic", Measure::kineticEnergy(), "J");
  scene.channel("potential", Measure::potentialEnergy(), "J");

  PetscCall(scene.createTS(&ts));
  PetscCall(TSSetMaxTime(ts, end));
  PetscCall(TSSetTolerances(ts, 1e-4, nullptr, 1e-4, nullptr));
  PetscCall(TSSetFromOptions(ts));
  std::vector<double> x;
  double              start = NAN, drift = 0, exchanged = 0;
  hhtex::Watch        watch(scene, end / 10, [&](double, const std::vector<double> &c) {
    const double T = c[c.size() - 2], V = c.back();
    if (std::isnan(start)) start = T + V;
    hhtex::Widen(drift, T + V, start);
    exchanged = std::fmax(exchanged, T);
  });
  PetscCall(watch.attach(ts));
  PetscCall(scene.solve(ts));

  PetscReal t;
  PetscCall(TSGetTime(ts, &t));
  PetscCall(scene.sample(ts, t, x));
  PetscCall(TSHHT3GetStatistics(ts, &s));
  PetscCall(PetscMemoryGetCurrentUsage(&after));
  after -= before;
  PetscCallMPI(MPI_Allreduce(&after, &all, 1, MPI_DOUBLE, MPI_SUM, PETSC_COMM_WORLD));
  PetscCall(TSGetSolution(ts, &U));
  PetscCall(VecGetSize(U, &unknowns));
  PetscCall(PetscPrintf(PETSC_COMM_WORLD,
                        "chain: bodies=%d unknowns=%d step=%.4g us body_step=%.4g us memory=%.0f bytes/body\n",
                        (int)bodies, (int)unknowns, 1e6 * (double)s.cpu / s.steps,
                        1e6 * (double)s.cpu / s.steps / bodies, (double)all / bodies));
  PetscCall(
      PetscPrintf(PETSC_COMM_WORLD, "tip: t=%g x=%.12g y=%.12g z=%.12g\n", (double)t, x[0], x[1], planar ? 0 : x[2]));
  PetscCall(PetscPrintf(PETSC_COMM_WORLD, "error: energy=%.3e kinetic=%.3e\n", drift, exchanged));
  PetscCall(TSDestroy(&ts));
  PetscFunctionReturn(0);
}

int main(int argc, char **argv)
{
  PetscFunctionBeginUser;
  PetscCall(PetscInitialize(&argc, &argv, nullptr, help));
  PetscCall(TSHHT3Initialize());
  PetscCall(hhtex::SummaryByDefault());
  PetscCall(Run());
  PetscCall(PetscFinalize());
  return 0;
}
