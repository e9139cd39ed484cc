/* The analysis of "klupair": finds pivots, orders the groups of unknowns that exchange their pivots, and passes both permutations to KLU */
#if defined(HHTDAE_HAVE_KLU)
#include "klupair_data.h"
#include <algorithm>

/* METIS nested dissection is tried only where AMD predicts more than this many operations of L D L^T per unknown: chains stay
   below (some 10), plates of bricks exceed it (5000; table in README.md) */
static const double METIS_FLOPS_PER_UNKNOWN = 1000;

/* An ordering with more entries in L is not counted to the end, and loses the comparison */
static const double MAX_COUNTED_ENTRIES = 1e9;

/* Pivots are planned anew if L and U have more than this multiple of the predicted entries: row exchanges during the
   factorization show that the planned pivots no longer fit the values. KluPair.PlansAnewWhenTheFillGrows. */
static const double REPLAN_FILL = 1.5;

/* Bound on KLU's search for diagonal blocks (BTF), in multiples of the entries of the matrix: it is quadratic in the worst case */
static const double MAX_BTF_WORK = 10;

namespace
{

/* The cycles of the permutation of pivots: single unknowns, pairs, rarely more. Group g has the members members[start[g]] to
   members[start[g + 1] - 1]. */
struct Groups {
  std::vector<PetscInt> group_of, start, members;
};

} // namespace

static Groups FindGroups(const std::vector<PetscInt> &pivot)
{
  Groups         g;
  const PetscInt n = (PetscInt)pivot.size();
  g.group_of.assign(n, -1);
  g.start.assign(1, 0);
  for (PetscInt i = 0; i < n; ++i) {
    if (g.group_of[i] >= 0) continue;
    const PetscInt group = (PetscInt)g.start.size() - 1;
    for (PetscInt j = i; g.group_of[j] < 0; j = pivot[j]) {
      g.group_of[j] = group;
      g.members.push_back(j);
    }
    g.start.push_back((PetscInt)g.members.size());
  }
  return g;
}

/* The graph of the groups */
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
      for (PetscInt k = graph.xadj[g.members[m]]; k < graph.xadj[g.members[m] + 1]; ++k) {
        const PetscInt other = g.group_of[graph.adj[k]];
        if (seen[other] != v) c.adj.push_back(other);
        seen[other] = v;
      }
    std::sort(c.adj.begin() + c.xadj[v], c.adj.end());
    c.xadj.push_back((PetscInt)c.adj.size());
  }
  return c;
}

/* The order of the unknowns that follows from an order of the groups */
static std::vector<PetscInt> Expand(const Groups &g, const std::vector<PetscInt> &order)
{
  std::vector<PetscInt> unknowns;
  unknowns.reserve(g.members.size());
  for (PetscInt v : order)
    unknowns.insert(unknowns.end(), g.members.begin() + g.start[v], g.members.begin() + g.start[v + 1]);
  return unknowns;
}

static PetscErrorCode OrderByAMD(const LinearGraph &c, std::vector<PetscInt> *order)
{
  PetscFunctionBegin;
  order->resize(c.n);
  const KluInt dummy = 0; /* AMD refuses a null pointer even if there are no entries */
  const int    status =
      (int)AMD(order)((KluInt)c.n, KluIndices(c.xadj.data()), c.adj.empty() ? &dummy : KluIndices(c.adj.data()),
                      KluIndices(order->data()), NULL, NULL);
  PetscCheck(status == AMD_OK || status == AMD_OK_BUT_JUMBLED, PETSC_COMM_SELF,
             status == AMD_OUT_OF_MEMORY ? PETSC_ERR_MEM : PETSC_ERR_LIB,
             "AMD returned %d for a graph of %" PetscInt_FMT " vertices and %zu edges", status, c.n, c.adj.size() / 2);
  PetscFunctionReturn(0);
}

/* Groups in the order of their first unknown in PETSc's order */
static std::vector<PetscInt> OrderAsGiven(const Groups &g, const std::vector<PetscInt> &given_order)
{
  std::vector<PetscInt> order;
  std::vector<bool>     done(g.start.size(), false);
  for (PetscInt i : given_order)
    if (!done[g.group_of[i]]) {
      done[g.group_of[i]] = true;
      order.push_back(g.group_of[i]);
    }
  return order;
}

/*
  Level by level from far to near the coupled unknowns: a chain is eliminated from its free end, so that the interface is
  coupled to the last few columns of L only. Groups that no path joins to coupled unknowns come first, in the order `others`.
*/
static std::vector<PetscInt> OrderTowardsInterface(const LinearGraph &c, const Groups &g, const std::vector<PetscInt> &coupled_unknowns,
                                                   const std::vector<PetscInt> &others)
{
  std::vector<PetscInt> breadth_first;
  std::vector<bool>     met(c.n, false);
  const auto            meet = [&](PetscInt v) {
    if (!met[v]) breadth_first.push_back(v);
    met[v] = true;
  };
  breadth_first.reserve(c.n);
  for (PetscInt i : coupled_unknowns) meet(g.group_of[i]);
  for (size_t head = 0; head < breadth_first.size(); ++head)
    for (PetscInt k = c.xadj[breadth_first[head]]; k < c.xadj[breadth_first[head] + 1]; ++k) meet(c.adj[k]);
  std::vector<PetscInt> order;
  order.reserve(c.n);
  for (PetscInt v : others)
    if (!met[v]) order.push_back(v);
  order.insert(order.end(), breadth_first.rbegin(), breadth_first.rend());
  return order;
}

namespace
{

/* An order and its cost in operations: the factorization and, for the interface, two sweeps over the columns of L that the
   coupled unknowns reach, and the product for the Schur complement */
struct WeighedOrder {
  const char           *name;
  std::vector<PetscInt> order;
  LinearWork            work;
  double                reached = 0, entries = 0, total = PETSC_MAX_REAL;
};

} // namespace

static void CountReachedColumns(const LinearTree &tree, const std::vector<PetscInt> &coupled_unknowns, WeighedOrder *c)
{
  std::vector<bool> met(tree.parent.size(), false);
  for (PetscInt i : coupled_unknowns)
    for (PetscInt j = tree.place[i]; j >= 0 && !met[j]; j = tree.parent[j]) {
      met[j] = true;
      c->reached += 1;
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
  LinearCountWork(graph, c.order.data(), MAX_COUNTED_ENTRIES, &c.work, &bounded, k.coupled_unknowns.empty() ? NULL : &tree);
  if (!bounded) return c;
  if (!k.coupled_unknowns.empty()) CountReachedColumns(tree, k.coupled_unknowns, &c);
  c.total = 2 * c.work.flops + (2 * c.entries + c.reached * (double)k.interface_size) * (double)k.interface_size;
  return c;
}

/* Chooses the order of the unknowns; its work is stored in k */
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
  if (!k->given_order.empty()) {
    best = Weigh("given by PETSc", graph, g, OrderAsGiven(g, k->given_order), *k);
  } else if (k->ordering == KLUPAIR_METIS) {
    PetscCall(LinearMetisOrder(c, {}, &groups));
    best = Weigh("METIS", graph, g, groups, *k);
  } else {
    PetscCall(OrderByAMD(c, &groups));
    best = Weigh("AMD", graph, g, groups, *k);
    if (k->ordering == KLUPAIR_AUTO && !k->coupled_unknowns.empty())
      try_this("towards the ends", OrderTowardsInterface(c, g, k->coupled_unknowns, groups));
    const bool try_metis =
        best.total >= 2 * METIS_FLOPS_PER_UNKNOWN * (double)graph.n || 2 * best.entries * (double)k->interface_size > best.work.flops;
    if (k->ordering == KLUPAIR_AUTO && try_metis) {
      PetscCall(LinearMetisOrder(c, {}, &groups));
      try_this("METIS", groups);
    }
  }
  k->ordering_used   = best.name;
  k->work            = best.work;
  k->reached_columns = best.reached;
  k->reached_entries = best.entries;
  order->swap(best.order);
  PetscFunctionReturn(0);
}

/*
  The permutations P and Q for KLU, which factors the transpose: its columns are the rows of A. The pivots of a pair
  (q, lambda) are a(q,q) and the Schur complement at (lambda,lambda) if the diagonal entry is the largest of the pair, and
  a(q,lambda), a(lambda,q) otherwise. The fill is the same.
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
    const PetscInt v = g.group_of[order[k]], count = g.start[v + 1] - g.start[v];
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
  A reducible matrix falls into diagonal blocks (BTF) that are solved one after the other, as where some unknowns are
  only computed from others. KLU's own analysis is taken if it finds several blocks and predicts less fill. Only for matrices
  with a full diagonal: for others KLU's search for pivots is slow (klupair.h).
*/
static void TryBlocks(const LinearRows &rows, KluPair *k)
{
  if (k->pivots.zeros || k->single_block || !k->given_order.empty() || k->ordering != KLUPAIR_AUTO) return;
  const double unlimited = k->common.maxwork;
  k->common.btf          = 1;
  k->common.maxwork      = MAX_BTF_WORK;
  k->symbolic            = KLU(analyze)((KluInt)rows.n, KluIndices(rows.start), KluIndices(rows.col), &k->common);
  k->common.maxwork      = unlimited;
  k->common.btf          = 0;
  if (!k->symbolic) return;
  const double entries      = k->symbolic->lnz + k->symbolic->unz;
  const bool   single_block = k->symbolic->structural_rank == (KluInt)rows.n;
  if (single_block && k->symbolic->nblocks > 1 && entries < 2 * k->work.factor) {
    k->ordering_used = "AMD in diagonal blocks";
    k->work.factor   = 0.5 * entries;
    k->work.flops    = k->symbolic->est_flops / 2;
  } else
    KLU(free_symbolic)(&k->symbolic, &k->common);
}

static PetscErrorCode AnalyseWithOrder(const LinearRows &rows, const Groups &g, const std::vector<PetscInt> &order,
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
    k->symbolic->Lnz[b] = k->work.factor; /* determines KLU's first allocation */
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
  if (!k->symbolic) PetscCall(AnalyseWithOrder(rows, g, order, k));
  k->replan_entries = REPLAN_FILL * 2 * k->work.factor;
  ++k->analyses;
  PetscCall(PetscInfo(A,
                      "%" PetscInt_FMT " rows without diagonal, %" PetscInt_FMT " in pairs, %" PetscInt_FMT
                      " without a pivot, found in %g looks; %s: %g entries in L, %g operations\n",
                      k->pivots.zeros, k->pivots.pairs, k->pivots.unmatched, k->pivots.edges_visited, k->ordering_used,
                      k->work.factor, k->work.flops));
  PetscFunctionReturn(0);
}

#endif
