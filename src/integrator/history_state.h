/* What is kept of the accepted steps: differences for the predictor, states for orders above two, and what the choice of the order knows. */
#ifndef HHTDAE_HISTORY_STATE_H
#define HHTDAE_HISTORY_STATE_H

#include "bdf.h"
#include <petscvec.h>

namespace hht3
{

constexpr PetscInt max_degree = max_order; /* of the predictor */
constexpr PetscInt hht_degree = 3; /* that pays in steps of order two */

struct PredictorOptions {
  PetscInt  degree_max = hht_degree; /* what the user allows */
  PetscBool fixed      = PETSC_FALSE;
};

struct PredictorState {
  PetscInt  degree    = 0; /* in use */
  PetscInt  available = 0; /* differences that exist */
  PetscReal t[max_degree + 2] = {}; /* t_n, t_{n-1}, ... */
};

/* Divided differences over the accepted steps. Of states those of the true s': the error test uses them, and w_n belongs to a
   time that shifts with h. a_n does too, but is smoother than q'' and predicts better. */
struct Predictor : PredictorOptions, PredictorState {
  Vec D[max_degree + 2] = {}; /* D[0]: a_n, s'_n, lambda_n, V_n, F_n; D[k] the k-th divided difference, allocated when first used. One beyond them is work space. */
};

/* What the choice of the order knows of the steps before */
struct OrderMemory {
  PetscReal S[max_order + 2] = {};     /* amplitudes of the scaled differences of orders 2 to 6; 0: none yet */
  PetscReal ratio[max_order + 1] = {10, 10, 10, 10, 10, 10}; /* of one to the one before it, as stability sees it; more than any where nothing is known */
};

/* Orders above two, bdf.cpp and order.cpp. Nothing of it is used where the largest order is two. */
struct OrderState {
  PetscInt  now = 2, next = 2;          /* of the step from t_n, and of the one after it when it is accepted */
  PetscInt  made = 0, accepted = 0;     /* of the step that led to t_n, and of the accepted one that leads away from it; 0: neither */
  PetscInt  ready = 2;                  /* for which X0, D_0 and the misfit of velocities stand */
  PetscInt  past = 0;                   /* states before t_n that are kept */
  PetscInt  since = 0, above = 0;       /* steps since the order has changed, and since it is above two */
  OrderMemory memory, after;            /* at t_n, and when the step is accepted */
  PetscInt  wait = 0, penalty = 0;      /* steps of order two after a higher one has failed: still to be made, and the last time */
  PetscBool chosen = PETSC_FALSE;       /* next is */
  PetscReal spin = 0;                   /* fastest rotation of a body in the step that led to t_n, rad per time; 0 where there is no history or no rotation vector */
  PetscReal misfit_h = 0;               /* length of the step of order two to whose end dV belongs; 0: it belongs to none */
  PetscReal t[max_order + 1] = {};      /* t_n, t_{n-1}, ... */
  PetscReal hht[max_order + 1] = {};    /* length of the steps of order two that led there; 0 for others */
};

struct Order : OrderState {
  PetscInt wanted = 2;        /* by the user; may be TSHHT3_ORDER_AUTO */
  PetscInt max    = 2;        /* that is possible */
  PetscBool measured = PETSC_FALSE; /* S are the scaled differences of the attempt, order.cpp */
  PetscReal S[max_order + 2] = {};
  Vec      U[max_order] = {}; /* U, U' at t_{n-1}, t_{n-2}, ... */
  Vec      V[max_order] = {};
};

} // namespace hht3

#endif
