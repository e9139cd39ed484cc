/* Which entry becomes the pivot of each row, where the diagonal has zeros */
#ifndef HHTDAE_LINEAR_KLUPAIR_MATCHING_H
#define HHTDAE_LINEAR_KLUPAIR_MATCHING_H

#include <petscmat.h>
#include <vector>

/* Rows of a SEQAIJ matrix, columns ascending */
struct LinearRows {
  PetscInt           n;
  const PetscInt    *start, *col;
  const PetscScalar *val;
};

/* Left vertex l is joined to adj[start[l]] to adj[start[l+1]-1] */
struct LinearBipartite {
  PetscInt              right = 0;
  std::vector<PetscInt> start, adj;
};

/* Extends a matching (-1: free) to a largest one; *looked grows by the number of edges looked at (Hopcroft, Karp 1973)
 */
void LinearMaximumMatching(const LinearBipartite &graph, std::vector<PetscInt> *of_left,
                           std::vector<PetscInt> *of_right, double *looked);

struct LinearPivots {
  std::vector<PetscInt> col;       /* the pivot of row i stands in column col[i]: a permutation */
  PetscInt              zeros = 0; /* rows without a value on the diagonal */
  PetscInt              pairs = 0; /* ... of which so many have the pivots a(i,j) and a(j,i) together with a row j */
  PetscInt              unmatched = 0; /* rows left without any pivot: the matrix is singular by its pattern */
  double                looked    = 0; /* entries looked at by the search, to show what it costs */
};

void LinearFindPivots(const LinearRows &A, LinearPivots *pivots);

#endif
