/* Inertia invariants against sums over the entries of M, and against the kinetic energy of the full model in motion */
#include "dense.h"
#include "box_model.h"
#include "flexible/attachments.h"
#include "support.h"
#include <random>

using namespace hhtest;
using namespace hhtdae;

namespace
{

/* A bent and tapered bar, for which no invariant vanishes by symmetry */
struct Bent {
  FeModel     model;
  ReducedBody body;
  Bent() : model(PETSC_COMM_SELF)
  {
    Box box = {{6, 2, 2}, {0.5, 0.06, 0.08}};
    box.map = [](Vector3 x) {
      return Vector3(x[0] + 1, x[1] * (1 - x[0]) + 0.3 * x[0] * x[0] - 2, x[2] * (1 + 0.4 * x[0]) + 0.2 * x[0] * x[1]);
    };
    BoxBuilder builder(box, &model);
    Reduction  r;
    r.attachments.resize(2);
    r.attachments[0].name = "left";
    r.attachments[1].name = "right";
    r.attachments[1].tie  = Tie::Average;
    r.modes               = 8;
    must(Reduce(model, r, &body));
  }
  Vector3 X(PetscInt i) const { return NodePosition(model, i) - body.modal.center; }
};

double largest(const Eigen::MatrixXd &a) { return a.cwiseAbs().maxCoeff(); }

double random(std::mt19937 &engine) { return std::uniform_real_distribution<double>(-1, 1)(engine); }

} // namespace

/* Every invariant as the double sum over m_ij that defines it */
TEST(Invariants, AreSumsOverTheMassMatrix)
{
  Bent             b;
  const ModalBody &m = b.body.modal;
  const PetscInt   n = m.modes();
  ModalBody        s;
  const int        first[6] = {0, 1, 2, 0, 1, 2}, second[6] = {0, 1, 2, 1, 2, 0};
  s.first.setZero(3, n);
  for (auto &a : s.moment) a.setZero(3, n);
  for (auto &a : s.quadratic) a.setZero(n, n);
  Vector3 weighted = Vector3::Zero();
  for (PetscInt i = 0; i < b.model.nodes; i++)
    for (PetscInt j = 0; j < b.model.nodes; j++) {
      double         mij;
      const PetscInt row = 3 * i, col = 3 * j;
      must(MatGetValues(b.model.M, 1, &row, 1, &col, &mij));
      if (mij == 0) continue;
      s.mass += mij;
      weighted += mij * NodePosition(b.model, j);
      s.moments += mij * b.X(i) * b.X(j).transpose();
      for (PetscInt k = 0; k < n; k++) {
        const Vector3 phi = b.body.shape.block<3, 1>(3 * j, k);
        s.first.col(k) += mij * phi;
        for (int c = 0; c < 3; c++) s.moment[c].col(k) += mij * b.X(i)[c] * phi;
        for (PetscInt l = 0; l < n; l++)
          for (int p = 0; p < 6; p++)
            s.quadratic[p](k, l) += mij * b.body.shape(3 * i + first[p], k) * b.body.shape(3 * j + second[p], l);
      }
    }
  EXPECT_NEAR(m.mass, s.mass, 1e-12 * s.mass);
  EXPECT_LT((m.center - weighted / s.mass).norm(), 1e-12);
  EXPECT_LT(largest(m.moments - s.moments), 1e-12 * largest(s.moments));
  EXPECT_LT(largest(m.first - s.first), 1e-11 * std::sqrt(s.mass));
  for (int c = 0; c < 3; c++) EXPECT_LT(largest(m.moment[c] - s.moment[c]), 1e-11 * largest(s.moment[c]));
  for (int p = 0; p < 6; p++) EXPECT_LT(largest(m.quadratic[p] - s.quadratic[p]), 1e-11);
}

TEST(Invariants, ModesAreOrthonormalAndFreeOfMomentum)
{
  Bent             b;
  const ModalBody &m = b.body.modal;
  const double     off =
      largest(m.quadratic[0] + m.quadratic[1] + m.quadratic[2] - Eigen::MatrixXd::Identity(m.modes(), m.modes()));
  double momentum = 0, moment = 0;
  for (PetscInt k = 0; k < m.modes(); k++) {
    Vector3 l;
    for (int c = 0; c < 3; c++) l[c] = m.moment[(c + 1) % 3]((c + 2) % 3, k) - m.moment[(c + 2) % 3]((c + 1) % 3, k);
    momentum = std::max(momentum, m.first.col(k).norm() / std::sqrt(m.mass));
    moment   = std::max(moment, l.norm() / std::sqrt(m.moments.trace()));
  }
  MEASURED("%d modes: off orthonormality by %.1e, momentum %.1e, moment of momentum %.1e", (int)m.modes(), off,
           momentum, moment);
  EXPECT_LT(off, 1e-10);
  EXPECT_LT(momentum, 1e-12);
  EXPECT_LT(moment, 1e-12);
}

/* The modes diagonalize K with the eigenvalues omega^2 */
TEST(Invariants, ModesDiagonalizeTheStiffness)
{
  Bent            b;
  const PetscInt  n = b.body.modal.modes();
  Eigen::MatrixXd K(n, n);
  Vec             x, y;
  must(MatCreateVecs(b.model.K, &x, &y));
  for (PetscInt k = 0; k < n; k++) {
    PetscScalar *v;
    must(VecGetArray(x, &v));
    Eigen::Map<Eigen::VectorXd>(v, 3 * b.model.own) = b.body.shape.col(k);
    must(VecRestoreArray(x, &v));
    must(MatMult(b.model.K, x, y));
    must(VecGetArray(y, &v));
    K.col(k) = b.body.shape.transpose() * Eigen::Map<Eigen::VectorXd>(v, 3 * b.model.own);
    must(VecRestoreArray(y, &v));
  }
  VecDestroy(&x);
  VecDestroy(&y);
  const Eigen::VectorXd omega = b.body.modal.omega;
  for (PetscInt k = 0; k < n; k++)
    for (PetscInt l = 0; l < n; l++)
      EXPECT_NEAR(K(k, l), k == l ? omega[k] * omega[k] : 0., 1e-9 * omega[n - 1] * omega[n - 1]);
}

/* Kinetic energy for the velocity field V + w x (X + phi eta) + phi eta' with large eta: 1/2 v^T M v over all nodes
   against the invariants */
TEST(Invariants, KineticEnergyOfTheFullModel)
{
  Bent             b;
  const ModalBody &m = b.body.modal;
  const PetscInt   n = m.modes();
  std::mt19937     engine(7);
  Vec              v, Mv;
  must(MatCreateVecs(b.model.M, &v, &Mv));
  for (int trial = 0; trial < 5; trial++) {
    Eigen::VectorXd eta(n), rate(n);
    Vector3         V, w;
    for (PetscInt k = 0; k < n; k++) {
      eta[k]  = 0.3 * random(engine);
      rate[k] = 2 * random(engine);
    }
    for (int c = 0; c < 3; c++) {
      V[c] = random(engine);
      w[c] = 3 * random(engine);
    }
    PetscScalar          *array;
    const Eigen::VectorXd u = b.body.shape * eta, du = b.body.shape * rate;
    must(VecGetArray(v, &array));
    for (PetscInt i = 0; i < b.model.own; i++)
      Eigen::Map<Vector3>(array + 3 * i) = V + w.cross(b.X(i) + u.segment<3>(3 * i)) + du.segment<3>(3 * i);
    must(VecRestoreArray(v, &array));
    PetscScalar full;
    must(MatMult(b.model.M, v, Mv));
    must(VecDot(v, Mv, &full));
    full /= 2;

    const int index[3][3] = {{0, 3, 5}, {3, 1, 4}, {5, 4, 2}};
    Matrix3   Q           = m.moments;
    Matrix3   coupling; /* int (X + u)_c du_d dm */
    for (int c = 0; c < 3; c++)
      for (int d = 0; d < 3; d++) {
        /* xy, yz, zx are stored, the others are transposes */
        const bool            stored = c == d || d == (c + 1) % 3;
        const Eigen::MatrixXd q =
            stored ? m.quadratic[index[c][d]] : Eigen::MatrixXd(m.quadratic[index[c][d]].transpose());
        Q(c, d) += m.moment[c].row(d).dot(eta) + m.moment[d].row(c).dot(eta) + eta.dot(q * eta);
        coupling(c, d) = m.moment[c].row(d).dot(rate) + eta.dot(q * rate);
      }
    const Matrix3 J = Q.trace() * Matrix3::Identity() - Q;
    const Vector3 h(coupling(1, 2) - coupling(2, 1), coupling(2, 0) - coupling(0, 2), coupling(0, 1) - coupling(1, 0));
    const double  energy = 0.5 * m.mass * V.squaredNorm() + V.dot(w.cross(m.first * eta)) + V.dot(m.first * rate) +
                          0.5 * w.dot(J * w) + w.dot(h) + 0.5 * rate.squaredNorm();
    if (trial == 0) MEASURED("energy %.15g by the full model, by invariants off by %.1e", full, energy / full - 1);
    EXPECT_NEAR(energy, full, 1e-11 * full);
    /* the parts that depend on the deformation are not negligible */
    EXPECT_GT(std::abs(0.5 * w.dot((Q - m.moments).trace() * w - (Q - m.moments) * w)), 1e-6 * full);
  }
  VecDestroy(&v);
  VecDestroy(&Mv);
}

/* A rigid attachment moves with its nodes; an averaging attachment has the nearest rigid motion of its nodes */
TEST(Invariants, AttachmentsFollowTheNodes)
{
  Bent                   b;
  const ModalAttachment &rigid = b.body.modal.attachments[0], &mean = b.body.modal.attachments[1];
  for (PetscInt k = 0; k < b.body.modal.modes(); k++) {
    for (PetscInt i : b.model.sets["left"]) {
      const Vector3 u =
          rigid.translation.col(k) + rigid.rotation.col(k).head<3>().cross(NodePosition(b.model, i) - rigid.position);
      EXPECT_LT((u - b.body.shape.block<3, 1>(3 * i, k)).norm(), 1e-10 * b.body.shape.col(k).norm());
    }
    /* least squares by a dense solve */
    const std::vector<PetscInt> &set = b.model.sets["right"];
    Eigen::MatrixXd              A(3 * set.size(), 6);
    Eigen::VectorXd              u(3 * set.size());
    for (std::size_t s = 0; s < set.size(); s++) {
      A.middleRows(3 * s, 3) = RigidMotion(NodePosition(b.model, set[s]), mean.position);
      u.segment<3>(3 * s)    = b.body.shape.block<3, 1>(3 * set[s], k);
    }
    const Eigen::VectorXd q = hhtest::LeastSquares(A, u);
    EXPECT_LT((q.head<3>() - mean.translation.col(k)).norm(), 1e-10 * u.norm());
    EXPECT_LT((q.tail<3>() - mean.rotation.col(k)).norm(), 1e-8 * u.norm());
  }
}
