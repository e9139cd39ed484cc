/* The analysis of "klupair": pivots, an ordering of the groups of unknowns that share them, and both as KLU wants them
 */
#if defined(HHTDAE_HAVE_KLU)
#include "klupair_data.h"
#include <algorithm>

/* METIS is tried where AMD foresees so many operations per unknown: a chain stays below, a plate does not */
static const double TRY_METIS = 1000;

/* An ordering with more entries than this is not compared any further */
static const double COUNT_LIMIT = 1e9;

/* Fill beyond this multiple of what was foreseen means that the pivots no longer fit the values */
static const double TOO_MUCH_FILL = 1.5;

/* Bound on KLU's search for diagonal blocks, in multiples of the entries of the matrix */
static const double BLOCK_SEARCH = 10;

namespace
{

/* The cycles of the permutation of pivots: single unknowns, pairs, rarely more */
struct Groups {
  std::vector<PetscInt> of, start, member;
};

} // namespace

static Groups FindGroups(const std::vector<PetscInt> &pivot)
{
  Groups         g;
  const PetscInt n = (PetscInt)pivot.size();
  g.of.assign(n, -1);
  g.start.assign(1, 0);
  for (PetscInt i = 0; i < n; ++i) {
    if (g.of[i] >= 0) continue;
    const PetscInt group = (PetscInt)g.start.size() - 1;
    for (PetscInt j = i; g.of[j] < 0; j = pivot[j]) {
      g.of[j] = group;
      g.member.push_back(j);
    }
    g.start.push_back((PetscInt)g.member.size());
  }
  return g;
}

static LinearGraph Compress(const LinearGraph &graph, const Groups &g)
{
  LinearGraph           c;
  std::vector<PetscInt> seen;
  c.n = (PetscInt)g.start.size() - 1;
  c.xadj.assign(1, 0);
  seen.assign(c.n, -1);
  for (PetscInt v = 0; v < c.n; ++v) {
    seen[v] = v;
    for (PetscInt m = g.start[v]; m < g.start[v + 1]; ++m)
      for (PetscInt k = graph.xadj[g.member[m]]; k < graph.xadj[g.member[m] + 1]; ++k) {
        const PetscInt other = g.of[graph.adj[k]];
        if (seen[other] != v) c.adj.push_back(other);
        seen[other] = v;
      }
    std::sort(c.adj.begin() + c.xadj[v], c.adj.end());
    c.xadj.push_back((PetscInt)c.adj.size());
  }
  return c;
}

static std::vector<PetscInt> Expand(const Groups &g, const std::vector<PetscInt> &order)
{
  std::vector<PetscInt> unknowns;
  unknowns.reserve(g.member.size());
  for (PetscInt v : order)
    unknowns.insert(unknowns.end(), g.member.begin() + g.start[v], g.member.begin() + g.start[v + 1]);
  return unknowns;
}

static PetscErrorCode OrderByAMD(const LinearGraph &c, std::vector<PetscInt> *order)
{
  PetscFunctionBegin;
  order->resize(c.n);
  const KluInt dummy = 0; /* AMD refuses a null pointer even where there are no entries */
  const int    status =
      (int)AMD(order)((KluInt)c.n, KluIndices(c.xadj.data()), c.adj.empty() ? &dummy : KluIndices(c.adj.data()),
                      KluIndices(order->data()), NULL, NULL);
  PetscCheck(status == AMD_OK || status == AMD_OK_BUT_JUMBLED, PETSC_COMM_SELF,
             status == AMD_OUT_OF_MEMORY ? PETSC_ERR_MEM : PETSC_ERR_LIB,
             "AMD returned %d for a graph of %" PetscInt_FMT " vertices and %zu edges", status, c.n, c.adj.size() / 2);
  PetscFunctionReturn(0);
}

/* Groups by their first unknown in the order that PETSc gave */
static std::vector<PetscInt> OrderAsGiven(const Groups &g, const std::vector<PetscInt> &given)
{
  std::vector<PetscInt> order;
  std::vector<bool>     done(g.start.size(), false);
  for (PetscInt i : given)
    if (!done[g.of[i]]) {
      done[g.of[i]] = true;
      order.push_back(g.of[i]);
    }
  return order;
}

/*
  From far to near the ends, level by level: a chain that ends at the outside is eaten up from its free end, so that the
  outside meets only the last few columns. Groups that no path joins to the ends come first, in the order that is there.
*/
static std::vector<PetscInt> OrderTowards(const LinearGraph &c, const Groups &g, const std::vector<PetscInt> &ends,
                                          const std::vector<PetscInt> &others)
{
  std::vector<PetscInt> near;
  std::vector<bool>     met(c.n, false);
  const auto            meet = [&](PetscInt v) {
    if (!met[v]) near.push_back(v);
    met[v] = true;
  };
  near.reserve(c.n);
  for (PetscInt i : ends) meet(g.of[i]);
  for (size_t head = 0; head < near.size(); ++head)
    for (PetscInt k = c.xadj[near[head]]; k < c.xadj[near[head] + 1]; ++k) meet(c.adj[k]);
  std::vector<PetscInt> order;
  order.reserve(c.n);
  for (PetscInt v : others)
    if (!met[v]) order.push_back(v);
  order.insert(order.end(), near.rbegin(), near.rend());
  return order;
}

namespace
{

/* An order and what it costs: the factorization and, for the outside, two sweeps over the columns of L that the ends
 * reach */
struct WeighedOrder {
  const char           *name;
  std::vector<PetscInt> order;
  LinearWork            work;
  double                columns = 0, entries = 0, total = PETSC_MAX_REAL;
};

} // namespace

static void FollowPaths(const LinearTree &tree, const std::vector<PetscInt> &ends, WeighedOrder *c)
{
  std::vector<bool> met(tree.parent.size(), false);
  for (PetscInt i : ends)
    for (PetscInt j = tree.place[i]; j >= 0 && !met[j]; j = tree.parent[j]) {
      met[j] = true;
      c->columns += 1;
      c->entries += (double)tree.count[j];
    }
}

static WeighedOrder Weigh(const char *name, const LinearGraph &graph, const Groups &g,
                          const std::vector<PetscInt> &groups, const KluPair &k)
{
  WeighedOrder c;
  LinearTree   tree;
  PetscBool    bounded;
  c.name  = name;
  c.order = Expand(g, groups);
  LinearCountWork(graph, c.order.data(), COUNT_LIMIT, &c.work, &bounded, k.ends.empty() ? NULL : &tree);
  if (!bounded) return c;
  if (!k.ends.empty()) FollowPaths(tree, k.ends, &c);
  c.total = 2 * c.work.flops + (2 * c.entries + c.columns * (double)k.width) * (double)k.width;
  return c;
}

/* Leaves the order of the unknowns in *order and the work it takes in k */
static PetscErrorCode Order(const LinearGraph &graph, const Groups &g, KluPair *k, std::vector<PetscInt> *order)
{
  const LinearGraph     c = Compress(graph, g);
  std::vector<PetscInt> groups;
  WeighedOrder          best;
  const auto            try_this = [&](const char *name, const std::vector<PetscInt> &by_groups) {
    WeighedOrder other = Weigh(name, graph, g, by_groups, *k);
    if (other.total < best.total) std::swap(best, other);
  };

  PetscFunctionBegin;
  if (!k->given.empty()) {
    best = Weigh("given by PETSc", graph, g, OrderAsGiven(g, k->given), *k);
  } else if (k->ordering == KLUPAIR_METIS) {
    PetscCall(LinearMetisOrder(c, {}, &groups));
    best = Weigh("METIS", graph, g, groups, *k);
  } else {
    PetscCall(OrderByAMD(c, &groups));
    best = Weigh("AMD", graph, g, groups, *k);
    if (k->ordering == KLUPAIR_AUTO && !k->ends.empty())
      try_this("towards the ends", OrderTowards(c, g, k->ends, groups));
    const bool much =
        best.total >= 2 * TRY_METIS * (double)graph.n || 2 * best.entries * (double)k->width > best.work.flops;
    if (k->ordering == KLUPAIR_AUTO && much) {
      PetscCall(LinearMetisOrder(c, {}, &groups));
      try_this("METIS", groups);
    }
  }
  k->ordering_used = best.name;
  k->work          = best.work;
  k->path_columns  = best.columns;
  k->path_entries  = best.entries;
  order->swap(best.order);
  PetscFunctionReturn(0);
}

/*
  KLU factors the transpose: its columns are our rows. A pair (q, lambda) is taken with the pivots a(q,q) and what is
  left at (lambda,lambda) where the diagonal is the larger, and with a(q,lambda), a(lambda,q) otherwise. The entries
  that fill in are the same.
*/
static void Permutations(const LinearRows &A, const Groups &g, const std::vector<PetscInt> &order,
                         const std::vector<PetscInt> &pivot, std::vector<PetscInt> *P, std::vector<PetscInt> *Q)
{
  const auto size = [&A](PetscInt i, PetscInt j) {
    for (PetscInt k = A.start[i]; k < A.start[i + 1]; ++k)
      if (A.col[k] == j) return PetscAbsScalar(A.val[k]);
    return (PetscReal)0;
  };
  Q->clear();
  P->clear();
  for (size_t k = 0; k < order.size();) {
    const PetscInt v = g.of[order[k]], count = g.start[v + 1] - g.start[v];
    PetscInt       i = order[k], j = pivot[i];
    if (count == 2) {
      if (size(i, i) < size(j, j)) std::swap(i, j);
      const bool diagonal = size(i, i) >= PetscMax(size(i, j), size(j, i)) && size(i, i) > 0;
      Q->insert(Q->end(), {i, j});
      if (diagonal)
        P->insert(P->end(), {i, j});
      else
        P->insert(P->end(), {j, i});
    } else
      for (PetscInt m = 0; m < count; ++m) {
        Q->push_back(order[k + m]);
        P->push_back(pivot[order[k + m]]);
      }
    k += count;
  }
}

/*
  A matrix with a full diagonal can fall into blocks that are solved one after the other, as where some unknowns are
  only computed from others. KLU finds the blocks by itself, with a bound on the search that is quadratic at its worst.
*/
static void TryBlocks(const LinearRows &rows, KluPair *k)
{
  if (k->pivots.zeros || k->whole || !k->given.empty() || k->ordering != KLUPAIR_AUTO) return;
  const double unlimited = k->common.maxwork;
  k->common.btf          = 1;
  k->common.maxwork      = BLOCK_SEARCH;
  k->symbolic            = KLU(analyze)((KluInt)rows.n, KluIndices(rows.start), KluIndices(rows.col), &k->common);
  k->common.maxwork      = unlimited;
  k->common.btf          = 0;
  if (!k->symbolic) return;
  const double entries = k->symbolic->lnz + k->symbolic->unz;
  const bool   whole   = k->symbolic->structural_rank == (KluInt)rows.n;
  if (whole && k->symbolic->nblocks > 1 && entries < 2 * k->work.factor) {
    k->ordering_used = "AMD in diagonal blocks";
    k->work.factor   = 0.5 * entries;
    k->work.flops    = k->symbolic->est_flops / 2;
  } else
    KLU(free_symbolic)(&k->symbolic, &k->common);
}

static PetscErrorCode AnalyseGiven(const LinearRows &rows, const Groups &g, const std::vector<PetscInt> &order,
                                   KluPair *k)
{
  std::vector<PetscInt> P, Q;

  PetscFunctionBegin;
  Permutations(rows, g, order, k->pivots.col, &P, &Q);
  k->common.btf = 0;
  k->symbolic   = KLU(analyze_given)((KluInt)rows.n, KluIndices(rows.start), KluIndices(rows.col), KluIndices(P.data()),
                                   KluIndices(Q.data()), &k->common);
  PetscCheck(k->symbolic, PETSC_COMM_SELF, k->common.status == KLU_OUT_OF_MEMORY ? PETSC_ERR_MEM : PETSC_ERR_LIB,
             "KLU's analysis of the matrix with %" PetscInt_FMT " rows failed with status %d", rows.n,
             (int)k->common.status);
  for (KluInt b = 0; b < k->symbolic->nblocks; ++b)
    k->symbolic->Lnz[b] = k->work.factor; /* how much KLU allocates at first */
  PetscFunctionReturn(0);
}

PetscErrorCode KluPairAnalyse(Mat A, const LinearRows &rows, KluPair *k)
{
  LinearGraph           graph;
  PetscBool             done;
  std::vector<PetscInt> order;

  PetscFunctionBegin;
  KLU(free_numeric)(&k->numeric, &k->common);
  KLU(free_symbolic)(&k->symbolic, &k->common);
  PetscCall(LinearGraphFromMat(A, &graph, &done));
  LinearFindPivots(rows, &k->pivots);
  const Groups g = FindGroups(k->pivots.col);
  PetscCall(Order(graph, g, k, &order));
  TryBlocks(rows, k);
  if (!k->symbolic) PetscCall(AnalyseGiven(rows, g, order, k));
  k->tolerated = TOO_MUCH_FILL * 2 * k->work.factor;
  ++k->analyses;
  PetscCall(PetscInfo(A,
                      "%" PetscInt_FMT " rows without diagonal, %" PetscInt_FMT " in pairs, %" PetscInt_FMT
                      " without a pivot, found in %g looks; %s: %g entries in L, %g operations\n",
                      k->pivots.zeros, k->pivots.pairs, k->pivots.unmatched, k->pivots.looked, k->ordering_used,
                      k->work.factor, k->work.flops));
  PetscFunctionReturn(0);
}

#endif
