/*
  The coarse level of the preconditioner "hhtconstraint", in which aggregates of neighbouring nodes of finite elements move as rigid bodies:

    R A_c^-1 R^T,    A_c = R^T A R.

  The columns of R are three translations and three rotations of each aggregate, and one for every unknown outside of aggregates: those of rigid bodies,
  modes, multipliers, and nodes that are coupled to these. Constraints therefore keep their full rank, the corrections of this level satisfy them exactly, and the fine level leaves these
  unknowns out. Motions of the whole body, which the fine level propagates by one node in an iteration, are found at once (Nicolaides, SIAM J. Numer. Anal. 24, 1987, 355-365).
*/
#ifndef HHTDAE_LINEAR_COARSE_H
#define HHTDAE_LINEAR_COARSE_H

#include "inner.h"
#include "matrix_nodes.h"
#include <vector>

struct CoarseLevel {
  Mat          R = nullptr, A = nullptr;
  InnerSolver  inner;
  Vec          residual = nullptr, answer = nullptr;

  struct Node {
    PetscInt row; /* the first of its three global rows */
    double   x[3];
  };
  std::vector<Node>     nodes;       /* nodes in aggregates, one aggregate after the other */
  std::vector<PetscInt> first;       /* aggregate a has nodes[first[a]] to nodes[first[a + 1] - 1] */
  std::vector<PetscInt> single_rows; /* global rows of unknowns outside of aggregates, ascending: each has a column of R, the first ones of this rank */
};

/* The matrix A, and the nodes among its unknowns */
struct CoarseNodes {
  const MatrixNodes &nodes;
  Mat                A;
  Vec                positions; /* positions of nodes, in the rows of their unknowns */
};

/* Forms aggregates of at most max_nodes nodes, each on one rank. Collective, as all of these functions. */
PetscErrorCode CoarseCreate(const CoarseNodes &of, PetscInt max_nodes, CoarseLevel *c);
/* Computes and factors A_c; to be called after each change of A's values. *failed if A_c is singular. */
PetscErrorCode CoarseFill(PC pc, Vec positions, CoarseLevel *c, PetscBool *failed);
/* y += R A_c^-1 R^T x */
PetscErrorCode CoarseAdd(CoarseLevel *c, Vec x, Vec y, PetscBool *failed);
/* Saves and restores aggregates, positions and solver; A must have the values that the state belongs to. *same is the result of this rank only; if it is PETSC_FALSE,
   the level may be the one before loading. */
PetscErrorCode CoarseSaveState(const CoarseLevel &c, Archive *archive);
PetscErrorCode CoarseLoadState(PC pc, CoarseLevel *c, Archive *archive, PetscBool *same, PetscBool *failed);
PetscErrorCode CoarseView(const CoarseLevel &c, PetscViewer viewer);
PetscErrorCode CoarseDestroy(CoarseLevel *c);

#endif
