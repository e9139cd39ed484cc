static char help[] = "Where KLU ends and MUMPS begins: time for one factorization and three solves (a Newton step that "
                     "needs a new matrix)\n"
                     "over families of Newton matrices, against the work that src/linear counts before it chooses.\n"
                     "  -limit <s>  leave out a package once a matrix of the family took it longer than this [10]\n";

#include "../../src/linear/graph.h"
#include "../../src/linear/linear.h"
#include "linear_matrices.h"
#include <algorithm>
#include <functional>
#include <hhtdae/hhtdae.h>
#include <petsc/private/petscimpl.h>
#include <petsctime.h>
#include <string>

struct Solver {
  const char *name, *pc, *package;
};
static const Solver solvers[] = {
    {"KLU", PCLU, "klu"}, {"KLU pairs", PCLU, "klupair"}, {"MUMPS LU", PCLU, "mumpsnd"}, {"MUMPS LDL^T", PCCHOLESKY, "mumpsnd"}};
static const int num_solvers = sizeof solvers / sizeof *solvers;

/* Seconds of one numeric factorization and three solves, the median over repetitions that take 0.2 s in all */
static PetscErrorCode time_solver(Mat A, const Solver &solver, double *seconds)
{
  KSP                 ksp;
  PC                  pc;
  Vec                 b, x;
  std::vector<double> times;

  PetscFunctionBeginUser;
  PetscCall(MatCreateVecs(A, &x, &b));
  PetscCall(VecSet(b, 1.0));
  PetscCall(KSPCreate(PETSC_COMM_SELF, &ksp));
  PetscCall(KSPSetType(ksp, KSPPREONLY));
  PetscCall(KSPGetPC(ksp, &pc));
  PetscCall(PCSetType(pc, solver.pc));
  PetscCall(PCFactorSetMatSolverType(pc, solver.package));
  PetscCall(KSPSetOperators(ksp, A, A));
  PetscCall(KSPSetUp(ksp));
  for (double total = 0; total < 0.2 || times.size() < 3;) {
    PetscLogDouble start, end;
    PetscCall(PetscObjectStateIncrease((PetscObject)A)); /* as if the values had changed */
    PetscCall(PetscTime(&start));
    for (int k = 0; k < 3; ++k) PetscCall(KSPSolve(ksp, b, x));
    PetscCall(PetscTime(&end));
    times.push_back(end - start);
    total += times.back();
    if (total > 20) break;
  }
  std::nth_element(times.begin(), times.begin() + times.size() / 2, times.end());
  *seconds = times[times.size() / 2];
  PetscCall(KSPDestroy(&ksp));
  PetscCall(VecDestroy(&b));
  PetscCall(VecDestroy(&x));
  PetscFunctionReturn(0);
}

static PetscErrorCode count_work(Mat A, LinearWork *work)
{
  LinearGraph     graph;
  PetscBool       done, bounded;
  IS              row, col;
  const PetscInt *order;

  PetscFunctionBeginUser;
  PetscCall(LinearGraphFromMat(A, &graph, &done));
  PetscCall(MatGetOrdering(A, "amd", &row, &col));
  PetscCall(ISGetIndices(row, &order));
  LinearCountWork(graph, order, 1e12, work, &bounded);
  PetscCall(ISRestoreIndices(row, &order));
  PetscCall(ISDestroy(&row));
  PetscCall(ISDestroy(&col));
  PetscFunctionReturn(0);
}

/* The solver that LinearChoose() selects for the matrix */
static PetscErrorCode chosen(Mat A, std::string *name)
{
  KSP           ksp;
  PC            pc;
  LinearChoice  choice;
  MatSolverType package;
  PCType        type;

  PetscFunctionBeginUser;
  PetscCall(KSPCreate(PETSC_COMM_SELF, &ksp));
  PetscCall(LinearDefaults(ksp, &choice));
  PetscCall(LinearChoose(ksp, A, PETSC_TRUE, &choice));
  PetscCall(KSPGetPC(ksp, &pc));
  PetscCall(PCGetType(pc, &type));
  PetscCall(PCFactorGetMatSolverType(pc, &package));
  *name = std::string(type) + "/" + package;
  PetscCall(KSPDestroy(&ksp));
  PetscFunctionReturn(0);
}

static PetscErrorCode measure_family(const char title[], const std::vector<PetscInt> &sizes, double limit,
                                     const std::function<Triplets(PetscInt)> &generate)
{
  bool skip[num_solvers] = {};

  PetscFunctionBeginUser;
  PetscCall(PetscPrintf(PETSC_COMM_SELF, "%s\n", title));
  for (PetscInt size : sizes) {
    Triplets     entries = generate(size);
    Mat         A;
    LinearWork  work;
    std::string choice;
    PetscCall(create_matrix(entries, &A));
    PetscCall(count_work(A, &work));
    PetscCall(chosen(A, &choice));
    PetscCall(PetscPrintf(PETSC_COMM_SELF, "%6" PetscInt_FMT " %7" PetscInt_FMT " %10.2e %10.2e %6.1f  ", size,
                          entries.n, work.factor, work.flops, work.flops / work.factor));
    for (int s = 0; s < num_solvers; ++s) {
      double seconds = 0;
      if (!skip[s]) PetscCall(time_solver(A, solvers[s], &seconds));
      if (skip[s])
        PetscCall(PetscPrintf(PETSC_COMM_SELF, "%12s", "-"));
      else
        PetscCall(PetscPrintf(PETSC_COMM_SELF, "%12.3f", 1e3 * seconds));
      skip[s] = skip[s] || seconds > limit;
    }
    PetscCall(PetscPrintf(PETSC_COMM_SELF, "   %s\n", choice.c_str()));
    PetscCall(MatDestroy(&A));
  }
  PetscFunctionReturn(0);
}

int main(int argc, char **argv)
{
  PetscReal limit = 10;

  PetscFunctionBeginUser;
  PetscCall(PetscInitialize(&argc, &argv, NULL, help));
  PetscCall(TSHHT3Initialize());
  PetscCall(PetscOptionsGetReal(NULL, NULL, "-limit", &limit, NULL));
  PetscCall(PetscPrintf(PETSC_COMM_SELF, "%6s %7s %10s %10s %6s  ", "size", "n", "nz(L)", "flops", "ratio"));
  for (const Solver &s : solvers) PetscCall(PetscPrintf(PETSC_COMM_SELF, "%12s", s.name));
  PetscCall(PetscPrintf(PETSC_COMM_SELF, "   chosen (times in ms)\n"));
  PetscCall(measure_family("planar chain, bodies", {10, 30, 100, 300, 1000, 3000, 10000}, limit,
                           [](PetscInt n) { return chain(n, 0); }));
  PetscCall(measure_family("chain of 10 bodies with dense modal blocks, modes", {5, 10, 20, 40, 80, 120, 160, 240},
                           limit, [](PetscInt n) { return chain(10, n); }));
  PetscCall(measure_family("chain of bodies with 20 modes, bodies", {3, 10, 30, 100, 300, 1000}, limit,
                           [](PetscInt n) { return chain(n, 20); }));
  PetscCall(
      measure_family("one body with modes", {40, 80, 160, 320, 640}, limit, [](PetscInt n) { return chain(1, n); }));
  PetscCall(measure_family("plate of n x n x 1 bricks, n", {4, 6, 8, 12, 16, 24, 32, 48, 64}, limit,
                           [](PetscInt n) { return block(n, n, 1, true); }));
  PetscCall(measure_family("block of n x n x n bricks, n", {2, 3, 4, 6, 8, 12, 16}, limit,
                           [](PetscInt n) { return block(n, n, n, true); }));
  PetscCall(PetscFinalize());
  return 0;
}
