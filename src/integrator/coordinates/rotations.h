/* Local rotation vectors, rotations.cpp: their reference, their stages, and their part of the error and of the dense output. */
#ifndef HHTDAE_ROTATIONS_H
#define HHTDAE_ROTATIONS_H

#include "integrator/state.h"
#include "integrator/work_vec.h"

namespace hht3
{

/* Of a body from a past attitude to that of the reference, rad: a rotation vector knows no more than half a turn */
constexpr PetscReal longest_turn = 3;

PetscErrorCode SetRotations(TS ts, IS rotations, TSHHT3Refer refer, TSHHT3ReferBack back, void *ctx);
PetscErrorCode SetUpRotations(TS ts);

/* U0 becomes the reference, and vec_sol follows */
PetscErrorCode ReferToState(TS ts);

/* U is the reference until ReferBack() gives it back its entries */
PetscErrorCode ReferTo(TS ts, Vec U, WorkVec &before);
PetscErrorCode ReferBack(TS ts, Vec U, const WorkVec &before);

/* Rotation vectors of U1, V1 being that of the stage */
PetscErrorCode StageOfRotations(const Integrator &I);

/* What TSHHT3GetRotationFactor() tells: of the step at hand, and to the application while the matrix of a step is made */
PetscReal      RotationFactor(const Integrator &I);
PetscErrorCode GetRotationFactor(TS ts, PetscReal *factor, Vec *begin);

/* Their part of the error estimate of order two on this rank: added to a sum of squares, or the larger one */
PetscErrorCode AddRotationErrors(const Integrator &I, NormType type, PetscReal *result);

/* A rotation vector u at the fraction x of the step, where w is v, from a polynomial that took `part` of the commutator in U1 along */
void InterpolateCommutator(const Integrator &I, PetscReal x, PetscReal part, const PetscScalar *v0, const PetscScalar *v1, const PetscScalar *v, PetscScalar *u);

} // namespace hht3

#endif
