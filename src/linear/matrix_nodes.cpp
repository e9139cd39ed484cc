#include "matrix_nodes.h"
#include "constraint.h"
#include <algorithm>

namespace
{

PetscErrorCode ReadNodes(const LocalRows &A, IS is, MatrixNodes *c)
{
  PetscInt        n, size, least, most;
  const PetscInt  begin = A.begin, end = A.begin + A.own;
  const PetscInt *row;

  PetscFunctionBegin;
  PetscCall(ISGetLocalSize(is, &n));
  PetscCall(ISGetBlockSize(is, &size));
  PetscCall(ISGetIndices(is, &row));
  least             = n ? *std::min_element(row, row + n) : begin;
  most              = n ? *std::max_element(row, row + n) : begin;
  c->three_unknowns = size == 3;
  for (PetscInt k = 0; k < n && least >= begin && most < end; k++) {
    c->node[(size_t)(row[k] - begin)] = row[k - k % size];
    if (row[k] != row[k - k % size] + k % size) c->three_unknowns = false;
  }
  c->count = n / size;
  PetscCall(ISRestoreIndices(is, &row));
  PetscCheck(!n || (least >= begin && most < end), PETSC_COMM_SELF, PETSC_ERR_ARG_OUTOFRANGE,
             "The nodes of the matrix (" LINEAR_NODES ") have rows %" PetscInt_FMT " to %" PetscInt_FMT ", this rank has rows %" PetscInt_FMT " to %" PetscInt_FMT, least, most, begin,
             end - 1);
  PetscFunctionReturn(0);
}

/* Consecutive rows with the same pattern and nonzero diagonal entries are a node; multipliers have no diagonal entry */
PetscErrorCode NodesByPattern(const LocalRows &A, MatrixNodes *c)
{
  std::vector<PetscInt> last, now;
  PetscInt              first = -1;

  PetscFunctionBegin;
  for (PetscInt i = 0; i < A.own; i++) {
    bool diagonal = false;
    now.clear();
    PetscCall(A.forRow(i, [&](PetscInt col, PetscScalar value) {
      now.push_back(col);
      diagonal = diagonal || (col == i && value != 0);
    }));
    if (!diagonal) first = -1;
    else if (first < 0 || now != last) {
      first = A.begin + i;
      c->count++;
    }
    c->node[(size_t)i] = first;
    last.swap(now);
  }
  PetscFunctionReturn(0);
}

/* Sets `mark` to 1 in the columns in which rows of non-nodal unknowns have entries */
PetscErrorCode MarkCoupled(const LocalRows &rows, const MatrixNodes &c, Vec mark)
{
  std::vector<PetscInt> columns;

  PetscFunctionBegin;
  for (PetscInt i = 0; i < rows.own; i++)
    if (c.node[(size_t)i] < 0) PetscCall(rows.forRow(i, [&](PetscInt col, PetscScalar) { columns.push_back(rows.global(col)); }));
  std::sort(columns.begin(), columns.end());
  columns.erase(std::unique(columns.begin(), columns.end()), columns.end());
  const std::vector<PetscScalar> ones(columns.size(), 1.);
  PetscCall(VecSetValues(mark, (PetscInt)columns.size(), columns.data(), ones.data(), INSERT_VALUES));
  PetscCall(VecAssemblyBegin(mark));
  PetscCall(VecAssemblyEnd(mark));
  PetscFunctionReturn(0);
}

PetscErrorCode ClassifyRows(Mat A, const LocalRows &rows, MatrixNodes *c)
{
  Vec                mark;
  const PetscScalar *coupled;

  PetscFunctionBegin;
  PetscCall(MatCreateVecs(A, &mark, NULL));
  PetscCall(MarkCoupled(rows, *c, mark));
  PetscCall(VecGetArrayRead(mark, &coupled));
  for (PetscInt i = 0, last; i < rows.own; i = last) {
    const PetscInt first      = c->node[(size_t)i];
    bool           only_nodes = first == rows.begin + i;
    for (last = i + 1; only_nodes && last < rows.own && c->node[(size_t)last] == first;) last++;
    only_nodes = only_nodes && last == i + 3;
    for (PetscInt k = i; only_nodes && k < last; k++) {
      only_nodes = coupled[k] == 0;
      PetscCall(rows.forRow(k, [&](PetscInt col, PetscScalar) { only_nodes = only_nodes && c->node[(size_t)col] >= 0; }));
    }
    if (only_nodes) c->node_blocks.push_back(i);
    else
      for (PetscInt k = i; k < last; k++) c->other_rows.push_back(k);
  }
  PetscCall(VecRestoreArrayRead(mark, &coupled));
  PetscCall(VecDestroy(&mark));
  PetscFunctionReturn(0);
}

} // namespace

PetscErrorCode LinearFetchColumns(Mat A, const LocalRows &rows, std::vector<PetscInt> *value)
{
  Vec                mine, theirs;
  IS                 from;
  VecScatter         scatter;
  PetscScalar       *own;
  const PetscScalar *other;

  PetscFunctionBegin;
  value->resize((size_t)(rows.own + rows.others));
  if (!rows.off) PetscFunctionReturn(0);
  PetscCall(MatCreateVecs(A, &mine, NULL));
  PetscCall(VecGetArrayWrite(mine, &own));
  std::copy_n(value->begin(), rows.own, own);
  PetscCall(VecRestoreArrayWrite(mine, &own));
  PetscCall(VecCreateSeq(PETSC_COMM_SELF, rows.others, &theirs));
  PetscCall(ISCreateGeneral(PETSC_COMM_SELF, rows.others, rows.garray, PETSC_USE_POINTER, &from));
  PetscCall(VecScatterCreate(mine, from, theirs, NULL, &scatter));
  PetscCall(VecScatterBegin(scatter, mine, theirs, INSERT_VALUES, SCATTER_FORWARD));
  PetscCall(VecScatterEnd(scatter, mine, theirs, INSERT_VALUES, SCATTER_FORWARD));
  PetscCall(VecGetArrayRead(theirs, &other));
  for (PetscInt k = 0; k < rows.others; k++) (*value)[(size_t)(rows.own + k)] = (PetscInt)PetscRealPart(other[k]);
  PetscCall(VecRestoreArrayRead(theirs, &other));
  PetscCall(VecScatterDestroy(&scatter));
  PetscCall(ISDestroy(&from));
  PetscCall(VecDestroy(&theirs));
  PetscCall(VecDestroy(&mine));
  PetscFunctionReturn(0);
}

PetscErrorCode FindMatrixNodes(Mat A, MatrixNodes *c)
{
  LocalRows   rows;
  IS          is;
  PetscMPIInt three_unknowns;

  PetscFunctionBegin;
  *c = MatrixNodes();
  PetscCall(LinearLocalRows(A, &rows));
  c->node.assign((size_t)rows.own, -1);
  PetscCall(PetscObjectQuery((PetscObject)A, LINEAR_NODES, (PetscObject *)&is));
  if (is) PetscCall(ReadNodes(rows, is, c));
  else PetscCall(NodesByPattern(rows, c));
  three_unknowns = c->three_unknowns;
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &three_unknowns, 1, MPI_INT, MPI_MIN, PetscObjectComm((PetscObject)A)));
  c->three_unknowns = three_unknowns;
  PetscCall(LinearFetchColumns(A, rows, &c->node));
  PetscCall(ClassifyRows(A, rows, c));
  PetscFunctionReturn(0);
}
