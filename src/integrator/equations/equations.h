/* The discretized equations (9) and their matrix (10), equations.cpp: the functions that SNES calls, and the application's own behind them. */
#ifndef HHTDAE_EQUATIONS_H
#define HHTDAE_EQUATIONS_H

#include "integrator/state.h"
#include <initializer_list>

namespace hht3
{

/* The application's residual and Jacobian, with what the counters and the preconditioner need to know of them. Without an I2Jacobian: by differences */
PetscErrorCode EvaluateResidual(TS ts, PetscReal t, Vec U, Vec V, Vec A, Vec F);
PetscErrorCode EvaluateJacobian(TS ts, PetscReal t, Vec U, Vec V, Vec A, PetscReal sv, PetscReal sa, Mat J, Mat P);

/* f_n of (9a) into F0, where the form needs it */
PetscErrorCode HistoryForces(TS ts, PetscReal t);

/* (9) and (10) of the attempt at hand, at the unknowns X. FormJacobian() also has the matrix factored. */
PetscErrorCode FormFunction(SNES snes, Vec X, Vec F, TS ts);
PetscErrorCode FormJacobian(SNES snes, Vec X, Mat J, Mat P, TS ts);

/* Shifts of the application's Jacobian and diagonal scalings that make it the Newton matrix */
struct Scales {
  PetscReal sv, sa;              /* d U'/dU, d U''/dU */
  PetscReal coordinate, state;   /* columns */
  PetscReal holonomic, velocity; /* rows */
};

/* to = the entries of x whose role is one of these, zeros elsewhere; also in place */
PetscErrorCode TakeRoles(const Integrator &I, Vec x, std::initializer_list<TSHHT3Role> roles, Vec to);

/* D_r A D_c, in place */
PetscErrorCode ScaleMatrix(Integrator &I, const Scales &s, Mat A);

} // namespace hht3

#endif
