/*
  The preconditioner "hhtconstraint", constraint.h. Its solver of P has the prefix "constraint_" after that of the preconditioner's own options,
  and is chosen as any other direct solver where the user chooses none.
*/
#include "constraint.h"
#include "coarse.h"
#include "linear.h"
#include <algorithm>
#include <petsc/private/pcimpl.h>
#include <vector>

namespace
{

constexpr PetscInt in_aggregate = 200; /* nodes: of 60 to 200 the best at 17,000 and 120,000 unknowns, src/flexible/README.md */

struct Constraint {
  InnerSolver           inner;
  Mat                   P = nullptr;
  std::vector<PetscInt> node;    /* of own rows: the first row of their node, or -1 */
  std::vector<PetscInt> columns; /* of other ranks, ascending, and the nodes of these */
  std::vector<PetscInt> of_columns;
  PetscInt              nodes = 0; /* of this rank */
  PetscInt              aggregate = in_aggregate;
  CoarseLevel           coarse;
  PetscObjectId         matrix  = 0;
  PetscObjectState      pattern = -1;
};

Constraint &Of(PC pc) { return *static_cast<Constraint *>(pc->data); }

/* ---- nodes ---- */

PetscErrorCode NodesGiven(Mat A, IS is, Constraint &c)
{
  PetscInt        begin, end, n, size, least, most;
  const PetscInt *row;

  PetscFunctionBegin;
  PetscCall(MatGetOwnershipRange(A, &begin, &end));
  PetscCall(ISGetLocalSize(is, &n));
  PetscCall(ISGetBlockSize(is, &size));
  PetscCall(ISGetIndices(is, &row));
  least = n ? *std::min_element(row, row + n) : begin;
  most  = n ? *std::max_element(row, row + n) : begin;
  for (PetscInt k = 0; k < n && least >= begin && most < end; k++) c.node[(size_t)(row[k] - begin)] = row[k - k % size];
  c.nodes = n / size;
  PetscCall(ISRestoreIndices(is, &row));
  PetscCheck(!n || (least >= begin && most < end), PETSC_COMM_SELF, PETSC_ERR_ARG_OUTOFRANGE,
             "The nodes of the matrix (" LINEAR_NODES ") have rows %" PetscInt_FMT " to %" PetscInt_FMT ", this rank has rows %" PetscInt_FMT " to %" PetscInt_FMT, least, most, begin,
             end - 1);
  PetscFunctionReturn(0);
}

/* Unknowns of a node are coupled to the same others; multipliers have no diagonal entry */
PetscErrorCode NodesByPattern(Mat A, Constraint &c)
{
  std::vector<PetscInt> last;
  PetscInt              begin, end, first = -1;

  PetscFunctionBegin;
  PetscCall(MatGetOwnershipRange(A, &begin, &end));
  for (PetscInt i = begin; i < end; i++) {
    const PetscInt    *col;
    const PetscScalar *value;
    PetscInt           n;
    PetscBool          diagonal = PETSC_FALSE;
    PetscCall(MatGetRow(A, i, &n, &col, &value));
    for (PetscInt k = 0; k < n; k++)
      if (col[k] == i && value[k] != 0) diagonal = PETSC_TRUE;
    const bool same = first >= 0 && (PetscInt)last.size() == n && std::equal(last.begin(), last.end(), col);
    if (!diagonal) first = -1;
    else if (!same) {
      first = i;
      c.nodes++;
    }
    c.node[(size_t)(i - begin)] = first;
    last.assign(col, col + n);
    PetscCall(MatRestoreRow(A, i, &n, &col, &value));
  }
  PetscFunctionReturn(0);
}

/* The nodes of columns that other ranks own */
PetscErrorCode FetchNodes(Mat A, Constraint &c)
{
  const PetscInt *garray;
  PetscInt        begin, n;
  Mat             off;
  Vec             mine, theirs;
  IS              from;
  VecScatter      scatter;
  PetscBool       mpi;

  PetscFunctionBegin;
  c.columns.clear();
  PetscCall(PetscObjectBaseTypeCompare((PetscObject)A, MATMPIAIJ, &mpi));
  if (!mpi) PetscFunctionReturn(0);
  PetscCall(MatMPIAIJGetSeqAIJ(A, NULL, &off, &garray));
  PetscCall(MatGetLocalSize(off, NULL, &n));
  c.columns.assign(garray, garray + n);
  PetscCall(MatCreateVecs(A, &mine, NULL));
  PetscCall(VecGetOwnershipRange(mine, &begin, NULL));
  for (size_t i = 0; i < c.node.size(); i++) PetscCall(VecSetValue(mine, begin + (PetscInt)i, (PetscScalar)c.node[i], INSERT_VALUES));
  PetscCall(VecAssemblyBegin(mine));
  PetscCall(VecAssemblyEnd(mine));
  PetscCall(VecCreateSeq(PETSC_COMM_SELF, n, &theirs));
  PetscCall(ISCreateGeneral(PETSC_COMM_SELF, n, garray, PETSC_USE_POINTER, &from));
  PetscCall(VecScatterCreate(mine, from, theirs, NULL, &scatter));
  PetscCall(VecScatterBegin(scatter, mine, theirs, INSERT_VALUES, SCATTER_FORWARD));
  PetscCall(VecScatterEnd(scatter, mine, theirs, INSERT_VALUES, SCATTER_FORWARD));
  const PetscScalar *node;
  PetscCall(VecGetArrayRead(theirs, &node));
  c.of_columns.resize((size_t)n);
  for (PetscInt k = 0; k < n; k++) c.of_columns[(size_t)k] = (PetscInt)PetscRealPart(node[k]);
  PetscCall(VecRestoreArrayRead(theirs, &node));
  PetscCall(VecScatterDestroy(&scatter));
  PetscCall(ISDestroy(&from));
  PetscCall(VecDestroy(&theirs));
  PetscCall(VecDestroy(&mine));
  PetscFunctionReturn(0);
}

/* ---- the matrix P ---- */

/* Whether the entry of a row of node `of_row` stays; begin, end: own columns */
bool Stays(const Constraint &c, PetscInt begin, PetscInt end, PetscInt of_row, PetscInt col)
{
  if (of_row < 0) return true;
  if (col >= begin && col < end) {
    const PetscInt other = c.node[(size_t)(col - begin)];
    return other < 0 || other == of_row;
  }
  const auto at = std::lower_bound(c.columns.begin(), c.columns.end(), col);
  return c.of_columns[(size_t)(at - c.columns.begin())] < 0; /* a node has one owner */
}

/* use(row, entries that stay of it) for every own row */
template <class Use>
PetscErrorCode ForRows(Mat A, const Constraint &c, Use use)
{
  std::vector<PetscInt>    cols;
  std::vector<PetscScalar> values;
  PetscInt                 begin, end;

  PetscFunctionBegin;
  PetscCall(MatGetOwnershipRange(A, &begin, &end));
  for (PetscInt i = begin; i < end; i++) {
    const PetscInt    *col;
    const PetscScalar *value;
    PetscInt           n;
    PetscCall(MatGetRow(A, i, &n, &col, &value));
    cols.clear();
    values.clear();
    for (PetscInt k = 0; k < n; k++)
      if (Stays(c, begin, end, c.node[(size_t)(i - begin)], col[k])) {
        cols.push_back(col[k]);
        values.push_back(value[k]);
      }
    PetscCall(MatRestoreRow(A, i, &n, &col, &value));
    PetscCall(use(i, cols, values));
  }
  PetscFunctionReturn(0);
}

PetscErrorCode CreateP(PC pc, Constraint &c)
{
  PetscInt              begin, end, n, N;
  std::vector<PetscInt> diagonal, off;

  PetscFunctionBegin;
  PetscCall(MatDestroy(&c.P));
  PetscCall(MatGetOwnershipRange(pc->pmat, &begin, &end));
  n = end - begin;
  PetscCall(MatGetSize(pc->pmat, &N, NULL));
  PetscCall(ForRows(pc->pmat, c, [&](PetscInt, const std::vector<PetscInt> &col, const std::vector<PetscScalar> &) -> PetscErrorCode {
    PetscInt own = 0;
    for (PetscInt j : col) own += j >= begin && j < end;
    diagonal.push_back(own);
    off.push_back((PetscInt)col.size() - own);
    return 0;
  }));
  PetscCall(MatCreateAIJ(PetscObjectComm((PetscObject)pc), n, n, N, N, 0, diagonal.data(), 0, off.data(), &c.P));
  PetscCall(MatSetOption(c.P, MAT_NO_OFF_PROC_ENTRIES, PETSC_TRUE));
  PetscFunctionReturn(0);
}

PetscErrorCode FillP(PC pc, Constraint &c)
{
  PetscFunctionBegin;
  PetscCall(ForRows(pc->pmat, c, [&](PetscInt i, const std::vector<PetscInt> &col, const std::vector<PetscScalar> &value) -> PetscErrorCode {
    PetscFunctionBegin;
    PetscCall(MatSetValues(c.P, 1, &i, (PetscInt)col.size(), col.data(), value.data(), INSERT_VALUES));
    PetscFunctionReturn(0);
  }));
  PetscCall(MatAssemblyBegin(c.P, MAT_FINAL_ASSEMBLY));
  PetscCall(MatAssemblyEnd(c.P, MAT_FINAL_ASSEMBLY));
  PetscFunctionReturn(0);
}

/* ---- the preconditioner ---- */

PetscErrorCode FindNodes(PC pc, Constraint &c)
{
  PetscInt begin, end;
  IS       is;

  PetscFunctionBegin;
  PetscCall(MatGetOwnershipRange(pc->pmat, &begin, &end));
  c.node.assign((size_t)(end - begin), -1);
  c.nodes = 0;
  PetscCall(PetscObjectQuery((PetscObject)pc->pmat, LINEAR_NODES, (PetscObject *)&is));
  if (is) PetscCall(NodesGiven(pc->pmat, is, c));
  else PetscCall(NodesByPattern(pc->pmat, c));
  PetscCall(FetchNodes(pc->pmat, c));
  PetscFunctionReturn(0);
}

PetscErrorCode CheckType(PC pc)
{
  PetscBool aij;
  MatType   type;

  PetscFunctionBegin;
  PetscCall(PetscObjectBaseTypeCompareAny((PetscObject)pc->pmat, &aij, MATSEQAIJ, MATMPIAIJ, ""));
  PetscCall(MatGetType(pc->pmat, &type));
  PetscCheck(aij, PetscObjectComm((PetscObject)pc), PETSC_ERR_SUP, "-pc_type " PCHHTCONSTRAINT " reads the rows of a matrix of type " MATAIJ ", not of %s", type);
  PetscFunctionReturn(0);
}

/* *fresh: another matrix or another pattern than before */
PetscErrorCode SetUpP(PC pc, Constraint &c, PetscBool *fresh)
{
  PetscObjectId    id;
  PetscObjectState pattern;

  PetscFunctionBegin;
  PetscCall(PetscObjectGetId((PetscObject)pc->pmat, &id));
  PetscCall(MatGetNonzeroState(pc->pmat, &pattern));
  *fresh = (PetscBool)(!c.P || id != c.matrix || pattern != c.pattern);
  if (*fresh) {
    PetscCall(FindNodes(pc, c));
    PetscCall(CreateP(pc, c));
    c.matrix  = id;
    c.pattern = pattern;
  }
  PetscCall(FillP(pc, c));
  PetscFunctionReturn(0);
}

PetscErrorCode SetUpCoarse(PC pc, Constraint &c, PetscBool fresh, PetscBool *failed)
{
  Vec         positions;
  IS          multipliers;
  const char *prefix;

  PetscFunctionBegin;
  *failed = PETSC_FALSE;
  PetscCall(PCGetOptionsPrefix(pc, &prefix));
  PetscCall(PetscOptionsGetInt(((PetscObject)pc)->options, prefix, "-pc_hhtconstraint_aggregate", &c.aggregate, NULL));
  PetscCall(PetscObjectQuery((PetscObject)pc->pmat, LINEAR_POSITIONS, (PetscObject *)&positions));
  PetscCall(PetscObjectQuery((PetscObject)pc->pmat, LINEAR_MULTIPLIERS, (PetscObject *)&multipliers));
  if (c.aggregate <= 0 || !positions) PetscCall(CoarseDestroy(&c.coarse));
  else {
    if (fresh || !c.coarse.R) PetscCall(CoarseCreate({c.node, c.P, positions, multipliers}, c.aggregate, &c.coarse));
    PetscCall(CoarseFill(pc, positions, &c.coarse, failed));
  }
  PetscFunctionReturn(0);
}

PetscErrorCode SetUp(PC pc)
{
  Constraint &c = Of(pc);
  PetscBool   fresh = PETSC_FALSE, fine, coarse;

  PetscFunctionBegin;
  PetscCall(CheckType(pc));
  PetscCall(SetUpP(pc, c, &fresh));
  PetscCall(InnerSetUp(pc, "constraint_", c.P, fresh, &c.inner, &fine));
  PetscCall(SetUpCoarse(pc, c, fresh, &coarse));
  pc->failedreason = fine || coarse ? PC_SUBPC_ERROR : PC_NOERROR;
  PetscFunctionReturn(0);
}

PetscErrorCode Apply(PC pc, Vec x, Vec y)
{
  Constraint &c = Of(pc);
  PetscBool   fine, coarse = PETSC_FALSE;

  PetscFunctionBegin;
  PetscCall(InnerSolve(&c.inner, x, y, &fine));
  if (c.coarse.R) PetscCall(CoarseAdd(&c.coarse, x, y, &coarse));
  if (fine || coarse) pc->failedreason = PC_SUBPC_ERROR;
  PetscFunctionReturn(0);
}

/* Conjugate gradients need a first iterate on the constraints */
PetscErrorCode PreSolve(PC, KSP ksp, Vec, Vec)
{
  PetscBool cg;

  PetscFunctionBegin;
  PetscCall(PetscObjectTypeCompareAny((PetscObject)ksp, &cg, KSPCG, KSPFCG, KSPPIPECG, ""));
  if (cg) PetscCall(KSPSetInitialGuessKnoll(ksp, PETSC_TRUE));
  PetscFunctionReturn(0);
}

PetscErrorCode View(PC pc, PetscViewer viewer)
{
  const Constraint &c = Of(pc);
  PetscBool         ascii;
  PetscInt          nodes = c.nodes;
  MatInfo           all, kept;

  PetscFunctionBegin;
  PetscCall(PetscObjectTypeCompare((PetscObject)viewer, PETSCVIEWERASCII, &ascii));
  if (!ascii || !c.P) PetscFunctionReturn(0);
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &nodes, 1, MPIU_INT, MPI_SUM, PetscObjectComm((PetscObject)pc)));
  PetscCall(MatGetInfo(pc->pmat, MAT_GLOBAL_SUM, &all));
  PetscCall(MatGetInfo(c.P, MAT_GLOBAL_SUM, &kept));
  PetscCall(PetscViewerASCIIPrintf(viewer, "  %" PetscInt_FMT " nodes without couplings among them, %g entries of %g; %s\n", nodes, (double)kept.nz_used, (double)all.nz_used, c.inner.choice.text));
  PetscCall(InnerView(c.inner, viewer));
  if (c.coarse.A) PetscCall(CoarseView(c.coarse, viewer));
  PetscFunctionReturn(0);
}

PetscErrorCode Reset(PC pc)
{
  Constraint &c = Of(pc);

  PetscFunctionBegin;
  PetscCall(InnerDestroy(&c.inner));
  PetscCall(CoarseDestroy(&c.coarse));
  PetscCall(MatDestroy(&c.P));
  PetscFunctionReturn(0);
}

PetscErrorCode Destroy(PC pc)
{
  PetscFunctionBegin;
  PetscCall(Reset(pc));
  delete static_cast<Constraint *>(pc->data);
  pc->data = NULL;
  PetscFunctionReturn(0);
}

PetscErrorCode Create(PC pc)
{
  PetscFunctionBegin;
  pc->data          = new Constraint();
  pc->ops->setup    = SetUp;
  pc->ops->apply    = Apply;
  pc->ops->presolve = PreSolve;
  pc->ops->view     = View;
  pc->ops->reset    = Reset;
  pc->ops->destroy  = Destroy;
  PetscFunctionReturn(0);
}

} // namespace

PetscErrorCode LinearRegisterConstraint(void)
{
  PetscFunctionBegin;
  PetscCall(PCRegister(PCHHTCONSTRAINT, Create));
  PetscFunctionReturn(0);
}
