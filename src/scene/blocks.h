/* Blocks of the matrix between the coordinates of two markers' bodies: what kernels of all kinds share, compiled once. */
#ifndef HHTDAE_SCENE_BLOCKS_H
#define HHTDAE_SCENE_BLOCKS_H

#include "batch.h"

namespace hhtdae
{

using Six = Matrix<6, 6>;

/* Derivatives A by the frame and, unless null, V by the twist of marker `column`, of a load (force, moment) on marker `row`, or of
   any six numbers that are paired with its (x, theta): in coordinates of both bodies. What the row's body adds as its own lever
   turns is not in it, see AddLever(). */
Six PairBlock(const Evaluation &ev, PetscInt row, const Frame<double> &at_row, PetscInt column, const Frame<double> &at_column, const Six &A,
              const Six *V = nullptr);

/* The change of the moment s x f of a force held fixed in space when its body turns, s from its centre to the marker: [f][s], in
   coordinates */
void AddLever(const Bodies &B, PetscInt marker, const Frame<double> &at, const Vector3 &f, Six &H);

/* The same of derivatives V by the twist of marker `column`, which is on an attachment's frame: to the groups of its v and w, for the groups of the row's body
   that the load reaches; returns the number of slots used. PairBlock() has what positions make of V. */
int RateBlocks(const Evaluation &ev, PetscInt row, const Frame<double> &at_row, PetscInt column, const Frame<double> &at_column, const Six &V, const Slot *slot,
               const bool *loads);

/* The part of D that belongs to groups g and h of two bodies */
void AddBlock(const Sink &sink, const Slot &slot, const Six &D, BodyKind row, int g, BodyKind column, int h);

} // namespace hhtdae

#endif
