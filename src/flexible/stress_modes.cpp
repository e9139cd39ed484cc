/*
  Stress modes: the stress at nodes for each mode of a reduced body.

  Stress is extrapolated from the elements' points of best accuracy (element.h) and averaged over the elements of one material
  at a node. Where materials meet, stress is discontinuous; the node then has the average over the elements of the stiffest
  material, which usually carries the higher stress. The choice must not depend on the modal coordinates, because stress
  has to be linear in them.
*/
#include "flexible/assembly.h"
#include "flexible/element.h"
#include "flexible/exchange.h"
#include "flexible/sides.h"
#include <algorithm>
#include <numeric>

namespace hhtdae
{

namespace
{

constexpr PetscInt modes_at_once = 16; /* modes processed together: the geometry of an element is evaluated once for all of them */

PetscErrorCode CheckInput(const FeModel &model, const ReducedBody &body)
{
  long long   elements = (long long)model.elements.size(), all;
  std::string problem;
  PetscFunctionBegin;
  PetscCallMPI(MPI_Allreduce(&elements, &all, 1, MPI_LONG_LONG, MPI_SUM, model.comm));
  PetscCheck(
      all, model.comm, PETSC_ERR_ARG_WRONG,
      "stress needs elements, and the model from \"%s\" has matrices alone; read it from a mesh (FeModel::readMesh)",
      model.source.c_str());
  if (body.shape.rows() != 3 * model.own)
    problem = "stress needs the modes at all nodes: the body has " + std::to_string(body.shape.rows()) +
              " rows of them on a rank with " + std::to_string(model.own) +
              " nodes of the model; reduce with all_nodes = true, and from this model";
  else if (body.shape.cols() != body.modal.modes())
    problem = "the body has " + std::to_string(body.modal.modes()) + " modes, but " +
              std::to_string(body.shape.cols()) + " columns of their shapes";
  if (problem.empty() && body.coordinates.size() == model.coordinates.size()) {
    const Eigen::Map<const Eigen::VectorXd> was(body.coordinates.data(), (Eigen::Index)body.coordinates.size()), is(model.coordinates.data(), (Eigen::Index)model.coordinates.size());
    if (was.size() && (was - is).cwiseAbs().maxCoeff() > 1e-6 * is.cwiseAbs().maxCoeff()) problem = "the nodes of the model from \"" + model.source + "\" are not where those of the body were: stress needs the model that was reduced";
  }
  if (problem.empty() && (int)model.materials.size() == 0)
    problem = "stress needs the materials of the elements, and the model has none";
  for (const FeElement &e : model.elements)
    if (problem.empty() && (e.material < 0 || e.material >= (PetscInt)model.materials.size()))
      problem =
          "an element has material " + std::to_string(e.material) + " of " + std::to_string(model.materials.size());
  PetscCall(Agree(model.comm, problem, PETSC_ERR_ARG_WRONG));
  PetscFunctionReturn(0);
}

} // namespace

PetscErrorCode ChooseSides(const FeModel &model, const ElementNodes &nodes, Sides *sides)
{
  const PetscInt        count = (PetscInt)model.materials.size();
  std::vector<PetscInt> order(count), place(count);
  PetscFunctionBegin;
  /* materials by ascending Young's modulus */
  std::iota(order.begin(), order.end(), 0);
  std::stable_sort(order.begin(), order.end(),
                   [&](PetscInt a, PetscInt b) { return model.materials[a].young < model.materials[b].young; });
  for (PetscInt k = 0; k < count; k++) place[order[k]] = k;
  std::vector<PetscInt> here(nodes.global.size() + 1, -1), own(model.own + 1, -1);
  for (const FeElement &e : model.elements)
    for (int i = 0; i < FeNodes(e.type); i++) {
      PetscInt &h = here[nodes.place(e.node[i])];
      h           = std::max(h, place[e.material]);
    }
  PetscCall(PetscSFReduceBegin(nodes.sf, MPIU_INT, here.data(), own.data(), MPI_MAX));
  PetscCall(PetscSFReduceEnd(nodes.sf, MPIU_INT, here.data(), own.data(), MPI_MAX));
  PetscCall(PetscSFBcastBegin(nodes.sf, MPIU_INT, own.data(), here.data(), MPI_REPLACE));
  PetscCall(PetscSFBcastEnd(nodes.sf, MPIU_INT, own.data(), here.data(), MPI_REPLACE));
  sides->material.resize(nodes.global.size());
  for (std::size_t n = 0; n < nodes.global.size(); n++) sides->material[n] = order[here[n]];

  std::vector<double> around(nodes.global.size() + 1, 0);
  for (const FeElement &e : model.elements)
    for (int i = 0; i < FeNodes(e.type); i++) {
      const PetscInt n = nodes.place(e.node[i]);
      if (sides->material[n] == e.material) around[n]++;
    }
  sides->count.assign(model.own + 1, 0);
  PetscCall(nodes.add(1, around.data(), sides->count.data()));
  PetscFunctionReturn(0);
}

namespace
{

/* Adds an element's stress to its nodes; u and stress have `modes_at_once` columns per node */
template <class Shape>
double AddStress(const FeModel &model, const FeElement &e, const ElementNodes &nodes, const Sides &sides,
                 const std::vector<double> &X, const std::vector<double> &u, PetscInt modes,
                 std::vector<double> &stress)
{
  constexpr int          n = Shape::nodes;
  PetscInt               place[n];
  fe::NodeVectors<Shape> x, v;
  fe::NodeStress<Shape>  at;
  const fe::Lame         lame(model.materials[e.material]);
  for (int i = 0; i < n; i++) {
    place[i] = nodes.place(e.node[i]);
    x.col(i) = Eigen::Map<const Eigen::Vector3d>(&X[3 * place[i]]);
  }
  const fe::StressAtNodes<Shape> kernel(x);
  for (PetscInt k = 0; k < modes; k++) {
    for (int i = 0; i < n; i++) v.col(i) = Eigen::Map<const Eigen::Vector3d>(&u[3 * (place[i] * modes_at_once + k)]);
    kernel(v, lame, at);
    for (int i = 0; i < n; i++)
      if (sides.material[place[i]] == e.material)
        Eigen::Map<Eigen::Matrix<double, 6, 1>>(&stress[6 * (place[i] * modes_at_once + k)]) += at.col(i);
  }
  return kernel.least();
}

/* Modes from .. from + count - 1 */
PetscErrorCode SomeModes(const FeModel &model, const ElementNodes &nodes, const Sides &sides,
                         const std::vector<double> &X, PetscInt from, PetscInt count, ReducedBody *body)
{
  std::vector<double> own(3 * modes_at_once * (model.own + 1), 0), u(3 * modes_at_once * (nodes.global.size() + 1), 0);
  std::vector<double> sum(6 * modes_at_once * (model.own + 1), 0), stress(6 * modes_at_once * (nodes.global.size() + 1), 0);
  std::string         problem;
  PetscFunctionBegin;
  for (PetscInt k = 0; k < count; k++)
    for (PetscInt n = 0; n < model.own; n++)
      for (int d = 0; d < 3; d++) own[3 * (n * modes_at_once + k) + d] = body->shape(3 * n + d, from + k);
  PetscCall(nodes.bring(3 * modes_at_once, own.data(), u.data()));
  for (const FeElement &e : model.elements) {
    const double least = fe::WithShape(
        e.type, [&](auto shape) { return AddStress<decltype(shape)>(model, e, nodes, sides, X, u, count, stress); });
    if (!(least > fe::degenerate)) problem = "stress: an element has no volume or is turned inside out";
  }
  PetscCall(Agree(model.comm, problem, PETSC_ERR_ARG_WRONG));
  PetscCall(nodes.add(6 * modes_at_once, stress.data(), sum.data()));
  for (PetscInt k = 0; k < count; k++)
    for (std::size_t i = 0; i < body->stress.node.size(); i++) {
      const PetscInt n = body->stress.node[i];
      for (int d = 0; d < 6; d++)
        body->stress.values(6 * i + d, from + k) = sum[6 * (n * modes_at_once + k) + d] / sides.count[n];
    }
  PetscFunctionReturn(0);
}

} // namespace

PetscErrorCode AddStressModes(const FeModel &model, ReducedBody *body)
{
  ElementNodes nodes;
  Sides        sides;
  PetscFunctionBegin;
  PetscCall(CheckInput(model, *body));
  PetscCall(nodes.setUp(model));
  std::vector<double> X(3 * nodes.global.size() + 1);
  PetscCall(nodes.bring(3, model.coordinates.data(), X.data()));
  PetscCall(ChooseSides(model, nodes, &sides));
  body->stress.node.clear();
  for (PetscInt n = 0; n < model.own; n++) /* nodes without elements, as those of springs, have no stress */
    if (sides.count[n] > 0) body->stress.node.push_back(n);
  const PetscInt modes = body->modal.modes();
  body->stress.values.resize(6 * body->stress.node.size(), modes);
  for (PetscInt k = 0; k < modes; k += modes_at_once)
    PetscCall(SomeModes(model, nodes, sides, X, k, std::min(modes_at_once, modes - k), body));
  PetscFunctionReturn(0);
}

} // namespace hhtdae
