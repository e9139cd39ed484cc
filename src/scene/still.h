/*
  Vectors, matrix and linear solver of Newton's method on the unknowns of a run at a fixed time, outside of the integrator: equilibrium.cpp, analyses.cpp.
*/
#ifndef HHTDAE_SCENE_STILL_H
#define HHTDAE_SCENE_STILL_H

#include "runtime.h"
#include <cmath>
#include <petscksp.h>
#include <vector>

namespace hhtdae
{

/* Maximum norms of parts of a residual. force: equations of motion, with moments divided by the scene's size; body: the
   body with this force, -1 if it is on no body of the scene */
struct Unbalanced {
  /* misfit: holonomic constraints; other: constraints at velocity level, variables, force states and states */
  double   force = 0, misfit = 0, other = 0;
  double   step = INFINITY;                  /* length of the last Newton step: radians, or parts of the scene's size */
  PetscInt body = -1;
};

constexpr double largest_turn = 0.25; /* longest step of a body's coordinates: radians, or parts of the scene's size */

struct StillSystem {
  Runtime &R;
  double   t, size; /* time; size of the scene */
  Vec      U = nullptr, V = nullptr, A = nullptr, zero = nullptr, F = nullptr, d = nullptr, next = nullptr;
  Mat      J   = nullptr;
  KSP      ksp = nullptr;
  std::vector<PetscInt> unread; /* own rows of states that no equation reads; measure() ignores them, since equilibrium does not depend on them */

  StillSystem(Runtime &r, double time);
  ~StillSystem();
  StillSystem(const StillSystem &) = delete;
  PetscErrorCode create(Vec begin, const char *prefix);                       /* U becomes a copy of begin; prefix: of the KSP's options */
  PetscErrorCode residual(Vec u) { return Residual(R, t, u, zero, zero, F); } /* F of u at rest */
  PetscErrorCode measure(Vec f, Unbalanced &out) const;
  PetscErrorCode reach(Vec x, double *part) const; /* the largest displacement or rotation of a body in x, in units of largest_turn; infinite if an entry is NaN */
};

/* equilibrium.cpp: moves U to static equilibrium at t */
PetscErrorCode RelaxAt(Runtime &R, double t, Vec U, PetscInt *iterations);

} // namespace hhtdae

#endif
