static char help[] =
    "Orderings and packages on the Newton matrix of an elastic block: operations, memory and time of one "
    "factorization.\n"
    "  -n <20>         bricks along each edge, or -nx -ny -nz\n"
    "  -clamped <1>    one face held by multipliers (indefinite), else a free block (positive definite)\n"
    "  -only <text>    only the rows whose name contains this\n";

#include "../../src/linear/linear.h"
#include "linear_matrices.h"
#include <cstring>
#include <hhtdae/hhtdae.h>
#include <petsctime.h>

struct Candidate {
  const char *name, *pc, *package, *ordering;
  PetscInt    icntl7;        /* MUMPS' option ICNTL(7), the ordering; -1: default */
  bool        definite_only; /* SuperLU_DIST aborts the program at a zero diagonal entry */
};

static const Candidate candidates[] = {{"MUMPS LDL^T METIS", PCCHOLESKY, "mumpsnd", MATORDERINGMETISND, -1, false},
                                       {"MUMPS LDL^T METIS, pairs, or own", PCCHOLESKY, "mumpsnd", NULL, -1, false},
                                       {"MUMPS LDL^T PORD", PCCHOLESKY, "mumpsnd", NULL, 4, false},
                                       {"MUMPS LDL^T AMD", PCCHOLESKY, "mumpsnd", NULL, 0, false},
                                       {"MUMPS LDL^T AMF", PCCHOLESKY, "mumpsnd", NULL, 2, false},
                                       {"MUMPS LDL^T QAMD", PCCHOLESKY, "mumpsnd", NULL, 6, false},
                                       {"PETSc's MUMPS LDL^T", PCCHOLESKY, "mumps", NULL, -1, false},
                                       {"MUMPS LU METIS, pairs, or own", PCLU, "mumpsnd", NULL, -1, false},
                                       {"PETSc's MUMPS LU", PCLU, "mumps", NULL, -1, false},
                                       {"PETSc's MUMPS LU metisnd", PCLU, "mumps", MATORDERINGMETISND, -1, false},
                                       {"CHOLMOD", PCCHOLESKY, "cholmod", NULL, -1, true},
                                       {"UMFPACK", PCLU, "umfpack", NULL, -1, false},
                                       {"KLU metisnd", PCLU, "klu", MATORDERINGMETISND, -1, false},
                                       {"SuperLU_DIST", PCLU, "superlu_dist", NULL, -1, true}};

static PetscErrorCode print_mumps(Mat F)
{
  PetscReal foreseen, done;
  PetscInt  estimate, used, delayed;

  PetscFunctionBeginUser;
  PetscCall(MatMumpsGetRinfog(F, 1, &foreseen));
  PetscCall(MatMumpsGetRinfog(F, 3, &done));
  PetscCall(MatMumpsGetInfog(F, 13, &delayed));
  PetscCall(MatMumpsGetInfog(F, 21, &estimate));
  PetscCall(MatMumpsGetInfog(F, 22, &used));
  PetscCall(PetscPrintf(PETSC_COMM_SELF, "  %.3e %.3e operations, %d MB, %d delayed", (double)foreseen, (double)done,
                        (int)used, (int)delayed));
  PetscFunctionReturn(0);
}

static PetscErrorCode measure(Mat A, const Candidate &c)
{
  KSP            ksp;
  PC             pc;
  Mat            F;
  Vec            b, x;
  PetscLogDouble start, setup, solved;
  PetscReal      residual;
  const bool     mumps = strstr(c.package, "mumps");

  PetscFunctionBeginUser;
  PetscCall(MatCreateVecs(A, &x, &b));
  PetscCall(VecSet(b, 1.0));
  PetscCall(KSPCreate(PETSC_COMM_SELF, &ksp));
  PetscCall(KSPSetType(ksp, KSPPREONLY));
  PetscCall(KSPGetPC(ksp, &pc));
  PetscCall(PCSetType(pc, c.pc));
  PetscCall(PCFactorSetMatSolverType(pc, c.package));
  if (c.ordering) PetscCall(PCFactorSetMatOrderingType(pc, c.ordering));
  PetscCall(KSPSetOperators(ksp, A, A));
  PetscCall(PCFactorSetUpMatSolverType(pc));
  PetscCall(PCFactorGetMatrix(pc, &F));
  if (c.icntl7 >= 0) PetscCall(MatMumpsSetIcntl(F, 7, c.icntl7));
  PetscCall(PetscTime(&start));
  PetscCall(KSPSetUp(ksp));
  PetscCall(PetscTime(&setup));
  PetscCall(KSPSolve(ksp, b, x));
  PetscCall(PetscTime(&solved));
  PetscCall(VecScale(b, -1.0));
  PetscCall(MatMultAdd(A, x, b, b));
  PetscCall(VecNorm(b, NORM_INFINITY, &residual));
  PetscCall(PetscPrintf(PETSC_COMM_SELF, "%-33s %7.2f s analysis and factor, %6.3f s solve, residual %.0e", c.name,
                        setup - start, solved - setup, (double)residual));
  if (mumps) PetscCall(print_mumps(F));
  PetscCall(PetscPrintf(PETSC_COMM_SELF, "\n"));
  PetscCall(KSPDestroy(&ksp));
  PetscCall(VecDestroy(&b));
  PetscCall(VecDestroy(&x));
  PetscFunctionReturn(0);
}

int main(int argc, char **argv)
{
  PetscInt  n         = 20, nx, ny, nz;
  PetscBool clamped   = PETSC_TRUE;
  char      only[128] = "";
  Mat       A;

  PetscFunctionBeginUser;
  PetscCall(PetscInitialize(&argc, &argv, NULL, help));
  PetscCall(TSHHT3Initialize());
  PetscCall(PetscOptionsGetInt(NULL, NULL, "-n", &n, NULL));
  nx = ny = nz = n;
  PetscCall(PetscOptionsGetInt(NULL, NULL, "-nx", &nx, NULL));
  PetscCall(PetscOptionsGetInt(NULL, NULL, "-ny", &ny, NULL));
  PetscCall(PetscOptionsGetInt(NULL, NULL, "-nz", &nz, NULL));
  PetscCall(PetscOptionsGetBool(NULL, NULL, "-clamped", &clamped, NULL));
  PetscCall(PetscOptionsGetString(NULL, NULL, "-only", only, sizeof only, NULL));
  Triplets entries = block(nx, ny, nz, clamped);
  PetscCall(create_matrix(entries, &A));
  PetscCall(PetscPrintf(PETSC_COMM_SELF, "block of %d x %d x %d bricks, %s, %d unknowns\n", (int)nx, (int)ny, (int)nz,
                        clamped ? "clamped by multipliers" : "free", (int)entries.n));
  if (!clamped) PetscCall(MatSetOption(A, MAT_SPD, PETSC_TRUE));
  for (const Candidate &c : candidates) {
    PetscBool available;
    if (!strstr(c.name, only) || (c.definite_only && clamped)) continue;
    PetscCall(
        MatGetFactorAvailable(A, c.package, strcmp(c.pc, PCLU) ? MAT_FACTOR_CHOLESKY : MAT_FACTOR_LU, &available));
    if (available) PetscCall(measure(A, c));
  }
  PetscCall(MatDestroy(&A));
  PetscCall(PetscFinalize());
  return 0;
}
