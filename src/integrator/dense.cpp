/*
  Dense output within the last accepted step, section 7 of the method.

  Order two: cubic Hermite polynomials for q (from q, q'), for q' (from q', q'') and for states (from s, s'); linear for q'', lambda, V and F.

  Order k above it: the polynomials of degree k through the last k + 1 values of q, of q' and of states, which for q is the one that the step is made of, and of degree k
  through those that the predictor keeps of q'', s', lambda, V and F, as far as these reach back.

  Both ends give back the step's own values.
*/
#include "bdf.h"
#include "dense.h"
#include "rotations.h"

namespace hht3
{

namespace
{

/* Basis of the cubic Hermite polynomial on [0, 1] at x, for values and for h times slopes */
struct Hermite {
  PetscReal y0, y1, d0, d1;
  Hermite(PetscReal x, PetscReal h)
  {
    const PetscReal z = 1 - x;
    y0                = z * z * (1 + 2 * x);
    y1                = x * x * (1 + 2 * z);
    d0                = h * x * z * z;
    d1                = -h * x * x * z;
  }
  PetscScalar operator()(PetscScalar a, PetscScalar da, PetscScalar b, PetscScalar db) const
  {
    return y0 * a + d0 * da + y1 * b + d1 * db;
  }
};

void At(const Integrator &I, PetscReal x, const Hermite &H, PetscInt n, const PetscScalar *const s0[], const PetscScalar *const s1[],
        PetscScalar *u, PetscScalar *v, PetscScalar *a)
{
  const PetscReal z = 1 - x;
  for (PetscInt i = 0; i < n; i++) {
    const PetscScalar u0 = s0[0][i], v0 = s0[1][i], a0 = s0[2][i], u1 = s1[0][i], v1 = s1[1][i], a1 = s1[2][i];
    const TSHHT3Role  r = RoleOf(I, i);
    if (u) u[i] = IsDifferential(r) ? H(u0, v0, u1, v1) : z * u0 + x * u1;
    if (v) v[i] = r == TSHHT3_COORDINATE ? H(v0, a0, v1, a1) : z * v0 + x * v1;
    if (a) a[i] = z * a0 + x * a1;
  }
}

/* A polynomial of order k, as a sum of vectors */
struct Sum {
  PetscInt           n = 0;
  PetscReal          weight[max_order + 2];
  Vec                vec[max_order + 2];
  const PetscScalar *x[max_order + 2];

  void add(PetscReal w, Vec v)
  {
    weight[n] = w;
    vec[n++]  = v;
  }
  PetscScalar operator[](PetscInt i) const
  {
    PetscScalar sum = 0;
    for (PetscInt j = 0; j < n; j++) sum += weight[j] * x[j][i];
    return sum;
  }
  PetscErrorCode get()
  {
    PetscFunctionBegin;
    for (PetscInt j = 0; j < n; j++) PetscCall(VecGetArrayRead(vec[j], &x[j]));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  PetscErrorCode restore()
  {
    PetscFunctionBegin;
    for (PetscInt j = n - 1; j >= 0; j--) PetscCall(VecRestoreArrayRead(vec[j], &x[j]));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
};

/* Through the values at t_{n+1}, t_n, ... of U or U' */
Sum ThroughStates(const Integrator &I, PetscReal t, Vec end, Vec begin, const Vec past[])
{
  const Order   &o = I.order;
  const PetscInt k = o.now;
  PetscReal      node[max_order + 1] = {}, weight[max_order + 1];
  Sum            sum;

  node[0] = I.t1;
  for (PetscInt j = 1; j <= k; j++) node[j] = o.t[j - 1];
  LagrangeWeights(k, node, t, weight);
  for (PetscInt j = 0; j <= k; j++) sum.add(weight[j], j == 0 ? end : j == 1 ? begin : past[j - 2]);
  return sum;
}

/* Through `end` at t_{n+1} and the values whose divided differences the predictor keeps:
   N(t) + (end - N(t_{n+1})) pi(t)/pi(t_{n+1}) with Newton's polynomial N and the product pi of all (t - t_j) */
Sum ThroughUnknowns(const Integrator &I, PetscReal t, Vec end)
{
  const Predictor &p = I.predictor;
  const PetscInt   n = PetscMin(p.available + 1, I.order.now);
  PetscReal        pi = 1, pi1 = 1, here[max_order + 1], there[max_order + 1];
  Sum              sum;

  for (PetscInt j = 0; j < n; j++) {
    here[j]  = pi;
    there[j] = pi1;
    pi *= t - p.t[j];
    pi1 *= I.t1 - p.t[j];
  }
  sum.add(pi / pi1, end);
  for (PetscInt j = 0; j < n; j++) sum.add(here[j] - pi / pi1 * there[j], p.D[j]);
  return sum;
}

/* Any of u, v, a may be null */
PetscErrorCode AtHigherOrder(const Integrator &I, PetscReal t, PetscInt n, PetscScalar *u, PetscScalar *v, PetscScalar *a)
{
  Sum U = ThroughStates(I, t, I.U1, I.U0, I.order.U), V = ThroughStates(I, t, I.V1, I.V0, I.order.V), X = ThroughUnknowns(I, t, I.X);

  PetscFunctionBegin;
  PetscCall(U.get());
  PetscCall(V.get());
  PetscCall(X.get());
  for (PetscInt i = 0; i < n; i++) {
    const TSHHT3Role r = RoleOf(I, i);
    if (u) u[i] = IsDifferential(r) ? U[i] : X[i];
    if (v) v[i] = r == TSHHT3_COORDINATE ? V[i] : r == TSHHT3_STATE ? X[i] : 0;
    if (a) a[i] = r == TSHHT3_COORDINATE ? X[i] : 0;
  }
  PetscCall(X.restore());
  PetscCall(V.restore());
  PetscCall(U.restore());
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* After At() */
void AtRotations(const Integrator &I, PetscReal x, const Hermite &H, const PetscScalar *const s0[], const PetscScalar *const s1[], PetscScalar *u)
{
  for (PetscInt i : I.rotations.at) {
    PetscScalar v[3];
    for (int k = 0; k < 3; k++) v[k] = H(s0[1][i + k], s0[2][i + k], s1[1][i + k], s1[2][i + k]);
    InterpolateCommutator(I, x, H.y1, s0[1] + i, s1[1] + i, v, u + i);
  }
}

} // namespace

/* Where t lies in the last step: 0 to 1, and these at its ends exactly */
PetscReal StepFraction(const Integrator &I, PetscReal t) { return t == I.t1 ? 1 : PetscClipInterval((t - I.t0) / I.h, 0, 1); }

/* Monitors are called when an event has taken the step back, too: then the state is that of t_n, and nothing is known of other times */
bool IsRolledBackTo(TS ts, PetscReal t) { return !Get(ts).have_step && ts->steprollback && t == ts->ptime; }

/* Any of U, V, A may be NULL. t lies between the ends of the last accepted step. */
PetscErrorCode Interpolate(TS ts, PetscReal t, Vec U, Vec V, Vec A)
{
  Integrator        &I = Get(ts);
  Vec                out[3] = {U, V, A}, begin[3] = {I.U0, I.V0, I.A0}, end[3] = {I.U1, I.V1, I.A1};
  PetscScalar       *o[3]   = {};
  const PetscScalar *s0[3], *s1[3];
  PetscInt           n, size;

  PetscFunctionBegin;
  if (IsRolledBackTo(ts, t)) {
    for (int k = 0; k < 3; k++)
      if (out[k]) PetscCall(VecCopy(begin[k], out[k]));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  PetscCheck(I.have_step, PetscObjectComm((PetscObject)ts), PETSC_ERR_ARG_WRONGSTATE, "There is no step to interpolate in: none was accepted since the start, the last restart or roll-back");
  PetscCheck(t >= I.t0 - I.h * PETSC_SQRT_MACHINE_EPSILON && t <= I.t1 + I.h * PETSC_SQRT_MACHINE_EPSILON, PetscObjectComm((PetscObject)ts), PETSC_ERR_ARG_OUTOFRANGE,
             "Time %g is not in the last step [%g, %g]", (double)t, (double)I.t0, (double)I.t1);
  PetscCall(VecGetLocalSize(I.U0, &n));
  for (Vec x : out) {
    if (!x) continue;
    PetscCall(VecGetLocalSize(x, &size));
    PetscCheck(size == n, PETSC_COMM_SELF, PETSC_ERR_ARG_SIZ, "A vector for values of the last step has %" PetscInt_FMT " entries on this rank, must be %" PetscInt_FMT " as the solution has", size, n);
  }
  const PetscReal x = StepFraction(I, t);
  for (int k = 0; k < 3; k++) {
    PetscCall(VecGetArrayRead(begin[k], &s0[k]));
    PetscCall(VecGetArrayRead(end[k], &s1[k]));
    if (out[k]) PetscCall(VecGetArrayWrite(out[k], &o[k]));
  }
  if (I.order.accepted > 2) PetscCall(AtHigherOrder(I, PetscClipInterval(t, I.t0, I.t1), n, o[0], o[1], o[2]));
  else {
    const Hermite H(x, I.h);
    At(I, x, H, n, s0, s1, o[0], o[1], o[2]);
    if (o[0]) AtRotations(I, x, H, s0, s1, o[0]);
  }
  for (int k = 0; k < 3; k++) {
    if (out[k]) PetscCall(VecRestoreArrayWrite(out[k], &o[k]));
    PetscCall(VecRestoreArrayRead(end[k], &s1[k]));
    PetscCall(VecRestoreArrayRead(begin[k], &s0[k]));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

} // namespace hht3
