/*
  The unknowns of a run at one time, with what Newton's method on them needs outside of the integrator: equilibrium.cpp, analyses.cpp.
*/
#ifndef HHTDAE_SCENE_STILL_H
#define HHTDAE_SCENE_STILL_H

#include "runtime.h"
#include <cmath>
#include <petscksp.h>
#include <vector>

namespace hhtdae
{

/* The largest force that nothing balances, and on which body; moments as forces at the scene's size */
struct Unbalanced {
  double   force = 0, misfit = 0, other = 0; /* misfit: of holonomic constraints */
  double   step = INFINITY; /* the last one: radians, parts of the scene's size */
  PetscInt body = -1;
};

constexpr double largest_turn = 0.25; /* in one step: radians, parts of the scene's size */

struct StillSystem {
  Runtime &R;
  double   t, size; /* of the scene */
  Vec      U = nullptr, V = nullptr, A = nullptr, zero = nullptr, F = nullptr, d = nullptr, next = nullptr;
  Mat      J   = nullptr;
  KSP      ksp = nullptr;
  std::vector<PetscInt> unread; /* own rows of states that nothing reads: they rest at any value, whatever their rates, and are not measured */

  StillSystem(Runtime &r, double time);
  ~StillSystem();
  StillSystem(const StillSystem &) = delete;
  PetscErrorCode create(Vec begin, const char *prefix); /* U is a copy of it */
  PetscErrorCode residual(Vec u) { return Residual(R, t, u, zero, zero, F); } /* at rest, into F */
  /* Only bodies' coordinates are compared with forces, only holonomic rows with lengths; what is left are definitions and states */
  PetscErrorCode measure(Vec f, Unbalanced &out) const;
  PetscErrorCode reach(Vec x, double *part) const; /* the largest move of a body, as a part of what one step may do; NaN: infinite */
};

/* equilibrium.cpp: downhill from U to static equilibrium at t */
PetscErrorCode RelaxAt(Runtime &R, double t, Vec U, PetscInt *iterations);

} // namespace hhtdae

#endif
