#include "fine.h"
#include <algorithm>
#include <cmath>
#include <petsc/private/pcimpl.h>

namespace
{

/* ---- nodes ---- */

/* Inverse of a 3 x 3 matrix by rows, by cofactors; false where it has none */
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
  f->inverse.resize(9 * nodes.alone.size());
  for (size_t n = 0; n < nodes.alone.size(); n++) {
    const PetscInt first = nodes.alone[n];
    double         block[9] = {};
    for (PetscInt r = 0; r < 3; r++)
      PetscCall(A.forRow(first + r, [&](PetscInt c, PetscScalar v) {
        if (c >= first && c < first + 3) block[3 * r + c - first] = PetscRealPart(v);
      }));
    if (!Invert(block, &f->inverse[9 * n])) *failed = PETSC_TRUE;
  }
  PetscFunctionReturn(0);
}

/* ---- all else ---- */

PetscErrorCode Number(Mat A, const LocalRows &rows, const MatrixNodes &nodes, FineLevel *f)
{
  const PetscInt n = (PetscInt)nodes.apart.size();
  PetscInt       end;

  PetscFunctionBegin;
  PetscCallMPI(MPI_Scan(&n, &end, 1, MPIU_INT, MPI_SUM, PetscObjectComm((PetscObject)A)));
  f->number.assign((size_t)rows.own, -1);
  for (PetscInt k = 0; k < n; k++) f->number[(size_t)nodes.apart[(size_t)k]] = end - n + k;
  PetscCall(LinearFetchColumns(A, rows, &f->number));
  PetscFunctionReturn(0);
}

/* use(row, its columns and values) for every row of the matrix `apart`, by its numbers */
template <class Use> PetscErrorCode ForRows(const LocalRows &A, const MatrixNodes &nodes, const FineLevel &f, Use use)
{
  std::vector<PetscInt>    cols;
  std::vector<PetscScalar> values;

  PetscFunctionBegin;
  for (PetscInt i : nodes.apart) {
    cols.clear();
    values.clear();
    PetscCall(A.forRow(i, [&](PetscInt c, PetscScalar v) {
      if (!EntryStays(nodes.node[(size_t)i], nodes.node[(size_t)c])) return;
      cols.push_back(f.number[(size_t)c]);
      values.push_back(v);
    }));
    PetscCall(use(f.number[(size_t)i], cols, values));
  }
  PetscFunctionReturn(0);
}

PetscErrorCode DestroyApart(FineLevel *f)
{
  PetscFunctionBegin;
  PetscCall(MatDestroy(&f->apart));
  PetscCall(VecDestroy(&f->b));
  PetscCall(VecDestroy(&f->x));
  PetscCall(InnerDestroy(&f->inner));
  PetscFunctionReturn(0);
}

PetscErrorCode CreateApart(Mat A, const LocalRows &rows, const MatrixNodes &nodes, FineLevel *f)
{
  const PetscInt        n = (PetscInt)nodes.apart.size();
  PetscInt              all;
  std::vector<PetscInt> diagonal, off;

  PetscFunctionBegin;
  PetscCall(DestroyApart(f));
  PetscCallMPI(MPI_Allreduce(&n, &all, 1, MPIU_INT, MPI_SUM, PetscObjectComm((PetscObject)A)));
  if (!all) PetscFunctionReturn(0);
  PetscCall(Number(A, rows, nodes, f));
  const PetscInt begin = n ? f->number[(size_t)nodes.apart[0]] : 0;
  PetscCall(ForRows(rows, nodes, *f, [&](PetscInt, const std::vector<PetscInt> &col, const std::vector<PetscScalar> &) -> PetscErrorCode {
    PetscInt own = 0;
    for (PetscInt j : col) own += j >= begin && j < begin + n;
    diagonal.push_back(own);
    off.push_back((PetscInt)col.size() - own);
    return 0;
  }));
  PetscCall(MatCreateAIJ(PetscObjectComm((PetscObject)A), n, n, all, all, 0, diagonal.data(), 0, off.data(), &f->apart));
  PetscCall(MatSetOption(f->apart, MAT_NO_OFF_PROC_ENTRIES, PETSC_TRUE));
  PetscCall(MatCreateVecs(f->apart, &f->x, &f->b));
  PetscFunctionReturn(0);
}

PetscErrorCode FillApart(const LocalRows &rows, const MatrixNodes &nodes, FineLevel *f)
{
  PetscFunctionBegin;
  PetscCall(ForRows(rows, nodes, *f, [&](PetscInt i, const std::vector<PetscInt> &col, const std::vector<PetscScalar> &value) -> PetscErrorCode {
    PetscFunctionBegin;
    PetscCall(MatSetValues(f->apart, 1, &i, (PetscInt)col.size(), col.data(), value.data(), INSERT_VALUES));
    PetscFunctionReturn(0);
  }));
  PetscCall(MatAssemblyBegin(f->apart, MAT_FINAL_ASSEMBLY));
  PetscCall(MatAssemblyEnd(f->apart, MAT_FINAL_ASSEMBLY));
  PetscFunctionReturn(0);
}

} // namespace

PetscErrorCode FineDestroy(FineLevel *f)
{
  PetscFunctionBegin;
  PetscCall(DestroyApart(f));
  *f = FineLevel();
  PetscFunctionReturn(0);
}

PetscErrorCode FineFill(PC pc, const MatrixNodes &nodes, PetscBool nodes_alone, PetscBool fresh, FineLevel *f, PetscBool *failed)
{
  LocalRows rows;
  PetscBool apart_failed = PETSC_FALSE;

  PetscFunctionBegin;
  PetscCall(LinearLocalRows(pc->pmat, &rows));
  PetscCall(FillInverses(rows, nodes, f, failed));
  if (nodes_alone) PetscCall(DestroyApart(f));
  else if (fresh || !f->apart) PetscCall(CreateApart(pc->pmat, rows, nodes, f));
  if (!f->apart) PetscFunctionReturn(0);
  PetscCall(FillApart(rows, nodes, f));
  PetscCall(InnerSetUp(pc, "constraint_", f->apart, &f->inner, &apart_failed));
  *failed = (PetscBool)(*failed || apart_failed);
  PetscFunctionReturn(0);
}

PetscErrorCode FineSaveState(const FineLevel &f, Archive *archive)
{
  PetscFunctionBegin;
  if (f.apart) PetscCall(InnerSaveState(f.inner, archive));
  PetscFunctionReturn(0);
}

PetscErrorCode FineLoadState(PC pc, FineLevel *f, Archive *archive, PetscBool *same, PetscBool *failed)
{
  PetscFunctionBegin;
  *same   = PETSC_TRUE;
  *failed = PETSC_FALSE;
  if (f->apart) PetscCall(InnerLoadState(pc, "constraint_", f->apart, &f->inner, archive, same, failed));
  PetscFunctionReturn(0);
}

PetscErrorCode FineSolve(FineLevel *f, const MatrixNodes &nodes, Vec x, Vec y, PetscBool *failed)
{
  const PetscScalar *from, *solved;
  PetscScalar       *to, *b;

  PetscFunctionBegin;
  *failed = PETSC_FALSE;
  PetscCall(VecGetArrayRead(x, &from));
  if (f->apart) {
    PetscCall(VecGetArrayWrite(f->b, &b));
    for (size_t k = 0; k < nodes.apart.size(); k++) b[k] = from[nodes.apart[k]];
    PetscCall(VecRestoreArrayWrite(f->b, &b));
    PetscCall(InnerSolve(&f->inner, f->b, f->x, failed));
  }
  PetscCall(VecGetArrayWrite(y, &to));
  for (size_t n = 0; n < nodes.alone.size(); n++) {
    const float       *a = &f->inverse[9 * n];
    const PetscScalar *r = from + nodes.alone[n];
    for (int i = 0; i < 3; i++) to[nodes.alone[n] + i] = a[3 * i] * r[0] + a[3 * i + 1] * r[1] + a[3 * i + 2] * r[2];
  }
  if (f->apart) {
    PetscCall(VecGetArrayRead(f->x, &solved));
    for (size_t k = 0; k < nodes.apart.size(); k++) to[nodes.apart[k]] = solved[k];
    PetscCall(VecRestoreArrayRead(f->x, &solved));
  } else
    for (PetscInt row : nodes.apart) to[row] = 0;
  PetscCall(VecRestoreArrayWrite(y, &to));
  PetscCall(VecRestoreArrayRead(x, &from));
  PetscFunctionReturn(0);
}
