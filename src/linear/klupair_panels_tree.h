/* The pattern of the factors of "klupair" and its elimination tree, from which panels are found */
#ifndef HHTDAE_LINEAR_KLUPAIR_PANELS_TREE_H
#define HHTDAE_LINEAR_KLUPAIR_PANELS_TREE_H

#include "klupair_panels.h"

/* For each place k: places of the off-diagonal entries of column k of L and of row k of U */
struct KluPattern {
  std::vector<PetscInt> start, index;
};

struct KluTree {
  std::vector<std::vector<PetscInt>> structure; /* of each place: the later places that its pivot fills */
  std::vector<PetscInt>              parent;    /* -1 at roots, as the last place of each diagonal block */
};

/* The pattern of KLU's factors */
PetscErrorCode KluPatternExtract(KluPair *k, KluPattern *pattern);

/* The off-diagonal pattern of M(P,Q) within diagonal blocks, for use before KLU has factored anything */
KluPattern KluPatternPlanned(const LinearRows &rows, const KluPair &k);

/* Symbolic elimination: the structure of a pivot is its pattern and the structures of its children. Returns false when there are more than
   `limit` entries: panels would then have much more fill than KLU's factors. */
bool KluTreeEliminate(const KluPattern &pattern, double limit, KluTree *tree);

/* The old place of each new place, such that the descendants of a place directly precede it. Roots keep their order, and so do the
   diagonal blocks. */
std::vector<PetscInt> KluTreePostorder(const KluTree &tree);

#endif
