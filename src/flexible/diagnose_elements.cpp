/*
  Whether a model's elements make its matrices, node by node: the mass that goes with each node, and the forces of a uniform strain. A deck of CalculiX has more in
  its matrices than the elements that are kept: springs, point masses, wedges, materials that are not isotropic.
*/
#include "body_check.h"
#include "diagnose_nodes.h"
#include "flexible/assembly.h"
#include "flexible/element.h"
#include "flexible/element_shapes.h"
#include "flexible/exchange.h"
#include "flexible/modes.h"

namespace hhtdae
{

/* Part of the sizes of the elements' contributions to a node. Points of integration other than ours, as of reduced elements, differ on elements that are bent or
   far from parallelepipeds (Calculix.ElementsThatAreNotAllOfTheModel) */
constexpr double other_points = 0.1;

namespace
{

/* Any strain: displacements are strain X */
Matrix3 Strain() { return (Matrix3() << 1, .3, -.2, .3, -.7, .5, -.2, .5, .4).finished(); }

/* Of a node: mass, force, and the sums of the absolute values of what they are made of */
constexpr int width = 8;

template <class Shape> void AddElement(const FeModel &model, const FeElement &e, const ElementNodes &nodes, const std::vector<double> &X, std::vector<double> *sum)
{
  const Material          &material = model.materials[e.material];
  const fe::Lame           lame(material);
  const Matrix3            stress = lame.lambda * Strain().trace() * Matrix3::Identity() + 2 * lame.mu * Strain();
  const auto               points = Shape::StiffnessRule::points();
  fe::NodeVectors<Shape>   x, f = fe::NodeVectors<Shape>::Zero();
  fe::Mass<Shape>          m;
  for (int i = 0; i < Shape::nodes; i++) x.col(i) = Eigen::Map<const Vector3>(&X[3 * nodes.place(e.node[i])]);
  fe::ElementMass<Shape>(x, material.density, m);
  for (int q = 0; q < Shape::StiffnessRule::count; q++) {
    fe::Gradients<Shape::nodes> G;
    const double                det = fe::SpatialGradients<Shape>(x, q, G);
    f += points.weight[q] * det * stress * G;
  }
  for (int i = 0; i < Shape::nodes; i++) {
    double *to = &(*sum)[width * nodes.place(e.node[i])];
    to[0] += m.row(i).sum();
    to[1] += std::abs(m.row(i).sum());
    for (int c = 0; c < 3; c++) to[2 + c] += f(c, i);
    for (int c = 0; c < 3; c++) to[5 + c] += std::abs(f(c, i));
  }
}

/* The same of the matrices: M 1 in the first column, K strain X in the second */
PetscErrorCode OfMatrices(const FeModel &model, MatrixXd *of)
{
  MatrixXd field(3 * model.own, 1), product;
  PetscFunctionBegin;
  of->setZero(3 * model.own, 2);
  field.setOnes();
  PetscCall(Multiply(model.M, field, &product));
  of->col(0) = product;
  for (PetscInt i = 0; i < model.own; i++) field.block<3, 1>(3 * i, 0) = Strain() * NodePosition(model, i);
  if (model.K) {
    PetscCall(Multiply(model.K, field, &product));
    of->col(1) = product;
  }
  PetscFunctionReturn(0);
}

} // namespace

PetscErrorCode CheckElements(const FeModel &model, const std::string &who)
{
  ElementNodes          nodes;
  std::vector<double>   X, here, own(width * model.own + 1, 0.);
  std::vector<PetscInt> bad;
  MatrixXd              of;
  std::string           problem, labels;
  PetscInt              count;
  PetscFunctionBegin;
  for (const FeElement &e : model.elements)
    if (e.material < 0 || e.material >= (PetscInt)model.materials.size())
      problem = who + ": an element has material " + std::to_string(e.material) + " of " + std::to_string(model.materials.size());
  PetscCall(Agree(model.comm, problem, PETSC_ERR_ARG_WRONG));
  PetscCall(nodes.setUp(model));
  X.resize(3 * nodes.global.size() + 1);
  here.assign(width * nodes.global.size() + 1, 0.);
  PetscCall(nodes.bring(3, model.coordinates.data(), X.data()));
  for (const FeElement &e : model.elements) fe::WithShape(e.type, [&](auto shape) { AddElement<decltype(shape)>(model, e, nodes, X, &here); });
  PetscCall(nodes.add(width, here.data(), own.data()));
  PetscCall(OfMatrices(model, &of));
  double largest = 0; /* force: what rounding leaves where all cancels */
  for (PetscInt i = 0; i < 3 * model.own; i++) largest = std::max(largest, own[width * (i / 3) + 5 + i % 3]);
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &largest, 1, MPI_DOUBLE, MPI_MAX, model.comm));
  for (PetscInt i = 0; i < model.own; i++) {
    const double *made = &own[width * i];
    bool          same = std::abs(of(3 * i, 0) - made[0]) <= other_points * made[1];
    const double  size = made[5] + made[6] + made[7];
    for (int c = 0; c < 3 && model.K; c++) same = same && std::abs(of(3 * i + c, 1) - made[2 + c]) <= other_points * size + 1e-8 * largest;
    if (!same) bad.push_back(i);
  }
  PetscCall(NameNodes(model, bad, &count, &labels));
  PetscCheck(!count, model.comm, PETSC_ERR_ARG_WRONG,
             "%s needs all of the FE model as tetrahedra and bricks of isotropic material, but at %" PetscInt_FMT
             " node(s) the matrices from \"%s\" have more or less mass or stiffness than the elements: %s. Springs, point masses, wedges and other materials are "
             "in the matrices alone",
             who.c_str(), count, model.source.c_str(), labels.c_str());
  PetscFunctionReturn(0);
}

} // namespace hhtdae
