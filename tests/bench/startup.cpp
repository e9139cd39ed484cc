/*
  Parts of the time that a program with a small scene takes: one rod on a pin, a quarter of a swing. Milliseconds of processor
  time and of wall-clock time; the first line is the dynamic linker before main() (processor time only). The second scene shows
  how much of the first one is due to the first use of PETSc's packages and of the pages of libraries.

    build/bin/startup
    OMPI_MCA_ess_singleton_isolated=1 build/bin/startup      a single process without Open MPI's daemon

  Debian 12 with its PETSc 3.18 and Open MPI 4.1, smallest of several times on two cores shared with five other processes, ms:

                                              cpu   by the clock
      dynamic linking                          66                  109 libraries, 107 of them PETSc's; an eighth with a PETSc that needs 27
      MPI_Init(), MPI_Finalize()               47   457, 57        isolated: 45, 280, 8
      PetscInitialize(), PetscFinalize()        1     1
      first scene                             5.2   5.2            2 of them first use of TS, SNES, KSP and Mat
      second scene                            1.4   1.4            0.8 of them the solve, 43 steps
*/
#include <cmath>
#include <cstdio>
#include <ctime>
#include <hhtdae/scene.h>

using namespace hhtdae;

static double Milliseconds(clockid_t clock)
{
  timespec t;
  clock_gettime(clock, &t);
  return 1e3 * (double)t.tv_sec + 1e-6 * (double)t.tv_nsec;
}

/* Prints the time since the last call under the name of what has been done meanwhile */
static void Lap(const char *done)
{
  static double cpu = 0, clock = 0;
  const double  c = Milliseconds(CLOCK_PROCESS_CPUTIME_ID), w = Milliseconds(CLOCK_MONOTONIC);
  if (clock > 0) std::printf("%-36s %8.2f %8.2f\n", done, c - cpu, w - clock);
  else std::printf("%-36s %8s %8s\n%-36s %8.2f\n", "ms", "cpu", "clock", done, c);
  cpu   = c;
  clock = w;
}

static PetscErrorCode Run()
{
  const double g = 9.81, length = 2, period = 4 * 1.8540746773013719 / std::sqrt(1.5 * g / length); /* 4 K(1/sqrt 2) / w */
  TS           ts;
  PetscFunctionBegin;
  Scene     scene(PETSC_COMM_WORLD);
  RigidBody rod;
  rod.mass     = 3;
  rod.inertia  = Vector3(1e-3, 1, 1).asDiagonal();
  rod.position = Vector3(length / 2, 0, 0);
  const Body body = scene.add("rod", rod);
  scene.add("pin", Revolute{scene.marker(body, {-length / 2, 0, 0}), scene.marker(scene.ground())});
  scene.gravity({0, -g, 0});
  Lap("description");
  PetscCall(scene.setUp());
  Lap("Scene::setUp()");
  PetscCall(scene.createTS(&ts));
  Lap("Scene::createTS()");
  PetscCall(TSSetMaxTime(ts, period / 4));
  PetscCall(TSSetMaxSteps(ts, 100000));
  PetscCall(TSSetTolerances(ts, 1e-5, nullptr, 1e-5, nullptr));
  PetscCall(TSSetFromOptions(ts));
  Lap("TSSetFromOptions()");
  PetscCall(scene.solve(ts));
  Lap("Scene::solve()");
  PetscCall(TSDestroy(&ts));
  Lap("TSDestroy()");
  PetscFunctionReturn(0);
}

int main(int argc, char **argv)
{
  int provided;
  Lap("dynamic linking");
  MPI_Init_thread(&argc, &argv, MPI_THREAD_FUNNELED, &provided);
  Lap("MPI_Init()");
  PetscCall(PetscInitialize(&argc, &argv, nullptr, nullptr));
  Lap("PetscInitialize()");
  PetscCall(Run());
  std::printf("second scene\n");
  PetscCall(Run());
  PetscCall(PetscFinalize());
  Lap("PetscFinalize()");
  MPI_Finalize();
  Lap("MPI_Finalize()");
  return 0;
}
