/*
  The stage: the state U1, V1, A1 at t_{n+1} as a function of the unknowns X, by (2) and by the average of accelerations of the form (formulas.h).

  The part that does not depend on X, the base, is computed once per attempt. A correction, its norm and the new stage are computed in one sweep
  (sweeps.h): VecAXPY() and three plain loops take 10 % of the instructions of a step more, and 3 % of its time, for a chain of 1,000 rods.
*/
#include "integrator/entries.h"
#include "estimate.h"
#include "order.h"
#include "integrator/coordinates/rotations.h"
#include "stage.h"
#include "integrator/sweeps.h"

namespace hht3
{

namespace
{

/* v: the velocities at t_n that the step starts from, q'_n without the part of its drift that a step of another length must not have,
   and with the drift that a start or a change of coordinates lacks, drift.cpp */
PetscErrorCode VelocitiesAtBegin(const Integrator &I, Vec v)
{
  PetscFunctionBegin;
  if (I.drift_removed != 0) PetscCall(VecWAXPY(v, -I.drift_removed, I.dV, I.V0));
  else PetscCall(VecCopy(I.V0, v));
  if (I.jerk == Jerk::Normal) PetscCall(VecAXPY(v, -I.p.jerk_factor() * I.h * I.h, I.normal_jerk));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* U1, V1, A1 = base + (kq, kv, ka) X for coordinates; for other unknowns U1 = X. States are treated by StageOfStates(). */
struct Stage {
  PetscReal          kq, kv, ka;
  const float       *moves; /* null: all are coordinates */
  const PetscScalar *base[3];
  PetscScalar       *to[3];

  template <class At>
  HHT3_INLINE void operator()(const At &at, const Four &given) const
  {
    const Four c = moves ? given * at.get(moves) : given;
    Four       u = at.get(base[0]) + kq * c;
    if (moves) u += given - c;
    at.put(to[0], u);
    at.put(to[1], at.get(base[1]) + kv * c);
    at.put(to[2], at.get(base[2]) + ka * c);
  }
};

struct GivenStage {
  Stage              stage;
  const PetscScalar *x;

  template <class At>
  HHT3_INLINE void operator()(const At &at) const { stage(at, at.get(x)); }
};

/* The same after X = X - d, with the sum of squares of the weighted d */
struct CorrectedStage {
  Stage              stage;
  const PetscScalar *d, *w;
  PetscScalar       *x;
  Four               sum = {0, 0, 0, 0};

  template <class At>
  HHT3_INLINE void operator()(const At &at)
  {
    const Four correction = at.get(d), weighted = correction * at.get(w), now = at.get(x) - correction;
    sum += weighted * weighted;
    at.put(x, now);
    stage(at, now);
  }
};

/* Calls sweep(n, stage) with access to the arrays of the stage and of `more` */
template <class F, class... More>
PetscErrorCode ForStage(const Integrator &I, F sweep, More &...more)
{
  Read     b0(I.base[0]), b1(I.base[1]), b2(I.base[2]);
  Write    u(I.U1), v(I.V1), a(I.A1);
  PetscInt n;

  PetscFunctionBegin;
  PetscCall(VecGetLocalSize(I.U1, &n));
  PetscCall(WithArrays(
    [&] { sweep(n, Stage{ScalePosition(I.p, I.h), ScaleVelocity(I.p, I.h), I.p.ca(), I.moves.empty() ? nullptr : I.moves.data(), {b0.x, b1.x, b2.x}, {u.x, v.x, a.x}}); },
    b0, b1, b2, u, v, a, more...));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode StageOfStates(const Integrator &I, Vec X)
{
  const Parameters &p  = I.p;
  const PetscReal   ks = ScaleState(p, I.h), cs = (1 - p.am_s) / (1 - p.af_s);

  PetscFunctionBegin;
  PetscCall(ForSome(
    I.states,
    [=](PetscInt, PetscScalar x, PetscScalar u0, PetscScalar v0, PetscScalar &u, PetscScalar &v) {
      u = u0 + ks * x;
      v = v0 + cs * x;
    },
    Read(X), Read(I.base[0]), Read(I.base[1]), Write(I.U1), Write(I.V1)));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* After the sweep: states, rotation vectors, and the note that U1, V1, A1 belong to X */
PetscErrorCode FinishStage(Integrator &I, Vec X)
{
  PetscFunctionBegin;
  if (I.count[TSHHT3_STATE]) PetscCall(StageOfStates(I, X));
  if (I.rotations.is) PetscCall(StageOfRotations(I));
  PetscCall(PetscObjectGetId((PetscObject)X, &I.stage_id));
  PetscCall(PetscObjectStateGet((PetscObject)X, &I.stage_state));
  PetscFunctionReturn(PETSC_SUCCESS);
}

} // namespace

/* U1, V1, A1 from X; to be called after PrepareStage() */
PetscErrorCode StageVectors(TS ts, Vec X)
{
  Integrator      &I = Get(ts);
  Read             x(X);
  PetscObjectId    id;
  PetscObjectState state;

  PetscFunctionBegin;
  PetscCall(PetscObjectGetId((PetscObject)X, &id));
  PetscCall(PetscObjectStateGet((PetscObject)X, &state));
  if (id == I.stage_id && state == I.stage_state) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(ForStage(I, [&](PetscInt n, const Stage &stage) { Sweep(n, GivenStage{stage, x.x}); }, x));
  PetscCall(FinishStage(I, X));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* X = X - dX, the norm of dX by which the corrector judges it, and U1, V1, A1 of the new X, in one sweep */
PetscErrorCode SubtractCorrection(TS ts, Vec X, Vec dX, PetscReal *e)
{
  Integrator &I = Get(ts);
  Write       x(X);
  Read        d(dX), w(I.weight);
  Four        sum = {0, 0, 0, 0};

  PetscFunctionBegin;
  PetscCall(ForStage(I, [&](PetscInt n, const Stage &stage) { sum = Sweep(n, CorrectedStage{stage, d.x, w.x, x.x}).sum; }, x, d, w));
  PetscCall(FinishStage(I, X));
  PetscCall(ReduceCorrection(ts, dX, Total(sum), I.h, e));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Computes the parts of U1, V1, A1 that do not depend on X, by (2) and the average of the form. To be called before the first
   residual, and whenever h, the state at t_n or the drift of its velocities have changed. a_n and w_n belong to a step of length
   h_last; their lag behind the true values q''_n and s'_n is stretched to the present h, without which a change of h costs an order
   (Bruels, Arnold 2008). In the paper's form a_n is the true value itself, so that this changes nothing. */
PetscErrorCode PrepareStage(TS ts)
{
  Integrator       &I     = Get(ts);
  const Parameters &p     = I.p;
  const bool        paper = I.form == TSHHT3_FORM_PAPER;
  const PetscReal   h = I.h, r = I.h_last > 0 ? h / I.h_last : 1, kq = OldPosition(p, h), kv = OldVelocity(p, h);
  const PetscReal   cn = paper ? 0 : p.am / (1 - p.af), c0 = paper ? 0 : p.af / (1 - p.af);

  PetscFunctionBegin;
  I.stage_id = 0;
  if (I.order.now > 2) {
    PetscCall(PrepareBDF(ts));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  PetscCall(VelocitiesAtBegin(I, I.base[1]));
  PetscCall(ForEntries(
    [&](PetscInt i, PetscScalar u0, PetscScalar v0, PetscScalar a0, PetscScalar x0, PetscScalar &u, PetscScalar &v, PetscScalar &a) {
      const TSHHT3Role  role  = RoleOf(I, i);
      const PetscScalar begin = v; /* of VelocitiesAtBegin() */
      u = v = a = 0;
      if (role == TSHHT3_COORDINATE) {
        const PetscScalar an = a0 + r * (x0 - a0);
        u                    = u0 + (h * begin + kq * an);
        v                    = begin + kv * an;
        a                    = cn * an - c0 * a0;
      } else if (role == TSHHT3_STATE) {
        const PetscScalar wn = v0 + r * (x0 - v0);
        u                    = u0 + h * (1 - p.gamma_s) * wn;
        v                    = (p.am_s * wn - p.af_s * v0) / (1 - p.af_s);
      }
    },
    Read(I.U0), Read(I.V0), Read(I.A0), Read(I.X0), Write(I.base[0]), Write(I.base[1]), Write(I.base[2])));
  PetscFunctionReturn(PETSC_SUCCESS);
}

} // namespace hht3
