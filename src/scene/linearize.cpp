/*
  The equations of small motions about a state of a run.

  The scene's matrix F_u + sv F_u' + sa F_u'' has the coordinates of the run, Euler angles among them. Where a body spins, these change their
  meaning with time. So du = T(t) x takes displacements and rotations in space axes, T = G^-1 for the angles:

    du' = T x' + T' x,    du'' = T x'' + 2 T' x' + T'' x
    M = T^T F_u'' T,    C = T^T (F_u' T + 2 F_u'' T'),    K = T^T (F_u T + F_u' T' + F_u'' T'')

  T^T makes moments about space axes of the rows. Since F = 0 all along the motion, this and factors of rows that change with time change nothing.
*/
#include "linearization.h"
#include "start.h"
#include <algorithm>
#include <cmath>

namespace hhtdae
{

namespace
{

constexpr double apart = 1099511627776.; /* 2^40: of what the shifts multiply, nothing else is left in the digits */

/* F_u, F_u' or F_u'' in MATAIJ: the matrix with the shifts, less F_u */
PetscErrorCode DerivativeMatrix(Runtime &R, double t, const Vec s[3], double sv, double sa, Mat less, Mat *out)
{
  Mat J;
  PetscFunctionBegin;
  PetscCall(MatDuplicate(R.J, MAT_DO_NOT_COPY_VALUES, &J));
  PetscCall(Jacobian(R, t, s[0], s[1], s[2], sv, sa, J));
  if (R.triangle) PetscCall(MatConvert(J, MATAIJ, MAT_INPLACE_MATRIX, &J));
  if (less) {
    PetscCall(MatAXPY(J, -1, less, SAME_NONZERO_PATTERN));
    PetscCall(MatScale(J, 1 / (sv + sa)));
  }
  *out = J;
  PetscFunctionReturn(0);
}

/* T, T', T'' of 3-1-3 angles: G = [z g2 g3], n = z x g2, g3 = -sin(theta) n + cos(theta) z */
void AngleRates(const double *angle, const double *rate, const double *second, Matrix3 T[3])
{
  const double  st = std::sin(angle[1]), ct = std::cos(angle[1]), p = rate[0], q = rate[1];
  const Vector3 z = Vector3::UnitZ(), g2(std::cos(angle[0]), std::sin(angle[0]), 0), n = z.cross(g2), g3 = ct * z - st * n;
  Matrix3       G, G1, G2;
  G << z, g2, g3;
  G1 << Vector3::Zero(), p * n, -q * (ct * n + st * z) + p * st * g2;
  G2 << Vector3::Zero(), second[0] * n - p * p * g2, -second[1] * (ct * n + st * z) + q * q * (st * n - ct * z) + (2 * p * q * ct + second[0] * st) * g2 + p * p * st * n;
  T[0] = G.inverse();
  T[1] = -T[0] * G1 * T[0];
  T[2] = -T[0] * (G2 * T[0] + 2 * G1 * T[1]);
}

PetscErrorCode MakeTurns(Linearization::Work &w)
{
  Runtime      &R = *w.R;
  const double *s[3];
  PetscFunctionBegin;
  for (int k = 0; k < 3; k++) {
    PetscCall(VecGetArrayRead(w.state[k], &s[k]));
    PetscCall(MatCreateAIJ(w.comm(), R.n, R.n, PETSC_DETERMINE, PETSC_DETERMINE, 3, nullptr, 0, nullptr, &w.turn[k]));
    for (PetscInt i = R.start; i < R.start + R.n; i++) PetscCall(MatSetValue(w.turn[k], i, i, k == 0, INSERT_VALUES));
  }
  for (PetscInt b = 0; b < R.bodies.own; b++) {
    const LocalBody &body = R.bodies.body[b];
    if (!HasEulerAngles(body.kind)) continue;
    const PetscInt at = body.first + 3, rows[3] = {R.start + at, R.start + at + 1, R.start + at + 2};
    Matrix3        T[3];
    AngleRates(s[0] + at, s[1] + at, s[2] + at, T);
    for (int k = 0; k < 3; k++) {
      const Matrix3 by_rows = T[k].transpose();
      PetscCall(MatSetValues(w.turn[k], 3, rows, 3, rows, by_rows.data(), INSERT_VALUES));
    }
  }
  for (int k = 0; k < 3; k++) {
    PetscCall(VecRestoreArrayRead(w.state[k], &s[k]));
    PetscCall(MatAssemblyBegin(w.turn[k], MAT_FINAL_ASSEMBLY));
    PetscCall(MatAssemblyEnd(w.turn[k], MAT_FINAL_ASSEMBLY));
  }
  PetscFunctionReturn(0);
}

/* A += f X Y */
PetscErrorCode AddProduct(Mat A, double f, Mat X, Mat Y)
{
  Mat P;
  PetscFunctionBegin;
  PetscCall(MatMatMult(X, Y, MAT_INITIAL_MATRIX, PETSC_DEFAULT, &P));
  PetscCall(MatAXPY(A, f, P, DIFFERENT_NONZERO_PATTERN));
  PetscCall(MatDestroy(&P));
  PetscFunctionReturn(0);
}

PetscErrorCode Roles(Linearization::Work &w)
{
  Runtime &R = *w.R;
  PetscFunctionBegin;
  w.role.assign(R.n, TSHHT3_COORDINATE);
  for (int r = 0; r < TSHHT3_NUM_ROLES; r++) {
    if (!R.roles[r]) continue;
    const PetscInt *index;
    PetscInt        n;
    PetscCall(ISGetLocalSize(R.roles[r], &n));
    PetscCall(ISGetIndices(R.roles[r], &index));
    for (PetscInt k = 0; k < n; k++) w.role[index[k] - R.start] = (unsigned char)r;
    PetscCall(ISRestoreIndices(R.roles[r], &index));
  }
  PetscFunctionReturn(0);
}

/* Accelerations and multipliers of the start are found by the first step */
PetscErrorCode Begin(Linearization::Work &w, TS ts, PetscReal t)
{
  Vec       U, V, u, v;
  PetscReal atol, rtol;
  PetscFunctionBegin;
  PetscCall(CreateRun(w.R->model, &w.start));
  w.R = RunOf(w.start);
  PetscCall(TS2GetSolution(ts, &U, &V));
  PetscCall(TS2GetSolution(w.start, &u, &v));
  PetscCall(VecCopy(U, u));
  PetscCall(VecCopy(V, v));
  PetscCall(TSGetTolerances(ts, &atol, nullptr, &rtol, nullptr));
  PetscCall(TSSetTolerances(w.start, atol, nullptr, rtol, nullptr));
  PetscCall(TSSetTime(w.start, t));
  PetscCall(TSSetMaxTime(w.start, t + 1));
  PetscCall(TSStep(w.start));
  PetscFunctionReturn(0);
}

} // namespace

void Linearization::Work::clear()
{
  PetscCallAbort(PETSC_COMM_SELF, TSDestroy(&start));
  for (Vec &x : state) PetscCallAbort(PETSC_COMM_SELF, VecDestroy(&x));
  for (Mat *x : {&M, &C, &K, &turn[0], &turn[1], &turn[2]}) PetscCallAbort(PETSC_COMM_SELF, MatDestroy(x));
}

PetscErrorCode Linearization::Work::check(const char *call) const
{
  PetscFunctionBegin;
  PetscCheck(M, PETSC_COMM_SELF, PETSC_ERR_ORDER, "%s: nothing has been taken, call Linearization::take() first", call);
  PetscFunctionReturn(0);
}

PetscErrorCode Linearization::Work::differentiate()
{
  Mat F[3], left;
  PetscFunctionBegin;
  PetscCall(DerivativeMatrix(*R, t, state, 0, 0, nullptr, &F[0]));
  PetscCall(DerivativeMatrix(*R, t, state, apart, 0, F[0], &F[1]));
  PetscCall(DerivativeMatrix(*R, t, state, 0, apart, F[0], &F[2]));
  PetscCall(MakeTurns(*this));
  PetscCall(MatMatMult(F[2], turn[0], MAT_INITIAL_MATRIX, PETSC_DEFAULT, &M));
  PetscCall(MatMatMult(F[1], turn[0], MAT_INITIAL_MATRIX, PETSC_DEFAULT, &C));
  PetscCall(AddProduct(C, 2, F[2], turn[1]));
  PetscCall(MatMatMult(F[0], turn[0], MAT_INITIAL_MATRIX, PETSC_DEFAULT, &K));
  PetscCall(AddProduct(K, 1, F[1], turn[1]));
  PetscCall(AddProduct(K, 1, F[2], turn[2]));
  PetscCall(MatTranspose(turn[0], MAT_INITIAL_MATRIX, &left));
  for (Mat *x : {&M, &C, &K}) {
    Mat product;
    PetscCall(MatMatMult(left, *x, MAT_INITIAL_MATRIX, PETSC_DEFAULT, &product));
    PetscCall(MatDestroy(x));
    *x = product;
  }
  PetscCall(MatDestroy(&left));
  for (Mat &f : F) PetscCall(MatDestroy(&f));
  PetscFunctionReturn(0);
}

/* Of multipliers, variables and force states the equations have no rates, of states no second ones */
PetscErrorCode Linearization::Work::toState(const SmallMotion &x, Vec d[3]) const
{
  Vec in;
  PetscFunctionBegin;
  PetscCall(VecDuplicate(state[0], &in));
  for (int k = 0; k < 3; k++) PetscCall(VecSet(d[k], 0));
  for (int k = 0; k < 3; k++) {
    constexpr double binomial[3][3] = {{1, 0, 0}, {1, 1, 0}, {1, 2, 1}};
    double          *y;
    PetscCall(VecGetArrayWrite(in, &y));
    std::copy(x[k].begin(), x[k].end(), y);
    for (PetscInt i = 0; i < R->n; i++)
      if (k && !coordinate(i) && !(k == 1 && role[i] == TSHHT3_STATE)) y[i] = 0;
    PetscCall(VecRestoreArrayWrite(in, &y));
    for (int order = k; order < 3; order++) {
      Vec product;
      PetscCall(VecDuplicate(in, &product));
      PetscCall(MatMult(turn[order - k], in, product));
      if (order == k || order - k > 0) PetscCall(VecAXPY(d[order], binomial[order][k], product));
      PetscCall(VecDestroy(&product));
    }
  }
  PetscCall(VecDestroy(&in));
  PetscFunctionReturn(0);
}

/* By differences of fourth order: along most of a small motion measures are polynomials, or nearly so */
PetscErrorCode Linearization::Work::derivative(const Measure &m, const SmallMotion &along, double *x) const
{
  constexpr double reach = 1e-3, weight[2] = {8. / 12, -1. / 12};
  Vec              d[3], at[3];
  double           largest = 0, here = 0;
  PetscFunctionBegin;
  for (int k = 0; k < 3; k++) at[k] = state[k];
  PetscCall(moved.take(*R, t, at));
  PetscCall(moved.value(m, &here));
  for (int k = 0; k < 3; k++) {
    PetscCall(VecDuplicate(state[0], &d[k]));
    PetscCall(VecDuplicate(state[0], &at[k]));
  }
  PetscCall(toState(along, d));
  for (PetscInt i = 0; i < R->n; i++)
    if (coordinate(i)) largest = std::max(largest, std::abs(along[0][i]));
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &largest, 1, MPI_DOUBLE, MPI_MAX, comm()));
  const double e = reach * std::min(1., size) / (largest > 0 ? largest : 1);
  *x             = 0;
  for (int k = 1; k <= 2; k++)
    for (int side : {1, -1}) {
      double y;
      for (int c = 0; c < 3; c++) PetscCall(VecWAXPY(at[c], side * k * e, d[c], state[c]));
      PetscCall(moved.take(*R, t, at));
      PetscCall(moved.value(m, &y));
      if (m.kind == Measure::Angle) y = std::remainder(y - here, 2 * M_PI); /* half a turn is both pi and -pi */
      *x += side * weight[k - 1] * y / e;
    }
  for (int k = 0; k < 3; k++) {
    PetscCall(VecDestroy(&d[k]));
    PetscCall(VecDestroy(&at[k]));
  }
  PetscFunctionReturn(0);
}

PetscErrorCode Linearization::Work::load(const Excitation &in, std::vector<double> *b) const
{
  const SceneData &s = R->scene;
  Motion           m, centre;
  PetscFunctionBegin;
  b->assign(R->n, 0);
  PetscCheck(s.valid(in.at), comm(), PETSC_ERR_ARG_WRONG, "Linearization: the marker of an excitation is not one of this scene");
  const PetscInt body = s.markers[in.at.id].body;
  PetscCheck(body >= 0, comm(), PETSC_ERR_ARG_WRONG, "Linearization: the marker of an excitation is on the ground, which no load moves");
  Vec at[3] = {state[0], state[1], state[2]};
  PetscCall(moved.take(*R, t, at));
  PetscCall(moved.motion(in.at, &m));
  PetscCall(moved.motion(Body{body}, &centre));
  const PetscInt local = R->local_body[body];
  if (local < 0 || !R->bodies.body[local].owned) PetscFunctionReturn(0);
  const LocalBody &k        = R->bodies.body[local];
  const Vector3    moment   = in.moment + (m.position - centre.position).cross(in.load);
  const int        position = GroupSize(k.kind, 0);
  double          *row      = b->data() + k.first;
  for (int c = 0; c < position; c++) row[c] = in.load(c);
  if (k.kind == BodyKind::Planar) row[2] = moment(2);
  else if (HasEulerAngles(k.kind)) std::copy(moment.data(), moment.data() + 3, row + 3);
  PetscFunctionReturn(0);
}

PetscErrorCode AmplitudeOf(const Linearization::Work &w, const Measure &m, const std::vector<std::complex<double>> &x, std::complex<double> s, std::complex<double> *y)
{
  double part[2];
  PetscFunctionBegin;
  for (int imaginary = 0; imaginary < 2; imaginary++) {
    SmallMotion          along;
    std::complex<double> power = 1;
    for (int k = 0; k < 3; k++, power *= s) {
      along[k].resize(x.size());
      for (std::size_t i = 0; i < x.size(); i++) along[k][i] = imaginary ? (power * x[i]).imag() : (power * x[i]).real();
    }
    PetscCall(w.derivative(m, along, &part[imaginary]));
  }
  *y = {part[0], part[1]};
  PetscFunctionReturn(0);
}

Linearization::Linearization() : work_(std::make_unique<Work>()) {}
Linearization::~Linearization() = default;

PetscErrorCode Linearization::take(TS ts, PetscReal t)
{
  Work     &w = *work_;
  PetscInt  steps;
  PetscBool ours;
  Vec       U, V;
  PetscFunctionBegin;
  w.clear();
  w.R = RunOf(ts);
  PetscCheck(w.R, PetscObjectComm((PetscObject)ts), PETSC_ERR_ARG_WRONG, "Linearization::take(): the TS is not one of a scene, Scene::createTS() makes them");
  PetscCall(PetscObjectTypeCompare((PetscObject)ts, TSHHT3, &ours));
  PetscCheck(ours, PetscObjectComm((PetscObject)ts), PETSC_ERR_ARG_INCOMP, "Linearization::take(): only TS type hhtdae gives accelerations and multipliers");
  PetscCall(TSGetStepNumber(ts, &steps));
  if (!steps) {
    PetscCall(TSGetTime(ts, &t));
    PetscCall(Begin(w, ts, t));
    ts = w.start;
  }
  PetscCall(TS2GetSolution(ts, &U, &V));
  for (Vec &x : w.state) PetscCall(VecDuplicate(U, &x));
  PetscCall(TSHHT3EvaluateAt(ts, t, w.state[0], w.state[1], w.state[2]));
  w.t    = t;
  w.size = SceneSize(w.R->scene);
  if (!(w.size > 0)) w.size = 1;
  PetscCall(Roles(w));
  PetscCall(w.differentiate());
  PetscFunctionReturn(0);
}

PetscErrorCode Linearization::take(TS ts)
{
  PetscReal t;
  PetscFunctionBegin;
  PetscCall(TSGetTime(ts, &t));
  PetscCall(take(ts, t));
  PetscFunctionReturn(0);
}

PetscErrorCode Linearization::operators(Mat *M, Mat *C, Mat *K) const
{
  PetscFunctionBegin;
  PetscCall(work_->check("Linearization::operators()"));
  *M = work_->M;
  *C = work_->C;
  *K = work_->K;
  PetscFunctionReturn(0);
}

/* By the entry itself, so that it becomes 1; of several as large the first on the lowest rank */
PetscErrorCode Linearization::normalize(Mode *m) const
{
  const Work          &w    = *work_;
  std::complex<double> best = 0;
  PetscFunctionBegin;
  PetscCall(w.check("Linearization::normalize()"));
  for (PetscInt i = 0; i < w.R->n; i++)
    if (w.coordinate(i) && std::abs(m->shape[i]) > (1 + 1e-9) * std::abs(best)) best = m->shape[i];
  std::vector<std::complex<double>> all(w.R->size);
  PetscCallMPI(MPI_Allgather(&best, 2, MPI_DOUBLE, all.data(), 2, MPI_DOUBLE, w.comm()));
  best = 0;
  for (const auto &x : all)
    if (std::abs(x) > (1 + 1e-9) * std::abs(best)) best = x;
  if (std::abs(best) > 0)
    for (auto &x : m->shape) x /= best;
  PetscFunctionReturn(0);
}

PetscErrorCode Linearization::value(const Mode &m, const Measure &what, std::complex<double> *x) const
{
  PetscFunctionBegin;
  PetscCall(work_->check("Linearization::value()"));
  PetscCall(AmplitudeOf(*work_, what, m.shape, m.value, x));
  PetscFunctionReturn(0);
}

PetscErrorCode Linearization::part(const Mode &m, Body b, BodyPart *part) const
{
  const Work    &w = *work_;
  const Runtime &R = *w.R;
  Vec            x, y;
  double         sum[14] = {0}; /* displacement, rotation; kinetic energy of the body and of all */
  PetscFunctionBegin;
  PetscCall(w.check("Linearization::part()"));
  PetscCheck(R.scene.valid(b), w.comm(), PETSC_ERR_ARG_WRONG, "Linearization::part(): the body is not one of this scene");
  const PetscInt local = R.local_body[b.id];
  const bool     mine  = local >= 0 && R.bodies.body[local].owned;
  const PetscInt first = mine ? R.bodies.body[local].first : 0, last = mine ? first + R.bodies.coordinates(local) : 0;
  PetscCall(MatCreateVecs(w.M, &x, &y));
  for (int imaginary = 0; imaginary < 2; imaginary++) {
    double       *put;
    const double *get;
    PetscCall(VecGetArrayWrite(x, &put));
    for (PetscInt i = 0; i < R.n; i++) put[i] = !w.coordinate(i) ? 0 : imaginary ? m.shape[i].imag() : m.shape[i].real();
    PetscCall(VecRestoreArrayWrite(x, &put));
    PetscCall(MatMult(w.M, x, y));
    PetscCall(VecGetArrayRead(y, &get));
    for (PetscInt i = 0; i < R.n; i++) {
      const double e = !w.coordinate(i) ? 0 : get[i] * (imaginary ? m.shape[i].imag() : m.shape[i].real());
      sum[13] += e;
      if (i >= first && i < last) sum[12] += e;
    }
    PetscCall(VecRestoreArrayRead(y, &get));
  }
  PetscCall(VecDestroy(&x));
  PetscCall(VecDestroy(&y));
  if (mine) {
    const BodyKind kind     = R.bodies.body[local].kind;
    const int      position = GroupSize(kind, 0), rotations = kind == BodyKind::Planar ? 1 : HasEulerAngles(kind) ? 3 : 0;
    for (int c = 0; c < position; c++) {
      sum[2 * c]     = m.shape[first + c].real();
      sum[2 * c + 1] = m.shape[first + c].imag();
    }
    for (int c = 0; c < rotations; c++) {
      const int to = 6 + 2 * (rotations == 1 ? 2 : c);
      sum[to]      = m.shape[first + position + c].real();
      sum[to + 1]  = m.shape[first + position + c].imag();
    }
  }
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, sum, 14, MPI_DOUBLE, MPI_SUM, w.comm()));
  for (int c = 0; c < 3; c++) {
    part->displacement(c) = {sum[2 * c], sum[2 * c + 1]};
    part->rotation(c)     = {sum[6 + 2 * c], sum[7 + 2 * c]};
  }
  part->share = sum[13] != 0 ? sum[12] / sum[13] : 0;
  PetscFunctionReturn(0);
}

} // namespace hhtdae
