static char help[] =
    "Phases of a direct solution with PETSc's \"klu\" and with our \"klupair\": analysis, factorization with "
    "pivoting, factorization of\n"
    "the same pattern with other values, one solve; entries of the factors (PETSc does not say for its own), largest "
    "residual.\n"
    "  -limit <s>  leave out a package once its analysis in a family took longer than this [20]\n";

#include "linear_matrices.h"
#include <functional>
#include <hhtdae/hhtdae.h>
#include <petscksp.h>
#include <petsctime.h>

struct Times {
  double analysis = 0, factor = 0, again = 0, solve = 0, entries = 0;
  double residual = 0;
};

static PetscErrorCode residual_of(Mat A, Mat F, Vec b, Vec x, Vec r, Times *t)
{
  PetscLogDouble start, end;
  PetscReal      norm, scale;

  PetscFunctionBeginUser;
  PetscCall(PetscTime(&start));
  PetscCall(MatSolve(F, b, x));
  PetscCall(PetscTime(&end));
  t->solve = t->solve > 0 ? PetscMin(t->solve, end - start) : end - start;
  PetscCall(MatMult(A, x, r));
  PetscCall(VecAYPX(r, -1.0, b));
  PetscCall(VecNorm(r, NORM_INFINITY, &norm));
  PetscCall(VecNorm(x, NORM_INFINITY, &scale));
  t->residual = PetscMax(t->residual, norm / scale);
  PetscFunctionReturn(0);
}

/* Slightly increases the mass of the coordinates from one matrix to the next, as a change of the step size does */
static PetscErrorCode change(Mat A, PetscInt coordinates)
{
  PetscFunctionBeginUser;
  for (PetscInt i = 0; i < coordinates; ++i) PetscCall(MatSetValue(A, i, i, 0.01, ADD_VALUES));
  PetscCall(MatAssemblyBegin(A, MAT_FINAL_ASSEMBLY));
  PetscCall(MatAssemblyEnd(A, MAT_FINAL_ASSEMBLY));
  PetscFunctionReturn(0);
}

static PetscErrorCode run(Mat A, const char package[], PetscInt coordinates, Times *t)
{
  Mat            F;
  Vec            b, x, r;
  MatFactorInfo  info;
  MatInfo        got;
  PetscLogDouble start, end;
  const int      repeat = 5;

  PetscFunctionBeginUser;
  *t = Times();
  PetscCall(MatCreateVecs(A, &x, &b));
  PetscCall(VecDuplicate(b, &r));
  PetscCall(VecSet(b, 1.0));
  PetscCall(MatFactorInfoInitialize(&info));
  PetscCall(MatGetFactor(A, package, MAT_FACTOR_LU, &F));
  PetscCall(PetscTime(&start));
  PetscCall(MatLUFactorSymbolic(F, A, NULL, NULL, &info));
  PetscCall(PetscTime(&end));
  t->analysis = end - start;
  for (int k = 0; k <= repeat; ++k) {
    PetscCall(PetscTime(&start));
    PetscCall(MatLUFactorNumeric(F, A, &info));
    PetscCall(PetscTime(&end));
    if (k == 0)
      t->factor = end - start;
    else
      t->again = k == 1 ? end - start : PetscMin(t->again, end - start);
    PetscCall(residual_of(A, F, b, x, r, t));
    PetscCall(change(A, coordinates));
  }
  PetscCall(MatGetInfo(F, MAT_LOCAL, &got));
  t->entries = got.nz_used;
  PetscCall(MatDestroy(&F));
  PetscCall(VecDestroy(&b));
  PetscCall(VecDestroy(&x));
  PetscCall(VecDestroy(&r));
  PetscFunctionReturn(0);
}

static PetscErrorCode family(const char title[], const std::vector<PetscInt> &sizes, double limit,
                             const std::function<Triplets(PetscInt)>  &generate,
                             const std::function<PetscInt(PetscInt)> &coordinates)
{
  bool skip = false;

  PetscFunctionBeginUser;
  PetscCall(PetscPrintf(PETSC_COMM_SELF, "%s\n", title));
  for (PetscInt size : sizes)
    for (const char *package : {"klu", "klupair"}) {
      const bool old = package[3] == 0;
      Mat        A;
      Times      t;
      if (old && skip) continue;
      Triplets entries = generate(size);
      PetscCall(create_matrix(entries, &A));
      PetscCall(run(A, package, coordinates(size), &t));
      PetscCall(PetscPrintf(PETSC_COMM_SELF,
                            "%7" PetscInt_FMT " %8" PetscInt_FMT " %-8s %10.3f %10.3f %10.3f %10.4f %10.2e %9.1e\n",
                            size, entries.n, package, 1e3 * t.analysis, 1e3 * t.factor, 1e3 * t.again, 1e3 * t.solve,
                            t.entries, t.residual));
      if (old) skip = t.analysis > limit;
      PetscCall(MatDestroy(&A));
    }
  PetscFunctionReturn(0);
}

int main(int argc, char **argv)
{
  PetscReal limit = 20;

  PetscFunctionBeginUser;
  PetscCall(PetscInitialize(&argc, &argv, NULL, help));
  PetscCall(TSHHT3Initialize());
  PetscCall(PetscOptionsGetReal(NULL, NULL, "-limit", &limit, NULL));
  PetscCall(PetscPrintf(PETSC_COMM_SELF, "%7s %8s %-8s %10s %10s %10s %10s %10s %9s   (ms)\n", "size", "n", "package",
                        "analysis", "factor", "again", "solve", "entries", "residual"));
  PetscCall(family(
      "planar chain, bodies", {10, 100, 1000, 10000}, limit, [](PetscInt n) { return chain(n, 0); },
      [](PetscInt n) { return 3 * n; }));
  PetscCall(family(
      "spatial chain, bodies", {10, 100, 1000, 3000, 10000, 30000, 100000}, limit,
      [](PetscInt n) { return spatial_chain(n); }, [](PetscInt n) { return 6 * n; }));
  PetscCall(family(
      "spatial chain with rings of 8, bodies", {80, 1000, 10000}, limit, [](PetscInt n) { return spatial_chain(n, 8); },
      [](PetscInt n) { return 6 * n; }));
  PetscCall(family(
      "one ring in space, bodies", {1000, 10000, 30000, 100000}, limit, [](PetscInt n) { return spatial_chain(n, n); },
      [](PetscInt n) { return 6 * n; }));
  PetscCall(family(
      "chain of bodies with 20 modes, bodies", {10, 100, 1000}, limit, [](PetscInt n) { return chain(n, 20); },
      [](PetscInt n) { return 23 * n; }));
  PetscCall(family(
      "chain of 10 bodies, modes", {40, 80, 120}, limit, [](PetscInt n) { return chain(10, n); },
      [](PetscInt n) { return 10 * (3 + n); }));
  PetscCall(family(
      "one body, modes", {160, 320}, limit, [](PetscInt n) { return chain(1, n); }, [](PetscInt n) { return 3 + n; }));
  PetscCall(family(
      "plate of n x n x 1 bricks, n", {8, 12, 16, 24}, limit, [](PetscInt n) { return block(n, n, 1, true); },
      [](PetscInt n) { return 6 * (n + 1) * (n + 1); }));
  PetscCall(family(
      "block of n x n x n bricks, n", {4, 6, 8}, limit, [](PetscInt n) { return block(n, n, n, true); },
      [](PetscInt n) { return 3 * (n + 1) * (n + 1) * (n + 1); }));
  PetscCall(PetscFinalize());
  return 0;
}
