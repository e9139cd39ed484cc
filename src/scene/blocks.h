/* Blocks of the matrix between the coordinates of two markers' bodies: functions common to all kernels, compiled once. */
#ifndef HHTDAE_SCENE_BLOCKS_H
#define HHTDAE_SCENE_BLOCKS_H

#include "batch.h"

namespace hhtdae
{

using Six = Matrix<6, 6>;

/* Transforms derivatives A by the frame and, unless null, V by the twist of marker `column`, of a load (force, moment) on marker `row`, to the coordinates of both
   bodies. The change of the load's lever with rotations of the row's body is not included, see AddLever(). */
Six PairBlock(const Evaluation &ev, PetscInt row, const Frame<double> &at_row, PetscInt column, const Frame<double> &at_column, const Six &A,
              const Six *V = nullptr);

/* Adds the change of the moment s x f of a force fixed in space with rotations of its body, s from the centre of mass to the marker: [f][s], in
   coordinates */
void AddLever(const Bodies &B, PetscInt marker, const Frame<double> &at, const Vector3 &f, Six &H);

/* Adds derivatives V by the twist of a marker `column` on an attachment's frame to the columns of its v and w, for the groups of the row's body
   on which the load acts; returns the number of slots used. PairBlock() covers the dependence of the twist on positions. */
int RateBlocks(const Evaluation &ev, PetscInt row, const Frame<double> &at_row, PetscInt column, const Frame<double> &at_column, const Six &V, const Slot *slot,
               const bool *loads);

/* The part of D that belongs to groups g and h of two bodies */
void AddBlock(const Sink &sink, const Slot &slot, const Six &D, BodyKind row, int g, BodyKind column, int h);

/* Bits of a marker's position (1) and rotation (2) in `depends` and `acts` of kernels; Reach(): whether they involve group g of its body */
inline unsigned OfMarker(unsigned mask, int k) { return mask >> (2 * k) & 3; }
inline bool     Reach(unsigned bits, BodyKind b, int g) { return (bits & 1) || (Turns(b, g) && (bits & 2)); }

/* - J^T lambda: the load of constraints on the body of one marker; J: the marker's six columns of their gradients */
template <int rows> Wrench<double> Reaction(const double *J, const double *lambda)
{
  Wrench<double> on;
  for (int c = 0; c < 6; c++, J += rows) {
    double sum = -J[0] * lambda[0];
    for (int r = 1; r < rows; r++) sum -= J[r] * lambda[r];
    (c < 3 ? on.f(c) : on.m(c - 3)) = sum;
  }
  return on;
}

/* Minus the block (k, l) of 6 x 6 blocks of a matrix of that leading dimension */
Six MinusBlock(const double *A, int leading, int k, int l);

/* - d load / d scalars: n columns in the coordinates of one marker's body, from the marker's six rows J of that leading dimension; acts: bits of the
   marker. n is 1, 2, 3 or 6. */
template <int n>
void AddScalars(Evaluation &ev, PetscInt marker, const Frame<double> &at, const double *J, int leading, unsigned acts, PetscInt offset, const Slot *&slot);

/* out = - H^T y; H: n x n */
void MinusTransposed(const double *H, int n, const double *y, double *out);

/* Constraints' rows and the columns of their multipliers in the coordinates of one marker's body. J: the marker's six columns of their gradients;
   at velocity level J belongs to the twist and P to the frame, else P is null. active: bits of the rows that are not redundant; used: bits of the marker.
   There may be 1, 2 or 3 rows. */
template <int rows>
void AddGradient(Evaluation &ev, PetscInt marker, const Frame<double> &at, const double *J, const double *P, unsigned active, unsigned used, const Slot *&slot);

/* A block of constraints' curvature. H: theirs between the frames of the two markers, of the given leading dimension; pairs: whether it can be nonzero,
   bit 2x + y for x or theta of the row's marker and of the column's; lever: unless null, J^T lambda at the marker on the diagonal, see AddLever() */
struct FramePair {
  PetscInt             row, column; /* markers */
  const Frame<double> &at_row, &at_column;
};
bool InPairs(unsigned pairs, BodyKind row, int g, BodyKind column, int h);
void AddCurvature(Evaluation &ev, const FramePair &p, const double *H, int leading, unsigned pairs, const Vector3 *lever, const Slot *&slot);

} // namespace hhtdae

#endif
