/*
  Maps state and history to new coordinates.

  The application's map takes (q, q', q'') at one time from the old to the new coordinates. But the predictor keeps only
  algorithmic accelerations: a_{n-k} is q'' at x_k = t_{n-k} + lag h_{n-k}, a time at
  which neither q nor q' is stored. So the motion is reconstructed: q'' as the polynomial through the
  a_{n-k} at x_k, q' and q as its integrals from the state at t_n. The integrals are as smooth in time as the
  polynomial, and so are the mapped accelerations: they predict as well as the old ones did.
  (Newmark's formulas backwards in time would give the stored q and q', but with the jumps that changes of h leave in them, which
  divided differences magnify.)

  All of this is linear in the stored vectors, so that it takes a few scalar weights per time and one sweep.

  Entries that the map does not change stay as they are, bit for bit.
*/
#include "change.h"
#include "integrator/entries.h"
#include "integrator/step/predictor.h"
#include "integrator/work_vec.h"
#include <algorithm>
#include <petscblaslapack.h>

namespace hht3
{

namespace
{

constexpr PetscInt max_basis = max_degree + 1;

/* The motion about t_n in old coordinates: q'' as the polynomial through stored vectors */
struct Motion {
  PetscInt  nodes = 0;            /* number of values of the predictor */
  PetscInt  n     = 0;            /* number of stored vectors in use */
  Vec       stored[max_basis];    /* those of the predictor; if it has only one, A0 is the second */
  PetscReal x[max_basis];         /* their times, relative to t_n */
  PetscReal unit = 1;             /* unit of time in the powers of the polynomial */
};

Motion Recall(const Integrator &I)
{
  const Predictor &p = I.predictor;
  Motion           m;
  PetscReal        lag = I.p.lag() * I.h_last;
  m.nodes = m.n = p.available + 1;
  m.unit        = I.h_last > 0 ? I.h_last : 1;
  for (PetscInt k = 0; k < m.nodes; k++) {
    if (k > 0 && k < m.nodes - 1) lag = I.p.lag() * (p.t[k] - p.t[k + 1]); /* of the step that ended at t_{n-k}; it is not known for the last node */
    m.x[k]      = p.t[k] - p.t[0] + lag;
    m.stored[k] = p.X[k];
  }
  if (m.nodes == 1 && m.x[0] != 0) { /* a history of one value: with q'' at t_n it gives a slope */
    m.n         = 2;
    m.x[1]      = 0;
    m.stored[1] = I.A0;
  }
  return m;
}

/* Weights w[0], w[1], w[2] of the stored vectors in q''(x) and in its first and second integral from 0 to x */
PetscErrorCode MotionWeights(const Motion &m, PetscReal x, PetscReal w[3][max_basis])
{
  PetscReal       L[max_basis][max_basis] = {}, power = 1;
  const PetscReal z = x / m.unit, u = m.unit;
  PetscBLASInt    n, sides = 3, stride = max_basis, pivots[max_basis], failed;

  PetscFunctionBegin;
  for (PetscInt j = 0; j < m.n; j++, power *= z) {
    w[0][j] = power;
    w[1][j] = u * power * z / (j + 1);
    w[2][j] = u * u * power * z * z / ((j + 1) * (j + 2));
    for (PetscInt k = 0; k < m.n; k++) L[k][j] = PetscPowRealInt(m.x[k] / u, j);
  }
  PetscCall(PetscBLASIntCast(m.n, &n));
  PetscCallBLAS("LAPACKgesv", LAPACKgesv_(&n, &sides, &L[0][0], &stride, pivots, &w[0][0], &stride, &failed)); /* with L^T: LAPACK stores by columns */
  PetscCheck(!failed, PETSC_COMM_SELF, PETSC_ERR_LIB, "The polynomial through the last steps cannot be evaluated: LAPACK's gesv returns %d", (int)failed);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Argument and result of the map, and which entries it has changed in any of the triples so far: Triple, any of q, q', q''; Acceleration, q'' */
struct Mapping {
  enum : unsigned char { Triple = 1, Acceleration = 2 };
  WorkVec                    old[3], now[3];
  std::vector<unsigned char> changed;

  PetscErrorCode like(Vec U)
  {
    PetscInt n;

    PetscFunctionBegin;
    for (int k = 0; k < 3; k++) {
      PetscCall(old[k].like(U));
      PetscCall(now[k].like(U));
    }
    PetscCall(VecGetLocalSize(U, &n));
    changed.assign((size_t)n, 0);
    PetscFunctionReturn(PETSC_SUCCESS);
  }
};

/* Applies the map at t_n + x: from `old` to `now` */
PetscErrorCode MapAt(TS ts, Mapping &map, PetscReal x)
{
  Integrator &I = Get(ts);

  PetscFunctionBegin;
  for (int k = 0; k < 3; k++) PetscCall(VecCopy(map.old[k], map.now[k]));
  PetscCall((*I.change.map)(ts, ts->ptime + x, map.now[0], map.now[1], map.now[2], I.change.ctx));
  for (int k = 0; k < 3; k++) {
    const unsigned char what = k == 2 ? Mapping::Triple | Mapping::Acceleration : Mapping::Triple;
    PetscCall(ForEntries([&](PetscInt i, PetscScalar a, PetscScalar b) { if (a != b) map.changed[i] |= what; }, Read(map.old[k]), Read(map.now[k])));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The motion at t_n + x. Unknowns that are no coordinates have their values at t_n, and no accelerations. */
PetscErrorCode At(const Integrator &I, const Motion &m, PetscReal x, const WorkVec (&to)[3])
{
  PetscReal w[3][max_basis];
  Vec       stored[max_basis];

  PetscFunctionBegin;
  PetscCall(MotionWeights(m, x, w));
  std::copy(m.stored, m.stored + m.n, stored);
  for (int s = 0; s < 3; s++) {
    PetscCall(VecZeroEntries(to[2 - s]));
    PetscCall(VecMAXPY(to[2 - s], m.n, w[s], stored));
  }
  PetscCall(ForEntries(
    [&](PetscInt i, PetscScalar u0, PetscScalar v0, PetscScalar &u, PetscScalar &v, PetscScalar &a) {
      const bool moves = IsCoordinate(I, i);
      u = moves ? u0 + x * v0 + u : u0;
      v = moves ? v0 + v : v0;
      if (!moves) a = 0;
    },
    Read(I.U0), Read(I.V0), Write(to[0]), Write(to[1]), Write(to[2])));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Maps q'' at the nodes */
PetscErrorCode MapNodes(TS ts, const Motion &m, Mapping &map, const WorkVec value[])
{
  PetscFunctionBegin;
  for (PetscInt k = 0; k < m.nodes; k++) {
    PetscCall(At(Get(ts), m, m.x[k], map.old));
    PetscCall(MapAt(ts, map, m.x[k]));
    PetscCall(VecCopy(map.now[2], value[k]));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Computes d of drift.cpp: the third derivative in new coordinates less the old one mapped as a tangent. The map is affine
   in q'', so that its difference for two values of q'' maps a tangent. */
PetscErrorCode MapJerk(TS ts, const Motion &m, Mapping &map)
{
  Integrator     &I = Get(ts);
  const PetscReal d = 0.01 * m.unit;
  WorkVec         jerk;

  PetscFunctionBegin;
  if (!I.normal_jerk) PetscCall(VecDuplicate(I.U0, &I.normal_jerk));
  PetscCall(jerk.like(I.U0));
  PetscCall(VecZeroEntries(I.normal_jerk));
  for (int sign = -1; sign <= 1; sign += 2) {
    PetscCall(At(I, m, sign * d, map.old));
    PetscCall(MapAt(ts, map, sign * d));
    PetscCall(VecAXPY(I.normal_jerk, sign / (2 * d), map.now[2]));
    PetscCall(VecAXPY(jerk, sign / (2 * d), map.old[2]));
  }
  for (int sign = -1; sign <= 1; sign += 2) {
    PetscCall(VecCopy(I.U0, map.old[0]));
    PetscCall(VecCopy(I.V0, map.old[1]));
    PetscCall(VecWAXPY(map.old[2], sign * m.unit, jerk, I.A0));
    PetscCall(MapAt(ts, map, 0));
    PetscCall(VecAXPY(I.normal_jerk, -sign / (2 * m.unit), map.now[2]));
  }
  PetscCall(ForEntries([&](PetscInt i, PetscScalar &b) { if (!(map.changed[i] & Mapping::Acceleration)) b = 0; /* rounding */ }, Write(I.normal_jerk)));
  I.jerk = Jerk::Whole;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Maps the state at t_n */
PetscErrorCode MapState(TS ts, Mapping &map)
{
  Integrator &I = Get(ts);

  PetscFunctionBegin;
  PetscCall(VecCopy(I.U0, map.old[0]));
  PetscCall(VecCopy(I.V0, map.old[1]));
  PetscCall(VecCopy(I.A0, map.old[2]));
  PetscCall(MapAt(ts, map, 0));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The map may change coordinates only: other unknowns have no second derivative */
PetscErrorCode CheckRoles(TS ts, const Mapping &map)
{
  Integrator &I = Get(ts);
  PetscInt    first;

  PetscFunctionBegin;
  PetscCall(FirstWhere([&](PetscInt i, PetscScalar) { return map.changed[i] && !IsCoordinate(I, i); }, &first, Read(I.U0)));
  PetscCheck(first < 0, PetscObjectComm((PetscObject)ts), PETSC_ERR_ARG_WRONG,
             "The map of TSHHT3SetCoordinateChange() has changed unknown %" PetscInt_FMT
             " at t = %g, which is not a coordinate: it may change U, U', U'' of coordinates only",
             first, (double)ts->ptime);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Copies changed entries into the predictor and into the state. In the paper's form q''_n and a_n are the same, except after a start,
   and stay so. */
PetscErrorCode TakeOver(Integrator &I, const Motion &m, const Mapping &map, const WorkVec value[])
{
  PetscFunctionBegin;
  for (PetscInt k = 0; k < m.nodes; k++)
    PetscCall(ForEntries([&](PetscInt i, PetscScalar now, PetscScalar &x) { if (map.changed[i] & Mapping::Acceleration) x = now; }, Read(value[k]), Write(I.predictor.X[k])));
  PetscCall(ForEntries(
    [&](PetscInt i, PetscScalar u, PetscScalar v, PetscScalar a, PetscScalar d0, PetscScalar &u0, PetscScalar &v0, PetscScalar &a0, PetscScalar &x0) {
      if (!map.changed[i]) return;
      const bool same = I.form == TSHHT3_FORM_PAPER && a0 == x0, accelerates = map.changed[i] & Mapping::Acceleration;
      u0 = u;
      v0 = v;
      if (accelerates) x0 = d0;
      a0 = same && accelerates ? d0 : a;
    },
    Read(map.now[0]), Read(map.now[1]), Read(map.now[2]), Read(value[0]), Write(I.U0), Write(I.V0), Write(I.A0), Write(I.X0)));
  PetscFunctionReturn(PETSC_SUCCESS);
}

} // namespace

/* Maps U0 and V0 before a consistent start: there is no history, and accelerations are not known yet */
PetscErrorCode MapStart(TS ts)
{
  Integrator &I = Get(ts);
  Mapping     map;

  PetscFunctionBegin;
  PetscCall(map.like(I.U0));
  PetscCall(VecZeroEntries(I.A0));
  PetscCall(MapState(ts, map));
  PetscCall(CheckRoles(ts, map));
  PetscCall(VecCopy(map.now[0], I.U0));
  PetscCall(VecCopy(map.now[1], I.V0));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Maps U0, V0, A0, X0 and the predictor's values, and computes d for drift.cpp */
PetscErrorCode MapHistory(TS ts)
{
  Integrator  &I = Get(ts);
  const Motion m = Recall(I);
  Mapping      map;
  WorkVec      value[max_basis];

  PetscFunctionBegin;
  PetscCall(map.like(I.U0));
  for (PetscInt k = 0; k < m.nodes; k++) PetscCall(value[k].like(I.U0));
  PetscCall(MapNodes(ts, m, map, value));
  if (I.count[TSHHT3_HOLONOMIC] && m.n > 1) PetscCall(MapJerk(ts, m, map));
  PetscCall(MapState(ts, map));
  PetscCall(CheckRoles(ts, map));
  PetscCall(TakeOver(I, m, map, value));
  PetscFunctionReturn(PETSC_SUCCESS);
}

} // namespace hht3
