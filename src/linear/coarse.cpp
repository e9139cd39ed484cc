/* The coarse level of "hhtconstraint", coarse.h */
#include "coarse.h"
#include <algorithm>
#include <cmath>
#include <petsc/private/pcimpl.h>

namespace
{

constexpr PetscInt rigid_motions = 6; /* of an aggregate: three translations, three rotations */

/* Nodes of an aggregate whose distances to a line are at most this part of its size count as collinear: the rotation about the line would be a zero column of R.
   ConstraintPC.NodesOnALineStandApart. */
constexpr double collinear_tolerance = 1e-6;

using Node = CoarseLevel::Node;

/* ---- aggregates ---- */

PetscErrorCode Positions(Vec positions, CoarseLevel *c)
{
  const PetscScalar *x;
  PetscInt           begin;

  PetscFunctionBegin;
  PetscCall(VecGetOwnershipRange(positions, &begin, NULL));
  PetscCall(VecGetArrayRead(positions, &x));
  for (Node &n : c->nodes)
    for (int k = 0; k < 3; k++) n.x[k] = PetscRealPart(x[n.row - begin + k]);
  PetscCall(VecRestoreArrayRead(positions, &x));
  PetscFunctionReturn(0);
}

PetscErrorCode ListUnknowns(const CoarseNodes &of, CoarseLevel *c)
{
  PetscInt begin;

  PetscFunctionBegin;
  PetscCall(MatGetOwnershipRange(of.A, &begin, NULL));
  for (PetscInt first : of.nodes.node_blocks) c->nodes.push_back({begin + first, {0, 0, 0}});
  for (PetscInt row : of.nodes.other_rows) c->single_rows.push_back(begin + row);
  PetscFunctionReturn(0);
}

/* The coordinate direction in which the nodes [from, to) have the largest extent */
int LongestSide(const CoarseLevel &c, PetscInt from, PetscInt to)
{
  int    side    = 0;
  double longest = -1;
  for (int k = 0; k < 3; k++) {
    const auto ends = std::minmax_element(c.nodes.begin() + from, c.nodes.begin() + to, [k](const Node &a, const Node &b) { return a.x[k] < b.x[k]; });
    if (ends.second->x[k] - ends.first->x[k] <= longest) continue;
    longest = ends.second->x[k] - ends.first->x[k];
    side    = k;
  }
  return side;
}

/* Recursively bisects the nodes [from, to) into aggregates of at most max_nodes nodes */
void Divide(CoarseLevel *c, PetscInt from, PetscInt to, PetscInt max_nodes)
{
  if (to - from <= max_nodes) {
    c->first.push_back(to);
    return;
  }
  const int      side   = LongestSide(*c, from, to);
  const PetscInt middle = from + (to - from) / 2;
  std::nth_element(c->nodes.begin() + from, c->nodes.begin() + middle, c->nodes.begin() + to,
                   [side](const Node &a, const Node &b) { return a.x[side] != b.x[side] ? a.x[side] < b.x[side] : a.row < b.row; });
  Divide(c, from, middle, max_nodes);
  Divide(c, middle, to, max_nodes);
}

/* Centre of the nodes [from, to); returns the largest distance from it in a coordinate direction */
double Centre(const CoarseLevel &c, PetscInt from, PetscInt to, double centre[3])
{
  double radius = 0;
  for (int k = 0; k < 3; k++) {
    centre[k] = 0;
    for (PetscInt i = from; i < to; i++) centre[k] += c.nodes[(size_t)i].x[k] / (double)(to - from);
    for (PetscInt i = from; i < to; i++) radius = std::max(radius, std::abs(c.nodes[(size_t)i].x[k] - centre[k]));
  }
  return radius;
}

/* Whether the nodes [from, to) are collinear: on the line through their centre and the node that is farthest from it */
bool IsCollinear(const CoarseLevel &c, PetscInt from, PetscInt to)
{
  double       m[3], far[3] = {0, 0, 0}, farthest = 0, off_line = 0;
  const double radius = Centre(c, from, to, m);
  for (PetscInt i = from; i < to; i++) {
    const double *x = c.nodes[(size_t)i].x, d = std::hypot(x[0] - m[0], x[1] - m[1], x[2] - m[2]);
    if (d <= farthest) continue;
    farthest = d;
    for (int k = 0; k < 3; k++) far[k] = (x[k] - m[k]) / d;
  }
  for (PetscInt i = from; i < to; i++)
    for (int k = 0; k < 3; k++) {
      const double *x = c.nodes[(size_t)i].x;
      const int     j = (k + 1) % 3, l = (k + 2) % 3;
      off_line = std::max(off_line, std::abs((x[j] - m[j]) * far[l] - (x[l] - m[l]) * far[j]));
    }
  return off_line <= collinear_tolerance * radius;
}

/* Dissolves aggregates of collinear nodes: the unknowns of these nodes become single rows */
void DissolveCollinear(CoarseLevel *c)
{
  std::vector<Node>     nodes;
  std::vector<PetscInt> first{0};
  for (size_t a = 0; a + 1 < c->first.size(); a++) {
    const auto from = c->nodes.begin() + c->first[a], to = c->nodes.begin() + c->first[a + 1];
    if (IsCollinear(*c, c->first[a], c->first[a + 1])) {
      for (auto n = from; n != to; ++n)
        for (PetscInt k = 0; k < 3; k++) c->single_rows.push_back(n->row + k);
    } else {
      nodes.insert(nodes.end(), from, to);
      first.push_back((PetscInt)nodes.size());
    }
  }
  std::sort(c->single_rows.begin(), c->single_rows.end());
  c->nodes.swap(nodes);
  c->first.swap(first);
}

/* Validates a division from a file: each own row belongs to exactly one node or is a single row, and no aggregate is collinear */
bool IsValidDivision(const CoarseLevel &c, PetscInt begin, PetscInt end)
{
  std::vector<bool> seen((size_t)(end - begin), false);
  const auto        isNew = [&](PetscInt row) {
    if (row < begin || row >= end || seen[(size_t)(row - begin)]) return false;
    return (bool)(seen[(size_t)(row - begin)] = true);
  };
  if (c.first.empty() || c.first[0] != 0 || c.first.back() != (PetscInt)c.nodes.size() || 3 * c.nodes.size() + c.single_rows.size() != seen.size()) return false;
  for (const Node &n : c.nodes)
    for (PetscInt k = 0; k < 3; k++)
      if (!std::isfinite(n.x[k]) || n.row > end - 3 || !isNew(n.row + k)) return false;
  for (PetscInt row : c.single_rows)
    if (!isNew(row)) return false;
  for (size_t a = 0; a + 1 < c.first.size(); a++) /* ascending from 0 to the number of nodes: in range */
    if (c.first[a] >= c.first[a + 1] || c.first[a + 1] > (PetscInt)c.nodes.size() || IsCollinear(c, c.first[a], c.first[a + 1])) return false;
  return true;
}

/* Writes or reads the division; rows and positions of nodes separately, without the padding of the struct */
void TransferDivision(CoarseLevel *c, Archive *archive)
{
  std::vector<PetscInt> row;
  std::vector<double>   x;
  for (const Node &n : c->nodes) {
    row.push_back(n.row);
    x.insert(x.end(), n.x, n.x + 3);
  }
  archive->list(row);
  archive->list(x);
  archive->list(c->first);
  archive->list(c->single_rows);
  if (!archive->reading) return;
  archive->good = archive->good && x.size() == 3 * row.size();
  c->nodes.clear();
  for (size_t i = 0; i < row.size() && archive->good; i++) c->nodes.push_back({row[i], {x[3 * i], x[3 * i + 1], x[3 * i + 2]}});
}

/* ---- the matrices ---- */

PetscErrorCode CreateR(Mat A, CoarseLevel *c)
{
  PetscInt       n;
  const PetscInt columns = (PetscInt)c->single_rows.size() + rigid_motions * ((PetscInt)c->first.size() - 1);

  PetscFunctionBegin;
  PetscCall(MatGetLocalSize(A, &n, NULL));
  PetscCall(MatCreateAIJ(PetscObjectComm((PetscObject)A), n, columns, PETSC_DETERMINE, PETSC_DETERMINE, 3, NULL, 0, NULL, &c->R));
  PetscCall(MatSetOption(c->R, MAT_NO_OFF_PROC_ENTRIES, PETSC_TRUE));
  PetscCall(MatCreateVecs(c->R, &c->residual, NULL));
  PetscCall(VecDuplicate(c->residual, &c->answer));
  PetscFunctionReturn(0);
}

/* Sets the rows of R of an aggregate whose columns begin with `column`: translations, and rotations about the centre divided by the aggregate's size */
PetscErrorCode FillAggregate(CoarseLevel *c, PetscInt from, PetscInt to, PetscInt column)
{
  double       m[3];
  const double radius = Centre(*c, from, to, m);

  PetscFunctionBegin;
  for (PetscInt i = from; i < to; i++) {
    const double *x = c->nodes[(size_t)i].x;
    for (PetscInt k = 0; k < 3; k++) {
      const PetscInt    row = c->nodes[(size_t)i].row + k, j = (k + 1) % 3, l = (k + 2) % 3;
      const PetscInt    at[3]    = {column + k, column + 3 + j, column + 3 + l};
      const PetscScalar value[3] = {1, (x[l] - m[l]) / radius, -(x[j] - m[j]) / radius}; /* (e_j x r)_k = r_l, (e_l x r)_k = -r_j */
      PetscCall(MatSetValues(c->R, 1, &row, 3, at, value, INSERT_VALUES));
    }
  }
  PetscFunctionReturn(0);
}

PetscErrorCode FillR(CoarseLevel *c)
{
  PetscInt          column;
  const PetscScalar one = 1;

  PetscFunctionBegin;
  PetscCall(MatGetOwnershipRangeColumn(c->R, &column, NULL));
  for (PetscInt row : c->single_rows) {
    PetscCall(MatSetValues(c->R, 1, &row, 1, &column, &one, INSERT_VALUES));
    column++;
  }
  for (size_t a = 0; a + 1 < c->first.size(); a++, column += rigid_motions) PetscCall(FillAggregate(c, c->first[a], c->first[a + 1], column));
  PetscCall(MatAssemblyBegin(c->R, MAT_FINAL_ASSEMBLY));
  PetscCall(MatAssemblyEnd(c->R, MAT_FINAL_ASSEMBLY));
  PetscFunctionReturn(0);
}

} // namespace

PetscErrorCode CoarseDestroy(CoarseLevel *c)
{
  PetscFunctionBegin;
  PetscCall(InnerDestroy(&c->inner));
  PetscCall(MatDestroy(&c->R));
  PetscCall(MatDestroy(&c->A));
  PetscCall(VecDestroy(&c->residual));
  PetscCall(VecDestroy(&c->answer));
  *c = CoarseLevel();
  PetscFunctionReturn(0);
}

PetscErrorCode CoarseCreate(const CoarseNodes &of, PetscInt max_nodes, CoarseLevel *c)
{
  PetscFunctionBegin;
  PetscCall(CoarseDestroy(c));
  PetscCall(ListUnknowns(of, c));
  PetscCall(Positions(of.positions, c));
  c->first.push_back(0);
  if (!c->nodes.empty()) Divide(c, 0, (PetscInt)c->nodes.size(), max_nodes);
  DissolveCollinear(c);
  PetscCall(CreateR(of.A, c));
  PetscFunctionReturn(0);
}

PetscErrorCode CoarseFill(PC pc, Vec positions, CoarseLevel *c, PetscBool *failed)
{
  PetscFunctionBegin;
  PetscCall(Positions(positions, c));
  PetscCall(FillR(c));
  PetscCall(MatPtAP(pc->pmat, c->R, c->A ? MAT_REUSE_MATRIX : MAT_INITIAL_MATRIX, 1, &c->A));
  PetscCall(InnerSetUp(pc, "coarse_", c->A, &c->inner, failed));
  PetscFunctionReturn(0);
}

PetscErrorCode CoarseSaveState(const CoarseLevel &c, Archive *archive)
{
  CoarseLevel division;

  PetscFunctionBegin;
  division.nodes       = c.nodes;
  division.first       = c.first;
  division.single_rows = c.single_rows;
  TransferDivision(&division, archive);
  PetscCall(InnerSaveState(c.inner, archive));
  PetscFunctionReturn(0);
}

PetscErrorCode CoarseLoadState(PC pc, CoarseLevel *c, Archive *archive, PetscBool *same, PetscBool *failed)
{
  CoarseLevel was;
  PetscInt    begin, end;

  PetscFunctionBegin;
  *failed = PETSC_FALSE;
  PetscCall(MatGetOwnershipRange(pc->pmat, &begin, &end));
  TransferDivision(&was, archive);
  *same = (PetscBool)(archive->good && IsValidDivision(was, begin, end));
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, same, 1, MPIU_BOOL, MPI_LAND, PetscObjectComm((PetscObject)pc)));
  if (!*same) PetscFunctionReturn(0);
  PetscCall(CoarseDestroy(c));
  *c = was;
  PetscCall(CreateR(pc->pmat, c));
  PetscCall(FillR(c));
  PetscCall(MatPtAP(pc->pmat, c->R, MAT_INITIAL_MATRIX, 1, &c->A));
  PetscCall(InnerLoadState(pc, "coarse_", c->A, &c->inner, archive, same, failed));
  PetscFunctionReturn(0);
}

PetscErrorCode CoarseAdd(CoarseLevel *c, Vec x, Vec y, PetscBool *failed)
{
  PetscFunctionBegin;
  PetscCall(MatMultTranspose(c->R, x, c->residual));
  PetscCall(InnerSolve(&c->inner, c->residual, c->answer, failed));
  PetscCall(MatMultAdd(c->R, c->answer, y, y));
  PetscFunctionReturn(0);
}

PetscErrorCode CoarseView(const CoarseLevel &c, PetscViewer viewer)
{
  PetscInt aggregates = (PetscInt)c.first.size() - 1, columns;

  PetscFunctionBegin;
  PetscCall(MatGetSize(c.R, NULL, &columns));
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &aggregates, 1, MPIU_INT, MPI_SUM, PetscObjectComm((PetscObject)c.R)));
  PetscCall(PetscViewerASCIIPrintf(viewer, "  coarse level: %" PetscInt_FMT " aggregates, %" PetscInt_FMT " unknowns; %s\n", aggregates, columns, c.inner.choice.text));
  PetscCall(InnerView(c.inner, viewer));
  PetscFunctionReturn(0);
}
