/*
  Load cases of a reduction. A pressure p on a face with the positions x(s, t), outward normal along x_s x x_t, has the nodal forces

    f_a = - p int N_a x_s x x_t ds dt

  and, if it follows the surface, their derivatives df_a = - p int N_a (u_s x x_t + x_s x u_t) ds dt along a displacement u.
*/
#include "loads.h"
#include "attachments.h"
#include "assembly.h"
#include "element_shapes.h"
#include "exchange.h"
#include "kept_nodes.h"
#include <algorithm>
#include <array>
#include <set>

namespace hhtdae
{

namespace
{

using FaceKey = std::array<PetscInt, 4>; /* corners of a face, ascending */

template <class Shape> FaceKey FaceKeyOf(const FeElement &e, int f)
{
  FaceKey key{-1, -1, -1, -1};
  for (int i = 0; i < Shape::perface; i++) key[i] = e.node[Shape::face[f][i]];
  std::sort(key.begin(), key.end());
  return key;
}

/* Collects an element's faces whose nodes are all in the set; inside[a]: node a of the element is in it */
template <class Shape> void FacesInside(const FeElement &e, std::size_t number, const std::vector<char> &inside, std::vector<ResolvedLoad::ElementFace> *faces, std::vector<FaceKey> *keys)
{
  for (int f = 0; f < Shape::faces; f++) {
    bool corner[8] = {}, all = true;
    for (int i = 0; i < Shape::perface; i++) corner[Shape::face[f][i]] = true;
    for (int a = 0; a < Shape::nodes; a++) {
      const bool on = a < Shape::corners ? corner[a] : corner[Shape::edge[a - Shape::corners][0]] && corner[Shape::edge[a - Shape::corners][1]];
      all           = all && (!on || inside[a]);
    }
    if (!all) continue;
    faces->push_back({number, f});
    keys->push_back(FaceKeyOf<Shape>(e, f));
  }
}

/* The outer faces with all nodes in the set: faces shared by two elements are inside the body */
PetscErrorCode FindFaces(const FeModel &model, const ElementNodes &nodes, const LoadCase &load, std::vector<ResolvedLoad::ElementFace> *faces)
{
  std::vector<double>                    own(model.own + 1, 0.), here(nodes.global.size() + 1);
  std::vector<PetscInt>                  member;
  std::vector<ResolvedLoad::ElementFace> found;
  std::vector<FaceKey>                   keys, all;
  int                                    count;

  PetscFunctionBegin;
  PetscCall(OwnNodesOf(model, load.surface, "Load case " + load.name, &member));
  for (PetscInt i : member) own[i] = 1;
  PetscCall(nodes.bring(1, own.data(), here.data()));
  for (std::size_t e = 0; e < model.elements.size(); e++) {
    const FeElement  &element = model.elements[e];
    std::vector<char> inside;
    for (int a = 0; a < FeNodes(element.type); a++) inside.push_back(here[nodes.place(element.node[a])] > 0);
    fe::WithShape(element.type, [&](auto shape) { FacesInside<decltype(shape)>(element, e, inside, &found, &keys); });
  }
  PetscCall(GatherAll(model.comm, keys, &all));
  std::sort(all.begin(), all.end());
  for (std::size_t k = 0; k < found.size(); k++) {
    const auto range = std::equal_range(all.begin(), all.end(), keys[k]);
    if (range.second - range.first == 1) faces->push_back(found[k]);
  }
  count = (int)faces->size();
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &count, 1, MPI_INT, MPI_SUM, model.comm));
  PetscCheck(count, model.comm, PETSC_ERR_ARG_WRONG, "Load case %s: no outer face of the mesh has all of its nodes in the set '%s'", load.name.c_str(), load.surface.c_str());
  PetscFunctionReturn(0);
}

PetscErrorCode FindForces(const FeModel &model, const LoadCase &load, std::vector<ResolvedLoad::NodeForce> *forces)
{
  std::vector<PetscInt> own;

  PetscFunctionBegin;
  PetscCheck(load.force.size() == 3 * load.node.size(), model.comm, PETSC_ERR_ARG_SIZ, "Load case %s: %d numbers of force for %d nodes, must be three for each", load.name.c_str(),
             (int)load.force.size(), (int)load.node.size());
  for (double f : load.force) PetscCheck(std::isfinite(f), model.comm, PETSC_ERR_ARG_OUTOFRANGE, "Load case %s: a force is not finite", load.name.c_str());
  PetscCall(FindLabels(model, load.node, "Load case " + load.name, &own));
  for (std::size_t k = 0; k < own.size(); k++)
    if (own[k] >= 0) forces->push_back({own[k], Eigen::Map<const Vector3>(&load.force[3 * k])});
  PetscFunctionReturn(0);
}

/* ---- sums over nodes and faces ---- */

struct LoadSums {
  MatrixXd rigid; /* columns: force, moment */
  MatrixXd modal, moment_gradient, force_gradient, modal_gradient;

  LoadSums(PetscInt m, bool follows) : rigid(MatrixXd::Zero(3, 2)), modal(MatrixXd::Zero(m, 1)), moment_gradient(MatrixXd::Zero(3, m))
  {
    if (!follows) return;
    force_gradient.setZero(3, m);
    modal_gradient.setZero(m, m);
  }
  /* Adds a force f at the position y relative to the centre of mass, where the modes have the displacements phi */
  template <class Phi> void add(const Vector3 &f, const Vector3 &y, const Phi &phi)
  {
    rigid.col(0) += f;
    rigid.col(1) += y.cross(f);
    modal.noalias() += phi.transpose() * f;
    moment_gradient.noalias() -= Cross(f) * phi;
  }
};

/* An integration point of a face: the element's shape functions, their derivatives along the face, weight */
struct FacePoint {
  VectorXd N, s, t;
  double   weight;
};

/* 3 x 3 Gauss points; for triangles in coordinates that collapse one side of the square (Duffy), which is exact for polynomials of degree four */
template <class Shape> std::vector<FacePoint> PointsOf(int f)
{
  const double           x[3] = {-std::sqrt(.6), 0, std::sqrt(.6)}, w[3] = {5. / 9, 8. / 9, 5. / 9};
  const Vector3          c[3] = {Shape::place(Shape::face[f][0]), Shape::place(Shape::face[f][1]), Shape::place(Shape::face[f][Shape::perface - 1])};
  const Vector3          s = c[1] - c[0], t = c[2] - c[0];
  std::vector<FacePoint> points;
  for (int i = 0; i < 3; i++)
    for (int j = 0; j < 3; j++) {
      const double                u = (1 + x[i]) / 2, v = (1 + x[j]) / 2;
      const Vector3               at = c[0] + (Shape::perface == 3 ? u * (1 - v) : u) * s + v * t;
      fe::Values<Shape::nodes>    N;
      fe::Gradients<Shape::nodes> d;
      Shape::shape(at, N);
      Shape::gradient(at, d);
      points.push_back({N, d.transpose() * s, d.transpose() * t, w[i] * w[j] / 4 * (Shape::perface == 3 ? 1 - v : 1)});
    }
  return points;
}

void AddFace(const FeElement &e, const std::vector<FacePoint> &points, const ElementNodes &nodes, const std::vector<double> &X, const std::vector<double> &modes, Eigen::Index m,
             const Vector3 &center, LoadSums *sum)
{
  const PetscInt n = (PetscInt)points[0].N.size();
  MatrixXd       x(3, n), U(3, n * m), moved, changed; /* U: modes at node a in columns a m to (a + 1) m - 1 */
  for (PetscInt a = 0; a < n; a++) {
    const PetscInt place   = nodes.place(e.node[a]);
    x.col(a)               = Eigen::Map<const Vector3>(&X[3 * place]);
    U.middleCols(a * m, m) = Eigen::Map<const MatrixXd>(&modes[3 * m * place], 3, m);
  }
  const auto along = [&](const VectorXd &N) {
    MatrixXd u = MatrixXd::Zero(3, m);
    for (PetscInt a = 0; a < n; a++) u += N(a) * U.middleCols(a * m, m);
    return u;
  };
  const bool follows = sum->modal_gradient.size() > 0;
  if (follows) {
    moved.resize(3 * (Eigen::Index)points.size(), m);
    changed.resize(3 * (Eigen::Index)points.size(), m);
  }
  for (std::size_t q = 0; q < points.size(); q++) {
    const FacePoint &p  = points[q];
    const Vector3    xs = x * p.s, xt = x * p.t, y = x * p.N - center;
    const MatrixXd   phi = along(p.N);
    sum->add(-p.weight * xs.cross(xt), y, phi);
    if (!follows) continue;
    const MatrixXd df = p.weight * (Cross(xt) * along(p.s) - Cross(xs) * along(p.t));
    sum->force_gradient += df;
    sum->moment_gradient.noalias() += Cross(y) * df;
    moved.middleRows<3>(3 * (Eigen::Index)q)   = phi;
    changed.middleRows<3>(3 * (Eigen::Index)q) = df;
  }
  if (follows) sum->modal_gradient.noalias() += moved.transpose() * changed;
}

/* Adds the pressure on all faces. The modes are fetched for all nodes of the elements, three components for each mode of a node. */
PetscErrorCode AddFaces(const FeModel &model, const ResolvedLoad &load, const BodyScales &scales, const MatrixXd &x, LoadSums *sum)
{
  const Eigen::Index     m = x.cols(); /* 64 bits: products with numbers of nodes may overflow an int */
  ElementNodes           nodes;
  std::vector<FeElement> elements;
  std::vector<double>    X, own(3 * m * model.own + 1), modes;

  PetscFunctionBegin;
  for (const auto &f : load.faces) elements.push_back(model.elements[f.element]);
  PetscCall(nodes.setUp(model, elements));
  X.resize(3 * nodes.global.size() + 1);
  modes.resize(3 * m * nodes.global.size() + 1);
  for (PetscInt i = 0; i < model.own; i++) Eigen::Map<MatrixXd>(&own[3 * m * i], 3, m) = x.middleRows<3>(3 * i);
  PetscCall(nodes.bring(3, model.coordinates.data(), X.data()));
  if (m) PetscCall(nodes.bring((int)(3 * m), own.data(), modes.data()));
  for (const auto &f : load.faces) {
    const FeElement &e = model.elements[f.element];
    AddFace(e, fe::WithShape(e.type, [&](auto shape) { return PointsOf<decltype(shape)>(f.face); }), nodes, X, modes, m, scales.center, sum);
  }
  PetscFunctionReturn(0);
}

} // namespace

PetscErrorCode ResolveLoads(const FeModel &model, const std::vector<LoadCase> &loads, std::vector<ResolvedLoad> *resolved)
{
  std::set<std::string> names;
  ElementNodes          nodes;
  long long             elements = (long long)model.elements.size();

  PetscFunctionBegin;
  resolved->assign(loads.size(), ResolvedLoad());
  if (loads.empty()) PetscFunctionReturn(0);
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &elements, 1, MPI_LONG_LONG, MPI_SUM, model.comm));
  PetscCall(nodes.setUp(model));
  for (std::size_t k = 0; k < loads.size(); k++) {
    const LoadCase &l = loads[k];
    PetscCheck(!l.name.empty() && names.insert(l.name).second, model.comm, PETSC_ERR_ARG_WRONG, "Load case %d has no name, or that of another one: '%s'", (int)k, l.name.c_str());
    PetscCheck(l.surface.empty() != l.node.empty(), model.comm, PETSC_ERR_ARG_WRONG, "Load case %s: give either a surface for a pressure, or nodes with forces", l.name.c_str());
    PetscCheck(l.surface.empty() || elements, model.comm, PETSC_ERR_ARG_WRONG,
               "Load case %s: pressure needs elements, and the model from \"%s\" has matrices alone; give the forces on the nodes", l.name.c_str(), model.source.c_str());
    if (l.surface.empty()) PetscCall(FindForces(model, l, &(*resolved)[k].forces));
    else PetscCall(FindFaces(model, nodes, l, &(*resolved)[k].faces));
  }
  PetscFunctionReturn(0);
}

PetscErrorCode FillLoads(const FeModel &model, const std::vector<LoadCase> &loads, const std::vector<ResolvedLoad> &resolved, const BodyScales &scales,
                         const MatrixXd &x, ModalBody *body)
{
  const PetscInt m = (PetscInt)x.cols();

  PetscFunctionBegin;
  body->loads.clear();
  for (std::size_t k = 0; k < loads.size(); k++) {
    LoadSums      sum(m, !loads[k].surface.empty() && loads[k].follows);
    ModalLoadCase l;
    for (const auto &f : resolved[k].forces) sum.add(f.force, NodePosition(model, f.node) - scales.center, x.middleRows<3>(3 * f.node));
    if (!loads[k].surface.empty()) PetscCall(AddFaces(model, resolved[k], scales, x, &sum));
    for (MatrixXd *A : {&sum.rigid, &sum.modal, &sum.moment_gradient, &sum.force_gradient, &sum.modal_gradient}) PetscCall(SumOverRanks(model.comm, A));
    l.name            = loads[k].name;
    l.force           = sum.rigid.col(0);
    l.moment          = sum.rigid.col(1);
    l.modal           = sum.modal;
    l.moment_gradient = sum.moment_gradient;
    if (sum.modal_gradient.size()) {
      l.force_gradient = sum.force_gradient;
      l.modal_gradient = sum.modal_gradient;
    }
    body->loads.push_back(l);
  }
  PetscFunctionReturn(0);
}

} // namespace hhtdae
