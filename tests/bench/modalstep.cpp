/*
  Time per step of a scene with a flexible body of many modes, compared with a bound: the time of its dense algebra alone.

    modalstep -modes 20,60,134 -attachments 2,20

  The body is a bar of bricks, which the program reduces; rigid bodies are connected to half of its attachments by revolute
  joints, the other half is held by springs to the ground, into which the bar falls. The bound is the time of these calls of
  LAPACK and BLAS, as many as the run counted:

    factorization  dgetrf of a dense matrix of 6 + modes
    solve          dgetrs with it
    residual       18 dgemv of modes x modes: the invariants quadratic in the modes with coordinates and rates
    Jacobian       27 dgemv (accelerations, too) and 9 sums of matrices of modes x modes

  The bound does not contain the joints and bodies at attachments. The second ratio is to a bound that includes their
  elimination: a product of rank 6 per attachment for each factorization, and 12 more columns per attachment for each solve.
  The following line has the same ratios for the steps after the first, that is, without symbolic analysis, pivoting and
  consistent accelerations, which are computed once.
  The same number of modes is then taken from a finer mesh, whose motion and counts differ slightly, so that times are
  compared as ratios to the bound.

    -end <2>  -tolerance <1e-5>  -mesh <24>,<40>: bricks along the bar  -repeat <3>: repetitions, of which the shortest time counts
*/
#include "box_model.h"
#include "hhtdae/flexible.h"
#include <algorithm>
#include <cstdlib>
#include <ctime>
#include <hhtdae/hhtdae.h>
#include <slepcsys.h>
#include <unistd.h>

using namespace hhtest;
using namespace hhtdae;

constexpr double length = 4, width = 0.1;

static std::string Name(PetscInt a) { return "at " + std::to_string(a); }

static PetscErrorCode MakeBody(PetscInt bricks, PetscInt modes, ReducedBody *body)
{
  const PetscInt count = 20, across = std::max<PetscInt>(2, bricks / 12);
  const double   size = length / (double)bricks;
  FeModel        model(PETSC_COMM_SELF);
  Reduction      reduction;
  PetscFunctionBegin;
  BoxBuilder builder({{(int)bricks, (int)across, (int)across}, {length, width, 0.8 * width}, {7e10, 0.3, 2700}},
                     &model);
  for (PetscInt a = 0; a < count; a++) {
    const double x0 = length * (double)a / (double)(count - 1);
    builder.addSet(Name(a), [=](const Vector3 &x) { return std::abs(x[0] - x0) < 0.51 * size; });
    Attachment attachment;
    attachment.name = Name(a);
    attachment.tie  = Tie::Average; /* only if there are more bricks than attachments do neighbouring sections have no common nodes */
    reduction.attachments.push_back(attachment);
  }
  reduction.modes = modes; /* constraint modes are added; the highest modes are then left out */
  for (PetscInt k = 0; k < modes; k++) reduction.keep.push_back(k);
  PetscCall(Reduce(model, reduction, body));
  PetscFunctionReturn(0);
}

/* ---- the scene ---- */

struct Timing {
  TSHHT3Statistics s;
  PetscInt         unknowns;
  std::string      package;
};

static PetscErrorCode Build(Scene &scene, std::shared_ptr<const ModalBody> model, PetscInt attachments)
{
  FlexibleBody b;
  PetscFunctionBegin;
  b.model   = model;
  b.damping = {{1e9, 0.005}};
  scene.gravity({0, 0, -9.81});
  const Body bar = scene.add("bar", b);
  for (PetscInt k = 0; k < attachments; k++) {
    const PetscInt a  = attachments > 1 ? k * 19 / (attachments - 1) : 0;
    const Vector3  at = model->attachments[a].position;
    const Body     on = scene.attachment(bar, Name(a));
    Matrix3        across; /* hinges along the bar */
    across << 0, 0, 1, 1, 0, 0, 0, 1, 0;
    if (k % 2 == 0) {
      RigidBody load;
      load.mass       = 2;
      load.inertia    = 0.01 * Matrix3::Identity();
      load.position   = at + Vector3(0, 0.2, -0.1);
      const Body hung = scene.add("load " + std::to_string(k), load);
      scene.add("hinge " + std::to_string(k),
                Revolute{scene.markerAt(on, at, across), scene.markerAt(hung, at, across)});
    }
    if (k % 2 == 1 || attachments == 2)
      scene.add("spring " + std::to_string(k),
                SpringDamper{scene.markerAt(on, at), scene.markerAt(scene.ground(), Vector3(at + Vector3(0.1, 0.1, 1))),
                             2e4 / (double)attachments, 10, -1});
  }
  PetscFunctionReturn(0);
}

static PetscErrorCode RunScene(std::shared_ptr<const ModalBody> model, PetscInt attachments, double end,
                               double tolerance, PetscInt steps, Timing *t)
{
  Scene         scene(PETSC_COMM_SELF);
  TS            ts;
  SNES          snes;
  KSP           ksp;
  PC            pc;
  Vec           U;
  MatSolverType package;
  PetscFunctionBegin;
  PetscCall(Build(scene, model, attachments));
  PetscCall(scene.createTS(&ts));
  PetscCall(TSSetMaxTime(ts, end));
  PetscCall(TSSetMaxSteps(ts, steps));
  PetscCall(TSSetTolerances(ts, tolerance, nullptr, tolerance, nullptr));
  PetscCall(TSSetFromOptions(ts));
  PetscCall(scene.solve(ts));
  PetscCall(TSHHT3GetStatistics(ts, &t->s));
  PetscCall(TSGetSolution(ts, &U));
  PetscCall(VecGetSize(U, &t->unknowns));
  PetscCall(TSGetSNES(ts, &snes));
  PetscCall(SNESGetKSP(snes, &ksp));
  PetscCall(KSPGetPC(ksp, &pc));
  PetscCall(PCFactorGetMatSolverType(pc, &package));
  t->package = package ? package : "?";
  PetscCall(TSDestroy(&ts));
  PetscFunctionReturn(0);
}

/* ---- the bound ---- */

/* CPU seconds of a call, from as many calls as take 50 ms */
template <class F> static double Seconds(F &&call)
{
  const std::clock_t start = std::clock();
  std::clock_t       now;
  int                calls = 0;
  do {
    call();
    calls++;
    now = std::clock();
  } while (now - start < CLOCKS_PER_SEC / 20);
  return (double)(now - start) / CLOCKS_PER_SEC / calls;
}

struct Bound {
  double factor = 0, solve = 0, residual = 0, jacobian = 0, eliminate = 0; /* seconds each */
  double seconds(const TSHHT3Statistics &s) const
  {
    return factor * (double)s.factorizations + solve * (double)s.solves + residual * (double)s.residuals +
           jacobian * (double)s.jacobians;
  }
};

/* By PETSc's dense matrices, which call LAPACK and BLAS with little overhead */
static PetscErrorCode Dense(const ModalBody &body, PetscInt attachments, Bound *t)
{
  const PetscInt  m = body.modes(), n = 6 + m;
  Eigen::MatrixXd A0 = Eigen::MatrixXd::Random(n, n), room(n, n);
  Mat             A, N[6], sum;
  Vec             x, y, b, c;
  MatFactorInfo   info;
  PetscErrorCode  failed = 0;
  const auto      check  = [&](PetscErrorCode e) { failed = failed ? failed : e; };
  PetscFunctionBegin;
  A0.diagonal().array() += n;
  PetscCall(MatFactorInfoInitialize(&info));
  PetscCall(MatCreateSeqDense(PETSC_COMM_SELF, n, n, room.data(), &A));
  PetscCall(MatCreateSeqDense(PETSC_COMM_SELF, m, m, nullptr, &sum));
  for (int p = 0; p < 6; p++)
    PetscCall(MatCreateSeqDense(PETSC_COMM_SELF, m, m, const_cast<double *>(body.quadratic[p].data()), &N[p]));
  PetscCall(MatCreateVecs(sum, &x, &y));
  PetscCall(MatCreateVecs(A, &b, &c));
  PetscCall(VecSet(x, 1));
  PetscCall(VecSet(b, 1));
  const auto products = [&] {
    for (int p = 0; p < 6; p++) check(MatMult(N[p], x, y));
    for (int p = 3; p < 6; p++) check(MatMultTranspose(N[p], x, y));
  };
  t->factor   = Seconds([&] {
    check(MatSetUnfactored(A));
    room = A0;
    check(MatLUFactor(A, nullptr, nullptr, &info));
  });
  t->solve    = Seconds([&] { check(MatSolve(A, b, c)); });
  t->residual = Seconds([&] {
    products();
    products();
  });
  t->jacobian = Seconds([&] {
    for (int k = 0; k < 3; k++) products();
    for (int k = 0; k < 9; k++) check(MatAXPY(sum, 0.5, N[k % 6], SAME_NONZERO_PATTERN));
  });
  PetscCall(failed);
  Mat left, right, product;
  PetscCall(MatCreateSeqDense(PETSC_COMM_SELF, n, 6 * attachments, nullptr, &left));
  PetscCall(MatCreateSeqDense(PETSC_COMM_SELF, 6 * attachments, n, nullptr, &right));
  PetscCall(MatMatMult(left, right, MAT_INITIAL_MATRIX, 1, &product));
  t->eliminate = Seconds([&] { check(MatMatMult(left, right, MAT_REUSE_MATRIX, 1, &product)); });
  for (Mat *K : {&left, &right, &product}) PetscCall(MatDestroy(K));
  PetscCall(failed);
  for (Mat &K : N) PetscCall(MatDestroy(&K));
  PetscCall(MatDestroy(&A));
  PetscCall(MatDestroy(&sum));
  for (Vec *v : {&x, &y, &b, &c}) PetscCall(VecDestroy(v));
  PetscFunctionReturn(0);
}

/* ---- the program ---- */

/* Microseconds of a step and of its bound; ratios to the bound, and to the bound with attachments */
struct Ratios {
  double step, bound, first, second;
};

static double Shares(const ModalBody &model, PetscInt attachments)
{
  return 12 * (double)attachments / (6 + (double)model.modes());
}

static Ratios Compared(const Bound &d, const TSHHT3Statistics &s, double seconds, double shares)
{
  const double bound = d.seconds(s), steps = 1e-6 * (double)s.steps;
  const double all   = bound + d.eliminate * (double)s.factorizations + d.solve * shares * (double)s.solves;
  return {seconds / steps, bound / steps, seconds / bound, seconds / all};
}

/* Only the counters that enter the bound */
static TSHHT3Statistics Difference(TSHHT3Statistics all, const TSHHT3Statistics &less)
{
  all.steps -= less.steps;
  all.factorizations -= less.factorizations;
  all.solves -= less.solves;
  all.residuals -= less.residuals;
  all.jacobians -= less.jacobians;
  return all;
}

static PetscErrorCode Compare(const ReducedBody &body, PetscInt attachments, double end, double tolerance,
                              PetscInt repeat, double *ratio)
{
  const auto model = std::make_shared<const ModalBody>(body.modal);
  Timing     t, start;
  Bound      d;
  double     least = PETSC_INFINITY, least_start = PETSC_INFINITY;
  PetscFunctionBegin;
  for (PetscInt k = 0; k < repeat; k++) {
    PetscCall(RunScene(model, attachments, end, tolerance, 1, &start));
    least_start = std::min(least_start, start.s.cpu);
    PetscCall(RunScene(model, attachments, end, tolerance, 1000000, &t));
    least = std::min(least, t.s.cpu);
  }
  PetscCall(Dense(*model, attachments, &d));
  const Ratios all = Compared(d, t.s, least, Shares(*model, attachments)),
               later = Compared(d, Difference(t.s, start.s), least - least_start, Shares(*model, attachments));
  *ratio           = all.first;
  PetscCall(PetscPrintf(PETSC_COMM_SELF, "%8d %6d %12d %9d %6d %6d %7d %6d %10.1f %9.1f %7.2f %7.2f  %s\n",
                        (int)body.fe_nodes, (int)model->modes(), (int)attachments, (int)t.unknowns, (int)t.s.steps,
                        (int)t.s.residuals, (int)t.s.factorizations, (int)t.s.solves, all.step, all.bound, all.first,
                        all.second, t.package.c_str()));
  PetscCall(PetscPrintf(PETSC_COMM_SELF, "%38s %6d %6d %7d %6d %10.1f %9.1f %7.2f %7.2f\n", "after the first step:",
                        (int)(t.s.steps - start.s.steps), (int)(t.s.residuals - start.s.residuals),
                        (int)(t.s.factorizations - start.s.factorizations), (int)(t.s.solves - start.s.solves),
                        later.step, later.bound, later.first, later.second));
  PetscCall(
      PetscPrintf(PETSC_COMM_SELF,
                  "%16s dense, us: factorization %.3g, solve %.3g, residual %.3g, Jacobian %.3g, elimination %.3g\n",
                  "", 1e6 * d.factor, 1e6 * d.solve, 1e6 * d.residual, 1e6 * d.jacobian, 1e6 * d.eliminate));
  PetscFunctionReturn(0);
}

static PetscErrorCode Run()
{
  PetscInt  modes[8] = {20, 60, 134}, attachments[8] = {2, 20}, mesh[2] = {24, 40}, nm = 8, na = 8, two = 2, repeat = 3;
  PetscReal end = 2, tolerance = 1e-5;
  PetscBool given;
  PetscFunctionBegin;
  PetscCall(PetscOptionsGetIntArray(nullptr, nullptr, "-modes", modes, &nm, &given));
  if (!given) nm = 3;
  PetscCall(PetscOptionsGetIntArray(nullptr, nullptr, "-attachments", attachments, &na, &given));
  if (!given) na = 2;
  for (PetscInt k = 0; k < na; k++)
    PetscCheck(attachments[k] > 0 && attachments[k] <= 20, PETSC_COMM_SELF, PETSC_ERR_ARG_OUTOFRANGE,
               "-attachments %d: from 1 to 20", (int)attachments[k]);
  PetscCall(PetscOptionsGetIntArray(nullptr, nullptr, "-mesh", mesh, &two, nullptr));
  PetscCall(PetscOptionsGetInt(nullptr, nullptr, "-repeat", &repeat, nullptr));
  PetscCall(PetscOptionsGetReal(nullptr, nullptr, "-end", &end, nullptr));
  PetscCall(PetscOptionsGetReal(nullptr, nullptr, "-tolerance", &tolerance, nullptr));
  PetscCall(PetscPrintf(PETSC_COMM_SELF, "FE nodes  modes  attachments  unknowns  steps  resid  factor. solves  us a "
                                         "step  dense us   ratio  second  solver\n"));
  for (PetscInt i = 0; i < nm; i++) {
    ReducedBody body, fine;
    double      coarse = 0, finer = 0;
    PetscCall(MakeBody(mesh[0], modes[i], &body));
    for (PetscInt k = 0; k < na; k++) PetscCall(Compare(body, attachments[k], end, tolerance, repeat, &coarse));
    if (i + 1 < nm || na == 0 || mesh[1] == mesh[0]) continue;
    PetscCall(MakeBody(mesh[1], modes[i], &fine));
    PetscCall(Compare(fine, attachments[na - 1], end, tolerance, repeat, &finer));
    PetscCall(PetscPrintf(PETSC_COMM_SELF, "finer mesh: ratio to the bound times %.3f\n", finer / coarse));
  }
  PetscFunctionReturn(0);
}

/* Several BLAS threads would waste time by busy waiting; OpenBLAS reads its environment only when it is loaded, so the
   program is executed again */
static void runSingleThreaded(char **argv)
{
  if (getenv("OMP_NUM_THREADS") && getenv("OPENBLAS_NUM_THREADS")) return;
  setenv("OMP_NUM_THREADS", "1", 1);
  setenv("OPENBLAS_NUM_THREADS", "1", 1);
  execv("/proc/self/exe", argv);
}

int main(int argc, char **argv)
{
  runSingleThreaded(argv);
  PetscFunctionBegin;
  PetscCall(SlepcInitialize(&argc, &argv, nullptr, nullptr));
  PetscCall(TSHHT3Initialize());
  PetscCall(Run());
  PetscCall(SlepcFinalize());
  return 0;
}
