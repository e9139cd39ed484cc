/* Pivots for "klupair": maximum matchings between rows without a diagonal value and columns, preferring symmetric pairs of large entries */
#include "klupair_matching.h"
#include <algorithm>

typedef std::vector<PetscInt> Indices;

/* ---- maximum matching ---- */

/* Breadth-first search from all unmatched left vertices at once, down to the level of the first unmatched right vertex; false if none is reached */
static bool Levels(const LinearBipartite &G, const Indices &of_left, const Indices &of_right, Indices *level,
                   double *edges_visited)
{
  const PetscInt n = (PetscInt)of_left.size();
  Indices        queue;
  PetscInt       last = PETSC_MAX_INT;

  level->assign(n, -1);
  for (PetscInt l = 0; l < n; ++l)
    if (of_left[l] < 0 && G.start[l] < G.start[l + 1]) {
      (*level)[l] = 0;
      queue.push_back(l);
    }
  for (size_t head = 0; head < queue.size(); ++head) {
    const PetscInt l = queue[head];
    if ((*level)[l] >= last) break;
    for (PetscInt k = G.start[l]; k < G.start[l + 1]; ++k) {
      const PetscInt owner = of_right[G.adj[k]];
      *edges_visited += 1;
      if (owner < 0)
        last = (*level)[l] + 1;
      else if ((*level)[owner] < 0) {
        (*level)[owner] = (*level)[l] + 1;
        queue.push_back(owner);
      }
    }
  }
  return last < PETSC_MAX_INT;
}

/* Depth-first search for an augmenting path along the levels. next[l] only advances, so that all searches of a sweep together visit every
   edge once. The stack is explicit because paths can be as long as a chain of bodies. */
static bool Augment(const LinearBipartite &G, PetscInt root, Indices *of_left, Indices *of_right, Indices *level,
                    Indices *next, double *edges_visited)
{
  Indices path(1, root);
  while (!path.empty()) {
    const PetscInt l = path.back();
    if ((*next)[l] == G.start[l + 1]) {
      (*level)[l] = -1;
      path.pop_back();
      continue;
    }
    const PetscInt owner = (*of_right)[G.adj[(*next)[l]++]];
    *edges_visited += 1;
    if (owner < 0) {
      for (PetscInt v : path) {
        const PetscInt r = G.adj[(*next)[v] - 1];
        (*of_left)[v]    = r;
        (*of_right)[r]   = v;
        (*level)[v]      = -1; /* paths of one sweep share no vertex */
      }
      return true;
    }
    if ((*level)[owner] == (*level)[l] + 1) path.push_back(owner);
  }
  return false;
}

void LinearMaximumMatching(const LinearBipartite &graph, Indices *of_left, Indices *of_right, double *edges_visited)
{
  Indices level;
  while (Levels(graph, *of_left, *of_right, &level, edges_visited)) {
    Indices next(graph.start.begin(), graph.start.end() - 1);
    for (PetscInt l = 0; l < (PetscInt)of_left->size(); ++l)
      if ((*of_left)[l] < 0 && level[l] == 0) Augment(graph, l, of_left, of_right, &level, &next, edges_visited);
  }
}

/* ---- initial matching ---- */

static LinearBipartite Transpose(const LinearBipartite &G)
{
  LinearBipartite T;
  const PetscInt  left = (PetscInt)G.start.size() - 1;
  T.right              = left;
  T.start.assign(G.right + 1, 0);
  T.adj.resize(G.adj.size());
  for (PetscInt r : G.adj) ++T.start[r + 1];
  for (PetscInt r = 0; r < G.right; ++r) T.start[r + 1] += T.start[r];
  Indices next(T.start.begin(), T.start.end() - 1);
  for (PetscInt l = 0; l < left; ++l)
    for (PetscInt k = G.start[l]; k < G.start[l + 1]; ++k) T.adj[next[G.adj[k]]++] = l;
  return T;
}

/*
  Matches left vertices with the fewest unmatched neighbours first (Karp, Sipser 1981), each with the neighbour of the largest
  weight per adjacent left vertex. Buckets hold the left vertices by their number of unmatched neighbours; outdated entries
  of buckets are skipped.
*/
static void GreedyMatching(const LinearBipartite &G, const std::vector<PetscReal> &weight, Indices *of_left,
                           Indices *of_right, double *edges_visited)
{
  const LinearBipartite T    = Transpose(G);
  const PetscInt        left = (PetscInt)of_left->size();
  Indices               free_count(left);
  std::vector<Indices>  bucket;

  for (PetscInt l = 0; l < left; ++l) {
    free_count[l] = G.start[l + 1] - G.start[l];
    if (free_count[l] >= (PetscInt)bucket.size()) bucket.resize(free_count[l] + 1);
    bucket[free_count[l]].push_back(l);
  }
  for (size_t b = 1; b < bucket.size();) {
    if (bucket[b].empty()) {
      ++b;
      continue;
    }
    const PetscInt l = bucket[b].back();
    bucket[b].pop_back();
    if ((*of_left)[l] >= 0 || free_count[l] != (PetscInt)b) continue;
    PetscInt  best       = -1;
    PetscReal best_score = -1;
    for (PetscInt k = G.start[l]; k < G.start[l + 1]; ++k) {
      const PetscInt r = G.adj[k];
      *edges_visited += 1;
      if ((*of_right)[r] >= 0) continue;
      const PetscReal s = weight[k] / (PetscReal)(T.start[r + 1] - T.start[r]);
      if (s > best_score) {
        best_score = s;
        best       = r;
      }
    }
    (*of_left)[l]     = best;
    (*of_right)[best] = l;
    for (PetscInt k = T.start[best]; k < T.start[best + 1]; ++k) {
      const PetscInt other = T.adj[k];
      *edges_visited += 1;
      if ((*of_left)[other] >= 0 || --free_count[other] == 0) continue;
      bucket[free_count[other]].push_back(other);
      b = std::min(b, (size_t)free_count[other]);
    }
  }
}

/* ---- pairs ---- */

static PetscReal Size(const LinearRows &A, PetscInt i, PetscInt j)
{
  const PetscInt *first = A.col + A.start[i], *last = A.col + A.start[i + 1], *at = std::lower_bound(first, last, j);
  return at < last && *at == j ? PetscAbsScalar(A.val[at - A.col]) : 0;
}

/* Graph of possible pairs: joins unknowns without a diagonal value to those with one where a(i,j) and a(j,i) are both nonzero. The weight is
   sqrt|a(i,j) a(j,i)|, divided by the largest of the row. */
static void CollectPairs(const LinearRows &A, const Indices &zeros, const std::vector<bool> &is_zero, LinearBipartite *G,
                         std::vector<PetscReal> *weight)
{
  G->right = A.n;
  G->start.assign(1, 0);
  for (PetscInt z : zeros) {
    const size_t first   = G->adj.size();
    PetscReal    largest = 0;
    for (PetscInt k = A.start[z]; k < A.start[z + 1]; ++k) {
      const PetscInt  j = A.col[k];
      const PetscReal w = is_zero[j] ? 0 : PetscSqrtReal(PetscAbsScalar(A.val[k])) * PetscSqrtReal(Size(A, j, z));
      if (!(w > 0)) continue;
      G->adj.push_back(j);
      weight->push_back(w);
      largest = std::max(largest, w);
    }
    for (size_t k = first; k < weight->size(); ++k) (*weight)[k] /= largest;
    G->start.push_back((PetscInt)G->adj.size());
  }
}

static void KeepLarge(const LinearBipartite &all, const std::vector<PetscReal> &weight, PetscReal least,
                      LinearBipartite *large, std::vector<PetscReal> *large_weight)
{
  large->right = all.right;
  large->start.assign(1, 0);
  for (size_t l = 0; l + 1 < all.start.size(); ++l) {
    for (PetscInt k = all.start[l]; k < all.start[l + 1]; ++k)
      if (weight[k] >= least) {
        large->adj.push_back(all.adj[k]);
        large_weight->push_back(weight[k]);
      }
    large->start.push_back((PetscInt)large->adj.size());
  }
}

/* Pairs of a smaller weight, relative to the largest of the row, are taken only if the maximum matching needs them. KluPairPivots.LargeEntryIsPreferred. */
static const PetscReal MIN_PAIR_WEIGHT = 0.1;

static void PairZeros(const LinearRows &A, const Indices &zeros, const std::vector<bool> &is_zero, LinearPivots *pivots)
{
  LinearBipartite        all, large;
  std::vector<PetscReal> weight, large_weight;
  Indices                of_zero(zeros.size(), -1), of_col(A.n, -1);

  CollectPairs(A, zeros, is_zero, &all, &weight);
  KeepLarge(all, weight, MIN_PAIR_WEIGHT, &large, &large_weight);
  GreedyMatching(large, large_weight, &of_zero, &of_col, &pivots->edges_visited);
  LinearMaximumMatching(large, &of_zero, &of_col, &pivots->edges_visited);
  LinearMaximumMatching(all, &of_zero, &of_col, &pivots->edges_visited);
  for (size_t k = 0; k < zeros.size(); ++k)
    if (of_zero[k] >= 0) {
      pivots->col[zeros[k]]   = of_zero[k];
      pivots->col[of_zero[k]] = zeros[k];
      ++pivots->pairs;
    }
}

/* Pairs coupled unknowns that both have no diagonal value and no partner yet */
static void PairAmongZeros(const LinearRows &A, const Indices &zeros, LinearPivots *pivots)
{
  for (PetscInt z : zeros) {
    PetscInt  best    = -1;
    PetscReal largest = 0;
    for (PetscInt k = A.start[z]; k < A.start[z + 1] && pivots->col[z] < 0; ++k) {
      const PetscInt j = A.col[k];
      if (j == z || pivots->col[j] >= 0) continue;
      const PetscReal w = PetscSqrtReal(PetscAbsScalar(A.val[k])) * PetscSqrtReal(Size(A, j, z));
      pivots->edges_visited += 1;
      if (w <= largest) continue;
      largest = w;
      best    = j;
    }
    if (best < 0) continue;
    pivots->col[z]    = best;
    pivots->col[best] = z;
    pivots->pairs += 2;
  }
}

/* ---- rows that no pair covers: matching of rows and columns ---- */

static void MatchRows(const LinearRows &A, bool values, LinearPivots *pivots)
{
  LinearBipartite G;
  Indices         of_col(A.n, -1);
  G.right = A.n;
  G.start.assign(1, 0);
  for (PetscInt i = 0; i < A.n; ++i) {
    for (PetscInt k = A.start[i]; k < A.start[i + 1]; ++k)
      if (!values || PetscAbsScalar(A.val[k]) > 0) G.adj.push_back(A.col[k]);
    G.start.push_back((PetscInt)G.adj.size());
    if (pivots->col[i] >= 0) of_col[pivots->col[i]] = i;
  }
  LinearMaximumMatching(G, &pivots->col, &of_col, &pivots->edges_visited);
}

/* Structurally singular: any permutation does */
static void AssignRemainingColumns(LinearPivots *pivots)
{
  std::vector<bool> taken(pivots->col.size(), false);
  for (PetscInt c : pivots->col)
    if (c >= 0) taken[c] = true;
  PetscInt next = 0;
  for (PetscInt &c : pivots->col) {
    if (c >= 0) continue;
    while (taken[next]) ++next;
    c = next++;
    ++pivots->unmatched;
  }
}

void LinearFindPivots(const LinearRows &A, LinearPivots *pivots)
{
  Indices           zeros;
  std::vector<bool> is_zero(A.n, false);

  *pivots = LinearPivots();
  pivots->col.resize(A.n);
  for (PetscInt i = 0; i < A.n; ++i) {
    is_zero[i]     = !(Size(A, i, i) > 0);
    pivots->col[i] = is_zero[i] ? -1 : i;
    if (is_zero[i]) zeros.push_back(i);
  }
  pivots->zeros = (PetscInt)zeros.size();
  if (zeros.empty()) return;
  const auto complete = [pivots] { return std::find(pivots->col.begin(), pivots->col.end(), -1) == pivots->col.end(); };
  PairZeros(A, zeros, is_zero, pivots);
  if (!complete()) PairAmongZeros(A, zeros, pivots);
  if (!complete()) MatchRows(A, true, pivots);
  if (!complete()) MatchRows(A, false, pivots); /* zeros stored in the pattern may get values later */
  if (!complete()) AssignRemainingColumns(pivots);
}
