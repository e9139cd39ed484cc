/* The interface of "kluparts": a vertex cover of the couplings between ranks, computed identically on all ranks */
#if defined(HHTDAE_HAVE_KLU)
#include "kluparts_data.h"
#include <algorithm>
#include <queue>

typedef std::vector<PetscInt> Indices;

namespace
{

/* Unknowns coupled across ranks, by global rows, and the graph of their couplings; the same on all ranks */
struct Couplings {
  Indices           row;
  LinearGraph       graph;
  std::vector<bool> multiplier; /* no value on the diagonal */
  Indices           weight;     /* number of rows that the interface gains with the unknown: itself and the multipliers it brings along, approximately */
};

} // namespace

PetscErrorCode PartsCountCouplings(Mat A, double *couplings)
{
  Mat             diagonal, off;
  const PetscInt *garray, *start, *col;
  PetscInt        n;
  PetscBool       done;
  double          mine;

  PetscFunctionBegin;
  PetscCall(MatMPIAIJGetSeqAIJ(A, &diagonal, &off, &garray));
  PetscCall(MatGetRowIJ(off, 0, PETSC_FALSE, PETSC_FALSE, &n, &start, &col, &done));
  mine = done ? (double)start[n] : 0;
  PetscCall(MatRestoreRowIJ(off, 0, PETSC_FALSE, PETSC_FALSE, &n, &start, &col, &done));
  PetscCallMPI(MPI_Allreduce(&mine, couplings, 1, MPI_DOUBLE, MPI_SUM, PetscObjectComm((PetscObject)A)));
  PetscFunctionReturn(0);
}

static PetscErrorCode GatherLists(MPI_Comm comm, const Indices &mine, Indices *all)
{
  PetscMPIInt size;
  double      count = (double)mine.size(), total;

  PetscFunctionBegin;
  PetscCallMPI(MPI_Comm_size(comm, &size));
  PetscCallMPI(MPI_Allreduce(&count, &total, 1, MPI_DOUBLE, MPI_SUM, comm));
  PetscCheck(total < (double)PETSC_MPI_INT_MAX, comm, PETSC_ERR_ARG_OUTOFRANGE,
             "%g couplings between ranks are too many for solver type %s; choose another one", total / 2,
             LINEAR_KLUPARTS);
  std::vector<PetscMPIInt> counts(size), first(size, 0);
  const PetscMPIInt        n = (PetscMPIInt)mine.size();
  PetscCallMPI(MPI_Allgather(&n, 1, MPI_INT, counts.data(), 1, MPI_INT, comm));
  for (PetscMPIInt r = 1; r < size; ++r) first[r] = first[r - 1] + counts[r - 1];
  all->resize((size_t)total);
  PetscCallMPI(MPI_Allgatherv(mine.data(), n, MPIU_INT, all->data(), counts.data(), first.data(), MPIU_INT, comm));
  PetscFunctionReturn(0);
}

static void SortUnique(Indices *list)
{
  std::sort(list->begin(), list->end());
  list->erase(std::unique(list->begin(), list->end()), list->end());
}

PetscErrorCode PartsGather(MPI_Comm comm, const Indices &mine, Indices *all)
{
  PetscFunctionBegin;
  PetscCall(GatherLists(comm, mine, all));
  SortUnique(all);
  PetscFunctionReturn(0);
}

/* ---- the couplings ---- */

static PetscErrorCode GatherCouplings(Mat A, Couplings *c)
{
  Mat             diagonal, off;
  const PetscInt *garray, *start, *col;
  PetscInt        n, begin, end;
  PetscBool       done;
  Indices         mine, all;

  PetscFunctionBegin;
  PetscCall(MatGetOwnershipRange(A, &begin, &end));
  PetscCall(MatMPIAIJGetSeqAIJ(A, &diagonal, &off, &garray));
  PetscCall(MatGetRowIJ(off, 0, PETSC_FALSE, PETSC_FALSE, &n, &start, &col, &done));
  for (PetscInt i = 0; i < n; ++i)
    for (PetscInt k = start[i]; k < start[i + 1]; ++k) mine.insert(mine.end(), {begin + i, garray[col[k]]});
  PetscCall(MatRestoreRowIJ(off, 0, PETSC_FALSE, PETSC_FALSE, &n, &start, &col, &done));
  PetscCall(GatherLists(PetscObjectComm((PetscObject)A), mine, &all));
  c->row = all;
  SortUnique(&c->row);
  for (PetscInt &r : all) r = (PetscInt)(std::lower_bound(c->row.begin(), c->row.end(), r) - c->row.begin());
  Indices from(all.size() / 2), to(all.size() / 2);
  for (size_t k = 0; k < from.size(); ++k) {
    from[k] = all[2 * k];
    to[k]   = all[2 * k + 1];
  }
  LinearGraphFromEntries<PetscInt>((PetscInt)c->row.size(), from.size(), from.data(), to.data(), 0, &c->graph);
  PetscFunctionReturn(0);
}

namespace
{

/* Rows of the rank's diagonal block, and which of them have a value on the diagonal */
struct DiagonalBlock {
  Mat               diagonal;
  LinearRows        rows;
  PetscInt          begin, end;
  std::vector<bool> multiplier;

  bool owns(PetscInt row) const { return row >= begin && row < end; }
};

} // namespace

static PetscErrorCode GetDiagonalBlock(Mat A, DiagonalBlock *l)
{
  Mat             off;
  const PetscInt *garray;

  PetscFunctionBegin;
  PetscCall(MatGetOwnershipRange(A, &l->begin, &l->end));
  PetscCall(MatMPIAIJGetSeqAIJ(A, &l->diagonal, &off, &garray));
  PetscCall(KluPairGetRows(l->diagonal, &l->rows));
  l->multiplier.assign(l->rows.n, true);
  for (PetscInt i = 0; i < l->rows.n; ++i)
    for (PetscInt k = l->rows.start[i]; k < l->rows.start[i + 1]; ++k)
      if (l->rows.col[k] == i && PetscAbsScalar(l->rows.val[k]) > 0) l->multiplier[i] = false;
  PetscFunctionReturn(0);
}

static PetscErrorCode WeighUnknowns(MPI_Comm comm, const DiagonalBlock &l, Couplings *c)
{
  const size_t n = c->row.size();
  Indices      mine(2 * n, 0), all(2 * n);

  PetscFunctionBegin;
  for (size_t v = 0; v < n; ++v) {
    if (!l.owns(c->row[v])) continue;
    const PetscInt i = c->row[v] - l.begin;
    mine[2 * v]      = l.multiplier[i];
    mine[2 * v + 1]  = 1;
    for (PetscInt k = l.rows.start[i]; k < l.rows.start[i + 1] && !l.multiplier[i]; ++k)
      mine[2 * v + 1] += l.multiplier[l.rows.col[k]];
  }
  PetscCheck(2 * n < (size_t)PETSC_MPI_INT_MAX, comm, PETSC_ERR_ARG_OUTOFRANGE,
             "%zu unknowns coupled across ranks are too many for solver type %s", n, LINEAR_KLUPARTS);
  PetscCallMPI(MPI_Allreduce(mine.data(), all.data(), (PetscMPIInt)(2 * n), MPIU_INT, MPI_SUM, comm));
  c->multiplier.resize(n);
  c->weight.resize(n);
  for (size_t v = 0; v < n; ++v) c->multiplier[v] = all[2 * v] > 0;
  for (PetscInt v = 0; v < (PetscInt)n; ++v) {
    c->weight[v] = all[2 * v + 1];
    for (PetscInt k = c->graph.xadj[v]; k < c->graph.xadj[v + 1] && !c->multiplier[v]; ++k)
      c->weight[v] += c->multiplier[c->graph.adj[k]];
  }
  PetscFunctionReturn(0);
}

/* ---- the cover ---- */

/* Greedy vertex cover: repeatedly takes the unknown that covers the most couplings per row of the interface */
static void CoverGreedily(const Couplings &c, std::vector<bool> *taken)
{
  typedef std::pair<double, PetscInt> Candidate; /* uncovered couplings per weight, and minus the unknown: ties go to the first one */
  std::priority_queue<Candidate>      queue;
  Indices                             uncovered(c.graph.n);
  const auto                          push_candidate = [&](PetscInt v) { queue.push({(double)uncovered[v] / (double)c.weight[v], -v}); };

  taken->assign(c.graph.n, false);
  for (PetscInt v = 0; v < c.graph.n; ++v) {
    uncovered[v] = c.graph.xadj[v + 1] - c.graph.xadj[v];
    push_candidate(v);
  }
  while (!queue.empty()) {
    const PetscInt v        = -queue.top().second;
    const double   coverage = queue.top().first;
    queue.pop();
    if ((*taken)[v] || uncovered[v] == 0) continue;
    if (coverage > (double)uncovered[v] / (double)c.weight[v]) { /* some of its couplings have been covered since */
      push_candidate(v);
      continue;
    }
    (*taken)[v] = true;
    for (PetscInt k = c.graph.xadj[v]; k < c.graph.xadj[v + 1]; ++k) --uncovered[c.graph.adj[k]];
  }
}

/* Adds the multipliers coupled to interface coordinates, and removes unknowns whose neighbours are all in the interface */
static void CompleteCover(const Couplings &c, std::vector<bool> *taken)
{
  const auto neighbours = [&c](PetscInt v) {
    return std::make_pair(c.graph.adj.begin() + c.graph.xadj[v], c.graph.adj.begin() + c.graph.xadj[v + 1]);
  };
  const std::vector<bool> cover = *taken;
  for (PetscInt v = 0; v < c.graph.n; ++v) {
    if (!cover[v] || c.multiplier[v]) continue;
    const auto all = neighbours(v);
    for (auto w = all.first; w != all.second; ++w)
      if (c.multiplier[*w]) (*taken)[*w] = true;
  }
  for (PetscInt v = c.graph.n - 1; v >= 0; --v) {
    if (!(*taken)[v]) continue;
    const auto all = neighbours(v);
    (*taken)[v]    = !std::all_of(all.first, all.second,
                                  [&](PetscInt w) { return (*taken)[w] && (!c.multiplier[v] || c.multiplier[w]); });
  }
}

PetscErrorCode PartsFindInterface(Mat A, const Indices &moved, Indices *interface)
{
  const MPI_Comm    comm = PetscObjectComm((PetscObject)A);
  Couplings         c;
  DiagonalBlock     l;
  std::vector<bool> taken;
  Indices           mine;

  PetscFunctionBegin;
  PetscCall(GatherCouplings(A, &c));
  PetscCall(GetDiagonalBlock(A, &l));
  PetscCall(WeighUnknowns(comm, l, &c));
  CoverGreedily(c, &taken);
  CompleteCover(c, &taken);
  for (PetscInt v = 0; v < c.graph.n; ++v) {
    if (!taken[v] || !l.owns(c.row[v])) continue;
    const PetscInt i = c.row[v] - l.begin;
    mine.push_back(c.row[v]);
    for (PetscInt k = l.rows.start[i]; k < l.rows.start[i + 1] && !c.multiplier[v]; ++k)
      if (l.multiplier[l.rows.col[k]]) mine.push_back(l.begin + l.rows.col[k]);
  }
  for (PetscInt row : moved)
    if (l.owns(row)) mine.push_back(row);
  PetscCall(KluPairRestoreRows(l.diagonal, &l.rows));
  PetscCall(PartsGather(comm, mine, interface));
  PetscFunctionReturn(0);
}

#endif
