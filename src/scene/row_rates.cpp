/*
  How rows of constraints change along the motion that is linearized, by differences of fourth order on

    q + q' e + q'' e^2/2,    v + q'' e,

  which has all that first rates of C and second ones of K depend on. Only rows' directions matter: what multiplies a whole row leaves the reduction as it
  is. Time is taken along where rows depend on it by themselves, as a user's may.
*/
#include "linearization.h"
#include "rotation.h"
#include <limits>

namespace hhtdae
{

namespace
{

/* Angles and parts of the scene's size that the motion covers in a step of the differences, and seconds where rows depend on time */
constexpr double reach = 1e-2;

Eigen::MatrixXd Rows(const Eigen::MatrixXd &A, const std::vector<PetscInt> &rows)
{
  Eigen::MatrixXd B(rows.size(), A.cols());
  for (std::size_t i = 0; i < rows.size(); i++) B.row((Eigen::Index)i) = A.row(rows[i]);
  return B;
}

/* Rates that are no more than rounding of what they are differences of are none: a steady motion has none, and keeps its modes without a frequency
   (Linearize.SleepingTop) */
void DropRounding(const Eigen::MatrixXd &of, double times, Eigen::MatrixXd &rate)
{
  const double relative = 8 * std::numeric_limits<double>::epsilon() * times;
  for (Eigen::Index i = 0; i < rate.rows(); i++) {
    const double rounding = relative * of.row(i).cwiseAbs().maxCoeff();
    for (Eigen::Index j = 0; j < rate.cols(); j++)
      if (std::abs(rate(i, j)) < rounding) rate(i, j) = 0;
  }
}

/* The local vector of what turns exp([x]) by `turn` in space */
Vector3 Turned(const Vector3 &turn, const Vector3 &x)
{
  const Eigen::AngleAxisd both(LocalTurn(turn) * LocalTurn(x));
  return both.angle() * both.axis();
}

} // namespace

PetscErrorCode Whole(Mat A, Eigen::MatrixXd &out)
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

/* 1/s */
PetscErrorCode Linearization::Work::fastest(double *rate) const
{
  Vec    at[3] = {state[0], state[1], state[2]};
  Motion m;
  PetscFunctionBegin;
  *rate = 0;
  PetscCall(look(at));
  for (std::size_t b = 0; b < R->scene.bodies.size(); b++) {
    PetscCall(moved.motion(Body{(PetscInt)b, R->scene.number}, &m));
    *rate = std::max({*rate, m.angular_velocity.norm(), std::sqrt(m.angular_acceleration.norm()), m.velocity.norm() / size, std::sqrt(m.acceleration.norm() / size)});
  }
  PetscFunctionReturn(0);
}

/* The linearization `later` on the motion, at a time */
PetscErrorCode Linearization::Work::nearby(double later, double time, Work *w) const
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
      Eigen::Map<Vector3>(x + at) = Turned(later * Read(v + at) + 0.5 * later * later * Read(a + at), Read(u + at));
    }
  PetscCall(VecRestoreArray(w->state[0], &x));
  PetscCall(VecRestoreArrayRead(state[2], &a));
  PetscCall(VecRestoreArrayRead(state[1], &v));
  PetscCall(VecRestoreArrayRead(state[0], &u));
  PetscCall(w->differentiate());
  PetscFunctionReturn(0);
}

PetscErrorCode Linearization::Work::rates(const std::vector<PetscInt> &rows, RowRates *out) const
{
  constexpr double first[5] = {1. / 12, -8. / 12, 0, 8. / 12, -1. / 12}, second[5] = {-1. / 12, 16. / 12, -30. / 12, 16. / 12, -1. / 12};
  Eigen::MatrixXd  X, at_a_time[2];
  double           rate, e;
  PetscFunctionBegin;
  if (rows.empty()) { /* of any rank */
    PetscInt n;
    PetscCall(MatGetSize(K, &n, nullptr));
    for (Eigen::MatrixXd *x : {&out->C, &out->K, &out->second_K}) x->resize(0, n);
    PetscFunctionReturn(0);
  }
  for (int k = 0; k < 2; k++) {
    Work w;
    PetscCall(nearby(0, t + k * reach, &w));
    PetscCall(Whole(w.K, X));
    at_a_time[k] = Rows(X, rows);
  }
  const bool of_time = at_a_time[0] != at_a_time[1];
  for (Eigen::MatrixXd *x : {&out->C, &out->K, &out->second_K}) *x = Eigen::MatrixXd::Zero((Eigen::Index)rows.size(), X.cols());
  PetscCall(fastest(&rate));
  if (!(rate > 0) && !of_time) PetscFunctionReturn(0);
  e = reach / (of_time ? std::max(1., rate) : rate);
  for (int k = 0; k < 5; k++) {
    const double at = (k - 2) * e;
    Work         w;
    PetscCall(nearby(at, of_time ? t + at : t, &w));
    PetscCall(Whole(w.C, X));
    out->C += first[k] / e * Rows(X, rows);
    PetscCall(Whole(w.K, X));
    out->K += first[k] / e * Rows(X, rows);
    out->second_K += second[k] / (e * e) * Rows(X, rows);
  }
  PetscCall(Whole(C, X));
  DropRounding(Rows(X, rows), 1 / e, out->C);
  DropRounding(at_a_time[0], 1 / e, out->K);
  DropRounding(at_a_time[0], 1 / (e * e), out->second_K);
  PetscFunctionReturn(0);
}

} // namespace hhtdae
