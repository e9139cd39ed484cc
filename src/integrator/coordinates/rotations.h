/* Local rotation vectors, rotations.cpp: their reference, their stage, and their part of the error estimate and of the dense output. */
#ifndef HHTDAE_ROTATIONS_H
#define HHTDAE_ROTATIONS_H

#include "integrator/state.h"
#include "integrator/work_vec.h"

namespace hht3
{

/* Largest rotation of a body from a past attitude to the reference, rad: a rotation vector describes at most half a turn */
constexpr PetscReal longest_turn = 3;

PetscErrorCode SetRotations(TS ts, IS rotations, TSHHT3Refer refer, TSHHT3ReferBack back, void *ctx);
PetscErrorCode SetUpRotations(TS ts);

/* Makes the attitudes of U0 the reference, and copies U0 to vec_sol */
PetscErrorCode ReferToState(TS ts);

/* Makes the attitudes of U the reference until ReferBack(), which restores the entries of U from `before` */
PetscErrorCode ReferTo(TS ts, Vec U, WorkVec &before);
PetscErrorCode ReferBack(TS ts, Vec U, const WorkVec &before);

/* Computes the rotation vectors in U1; V1 has to be that of the stage already */
PetscErrorCode StageOfRotations(const Integrator &I);

/* The factor of TSHHT3GetRotationFactor() in the present step; GetRotationFactor() returns it to the application while the matrix of
   a step is made, else 0 */
PetscReal      RotationFactor(const Integrator &I);
PetscErrorCode GetRotationFactor(TS ts, PetscReal *factor, Vec *begin);

/* Their part of the error estimate of order two on this rank: added to *result, a sum of squares, or the maximum with it */
PetscErrorCode AddRotationErrors(const Integrator &I, NormType type, PetscReal *result);

/* Corrects a rotation vector u that was interpolated at the fraction x of the step, where the angular velocity is v; the polynomial
   contains `part` of the commutator in U1 */
void InterpolateCommutator(const Integrator &I, PetscReal x, PetscReal part, const PetscScalar *v0, const PetscScalar *v1, const PetscScalar *v, PetscScalar *u);

} // namespace hht3

#endif
