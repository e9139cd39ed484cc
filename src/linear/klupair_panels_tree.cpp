#if defined(HHTDAE_HAVE_KLU)
#include "klupair_panels_tree.h"
#include <algorithm>

typedef std::vector<PetscInt> Indices;

PetscErrorCode KluPatternExtract(KluPair *k, KluPattern *pattern)
{
  const KluInt        n = k->symbolic->n;
  std::vector<KluInt> Lp(n + 1), Li(k->numeric->lnz), Up(n + 1), Ui(k->numeric->unz);
  std::vector<double> Lx(Li.size()), Ux(Ui.size()); /* KLU returns indices only together with values */

  PetscFunctionBegin;
  const KluInt ok = KLU(extract)(k->numeric, k->symbolic, Lp.data(), Li.data(), Lx.data(), Up.data(), Ui.data(),
                                 Ux.data(), NULL, NULL, NULL, NULL, NULL, NULL, NULL, &k->common);
  PetscCheck(ok, PETSC_COMM_SELF, PETSC_ERR_LIB, "KLU does not give the pattern of its factors, status %d",
             (int)k->common.status);
  Indices &start = pattern->start;
  start.assign(n + 1, 0);
  for (KluInt j = 0; j < n; ++j) {
    start[j + 1] += Lp[j + 1] - Lp[j];
    for (KluInt e = Up[j]; e < Up[j + 1]; ++e) ++start[Ui[e] + 1];
  }
  for (KluInt j = 0; j < n; ++j) start[j + 1] += start[j];
  pattern->index.resize(start[n]);
  Indices next(start.begin(), start.end() - 1);
  for (KluInt j = 0; j < n; ++j) {
    for (KluInt e = Lp[j]; e < Lp[j + 1]; ++e) pattern->index[next[j]++] = Li[e];
    for (KluInt e = Up[j]; e < Up[j + 1]; ++e) pattern->index[next[Ui[e]]++] = j;
  }
  PetscFunctionReturn(0);
}

KluPattern KluPatternPlanned(const LinearRows &rows, const KluPair &k)
{
  Indices    row(rows.n), col(rows.n), block(rows.n), low, high;
  KluPattern pattern;
  for (KluInt b = 0; b < k.symbolic->nblocks; ++b)
    std::fill(block.begin() + k.symbolic->R[b], block.begin() + k.symbolic->R[b + 1], (PetscInt)b);
  for (PetscInt i = 0; i < rows.n; ++i) {
    row[k.symbolic->P[i]] = i;
    col[k.symbolic->Q[i]] = i;
  }
  pattern.start.assign(rows.n + 1, 0);
  for (PetscInt j = 0; j < rows.n; ++j)
    for (PetscInt e = rows.start[j]; e < rows.start[j + 1]; ++e) {
      const PetscInt a = row[rows.col[e]], b = col[j];
      if (a == b || block[a] != block[b]) continue;
      low.push_back(std::min(a, b));
      high.push_back(std::max(a, b));
      ++pattern.start[low.back() + 1];
    }
  for (PetscInt i = 0; i < rows.n; ++i) pattern.start[i + 1] += pattern.start[i];
  pattern.index.resize(low.size());
  Indices next(pattern.start.begin(), pattern.start.end() - 1);
  for (size_t e = 0; e < low.size(); ++e) pattern.index[next[low[e]]++] = high[e];
  return pattern;
}

bool KluTreeEliminate(const KluPattern &pattern, double limit, KluTree *tree)
{
  const PetscInt n = (PetscInt)pattern.start.size() - 1;
  Indices        met(n, -1), child(n, -1), next(n, -1);
  double         entries = 0;

  tree->structure.assign(n, Indices());
  tree->parent.assign(n, -1);
  for (PetscInt k = 0; k < n; ++k) {
    Indices   &s    = tree->structure[k];
    const auto meet = [&](PetscInt i) {
      if (i > k && met[i] != k) s.push_back(i);
      met[i] = k;
    };
    for (PetscInt e = pattern.start[k]; e < pattern.start[k + 1]; ++e) meet(pattern.index[e]);
    for (PetscInt c = child[k]; c >= 0; c = next[c])
      for (PetscInt i : tree->structure[c]) meet(i);
    entries += 2 * (double)s.size();
    if (entries > limit) return false;
    if (s.empty()) continue;
    const PetscInt parent = *std::min_element(s.begin(), s.end());
    tree->parent[k]       = parent;
    next[k]               = child[parent];
    child[parent]         = k;
  }
  return true;
}

Indices KluTreePostorder(const KluTree &tree)
{
  const PetscInt n = (PetscInt)tree.parent.size();
  Indices        child(n, -1), next(n, -1), order, stack;
  for (PetscInt k = n; k-- > 0;)
    if (tree.parent[k] >= 0) {
      next[k]               = child[tree.parent[k]];
      child[tree.parent[k]] = k;
    }
  order.reserve(n);
  for (PetscInt root = 0; root < n; ++root) {
    if (tree.parent[root] >= 0) continue;
    stack.assign(1, root);
    while (!stack.empty()) {
      const PetscInt v = stack.back(), c = child[v];
      if (c >= 0) {
        child[v] = next[c];
        stack.push_back(c);
      } else {
        order.push_back(v);
        stack.pop_back();
      }
    }
  }
  return order;
}

#endif
