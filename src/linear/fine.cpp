/* The fine level of "hhtconstraint", fine.h */
#include "fine.h"
#include <algorithm>
#include <cmath>
#include <petsc/private/pcimpl.h>

namespace
{

/* ---- nodes ---- */

/* Inverts a 3 x 3 matrix, stored by rows, by cofactors; false if it is singular or the inverse overflows single precision */
bool Invert(const double a[9], float inverse[9])
{
  double c[9];
  for (int i = 0; i < 3; i++)
    for (int j = 0; j < 3; j++) {
      const int k = (i + 1) % 3, l = (i + 2) % 3, m = (j + 1) % 3, n = (j + 2) % 3;
      c[3 * j + i] = a[3 * k + m] * a[3 * l + n] - a[3 * k + n] * a[3 * l + m];
    }
  const double det = a[0] * c[0] + a[1] * c[3] + a[2] * c[6];
  if (det == 0) return false;
  for (int i = 0; i < 9; i++) {
    inverse[i] = (float)(c[i] / det);
    if (!std::isfinite(inverse[i])) return false;
  }
  return true;
}

PetscErrorCode FillInverses(const LocalRows &A, const MatrixNodes &nodes, FineLevel *f, PetscBool *failed)
{
  PetscFunctionBegin;
  *failed = PETSC_FALSE;
  f->inverse.resize(9 * nodes.node_blocks.size());
  for (size_t n = 0; n < nodes.node_blocks.size(); n++) {
    const PetscInt first    = nodes.node_blocks[n];
    double         block[9] = {};
    for (PetscInt r = 0; r < 3; r++)
      PetscCall(A.forRow(first + r, [&](PetscInt c, PetscScalar v) {
        if (c >= first && c < first + 3) block[3 * r + c - first] = PetscRealPart(v);
      }));
    if (!Invert(block, &f->inverse[9 * n])) *failed = PETSC_TRUE;
  }
  PetscFunctionReturn(0);
}

/* ---- the other rows ---- */

PetscErrorCode NumberRest(Mat A, const LocalRows &rows, const MatrixNodes &nodes, FineLevel *f)
{
  const PetscInt n = (PetscInt)nodes.other_rows.size();
  PetscInt       end;

  PetscFunctionBegin;
  PetscCallMPI(MPI_Scan(&n, &end, 1, MPIU_INT, MPI_SUM, PetscObjectComm((PetscObject)A)));
  f->number.assign((size_t)rows.own, -1);
  for (PetscInt k = 0; k < n; k++) f->number[(size_t)nodes.other_rows[(size_t)k]] = end - n + k;
  PetscCall(LinearFetchColumns(A, rows, &f->number));
  PetscFunctionReturn(0);
}

/* Calls use(row, columns, values) for every row of the matrix `rest`, with its row and column numbers */
template <class Use> PetscErrorCode ForRows(const LocalRows &A, const MatrixNodes &nodes, const FineLevel &f, Use use)
{
  std::vector<PetscInt>    cols;
  std::vector<PetscScalar> values;

  PetscFunctionBegin;
  for (PetscInt i : nodes.other_rows) {
    cols.clear();
    values.clear();
    PetscCall(A.forRow(i, [&](PetscInt c, PetscScalar v) {
      if (!IsKept(nodes.node[(size_t)i], nodes.node[(size_t)c])) return;
      cols.push_back(f.number[(size_t)c]);
      values.push_back(v);
    }));
    PetscCall(use(f.number[(size_t)i], cols, values));
  }
  PetscFunctionReturn(0);
}

PetscErrorCode DestroyRest(FineLevel *f)
{
  PetscFunctionBegin;
  PetscCall(MatDestroy(&f->rest));
  PetscCall(VecDestroy(&f->b));
  PetscCall(VecDestroy(&f->x));
  PetscCall(InnerDestroy(&f->inner));
  PetscFunctionReturn(0);
}

PetscErrorCode CreateRest(Mat A, const LocalRows &rows, const MatrixNodes &nodes, FineLevel *f)
{
  const PetscInt        n = (PetscInt)nodes.other_rows.size();
  PetscInt              all;
  std::vector<PetscInt> diagonal, off;

  PetscFunctionBegin;
  PetscCall(DestroyRest(f));
  PetscCallMPI(MPI_Allreduce(&n, &all, 1, MPIU_INT, MPI_SUM, PetscObjectComm((PetscObject)A)));
  if (!all) PetscFunctionReturn(0);
  PetscCall(NumberRest(A, rows, nodes, f));
  const PetscInt begin = n ? f->number[(size_t)nodes.other_rows[0]] : 0;
  PetscCall(ForRows(rows, nodes, *f, [&](PetscInt, const std::vector<PetscInt> &col, const std::vector<PetscScalar> &) -> PetscErrorCode {
    PetscInt own = 0;
    for (PetscInt j : col) own += j >= begin && j < begin + n;
    diagonal.push_back(own);
    off.push_back((PetscInt)col.size() - own);
    return 0;
  }));
  PetscCall(MatCreateAIJ(PetscObjectComm((PetscObject)A), n, n, all, all, 0, diagonal.data(), 0, off.data(), &f->rest));
  PetscCall(MatSetOption(f->rest, MAT_NO_OFF_PROC_ENTRIES, PETSC_TRUE));
  PetscCall(MatCreateVecs(f->rest, &f->x, &f->b));
  PetscFunctionReturn(0);
}

PetscErrorCode FillRest(const LocalRows &rows, const MatrixNodes &nodes, FineLevel *f)
{
  PetscFunctionBegin;
  PetscCall(ForRows(rows, nodes, *f, [&](PetscInt i, const std::vector<PetscInt> &col, const std::vector<PetscScalar> &value) -> PetscErrorCode {
    PetscFunctionBegin;
    PetscCall(MatSetValues(f->rest, 1, &i, (PetscInt)col.size(), col.data(), value.data(), INSERT_VALUES));
    PetscFunctionReturn(0);
  }));
  PetscCall(MatAssemblyBegin(f->rest, MAT_FINAL_ASSEMBLY));
  PetscCall(MatAssemblyEnd(f->rest, MAT_FINAL_ASSEMBLY));
  PetscFunctionReturn(0);
}

} // namespace

PetscErrorCode FineDestroy(FineLevel *f)
{
  PetscFunctionBegin;
  PetscCall(DestroyRest(f));
  *f = FineLevel();
  PetscFunctionReturn(0);
}

PetscErrorCode FineFill(PC pc, const MatrixNodes &nodes, PetscBool blocks_only, PetscBool fresh, FineLevel *f, PetscBool *failed)
{
  LocalRows rows;
  PetscBool rest_failed = PETSC_FALSE;

  PetscFunctionBegin;
  PetscCall(LinearLocalRows(pc->pmat, &rows));
  PetscCall(FillInverses(rows, nodes, f, failed));
  if (blocks_only) PetscCall(DestroyRest(f));
  else if (fresh || !f->rest) PetscCall(CreateRest(pc->pmat, rows, nodes, f));
  if (!f->rest) PetscFunctionReturn(0);
  PetscCall(FillRest(rows, nodes, f));
  PetscCall(InnerSetUp(pc, "constraint_", f->rest, &f->inner, &rest_failed));
  *failed = (PetscBool)(*failed || rest_failed);
  PetscFunctionReturn(0);
}

PetscErrorCode FineSaveState(const FineLevel &f, Archive *archive)
{
  PetscFunctionBegin;
  if (f.rest) PetscCall(InnerSaveState(f.inner, archive));
  PetscFunctionReturn(0);
}

PetscErrorCode FineLoadState(PC pc, FineLevel *f, Archive *archive, PetscBool *same, PetscBool *failed)
{
  PetscFunctionBegin;
  *same   = PETSC_TRUE;
  *failed = PETSC_FALSE;
  if (f->rest) PetscCall(InnerLoadState(pc, "constraint_", f->rest, &f->inner, archive, same, failed));
  PetscFunctionReturn(0);
}

PetscErrorCode FineSolve(FineLevel *f, const MatrixNodes &nodes, Vec x, Vec y, PetscBool *failed)
{
  const PetscScalar *from, *solved;
  PetscScalar       *to, *b;

  PetscFunctionBegin;
  *failed = PETSC_FALSE;
  PetscCall(VecGetArrayRead(x, &from));
  if (f->rest) {
    PetscCall(VecGetArrayWrite(f->b, &b));
    for (size_t k = 0; k < nodes.other_rows.size(); k++) b[k] = from[nodes.other_rows[k]];
    PetscCall(VecRestoreArrayWrite(f->b, &b));
    PetscCall(InnerSolve(&f->inner, f->b, f->x, failed));
  }
  PetscCall(VecGetArrayWrite(y, &to));
  for (size_t n = 0; n < nodes.node_blocks.size(); n++) {
    const float       *a = &f->inverse[9 * n];
    const PetscScalar *r = from + nodes.node_blocks[n];
    for (int i = 0; i < 3; i++) to[nodes.node_blocks[n] + i] = a[3 * i] * r[0] + a[3 * i + 1] * r[1] + a[3 * i + 2] * r[2];
  }
  if (f->rest) {
    PetscCall(VecGetArrayRead(f->x, &solved));
    for (size_t k = 0; k < nodes.other_rows.size(); k++) to[nodes.other_rows[k]] = solved[k];
    PetscCall(VecRestoreArrayRead(f->x, &solved));
  } else
    for (PetscInt row : nodes.other_rows) to[row] = 0;
  PetscCall(VecRestoreArrayWrite(y, &to));
  PetscCall(VecRestoreArrayRead(x, &from));
  PetscFunctionReturn(0);
}
