/* Runs whose Jacobian has a type other than MATAIJ, or whose operator is a MATSHELL beside an assembled matrix */
#ifndef HHTDAE_TESTS_MATRIX_TYPES_H
#define HHTDAE_TESTS_MATRIX_TYPES_H

#include "support.h"

namespace hhtest
{

/* The application's matrices: P has a type and a block size; J is P or a separate operator */
struct Matrices {
  MatType  type  = MATAIJ;
  PetscInt block = 1;
  enum { Same, Shell, Managed, Second } J = Same; /* Shell: PETSc scales it; Managed: a shell that scales itself; Second: another assembled matrix */
  bool assembles = true;                            /* the application assembles its operator, like PETSc's examples */
};

/* Data of the operator: a copy of P as the application computed it */
struct OperatorData {
  TSI2Jacobian f;
  void        *ctx;
  Mat          J = nullptr, values = nullptr;
  bool         assembles;
  int          other = 0; /* number of calls with an operator other than the application's */

  static PetscErrorCode product(Mat J, Vec x, Vec y)
  {
    OperatorData *d;
    PetscFunctionBegin;
    PetscCall(MatShellGetContext(J, &d));
    PetscCall(MatMult(d->values, x, y));
    PetscFunctionReturn(0);
  }
  static PetscErrorCode jacobian(TS ts, PetscReal t, Vec U, Vec V, Vec A, PetscReal sv, PetscReal sa, Mat J, Mat P, void *ctx)
  {
    auto *d = static_cast<OperatorData *>(ctx);
    PetscFunctionBegin;
    PetscCall(d->f(ts, t, U, V, A, sv, sa, P, P, d->ctx));
    if (J != d->J) d->other++;
    if (!d->values) PetscCall(MatDuplicate(P, MAT_COPY_VALUES, &d->values));
    else PetscCall(MatCopy(P, d->values, SAME_NONZERO_PATTERN));
    if (d->J != d->values && J == d->J && d->assembles) {
      PetscCall(MatAssemblyBegin(J, MAT_FINAL_ASSEMBLY));
      PetscCall(MatAssemblyEnd(J, MAT_FINAL_ASSEMBLY));
    }
    PetscFunctionReturn(0);
  }
};

/* A run with these matrices, which exist before TSSetFromOptions() */
struct MatrixRun {
  Array            u;
  TSHHT3Statistics s = {};
  std::string      pc, package, said;
  PetscErrorCode   error;
  int              other = 0;

  MatrixRun(MPI_Comm comm, const Problem &p, const Matrices &m, const std::string &options, bool setRoles = false)
  {
    Options      in(options);
    ErrorTrap    trap;
    OperatorData data;
    TS           ts;
    Vec          U, V;
    must(ProblemCreateTS(comm, p, &ts, &U, &V, setRoles));
    if (!setRoles) must(TSSetType(ts, TSHHT3));
    give(ts, m, data);
    must(TSSetFromOptions(ts));
    error = TSSolve(ts, nullptr);
    said  = trap.message;
    u     = whole(U);
    other = data.other;
    must(TSHHT3GetStatistics(ts, &s));
    if (!error) noteSolver(ts);
    must(TSDestroy(&ts));
    must(MatDestroy(&data.values));
    must(VecDestroy(&U));
    must(VecDestroy(&V));
  }
  bool says(const std::string &part) const { return said.find(part) != std::string::npos; }

private:
  void noteSolver(TS ts)
  {
    SNES          snes;
    KSP           ksp;
    PC            c;
    PCType        type;
    MatSolverType solver = nullptr;
    must(TSGetSNES(ts, &snes));
    must(SNESGetKSP(snes, &ksp));
    must(KSPGetPC(ksp, &c));
    must(PCGetType(c, &type));
    must(PCFactorGetMatSolverType(c, &solver));
    pc      = type;
    package = solver ? solver : "";
  }

  static Mat assembled(MPI_Comm comm, PetscInt n, PetscInt N, const Matrices &m)
  {
    Mat P;
    must(MatCreate(comm, &P));
    must(MatSetSizes(P, n, n, N, N));
    must(MatSetType(P, m.type));
    must(MatSetBlockSize(P, m.block));
    const std::vector<PetscInt> on((size_t)(n / m.block), n / m.block), off((size_t)(n / m.block), (N - n) / m.block);
    must(MatXAIJSetPreallocation(P, m.block, on.data(), off.data(), on.data(), off.data()));
    must(MatSetUp(P));
    PetscBool triangle;
    must(PetscObjectBaseTypeCompareAny((PetscObject)P, &triangle, MATSEQSBAIJ, MATMPISBAIJ, ""));
    if (triangle) must(MatSetOption(P, MAT_IGNORE_LOWER_TRIANGULAR, PETSC_TRUE));
    return P;
  }

  static void give(TS ts, const Matrices &m, OperatorData &data)
  {
    MPI_Comm comm = PetscObjectComm((PetscObject)ts);
    Mat      A, P, J;
    PetscInt n, N;
    must(TSGetI2Jacobian(ts, &A, nullptr, &data.f, &data.ctx));
    must(MatGetLocalSize(A, &n, nullptr));
    must(MatGetSize(A, &N, nullptr));
    P = A;
    if (std::string(m.type) == MATAIJ) must(PetscObjectReference((PetscObject)P));
    else if (std::string(m.type) == MATSHELL) must(MatCreateShell(comm, n, n, N, N, nullptr, &P));
    else if (std::string(m.type) == MATNEST) must(MatCreateNest(comm, 1, nullptr, 1, nullptr, &A, &P));
    else P = assembled(comm, n, N, m);
    if (m.J == Matrices::Same) {
      must(TSSetI2Jacobian(ts, P, P, data.f, data.ctx));
      must(MatDestroy(&P));
      return;
    }
    data.assembles = m.assembles;
    if (m.J == Matrices::Second) {
      must(MatDuplicate(P, MAT_DO_NOT_COPY_VALUES, &J));
      must(PetscObjectReference((PetscObject)J));
      data.values = J;
    } else {
      must(MatCreateShell(comm, n, n, N, N, &data, &J));
      must(MatShellSetOperation(J, MATOP_MULT, (void (*)(void))OperatorData::product));
      if (m.J == Matrices::Managed) must(MatShellSetManageScalingShifts(J));
    }
    data.J = J;
    must(TSSetI2Jacobian(ts, J, P, OperatorData::jacobian, &data));
    must(MatDestroy(&J));
    must(MatDestroy(&P));
  }
};

} // namespace hhtest

#endif
