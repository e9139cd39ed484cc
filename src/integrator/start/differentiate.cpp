/*
  Time derivatives of the constraints, where the application gives none: one-sided differences of its residual along q + tau q'. They are exact in
  q'' by construction, blind to what happened before t (a motion may start there), and each row takes the step tau at which it is most accurate:
  where its derivative changes least from one tau to the next. A row that depends on time itself begins with a tau that resolves this (excitation.cpp).
  Where the longest tau is the best one of a row, rounding decides, as where coordinates are large numbers and one of them happens to be near 0: longer
  ones are tried, as far as they move nothing by more than the largest coordinate.
  A row that is no number ahead, as beyond the end of a table, is differenced backwards; one that is none there either has no derivative (NaN).
*/
#include "consistent.h"
#include "integrator/entries.h"
#include "integrator/equations/equations.h"
#include "integrator/random.h"
#include "integrator/equations/roles.h"
#include "integrator/work_vec.h"

namespace hht3
{

namespace
{

constexpr int         levels        = 9, points = 6; /* of a row: tau = T/10, T/40, ...; of fourth order in tau */
constexpr int         max_levels    = 32;        /* of all rows */
constexpr int         longer_levels = 16;            /* levels -1, -2, ...: tau = 4 T/10, 16 T/10, ... (Units.ForcesOfTheStart) */
constexpr signed char no_level      = -longer_levels - 1;

PetscReal LevelTime(PetscReal T, int level) { return 0.1 * T * PetscPowRealInt(0.25, level); }

/* The first level of a row that follows time within `excitation` */
int FirstLevel(PetscReal T, PetscReal excitation)
{
  int level = 0;
  while (level < max_levels - levels && LevelTime(T, level) > excitation) level++;
  return level;
}
constexpr PetscReal first_weights[points]  = {-25. / 12, 4, -3, 4. / 3, -1. / 4, 0};
constexpr PetscReal second_weights[points] = {45. / 12, -154. / 12, 214. / 12, -13, 61. / 12, -10. / 12};
constexpr PetscReal first_sum              = 32. / 3, second_sum = 160. / 3; /* of their sizes */

/* A derivative of each row: the best one so far, and the level that it is of */
struct Best {
  std::vector<PetscReal> last, value, change;
  std::vector<signed char> &level;
  const std::vector<signed char> &from; /* first levels; empty: all rows begin with 0 */
  bool                      known; /* the levels are those of an earlier call */
  Best(std::vector<signed char> &at, const std::vector<signed char> &begin, PetscInt n, bool again)
    : last(n, 0), value(n, NAN), change(n, PETSC_MAX_REAL), level(at), from(begin), known(again)
  {
    if (!known) level.assign((size_t)n, no_level);
  }
  /* noise: what rounding of the coordinates makes of x. Over a tau that is too short for anything to change the differences vanish, and agree (Units.ForcesOfTheStart).
     Of longer tau only those that go on from the longest so far, if that was the best. */
  void take(PetscInt i, int l, PetscReal x, PetscReal noise)
  {
    const PetscReal d    = PetscMax(PetscAbsReal(x - last[i]), noise);
    const int       nth  = from.empty() ? l : l - from[i];
    const bool      next = l < 0 ? asksFor(i, l) : nth > 0 && nth < levels;
    if (known ? l == level[i] : next && d < change[i]) { /* false for NaN */
      change[i] = d;
      value[i]  = x;
      level[i]  = (signed char)l;
    }
    last[i] = x;
  }
  bool asksFor(PetscInt i, int l) const { return l == -1 ? level[i] == 1 : level[i] == l + 1; }
};

/* Which levels any row on any rank takes its derivative from, those of order 0 or 1 */
PetscErrorCode LevelsInUse(TS ts, const Integrator &I, const Levels &levels, bool first, bool second, bool (&used)[longer_levels + max_levels])
{
  PetscBool any[longer_levels + max_levels] = {};

  PetscFunctionBegin;
  for (size_t i = 0; i < I.role.size(); i++) {
    if (!IsConstraint(I, (PetscInt)i)) continue;
    const bool holonomic = I.role[i] == TSHHT3_HOLONOMIC;
    const int  one = first && holonomic ? levels.of[0][i] : no_level, two = second ? levels.of[holonomic ? 1 : 0][i] : no_level;
    for (int level : {one, two})
      if (level != no_level) any[longer_levels + level] = PETSC_TRUE;
  }
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, any, longer_levels + max_levels, MPIU_BOOL, MPI_LOR, PetscObjectComm((PetscObject)ts)));
  for (int l = 0; l < longer_levels + max_levels; l++) used[l] = any[l];
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* First levels of rows that follow time, and which levels are to be looked at */
PetscErrorCode LevelsToTry(const Integrator &I, PetscReal T, std::vector<signed char> &from, bool (&used)[longer_levels + max_levels])
{
  const int last = I.excitation ? FirstLevel(T, I.fastest) : 0;

  PetscFunctionBegin;
  for (int l = -longer_levels; l < max_levels; l++) used[longer_levels + l] = l >= 0 && l < last + levels;
  if (last == 0) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(ForEntries([&](PetscInt, PetscScalar x) { from.push_back((signed char)FirstLevel(T, PetscRealPart(x))); }, Read(I.excitation)));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Of what does not move: constraints do not change, and those of velocities are what they are */
PetscErrorCode DerivativesAtRest(TS ts, PetscReal t, Vec U, Vec V, Vec first, Vec second)
{
  Integrator &I = Get(ts);
  WorkVec     F;

  PetscFunctionBegin;
  if (second) PetscCall(VecZeroEntries(second));
  if (!first) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(VecZeroEntries(first));
  if (!I.count[TSHHT3_NONHOLONOMIC]) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(F.like(U));
  PetscCall(EvaluateResidual(ts, t, U, V, first, F)); /* `first` is zero yet */
  PetscCall(ForEntries([&](PetscInt i, PetscScalar f, PetscScalar &x) { if (RoleOf(I, i) == TSHHT3_NONHOLONOMIC) x = f; }, Read(F), Write(first)));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The rows along U + tau V, t + tau */
struct Path {
  TS                     ts;
  PetscReal              t, speed = 0, largest = 0; /* of the coordinates */
  Vec                    U, V;
  WorkVec                at, F, zero;
  std::vector<PetscReal> now; /* rows at t */

  Path(TS s, PetscReal time, Vec u, Vec v) : ts(s), t(time), U(u), V(v) {}

  PetscErrorCode create()
  {
    const auto size = [&](PetscInt i, PetscScalar u) { return IsCoordinate(Get(ts), i) ? PetscAbsScalar(u) : 0; };
    PetscFunctionBegin;
    for (WorkVec *x : {&at, &F, &zero}) PetscCall(x->like(U));
    PetscCall(LargestOf(size, &largest, Read(U)));
    PetscCall(LargestOf(size, &speed, Read(V)));
    PetscCall(VecCopy(U, at));
    PetscCall(rows(t, now));
    PetscFunctionReturn(PETSC_SUCCESS);
  }

  /* of what stands in `at` */
  PetscErrorCode rows(PetscReal time, std::vector<PetscReal> &f)
  {
    PetscFunctionBegin;
    f.clear();
    PetscCall(ResidualAlong(ts, time, at, V, zero, F));
    PetscCall(ForEntries([&](PetscInt, PetscScalar x) { f.push_back(PetscRealPart(x)); }, Read(F)));
    PetscFunctionReturn(PETSC_SUCCESS);
  }

  /* Sums of differences over tau: times 1/tau and 1/tau^2 first and second derivatives */
  PetscErrorCode differences(PetscReal tau, std::vector<PetscReal> &first, std::vector<PetscReal> &second)
  {
    std::vector<PetscReal> f = now;
    PetscFunctionBegin;
    first.assign(now.size(), 0);
    second.assign(now.size(), 0);
    for (int j = 0; j < points; j++) {
      if (j > 0) {
        PetscCall(VecWAXPY(at, j * tau, V, U));
        PetscCall(rows(t + j * tau, f));
      }
      for (size_t i = 0; i < f.size(); i++) {
        first[i] += first_weights[j] * f[i];
        second[i] += second_weights[j] * f[i];
      }
    }
    PetscFunctionReturn(PETSC_SUCCESS);
  }

  /* Over -tau for those constraints that are no numbers over tau; sign: of each row's tau (Start.WhereATableEnds) */
  PetscErrorCode differencesWhereNumbers(PetscReal tau, std::vector<PetscReal> &first, std::vector<PetscReal> &second, std::vector<PetscReal> &sign)
  {
    std::vector<PetscReal> s1, s2;
    bool                   any = false;
    PetscFunctionBegin;
    PetscCall(differences(tau, first, second));
    sign.assign(now.size(), 1);
    for (size_t i = 0; i < now.size(); i++)
      if (IsConstraint(Get(ts), (PetscInt)i) && PetscIsInfOrNanReal(first[i])) any = true;
    PetscCall(OnAnyRank(ts, any, &any));
    if (!any) PetscFunctionReturn(PETSC_SUCCESS);
    PetscCall(differences(-tau, s1, s2));
    for (size_t i = 0; i < now.size(); i++) {
      if (!PetscIsInfOrNanReal(first[i])) continue;
      first[i]  = s1[i];
      second[i] = s2[i];
      sign[i]   = -1;
    }
    PetscFunctionReturn(PETSC_SUCCESS);
  }

  /* What rounding of the coordinates makes of each row, by a sample; at least that of the largest coordinate: what is 0, as a rotation within the step, turns lengths
     that are rounded */
  PetscErrorCode roundingOfRows(std::vector<PetscReal> &rounding)
  {
    constexpr int times_rounding = 8; /* times rounding */
    PetscInt               start;
    std::vector<PetscReal> f;
    PetscFunctionBegin;
    PetscCall(VecGetOwnershipRange(U, &start, NULL));
    rounding.assign(now.size(), PETSC_MACHINE_EPSILON * largest);
    PetscCall(ForEntries([&](PetscInt i, PetscScalar u, PetscScalar &x) { x = u * (1 + times_rounding * PETSC_MACHINE_EPSILON * RandomRounding(start + i, 0)); }, Read(U), Write(at)));
    PetscCall(rows(t, f));
    for (size_t i = 0; i < f.size(); i++) rounding[i] = PetscMax(rounding[i], PetscAbsReal(f[i] - now[i]) / times_rounding);
    PetscFunctionReturn(PETSC_SUCCESS);
  }
};

/* Whether any row of any rank asks for a tau as long as that of level l < 0, what follows time is resolved by it, and none of what moves is moved further than the
   largest coordinate; the same on all ranks, those without unknowns too */
PetscErrorCode IsLongerOf(const Path &along, const Best &d1, const Best &d2, int l, PetscReal tau, bool *yes)
{
  const Integrator &I    = Get(along.ts);
  bool              asks = false;

  PetscFunctionBegin;
  *yes = false;
  if (!(along.speed > 0) || (I.excitation && tau > I.fastest) || (points - 1) * tau * along.speed > along.largest) PetscFunctionReturn(PETSC_SUCCESS);
  for (PetscInt i = 0; i < (PetscInt)I.role.size() && !asks; i++)
    if (IsConstraint(I, i) && (d1.asksFor(i, l) || d2.asksFor(i, l))) asks = true;
  PetscCall(OnAnyRank(along.ts, asks, yes));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The derivatives of each row: of those over `used` levels, or of longer ones where these are asked for */
PetscErrorCode FindBest(Path &along, PetscReal T, const bool (&used)[longer_levels + max_levels], Best &d1, Best &d2)
{
  const Integrator      &I = Get(along.ts);
  bool                   more;
  std::vector<PetscReal> s1, s2, sign, rounding(along.now.size(), 0);

  PetscFunctionBegin;
  if (!d1.known) PetscCall(along.roundingOfRows(rounding));
  const auto attempt = [&](int level) -> PetscErrorCode {
    const PetscReal tau = SpanFrom(along.t, LevelTime(T, level));
    PetscFunctionBegin;
    PetscCall(along.differencesWhereNumbers(tau, s1, s2, sign));
    for (PetscInt i = 0; i < (PetscInt)s1.size(); i++) {
      if (!IsConstraint(I, i)) continue;
      d1.take(i, level, s1[i] / (sign[i] * tau), first_sum * rounding[i] / tau);
      d2.take(i, level, s2[i] / (tau * tau), second_sum * rounding[i] / (tau * tau));
    }
    PetscFunctionReturn(PETSC_SUCCESS);
  };
  for (int level = -longer_levels; level < max_levels; level++)
    if (used[longer_levels + level]) PetscCall(attempt(level));
  for (int level = -1; level >= -longer_levels && !d1.known; level--) {
    PetscCall(IsLongerOf(along, d1, d2, level, LevelTime(T, level), &more));
    if (!more) break;
    if (level == -1) PetscCall(attempt(0)); /* the one before it */
    PetscCall(attempt(level));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

} // namespace

PetscErrorCode IsAtRest(const Integrator &I, Vec V, PetscBool *yes)
{
  PetscReal v;

  PetscFunctionBegin;
  *yes = PETSC_FALSE;
  if (I.excitation) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(VecNorm(V, NORM_INFINITY, &v));
  *yes = (PetscBool)(v == 0);
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode ConstraintDerivatives(TS ts, PetscReal t, Vec U, Vec V, PetscReal T, Levels *levels, Vec first, Vec second)
{
  Integrator              &I = Get(ts);
  Path                     along(ts, t, U, V);
  PetscBool                rest;
  bool                     used[longer_levels + max_levels];
  std::vector<signed char> from;

  PetscFunctionBegin;
  PetscCall(IsAtRest(I, V, &rest));
  if (rest) {
    levels->known = false;
    PetscCall(DerivativesAtRest(ts, t, U, V, first, second));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  if (levels->known) PetscCall(LevelsInUse(ts, I, *levels, first, second, used));
  else PetscCall(LevelsToTry(I, T, from, used));
  PetscCall(along.create());
  Best d1(levels->of[0], from, (PetscInt)along.now.size(), levels->known), d2(levels->of[1], from, (PetscInt)along.now.size(), levels->known);
  PetscCall(FindBest(along, T, used, d1, d2));
  levels->known = true;
  for (int order = 1; order <= 2; order++) {
    Vec out = order == 1 ? first : second;
    if (!out) continue;
    PetscCall(ForEntries(
      [&](PetscInt i, PetscScalar &g) {
        g = 0;
        if (!IsConstraint(I, i)) return;
        if (I.role[i] == TSHHT3_HOLONOMIC) g = order == 1 ? d1.value[i] : d2.value[i];
        else g = order == 1 ? along.now[i] : d1.value[i];
      },
      Write(out)));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

} // namespace hht3
