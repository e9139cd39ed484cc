/* Blocks of the matrix between the coordinates of two markers' bodies. These functions are common to all kernels, so that
   they are compiled only once. */
#ifndef HHTDAE_SCENE_BLOCKS_H
#define HHTDAE_SCENE_BLOCKS_H

#include "batch.h"

namespace hhtdae
{

using Six = Matrix<6, 6>;

/* Derivatives of the generalized force on the body of marker `row` by the coordinates of the body of marker `column`. A
   and, unless null, V are the derivatives of the load (force, moment) on marker `row` by frame and twist of marker
   `column`. AddLever() adds the change of the load's lever arm with rotations of the row's body. */
Six PairBlock(const Evaluation &ev, PetscInt row, const Frame<double> &at_row, PetscInt column, const Frame<double> &at_column, const Six &A,
              const Six *V = nullptr);

/* Adds the derivative of the moment s x f by rotations of the body, [f][s], transformed to its coordinates. The force f
   is fixed in space; s is the vector from the centre of mass to the marker. */
void AddLever(const Bodies &B, PetscInt marker, const Frame<double> &at, const Vector3 &f, Six &H);

/* Adds derivatives V of a load by the twist of marker `column`, which is on an attachment's frame, to the columns of v
   and w of that frame. loads: whether the load acts on each group of the row's body. Returns the number of slots used.
   PairBlock() contains the dependence of the twist on positions. */
int RateBlocks(const Evaluation &ev, PetscInt row, const Frame<double> &at_row, PetscInt column, const Frame<double> &at_column, const Six &V, const Slot *slot,
               const bool *loads);

/* Adds the part of D that belongs to group g of the row's body and group h of the column's */
void AddBlock(const Sink &sink, const Slot &slot, const Six &D, BodyKind row, int g, BodyKind column, int h);

/* OfMarker(): the bits of marker k in a kernel's `depends` or `acts`, 1 for its position and 2 for its rotation. Reach():
   whether a marker with these bits involves group g of its body */
inline unsigned OfMarker(unsigned mask, int k) { return mask >> (2 * k) & 3; }
inline bool     Reach(unsigned bits, BodyKind b, int g) { return (bits & 1) || (Turns(b, g) && (bits & 2)); }

/* - J^T lambda, the load of constraints on the body of one marker; J: the six columns of the gradient that belong to the marker */
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

/* Minus the 6 x 6 block (k, l) of a matrix with the given leading dimension */
Six MinusBlock(const double *A, int leading, int k, int l);

/* Adds - d load / d z for n scalars z (1, 2, 3 or 6) in the rows of one marker's body. J: derivatives of the load on the
   marker, six rows of a matrix with the given leading dimension; acts: bits of the marker, OfMarker(); offset: first
   column in the group of z. */
template <int n>
void AddScalars(Evaluation &ev, PetscInt marker, const Frame<double> &at, const double *J, int leading, unsigned acts, PetscInt offset, const Slot *&slot);

/* out = - H^T y; H: n x n */
void MinusTransposed(const double *H, int n, const double *y, double *out);

/* Adds the rows of constraints, and the columns of their multipliers, in the coordinates of one marker's body. J: the six
   columns of the gradient that belong to the marker; at velocity level J is the derivative by the twist and P by the
   frame, else P is null. active: bits of the rows that are not dropped; used: bits of the marker, OfMarker(). `rows` is
   1, 2 or 3. */
template <int rows>
void AddGradient(Evaluation &ev, PetscInt marker, const Frame<double> &at, const double *J, const double *P, unsigned active, unsigned used, const Slot *&slot);

/* AddCurvature() adds a block of d(J^T lambda)/dq. H: d(J^T lambda)/d frames for the two markers, with the given leading
   dimension, or null if it is zero. pairs: bit 2a + b is set if rows a and columns b of H, 0 for x and 1 for theta, can
   be nonzero. lever: unless null, the force of J^T lambda at the marker, which is row and column, see AddLever(). */
struct FramePair {
  PetscInt             row, column; /* markers */
  const Frame<double> &at_row, &at_column;
};
bool InPairs(unsigned pairs, BodyKind row, int g, BodyKind column, int h);
void AddCurvature(Evaluation &ev, const FramePair &p, const double *H, int leading, unsigned pairs, const Vector3 *lever, const Slot *&slot);

} // namespace hhtdae

#endif
