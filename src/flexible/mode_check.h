/* What slowest_modes.cpp searches with and holds its modes against: the operators balanced, and what a mode leaves of their equation. */
#ifndef HHTDAE_FLEXIBLE_MODE_CHECK_H
#define HHTDAE_FLEXIBLE_MODE_CHECK_H

#include "hhtdae/linearize.h"
#include <petscksp.h>

namespace hhtdae
{

/* A value, in parts of the shift: beyond it digits are lost (SmallBodies.SlowestModes, ModesOfAllSpeeds) */
constexpr PetscReal beside = 10;

/* Part of the forces of inertia and damping that a mode may leave (SmallBodies.SlowestModesAreChecked) */
constexpr PetscReal balanced = 1e-3;

/* The operators of D y = x, where D makes all rows of the matrix that is factored about as large (Ruiz, RAL-TR-2001-034): constraints have entries of 1
   beside stiffness, and the accuracy of slow modes would be lost between the two */
struct Balanced {
  Mat operators[3] = {nullptr, nullptr, nullptr}; /* K, C, M */
  Vec D            = nullptr;
};

PetscErrorCode BalanceOperators(const Mat given[3], PetscReal shift, Balanced *b);
PetscErrorCode DestroyBalanced(Balanced *b);

/* The factor is made here, before SLEPc gives its solver the matrix to be factored, so that MUMPS gets more workspace; A: of the same size and type */
PetscErrorCode GiveFactorRoom(KSP ksp, Mat A);

/* Motions that nothing drives back, as far as this can be told beside other modes and the shift */
bool IsAtRest(const Mode &m, const std::vector<Mode> &modes, PetscReal shift);

/* Each mode that is no rigid motion in the equations, balanced as they are where it is: next to a shift far from it rigid motions weigh too much. Shapes
   that do not satisfy them well enough are refined. */
PetscErrorCode CheckModes(const Mat given[3], PetscReal shift, std::vector<Mode> *modes, PetscReal *worst, PetscReal *frequency);

} // namespace hhtdae

#endif
