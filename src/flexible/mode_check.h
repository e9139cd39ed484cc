/* Balanced operators for the search of slowest_modes.cpp, and the residuals of the modes found. */
#ifndef HHTDAE_FLEXIBLE_MODE_CHECK_H
#define HHTDAE_FLEXIBLE_MODE_CHECK_H

#include "hhtdae/linearize.h"
#include <petscksp.h>

namespace hhtdae
{

/* Largest ratio |value| / |shift| for which a search gives accurate eigenvalues; beyond it digits are lost (SmallBodies.SlowestModes, ModesOfAllSpeeds) */
constexpr PetscReal max_value_per_shift = 10;

/* Largest residual of a mode relative to its inertia and damping forces (SmallBodies.SlowestModesAreChecked) */
constexpr PetscReal max_residual = 1e-3;

/* The operators in the unknowns y, x = D y, where the diagonal D equilibrates the rows of the matrix that is factored (Ruiz, RAL-TR-2001-034): the entries of constraints
   are of order 1, those of stiffness much larger, and slow modes would lose their accuracy by the difference */
struct Balanced {
  Mat operators[3] = {nullptr, nullptr, nullptr}; /* K, C, M */
  Vec D            = nullptr;
};

PetscErrorCode BalanceOperators(const Mat given[3], PetscReal shift, Balanced *b);
PetscErrorCode DestroyBalanced(Balanced *b);

/* Gives MUMPS more workspace. Creates the factor for that, before SLEPc sets the matrix to be factored; A has the same size and type. */
PetscErrorCode GiveFactorWorkspace(KSP ksp, Mat A);

/* Whether a mode counts as a rigid motion, without restoring forces: its value is small compared with the fastest of `modes` and the shift */
bool IsRigidMotion(const Mode &m, const std::vector<Mode> &modes, PetscReal shift);

/* Computes the residual of each mode that is no rigid motion, in equations balanced for a shift near its value: balanced for a distant shift, rigid motions would have too
   much weight. Shapes with a residual above max_residual are refined. *worst, *frequency: largest residual, and the frequency of that mode in Hz. */
PetscErrorCode CheckModes(const Mat given[3], PetscReal shift, std::vector<Mode> *modes, PetscReal *worst, PetscReal *frequency);

} // namespace hhtdae

#endif
