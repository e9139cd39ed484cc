/*
  The pattern of a matrix as an undirected graph on one process, its METIS ordering, and the work that a factorization
  in a given order would take.
*/
#ifndef HHTDAE_LINEAR_GRAPH_H
#define HHTDAE_LINEAR_GRAPH_H

#include <petscmat.h>
#include <vector>

/* Neighbours of i: adj[xadj[i]] to adj[xadj[i+1]-1], ascending, each once and without i itself */
struct LinearGraph {
  PetscInt              n = 0;
  std::vector<PetscInt> xadj, adj;
};

/* From the entries (row[k], col[k]) of a matrix or of one of its triangles; indices start at base */
template <typename Index>
void LinearGraphFromEntries(PetscInt n, size_t count, const Index row[], const Index col[], Index base,
                            LinearGraph *graph);

/* Of a SEQAIJ matrix, or of the blocks of a SEQBAIJ or SEQSBAIJ matrix; *done = PETSC_FALSE if its type gives no rows */
PetscErrorCode LinearGraphFromMat(Mat A, LinearGraph *graph, PetscBool *done);

/*
  Nested dissection; order[k] is the unknown eliminated as number k (PETSc's convention for a row permutation).
  partner[i] >= 0 asks that i come right after that unknown: a multiplier has no diagonal entry, so it can only be a
  pivot together with, or after, a coordinate that it constrains. Entries of partner are -1 otherwise; it may be empty.
*/
PetscErrorCode LinearMetisOrder(const LinearGraph &graph, const std::vector<PetscInt> &partner,
                                std::vector<PetscInt> *order);

/* What the factorization of a symmetric matrix costs; LU on the same pattern costs twice as much */
struct LinearWork {
  double factor = 0; /* entries of L */
  double flops  = 0; /* multiplications and additions of L D L^T, the sum of the squared column counts */
};

/* The elimination tree, by places in the order: who follows (-1: nobody), entries of each column of L */
struct LinearTree {
  std::vector<PetscInt> place, parent, count;
};

/* Counts the columns of L along the elimination tree and stops, *bounded = PETSC_FALSE, once L exceeds `limit` entries
 */
void LinearCountWork(const LinearGraph &graph, const PetscInt order[], double limit, LinearWork *work,
                     PetscBool *bounded, LinearTree *tree = NULL);

#endif
