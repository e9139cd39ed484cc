/*
  Residual and Jacobian of a TS for equations of motion that were traced into a tape; they are evaluated without Python. U is (q, lambda). The
  arguments of the tape are t, U, U', U''; its outputs are the residual, then the nonzero entries of dF/dU, dF/dU', dF/dU''.
*/
#include "bind.h"
#include "tape.h"
#include <algorithm>

namespace hhtdae
{
namespace python
{

namespace
{

struct Equations {
  std::shared_ptr<Tape> residual, jacobian;
  PetscInt              n;
  std::vector<PetscInt> row[3], column[3]; /* row and column of the entries of each of the three matrices */
  std::vector<double>   u, out;

  /* Concatenates t and the three vectors in u */
  PetscErrorCode gather(PetscReal t, Vec U, Vec V, Vec A)
  {
    const PetscScalar *x;
    PetscFunctionBegin;
    u[0] = t;
    Vec W[3] = {U, V, A};
    for (int k = 0; k < 3; k++) {
      PetscCall(VecGetArrayRead(W[k], &x));
      std::copy(x, x + n, u.begin() + 1 + k * n);
      PetscCall(VecRestoreArrayRead(W[k], &x));
    }
    PetscFunctionReturn(0);
  }
};

/* Evaluates a tape; it may contain callbacks to Python functions, which may raise exceptions */
template <class F> PetscErrorCode Safely(F f)
{
  PetscFunctionBegin;
  try {
    f();
  } catch (const std::exception &e) {
    SETERRQ(PETSC_COMM_SELF, PETSC_ERR_USER, "The equations of motion have failed: %s", e.what());
  }
  PetscFunctionReturn(0);
}

PetscErrorCode Residual(TS, PetscReal t, Vec U, Vec V, Vec A, Vec F, void *ctx)
{
  Equations   &e = *static_cast<Equations *>(ctx);
  PetscScalar *f;
  PetscFunctionBegin;
  PetscCall(e.gather(t, U, V, A));
  PetscCall(VecGetArrayWrite(F, &f));
  PetscCall(Safely([&] { e.residual->evaluate(e.u.data(), f); }));
  PetscCall(VecRestoreArrayWrite(F, &f));
  PetscFunctionReturn(0);
}

PetscErrorCode Jacobian(TS, PetscReal t, Vec U, Vec V, Vec A, PetscReal sv, PetscReal sa, Mat J, Mat P, void *ctx)
{
  Equations   &e         = *static_cast<Equations *>(ctx);
  const double factor[3] = {1, sv, sa};
  std::size_t  k         = 0;
  PetscFunctionBegin;
  PetscCall(e.gather(t, U, V, A));
  e.out.resize(e.jacobian->outputs.size());
  PetscCall(Safely([&] { e.jacobian->evaluate(e.u.data(), e.out.data()); }));
  PetscCall(MatZeroEntries(P));
  for (int m = 0; m < 3; m++)
    for (std::size_t l = 0; l < e.row[m].size(); l++) PetscCall(MatSetValue(P, e.row[m][l], e.column[m][l], factor[m] * e.out[k++], ADD_VALUES));
  PetscCall(MatAssemblyBegin(P, MAT_FINAL_ASSEMBLY));
  PetscCall(MatAssemblyEnd(P, MAT_FINAL_ASSEMBLY));
  if (J != P) {
    PetscCall(MatAssemblyBegin(J, MAT_FINAL_ASSEMBLY));
    PetscCall(MatAssemblyEnd(J, MAT_FINAL_ASSEMBLY));
  }
  PetscFunctionReturn(0);
}

/* Creates J with the nonzeros of all three matrices and of the diagonal, which factorizations require */
PetscErrorCode Pattern(const Equations &e, Mat *J)
{
  PetscFunctionBegin;
  PetscCall(MatCreateSeqAIJ(PETSC_COMM_SELF, e.n, e.n, e.n, nullptr, J));
  for (PetscInt k = 0; k < e.n; k++) PetscCall(MatSetValue(*J, k, k, 0, INSERT_VALUES));
  for (int m = 0; m < 3; m++)
    for (std::size_t l = 0; l < e.row[m].size(); l++) PetscCall(MatSetValue(*J, e.row[m][l], e.column[m][l], 0, INSERT_VALUES));
  PetscCall(MatAssemblyBegin(*J, MAT_FINAL_ASSEMBLY));
  PetscCall(MatAssemblyEnd(*J, MAT_FINAL_ASSEMBLY));
  PetscFunctionReturn(0);
}

PetscErrorCode SetEquations(TS ts, Equations *e)
{
  Mat J;
  Vec F;
  PetscFunctionBegin;
  PetscCall(OwnedBy((PetscObject)ts, "hhtdae python equations", e));
  PetscCall(Pattern(*e, &J));
  PetscCall(MatCreateVecs(J, nullptr, &F));
  PetscCall(TSSetI2Function(ts, F, Residual, e));
  PetscCall(TSSetI2Jacobian(ts, J, J, Jacobian, e));
  PetscCall(MatDestroy(&J));
  PetscCall(VecDestroy(&F));
  PetscFunctionReturn(0);
}

} // namespace

void BindMechanism(py::module_ &m)
{
  m.def("set_equations", [](py::object ts, PetscInt n, std::shared_ptr<Tape> residual, std::shared_ptr<Tape> jacobian, py::list rows, py::list columns) {
    auto *e     = new Equations;
    e->residual = std::move(residual);
    e->jacobian = std::move(jacobian);
    e->n        = n;
    e->u.resize(1 + 3 * n);
    for (int k = 0; k < 3; k++) {
      for (py::handle x : py::object(rows[k])) e->row[k].push_back(x.cast<PetscInt>());
      for (py::handle x : py::object(columns[k])) e->column[k].push_back(x.cast<PetscInt>());
    }
    Check(SetEquations(ToTS(ts), e));
  });
}

} // namespace python
} // namespace hhtdae
