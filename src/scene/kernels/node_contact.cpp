#include "node_contact.h"
#include <petscblaslapack.h>

namespace hhtdae
{

std::shared_ptr<const ContactNodes> MakeContactNodes(std::shared_ptr<const ModalBody> model, const std::vector<PetscInt> &place)
{
  auto n   = std::make_shared<ContactNodes>();
  n->model = model;
  n->place.resize(3, (Eigen::Index)place.size());
  n->reach = Eigen::VectorXd::Zero(model->modes());
  for (PetscInt i : place) {
    const ModalNode &node                           = model->nodes[i];
    n->place.col((Eigen::Index)n->node.size()) = node.position - model->center;
    n->node.push_back(&node);
    n->reach = n->reach.cwiseMax(node.translation.colwise().norm().transpose());
  }
  return n;
}

double NodesOnBody::slack(const Evaluation &ev) const
{
  return nodes->reach.dot(Eigen::Map<const Eigen::VectorXd>(ev.u + ev.bodies.body[body].first + 6, nodes->reach.size()).cwiseAbs());
}

NodesOnBody::Ball NodesOnBody::ball(const Evaluation &ev, std::size_t k, const Frame<double> &fj, const Twist<double> &wj) const
{
  const BodyMotion                       &b     = ev.bodies.now[body];
  const PetscInt                          first = ev.bodies.body[body].first + 6;
  const Eigen::Map<const Eigen::VectorXd> eta(ev.u + first, nodes->reach.size()), rate(ev.v + first, nodes->reach.size());
  Ball                                    x;
  x.phi    = &nodes->node[k]->translation;
  x.arm    = b.A * (nodes->place.col((Eigen::Index)k) + *x.phi * eta);
  x.rate   = b.A * (*x.phi * rate);
  x.f[0].x = b.r + x.arm;
  x.f[0].R = b.A;
  x.f[1]   = fj;
  x.w[0]   = {b.v + b.w.cross(x.arm) + x.rate, b.w};
  x.w[1]   = wj;
  return x;
}

void NodesOnBody::load(Evaluation &ev, const Ball &x, const Wrench<double> *on) const
{
  BodyMotion &b = ev.bodies.now[body];
  b.f += on[0].f;
  b.m += on[0].m + x.arm.cross(on[0].f);
  ev.bodies.modal[ev.bodies.body[body].modal].load += x.phi->transpose() * (b.A.transpose() * on[0].f);
  ev.bodies.load(j, x.f[1], on[1].f, on[1].m);
}

/* Requests the blocks of the flexible body; then those with rows of this body and columns of j's body, and the reverse; then those of j's body */
void NodesOnBody::pattern(const Bodies &B, Pattern &p, std::vector<PetscInt> &request) const
{
  const PetscInt g    = B.body[body].group, h = B.body[B.marker[j].body].group;
  const BodyKind kind = kindOfJ(B);
  const int      n    = Groups(kind);
  for (int a = 0; a < 3; a++)
    for (int c = 0; c < 3; c++) request.push_back(p.need(g + a, g + c));
  for (int c = 0; c < n; c++)
    for (int a = 0; a < 3; a++) {
      request.push_back(p.need(g + a, h + c));
      request.push_back(p.need(h + c, g + a));
    }
  for (int a = 0; a < n; a++)
    for (int c = 0; c < n; c++) request.push_back(p.need(h + a, h + c));
  for (int c = 0; c < 2 && kind == BodyKind::Attached; c++) {
    for (int a = 0; a < 3; a++) request.push_back(p.need(g + a, h + first_rate_group + c));
    for (int a = 0; a < 2; a++) request.push_back(p.need(h + a, h + first_rate_group + c));
  }
}

void NodesOnBody::begin(const Evaluation &ev, Matrices &M) const
{
  const Eigen::Index n = 6 + ev.bodies.modes(body);
  M.left.resize(n, 24);
  M.right.resize(n, 24);
  M.own.setZero(n, n);
  M.by_j.setZero(n, 6);
  M.rate_j.setZero(n, 6);
  M.of_j.setZero(6, n);
  M.jj.setZero();
  M.jj_rate.setZero();
}

void NodesOnBody::add(const Evaluation &ev, const Ball &x, const Bodies::AngularGradient &g, const Wrench<double> *on, const ForceJacobian<2, 0> &J, Matrices &M) const
{
  const BodyMotion  &b = ev.bodies.now[body];
  const int          m = ev.bodies.modes(body);
  const Matrix3      E = Cross<double>(x.arm), W = Cross<double>(b.w), F = Cross<double>(on[0].f);
  if (!M.count++) begin(ev, M);
  const Eigen::MatrixXd APhi = b.A * *x.phi;
  Eigen::MatrixXd       L = Eigen::MatrixXd::Zero(6, 6 + m), X = L, V = L;
  L.topLeftCorner<3, 3>().setIdentity();
  L.block<3, 3>(0, 3)    = -E * b.G;
  L.block<3, 3>(3, 3)    = b.G;
  L.topRightCorner(3, m) = APhi;
  X                      = L;
  X.block<3, 3>(0, 3)    = -E * g.G;
  X.block<3, 3>(3, 3)    = g.G;
  V.topLeftCorner<3, 3>() = ev.sv * Matrix3::Identity();
  V.block<3, 3>(0, 3)     = -E * g.w - (W * E + Cross<double>(x.rate)) * g.G;
  V.block<3, 3>(3, 3)     = g.w;
  V.topRightCorner(3, m)  = W * APhi + ev.sv * APhi;

  const Eigen::Index column = 3 * (M.count - 1);
  if (column + 3 > M.left.cols()) {
    M.left.conservativeResize(Eigen::NoChange, 2 * M.left.cols());
    M.right.conservativeResize(Eigen::NoChange, 2 * M.right.cols());
  }
  const Eigen::MatrixXd wrench = -(J.frames.topLeftCorner<6, 6>() * X + J.twists.topLeftCorner<6, 6>() * V);
  M.left.middleCols<3>(column)  = L.topRows<3>().transpose();
  M.right.middleCols<3>(column) = wrench.topRows<3>().transpose();
  M.own.middleRows<3>(3) += b.G.transpose() * wrench.bottomRows<3>();
  M.own.block<3, 3>(3, 3) -= b.G.transpose() * F * E * g.G;
  M.own.block(3, 6, 3, m) += b.G.transpose() * F * APhi;
  M.own.block(6, 3, m, 3) -= APhi.transpose() * F * g.G;

  const BodyKind kind = kindOfJ(ev.bodies);
  if (!Groups(kind)) return;
  Six T = Six::Zero(), turned = Six::Zero(), A = -J.frames.topRightCorner<6, 6>(), C = -J.twists.topRightCorner<6, 6>();
  ev.bodies.columns(j, x.f[1], Six(Six::Identity()), T);
  ev.bodies.columns(j, x.f[1], A, turned);
  ev.bodies.inStep(j, turned);
  ev.bodies.velocityColumns(j, x.f[1], ev.v, ev.sv, C, turned);
  M.by_j.noalias() += L.transpose() * turned;
  M.of_j.noalias() -= T.transpose() * (J.frames.bottomLeftCorner<6, 6>() * X + J.twists.bottomLeftCorner<6, 6>() * V);
  A = -J.frames.bottomRightCorner<6, 6>();
  const Six Cjj = -J.twists.bottomRightCorner<6, 6>();
  M.jj += PairBlock(ev, j, x.f[1], j, x.f[1], A, &Cjj);
  AddLever(ev.bodies, j, x.f[1], -on[1].f, M.jj);
  if (kind != BodyKind::Attached) return;
  M.rate_j.noalias() += L.transpose() * (C * T);
  M.jj_rate += PairBlock(ev, j, x.f[1], j, x.f[1], Cjj);
}

void NodesOnBody::deliver(Evaluation &ev, Matrices &M, const Slot *&slot) const
{
  const BodyKind kind = kindOfJ(ev.bodies);
  const int      n = Groups(kind), m = ev.bodies.modes(body), at[3] = {0, 3, 6}, size[3] = {3, 3, m};
  const auto     offset = [&](int g) { return GroupOffset(kind, g); };
  const auto     width  = [&](int g) { return GroupSize(kind, g); };
  if (!M.count) {
    slot += 9 + 6 * n + n * n + (kind == BodyKind::Attached ? 10 : 0);
    return;
  }
  const PetscBLASInt order = 6 + m, columns = 3 * M.count;
  const double       one   = 1;
  BLASgemm_("N", "T", &order, &order, &columns, &one, M.left.data(), &order, M.right.data(), &order, &one, M.own.data(), &order);
  for (int a = 0; a < 3; a++)
    for (int c = 0; c < 3; c++) ev.sink.add(*slot++, M.own.block(at[a], at[c], size[a], size[c]), size[a], size[c]);
  for (int c = 0; c < n; c++)
    for (int a = 0; a < 3; a++) {
      ev.sink.add(*slot++, M.by_j.block(at[a], offset(c), size[a], width(c)), size[a], width(c));
      ev.sink.add(*slot++, M.of_j.block(offset(c), at[a], width(c), size[a]), width(c), size[a]);
    }
  for (int a = 0; a < n; a++)
    for (int c = 0; c < n; c++) AddBlock(ev.sink, *slot++, M.jj, kind, a, kind, c);
  for (int c = 0; c < 2 && kind == BodyKind::Attached; c++) {
    for (int a = 0; a < 3; a++) ev.sink.add(*slot++, M.rate_j.block(at[a], 3 * c, size[a], 3), size[a], 3);
    for (int a = 0; a < 2; a++) AddBlock(ev.sink, *slot++, M.jj_rate, kind, a, kind, c);
  }
}

} // namespace hhtdae
