/*
  Cost of a step of a whole finite-element model in a scene: seconds, factorizations, memory.

    mpiexec -n 2 fullbody -size 60,12,12 -law large -steps 20

  -size: bricks along x, y, z; -brick8: bricks of 8 nodes instead of 20;
  -held clamp,hinge,free,rod: the body is clamped or hinged at its root; or it spins freely, without multipliers; or it is
  the connecting rod of a slider-crank, tied to pins at both ends, whose crank turns once in -turn <4> bending periods;
  -steps: measured steps; they follow the first one, which includes the choice of the solver and is not in the table, and
  are a separate stage in -log_view;
  -part <0.01>: length of a step, as a part of the first bending period (-ts_adapt_type basic for error control);
  -blocks: gives the solver the block size of 3 and the rigid-body modes (with `free` only). All -ksp_, -pc_, -mat_ and
  -ts_hhtdae_ options can be used.
*/
#include "beam_bodies.h"
#include "process_use.h"

#include <hhtdae/hhtdae.h>
#include <petsctime.h>
#include <slepcsys.h>

using namespace hhtdae;
using hhtbench::PeakMegabytes;
using hhtbench::ProcessorSeconds;

enum { CLAMP, HINGE, FREE, ROD };

struct Case {
  hhtex::SolidBeam block;
  FeLaw            law    = FeLaw::Large;
  int              held   = CLAMP;
  PetscInt         steps  = 20;
  PetscReal        part   = 0.01, turn = 4;
  PetscBool        blocks = PETSC_FALSE;
};

/* Material: rubber; bricks of 2 cm */
static PetscErrorCode ReadCase(Case *c)
{
  const char *const laws[]  = {"large", "small", "Law", "", nullptr};
  const char *const helds[] = {"clamp", "hinge", "free", "rod", "Held", "", nullptr};
  PetscInt          n[3] = {40, 8, 8}, three = 3;
  PetscEnum         law = (PetscEnum)0, held = (PetscEnum)CLAMP;
  PetscBool         brick8 = PETSC_FALSE, sized;
  PetscFunctionBeginUser;
  PetscCall(PetscOptionsGetIntArray(nullptr, nullptr, "-size", n, &three, &sized));
  PetscCheck((!sized || three == 3) && n[0] > 0 && n[1] > 0 && n[2] > 0, PETSC_COMM_WORLD, PETSC_ERR_ARG_OUTOFRANGE,
             "-size needs three positive numbers");
  PetscCall(PetscOptionsGetEnum(nullptr, nullptr, "-law", laws, &law, nullptr));
  PetscCall(PetscOptionsGetEnum(nullptr, nullptr, "-held", helds, &held, nullptr));
  PetscCall(PetscOptionsGetInt(nullptr, nullptr, "-steps", &c->steps, nullptr));
  PetscCall(PetscOptionsGetReal(nullptr, nullptr, "-part", &c->part, nullptr));
  PetscCall(PetscOptionsGetReal(nullptr, nullptr, "-turn", &c->turn, nullptr));
  PetscCall(PetscOptionsGetBool(nullptr, nullptr, "-brick8", &brick8, nullptr));
  PetscCall(PetscOptionsGetBool(nullptr, nullptr, "-blocks", &c->blocks, nullptr));
  PetscCheck(c->steps > 0 && c->part > 0 && c->turn > 0, PETSC_COMM_WORLD, PETSC_ERR_ARG_OUTOFRANGE,
             "-steps, -part and -turn must be positive");
  c->held             = held;
  c->law              = law ? FeLaw::Small : FeLaw::Large;
  hhtex::SolidBeam &b = c->block;
  for (int k = 0; k < 3; k++) b.n[k] = (int)n[k];
  b.length   = 0.02 * b.n[0];
  b.depth    = 0.02 * b.n[1];
  b.width    = 0.02 * b.n[2];
  b.element  = brick8 ? hhtex::BeamElement::Brick8 : hhtex::BeamElement::Brick20;
  b.material = {5e6, 0.4, 1100};
  PetscFunctionReturn(0);
}

/* First bending period of the cantilever, of the free beam, or of the rod between pins */
static double Period(const Case &c)
{
  const hhtex::SolidBeam &b    = c.block;
  const double            root = c.held == FREE ? 4.730 : c.held == ROD ? PETSC_PI : 1.8751, I = std::fmin(b.Iyy(), b.Izz());
  return 2 * PETSC_PI * b.length * b.length / (root * root) *
         std::sqrt(b.material.density * b.area() / (b.material.young * I));
}

static const Matrix3 &AlongY() /* axes of markers of hinges */
{
  static const Matrix3 axes = Eigen::AngleAxisd(-PETSC_PI / 2, Vector3::UnitX()).toRotationMatrix();
  return axes;
}

static double CrankSpeed(const Case &c) { return 2 * PETSC_PI / (c.turn * Period(c)); }

/* The crank, a quarter of the rod's length, points up from the origin and rotates about y at constant speed; it moves
   the slider, which has the rod's mass, along x. With the crank pointing up the rod translates */
static PetscErrorCode BuildSliderCrank(const Case &c, const FeModel &model, Scene &scene, FullFeBody *fe)
{
  const double            length = c.block.length, r = length / 4, mass = c.block.material.density * length * c.block.area(), speed = CrankSpeed(c);
  const Vector3           pin(0, 0, r), end(std::sqrt(length * length - r * r), 0, 0), velocity(speed * r, 0, 0);
  const Matrix3           along_x = Eigen::AngleAxisd(PETSC_PI / 2, Vector3::UnitY()).toRotationMatrix();
  FullBody                body;
  RigidBody               crank, slider;
  PetscFunctionBeginUser;
  body.law         = c.law;
  body.attachments = hhtex::BeamAttachments(Tie::Rigid);
  body.position    = pin;
  body.rotation    = Eigen::AngleAxisd(std::asin(r / length), Vector3::UnitY()).toRotationMatrix();
  body.velocity    = velocity;
  PetscCall(fe->add(scene, "rod", model, body));
  crank.mass             = mass / 2;
  crank.inertia          = (crank.mass * r * r / 12) * Matrix3::Identity();
  crank.position         = pin / 2;
  crank.velocity         = velocity / 2;
  crank.angular_velocity = {0, speed, 0};
  slider.mass            = mass;
  slider.inertia         = (mass * r * r / 12) * Matrix3::Identity();
  slider.position        = end;
  slider.velocity        = velocity;
  const Body   cranked = scene.add("crank", crank), sliding = scene.add("slider", slider), ground = scene.ground();
  const Body   big = fe->attachment("root"), small = fe->attachment("tip");
  const Marker shaft = scene.markerAt(cranked, Vector3::Zero(), AlongY()), bearing = scene.markerAt(ground, Vector3::Zero(), AlongY());
  scene.add("shaft", Revolute{shaft, bearing});
  scene.add("drive", RotationalMotion{shaft, bearing, TimeFunction::polynomial({0, speed})});
  scene.add("big end", Revolute{scene.markerAt(big, pin, AlongY()), scene.markerAt(cranked, pin, AlongY())});
  scene.add("small end", Revolute{scene.markerAt(small, end, AlongY()), scene.markerAt(sliding, end, AlongY())});
  scene.add("guide", Translational{scene.markerAt(sliding, end, along_x), scene.markerAt(ground, end, along_x)});
  PetscFunctionReturn(0);
}

static PetscErrorCode Build(const Case &c, const FeModel &model, Scene &scene, FullFeBody *fe)
{
  FullBody body;
  PetscFunctionBeginUser;
  body.law = c.law;
  if (c.held == FREE) {
    body.angular_velocity = {0, c.law == FeLaw::Large ? 0.3 / Period(c) : 0, 0};
    body.mass_damping     = c.law == FeLaw::Small ? 0.1 / Period(c) : 0;
  } else {
    body.attachments = {hhtex::BeamAttachments()[0]};
  }
  PetscCall(fe->add(scene, "block", model, body));
  if (c.held == FREE) PetscFunctionReturn(0);
  const Body root = fe->attachment("root"), ground = scene.ground();
  if (c.held == CLAMP)
    scene.add("clamp", Fixed{scene.marker(root), scene.marker(ground)});
  else
    scene.add("hinge", Revolute{scene.marker(root, Vector3::Zero(), AlongY()), scene.marker(ground, Vector3::Zero(), AlongY())});
  PetscFunctionReturn(0);
}

/* Gives algebraic multigrid the block size and the rigid-body modes */
static PetscErrorCode TellBlocks(TS ts, Mat K)
{
  Mat          J, P;
  MatNullSpace rigid;
  PetscFunctionBeginUser;
  PetscCall(TSGetI2Jacobian(ts, &J, &P, nullptr, nullptr));
  PetscCall(MatGetNearNullSpace(K, &rigid));
  PetscCall(MatSetNearNullSpace(P, rigid));
  PetscCall(MatSetBlockSize(P, 3));
  PetscFunctionReturn(0);
}

/* ---- results ---- */

struct Clock {
  PetscLogDouble   run = 0, start = 0; /* of the whole run, of the second step */
  double           processor[2] = {};  /* the same in processor time */
  TSHHT3Statistics first = {};
  PetscLogStage    stage = -1; /* log stage of the steps after the first */

  /* called at the end of the first step */
  static PetscErrorCode monitor(TS ts, PetscInt step, PetscReal, Vec, void *ctx)
  {
    Clock *c = static_cast<Clock *>(ctx);
    PetscFunctionBegin;
    if (step != 1) PetscFunctionReturn(0);
    PetscCall(PetscTime(&c->start));
    c->processor[1] = ProcessorSeconds();
    PetscCall(TSHHT3GetStatistics(ts, &c->first));
    PetscCall(PetscLogStagePush(c->stage));
    PetscFunctionReturn(0);
  }
};

/* Peaks of resident memory in MB: the largest of a rank, and the sum */
static PetscErrorCode Memory(double *most, double *all)
{
  PetscFunctionBeginUser;
  *most = *all = PeakMegabytes();
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, most, 1, MPI_DOUBLE, MPI_MAX, PETSC_COMM_WORLD));
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, all, 1, MPI_DOUBLE, MPI_SUM, PETSC_COMM_WORLD));
  PetscFunctionReturn(0);
}

static PetscErrorCode Solver(TS ts, std::string *name)
{
  SNES          snes;
  KSP           ksp;
  PC            pc;
  KSPType       ksp_type;
  PCType        pc_type;
  MatSolverType package = nullptr;
  PetscBool     factors;
  PetscFunctionBeginUser;
  PetscCall(TSGetSNES(ts, &snes));
  PetscCall(SNESGetKSP(snes, &ksp));
  PetscCall(KSPGetPC(ksp, &pc));
  PetscCall(KSPGetType(ksp, &ksp_type));
  PetscCall(PCGetType(pc, &pc_type));
  PetscCall(PetscObjectTypeCompareAny((PetscObject)pc, &factors, PCLU, PCCHOLESKY, ""));
  if (factors) PetscCall(PCFactorGetMatSolverType(pc, &package));
  *name = std::string(ksp_type) + " + " + pc_type + (package ? std::string(" by ") + package : "");
  PetscFunctionReturn(0);
}

static PetscErrorCode Report(TS ts, const Case &c, const Clock &clock, double building)
{
  PetscLogDouble   now;
  PetscReal        end;
  TSHHT3Statistics s;
  PetscInt         unknowns, iterations;
  PetscMPIInt      ranks;
  Vec              U;
  Mat              P;
  MatInfo          info;
  std::string      solver;
  double           most, all;
  PetscFunctionBeginUser;
  PetscCall(PetscTime(&now));
  PetscCallMPI(MPI_Comm_size(PETSC_COMM_WORLD, &ranks));
  PetscCall(TSHHT3GetStatistics(ts, &s));
  PetscCall(TSGetSolution(ts, &U));
  PetscCall(VecGetSize(U, &unknowns));
  PetscCall(TSGetI2Jacobian(ts, nullptr, &P, nullptr, nullptr));
  PetscCall(MatGetInfo(P, MAT_GLOBAL_SUM, &info));
  PetscCall(TSGetKSPIterations(ts, &iterations));
  PetscCall(Solver(ts, &solver));
  PetscCall(Memory(&most, &all));
  const double n          = (double)PetscMax(s.steps - clock.first.steps, 1);
  double       processor[2] = {clock.processor[1] - clock.processor[0], (ProcessorSeconds() - clock.processor[1]) / n}; /* first, later step */
  char         turned[64] = "";
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, processor, 2, MPI_DOUBLE, MPI_MAX, PETSC_COMM_WORLD));
  PetscCall(TSGetTime(ts, &end));
  if (c.held == ROD) PetscCall(PetscSNPrintf(turned, sizeof turned, "; the crank has turned by %.3g degrees", CrankSpeed(c) * end * 180 / PETSC_PI));
  PetscCall(PetscPrintf(
      PETSC_COMM_WORLD,
      "%d rank(s), %" PetscInt_FMT " unknowns, %.3g entries of the matrix, %s; law %s\n"
      "  reading, assembly and set-up %.2f s, first step %.2f s, of a processor %.2f s at most\n"
      "  %.3f s per step (%g steps), of a processor %.3f s at most; per 100 steps: %.0f corrector iterations, %.0f matrices, %.0f factorizations\n"
      "  iterations of the linear solver per solve %.1f; rejected %" PetscInt_FMT ", corrector failures %" PetscInt_FMT
      "\n  memory at most %.0f MB on a rank, %.0f MB on all%s\n",
      ranks, unknowns, info.nz_used, solver.c_str(), c.law == FeLaw::Small ? "small" : "large", building,
      clock.start - clock.run, processor[0], (now - clock.start) / n, (double)n, processor[1], 100 * (double)(s.newton - clock.first.newton) / n,
      100 * (double)(s.jacobians - clock.first.jacobians) / n,
      100 * (double)(s.factorizations - clock.first.factorizations) / n,
      (double)iterations / (double)PetscMax(s.solves, 1), s.rejected, s.corrector_fails, most, all, turned));
  PetscFunctionReturn(0);
}

static PetscErrorCode Run()
{
  Case           c;
  TS             ts;
  Clock          clock;
  PetscLogDouble start, built;
  PetscFunctionBeginUser;
  PetscCall(ReadCase(&c));
  PetscCall(PetscTime(&start));
  FeModel    model(PETSC_COMM_WORLD);
  Scene      scene(PETSC_COMM_WORLD);
  FullFeBody fe;
  PetscCall(ReadSolidBeam(c.block, &model));
  scene.gravity({0, 0, -9.81});
  if (c.held == ROD) PetscCall(BuildSliderCrank(c, model, scene, &fe));
  else PetscCall(Build(c, model, scene, &fe));
  if (c.law == FeLaw::Large && !c.blocks) { /* the body contains its elements */
    PetscCall(MatDestroy(&model.K));
    PetscCall(MatDestroy(&model.M));
  }
  PetscCall(scene.createTS(&ts));
  if (c.blocks && c.held == FREE) PetscCall(TellBlocks(ts, model.K));
  PetscCall(TSSetMaxTime(ts, 100 * c.steps * c.part * Period(c)));
  PetscCall(TSSetMaxSteps(ts, c.steps + 1));
  PetscCall(TSSetTimeStep(ts, c.part * Period(c)));
  PetscCall(TSSetTolerances(ts, 1e-5 * c.block.length, nullptr, 1e-5, nullptr));
  TSAdapt adapt;
  PetscCall(TSGetAdapt(ts, &adapt));
  PetscCall(TSAdaptSetType(adapt, TSADAPTNONE));
  PetscCall(TSSetFromOptions(ts));
  PetscCall(TSMonitorSet(ts, Clock::monitor, &clock, nullptr));
  PetscCall(PetscTime(&built));
  clock.run          = built;
  clock.processor[0] = ProcessorSeconds();
  PetscCall(PetscLogStageRegister("Further steps", &clock.stage));
  PetscCall(scene.solve(ts));
  PetscCall(PetscLogStagePop());
  PetscCall(Report(ts, c, clock, built - start));
  PetscCall(TSDestroy(&ts));
  PetscFunctionReturn(0);
}

int main(int argc, char **argv)
{
  PetscCall(SlepcInitialize(&argc, &argv, nullptr, nullptr));
  PetscCall(TSHHT3Initialize());
  PetscCall(Run());
  PetscCall(SlepcFinalize());
  return 0;
}
