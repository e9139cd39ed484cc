static char help[] = "Unit masses in a row between unit springs, in C: the first spring is held by a wall, the last mass by a constraint. They swing in one of\n"
                     "their modes; exact solution. On any number of ranks.\n"
                     "  -n <20>: masses\n"
                     "  -mode <1>: 1 to n - 1\n"
                     "  -end <20>: end time, s\n";

#include <hhtdae/hhtdae.h>

/* U = (x_1, ..., x_n, lambda): F = M U'' + K U, where the last row and column of K are those of the constraint x_n = 0, and M is zero there */
typedef struct {
  Mat K;
  Vec M;
} Chain;

static PetscErrorCode Residual(TS ts, PetscReal t, Vec U, Vec V, Vec A, Vec F, void *ctx)
{
  const Chain *chain = (const Chain *)ctx;

  PetscFunctionBeginUser;
  (void)ts, (void)t, (void)V;
  PetscCall(VecPointwiseMult(F, chain->M, A));
  PetscCall(MatMultAdd(chain->K, U, F, F));
  PetscFunctionReturn(0);
}

/* dF/dU + sv dF/dU' + sa dF/dU'' */
static PetscErrorCode Jacobian(TS ts, PetscReal t, Vec U, Vec V, Vec A, PetscReal sv, PetscReal sa, Mat J, Mat P, void *ctx)
{
  const Chain *chain = (const Chain *)ctx;
  Vec          diagonal;

  PetscFunctionBeginUser;
  (void)ts, (void)t, (void)U, (void)V, (void)A, (void)sv, (void)J;
  PetscCall(MatCopy(chain->K, P, SAME_NONZERO_PATTERN));
  PetscCall(VecDuplicate(chain->M, &diagonal));
  PetscCall(VecCopy(chain->M, diagonal));
  PetscCall(VecScale(diagonal, sa));
  PetscCall(MatDiagonalSet(P, diagonal, ADD_VALUES));
  PetscCall(VecDestroy(&diagonal));
  PetscFunctionReturn(0);
}

static PetscErrorCode Create(PetscInt n, Chain *chain)
{
  PetscInt first, end;

  PetscFunctionBeginUser;
  PetscCall(MatCreateAIJ(PETSC_COMM_WORLD, PETSC_DECIDE, PETSC_DECIDE, n + 1, n + 1, 3, NULL, 3, NULL, &chain->K));
  PetscCall(MatCreateVecs(chain->K, &chain->M, NULL));
  PetscCall(VecSet(chain->M, 1));
  PetscCall(MatGetOwnershipRange(chain->K, &first, &end));
  for (PetscInt i = first; i < end; i++) {
    const PetscInt    columns[3] = {i - 1, i, i + 1}; /* negative ones are left out */
    const PetscScalar mass[3] = {-1, 2, -1}, last[3] = {-1, 1, 1}, constraint[2] = {1, 0};

    if (i < n - 1) PetscCall(MatSetValues(chain->K, 1, &i, 3, columns, mass, INSERT_VALUES));
    else if (i == n - 1) PetscCall(MatSetValues(chain->K, 1, &i, 3, columns, last, INSERT_VALUES));
    else {
      PetscCall(MatSetValues(chain->K, 1, &i, 2, columns, constraint, INSERT_VALUES));
      PetscCall(VecSetValue(chain->M, i, 0, INSERT_VALUES));
    }
  }
  PetscCall(MatAssemblyBegin(chain->K, MAT_FINAL_ASSEMBLY));
  PetscCall(MatAssemblyEnd(chain->K, MAT_FINAL_ASSEMBLY));
  PetscCall(VecAssemblyBegin(chain->M));
  PetscCall(VecAssemblyEnd(chain->M));
  PetscFunctionReturn(0);
}

/* x_i = sin(i k pi / n) cos(omega t), omega = 2 sin(k pi / (2 n)); the force that holds the last mass is that of its spring, x_{n-1} */
static PetscErrorCode Exact(PetscInt n, PetscInt mode, PetscReal t, Vec U)
{
  const PetscReal angle = mode * PETSC_PI / n, now = PetscCosReal(2 * PetscSinReal(angle / 2) * t);
  PetscInt        first, end;

  PetscFunctionBeginUser;
  PetscCall(VecGetOwnershipRange(U, &first, &end));
  for (PetscInt i = first; i < end; i++) PetscCall(VecSetValue(U, i, now * PetscSinReal((i < n ? i + 1 : n - 1) * angle), INSERT_VALUES));
  PetscCall(VecAssemblyBegin(U));
  PetscCall(VecAssemblyEnd(U));
  PetscFunctionReturn(0);
}

/* Largest errors of the positions and of the multiplier */
static PetscErrorCode Report(TS ts, PetscInt n, PetscInt mode, Vec U)
{
  PetscReal t, error[2] = {0, 0};
  PetscInt  first, end;
  Vec       exact;
  const PetscScalar *u, *e;

  PetscFunctionBeginUser;
  PetscCall(TSGetSolveTime(ts, &t));
  PetscCall(VecDuplicate(U, &exact));
  PetscCall(Exact(n, mode, t, exact));
  PetscCall(VecGetOwnershipRange(U, &first, &end));
  PetscCall(VecGetArrayRead(U, &u));
  PetscCall(VecGetArrayRead(exact, &e));
  for (PetscInt i = first; i < end; i++) error[i == n] = PetscMax(error[i == n], PetscAbsScalar(u[i - first] - e[i - first]));
  PetscCall(VecRestoreArrayRead(exact, &e));
  PetscCall(VecRestoreArrayRead(U, &u));
  PetscCall(VecDestroy(&exact));
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, error, 2, MPIU_REAL, MPIU_MAX, PETSC_COMM_WORLD));
  PetscCall(PetscPrintf(PETSC_COMM_WORLD, "t = %g: errors of the positions %.3g, of the force on the last mass %.3g\n", (double)t, (double)error[0], (double)error[1]));
  PetscFunctionReturn(0);
}

int main(int argc, char **argv)
{
  PetscInt  n = 20, mode = 1;
  PetscReal end = 20;
  Chain     chain;
  Mat       J;
  Vec       U, V;
  TS        ts;

  PetscFunctionBeginUser;
  PetscCall(PetscInitialize(&argc, &argv, NULL, help));
  PetscCall(TSHHT3Initialize());
  PetscCall(PetscOptionsGetInt(NULL, NULL, "-n", &n, NULL));
  PetscCall(PetscOptionsGetInt(NULL, NULL, "-mode", &mode, NULL));
  PetscCall(PetscOptionsGetReal(NULL, NULL, "-end", &end, NULL));
  PetscCheck(n >= 2 && mode >= 1 && mode < n, PETSC_COMM_WORLD, PETSC_ERR_ARG_OUTOFRANGE, "-n is at least 2, -mode 1 to n - 1");
  PetscCall(Create(n, &chain));
  PetscCall(MatDuplicate(chain.K, MAT_COPY_VALUES, &J));
  PetscCall(VecDuplicate(chain.M, &U));
  PetscCall(VecDuplicate(U, &V)); /* at rest */
  PetscCall(Exact(n, mode, 0, U)); /* the initial value of the multiplier does not matter */
  PetscCall(TSCreate(PETSC_COMM_WORLD, &ts));
  PetscCall(TSSetType(ts, TSHHT3));
  PetscCall(TSSetI2Function(ts, NULL, Residual, &chain));
  PetscCall(TSSetI2Jacobian(ts, J, J, Jacobian, &chain));
  PetscCall(TS2SetSolution(ts, U, V));
  PetscCall(TSSetMaxTime(ts, end));
  PetscCall(TSSetExactFinalTime(ts, TS_EXACTFINALTIME_MATCHSTEP));
  PetscCall(TSSetTolerances(ts, 1e-6, NULL, 1e-6, NULL));
  PetscCall(TSSetFromOptions(ts));
  PetscCall(TSSolve(ts, U));
  PetscCall(Report(ts, n, mode, U));
  PetscCall(TSDestroy(&ts));
  PetscCall(VecDestroy(&U));
  PetscCall(VecDestroy(&V));
  PetscCall(MatDestroy(&J));
  PetscCall(VecDestroy(&chain.M));
  PetscCall(MatDestroy(&chain.K));
  PetscCall(PetscFinalize());
  return 0;
}
