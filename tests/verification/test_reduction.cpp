/*
  Reduced bodies against published frequencies, against the full model, and against static solutions by dense algebra.
*/
#include "dense.h"
#include "box_model.h"
#include "flexible/attachments.h"
#include "support.h"
#include <fstream>
#include <sstream>
#include <unistd.h>

using namespace hhtest;
using namespace hhtdae;
using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace
{

/* ---- models of another program: node lines of an Abaqus deck, matrices in rows i j v ---- */

std::string reference(const std::string &file)
{
  const std::string here(__FILE__);
  return here.substr(0, here.rfind("/tests/")) + "/../shared/reference/" + file;
}

void readNodes(const std::string &file, FeModel *model)
{
  std::ifstream in(file);
  std::string   line;
  while (std::getline(in, line) && line.rfind("*Node", 0) != 0) {
  }
  while (std::getline(in, line) && line[0] != '*') {
    double x, y, z;
    int    label;
    if (std::sscanf(line.c_str(), "%d, %lf, %lf, %lf", &label, &x, &y, &z) != 4) break;
    model->label.push_back(label);
    for (double c : {x, y, z}) model->coordinates.push_back(c);
  }
  model->nodes = model->own = (PetscInt)model->label.size();
}

Mat readMatrix(const std::string &file, PetscInt rows)
{
  std::ifstream in(file);
  PetscInt      i, j;
  double        v;
  Mat           A;
  must(MatCreateSeqAIJ(PETSC_COMM_SELF, rows, rows, 200, nullptr, &A));
  must(MatSetOption(A, MAT_NEW_NONZERO_ALLOCATION_ERR, PETSC_FALSE));
  while (in >> i >> j >> v) must(MatSetValue(A, i - 1, j - 1, v, INSERT_VALUES));
  must(MatAssemblyBegin(A, MAT_FINAL_ASSEMBLY));
  must(MatAssemblyEnd(A, MAT_FINAL_ASSEMBLY));
  return A;
}

bool readModel(const std::string &deck, const std::string &stem, FeModel *model)
{
  if (access(reference(deck).c_str(), R_OK)) return false;
  readNodes(reference(deck), model);
  model->K = readMatrix(reference(stem + "STIF1.mtx"), 3 * model->nodes);
  model->M = readMatrix(reference(stem + "MASS1.mtx"), 3 * model->nodes);
  return true;
}

void setOf(FeModel *model, const std::string &name, int c, double value)
{
  for (PetscInt i = 0; i < model->own; i++)
    if (std::abs(model->coordinates[3 * i + c] - value) < 1e-6) model->sets[name].push_back(i);
}

void expectFrequencies(const ReducedBody &body, const std::vector<double> &published)
{
  ASSERT_GE(body.mode.size(), published.size());
  double off = 0, residual = 0;
  for (std::size_t k = 0; k < published.size(); k++) {
    off      = std::max(off, std::abs(body.mode[k].frequency / published[k] - 1));
    residual = std::max(residual, body.mode[k].residual);
  }
  MEASURED("%d frequencies: off by %.1e at most, residuals up to %.1e", (int)published.size(), off, residual);
  EXPECT_LT(off, 2e-6); /* as many digits as the reference has */
  EXPECT_LT(residual, 1e-6);
}

/* ---- dense algebra ---- */

MatrixXd dense(Mat A)
{
  PetscInt n;
  must(MatGetSize(A, &n, nullptr));
  MatrixXd D(n, n);
  for (PetscInt i = 0; i < n; i++)
    for (PetscInt j = 0; j < n; j++) must(MatGetValues(A, 1, &i, 1, &j, &D(i, j)));
  return D;
}

VectorXd frequencies(const MatrixXd &K, const MatrixXd &M)
{
  const VectorXd l = hhtest::EigenvaluesOf(K, M);
  return l.cwiseMax(0).cwiseSqrt() / (2 * PETSC_PI);
}

/* The tied model in dense form: degrees of freedom not in a rigid attachment, then six for each rigid attachment; Q
   removes the motion of all attachments */
struct Dense {
  MatrixXd P, K, M, Q, R;
  Dense(const FeModel &model, const Reduction &reduction, const ReducedBody &body)
  {
    const PetscInt    n = 3 * model.nodes;
    std::vector<char> held(model.nodes, 0);
    PetscInt          columns = 0, k = 0;
    for (const Attachment &a : reduction.attachments) {
      if (a.tie == Tie::Rigid) columns += 6;
      for (PetscInt i : model.sets.at(a.name))
        if (a.tie == Tie::Rigid) held[i] = 1;
    }
    for (char h : held) columns += h ? 0 : 3;
    P.setZero(n, columns);
    for (PetscInt i = 0; i < model.nodes; i++)
      for (int c = 0; c < 3 && !held[i]; c++) P(3 * i + c, k++) = 1;
    Q.setZero(6 * reduction.attachments.size(), columns);
    for (std::size_t a = 0; a < reduction.attachments.size(); a++) {
      if (reduction.attachments[a].tie != Tie::Rigid) continue;
      for (PetscInt i : model.sets.at(reduction.attachments[a].name))
        P.block<3, 6>(3 * i, k) = RigidMotion(NodePosition(model, i), body.modal.attachments[a].position);
      Q.block<6, 6>(6 * a, k).setIdentity();
      k += 6;
    }
    for (std::size_t a = 0; a < reduction.attachments.size(); a++)
      if (reduction.attachments[a].tie == Tie::Average)
        average(model, reduction.attachments[a], body.modal.attachments[a].position, a);
    K = P.transpose() * dense(model.K) * P;
    M = P.transpose() * dense(model.M) * P;
    /* rigid-body motions, orthonormal in M */
    MatrixXd u(n, 6);
    for (PetscInt i = 0; i < model.nodes; i++)
      u.middleRows(3 * i, 3) = RigidMotion(NodePosition(model, i), body.modal.center);
    R                 = hhtest::LeastSquares(P, u);
    const MatrixXd mR = R.transpose() * M * R;
    R                 = (R * hhtest::ModesOf(MatrixXd::Identity(6, 6), mR).vectors).eval();
  }
  /* averaging attachment by least squares (normal equations) */
  void average(const FeModel &model, const Attachment &a, const Vector3 &position, std::size_t row)
  {
    const std::vector<PetscInt> &set = model.sets.at(a.name);
    MatrixXd                     A(3 * set.size(), 6), S = MatrixXd::Zero(3 * set.size(), 3 * model.nodes);
    VectorXd                     w(3 * set.size());
    for (std::size_t s = 0; s < set.size(); s++) {
      A.middleRows(3 * s, 3)           = RigidMotion(NodePosition(model, set[s]), position);
      S.block<3, 3>(3 * s, 3 * set[s]) = Matrix3::Identity();
      w.segment<3>(3 * s)              = Vector3::Constant(a.weights.empty() ? 1. : a.weights[s]);
    }
    Q.middleRows(6 * row, 6) =
        hhtest::SolveDense(A.transpose() * w.asDiagonal() * A, A.transpose() * w.asDiagonal() * S) * P;
  }
  /* Elastic displacements, orthogonal to rigid-body motions in M, under self-equilibrated forces */
  MatrixXd solve(const MatrixXd &f) const
  {
    const MatrixXd MR = M * R;
    const double   s  = K.diagonal().maxCoeff() / M.diagonal().maxCoeff() * 1e-3;
    return hhtest::SolveDense(K + s * MR * MR.transpose(), f);
  }
};

Reduction between(Tie left, Tie right, PetscInt modes, Method method = Method::CraigBampton)
{
  Reduction r;
  r.attachments.resize(2);
  r.attachments[0].name = "left";
  r.attachments[0].tie  = left;
  r.attachments[1].name = "right";
  r.attachments[1].tie  = right;
  r.modes               = modes;
  r.method              = method;
  return r;
}

Box crooked(int nx, int ny, int nz)
{
  Box box = {{nx, ny, nz}, {0.5, 0.06, 0.08}};
  box.map = [](Vector3 x) { return Vector3(x[0] + 1, x[1] * (1 - x[0]) + 0.3 * x[0] * x[0], x[2] * (1 + 0.4 * x[0])); };
  return box;
}

} // namespace

/* ---- published frequencies ---- */

TEST(Exudyn, BlockUnsupported)
{
  FeModel model(PETSC_COMM_SELF);
  if (!readModel("exudyn_abaqus_block/blockC3D8.inp", "exudyn_abaqus_block/blockC3D8_", &model)) GTEST_SKIP();
  Reduction r;
  r.modes = 8;
  ReducedBody body;
  must(Reduce(model, r, &body));
  EXPECT_EQ(body.fe_nodes, 176);
  EXPECT_NEAR(body.modal.mass, 11600, 1e-3);
  expectFrequencies(body, {438.775, 438.775, 555.888, 967.040, 967.040, 1028.046});
}

/* Clamped at x = 0: a body with this attachment, whose six coordinates are fixed. The fixed-interface modes span the
   remaining space, so that the frequencies are those of the full model */
TEST(Exudyn, BlockClamped)
{
  FeModel model(PETSC_COMM_SELF);
  if (!readModel("exudyn_abaqus_block/blockC3D8.inp", "exudyn_abaqus_block/blockC3D8_", &model)) GTEST_SKIP();
  setOf(&model, "left", 0, 0.);
  ASSERT_EQ(model.sets["left"].size(), 16u);
  Reduction r;
  r.attachments.resize(1);
  r.attachments[0].name = "left";
  r.modes               = 8;
  ReducedBody body;
  must(Reduce(model, r, &body));
  const PetscInt         n = body.modal.modes();
  const ModalAttachment &a = body.modal.attachments[0];
  MatrixXd               K = MatrixXd::Zero(6 + n, 6 + n), M = MatrixXd::Identity(6 + n, 6 + n), G(6, 6 + n);
  M.topLeftCorner<3, 3>() *= body.modal.mass;
  M.block<3, 3>(3, 3) = body.modal.inertia();
  for (PetscInt k = 0; k < n; k++) K(6 + k, 6 + k) = std::pow(body.modal.omega[k], 2);
  G << Matrix3::Identity(), -Cross(a.position - body.modal.center), a.translation, Matrix3::Zero(), Matrix3::Identity(),
      a.rotation;
  const MatrixXd free         = Eigen::FullPivLU<MatrixXd>(G).kernel();
  const VectorXd f            = frequencies(free.transpose() * K * free, free.transpose() * M * free);
  const double   published[8] = {81.86755, 81.86755, 279.74872, 412.38190, 412.38190, 522.65899, 832.12627, 938.49682};
  ASSERT_EQ(f.size(), 8);
  double off = 0;
  for (int k = 0; k < 8; k++) off = std::max(off, std::abs(f[k] / published[k] - 1));
  MEASURED("clamped block: 8 frequencies off by %.1e at most", off);
  EXPECT_LT(off, 1e-7);
}

TEST(Exudyn, RotorUnsupported)
{
  FeModel model(PETSC_COMM_SELF);
  if (!readModel("exudyn_rotor/rotorDiscTest.inp", "exudyn_rotor/rotorDiscTest", &model)) GTEST_SKIP();
  Reduction r;
  r.modes = 10;
  ReducedBody body;
  must(Reduce(model, r, &body));
  EXPECT_EQ(body.fe_nodes, 115);
  EXPECT_NEAR(body.modal.mass, 77.96605109486, 1e-9);
  expectFrequencies(body, {1046.3701, 1046.3701, 1878.2409, 2123.2970, 2245.5211, 2386.8793, 2842.0473, 2842.0473,
                           3945.7171, 3945.7171});
}

/* ---- the full model ---- */

/* Free frequencies of the body with its attachments, by Craig-Bampton and by the full (tied) model with dense algebra;
   normal modes up to two and a half times the cut-off */
TEST(ReducedFrequencies, AgreeWithTheFullModel)
{
  for (Tie tie : {Tie::Rigid, Tie::Average}) {
    FeModel      model(PETSC_COMM_SELF);
    BoxBuilder   builder(crooked(20, 3, 3), &model);
    const double cut_off = 30e3;
    Reduction    r       = between(tie, tie, PETSC_DEFAULT);
    r.max_frequency      = 2.5 * cut_off;
    r.keep_below         = cut_off;
    ReducedBody body;
    must(Reduce(model, r, &body));
    const Dense    full(model, r, body);
    const VectorXd f   = frequencies(full.K, full.M);
    double         ten = 0, all = 0, residual = 0;
    for (PetscInt k = 0; k < body.modal.modes(); k++) {
      const double off = body.mode[k].frequency / f[6 + k] - 1;
      EXPECT_GT(off, -1e-9); /* a subspace does not lower a frequency */
      all = std::max(all, off);
      if (k < 10) {
        ten      = std::max(ten, off);
        residual = std::max(residual, body.mode[k].residual);
      }
    }
    MEASURED("%s: %d modes to %g Hz off by %.2e at most, the first ten by %.2e (residuals to %.1e); full model: %d",
             tie == Tie::Rigid ? "rigid" : "average", (int)body.modal.modes(), cut_off, all, ten, residual,
             (int)((f.array() < cut_off).count() - 6));
    EXPECT_GE(body.modal.modes(), 12);
    EXPECT_EQ(body.modal.modes(), (f.array() < cut_off).count() - 6);
    EXPECT_LT(all, 1e-2);
    EXPECT_LT(ten, 1e-4);
  }
}

TEST(ReducedFrequencies, FreeModesAreThoseOfTheTiedModel)
{
  for (Tie tie : {Tie::Rigid, Tie::Average}) {
    FeModel     model(PETSC_COMM_SELF);
    BoxBuilder  builder(crooked(8, 2, 2), &model);
    Reduction   r = between(tie, tie, 20, Method::FreeFree);
    ReducedBody body;
    must(Reduce(model, r, &body));
    const Dense    full(model, r, body);
    const VectorXd f = frequencies(full.K, full.M);
    for (int k = 0; k < 20; k++) {
      EXPECT_NEAR(body.mode[k].frequency, f[6 + k], 1e-8 * f[6 + k]);
      EXPECT_LT(body.mode[k].residual, 1e-6);
    }
  }
}

/* Guyan reduction has the frequencies of static condensation by dense algebra */
TEST(ReducedFrequencies, GuyanIsStaticCondensation)
{
  FeModel     model(PETSC_COMM_SELF);
  BoxBuilder  builder(crooked(6, 2, 2), &model);
  Reduction   r = between(Tie::Rigid, Tie::Rigid, 0, Method::Static);
  ReducedBody body;
  must(Reduce(model, r, &body));
  const Dense    full(model, r, body);
  const PetscInt n = (PetscInt)full.K.rows(), i = n - 12;
  MatrixXd       T(n, 12);
  T << -hhtest::SolveDense(full.K.topLeftCorner(i, i), full.K.topRightCorner(i, 12)), MatrixXd::Identity(12, 12);
  const VectorXd f = frequencies(T.transpose() * full.K * T, T.transpose() * full.M * T);
  ASSERT_EQ(body.modal.modes(), 6);
  for (int k = 0; k < 6; k++) EXPECT_NEAR(body.mode[k].frequency, f[6 + k], 1e-8 * f[6 + k]);
}

/* ---- static exactness ---- */

/* Self-equilibrated wrenches at the attachments displace these as in the full model, with any number of normal modes */
TEST(ReducedStatics, WrenchesBetweenAttachments)
{
  const struct {
    Tie    left, right;
    Method method;
    int    modes;
  } cases[] = {
      {Tie::Rigid, Tie::Rigid, Method::CraigBampton, 0},     {Tie::Rigid, Tie::Rigid, Method::CraigBampton, 7},
      {Tie::Average, Tie::Average, Method::CraigBampton, 0}, {Tie::Average, Tie::Average, Method::CraigBampton, 7},
      {Tie::Rigid, Tie::Average, Method::CraigBampton, 5},   {Tie::Average, Tie::Rigid, Method::Static, 0}};
  for (const auto &c : cases) {
    FeModel    model(PETSC_COMM_SELF);
    BoxBuilder builder(crooked(6, 2, 2), &model);
    Reduction  r              = between(c.left, c.right, c.modes, c.method);
    r.attachments[1].at_given = true;
    r.attachments[1].position = Vector3(1.6, 0.2, -0.1);
    if (c.right == Tie::Average) r.attachments[1].weights = {1, 2, 1, 2, 4, 2, 1, 2, 0};
    ReducedBody body;
    must(Reduce(model, r, &body));
    const ModalAttachment &a = body.modal.attachments[0], &b = body.modal.attachments[1];
    MatrixXd               G(12, body.modal.modes()), F(12, 6);
    G << a.translation, a.rotation, b.translation, b.rotation;
    /* unit wrenches at b, and their reactions at a */
    F.bottomRows<6>().setIdentity();
    for (int k = 0; k < 6; k++) {
      Vector3 force = Vector3::Zero(), torque = Vector3::Zero();
      (k < 3 ? force : torque)[k % 3] = 1;
      F.block<3, 1>(0, k)             = -force;
      F.block<3, 1>(3, k)             = -torque - (b.position - a.position).cross(force);
    }
    const Dense    full(model, r, body);
    const MatrixXd exact   = full.Q * full.solve(full.Q.transpose() * F);
    const MatrixXd reduced = G * body.modal.omega.cwiseAbs2().cwiseInverse().asDiagonal() * G.transpose() * F;
    double         off     = 0;
    for (int k = 0; k < 12; k++) off = std::max(off, (exact.row(k) - reduced.row(k)).norm() / exact.row(k).norm());
    MEASURED("%s to %s, %d normal modes: off by %.1e", c.left == Tie::Rigid ? "rigid" : "average",
             c.right == Tie::Rigid ? "rigid" : "average", c.modes, off);
    EXPECT_LT(off, 1e-8);
  }
}
