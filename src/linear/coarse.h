/*
  The coarse level of the preconditioner "hhtconstraint": neighbouring nodes of finite elements move together as a rigid body,

    R A_c^-1 R^T,    A_c = R^T A R.

  Columns of R are three translations and three rotations of each aggregate of nodes, and one for every unknown that belongs to none: rigid bodies,
  modes, multipliers, and nodes that are coupled to these. So constraints keep their full rank, what the level answers satisfies them, and the fine level has nothing to do there. A motion of
  the whole body, which the other level brings along by one node in an iteration, it finds at once (Nicolaides, SIAM J. Numer. Anal. 24, 1987, 355-365).
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
    PetscInt row; /* its first one of three */
    double   x[3];
  };
  std::vector<Node>     nodes;       /* that move with an aggregate, one aggregate after the other */
  std::vector<PetscInt> first;       /* node of each aggregate, and the number of nodes */
  std::vector<PetscInt> apart;       /* rows of all other unknowns, ascending: the first columns of R of this rank */
};

/* What is known of the unknowns of the matrix A */
struct CoarseNodes {
  const MatrixNodes &nodes;
  Mat                A;
  Vec                positions; /* of nodes, in the rows of their unknowns */
};

/* Aggregates of at most so many nodes, each of nodes of one rank. Collective, as all of these. */
PetscErrorCode CoarseCreate(const CoarseNodes &of, PetscInt most, CoarseLevel *c);
/* After each change of A's values; *failed where A_c is singular */
PetscErrorCode CoarseFill(PC pc, Vec positions, CoarseLevel *c, PetscBool *failed);
/* y += R A_c^-1 R^T x */
PetscErrorCode CoarseAdd(CoarseLevel *c, Vec x, Vec y, PetscBool *failed);
/* Aggregates, positions and solver as they were for the values that A has. Each rank's own answers; without *same the level may be the one that there was before. */
PetscErrorCode CoarseSaveState(const CoarseLevel &c, Archive *archive);
PetscErrorCode CoarseLoadState(PC pc, CoarseLevel *c, Archive *archive, PetscBool *same, PetscBool *failed);
PetscErrorCode CoarseView(const CoarseLevel &c, PetscViewer viewer);
PetscErrorCode CoarseDestroy(CoarseLevel *c);

#endif
