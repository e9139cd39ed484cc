/*
  A solid cantilever under a load at its tip as a whole finite-element model: history of displacements, time of a step,
  memory; by hhtdae, by backward Euler for the same equations, or its static solution. The scripts t10_beam.py and
  calculix_beam.py compare it with published figures and with CalculiX.

    solidbeam -size 9,6,3 -load 5000,0,0 -ts_dt 1e-3 -end 0.05 -motion u.txt

  -by hhtdae, euler, static: euler solves each step by Newton's method with a new matrix in every iteration (options with
  the prefix euler_); static increases the load in -increments <1> (prefix static_);
  -size, -dimensions <3,2,1>: cells along x, y, z and lengths; -element tetrahedron10, brick20: a cell is six tetrahedra
  or one brick; -write_mesh FILE: writes this mesh; -mesh FILE: reads a mesh of Gmsh instead, with the physical groups
  "root", which is clamped, and "tip"; -young <7e8>, -poisson <0.33>, -density <2700>;
  -load: the force on the tip, in equal parts on its nodes; -rise <0>: time in which the load increases to this value;
  -end: final time; -motion FILE: writes time and displacements at the end of each step, of the nodes nearest to the corner
  of the tip with the largest coordinates and to the middle of the edge with the largest y and z, and of the mean of the tip;
  -every DT: at the multiples of DT instead of the ends of steps, interpolated within hhtdae's steps.
*/
#include "beam_mesh.h"
#include "process_use.h"
#include "solidbeam_history.h"

#include <hhtdae/hhtdae.h>
#include <slepcsys.h>

using namespace hhtdae;
using hhtbench::PeakMegabytes;
using hhtbench::ProcessorSeconds;

namespace
{

enum By { HHTDAE, EULER, STATIC };

struct Case {
  hhtex::SolidBeam beam;
  By               by   = HHTDAE;
  Vector3          load = Vector3::Zero();
  double           end = 0.05, h = 1e-3, rise = 0, every = 0;
  PetscInt         increments = 1;
  std::string      mesh, write_mesh, motion;
};

PetscErrorCode Name(const char *option, std::string *name)
{
  char text[PETSC_MAX_PATH_LEN] = "";
  PetscFunctionBeginUser;
  PetscCall(PetscOptionsGetString(nullptr, nullptr, option, text, sizeof text, nullptr));
  *name = text;
  PetscFunctionReturn(0);
}

PetscErrorCode Three(const char *option, double *x)
{
  PetscInt  n = 3;
  PetscBool given;
  PetscFunctionBeginUser;
  PetscCall(PetscOptionsGetRealArray(nullptr, nullptr, option, x, &n, &given));
  PetscCheck(!given || n == 3, PETSC_COMM_WORLD, PETSC_ERR_ARG_OUTOFRANGE, "%s needs three numbers", option);
  PetscFunctionReturn(0);
}

PetscErrorCode ReadCase(Case *c)
{
  const char *const kinds[] = {"hhtdae", "euler", "static", "By", "", nullptr}, *const elements[] = {"tetrahedron10", "brick20", "Element", "", nullptr};
  PetscInt          n[3] = {3, 2, 1}, three = 3;
  PetscReal         L[3] = {3, 2, 1};
  PetscEnum         by = (PetscEnum)HHTDAE, element = (PetscEnum)0;
  PetscBool         sized;
  hhtex::SolidBeam &b = c->beam;
  PetscFunctionBeginUser;
  b.material = {7e8, 0.33, 2700};
  PetscCall(PetscOptionsGetEnum(nullptr, nullptr, "-by", kinds, &by, nullptr));
  PetscCall(PetscOptionsGetEnum(nullptr, nullptr, "-element", elements, &element, nullptr));
  b.element = element ? hhtex::BeamElement::Brick20 : hhtex::BeamElement::Tetrahedron10;
  PetscCall(PetscOptionsGetIntArray(nullptr, nullptr, "-size", n, &three, &sized));
  PetscCheck(!sized || three == 3, PETSC_COMM_WORLD, PETSC_ERR_ARG_OUTOFRANGE, "-size needs three numbers");
  PetscCall(Three("-dimensions", L));
  PetscCall(Three("-load", c->load.data()));
  for (auto &o : {std::make_pair("-young", &b.material.young),
                  {"-poisson", &b.material.poisson},
                  {"-density", &b.material.density},
                  {"-rise", &c->rise},
                  {"-every", &c->every},
                  {"-end", &c->end}})
    PetscCall(PetscOptionsGetReal(nullptr, nullptr, o.first, o.second, nullptr));
  PetscCall(PetscOptionsGetInt(nullptr, nullptr, "-increments", &c->increments, nullptr));
  for (const char *name : {"-ts_dt", "-ts_time_step"}) /* the option's names in PETSc before 3.25 and since */
    PetscCall(PetscOptionsGetReal(nullptr, nullptr, name, &c->h, nullptr));
  PetscCall(Name("-mesh", &c->mesh));
  PetscCall(Name("-write_mesh", &c->write_mesh));
  PetscCall(Name("-motion", &c->motion));
  PetscCheck(c->h > 0 && c->end > 0 && c->increments > 0 && c->rise >= 0, PETSC_COMM_WORLD, PETSC_ERR_ARG_OUTOFRANGE,
             "-ts_dt, -end and -increments must be positive, -rise not negative");
  c->by = (By)by;
  if (c->by == STATIC) c->rise = 1;
  for (int k = 0; k < 3; k++) b.n[k] = (int)n[k];
  b.length = L[0];
  b.depth  = L[1];
  b.width  = L[2];
  PetscFunctionReturn(0);
}

PetscErrorCode ReadModel(const Case &c, FeModel *model)
{
  PetscMPIInt rank;
  int         written = 1;
  PetscFunctionBeginUser;
  PetscCallMPI(MPI_Comm_rank(PETSC_COMM_WORLD, &rank));
  if (!c.write_mesh.empty()) {
    if (rank == 0) written = hhtex::BeamMeshFile(c.beam).write(c.write_mesh);
    PetscCallMPI(MPI_Bcast(&written, 1, MPI_INT, 0, PETSC_COMM_WORLD));
    PetscCheck(written, PETSC_COMM_WORLD, PETSC_ERR_FILE_WRITE, "cannot write the mesh %s", c.write_mesh.c_str());
  }
  if (c.mesh.empty()) PetscCall(ReadSolidBeam(c.beam, model));
  else PetscCall(model->readMesh(c.mesh, {{"", c.beam.material}}));
  for (const char *set : {"root", "tip"})
    PetscCheck(model->sets.count(set), PETSC_COMM_WORLD, PETSC_ERR_ARG_WRONG, "the mesh has no physical group \"%s\"", set);
  PetscFunctionReturn(0);
}

/* The force acts in equal parts on all nodes of the tip. For static solutions the time goes from 0 to 1 */
PetscErrorCode Build(const Case &c, const FeModel &model, Scene &scene, FullFeBody *fe)
{
  FullBody  body;
  UserForce load;
  PetscFunctionBeginUser;
  body.attachments.resize(2);
  body.attachments[0].name = "root";
  body.attachments[1].name = "tip";
  body.attachments[1].tie  = Tie::Average;
  PetscCall(fe->add(scene, "beam", model, body));
  const Marker root = scene.marker(fe->attachment("root"));
  scene.add("clamp", Fixed{root, scene.marker(scene.ground(), DataOf(scene).frame(root).x)});
  load.i = scene.marker(fe->attachment("tip"));
  for (int k = 0; k < 3; k++) {
    const double f = c.load[k], rise = c.rise;
    load.force.push_back(Expression({Measure::time()}, [f, rise](const Real *t) -> Real { return t[0] < rise ? f / rise * t[0] : f + 0. * t[0]; }));
  }
  scene.add("load", load);
  if (c.by != HHTDAE) scene.start().rotations = Rotations::Euler313;
  PetscFunctionReturn(0);
}

struct Counts {
  PetscInt steps = 0, iterations = 0, matrices = 0, factorizations = 0;
  double   begun = 0, first = 0, ended = 0; /* processor time: before the first step, after it, after the last one */
};

/* ---- hhtdae ---- */

struct Watcher {
  History *history;
  Counts  *counts;
  double   every; /* 0: record the ends of steps */
  PetscInt done = 0;

  static PetscErrorCode monitor(TS ts, PetscInt step, PetscReal t, Vec U, void *ctx)
  {
    Watcher *w = static_cast<Watcher *>(ctx);
    PetscFunctionBeginUser;
    if (step <= 0) PetscFunctionReturn(0);
    if (step == 1) w->counts->first = ProcessorSeconds();
    if (w->every > 0) PetscCall(w->within(ts, t, U));
    else PetscCall(w->history->write(t, U));
    PetscFunctionReturn(0);
  }

private:
  PetscErrorCode within(TS ts, PetscReal t, Vec U)
  {
    Vec between;
    PetscFunctionBeginUser;
    PetscCall(VecDuplicate(U, &between));
    for (; (double)(done + 1) * every <= t * (1 + 1e-12); done++) {
      const double at = std::fmin((double)(done + 1) * every, t);
      PetscCall(TSHHT3Interpolate(ts, at, between, nullptr, nullptr));
      PetscCall(history->write(at, between));
    }
    PetscCall(VecDestroy(&between));
    PetscFunctionReturn(0);
  }
};

PetscErrorCode RunHHT(const Case &c, Scene &scene, TS ts, History &history, Counts &counts)
{
  Watcher          watcher{&history, &counts, c.every};
  TSAdapt          adapt;
  TSHHT3Statistics s;
  PetscFunctionBeginUser;
  PetscCall(TSSetMaxTime(ts, c.end));
  PetscCall(TSSetMaxSteps(ts, 100000000));
  PetscCall(TSSetTimeStep(ts, c.h));
  PetscCall(TSGetAdapt(ts, &adapt));
  PetscCall(TSAdaptSetType(adapt, TSADAPTNONE));
  PetscCall(TSSetFromOptions(ts));
  PetscCall(TSMonitorSet(ts, Watcher::monitor, &watcher, nullptr));
  counts.begun = ProcessorSeconds();
  PetscCall(scene.solve(ts));
  counts.ended = ProcessorSeconds();
  PetscCall(TSHHT3GetStatistics(ts, &s));
  counts.steps          = s.steps;
  counts.iterations     = s.newton;
  counts.matrices       = s.jacobians;
  counts.factorizations = s.factorizations;
  PetscFunctionReturn(0);
}

/* ---- backward Euler, and rest, by SNES ---- */

/* The positions are the unknowns of a step: u' = (u - u_n)/h, u'' = (u' - u'_n)/h in the scene's equations, which is
   backward Euler on the first-order system with u' eliminated. For static solutions both are zero. Rows of constraints
   are multiplied by a mean diagonal entry s of the other rows, and so are the columns of multipliers (the unknowns are
   lambda/s): with unscaled constraints, whose entries are much smaller, LDL^T must delay thousands of pivots and takes
   more than twice as long */
struct Euler {
  TS      ts;
  double  h, t = 0; /* h = 0: static */
  Vec     Un, Vn, V, A, scale, U; /* scale: 1, and s for multipliers; U includes lambda */
  Counts *counts;

  PetscErrorCode motion(Vec U)
  {
    PetscFunctionBeginUser;
    if (h <= 0) PetscFunctionReturn(0);
    PetscCall(VecWAXPY(V, -1, Un, U));
    PetscCall(VecScale(V, 1 / h));
    PetscCall(VecWAXPY(A, -1, Vn, V));
    PetscCall(VecScale(A, 1 / h));
    PetscFunctionReturn(0);
  }
  /* Determines s from the matrix at x, at which all scale factors are still 1 */
  PetscErrorCode findScale(Vec x, Mat J)
  {
    IS          multipliers;
    Vec         part;
    PetscScalar sum;
    PetscInt    n, m;
    PetscFunctionBeginUser;
    PetscCall(VecSet(scale, 1));
    PetscCall(matrix(x, J));
    PetscCall(MatGetDiagonal(J, U));
    PetscCall(VecAbs(U));
    PetscCall(VecSum(U, &sum));
    PetscCall(TSHHT3GetIS(ts, TSHHT3_HOLONOMIC, &multipliers));
    PetscCall(VecGetSize(U, &n));
    PetscCall(ISGetSize(multipliers, &m));
    PetscCall(VecGetSubVector(scale, multipliers, &part));
    PetscCall(VecSet(part, sum / (double)(n - m)));
    PetscCall(VecRestoreSubVector(scale, multipliers, &part));
    PetscFunctionReturn(0);
  }
  PetscErrorCode matrix(Vec x, Mat J)
  {
    TSI2Jacobian f;
    void        *scene;
    const double rate = h > 0 ? 1 / h : 0;
    PetscFunctionBeginUser;
    PetscCall(motion(x));
    PetscCall(VecPointwiseMult(U, scale, x));
    PetscCall(TSGetI2Jacobian(ts, nullptr, nullptr, &f, &scene));
    PetscCall((*f)(ts, t, U, V, A, rate, rate * rate, J, J, scene));
    PetscCall(MatDiagonalScale(J, scale, scale));
    PetscFunctionReturn(0);
  }
  static PetscErrorCode function(SNES, Vec x, Vec F, void *ctx)
  {
    Euler       *e = static_cast<Euler *>(ctx);
    TSI2Function f;
    void        *scene;
    PetscFunctionBeginUser;
    PetscCall(e->motion(x));
    PetscCall(VecPointwiseMult(e->U, e->scale, x));
    PetscCall(TSGetI2Function(e->ts, nullptr, &f, &scene));
    PetscCall((*f)(e->ts, e->t, e->U, e->V, e->A, F, scene));
    PetscCall(VecPointwiseMult(F, e->scale, F));
    PetscFunctionReturn(0);
  }
  static PetscErrorCode jacobian(SNES, Vec x, Mat, Mat J, void *ctx)
  {
    Euler *e = static_cast<Euler *>(ctx);
    PetscFunctionBeginUser;
    PetscCall(e->matrix(x, J));
    e->counts->matrices++;
    PetscFunctionReturn(0);
  }
};

PetscErrorCode CreateSNES(Euler &e, const char *prefix, double force, SNES *snes)
{
  Mat            J;
  KSP            ksp;
  PC             pc;
  SNESLineSearch search;
  PetscFunctionBeginUser;
  PetscCall(TSGetI2Jacobian(e.ts, nullptr, &J, nullptr, nullptr));
  PetscCall(SNESCreate(PETSC_COMM_WORLD, snes));
  PetscCall(SNESSetOptionsPrefix(*snes, prefix));
  PetscCall(SNESSetFunction(*snes, nullptr, Euler::function, &e));
  PetscCall(SNESSetJacobian(*snes, J, J, Euler::jacobian, &e));
  /* no test of the correction relative to the positions, which are large compared with displacements */
  PetscCall(SNESSetTolerances(*snes, 2e-8 * force, 1e-8, 0, 50, PETSC_DEFAULT));
  PetscCall(SNESGetLineSearch(*snes, &search));
  PetscCall(SNESLineSearchSetType(search, SNESLINESEARCHBASIC));
  PetscCall(SNESGetKSP(*snes, &ksp));
  PetscCall(KSPSetType(ksp, KSPPREONLY));
  PetscCall(KSPGetPC(ksp, &pc));
  PetscCall(PCSetType(pc, PCCHOLESKY));
  PetscCall(PCFactorSetMatSolverType(pc, "mumpsnd"));
  PetscCall(SNESSetFromOptions(*snes));
  PetscFunctionReturn(0);
}

PetscErrorCode RunEuler(const Case &c, TS ts, History &history, Counts &counts)
{
  Euler               e{ts, c.by == STATIC ? 0 : c.h, 0, nullptr, nullptr, nullptr, nullptr, nullptr, nullptr, &counts};
  Vec                 x, U0, V0;
  Mat                 J;
  SNES                snes;
  SNESConvergedReason reason;
  PetscInt            iterations;
  const double        h     = c.by == STATIC ? 1. / (double)c.increments : c.h;
  const PetscInt      steps = c.by == STATIC ? c.increments : (PetscInt)std::llround(c.end / c.h);
  PetscFunctionBeginUser;
  PetscCall(TS2GetSolution(ts, &U0, &V0));
  for (Vec *v : {&x, &e.Un, &e.Vn, &e.V, &e.A, &e.scale, &e.U}) PetscCall(VecDuplicate(U0, v));
  PetscCall(VecCopy(U0, x)); /* with multipliers of zero */
  PetscCall(VecCopy(U0, e.Un));
  PetscCall(VecCopy(V0, e.Vn));
  PetscCall(VecZeroEntries(e.V));
  PetscCall(VecZeroEntries(e.A));
  PetscCall(CreateSNES(e, c.by == STATIC ? "static_" : "euler_", c.load.norm(), &snes));
  counts.begun = ProcessorSeconds();
  PetscCall(TSGetI2Jacobian(ts, nullptr, &J, nullptr, nullptr));
  PetscCall(e.findScale(x, J));
  for (PetscInt n = 1; n <= steps; n++) {
    e.t = (double)n * h;
    PetscCall(VecCopy(x, e.Un));
    if (c.by == EULER) PetscCall(VecAXPY(x, h, e.Vn));
    PetscCall(SNESSolve(snes, nullptr, x));
    PetscCall(SNESGetConvergedReason(snes, &reason));
    PetscCheck(reason > 0, PETSC_COMM_WORLD, PETSC_ERR_NOT_CONVERGED, "step %" PetscInt_FMT ": Newton's method has not converged, %s", n,
               SNESConvergedReasons[reason]);
    PetscCall(SNESGetIterationNumber(snes, &iterations));
    counts.iterations += iterations;
    counts.steps++;
    PetscCall(e.motion(x));
    PetscCall(VecCopy(e.V, e.Vn));
    PetscCall(history.write(e.t, x));
    if (n == 1) counts.first = ProcessorSeconds();
  }
  counts.ended = ProcessorSeconds();
  counts.factorizations = counts.matrices;
  PetscCall(SNESDestroy(&snes));
  for (Vec *v : {&x, &e.Un, &e.Vn, &e.V, &e.A, &e.scale, &e.U}) PetscCall(VecDestroy(v));
  PetscFunctionReturn(0);
}

/* ---- results ---- */

PetscErrorCode Report(const Case &c, const FeModel &model, TS ts, const History &history, const Counts &k)
{
  const char *const kinds[] = {"hhtdae", "euler", "static"};
  double            time[3] = {k.begun, k.first - k.begun, (k.ended - k.first) / (double)PetscMax(k.steps - 1, 1)};
  PetscInt          unknowns;
  Vec               U;
  PetscFunctionBeginUser;
  double memory = PeakMegabytes();
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &memory, 1, MPI_DOUBLE, MPI_SUM, PETSC_COMM_WORLD));
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, time, 3, MPI_DOUBLE, MPI_MAX, PETSC_COMM_WORLD));
  PetscCall(TSGetSolution(ts, &U));
  PetscCall(VecGetSize(U, &unknowns));
  const double *d = history.last();
  PetscCall(PetscPrintf(PETSC_COMM_WORLD,
                        "solidbeam: by=%s nodes=%" PetscInt_FMT " unknowns=%" PetscInt_FMT " steps=%" PetscInt_FMT " iterations=%" PetscInt_FMT
                        " matrices=%" PetscInt_FMT " factorizations=%" PetscInt_FMT " cpu_setup=%.3f cpu_first=%.3f cpu_step=%.5f memory_MB=%.0f\n"
                        "end: corner=%.15e,%.15e,%.15e edge=%.15e,%.15e,%.15e tip=%.15e,%.15e,%.15e\n",
                        kinds[c.by], model.nodes, unknowns, k.steps, k.iterations, k.matrices, k.factorizations, time[0], time[1], time[2], memory,
                        d[0], d[1], d[2], d[3], d[4], d[5], d[6], d[7], d[8]));
  PetscFunctionReturn(0);
}

PetscErrorCode Run()
{
  Case    c;
  TS      ts;
  History history;
  Counts  counts;
  PetscFunctionBeginUser;
  PetscCall(ReadCase(&c));
  FeModel    model(PETSC_COMM_WORLD);
  Scene      scene(PETSC_COMM_WORLD);
  FullFeBody fe;
  PetscCall(ReadModel(c, &model));
  PetscCall(Build(c, model, scene, &fe));
  PetscCall(scene.createTS(&ts));
  PetscCall(history.open(c.motion, model, ts));
  if (c.by == HHTDAE) PetscCall(RunHHT(c, scene, ts, history, counts));
  else PetscCall(RunEuler(c, ts, history, counts));
  PetscCall(history.close());
  PetscCall(Report(c, model, ts, history, counts));
  PetscCall(TSDestroy(&ts));
  PetscFunctionReturn(0);
}

} // namespace

int main(int argc, char **argv)
{
  PetscCall(SlepcInitialize(&argc, &argv, nullptr, nullptr));
  PetscCall(TSHHT3Initialize());
  PetscCall(Run());
  PetscCall(SlepcFinalize());
  return 0;
}
