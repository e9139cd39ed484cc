#include "graph.h"
#include <algorithm>
#include <climits>
#include <metis.h>

template <typename Index>
void LinearGraphFromEntries(PetscInt n, size_t count, const Index row[], const Index col[], Index base,
                            LinearGraph *graph)
{
  std::vector<size_t> start(n + 1, 0);
  for (size_t k = 0; k < count; ++k)
    if (row[k] != col[k]) {
      ++start[row[k] - base + 1];
      ++start[col[k] - base + 1];
    }
  for (PetscInt i = 0; i < n; ++i) start[i + 1] += start[i];

  std::vector<PetscInt> both(start[n]);
  std::vector<size_t>   next(start.begin(), start.end() - 1);
  for (size_t k = 0; k < count; ++k)
    if (row[k] != col[k]) {
      both[next[row[k] - base]++] = (PetscInt)(col[k] - base);
      both[next[col[k] - base]++] = (PetscInt)(row[k] - base);
    }

  graph->n = n;
  graph->xadj.assign(n + 1, 0);
  graph->adj.clear();
  graph->adj.reserve(both.size() / 2);
  for (PetscInt i = 0; i < n; ++i) {
    const auto first = both.begin() + start[i], last = both.begin() + start[i + 1];
    std::sort(first, last);
    graph->adj.insert(graph->adj.end(), first, std::unique(first, last));
    graph->xadj[i + 1] = (PetscInt)graph->adj.size();
  }
}

template void LinearGraphFromEntries<int>(PetscInt, size_t, const int[], const int[], int, LinearGraph *);
#if defined(PETSC_USE_64BIT_INDICES)
template void LinearGraphFromEntries<PetscInt>(PetscInt, size_t, const PetscInt[], const PetscInt[], PetscInt,
                                               LinearGraph *);
#endif

/* Pattern of the transpose, rows ascending */
static void Transposed(PetscInt n, const PetscInt ia[], const PetscInt ja[], std::vector<PetscInt> *start,
                       std::vector<PetscInt> *row)
{
  start->assign(n + 1, 0);
  row->resize(ia[n]);
  for (PetscInt k = 0; k < ia[n]; ++k) ++(*start)[ja[k] + 1];
  for (PetscInt i = 0; i < n; ++i) (*start)[i + 1] += (*start)[i];
  std::vector<PetscInt> next(start->begin(), start->end() - 1);
  for (PetscInt i = 0; i < n; ++i)
    for (PetscInt k = ia[i]; k < ia[i + 1]; ++k) (*row)[next[ja[k]]++] = i;
}

/* Rows of SEQAIJ are sorted, so that merging them with those of the transpose needs no sorting. Block matrices are factored block by block, and PETSc orders
   their blocks (MatrixTypes.OrderingsOfBlocks). */
PetscErrorCode LinearGraphFromMat(Mat A, LinearGraph *graph, PetscBool *done)
{
  PetscInt              n;
  const PetscInt       *ia, *ja;
  std::vector<PetscInt> start, row;
  PetscBool             blocks;

  PetscFunctionBegin;
  PetscCall(PetscObjectBaseTypeCompareAny((PetscObject)A, &blocks, MATSEQBAIJ, MATSEQSBAIJ, ""));
  PetscCall(MatGetRowIJ(A, 0, PETSC_FALSE, blocks, &n, &ia, &ja, done));
  if (!*done) PetscFunctionReturn(0);
  Transposed(n, ia, ja, &start, &row);
  graph->n = n;
  graph->xadj.assign(n + 1, 0);
  graph->adj.resize(2 * (size_t)ia[n]);
  PetscInt *to = graph->adj.data();
  for (PetscInt i = 0; i < n; ++i) {
    const PetscInt *const below = row.data() + start[i], *const end = row.data() + start[i + 1];
    if (std::equal(ja + ia[i], ja + ia[i + 1], below, end))
      to = std::remove_copy(below, end, to, i);
    else
      to = std::remove(to, std::set_union(ja + ia[i], ja + ia[i + 1], below, end, to), i);
    graph->xadj[i + 1] = (PetscInt)(to - graph->adj.data());
  }
  graph->adj.resize(graph->xadj[n]);
  PetscCall(MatRestoreRowIJ(A, 0, PETSC_FALSE, blocks, &n, &ia, &ja, done));
  *done = PETSC_TRUE;
  PetscFunctionReturn(0);
}

/* Merges every unknown with its partner. group[i]: the group of unknown i; first, second: the members of each group in the order of elimination, second -1 if there is one only. */
static void MergePartners(PetscInt n, const std::vector<PetscInt> &partner, std::vector<PetscInt> &group,
                          std::vector<PetscInt> &first, std::vector<PetscInt> &second)
{
  group.assign(n, -1);
  for (PetscInt i = 0; i < (PetscInt)partner.size(); ++i) {
    const PetscInt p = partner[i];
    if (p < 0 || p == i || group[p] >= 0 || group[i] >= 0) continue;
    group[p] = group[i] = (PetscInt)first.size();
    first.push_back(p);
    second.push_back(i);
  }
  for (PetscInt i = 0; i < n; ++i)
    if (group[i] < 0) {
      group[i] = (PetscInt)first.size();
      first.push_back(i);
      second.push_back(-1);
    }
}

PetscErrorCode LinearMetisOrder(const LinearGraph &graph, const std::vector<PetscInt> &partner,
                                std::vector<PetscInt> *order)
{
  std::vector<PetscInt> group, first, second;

  PetscFunctionBegin;
  PetscCheck(graph.adj.size() < (size_t)IDX_MAX, PETSC_COMM_SELF, PETSC_ERR_ARG_OUTOFRANGE,
             "The pattern has %zu off-diagonal entries, more than this build of METIS can count (%zu); choose another "
             "ordering",
             graph.adj.size(), (size_t)IDX_MAX);
  order->clear();
  order->reserve(graph.n);
  MergePartners(graph.n, partner, group, first, second);

  const idx_t        groups = (idx_t)first.size();
  std::vector<idx_t> xadj(groups + 1, 0), adj, seen(groups, -1), perm(groups), inverse(groups);
  adj.reserve(graph.adj.size());
  for (idx_t g = 0; g < groups; ++g) {
    seen[g] = g;
    for (PetscInt i : {first[g], second[g]})
      for (PetscInt k = i < 0 ? 0 : graph.xadj[i]; k < (i < 0 ? 0 : graph.xadj[i + 1]); ++k) {
        const idx_t other = (idx_t)group[graph.adj[k]];
        if (seen[other] != g) adj.push_back(other);
        seen[other] = g;
      }
    xadj[g + 1] = (idx_t)adj.size();
  }

  /* METIS reports an error for a graph without edges, for which all orders are equivalent */
  for (idx_t g = 0; g < groups; ++g) perm[g] = g;
  if (!adj.empty()) {
    idx_t nvtxs = groups, options[METIS_NOPTIONS];
    METIS_SetDefaultOptions(options); /* fixed seed: the ordering is the same in every run */
    const int status = METIS_NodeND(&nvtxs, xadj.data(), adj.data(), NULL, options, perm.data(), inverse.data());
    PetscCheck(status == METIS_OK, PETSC_COMM_SELF, PETSC_ERR_LIB,
               "METIS_NodeND returned %d for a graph of %lld vertices and %zu edges", status, (long long)groups,
               adj.size() / 2);
  }
  for (idx_t g : perm) {
    order->push_back(first[g]);
    if (second[g] >= 0) order->push_back(second[g]);
  }
  PetscFunctionReturn(0);
}

/*
  Row i of L has an entry in column j exactly if j lies on a path of the elimination tree from a neighbour k < i of i up
  to i (Liu 1990). Following these paths, each to the first column already visited in this row, counts every entry of L once and
  builds the tree at the same time: the parent of j is the first i that reaches it.
*/
void LinearCountWork(const LinearGraph &graph, const PetscInt order[], double limit, LinearWork *work,
                     PetscBool *bounded, LinearTree *tree)
{
  const PetscInt        n = graph.n;
  std::vector<PetscInt> place(n), parent(n, -1), met(n, -1), count(n, 1);

  *work    = LinearWork();
  *bounded = PETSC_FALSE;
  for (PetscInt k = 0; k < n; ++k) place[order[k]] = k;
  for (PetscInt i = 0; i < n; ++i) {
    const PetscInt v = order[i];
    met[i]           = i;
    work->factor += 1;
    for (PetscInt k = graph.xadj[v]; k < graph.xadj[v + 1]; ++k)
      for (PetscInt j = place[graph.adj[k]]; j < i && met[j] != i; j = parent[j]) {
        met[j] = i;
        ++count[j];
        work->factor += 1;
        if (parent[j] < 0) parent[j] = i;
      }
    if (work->factor > limit) break;
  }
  for (PetscInt j = 0; j < n; ++j) work->flops += (double)count[j] * (double)count[j];
  if (work->factor <= limit) *bounded = PETSC_TRUE;
  if (tree) {
    tree->place.swap(place);
    tree->parent.swap(parent);
    tree->count.swap(count);
  }
}
