/*
  Rates of rows of constraints along the motion that is linearized, by differences of fourth order on

    q + q' e + q'' e^2/2,    v + q'' e,

  on which first rates of C and second rates of K depend. Factors of whole rows do not change the reduction and are ignored.
  Users' rows may depend on time explicitly; then time changes along the motion, too, and a suitable step of the differences
  is searched for, since the time scale of such a row is not known (Linearize.RowsThatTurnByThemselves).

  Rows at velocity level may read variables, V = -K_VV^-1 (K_Vq q + C_Vq v + K_Vs s + ...) by the variables' own rows: these are eliminated, here and in
  minimal.cpp.
*/
#include "linearization.h"
#include "rotation.h"
#include <petscblaslapack.h>
#include <algorithm>
#include <iterator>
#include <limits>

namespace hhtdae
{

namespace
{

/* Step of the differences, expressed as the rotation, rad, or displacement, part of the scene's size, of the fastest
   body; for rows that depend on time the first step is at least this many seconds */
constexpr double difference_step = 1e-2;
/* For rows that depend on time: ratio of successive steps, relative difference of the rates from two successive steps
   that ends the search, and largest number of changes in either direction. The ratio is irrational, so that not all steps
   are multiples of the period of a row, which would then seem constant */
constexpr double golden     = 1.6180339887498949;
constexpr double step_ratio = 5 * golden, agreement = 1e-6;
constexpr int    max_step_changes = 16;

Eigen::MatrixXd RowsOf(const Eigen::MatrixXd &A, const std::vector<PetscInt> &rows)
{
  Eigen::MatrixXd B(rows.size(), A.cols());
  for (std::size_t i = 0; i < rows.size(); i++) B.row((Eigen::Index)i) = A.row(rows[i]);
  return B;
}

/* Sets rates that are within rounding of their differences to zero: in a steady motion they are zero, and modes of frequency zero then stay exact (Linearize.SleepingTop).
   `times`: factor of the rounding of the rows `of` in the rates */
void DropRounding(const Eigen::MatrixXd &of, double times, Eigen::MatrixXd &rate)
{
  const double relative = 8 * std::numeric_limits<double>::epsilon() * times;
  for (Eigen::Index i = 0; i < rate.rows(); i++) {
    const double rounding = relative * of.row(i).cwiseAbs().maxCoeff();
    for (Eigen::Index j = 0; j < rate.cols(); j++)
      if (std::abs(rate(i, j)) < rounding) rate(i, j) = 0;
  }
}

/* The rotation vector of exp([turn]) exp([x]) */
Vector3 ComposedRotation(const Vector3 &turn, const Vector3 &x)
{
  const Eigen::AngleAxisd both(LocalTurn(turn) * LocalTurn(x));
  return both.angle() * both.axis();
}

} // namespace

PetscErrorCode GatherDense(Mat A, Eigen::MatrixXd &out)
{
  Mat         one;
  PetscMPIInt size;
  PetscInt    n;
  PetscFunctionBegin;
  PetscCallMPI(MPI_Comm_size(PetscObjectComm((PetscObject)A), &size));
  PetscCall(MatGetSize(A, &n, nullptr));
  PetscCall(MatCreateRedundantMatrix(A, size, MPI_COMM_NULL, MAT_INITIAL_MATRIX, &one));
  out = Eigen::MatrixXd::Zero(n, n);
  for (PetscInt i = 0; i < n; i++) {
    PetscInt           count;
    const PetscInt    *column;
    const PetscScalar *value;
    PetscCall(MatGetRow(one, i, &count, &column, &value));
    for (PetscInt k = 0; k < count; k++) out(i, column[k]) = value[k];
    PetscCall(MatRestoreRow(one, i, &count, &column, &value));
  }
  PetscCall(MatDestroy(&one));
  PetscFunctionReturn(0);
}

/* Largest rate of a body's motion, 1/s; lengths in units of the scene's size */
PetscErrorCode Linearization::Work::characteristicRate(double *rate) const
{
  Vec    at[3] = {state[0], state[1], state[2]};
  Motion m;
  PetscFunctionBegin;
  *rate = 0;
  PetscCall(setState(at));
  for (std::size_t b = 0; b < R->scene.bodies.size(); b++) {
    PetscCall(perturbed.motion(Body{(PetscInt)b, R->scene.number}, &m));
    *rate = std::max({*rate, m.angular_velocity.norm(), std::sqrt(m.angular_acceleration.norm()), m.velocity.norm() / size, std::sqrt(m.acceleration.norm() / size)});
  }
  PetscFunctionReturn(0);
}

/* Linearizes at the state of the motion after `later` seconds; `time`: value of t in the equations */
PetscErrorCode Linearization::Work::linearizeAt(double later, double time, Work *w) const
{
  const double *u, *v, *a;
  double       *x;
  PetscFunctionBegin;
  w->R         = R;
  w->origin    = origin;
  w->t         = time;
  w->spin      = spin + later * spin_rate;
  w->spin_rate = spin_rate;
  w->axes      = LocalTurn(later * spin + 0.5 * later * later * spin_rate).toRotationMatrix() * axes;
  for (int k = 0; k < 3; k++) {
    PetscCall(VecDuplicate(state[k], &w->state[k]));
    PetscCall(VecCopy(state[k], w->state[k]));
  }
  PetscCall(VecAXPY(w->state[0], later, state[1]));
  PetscCall(VecAXPY(w->state[0], 0.5 * later * later, state[2]));
  PetscCall(VecAXPY(w->state[1], later, state[2]));
  PetscCall(VecGetArrayRead(state[0], &u));
  PetscCall(VecGetArrayRead(state[1], &v));
  PetscCall(VecGetArrayRead(state[2], &a));
  PetscCall(VecGetArray(w->state[0], &x));
  for (PetscInt b = 0; R->bodies.local && b < R->bodies.own; b++)
    if (TurnsInSpace(R->bodies.body[b].kind)) {
      const PetscInt at = R->bodies.body[b].first + 3;
      using Read        = Eigen::Map<const Vector3>;
      Eigen::Map<Vector3>(x + at) = ComposedRotation(later * Read(v + at) + 0.5 * later * later * Read(a + at), Read(u + at));
    }
  PetscCall(VecRestoreArray(w->state[0], &x));
  PetscCall(VecRestoreArrayRead(state[2], &a));
  PetscCall(VecRestoreArrayRead(state[1], &v));
  PetscCall(VecRestoreArrayRead(state[0], &u));
  PetscCall(w->differentiate());
  PetscFunctionReturn(0);
}

void EliminateVariables(const std::vector<PetscInt> &rows, const std::vector<PetscInt> &variables, Eigen::MatrixXd &C, Eigen::MatrixXd &K)
{
  const auto           reads = [&](PetscInt i) { return std::any_of(variables.begin(), variables.end(), [&](PetscInt v) { return K(i, v) != 0; }); };
  std::vector<PetscInt> reading;
  std::copy_if(rows.begin(), rows.end(), std::back_inserter(reading), reads);
  if (reading.empty()) return;
  const Eigen::Index        n = K.cols();
  const PetscBLASInt        nv = (PetscBLASInt)variables.size(), columns = (PetscBLASInt)(2 * n);
  Eigen::MatrixXd           V(nv, nv), right(nv, 2 * n), by(reading.size(), nv);
  std::vector<PetscBLASInt> pivot(nv);
  PetscBLASInt              info = 0;
  right << RowsOf(C, variables), RowsOf(K, variables);
  for (PetscBLASInt k = 0; k < nv; k++) {
    V.col(k)  = right.col(n + variables[k]);
    by.col(k) = RowsOf(K, reading).col(variables[k]);
  }
  LAPACKgesv_(&nv, &columns, V.data(), &nv, pivot.data(), right.data(), &nv, &info);
  if (info) right.setConstant(NAN);
  const Eigen::MatrixXd eliminated = by * right;
  for (std::size_t i = 0; i < reading.size(); i++) {
    C.row(reading[i]) -= eliminated.row((Eigen::Index)i).head(n);
    K.row(reading[i]) -= eliminated.row((Eigen::Index)i).tail(n);
    for (PetscInt v : variables) K(reading[i], v) = 0;
  }
}

/* These rows of C and K, and M, after `later` seconds of the motion, with t = time */
PetscErrorCode Linearization::Work::rowsAt(double later, double time, const std::vector<PetscInt> &rows, const std::vector<PetscInt> &variables, RowValues *out) const
{
  Work            w;
  Eigen::MatrixXd X, Y;
  PetscFunctionBegin;
  PetscCall(linearizeAt(later, time, &w));
  PetscCall(GatherDense(w.C, X));
  PetscCall(GatherDense(w.K, Y));
  PetscCall(GatherDense(w.M, out->M));
  EliminateVariables(rows, variables, X, Y);
  out->C = RowsOf(X, rows);
  out->K = RowsOf(Y, rows);
  PetscFunctionReturn(0);
}

/* Rates by differences with the step e, s; of_time: whether t changes, too */
PetscErrorCode Linearization::Work::ratesBy(double e, bool of_time, const std::vector<PetscInt> &rows, const std::vector<PetscInt> &variables, RowRates *out) const
{
  constexpr double first[5] = {1. / 12, -8. / 12, 0, 8. / 12, -1. / 12}, second[5] = {-1. / 12, 16. / 12, -30. / 12, 16. / 12, -1. / 12};
  RowValues        now, middle;
  PetscFunctionBegin;
  for (int k = 0; k < 5; k++) {
    const double at = (k - 2) * e;
    PetscCall(rowsAt(at, of_time ? t + at : t, rows, variables, &now));
    if (!k) out->setZero((Eigen::Index)rows.size(), now.M.cols());
    out->C += first[k] / e * now.C;
    out->K += first[k] / e * now.K;
    out->M += first[k] / e * now.M;
    out->second_K += second[k] / (e * e) * now.K;
    out->second_M += second[k] / (e * e) * now.M;
    if (k == 2) middle = now;
  }
  DropRounding(middle.C, 1 / e, out->C);
  DropRounding(middle.K, 1 / e, out->K);
  DropRounding(middle.M, 1 / e, out->M);
  DropRounding(middle.K, 1 / (e * e), out->second_K);
  DropRounding(middle.M, 1 / (e * e), out->second_M);
  PetscFunctionReturn(0);
}

/* Largest difference of entries relative to the largest entry */
static double RelativeDifference(const Eigen::MatrixXd &a, const Eigen::MatrixXd &b)
{
  const double size = std::max(a.size() ? a.cwiseAbs().maxCoeff() : 0, b.size() ? b.cwiseAbs().maxCoeff() : 0);
  return size > 0 ? (a - b).cwiseAbs().maxCoeff() / size : 0;
}

/* Rates of rows that depend on time. The step decreases from e on until two successive results agree; if none do, the
   results that agree best are used. At rest e is first increased until the relative change of the rows is
   difference_step. */
PetscErrorCode Linearization::Work::ratesInTime(double e, bool at_rest, const std::vector<PetscInt> &rows, const std::vector<PetscInt> &variables, RowRates *out) const
{
  RowValues start, other;
  RowRates  current, before;
  double    best = INFINITY;
  PetscFunctionBegin;
  PetscCall(rowsAt(0, t, rows, variables, &start));
  for (int k = 0; at_rest && k < max_step_changes; k++) {
    double change = 0;
    for (double at : {e, e / golden}) {
      PetscCall(rowsAt(at, t + at, rows, variables, &other));
      change = std::max(change, RelativeDifference(other.C, start.C) + RelativeDifference(other.K, start.K));
    }
    if (change >= difference_step) break;
    e *= step_ratio;
  }
  for (int k = 0; k < max_step_changes; k++, e /= step_ratio) {
    PetscCall(ratesBy(e, true, rows, variables, &current));
    const double difference = k ? std::max({RelativeDifference(current.C, before.C), RelativeDifference(current.K, before.K), RelativeDifference(current.second_K, before.second_K)}) : INFINITY;
    if (difference < best || !k) {
      best = difference;
      *out = current;
    }
    if (best <= agreement) break;
    before = current;
  }
  PetscFunctionReturn(0);
}

PetscErrorCode Linearization::Work::rates(const std::vector<PetscInt> &rows, const std::vector<PetscInt> &variables, RowRates *out) const
{
  RowValues start, other;
  double    rate;
  bool      of_time = false;
  PetscInt  n;
  PetscFunctionBegin;
  PetscCall(MatGetSize(K, &n, nullptr));
  out->setZero((Eigen::Index)rows.size(), n);
  if (rows.empty()) PetscFunctionReturn(0); /* `rows` is the same on all ranks */
  PetscCall(rowsAt(0, t, rows, variables, &start));
  for (double later : {difference_step, difference_step / golden}) {
    if (of_time) break;
    PetscCall(rowsAt(0, t + later, rows, variables, &other));
    of_time = other.C != start.C || other.K != start.K;
  }
  PetscCall(characteristicRate(&rate));
  if (of_time) PetscCall(ratesInTime(rate > 0 ? std::max(difference_step, difference_step / rate) : difference_step, !(rate > 0), rows, variables, out));
  else if (rate > 0) PetscCall(ratesBy(difference_step / rate, false, rows, variables, out));
  PetscFunctionReturn(0);
}

} // namespace hhtdae
