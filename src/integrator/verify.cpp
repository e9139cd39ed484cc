/*
  Whether a small correction proves anything.

  The corrector stops when corrections are small. Where the Newton matrix claims far more stiffness than there is, because it
  is old and what held the system has let go, or because the application's Jacobian is wrong, corrections are small whatever
  the residual, a rate of earlier steps knows nothing of it, and neither does the error test. So the claim itself is measured:

    claim_i = P_ii / (ca M_ii)        how much stiffer than inertia the matrix says that unknown i is
    E       = |k| h^2 |claim dX|      what the correction would have been, were there only inertia

  Where the matrix claims nothing, E is the correction and nothing is to be done. Else accelerations of up to A = E/(|k| h^2) may be
  missing since the last proof, a time T ago, and with them positions of A T^2/2. Before this exceeds a part of the tolerance, the
  residual is evaluated once more after the last correction. It must have followed: what is left of every entry is below
  `followed` times what it was (P dX, the linear model that the correction has solved), or rounding of q times stiffness, or
  too little to move the positions. And in sum it must not have stayed as it was, which tells forces that persist from
  rounding, which does not.

  Otherwise the iteration goes on; the rate that it then measures, or a new matrix, settles the matter.
*/
#include "impl.h"

namespace hht3
{

namespace
{

constexpr PetscReal least_claim = 10;  /* below it a correction is too small by no more than this, and the next steps take up what is left; inertia that varies with the position claims as much */
constexpr PetscReal most_claim  = 1e11; /* beyond it the residual is rounding of forces (modes of 1e7 Hz at h omega = 1e6) */
constexpr PetscReal allowed     = 0.1; /* unproved change of positions, in units of the tolerance */
constexpr PetscReal least_error = 1e-4; /* at fixed steps the error of the last step takes the tolerance's place, down to here: forces have rounding, too */
constexpr PetscReal followed    = 0.3; /* a rate at which the iteration converges */
constexpr PetscReal massless    = 1e-14; /* inertia below this part of the mean is rounding */
constexpr PetscReal variation   = 1e3;   /* of inertia from one matrix to another; beyond, a sum has cancelled or stiff forces have drowned it in rounding */
constexpr PetscReal stayed      = 0.2; /* |1 - <r', r>/<r, r>| below it: the residual has not followed at all */

constexpr PetscReal hopeless    = 0.1; /* part of a correction that the residual answers: below it the iteration does not converge in ten */

constexpr PetscReal rounding_of_sums = 64 * PETSC_MACHINE_EPSILON; /* of some terms in a residual, relative to the largest */

/* d s'/d w, which a row of a state has in place of ca */
PetscReal StateInertia(const Parameters &p) { return p.gamma_s * p.gamma / p.beta; }

bool HasDefinitions(const Integrator &I) { return I.count[TSHHT3_VARIABLE] || I.count[TSHHT3_FORCE]; }

/* Whether the matrix may hide an imbalance: by its diagonal, or by definitions, whose stiffness does not stand there */
bool Claims(const Integrator &I) { return I.verify.largest >= least_claim || (I.verify.largest > 0 && HasDefinitions(I)); }

/* inertia_i: M_ii of coordinates, dF/ds' of states, the diagonal p of the matrix of the start; 0 for a coordinate without mass, but for
   rounding, and for all others: of these nothing is asked */
PetscErrorCode NoteInertia(TS ts, const PetscScalar *p, PetscInt n, PetscScalar *m)
{
  Integrator &I        = Get(ts);
  PetscReal   local[2] = {0, 0}, sum[2];

  PetscFunctionBegin;
  for (PetscInt i = 0; i < n; i++)
    if (IsCoordinate(I, i) && PetscAbsScalar(p[i]) > 0) local[0] += PetscLogReal(PetscAbsScalar(p[i])), local[1] += 1;
  PetscCallMPI(MPI_Allreduce(local, sum, 2, MPIU_REAL, MPIU_SUM, PetscObjectComm((PetscObject)ts)));
  const PetscReal mean = sum[1] > 0 ? PetscExpReal(sum[0] / sum[1]) : 1;
  for (PetscInt i = 0; i < n; i++) m[i] = IsDifferential(RoleOf(I, i)) && PetscAbsScalar(p[i]) > massless * mean ? PetscAbsScalar(p[i]) : 0;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Of a row, in units of the tolerance: a residual that inertia alone answers, the same of a residual over its inertia, and rounding */
struct RowScale {
  PetscReal answer, claimed, rounding;
};

struct RowScales {
  PetscReal          answer[2], claimed[2]; /* of coordinates, of states */
  const PetscScalar *w, *c, *m, *noise;

  RowScale at(TSHHT3Role r, PetscInt i) const
  {
    const int       k = r == TSHHT3_STATE;
    const PetscReal a = answer[k] * PetscRealPart(w[i] / m[i]);
    return {a, claimed[k] * PetscRealPart(w[i]), a * PetscRealPart(noise[i])};
  }
};

PetscErrorCode GetRowScales(const Integrator &I, RowScales *s)
{
  PetscFunctionBegin;
  s->claimed[0] = PetscAbsReal(I.p.k) * I.h * I.h;
  s->claimed[1] = I.p.gamma_s * I.h;
  s->answer[0]  = s->claimed[0] / I.p.ca();
  s->answer[1]  = s->claimed[1] / StateInertia(I.p);
  PetscCall(VecGetArrayRead(I.weight, &s->w));
  PetscCall(VecGetArrayRead(I.verify.claim, &s->c));
  PetscCall(VecGetArrayRead(I.verify.inertia, &s->m));
  PetscCall(VecGetArrayRead(I.verify.noise, &s->noise));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode RestoreRowScales(const Integrator &I, RowScales *s)
{
  PetscFunctionBegin;
  PetscCall(VecRestoreArrayRead(I.verify.noise, &s->noise));
  PetscCall(VecRestoreArrayRead(I.verify.inertia, &s->m));
  PetscCall(VecRestoreArrayRead(I.verify.claim, &s->c));
  PetscCall(VecRestoreArrayRead(I.weight, &s->w));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The sums that entry(row, scale, sum) adds to, over all rows of which something is asked and all ranks */
template <class Entry>
PetscErrorCode SumRows(TS ts, PetscReal sum[4], Entry entry)
{
  Integrator &I        = Get(ts);
  PetscReal   local[4] = {0, 0, 0, 0};
  RowScales   s;
  PetscInt    n;

  PetscFunctionBegin;
  PetscCall(VecGetLocalSize(I.X, &n));
  PetscCall(GetRowScales(I, &s));
  for (PetscInt i = 0; i < n; i++) {
    const TSHHT3Role r = RoleOf(I, i);
    if (PetscRealPart(s.m[i]) > 0 && PetscRealPart(s.c[i]) < most_claim) entry(i, s.at(r, i), local);
  }
  PetscCall(RestoreRowScales(I, &s));
  PetscCallMPI(MPI_Allreduce(local, sum, 4, MPIU_REAL, MPIU_SUM, PetscObjectComm((PetscObject)ts)));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* to = the entries of R whose role is among the two, zeros elsewhere */
PetscErrorCode Keep(const Integrator &I, Vec R, TSHHT3Role one, TSHHT3Role other, Vec to)
{
  const PetscScalar *r;
  PetscScalar       *t;
  PetscInt           n;

  PetscFunctionBegin;
  PetscCall(VecGetLocalSize(R, &n));
  PetscCall(VecGetArrayRead(R, &r));
  PetscCall(VecGetArrayWrite(to, &t));
  for (PetscInt i = 0; i < n; i++) t[i] = RoleOf(I, i) == one || RoleOf(I, i) == other ? r[i] : 0;
  PetscCall(VecRestoreArrayWrite(to, &t));
  PetscCall(VecRestoreArrayRead(R, &r));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Imbalances of variables and force states act on the equations of motion: R -= P R_B for B = V, F */
PetscErrorCode PassDefinitionsOn(TS ts, Mat P, Vec R)
{
  Integrator &I = Get(ts);
  Vec         only, product;

  PetscFunctionBegin;
  if (!HasDefinitions(I)) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(VecDuplicate(R, &only));
  PetscCall(VecDuplicate(R, &product));
  PetscCall(Keep(I, R, TSHHT3_VARIABLE, TSHHT3_FORCE, only));
  PetscCall(MatMult(P, only, product));
  PetscCall(VecAXPY(R, -1, product));
  PetscCall(VecDestroy(&product));
  PetscCall(VecDestroy(&only));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* What the correction was to take away of the residual, by the linear model that it has solved, but for what the constraint forces of
   its multipliers answer: model = P dX - P_lambda dLambda. Those stand in work. */
PetscErrorCode Model(TS ts, Vec dX)
{
  Integrator   &I = Get(ts);
  Verification &v = I.verify;
  Mat           P;

  PetscFunctionBegin;
  if (!v.model) PetscCall(VecDuplicate(dX, &v.model));
  if (!v.work) PetscCall(VecDuplicate(dX, &v.work));
  PetscCall(SNESGetJacobian(ts->snes, NULL, &P, NULL, NULL));
  if (I.constraints()) {
    PetscCall(Keep(I, dX, TSHHT3_HOLONOMIC, TSHHT3_NONHOLONOMIC, v.model));
    PetscCall(MatMult(P, v.model, v.work));
    PetscCall(MatMult(P, dX, v.model));
    PetscCall(VecAXPY(v.model, -1, v.work));
  } else {
    PetscCall(VecZeroEntries(v.work));
    PetscCall(MatMult(P, dX, v.model));
  }
  PetscCall(PassDefinitionsOn(ts, P, v.model));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* E: the correction times the claims. Definitions hide stiffness from the diagonal: then what inertia alone would make of the model */
PetscErrorCode Claimed(TS ts, Vec dX, PetscReal *E)
{
  Integrator        &I = Get(ts);
  const bool         definitions = HasDefinitions(I);
  const PetscScalar *d, *c;
  PetscReal          sum[4];

  PetscFunctionBegin;
  if (definitions) PetscCall(Model(ts, dX));
  const Vec R = definitions ? I.verify.model : dX;
  PetscCall(VecGetArrayRead(R, &d));
  PetscCall(VecGetArrayRead(I.verify.claim, &c));
  PetscCall(SumRows(ts, sum, [&](PetscInt i, const RowScale &s, PetscReal local[]) {
    /* claim dX is P_ii dX_i / inertia_i: the diagonal's part of the model */
    local[0] += PetscSqr(definitions ? PetscRealPart(d[i]) * s.answer : PetscRealPart(c[i] * d[i]) * s.claimed);
  }));
  PetscCall(VecRestoreArrayRead(I.verify.claim, &c));
  PetscCall(VecRestoreArrayRead(R, &d));
  *E = PetscSqrtReal(sum[0] / I.norm_size);
  PetscFunctionReturn(PETSC_SUCCESS);
}

bool Followed(const RowScale &s, PetscReal now, PetscReal was)
{
  return PetscAbsReal(now) * s.answer <= followed * PetscAbsReal(was) * s.answer + s.rounding;
}

/* What is left of the residual F that the correction was to take away, in units of the tolerance; and how much of it is as it was */
PetscErrorCode Compare(TS ts, Vec F, PetscReal *left, PetscReal *stay, PetscReal *part)
{
  Integrator        &I = Get(ts);
  const bool         known = I.corrector.rate >= 0; /* then the iteration has been seen to converge, and what is left of constraint forces is a part of what they were */
  const PetscScalar *f, *r, *g;
  PetscReal          sum[4];
  Vec                now = F;
  Mat                P;

  PetscFunctionBegin;
  if (HasDefinitions(I)) {
    PetscCall(SNESGetJacobian(ts->snes, NULL, &P, NULL, NULL));
    PetscCall(VecDuplicate(F, &now));
    PetscCall(VecCopy(F, now));
    PetscCall(PassDefinitionsOn(ts, P, now));
  }
  PetscCall(VecGetArrayRead(now, &f));
  PetscCall(VecGetArrayRead(I.verify.model, &r));
  PetscCall(VecGetArrayRead(I.verify.work, &g));
  PetscCall(SumRows(ts, sum, [&](PetscInt i, const RowScale &s, PetscReal local[]) {
    const PetscReal is = PetscRealPart(f[i]) * s.answer, was = PetscRealPart(r[i]) * s.answer, constraint = known ? PetscAbsReal(PetscRealPart(g[i])) * s.answer : 0;
    const PetscReal excess = PetscSqr(PetscMax(0, PetscAbsReal(is) - followed * (PetscAbsReal(was) + constraint) - s.rounding));
    local[0] += excess;
    if (PetscAbsReal(is - was) < 0.5 * PetscAbsReal(was)) local[3] += excess;
    if (PetscAbsReal(was) <= s.rounding / 16) return; /* less cannot be told from rounding, even by what persists */
    local[1] += is * was;
    local[2] += was * was;
  }));
  PetscCall(VecRestoreArrayRead(I.verify.work, &g));
  PetscCall(VecRestoreArrayRead(I.verify.model, &r));
  PetscCall(VecRestoreArrayRead(now, &f));
  if (now != F) PetscCall(VecDestroy(&now));
  *left = PetscSqrtReal(sum[0] / I.norm_size);
  *stay = PetscSqrtReal(sum[3] / I.norm_size);
  *part = sum[2] > 0 ? sum[1] / sum[2] : 0;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* How much of the change that the matrix expects on a part `way` of dX, from where the matrix was made, the residual shows: 1 if the Jacobian
   is right there. In the rows that have not followed dX, as far as they stand out of rounding; the constraint forces are taken as the
   matrix has them. -1: there are no such rows. */
PetscErrorCode Answer(TS ts, PetscReal way, Vec dX, Vec F, Vec F_where, Vec all, PetscReal *answer)
{
  Integrator        &I = Get(ts);
  Verification      &v = I.verify;
  const PetscScalar *f, *m, *d;
  PetscReal          sum[4];
  Vec                Y, change;
  Mat                P;

  PetscFunctionBegin;
  PetscCall(VecDuplicate(dX, &Y));
  PetscCall(VecDuplicate(dX, &change));
  PetscCall(SNESGetJacobian(ts->snes, NULL, &P, NULL, NULL));
  PetscCall(VecWAXPY(Y, -way, dX, v.where));
  PetscCall(SNESComputeFunction(ts->snes, Y, change));
  PetscCall(VecAYPX(change, -1, F_where));
  PetscCall(PassDefinitionsOn(ts, P, change));
  PetscCall(VecAXPY(change, -way, all));
  PetscCall(VecAXPY(change, way, v.model));
  PetscCall(VecGetArrayRead(F, &f));
  PetscCall(VecGetArrayRead(change, &d));
  PetscCall(VecGetArrayRead(v.model, &m));
  PetscCall(SumRows(ts, sum, [&](PetscInt i, const RowScale &s, PetscReal local[]) {
    const PetscReal model = PetscRealPart(m[i]) * s.answer;
    if (PetscAbsReal(way * model) < 10 * s.rounding || Followed(s, PetscRealPart(f[i]), PetscRealPart(m[i]))) return;
    local[1] += PetscRealPart(d[i]) * s.answer * model;
    local[2] += way * model * model;
  }));
  PetscCall(VecRestoreArrayRead(v.model, &m));
  PetscCall(VecRestoreArrayRead(change, &d));
  PetscCall(VecRestoreArrayRead(F, &f));
  PetscCall(VecDestroy(&change));
  PetscCall(VecDestroy(&Y));
  *answer = sum[2] != 0 ? PetscAbsReal(sum[1] / sum[2]) : -1;
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* The residual at X does not follow the correction dX, made with a matrix of this very step: is that a property of the model, such as a
   contact that ends on the way, or is the Jacobian wrong where it was evaluated? There one of the two directions along dX must answer. */
PetscErrorCode CheckJacobian(TS ts, Vec dX, Vec F, PetscBool *wrong)
{
  Verification &v = Get(ts).verify;
  PetscReal     answer[2];
  Vec           F_where, all;
  Mat           P;

  PetscFunctionBegin;
  PetscCall(VecDuplicate(dX, &F_where));
  PetscCall(VecDuplicate(dX, &all));
  PetscCall(SNESGetJacobian(ts->snes, NULL, &P, NULL, NULL));
  PetscCall(MatMult(P, dX, all));
  PetscCall(PassDefinitionsOn(ts, P, all));
  PetscCall(SNESComputeFunction(ts->snes, v.where, F_where));
  for (int k = 0; k < 2; k++) PetscCall(Answer(ts, k ? -0.25 : 0.25, dX, F, F_where, all, &answer[k]));
  PetscCall(VecDestroy(&all));
  PetscCall(VecDestroy(&F_where));
  *wrong = (PetscBool)(answer[0] >= 0 && answer[0] < hopeless && answer[1] >= 0 && answer[1] < hopeless);
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Largest change of the positions, in units of the tolerance, by accelerations of E/(|k| h^2) over the time T */
PetscReal Drift(const Integrator &I, PetscReal E, PetscReal T) { return E * PetscSqr(T / I.h) / (2 * PetscAbsReal(I.p.k)); }

} // namespace

/* claim_i of the matrix P with the inertia at hand, and the largest */
static PetscErrorCode MakeClaims(TS ts, Mat P, bool start)
{
  Integrator   &I = Get(ts);
  Verification &v = I.verify;
  PetscScalar  *p, *m;
  PetscReal     largest = 0;
  PetscInt      n;

  PetscFunctionBegin;
  PetscCall(MatGetDiagonal(P, v.claim));
  PetscCall(VecGetLocalSize(v.claim, &n));
  PetscCall(VecGetArray(v.claim, &p));
  PetscCall(VecGetArray(v.inertia, &m));
  if (start) PetscCall(NoteInertia(ts, p, n, m));
  for (PetscInt i = 0; i < n; i++) {
    const TSHHT3Role r = RoleOf(I, i);
    p[i]    = PetscRealPart(m[i]) > 0 ? PetscAbsScalar(p[i]) / (m[i] * (r == TSHHT3_STATE ? StateInertia(I.p) : I.p.ca())) : 0;
    if (PetscRealPart(p[i]) < most_claim) largest = PetscMax(largest, PetscRealPart(p[i]));
  }
  PetscCall(VecRestoreArray(v.inertia, &m));
  PetscCall(VecRestoreArray(v.claim, &p));
  PetscCallMPI(MPI_Allreduce(&largest, &v.largest, 1, MPIU_REAL, MPIU_MAX, PetscObjectComm((PetscObject)ts)));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* To be called for every new matrix P, made at X */
PetscErrorCode NoteClaims(TS ts, Vec X, Mat P)
{
  Integrator   &I = Get(ts);
  Verification &v = I.verify;
  const bool    start = I.mode == Mode::Start;
  PetscBool     has;

  PetscFunctionBegin;
  PetscCall(MatHasOperation(P, MATOP_GET_DIAGONAL, &has));
  if (!has || (!start && !v.inertia)) PetscFunctionReturn(PETSC_SUCCESS);
  if (!v.inertia) PetscCall(VecDuplicate(I.X, &v.inertia));
  if (!v.claim) PetscCall(VecDuplicate(I.X, &v.claim));
  if (!v.noise) PetscCall(VecDuplicate(I.X, &v.noise));
  PetscCall(MakeClaims(ts, P, start));
  PetscCall(VecZeroEntries(v.noise));
  v.measured = PETSC_FALSE;
  if (start) v.largest = v.since = v.missing = 0;
  if (Claims(I)) {
    if (!v.where) PetscCall(VecDuplicate(X, &v.where));
    PetscCall(VecCopy(X, v.where));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* +1 or -1 */
static PetscReal RandomSign(PetscInt i) { return (i * 2654435761u >> 7) & 1 ? 1 : -1; }

/* noise = |F(X + dX) - F| for the residual F at X and dX of random signs: rounding of the unknowns, and, as changes of these, of the largest
   terms that make up positions and states */
static PetscErrorCode MeasureRounding(TS ts, Vec X, Vec F, Vec noise)
{
  Integrator        &I = Get(ts);
  const PetscReal    position = 1 / ScalePosition(I.p, I.h), state = 1 / ScaleState(I.p, I.h);
  const PetscScalar *y, *v;
  PetscScalar       *x;
  Vec                near;
  PetscInt           n, first;

  PetscFunctionBegin;
  PetscCall(VecDuplicate(X, &near));
  PetscCall(VecCopy(X, near));
  PetscCall(VecGetLocalSize(X, &n));
  PetscCall(VecGetOwnershipRange(X, &first, NULL));
  PetscCall(VecGetArray(near, &x));
  PetscCall(VecGetArrayRead(I.ymax, &y));
  PetscCall(VecGetArrayRead(I.V1, &v));
  for (PetscInt i = 0; i < n; i++) {
    const TSHHT3Role r    = RoleOf(I, i);
    const PetscReal  size = IsDifferential(r) ? (PetscRealPart(y[i]) + I.h * PetscAbsScalar(v[i])) * (r == TSHHT3_STATE ? state : position) : 0;
    x[i] += rounding_of_sums * RandomSign(first + i) * (PetscAbsScalar(x[i]) + size);
  }
  PetscCall(VecRestoreArrayRead(I.V1, &v));
  PetscCall(VecRestoreArrayRead(I.ymax, &y));
  PetscCall(VecRestoreArray(near, &x));
  PetscCall(SNESComputeFunction(ts->snes, near, noise));
  PetscCall(VecAXPY(noise, -1, F));
  PetscCall(VecAbs(noise));
  PetscCall(VecDestroy(&near));
  PetscCall(StageVectors(ts, X));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* z = 1/weight with random signs: accelerations of the size that the tolerances mean; zero where there is no coordinate */
static PetscErrorCode ProbingAccelerations(TS ts, Vec Z)
{
  Integrator        &I = Get(ts);
  const PetscScalar *w;
  PetscScalar       *z;
  PetscInt           n, first;

  PetscFunctionBegin;
  PetscCall(VecGetLocalSize(Z, &n));
  PetscCall(VecGetOwnershipRange(Z, &first, NULL));
  PetscCall(VecGetArray(Z, &z));
  PetscCall(VecGetArrayRead(I.weight, &w));
  for (PetscInt i = 0; i < n; i++) z[i] = IsCoordinate(I, i) ? RandomSign(first + i) / (PetscRealPart(w[i]) > 0 ? w[i] : 1) : 0;
  PetscCall(VecRestoreArrayRead(I.weight, &w));
  PetscCall(VecRestoreArray(Z, &z));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Inertia of coordinates: |F(q''+z) - F(q'')|/|z|, where that stands out of rounding and z does not happen to cancel */
static PetscErrorCode MeasureInertia(TS ts)
{
  Integrator        &I = Get(ts);
  Vec                Z, A, F, change;
  const PetscScalar *z, *f, *noise;
  PetscScalar       *m;
  PetscInt           n;

  PetscFunctionBegin;
  for (Vec *v : {&Z, &A, &F, &change}) PetscCall(VecDuplicate(I.X, v));
  PetscCall(ProbingAccelerations(ts, Z));
  PetscCall(EvaluateResidual(ts, I.t1, I.U1, I.V1, I.A1, F));
  PetscCall(VecWAXPY(A, 1, Z, I.A1));
  PetscCall(EvaluateResidual(ts, I.t1, I.U1, I.V1, A, change));
  PetscCall(VecAXPY(change, -1, F));
  PetscCall(VecGetLocalSize(F, &n));
  PetscCall(VecGetArrayRead(Z, &z));
  PetscCall(VecGetArrayRead(change, &f));
  PetscCall(VecGetArrayRead(I.verify.noise, &noise));
  PetscCall(VecGetArray(I.verify.inertia, &m));
  for (PetscInt i = 0; i < n; i++) {
    if (!IsCoordinate(I, i)) continue;
    const PetscReal now = PetscAbsScalar(f[i] / z[i]);
    if (PetscAbsScalar(f[i]) > PetscRealPart(noise[i]) && now > PetscRealPart(m[i]) / variation) m[i] = now;
  }
  PetscCall(VecRestoreArray(I.verify.inertia, &m));
  PetscCall(VecRestoreArrayRead(I.verify.noise, &noise));
  PetscCall(VecRestoreArrayRead(change, &f));
  PetscCall(VecRestoreArrayRead(Z, &z));
  for (Vec *v : {&Z, &A, &F, &change}) PetscCall(VecDestroy(v));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Forces have rounding, and inertia that varies with the position looks like stiffness to a matrix of the start. Where a doubt has been
   raised, both are measured at the state of the stage, inertia once for each matrix. */
static PetscErrorCode MeasureRows(TS ts, Vec X, Vec F)
{
  Verification &v = Get(ts).verify;
  Mat           P;

  PetscFunctionBegin;
  PetscCall(MeasureRounding(ts, X, F, v.noise));
  if (v.measured) PetscFunctionReturn(PETSC_SUCCESS);
  v.measured = PETSC_TRUE;
  PetscCall(MeasureInertia(ts));
  PetscCall(SNESGetJacobian(ts->snes, NULL, &P, NULL, NULL));
  PetscCall(MakeClaims(ts, P, false));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* After the correction dX, which has led to X and would be the last. F: the residual at X if `evaluated`, which it then is. */
PetscErrorCode Verify(TS ts, Vec X, Vec dX, Vec F, PetscBool *evaluated, PetscBool *proved)
{
  Integrator   &I = Get(ts);
  Verification &v = I.verify;
  Corrector    &c = I.corrector;
  PetscReal     E, left = 0, stay = 0, part = 0;

  PetscFunctionBegin;
  *proved = PETSC_TRUE;
  if (I.mode != Mode::Step || !Claims(I)) PetscFunctionReturn(PETSC_SUCCESS);
  const PetscReal limit = allowed * (I.fixed_h ? PetscClipInterval(c.wlte, least_error, 1) : 1), k = PetscAbsReal(I.p.k) * I.h * I.h, T = v.since + I.h;
  PetscCall(Claimed(ts, dX, &E));
  E = PetscMax(E, k * v.missing);
  if (Drift(I, E, T) <= limit) {
    v.missing = E / k;
    v.since   = T;
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  if (!*evaluated) PetscCall(SNESComputeFunction(ts->snes, X, F));
  *evaluated = PETSC_TRUE;
  if (!HasDefinitions(I)) PetscCall(Model(ts, dX));
  for (int attempt = 0; attempt < 2; attempt++) {
    PetscCall(Compare(ts, F, &left, &stay, &part));
    /* a rate measured in this correction speaks for what is left, unless that is as it was */
    const bool good = c.it - c.base >= 2 && c.rate >= 0 && c.rate < 0.5 && part < 0.5;
    *proved         = (PetscBool)((good || Drift(I, left, I.h) <= limit) && Drift(I, stay, T) <= limit && PetscAbsReal(part - 1) > stayed);
    if (attempt && !*proved) {
      PetscCall(Claimed(ts, dX, &E));
      *proved = (PetscBool)(!Claims(I) || Drift(I, E, T) <= limit);
    }
    if (*proved) {
      v.missing = PetscMin(stay, E) / k;
      v.since   = stay > 0 ? T : 0;
      PetscFunctionReturn(PETSC_SUCCESS);
    }
    if (!attempt) PetscCall(MeasureRows(ts, X, F));
  }
  PetscCall(PetscInfo(ts, "corrector: a correction of %g of the tolerance at t = %g is no proof: the residual, %g of the tolerance by inertia alone, has not followed (%g of it as before)\n",
                      (double)c.e, (double)I.t1, (double)left, (double)part));
  if (c.fresh) PetscCall(CheckJacobian(ts, dX, F, &c.wrong_jacobian));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode ViewClaims(TS ts, PetscViewer viewer)
{
  const Integrator &I = Get(ts);

  PetscFunctionBegin;
  if (Claims(I)) PetscCall(PetscViewerASCIIPrintf(viewer, "small corrections are proved by a residual: the matrix claims up to %g times the inertia of an unknown%s\n", (double)I.verify.largest,
                                                  HasDefinitions(I) ? ", and definitions may hide more" : ""));
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* After a correction that has failed with a matrix of its own: whether the residual has not answered it at all */
PetscErrorCode BlameJacobian(TS ts, Vec X, Vec dX, Vec F, PetscBool *evaluated)
{
  Integrator &I = Get(ts);
  PetscReal   left = 0, stay = 0, part = 0;

  PetscFunctionBegin;
  if (I.mode != Mode::Step || !I.corrector.fresh || !Claims(I)) PetscFunctionReturn(PETSC_SUCCESS);
  if (!*evaluated) PetscCall(SNESComputeFunction(ts->snes, X, F));
  *evaluated = PETSC_TRUE;
  PetscCall(MeasureRows(ts, X, F));
  PetscCall(Model(ts, dX));
  PetscCall(Compare(ts, F, &left, &stay, &part));
  if (left > 0 && PetscAbsReal(part - 1) <= stayed) PetscCall(CheckJacobian(ts, dX, F, &I.corrector.wrong_jacobian));
  PetscFunctionReturn(PETSC_SUCCESS);
}

} // namespace hht3
