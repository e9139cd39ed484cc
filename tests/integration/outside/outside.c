/* A program outside the project, in C: a mass that slides along a line, x'' = -x + constraint force, y = 2 x.
   With lambda eliminated, 5 x'' = -x; the exact solution is x = cos(t / sqrt 5). */
#include <hhtdae/hhtdae.h>

static PetscErrorCode Residual(TS ts, PetscReal t, Vec U, Vec V, Vec A, Vec F, void *ctx)
{
  const PetscScalar *u, *a;
  PetscScalar       *f;

  PetscFunctionBeginUser;
  (void)ts, (void)t, (void)V, (void)ctx;
  PetscCall(VecGetArrayRead(U, &u));
  PetscCall(VecGetArrayRead(A, &a));
  PetscCall(VecGetArray(F, &f));
  f[0] = a[0] + u[0] + 2 * u[2];
  f[1] = a[1] - u[2];
  f[2] = 2 * u[0] - u[1];
  PetscCall(VecRestoreArrayRead(U, &u));
  PetscCall(VecRestoreArrayRead(A, &a));
  PetscCall(VecRestoreArray(F, &f));
  PetscFunctionReturn(0);
}

static PetscErrorCode Jacobian(TS ts, PetscReal t, Vec U, Vec V, Vec A, PetscReal sv, PetscReal sa, Mat J, Mat P,
                               void *ctx)
{
  const PetscInt    rows[3]   = {0, 1, 2};
  const PetscScalar values[9] = {sa + 1, 0, 2, 0, sa, -1, 2, -1, 0};

  PetscFunctionBeginUser;
  (void)ts, (void)t, (void)U, (void)V, (void)A, (void)sv, (void)ctx;
  PetscCall(MatSetValues(P, 3, rows, 3, rows, values, INSERT_VALUES));
  PetscCall(MatAssemblyBegin(P, MAT_FINAL_ASSEMBLY));
  PetscCall(MatAssemblyEnd(P, MAT_FINAL_ASSEMBLY));
  if (J != P) {
    PetscCall(MatAssemblyBegin(J, MAT_FINAL_ASSEMBLY));
    PetscCall(MatAssemblyEnd(J, MAT_FINAL_ASSEMBLY));
  }
  PetscFunctionReturn(0);
}

static PetscErrorCode Solve(TS ts)
{
  const PetscReal    end = 3;
  Mat                J;
  Vec                U, V, F;
  TSType             type;
  const PetscScalar *u;
  TSHHT3Statistics   statistics;

  PetscFunctionBeginUser;
  PetscCall(MatCreateSeqAIJ(PETSC_COMM_SELF, 3, 3, 3, NULL, &J));
  PetscCall(MatCreateVecs(J, &U, &F));
  PetscCall(VecDuplicate(U, &V));
  PetscCall(VecSetValue(U, 0, 1, INSERT_VALUES));
  PetscCall(VecSetValue(U, 1, 2, INSERT_VALUES));
  PetscCall(VecAssemblyBegin(U));
  PetscCall(VecAssemblyEnd(U));
  PetscCall(TSSetType(ts, TSHHT3));
  PetscCall(TSHHT3SetAlpha(ts, -0.1));
  PetscCall(TSSetI2Function(ts, F, Residual, NULL));
  PetscCall(TSSetI2Jacobian(ts, J, J, Jacobian, NULL));
  PetscCall(TS2SetSolution(ts, U, V));
  PetscCall(TSSetTimeStep(ts, 1e-3));
  PetscCall(TSSetMaxTime(ts, end));
  PetscCall(TSSetExactFinalTime(ts, TS_EXACTFINALTIME_MATCHSTEP));
  PetscCall(TSSetTolerances(ts, 1e-7, NULL, 0, NULL));
  PetscCall(TSSetFromOptions(ts));
  PetscCall(TSSolve(ts, NULL));
  PetscCall(TSGetType(ts, &type));
  PetscCall(TSHHT3GetStatistics(ts, &statistics));
  PetscCall(VecGetArrayRead(U, &u));
  PetscCall(PetscPrintf(PETSC_COMM_SELF, "type %s steps %" PetscInt_FMT " error %g\n", type, statistics.steps,
                        (double)PetscAbsReal(u[0] - PetscCosReal(end / PetscSqrtReal(5)))));
  PetscCall(VecRestoreArrayRead(U, &u));
  PetscCall(MatDestroy(&J));
  PetscCall(VecDestroy(&U));
  PetscCall(VecDestroy(&V));
  PetscCall(VecDestroy(&F));
  PetscFunctionReturn(0);
}

int main(int argc, char **argv)
{
  TS ts;

  PetscFunctionBeginUser;
  PetscCall(PetscInitialize(&argc, &argv, NULL, NULL));
  PetscCall(TSHHT3Initialize());
  PetscCall(TSCreate(PETSC_COMM_SELF, &ts));
  PetscCall(Solve(ts));
  PetscCall(TSDestroy(&ts));
  PetscCall(PetscFinalize());
  return 0;
}
