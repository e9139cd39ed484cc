/*
  The pattern of a matrix as an undirected graph on one process, its METIS ordering, and the work of a factorization
  in a given order.
*/
#ifndef HHTDAE_LINEAR_GRAPH_H
#define HHTDAE_LINEAR_GRAPH_H

#include <petscmat.h>
#include <vector>

/* Neighbours of i are adj[xadj[i]] to adj[xadj[i+1]-1], ascending, each once and without i itself */
struct LinearGraph {
  PetscInt              n = 0;
  std::vector<PetscInt> xadj, adj;
};

/* The graph of a matrix from all entries (row[k], col[k]) or those of one triangle; indices start at base */
template <typename Index>
void LinearGraphFromEntries(PetscInt n, size_t count, const Index row[], const Index col[], Index base,
                            LinearGraph *graph);

/* The graph of a SEQAIJ matrix, or of the blocks of a SEQBAIJ or SEQSBAIJ matrix; *done = PETSC_FALSE if MatGetRowIJ() does not support the type */
PetscErrorCode LinearGraphFromMat(Mat A, LinearGraph *graph, PetscBool *done);

/*
  Nested dissection; order[k] is the unknown eliminated as number k (PETSc's convention for a row permutation).
  partner[i] >= 0 orders i directly after that unknown: a multiplier has no diagonal entry, so it can only be a
  pivot together with, or after, a coordinate that it constrains. Other entries of partner are -1; it may be empty.
*/
PetscErrorCode LinearMetisOrder(const LinearGraph &graph, const std::vector<PetscInt> &partner,
                                std::vector<PetscInt> *order);

/* Work of the factorization of a symmetric matrix; LU with the same pattern takes twice as much */
struct LinearWork {
  double factor = 0; /* entries of L */
  double flops  = 0; /* multiplications and additions of L D L^T, the sum of the squared column counts */
};

/* The elimination tree by positions in the order. place: position of each unknown; parent of each position, -1 at roots; count: entries of each column of L */
struct LinearTree {
  std::vector<PetscInt> place, parent, count;
};

/* Counts the entries of the columns of L along the elimination tree; stops with *bounded = PETSC_FALSE once L exceeds `limit` entries */
void LinearCountWork(const LinearGraph &graph, const PetscInt order[], double limit, LinearWork *work,
                     PetscBool *bounded, LinearTree *tree = NULL);

#endif
