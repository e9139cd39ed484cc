/*
  Bodies and movements without inertia. The equations of motion can be solved if the mass matrix is positive definite on the movements that the
  constraints allow. So the constraints must determine the movements without inertia, the columns of N: Phi_q N must have full column rank.
*/
#include "products.h"
#include "start.h"
#include "symmetric.h"
#include <Eigen/OrderingMethods>
#include <Eigen/SparseQR>
#include <algorithm>

namespace hhtdae
{

namespace
{

constexpr double zero_moment_ratio = 1e-12; /* principal moments of inertia below this part of the body's largest one count as zero */
/* substitute for missing inertia in the metric of assembly, relative to that of the lightest body or of the body itself
   */
constexpr double light_mass_ratio  = 1e-3;
constexpr double least_mass_ratio  = 1e-7;  /* least inertia in the metric of assembly, relative to the largest one (Massless.NextToNothing) */
constexpr double rank_tolerance    = 1e-8;  /* pivot threshold for the rank of Phi_q N, whose columns are scaled to norm one */

/* Axes, as columns in body axes, about which the body has no moment of inertia */
Eigen::MatrixXd AxesWithoutInertia(const SceneData &s, const BodyData &b)
{
  if (b.point) return Eigen::MatrixXd(3, 0);
  if (s.planar) return b.inertia(2, 2) > 0 ? Eigen::MatrixXd(3, 0) : Eigen::MatrixXd(Vector3::UnitZ());
  const SymmetricEigen principal(b.inertia);
  int                  n = 0;
  while (n < 3 && principal.values(n) <= zero_moment_ratio * principal.values(2)) n++;
  return principal.vectors.leftCols(n);
}

double LeastMoment(const SceneData &s, const BodyData &b)
{
  if (s.planar) return b.inertia(2, 2);
  return SymmetricEigen(b.inertia).values(0);
}

bool HasFullInertia(const SceneData &s, const BodyData &b) { return b.massless || b.flexible || (b.mass > 0 && AxesWithoutInertia(s, b).cols() == 0); }

/* Movements of a body without inertia, as columns of components in its directions of motion */
Eigen::MatrixXd MovementsWithoutInertia(const SceneData &s, const BodyData &b)
{
  const std::vector<int> &d     = Directions(KindOf(s, b));
  const Eigen::MatrixXd   axes         = b.A * AxesWithoutInertia(s, b);
  const int               translations = b.mass > 0 ? 0 : s.planar ? 2 : 3;
  Eigen::MatrixXd         full         = Eigen::MatrixXd::Zero(6, translations + axes.cols()), N(d.size(), full.cols());
  for (int k = 0; k < translations; k++) full(k, k) = 1;
  full.bottomRightCorner(3, axes.cols()) = axes;
  for (std::size_t i = 0; i < d.size(); i++) N.row((Eigen::Index)i) = full.row(d[i]);
  return N;
}

} // namespace

/* Sets the least inertia of each body in the metric of assembly. If a body is far lighter than its neighbours, their
   coupling would be lost in Phi_q M^-1 Phi_q^T by rounding */
void FillLight(SceneData &s)
{
  double lightest = INFINITY, heaviest = 0, moment = 0;
  for (const BodyData &b : s.bodies) {
    if (b.mass > 0) lightest = std::min(lightest, b.mass);
    heaviest = std::max(heaviest, b.mass);
    if (!b.point) moment = std::max(moment, s.planar ? b.inertia(2, 2) : b.inertia.norm());
  }
  for (BodyData &b : s.bodies) {
    if (HasFullInertia(s, b)) {
      if (b.mass < least_mass_ratio * heaviest) b.light_mass = std::max(b.light_mass, least_mass_ratio * heaviest);
      if (!b.point && LeastMoment(s, b) < least_mass_ratio * moment) b.light_inertia = std::max(b.light_inertia, least_mass_ratio * moment);
      continue;
    }
    const double size = SceneSize(s);
    b.light_mass      = std::isfinite(lightest) ? light_mass_ratio * lightest : 1;
    b.light_inertia   = std::max(light_mass_ratio * (s.planar ? b.inertia(2, 2) : b.inertia.norm()), light_mass_ratio * (b.mass > 0 ? b.mass : b.light_mass) * (size > 0 ? size * size : 1));
  }
}

PetscErrorCode CheckInertia(const SceneData &s)
{
  std::vector<PetscInt>               first(s.bodies.size(), -1), of; /* first column of each body; body of each column */
  std::vector<Eigen::Triplet<double>> entries;
  std::vector<Eigen::MatrixXd>        N(s.bodies.size());
  PetscFunctionBegin;
  for (std::size_t b = 0; b < s.bodies.size(); b++) {
    if (HasFullInertia(s, s.bodies[b])) continue;
    N[b]     = MovementsWithoutInertia(s, s.bodies[b]);
    first[b] = (PetscInt)of.size();
    of.insert(of.end(), N[b].cols(), (PetscInt)b);
  }
  if (of.empty()) PetscFunctionReturn(0);
  int row = 0;
  for (const RowBlock &block : DescribeAll(s, s.start.time, FixedBodies::None)) {
    for (std::size_t k = 0; k < block.body.size(); k++) {
      const PetscInt b = block.body[k];
      if (first[b] < 0) continue;
      const Eigen::MatrixXd J = block.J.middleCols(block.column[k], N[b].rows()) * N[b];
      for (int r = 0; r < block.rows; r++)
        for (int c = 0; c < J.cols(); c++)
          if (J(r, c) != 0) entries.emplace_back(row + r, (int)first[b] + c, J(r, c));
    }
    row += block.rows;
  }
  Eigen::SparseMatrix<double> A(std::max(row, (int)of.size()), (int)of.size());
  A.setFromTriplets(entries.begin(), entries.end());
  for (int c = 0; c < A.cols(); c++)
    if (A.col(c).norm() > 0) A.col(c) /= A.col(c).norm();
  A.makeCompressed();
  Eigen::SparseQR<Eigen::SparseMatrix<double>, Eigen::COLAMDOrdering<int>> qr;
  qr.setPivotThreshold(rank_tolerance);
  qr.compute(A);
  if (qr.rank() == A.cols()) PetscFunctionReturn(0);
  const BodyData &b = s.bodies[of[qr.colsPermutation().indices()(qr.rank())]];
  SETERRQ(s.comm, PETSC_ERR_ARG_WRONG,
          "body %s moves in a way that has no inertia and that no joint or motion determines (%d such movements in the scene): give it mass and moments of inertia, hold it by "
          "joints, or make a body without moments a PointMass",
          b.name.c_str(), (int)(A.cols() - qr.rank()));
}

} // namespace hhtdae
