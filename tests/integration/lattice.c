/* Unit masses in a cube of n^3, every one tied to its neighbours and to its place by unit springs, one coordinate each: on several
   ranks many unknowns lie between them. Nothing else than the plugin makes the type hhtdae known. */
#include <petscdmda.h>
#include <petscts.h>

static PetscErrorCode Residual(TS ts, PetscReal t, Vec U, Vec V, Vec A, Vec F, void *K)
{
  PetscFunctionBeginUser;
  (void)ts, (void)t, (void)V;
  PetscCall(MatMultAdd((Mat)K, U, A, F));
  PetscFunctionReturn(0);
}

static PetscErrorCode Jacobian(TS ts, PetscReal t, Vec U, Vec V, Vec A, PetscReal sv, PetscReal sa, Mat J, Mat P, void *K)
{
  PetscFunctionBeginUser;
  (void)ts, (void)t, (void)U, (void)V, (void)A, (void)sv, (void)J;
  PetscCall(MatCopy((Mat)K, P, SAME_NONZERO_PATTERN));
  PetscCall(MatShift(P, sa));
  PetscFunctionReturn(0);
}

static PetscErrorCode Springs(DM grid, PetscInt n, Mat K)
{
  PetscInt x, y, z, nx, ny, nz;

  PetscFunctionBeginUser;
  PetscCall(DMDAGetCorners(grid, &x, &y, &z, &nx, &ny, &nz));
  for (PetscInt k = z; k < z + nz; k++)
    for (PetscInt j = y; j < y + ny; j++)
      for (PetscInt i = x; i < x + nx; i++) {
        const PetscInt at[3] = {i, j, k};
        MatStencil     row = {0}, col[7];
        PetscScalar    value[7] = {1};
        PetscInt       count = 1;

        row.i = i, row.j = j, row.k = k;
        col[0] = row;
        for (int d = 0; d < 6; d++) {
          const PetscInt step = d % 2 ? 1 : -1, to = at[d / 2] + step;
          if (to < 0 || to >= n) continue;
          col[count] = row;
          if (d / 2 == 0) col[count].i = to;
          if (d / 2 == 1) col[count].j = to;
          if (d / 2 == 2) col[count].k = to;
          value[count++] = -1;
          value[0] += 1;
        }
        PetscCall(MatSetValuesStencil(K, 1, &row, count, col, value, INSERT_VALUES));
      }
  PetscCall(MatAssemblyBegin(K, MAT_FINAL_ASSEMBLY));
  PetscCall(MatAssemblyEnd(K, MAT_FINAL_ASSEMBLY));
  PetscFunctionReturn(0);
}

int main(int argc, char **argv)
{
  PetscInt       n = 8;
  DM             grid;
  Mat            K, J;
  Vec            U, V;
  TS             ts;

  PetscCall(PetscInitialize(&argc, &argv, NULL, NULL));
  PetscCall(PetscOptionsGetInt(NULL, NULL, "-n", &n, NULL));
  PetscCall(DMDACreate3d(PETSC_COMM_WORLD, DM_BOUNDARY_NONE, DM_BOUNDARY_NONE, DM_BOUNDARY_NONE, DMDA_STENCIL_STAR, n, n, n, PETSC_DECIDE,
                         PETSC_DECIDE, PETSC_DECIDE, 1, 1, NULL, NULL, NULL, &grid));
  PetscCall(DMSetUp(grid));
  PetscCall(DMSetMatType(grid, MATAIJ));
  PetscCall(DMCreateMatrix(grid, &K));
  PetscCall(Springs(grid, n, K));
  PetscCall(MatDuplicate(K, MAT_COPY_VALUES, &J));
  PetscCall(DMCreateGlobalVector(grid, &U));
  PetscCall(VecDuplicate(U, &V));
  PetscCall(VecSet(U, 1)); /* all together: cos(t) */
  PetscCall(TSCreate(PETSC_COMM_WORLD, &ts));
  PetscCall(TSSetType(ts, "hhtdae"));
  PetscCall(TSSetI2Function(ts, NULL, Residual, K));
  PetscCall(TSSetI2Jacobian(ts, J, J, Jacobian, K));
  PetscCall(TS2SetSolution(ts, U, V));
  PetscCall(TSSetMaxTime(ts, 2));
  PetscCall(TSSetExactFinalTime(ts, TS_EXACTFINALTIME_MATCHSTEP));
  PetscCall(TSSetFromOptions(ts));
  PetscCall(TSSolve(ts, U));
  PetscCall(VecShift(U, -PetscCosReal(2)));
  PetscReal error;
  PetscCall(VecNorm(U, NORM_INFINITY, &error));
  PetscCall(PetscPrintf(PETSC_COMM_WORLD, "error %g\n", (double)error));
  PetscCall(TSDestroy(&ts));
  PetscCall(VecDestroy(&U));
  PetscCall(VecDestroy(&V));
  PetscCall(MatDestroy(&J));
  PetscCall(MatDestroy(&K));
  PetscCall(DMDestroy(&grid));
  return PetscFinalize();
}
