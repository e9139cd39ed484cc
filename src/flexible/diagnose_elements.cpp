/*
  Checks node by node whether a model's elements yield its matrices: by the mass of each node, and its force for a uniform strain. The matrices of a CalculiX deck may contain
  more than the elements that are read: springs, point masses, wedges, materials that are not isotropic.
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

/* Tolerance relative to the sum of the absolute values of the elements' contributions to a node: with other integration points, as those of reduced elements, mass and force
   differ on elements with curved edges or far from parallelepipeds (Calculix.ElementsThatAreNotAllOfTheModel) */
constexpr double integration_tolerance = 0.1;

namespace
{

/* An arbitrary uniform strain; displacements are Strain() X */
Matrix3 Strain() { return (Matrix3() << 1, .3, -.2, .3, -.7, .5, -.2, .5, .4).finished(); }

/* mass, |mass|, force (3), |force| (3), where |.| is the sum of the absolute values of the elements' contributions */
constexpr int values_per_node = 8;

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
    double *to = &(*sum)[values_per_node * nodes.place(e.node[i])];
    to[0] += m.row(i).sum();
    to[1] += std::abs(m.row(i).sum());
    for (int c = 0; c < 3; c++) to[2 + c] += f(c, i);
    for (int c = 0; c < 3; c++) to[5 + c] += std::abs(f(c, i));
  }
}

/* Mass and force from the matrices: M 1 in the first column, K Strain() X in the second */
PetscErrorCode SumsOfMatrices(const FeModel &model, MatrixXd *of_matrices)
{
  MatrixXd field(3 * model.own, 1), product;
  PetscFunctionBegin;
  of_matrices->setZero(3 * model.own, 2);
  field.setOnes();
  PetscCall(Multiply(model.M, field, &product));
  of_matrices->col(0) = product;
  for (PetscInt i = 0; i < model.own; i++) field.block<3, 1>(3 * i, 0) = Strain() * NodePosition(model, i);
  if (model.K) {
    PetscCall(Multiply(model.K, field, &product));
    of_matrices->col(1) = product;
  }
  PetscFunctionReturn(0);
}

} // namespace

PetscErrorCode CheckElements(const FeModel &model, const std::string &who)
{
  ElementNodes          nodes;
  std::vector<double>   X, here, own(values_per_node * model.own + 1, 0.);
  std::vector<PetscInt> bad;
  MatrixXd              of_matrices;
  std::string           problem, labels;
  PetscInt              count;
  PetscFunctionBegin;
  for (const FeElement &e : model.elements)
    if (e.material < 0 || e.material >= (PetscInt)model.materials.size())
      problem = who + ": an element has material " + std::to_string(e.material) + " of " + std::to_string(model.materials.size());
  PetscCall(Agree(model.comm, problem, PETSC_ERR_ARG_WRONG));
  PetscCall(nodes.setUp(model));
  X.resize(3 * nodes.global.size() + 1);
  here.assign(values_per_node * nodes.global.size() + 1, 0.);
  PetscCall(nodes.bring(3, model.coordinates.data(), X.data()));
  for (const FeElement &e : model.elements) fe::WithShape(e.type, [&](auto shape) { AddElement<decltype(shape)>(model, e, nodes, X, &here); });
  PetscCall(nodes.add(values_per_node, here.data(), own.data()));
  PetscCall(SumsOfMatrices(model, &of_matrices));
  double largest = 0; /* largest |force|: scale of the rounding that remains where contributions cancel */
  for (PetscInt i = 0; i < 3 * model.own; i++) largest = std::max(largest, own[values_per_node * (i / 3) + 5 + i % 3]);
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &largest, 1, MPI_DOUBLE, MPI_MAX, model.comm));
  for (PetscInt i = 0; i < model.own; i++) {
    const double *of_elements = &own[values_per_node * i];
    bool          same        = std::abs(of_matrices(3 * i, 0) - of_elements[0]) <= integration_tolerance * of_elements[1];
    const double  size        = of_elements[5] + of_elements[6] + of_elements[7];
    for (int c = 0; c < 3 && model.K; c++) same = same && std::abs(of_matrices(3 * i + c, 1) - of_elements[2 + c]) <= integration_tolerance * size + 1e-8 * largest;
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
