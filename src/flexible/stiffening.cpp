/* Geometric stiffening of a body in modal coordinates; see stiffening.h. */
#include "stiffening.h"
#include "flexible/assembly.h"
#include "flexible/body_check.h"
#include "flexible/element.h"
#include "flexible/exchange.h"
#include "scene/symmetric.h"
#include <algorithm>

namespace hhtdae
{

namespace
{

constexpr PetscInt loads_at_once     = 12; /* loads processed together: the geometry of an element is evaluated once for all of them */
constexpr int      velocity_products = 6;  /* loads by products of angular velocities: xx, yy, zz, xy, yz, zx */

PetscErrorCode CheckInput(const FeModel &model, const std::vector<Tied> &tied)
{
  long long elements = (long long)model.elements.size(), all;
  PetscFunctionBegin;
  PetscCallMPI(MPI_Allreduce(&elements, &all, 1, MPI_LONG_LONG, MPI_SUM, model.comm));
  PetscCheck(all, model.comm, PETSC_ERR_ARG_WRONG,
             "geometric stiffening needs elements, and the model from \"%s\" has matrices alone; read it from a mesh (FeModel::readMesh)", model.source.c_str());
  PetscCheck(!tied.empty(), model.comm, PETSC_ERR_ARG_WRONG, "geometric stiffening needs an attachment: nothing else holds the body while its loads are found");
  PetscCall(CheckElements(model, "geometric stiffening"));
  PetscFunctionReturn(0);
}

/* Centrifugal forces at own dofs, M (tr(S) - S) X with S = (e_c e_d^T + e_d e_c^T)/2 */
PetscErrorCode CentrifugalForces(const FeModel &model, const BodyScales &scales, MatrixXd *f)
{
  MatrixXd field(3 * model.own, velocity_products);

  PetscFunctionBegin;
  for (int p = 0; p < velocity_products; p++) {
    const int c = p % 3, d = p < 3 ? c : (c + 1) % 3;
    Matrix3   S = Matrix3::Zero();
    S(c, d) += 0.5;
    S(d, c) += 0.5;
    const Matrix3 outward = S.trace() * Matrix3::Identity() - S;
    for (PetscInt i = 0; i < model.own; i++) field.col(p).segment<3>(3 * i) = outward * (NodePosition(model, i) - scales.center);
  }
  PetscCall(Multiply(model.M, field, f));
  PetscFunctionReturn(0);
}

/* Motions of the attachments in the rigid motions scales.rigid */
MatrixXd RigidOfAttachments(const std::vector<Tied> &tied, const BodyScales &scales)
{
  MatrixXd motion(6 * tied.size(), 6);
  for (std::size_t a = 0; a < tied.size(); a++)
    motion.middleRows<6>(6 * a) << RigidMotion(tied[a].position, scales.center) * scales.frame, scales.frame.bottomRows<3>();
  return motion;
}

/* A solution of K u = f for the stiffness of the attachments, which is singular for six rigid motions */
MatrixXd SolveFree(const MatrixXd &K, const MatrixXd &f, double length)
{
  VectorXd unit(K.rows()); /* scales rotations by 1 / length, so that they are comparable with translations */
  for (Eigen::Index i = 0; i < K.rows(); i++) unit(i) = i % 6 < 3 ? 1 : 1 / length;
  const MatrixXd       A = unit.asDiagonal() * (0.5 * (K + K.transpose())) * unit.asDiagonal();
  const SymmetricEigen modes(A);
  const Eigen::Index   n = K.rows() - 6;
  if (n <= 0) return MatrixXd::Zero(f.rows(), f.cols());
  const auto V = modes.vectors.rightCols(n);
  return unit.asDiagonal() * (V * (V.transpose() * (unit.asDiagonal() * f)).cwiseQuotient(modes.values.tail(n).replicate(1, f.cols())));
}

/* T of sum t (phi x (phi x d))/2 = phi^T T phi/2 for the forces t of an attachment on its nodes at d from its point. The nodes of a rigid attachment are in no
   other one, so that t is the total reaction there; an average distributes the loads attachment_loads to its nodes. */
PetscErrorCode TieForces(const FeModel &model, const std::vector<Tied> &tied, const MatrixXd &t, const MatrixXd &attachment_loads, MatrixXd *ties)
{
  PetscFunctionBegin;
  ties->setZero(3 * (Eigen::Index)tied.size(), 3 * t.cols());
  for (std::size_t a = 0; a < tied.size(); a++)
    for (std::size_t i = 0; i < tied[a].node.size(); i++) {
      const PetscInt node = tied[a].node[i];
      const Vector3  d    = NodePosition(model, node) - tied[a].position;
      for (Eigen::Index l = 0; l < t.cols(); l++) {
        Vector3 force;
        if (tied[a].tie == Tie::Rigid) force = t.col(l).segment<3>(3 * node);
        else force = tied[a].row[i].transpose() * attachment_loads.col(l).segment<6>(6 * (Eigen::Index)a);
        ties->block<3, 3>(3 * (Eigen::Index)a, 3 * l) += 0.5 * (force * d.transpose() + d * force.transpose()) - force.dot(d) * Matrix3::Identity();
      }
    }
  PetscCall(SumOverRanks(model.comm, ties));
  PetscFunctionReturn(0);
}

/* Displacements at own dofs, one column per load: six products of angular velocities, then six loads of each attachment. ties: rows 3 a to 3 a + 2, columns
   3 l to 3 l + 2 are T of attachment a for load l. */
PetscErrorCode Displacements(const FeModel &model, const std::vector<Tied> &tied, const BodyScales &scales, MatrixXd *u, MatrixXd *ties)
{
  const PetscInt n = 6 * (PetscInt)tied.size();
  Interior       in;
  ScopedSolver   solver;
  MatrixXd       centrifugal, modes(3 * model.own, n), product, K, rigid, part, x;
  MatrixXd       f = MatrixXd::Zero(3 * model.own, velocity_products + n), attachment_loads = MatrixXd::Zero(n, velocity_products + n);

  PetscFunctionBegin;
  PetscCall(CreateInterior(model, tied, scales, &in));
  PetscCall(FactorInterior(model, in, scales, &solver.ksp));
  PetscCall(ConstraintModes(model, tied, in, solver.ksp, &modes));
  PetscCall(Multiply(model.K, modes, &product));
  K = modes.transpose() * product;
  PetscCall(SumOverRanks(model.comm, &K));

  PetscCall(CentrifugalForces(model, scales, &centrifugal));
  f.leftCols(velocity_products) = centrifugal;
  attachment_loads.rightCols(n).setIdentity();
  part = scales.rigid.transpose() * f; /* resultants, balanced by rigid accelerations */
  PetscCall(SumOverRanks(model.comm, &part));
  part += RigidOfAttachments(tied, scales).transpose() * attachment_loads;
  PetscCall(Multiply(model.M, scales.rigid, &rigid));
  f -= rigid * part;

  part = modes.transpose() * f;
  PetscCall(SumOverRanks(model.comm, &part));
  *u = modes * SolveFree(K, attachment_loads + part, scales.length);
  PetscCall(SolveBlock(solver.ksp, InteriorRows(in, f), &x));
  for (std::size_t i = 0; i < in.dof.size(); i++) u->row(in.dof[i]) += x.row((Eigen::Index)i);
  PetscCall(Multiply(model.K, *u, &product));
  PetscCall(TieForces(model, tied, product - f, attachment_loads, ties));
  PetscFunctionReturn(0);
}

/* Fetches the columns of x for all nodes of this rank's elements; three components for each column of a node */
PetscErrorCode FetchAtElements(const FeModel &model, const ElementNodes &nodes, const Eigen::Ref<const MatrixXd> &x, std::vector<double> *here)
{
  const Eigen::Index  width = x.cols(); /* 64 bits: products with numbers of nodes may overflow an int */
  std::vector<double> own(3 * width * model.own + 1);

  PetscFunctionBegin;
  here->resize(3 * width * nodes.global.size() + 1);
  for (PetscInt i = 0; i < model.own; i++)
    for (Eigen::Index k = 0; k < width; k++)
      for (int c = 0; c < 3; c++) own[3 * (i * width + k) + c] = x(3 * i + c, k);
  PetscCall(nodes.bring((int)(3 * width), own.data(), here->data()));
  PetscFunctionReturn(0);
}

/* Derivatives of the shape functions with respect to positions, and weights, at the integration points of an element's stiffness */
struct ElementSamples {
  std::vector<MatrixXd> G; /* 3 x nodes */
  std::vector<double>   weight;
  double                least = std::numeric_limits<double>::infinity();

  template <class Shape> ElementSamples(Shape, const fe::NodeVectors<Shape> &x)
  {
    using Rule           = typename Shape::StiffnessRule;
    const auto   &points = fe::Table<Shape, Rule>::get().points;
    for (int q = 0; q < Rule::count; q++) {
      fe::Gradients<Shape::nodes> g;
      const double                det = fe::SpatialGradients<Shape>(x, q, g);
      fe::Lower(least, det);
      G.push_back(g);
      weight.push_back(det * points.weight[q]);
    }
    least *= fe::InverseExtent<Shape>(x);
  }
};

/* Adds the integral of grad phi_k^T : (sigma grad phi_l^T) over the element, for each load */
void AddElement(const ElementSamples &s, const fe::Lame &lame, const std::vector<PetscInt> &place, const std::vector<double> &modes, Eigen::Index m, const std::vector<double> &u,
                Eigen::Index loads, std::vector<MatrixXd> *sum)
{
  const Eigen::Index n = (Eigen::Index)place.size();
  MatrixXd           shape[3], gradient(9, m), stressed(9, m);
  for (int c = 0; c < 3; c++) {
    shape[c].resize(n, m);
    for (Eigen::Index i = 0; i < n; i++)
      for (Eigen::Index k = 0; k < m; k++) shape[c](i, k) = modes[3 * (place[i] * m + k) + c];
  }
  for (std::size_t q = 0; q < s.G.size(); q++) {
    for (int c = 0; c < 3; c++) gradient.middleRows<3>(3 * c).noalias() = s.G[q] * shape[c];
    for (Eigen::Index l = 0; l < loads; l++) {
      Matrix3 D = Matrix3::Zero();
      for (Eigen::Index i = 0; i < n; i++) D += Eigen::Map<const Vector3>(&u[3 * (place[i] * loads + l)]) * s.G[q].col(i).transpose();
      const Matrix3 strain = 0.5 * (D + D.transpose());
      const Matrix3 stress = s.weight[q] * (lame.lambda * strain.trace() * Matrix3::Identity() + 2 * lame.mu * strain);
      for (int c = 0; c < 3; c++) stressed.middleRows<3>(3 * c).noalias() = stress * gradient.middleRows<3>(3 * c);
      (*sum)[l].noalias() += gradient.transpose() * stressed;
    }
  }
}

/* *place: local numbers of the element's nodes */
ElementSamples SampleElement(const FeElement &e, const ElementNodes &nodes, const std::vector<double> &X, std::vector<PetscInt> *place)
{
  return fe::WithShape(e.type, [&](auto shape) {
    fe::NodeVectors<decltype(shape)> x;
    place->resize(shape.nodes);
    for (int i = 0; i < shape.nodes; i++) {
      (*place)[i] = nodes.place(e.node[i]);
      x.col(i)    = Eigen::Map<const Vector3>(&X[3 * (*place)[i]]);
    }
    return ElementSamples(shape, x);
  });
}

} // namespace

PetscErrorCode ComputeStiffening(const FeModel &model, const std::vector<Tied> &tied, const BodyScales &scales, const Reduction &reduction,
                                 const MatrixXd &x, ModalBody *body)
{
  const PetscInt      m = (PetscInt)x.cols(), loads = velocity_products + 6 * (PetscInt)tied.size();
  ElementNodes        nodes;
  MatrixXd            u, ties, all(m, m * loads);
  std::vector<double> X, modes, displacements;
  std::string         problem;
  Phase               phase(model.comm, reduction.progress);

  PetscFunctionBegin;
  PetscCall(phase.begin("stiffening"));
  PetscCall(CheckInput(model, tied));
  PetscCall(Displacements(model, tied, scales, &u, &ties));
  PetscCall(nodes.setUp(model));
  X.resize(3 * nodes.global.size() + 1);
  PetscCall(nodes.bring(3, model.coordinates.data(), X.data()));
  PetscCall(FetchAtElements(model, nodes, x, &modes));
  for (PetscInt from = 0; from < loads; from += loads_at_once) {
    const PetscInt        count = std::min(loads_at_once, loads - from);
    std::vector<MatrixXd> sum(count, MatrixXd::Zero(m, m));
    PetscCall(FetchAtElements(model, nodes, u.middleCols(from, count), &displacements));
    for (const FeElement &e : model.elements) {
      std::vector<PetscInt> place;
      const ElementSamples  sampled = SampleElement(e, nodes, X, &place);
      AddElement(sampled, fe::Lame(model.materials[e.material]), place, modes, m, displacements, count, &sum);
      if (!(sampled.least > fe::degenerate)) problem = "geometric stiffening: an element has no volume or is turned inside out";
    }
    for (PetscInt l = 0; l < count; l++) all.middleCols(m * (from + l), m) = 0.5 * (sum[l] + sum[l].transpose());
  }
  PetscCall(Agree(model.comm, problem, PETSC_ERR_ARG_WRONG));
  PetscCall(SumOverRanks(model.comm, &all));
  for (std::size_t a = 0; a < tied.size(); a++)
    for (PetscInt l = 0; l < loads; l++) {
      const Eigen::Matrix<double, 3, Eigen::Dynamic> &phi = body->attachments[a].rotation;
      all.middleCols(m * l, m) += phi.transpose() * ties.block<3, 3>(3 * (Eigen::Index)a, 3 * l) * phi;
    }
  for (int p = 0; p < 6; p++) body->stiffening[p] = all.middleCols(m * p, m);
  for (std::size_t a = 0; a < tied.size(); a++)
    for (int c = 0; c < 6; c++) body->attachments[a].stiffening[c] = all.middleCols(m * (velocity_products + 6 * (PetscInt)a + c), m);
  PetscCall(phase.end(std::to_string(loads) + " loads"));
  PetscFunctionReturn(0);
}

} // namespace hhtdae
