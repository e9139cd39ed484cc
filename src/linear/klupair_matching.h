/* Chooses the pivot of each row, off the diagonal where the diagonal has zeros */
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

/* Extends a matching (-1: unmatched) to a maximum one (Hopcroft, Karp 1973); adds the number of edges visited to *edges_visited */
void LinearMaximumMatching(const LinearBipartite &graph, std::vector<PetscInt> *of_left,
                           std::vector<PetscInt> *of_right, double *edges_visited);

struct LinearPivots {
  std::vector<PetscInt> col;               /* the pivot of row i stands in column col[i]: a permutation */
  PetscInt              zeros         = 0; /* rows without a value on the diagonal */
  PetscInt              pairs         = 0; /* those of these rows that form a pair with a row j: the pivots are a(i,j) and a(j,i) */
  PetscInt              unmatched     = 0; /* rows without a pivot: the matrix is structurally singular */
  double                edges_visited = 0; /* by the search for pivots: a measure of its cost */
};

void LinearFindPivots(const LinearRows &A, LinearPivots *pivots);

#endif
