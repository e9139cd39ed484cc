/*
  The equations of small motions about a state of a run.

  The scene's matrix F_u + sv F_v + sa F_a contains derivatives by the coordinates of the run and their velocities and accelerations. The meaning of rotational coordinates
  changes with time if a body spins. So the unknowns x of small motions are displacements and rotations in space axes, and

    du = T_00 x,    dv = T_11 x' + T_10 x,    da = T_22 x'' + T_21 x' + T_20 x
    M = T_00^T F_a T_22,    C = T_00^T (F_v T_11 + F_a T_21),    K = T_00^T (F_u T_00 + F_v T_10 + F_a T_20)

  For Euler angles T_00 = G^-1 =: T, and T_11 = T_22 = T, T_10 = T', T_21 = 2 T', T_20 = T''. For local rotation vectors v and a are the angular velocity w
  and acceleration: exp([x]) A has the angular velocity w + x' + x cross w, so that T_00 = G^-1, T_11 = T_22 = 1, T_10 = T_21 = -[w], T_20 = -[w'].

  x may be in axes that rotate with W and presently coincide with those of space: for displacements and rotations T_kl becomes the sum over m of T_km S_ml with

    S_00 = S_11 = S_22 = 1,    S_10 = [W],    S_21 = 2 [W],    S_20 = [W'] + [W][W]

  T_00^T turns the rows of rotations into moments about space axes. Since F = 0 along the whole motion, time-dependent factors of rows do not change the result.
*/
#include "euler.h"
#include "extension.h"
#include "linearization.h"
#include "start.h"

namespace hhtdae
{

namespace
{

/* 2^40, used for sv (1/s) or sa (1/s^2): F_u is negligible compared with the shifted term, which is then obtained to all
   digits; as a power of two it adds no rounding */
constexpr double derivative_shift = 1099511627776.;

/* F_u, F_u' or F_u''. The latter two are the Jacobian with one shift minus F_u (`less`), divided by the shift */
PetscErrorCode DerivativeMatrix(Runtime &R, double t, const Vec s[3], double sv, double sa, Mat less, Mat *out)
{
  Mat J;
  PetscFunctionBegin;
  PetscCall(MatDuplicate(R.J, MAT_DO_NOT_COPY_VALUES, &J));
  PetscCall(Jacobian(R, t, s[0], s[1], s[2], sv, sa, J));
  if (less) {
    PetscCall(MatAXPY(J, -1, less, SAME_NONZERO_PATTERN));
    PetscCall(MatScale(J, 1 / (sv + sa)));
  }
  *out = J;
  PetscFunctionReturn(0);
}

/* T_kl of Euler angles. G = [z g2 g3] rotates about z with phi, and g3 about g2 with theta: d g3/d theta = p, dp/d theta = -g3 */
void AngleRates(const double *angle, const double *rate, const double *second, Matrix3 T[3][3])
{
  const double phi = rate[0], theta = rate[1];
  Matrix3      A, G1, G2;
  EulerAxes    e;
  EulerFrame(angle, A, e);
  const Vector3 zero = Vector3::Zero(), p = e.p(), z2 = CrossZ(e.g2), z3 = CrossZ(e.g3);
  G1 << zero, phi * z2, phi * z3 + theta * p;
  G2 << zero, second[0] * z2 + phi * phi * CrossZ(z2), second[0] * z3 + phi * phi * CrossZ(z3) + 2 * phi * theta * CrossZ(p) + second[1] * p - theta * theta * e.g3;
  T[0][0] = T[1][1] = T[2][2] = e.G().inverse();
  T[1][0]                     = -T[0][0] * G1 * T[0][0];
  T[2][1]                     = 2 * T[1][0];
  T[2][0]                     = -T[0][0] * (G2 * T[0][0] + 2 * G1 * T[1][0]);
}

void LocalRates(const double *x, const double *w, const double *alpha, Matrix3 T[3][3])
{
  Matrix3 A, G;
  LocalFrame(Vector3(x[0], x[1], x[2]), Matrix3::Identity(), A, G);
  T[0][0]           = G.inverse();
  T[1][1] = T[2][2] = Matrix3::Identity();
  T[1][0] = T[2][1] = -Cross<double>(Vector3(w[0], w[1], w[2]));
  T[2][0]           = -Cross<double>(Vector3(alpha[0], alpha[1], alpha[2]));
}

/* S_kl of axes that rotate with `spin`; `axes`: their present orientation */
struct RotatingAxes {
  Matrix3 S[3][3];

  RotatingAxes(const Vector3 &spin, const Vector3 &rate, const Matrix3 &axes)
  {
    const Matrix3 W = Cross<double>(spin);
    for (auto &row : S)
      for (Matrix3 &x : row) x.setZero();
    for (int k = 0; k < 3; k++) S[k][k].setIdentity();
    S[1][0] = W;
    S[2][1] = 2 * W;
    S[2][0] = Cross<double>(rate) + W * W;
    for (auto &row : S)
      for (Matrix3 &x : row) x = x * axes;
  }

  void compose(Matrix3 T[3][3]) const
  {
    for (int k = 2; k >= 0; k--)
      for (int l = 0; l <= k; l++) {
        Matrix3 sum = Matrix3::Zero();
        for (int m = l; m <= k; m++) sum += T[k][m] * S[m][l];
        T[k][l] = sum;
      }
  }
};

/* Sets T_kl of n unknowns from `first` on */
PetscErrorCode SetTransformation(Linearization::Work &w, PetscInt first, int n, const Matrix3 T[3][3])
{
  const PetscInt rows[3] = {first, first + 1, first + 2};
  PetscFunctionBegin;
  for (int k = 0; k < 3; k++)
    for (int l = 0; l <= k; l++) {
      double by_rows[9];
      for (int i = 0; i < n; i++)
        for (int j = 0; j < n; j++) by_rows[n * i + j] = T[k][l](i, j);
      PetscCall(MatSetValues(w.turn[k][l], n, rows, n, rows, by_rows, INSERT_VALUES));
    }
  PetscFunctionReturn(0);
}

PetscErrorCode MakeTransformations(Linearization::Work &w)
{
  Runtime      &R = *w.R;
  const RotatingAxes by(w.spin, w.spin_rate, w.axes);
  const double *s[3];
  PetscFunctionBegin;
  for (int k = 0; k < 3; k++) PetscCall(VecGetArrayRead(w.state[k], &s[k]));
  for (int k = 0; k < 3; k++)
    for (int l = 0; l <= k; l++) {
      PetscCall(MatCreateAIJ(w.comm(), R.n, R.n, PETSC_DETERMINE, PETSC_DETERMINE, 3, nullptr, 0, nullptr, &w.turn[k][l]));
      for (PetscInt i = R.start; i < R.start + R.n; i++) PetscCall(MatSetValue(w.turn[k][l], i, i, k == l, INSERT_VALUES));
    }
  for (PetscInt b = 0; b < R.bodies.own; b++) {
    const LocalBody &body = R.bodies.body[b];
    const PetscInt   at   = body.first + 3;
    if (Coordinates(body.kind)) PetscCall(SetTransformation(w, R.start + body.first, GroupSize(body.kind, 0), by.S));
    if (!TurnsInSpace(body.kind)) continue;
    Matrix3 T[3][3];
    (R.bodies.local ? LocalRates : AngleRates)(s[0] + at, s[1] + at, s[2] + at, T);
    by.compose(T);
    PetscCall(SetTransformation(w, R.start + at, 3, T));
  }
  for (const auto &e : R.scene.extensions)
    for (PetscInt i = 0; e->vectors() && i < e->coordinates(); i += 3) PetscCall(SetTransformation(w, e->start[R.rank] + i, 3, by.S));
  for (int k = 0; k < 3; k++) PetscCall(VecRestoreArrayRead(w.state[k], &s[k]));
  for (int k = 0; k < 3; k++)
    for (int l = 0; l <= k; l++) {
      PetscCall(MatAssemblyBegin(w.turn[k][l], MAT_FINAL_ASSEMBLY));
      PetscCall(MatAssemblyEnd(w.turn[k][l], MAT_FINAL_ASSEMBLY));
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

} // namespace

void Linearization::Work::clear()
{
  PetscCallAbort(PETSC_COMM_SELF, TSDestroy(&start));
  for (Vec &x : state) PetscCallAbort(PETSC_COMM_SELF, VecDestroy(&x));
  for (Mat *x : {&M, &C, &K}) PetscCallAbort(PETSC_COMM_SELF, MatDestroy(x));
  for (auto &row : turn)
    for (Mat &x : row) PetscCallAbort(PETSC_COMM_SELF, MatDestroy(&x));
}

PetscErrorCode Linearization::Work::check(const char *call) const
{
  PetscFunctionBegin;
  PetscCheck(M, PETSC_COMM_SELF, PETSC_ERR_ORDER, "%s: nothing has been taken, call Linearization::take() first", call);
  PetscFunctionReturn(0);
}

PetscErrorCode Linearization::Work::check(const char *call, const Mode &m) const
{
  PetscMPIInt foreign;
  PetscFunctionBegin;
  PetscCall(check(call));
  foreign = (PetscInt)m.shape.size() != R->n;
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &foreign, 1, MPI_INT, MPI_MAX, comm()));
  PetscCheck(!foreign, comm(), PETSC_ERR_ARG_WRONG, "%s: the mode's shape has %d entries on this rank, which has %d unknowns of this linearization; use a mode of this linearization", call, (int)m.shape.size(), (int)R->n);
  PetscFunctionReturn(0);
}

/* Chooses the spin of the axes: that of the given body, else the mean of all flexible bodies if their spins agree,
   because modal coordinates are in the bodies' axes */
PetscErrorCode Linearization::Work::chooseAxes(Body of)
{
  const SceneData &s     = R->scene;
  Vec              at[3] = {state[0], state[1], state[2]};
  double              fastest = 0, angular_difference = 0, slowest = INFINITY;
  std::vector<Motion> all;
  PetscFunctionBegin;
  spin.setZero();
  spin_rate.setZero();
  PetscCheck(of.id < 0 || s.valid(of), comm(), PETSC_ERR_ARG_WRONG, "Linearization::take(): the body whose axes are asked for is not one of this scene");
  if (of.id == -1) PetscFunctionReturn(0); /* the ground */
  PetscCall(setState(at));
  for (std::size_t b = 0; b < s.bodies.size(); b++) {
    if (of.id >= 0 ? (PetscInt)b != of.id : !s.bodies[b].flexible) continue;
    all.emplace_back();
    PetscCall(perturbed.motion(Body{(PetscInt)b, s.number}, &all.back()));
    if (s.bodies[b].flexible && s.bodies[b].flexible->model->omega.size()) slowest = std::min(slowest, s.bodies[b].flexible->model->omega.minCoeff());
  }
  for (const Motion &m : all) {
    fastest = std::max(fastest, m.angular_velocity.norm());
    angular_difference = std::max(angular_difference, (m.angular_velocity - all[0].angular_velocity).norm());
  }
  if (angular_difference <= same_spin_tolerance * fastest) {
    for (const Motion &m : all) {
      spin += m.angular_velocity / (double)all.size();
      spin_rate += m.angular_acceleration / (double)all.size();
    }
    if (fastest > 0) PetscCall(PetscInfo(nullptr, "scene: small motions in axes that turn with (%g, %g, %g) rad/s\n", spin(0), spin(1), spin(2)));
  } else if (fastest > slow_spin_ratio * slowest) {
    PetscCall(PetscPrintf(comm(), "scene: flexible bodies do not turn alike: if they rotate, modes relative to space axes are wrong. Give Linearization::take() the body relative to which the motion is steady\n"));
  }
  PetscFunctionReturn(0);
}

PetscErrorCode Linearization::Work::setState(Vec at[3]) const
{
  PetscFunctionBegin;
  PetscCall(perturbed.take(*R, t, at));
  perturbed.work_->origin = origin;
  PetscFunctionReturn(0);
}

PetscErrorCode Linearization::Work::differentiate()
{
  Mat             F[3];
  const CountFrom then(*R, origin);
  PetscFunctionBegin;
  PetscCall(DerivativeMatrix(*R, t, state, 0, 0, nullptr, &F[0]));
  PetscCall(DerivativeMatrix(*R, t, state, derivative_shift, 0, F[0], &F[1]));
  PetscCall(DerivativeMatrix(*R, t, state, 0, derivative_shift, F[0], &F[2]));
  PetscCall(MakeTransformations(*this));
  PetscCall(MatMatMult(F[2], turn[2][2], MAT_INITIAL_MATRIX, PETSC_DEFAULT, &M));
  PetscCall(MatMatMult(F[1], turn[1][1], MAT_INITIAL_MATRIX, PETSC_DEFAULT, &C));
  PetscCall(AddProduct(C, 1, F[2], turn[2][1]));
  PetscCall(MatMatMult(F[0], turn[0][0], MAT_INITIAL_MATRIX, PETSC_DEFAULT, &K));
  PetscCall(AddProduct(K, 1, F[1], turn[1][0]));
  PetscCall(AddProduct(K, 1, F[2], turn[2][0]));
  for (Mat *x : {&M, &C, &K}) {
    Mat product;
    PetscCall(MatTransposeMatMult(turn[0][0], *x, MAT_INITIAL_MATRIX, PETSC_DEFAULT, &product));
    PetscCall(MatDestroy(x));
    *x = product;
  }
  for (Mat &f : F) PetscCall(MatDestroy(&f));
  PetscFunctionReturn(0);
}

/* Sets unit = 1/sqrt(mass) from the diagonal of M; missing inertia is replaced as in assembly. Coordinates of extensions
   without a diagonal entry get the largest unit */
PetscErrorCode Linearization::Work::chooseUnits()
{
  Vec           diagonal;
  const double *mass;
  double        largest = 0;
  PetscFunctionBegin;
  unit.assign(R->n, 0);
  PetscCall(MatCreateVecs(M, &diagonal, nullptr));
  PetscCall(MatGetDiagonal(M, diagonal));
  PetscCall(VecGetArrayRead(diagonal, &mass));
  for (PetscInt i = 0; i < R->n; i++) unit[i] = std::max(0., mass[i]);
  PetscCall(VecRestoreArrayRead(diagonal, &mass));
  PetscCall(VecDestroy(&diagonal));
  for (PetscInt b = 0; b < R->bodies.own; b++) {
    const LocalBody &k = R->bodies.body[b];
    const BodyData  &d = R->scene.bodies[k.id];
    for (int c = 0; c < Coordinates(k.kind); c++) {
      double &x = unit[k.first + c];
      x         = std::max(x, c < GroupSize(k.kind, 0) ? d.light_mass : d.light_inertia);
    }
  }
  for (PetscInt i = 0; i < R->n; i++) {
    unit[i] = coordinate(i) && unit[i] > 0 ? 1 / std::sqrt(unit[i]) : 0;
    largest = std::max(largest, unit[i]);
  }
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &largest, 1, MPI_DOUBLE, MPI_MAX, comm()));
  for (PetscInt i = 0; i < R->n; i++)
    if (!(unit[i] > 0)) unit[i] = coordinate(i) && largest > 0 ? largest : 1;
  PetscFunctionReturn(0);
}

Linearization::Linearization() : work_(std::make_unique<Work>()) {}
Linearization::~Linearization() = default;

PetscErrorCode Linearization::take(TS ts, PetscReal t, Body axes)
{
  Work     &w = *work_;
  PetscBool ours;
  Vec       U, V;
  PetscFunctionBegin;
  PetscCall(ReadCheckpoint(ts));
  w.clear();
  w.R = RunOf(ts);
  PetscCheck(w.R, PetscObjectComm((PetscObject)ts), PETSC_ERR_ARG_WRONG, "Linearization::take(): the TS is not one of a scene, Scene::createTS() makes them");
  PetscCall(PetscObjectTypeCompare((PetscObject)ts, TSHHT3, &ours));
  PetscCheck(ours, PetscObjectComm((PetscObject)ts), PETSC_ERR_ARG_INCOMP, "Linearization::take(): only TS type hhtdae gives accelerations and multipliers");
  PetscCall(TS2GetSolution(ts, &U, &V));
  for (Vec &x : w.state) PetscCall(VecDuplicate(U, &x));
  PetscCall(StateAt(ts, t, true, w.state, &w.start));
  std::vector<double> parameters;
  PetscCall(ParametersAt(*w.R, ts, t, &parameters));
  if (w.start) w.R = RunOf(w.start);
  w.origin.take(*w.R);
  w.origin.parameters = parameters;
  w.t    = t;
  w.size = SceneSize(w.R->scene);
  if (!(w.size > 0)) w.size = 1;
  PetscCall(RolesOf(*w.R, w.role));
  PetscCall(w.chooseAxes(axes));
  PetscCall(w.differentiate());
  PetscCall(w.chooseUnits());
  PetscFunctionReturn(0);
}

PetscErrorCode Linearization::take(TS ts, Body axes)
{
  PetscReal t;
  PetscFunctionBegin;
  PetscCall(ReadCheckpoint(ts));
  PetscCall(TSGetTime(ts, &t));
  PetscCall(take(ts, t, axes));
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

} // namespace hhtdae
