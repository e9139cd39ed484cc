/* What the panels of "klupair" are found from: the pattern of the factors and its elimination tree */
#ifndef HHTDAE_LINEAR_KLUPAIR_PANELS_TREE_H
#define HHTDAE_LINEAR_KLUPAIR_PANELS_TREE_H

#include "klupair_panels.h"

/* Off the diagonal, entries of column k of L and of row k of U together, as places */
struct KluPattern {
  std::vector<PetscInt> start, index;
};

struct KluTree {
  std::vector<std::vector<PetscInt>> structure; /* places after each place that its pivot reaches */
  std::vector<PetscInt>              parent;    /* -1 at roots: the last place of a diagonal block, and other ends */
};

/* Of KLU's factors */
PetscErrorCode KluPatternExtract(KluPair *k, KluPattern *pattern);

/* Instead of them, where KLU has factored nothing yet: what M(P,Q) has off the diagonal, in diagonal blocks */
KluPattern KluPatternPlanned(const LinearRows &rows, const KluPair &k);

/* A pivot reaches what it meets itself and what those before hand over to it. False, and structures dropped, when `limit`
   entries are exceeded: panels would be much fuller than KLU's factors */
bool KluTreeEliminate(const KluPattern &pattern, double limit, KluTree *tree);

/* Old place of each new one: everything below a place directly before it. Roots stay in their order, and with them the
   diagonal blocks. */
std::vector<PetscInt> KluTreePostorder(const KluTree &tree);

#endif
