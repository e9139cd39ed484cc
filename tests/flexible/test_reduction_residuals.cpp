/*
  The residuals of reduced modes as bounds, on models whose full spectrum is computed densely: the theorems of
  Krylov-Weinstein and Temple-Kato hold for every mode kept, and the residual is not much larger than the error.
*/
#include "dense.h"
#include "box_model.h"
#include "flexible/attachments.h"
#include "support.h"

using namespace hhtest;
using namespace hhtdae;

using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace
{

constexpr double rounding = 1e-10; /* of eigenvalues, relative; the highest are 1e8 times the lowest */

/* A skewed box, so that no frequencies coincide */
Box crooked()
{
  Box box = {{10, 2, 2}, {0.5, 0.06, 0.08}};
  box.map = [](Vector3 x) { return Vector3(x[0], x[1] * (1 + 0.4 * x[0]), x[2] * (1 + 0.3 * x[0] + 2 * x[1])); };
  return box;
}

Reduction between(Tie left, Tie right, PetscInt modes, Method method = Method::CraigBampton)
{
  Reduction r;
  for (const char *name : {"left", "right"}) {
    Attachment a;
    a.name = name;
    a.tie  = a.name == "left" ? left : right;
    r.attachments.push_back(a);
  }
  r.modes  = modes;
  r.method = method;
  return r;
}

MatrixXd dense(Mat A)
{
  PetscInt n;
  must(MatGetSize(A, &n, nullptr));
  std::vector<PetscInt> all(n);
  for (PetscInt i = 0; i < n; i++) all[i] = i;
  MatrixXd D(n, n);
  must(MatGetValues(A, n, all.data(), n, all.data(), D.data())); /* symmetric */
  return D;
}

/* Elastic eigenvalues of the full model with rigid attachments tied */
VectorXd spectrum(const FeModel &model, const Reduction &r, const ReducedBody &body)
{
  const PetscInt n = 3 * model.nodes;
  MatrixXd       P = MatrixXd::Identity(n, n);
  for (std::size_t a = 0; a < r.attachments.size(); a++) {
    if (r.attachments[a].tie != Tie::Rigid) continue;
    MatrixXd motion = MatrixXd::Zero(n, 6);
    for (PetscInt i : model.sets.at(r.attachments[a].name)) {
      motion.middleRows(3 * i, 3) = RigidMotion(NodePosition(model, i), body.modal.attachments[a].position);
      P.middleRows(3 * i, 3).setZero();
    }
    P.conservativeResize(Eigen::NoChange, P.cols() + 6);
    P.rightCols(6) = motion;
  }
  std::vector<int> used;
  for (int k = 0; k < P.cols(); k++)
    if (P.col(k).squaredNorm() > 0) used.push_back(k);
  MatrixXd T(n, used.size());
  for (std::size_t k = 0; k < used.size(); k++) T.col(k) = P.col(used[k]);
  const VectorXd all = hhtest::EigenvaluesOf(T.transpose() * dense(model.K) * T, T.transpose() * dense(model.M) * T);
  return all.tail(all.size() - 6);
}

struct Reduced {
  FeModel     model;
  BoxBuilder  builder;
  Reduction   reduction;
  ReducedBody body;
  VectorXd    exact;

  explicit Reduced(const Reduction &r) : model(PETSC_COMM_SELF), builder(crooked(), &model), reduction(r)
  {
    must(Reduce(model, reduction, &body));
    exact = spectrum(model, reduction, body);
  }
  int    modes() const { return (int)body.mode.size(); }
  double lambda(int k) const { return body.modal.omega[k] * body.modal.omega[k]; }
  double eta(int k) const { return body.mode[k].residual; }
  double off(int k) const { return lambda(k) / exact[k] - 1; } /* never negative, because a subspace does not lower an eigenvalue */
  int    nearest(int k) const
  {
    int at;
    ((lambda(k) - exact.array()).abs() / exact.array()).minCoeff(&at);
    return at;
  }
  /* |1 - lambda / lambda_j|, smallest over all j except one */
  double gap(int k, int but) const
  {
    double least = INFINITY;
    for (int j = 0; j < exact.size(); j++)
      if (j != but) least = std::min(least, std::abs(1 - lambda(k) / exact[j]));
    return least;
  }
};

void expectBounds(const Reduced &r)
{
  for (int k = 0; k < r.modes(); k++) {
    const int    j     = r.nearest(k);
    const double error = std::abs(r.lambda(k) - r.exact[j]) / r.exact[j], eta = r.eta(k);
    EXPECT_LE(error, eta + rounding) << "Krylov-Weinstein, mode " << k;
    EXPECT_LE(error, eta * eta / r.gap(k, j) + rounding) << "Temple-Kato, mode " << k;
  }
}

const std::pair<Tie, Tie> ties[] = {
    {Tie::Rigid, Tie::Rigid}, {Tie::Rigid, Tie::Average}, {Tie::Average, Tie::Average}};

} // namespace

TEST(ReductionResiduals, BoundTheErrorOfEveryMode)
{
  for (auto t : ties) {
    const Reduced r(between(t.first, t.second, 20));
    ASSERT_EQ(r.modes(), 26);
    expectBounds(r);
    double most = 0, least = INFINITY;
    for (int k = 0; k < 10; k++) {
      const double eta = r.eta(k);
      EXPECT_LE(r.off(k), eta + rounding) << k;
      if (r.off(k) < 1e3 * rounding) continue;
      most  = std::max(most, eta * eta / r.off(k));
      least = std::min(least, eta * eta / r.off(k));
    }
    std::printf("[ MEASURED ] eta^2 is %.3f to %.3f times the error of the first ten, eta up to %.1e, of all to %.1e\n",
                least, most, r.eta(9), r.body.mode.back().residual);
    /* to first order the error is between eta^2 and eta^2 / (1 - lambda / nu), where nu is that of the first mode left out */
    EXPECT_LT(most, 1.1);
    EXPECT_GT(least, 0.3);
  }
}

/* The residuals of the first modes decrease with additional normal modes; near the highest normal modes this need not hold */
TEST(ReductionResiduals, FallWithMoreModes)
{
  for (auto t : ties) {
    VectorXd before = VectorXd::Constant(3, 1.), start;
    for (PetscInt modes : {4, 8, 16, 32}) {
      const Reduced r(between(t.first, t.second, modes));
      for (int k = 0; k < 3; k++) {
        EXPECT_LT(r.eta(k), before[k]) << modes << " modes, mode " << k;
        before[k] = r.eta(k);
      }
      if (!start.size()) start = before;
    }
    std::printf("[ MEASURED ] 4 to 32 normal modes: residual of the first three %.1e %.1e %.1e to %.1e %.1e %.1e\n",
                start[0], start[1], start[2], before[0], before[1], before[2]);
    EXPECT_LT(before.cwiseQuotient(start).maxCoeff(), 0.2);
  }
}

TEST(ReductionResiduals, OfConstraintModesAlone)
{
  for (auto t : ties) {
    const Reduced r(between(t.first, t.second, 0, Method::Static));
    ASSERT_EQ(r.modes(), 6);
    expectBounds(r);
    for (int k = 0; k < r.modes(); k++) EXPECT_GT(r.eta(k), 1e-3) << "six modes are no exact ones";
    /* the same space, requested in another way */
    const Reduced s(between(t.first, t.second, 0));
    for (int k = 0; k < r.modes(); k++) EXPECT_NEAR(s.eta(k), r.eta(k), 1e-6 * r.eta(k));
  }
}

/* The modes are eigenvectors of the full model, whose residual is that of the eigensolver */
TEST(ReductionResiduals, OfTheFreeBody)
{
  for (auto t : ties) {
    const Reduced r(between(t.first, t.second, 20, Method::FreeFree));
    ASSERT_EQ(r.modes(), 20);
    expectBounds(r);
    for (int k = 0; k < r.modes(); k++) EXPECT_LT(r.eta(k), 1e-8) << k;
    /* the error of a coarse solver tolerance is noticed and bounded */
    Options       options("-reduce_eps_tol 1e-3 -reduce_eps_ncv 24 -reduce_verify 0");
    const Reduced coarse(between(t.first, t.second, 20, Method::FreeFree));
    expectBounds(coarse);
    double most = 0;
    for (int k = 0; k < coarse.modes(); k++) most = std::max(most, coarse.eta(k));
    EXPECT_GT(most, 1e-6);
  }
}

/* Residuals are the same if modes are computed in slices, which leaves no factorization, or if only some modes are selected */
TEST(ReductionResiduals, SlicesAndSelectionHaveTheSame)
{
  Reduction r     = between(Tie::Rigid, Tie::Average, PETSC_DEFAULT);
  r.max_frequency = 20e3;
  const Reduced counted(r);
  ASSERT_GT(counted.modes(), 10);
  {
    Options       options("-reduce_slices_from 1");
    const Reduced sliced(r);
    ASSERT_EQ(sliced.modes(), counted.modes());
    for (int k = 0; k < sliced.modes(); k++)
      EXPECT_NEAR(sliced.eta(k), counted.eta(k), 1e-4 * counted.eta(k) + 1e-8) << k;
  }
  r.keep = {2, 7};
  const Reduced some(r);
  ASSERT_EQ(some.modes(), 2);
  EXPECT_NEAR(some.eta(0), counted.eta(2), 1e-4 * counted.eta(2) + 1e-8);
  EXPECT_NEAR(some.eta(1), counted.eta(7), 1e-4 * counted.eta(7) + 1e-8);
}
