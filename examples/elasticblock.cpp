static char help[] = "A linear elastic block of 8-node bricks, clamped or hinged by Lagrange multipliers, under a load "
                     "that comes suddenly.\n"
                     "Runs on any number of processes. error: modal, the motion in the first mode against its exact "
                     "solution; static, the\n"
                     "deflection of the clamped block under the load against beam theory with shear (the bricks are "
                     "stiffer on a coarse grid).\n"
                     "  -nx -ny -nz <40, 4, 4>           bricks along the edges\n"
                     "  -size <1,0.1,0.1>                edges, m\n"
                     "  -E <2.1e11> -nu <0.3> -rho <7850> steel\n"
                     "  -damping_mass -damping_stiffness <0, 0>  Rayleigh damping\n"
                     "  -support <clamped>               clamped: the face x = 0; hinged: its lower edge\n"
                     "  -load <tip>                      tip: -force N on the face x = size; gravity: -gravity m/s^2\n"
                     "  -lumped                          lumped masses\n"
                     "  -periods <2>                     end time in periods of the first elastic mode\n";

#include "elasticblock_modes.h"
#include "problem.h"

using namespace elasticblock;

/* Tolerances relative to the deflection in the first elastic mode */
static PetscErrorCode set_time(TS ts, const Mode &mode, PetscReal periods)
{
  const PetscReal period = 2 * PETSC_PI / mode.omega;
  PetscReal       largest;

  PetscFunctionBeginUser;
  PetscCall(VecNorm(mode.phi, NORM_INFINITY, &largest));
  PetscCall(
      TSSetTolerances(ts, 1e-4 * largest * PetscAbsReal(mode.load) / (mode.omega * mode.omega), NULL, 1e-4, NULL));
  PetscCall(TSSetMaxTime(ts, periods * period));
  PetscCall(TSSetTimeStep(ts, 1e-3 * period));
  PetscCall(TSSetExactFinalTime(ts, TS_EXACTFINALTIME_MATCHSTEP));
  PetscFunctionReturn(0);
}

static PetscErrorCode report(const Model &m, const Modes &modes)
{
  const Options &o     = m.options;
  double         modal = 0;

  PetscFunctionBeginUser;
  for (const Mode &mode : modes.mode) modal = std::fmax(modal, mode.error / mode.largest);
  PetscCall(PetscPrintf(PETSC_COMM_WORLD, "error: modal=%.3e", modal));
  if (o.support == CLAMPED)
    PetscCall(PetscPrintf(PETSC_COMM_WORLD, " static=%.3e", std::fabs(modes.static_work / beam_static_work(o) - 1)));
  PetscCall(PetscPrintf(PETSC_COMM_WORLD, "\n"));
  PetscFunctionReturn(0);
}

int main(int argc, char **argv)
{
  Options   options;
  Model     model;
  Modes     modes;
  TS        ts;
  Vec       U, V;
  PetscReal periods = 2;
  PetscInt  n, constraints;

  PetscFunctionBeginUser;
  PetscCall(PetscInitialize(&argc, &argv, NULL, help));
  PetscCall(TSHHT3Initialize());
  PetscCall(hhtex::SummaryByDefault());
  PetscCall(PetscOptionsGetReal(NULL, NULL, "-periods", &periods, NULL));
  PetscCall(options_read(&options));
  PetscCall(model_create(options, &model));
  PetscCall(modes_find(model, &modes));
  PetscCall(VecGetSize(model.f, &n));
  PetscCall(ISGetSize(model.constraints, &constraints));
  PetscCall(PetscPrintf(
      PETSC_COMM_WORLD, "%d unknowns, %d of them multipliers; first elastic mode at %.6g Hz, slender beam %.6g Hz\n",
      (int)n, (int)constraints, modes.mode.back().omega / (2 * PETSC_PI), beam_frequency(options) / (2 * PETSC_PI)));

  PetscCall(TSCreate(PETSC_COMM_WORLD, &ts));
  PetscCall(TSSetType(ts, TSHHT3));
  PetscCall(TSSetI2Function(ts, NULL, residual, &model));
  PetscCall(TSSetI2Jacobian(ts, model.J, model.J, jacobian, &model));
  PetscCall(TSHHT3SetIS(ts, TSHHT3_HOLONOMIC, model.constraints));
  PetscCall(VecDuplicate(model.f, &U));
  PetscCall(VecDuplicate(model.f, &V));
  PetscCall(TS2SetSolution(ts, U, V));
  PetscCall(set_time(ts, modes.mode.back(), periods));
  PetscCall(TSMonitorSet(ts, modes_monitor, &modes, NULL));
  PetscCall(TSSetFromOptions(ts));
  PetscCall(TSSolve(ts, U));
  PetscCall(report(model, modes));

  PetscCall(VecDestroy(&U));
  PetscCall(VecDestroy(&V));
  PetscCall(TSDestroy(&ts));
  PetscCall(modes_destroy(&modes));
  PetscCall(model_destroy(&model));
  PetscCall(PetscFinalize());
  return 0;
}
