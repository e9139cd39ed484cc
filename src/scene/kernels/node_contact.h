/*
  Contact of kept nodes of a flexible body, as balls, with one shape on a marker of another body: Contact<Shape> (contact.h)
  for every node, without attachments' frames at the nodes.

  A ball moves with its node and rotates with the floating frame: x = r + A (s + Phi eta). Nodes that cannot touch are
  excluded by an upper bound on the displacement of all nodes by the modes, sum_k |eta_k| max |phi_k|; the product with the
  modes is computed only for the other nodes. X and V are the derivatives of (x, theta) and (v, w) by the body's position,
  angles and modes; K and C are the derivatives of the wrench by (x, theta) and (v, w). The matrix of a node is

    - L^T (K X + C V) - d(L^T (f, m))/dq for fixed (f, m),    L: X without the factor Bodies::inStep() of rotations
*/
#ifndef HHTDAE_SCENE_KERNELS_NODE_CONTACT_H
#define HHTDAE_SCENE_KERNELS_NODE_CONTACT_H

#include "contact.h"
#include "hhtdae/modal.h"
#include "scene/blocks.h"
#include <memory>

namespace hhtdae
{

/* Constant data, shared by all runs */
struct ContactNodes {
  std::shared_ptr<const ModalBody> model; /* keeps the modes of the nodes alive */
  std::vector<const ModalNode *>   node;
  Eigen::Matrix3Xd                 place; /* undeformed positions relative to the centre of mass, body axes */
  Eigen::VectorXd                  reach; /* for each mode: largest displacement of a node per unit of the modal coordinate */
};
std::shared_ptr<const ContactNodes> MakeContactNodes(std::shared_ptr<const ModalBody> model, const std::vector<PetscInt> &place);

/* One element on this rank without its shape, which NodeContactBatch has */
class NodesOnBody
{
public:
  PetscInt                            body = -1, j = -1; /* local numbers of the flexible body and of the marker of the shape */
  std::shared_ptr<const ContactNodes> nodes;

  struct Ball {
    const Eigen::Matrix<double, 3, Eigen::Dynamic> *phi;
    Frame<double>                                   f[2];
    Twist<double>                                   w[2];
    /* position relative to the body's origin, and velocity due to the modes, in space axes */
    Vector3                                         arm, rate;
  };
  /* Upper bound on the displacement of all nodes by the deformation */
  double slack(const Evaluation &ev) const;
  Ball   ball(const Evaluation &ev, std::size_t k, const Frame<double> &fj, const Twist<double> &wj) const;
  void   load(Evaluation &ev, const Ball &b, const Wrench<double> *on) const;

  /* ---- the matrix; the functions are in the order in which they are called for each instance ---- */
  void pattern(const Bodies &B, Pattern &p, std::vector<PetscInt> &request) const;
  /* Sums over the balls that touch */
  struct Matrices {
    /* three columns per ball, with spare capacity: the transposed rows of L for its position, and of - (K X + C V) for
       the force on it */
    Eigen::MatrixXd left, right;
    Eigen::MatrixXd own, by_j, rate_j; /* own: other terms of the body's own block; by_j, rate_j: columns x, theta and v, w of j's body */
    Eigen::MatrixXd of_j;              /* rows of j's body */
    Six             jj, jj_rate;
    int             count = 0;
  };
  void begin(const Evaluation &ev, Matrices &M) const;
  void add(const Evaluation &ev, const Ball &b, const Bodies::AngularGradient &g, const Wrench<double> *on, const ForceJacobian<2, 0> &J, Matrices &M) const;
  void deliver(Evaluation &ev, Matrices &M, const Slot *&slot) const; /* adds nothing if no ball touches */

private:
  BodyKind kindOfJ(const Bodies &B) const { return B.body[B.marker[j].body].kind; }
};

/* Tests for each shape of the other body: whether a ball within the distance `slack` of an undeformed place can touch the shape */
class NearPlane
{
public:
  NearPlane(const SpherePlaneShape::Data &d, const Vector3 &r, const Matrix3 &A, const Frame<double> &f, double slack)
    : g_(A.transpose() * f.R.col(d.axis)), most_(d.radius + slack - f.R.col(d.axis).dot(r - f.x))
  {
  }
  bool operator()(const Vector3 &s) const { return g_.dot(s) < most_; }

private:
  Vector3 g_;
  double  most_;
};
class NearSphere
{
public:
  NearSphere(const SphereSphereShape::Data &d, const Vector3 &r, const Matrix3 &A, const Frame<double> &f, double slack)
    : c_(A.transpose() * (f.x - r)), most_(d.radius_i + d.radius_j + slack)
  {
  }
  bool operator()(const Vector3 &s) const { return (s - c_).squaredNorm() < most_ * most_; }

private:
  Vector3 c_;
  double  most_;
};
template <class Shape> struct NearOf;
template <> struct NearOf<SpherePlaneShape> {
  using Test = NearPlane;
  /* no bound: the matter below the plane has no other side */
  static double through(const SpherePlaneShape::Data &) { return std::numeric_limits<double>::infinity(); }
};
template <> struct NearOf<SphereSphereShape> {
  using Test = NearSphere;
  static double through(const SphereSphereShape::Data &d) { return 0.5 * (d.radius_i + d.radius_j); }
};

template <class Shape> class NodeContactBatch : public Batch
{
  using Kernel = Contact<Shape>;
  using Near   = NearOf<Shape>;

public:
  struct Instance {
    NodesOnBody           on;
    typename Kernel::Data data;
    bool                  mine; /* whether this rank adds its energy to the balance */
  };
  std::vector<Instance> all;

  void pattern(Pattern &p) override
  {
    for (const Instance &e : all) e.on.pattern(*bodies, p, request_);
  }
  Bodies *bodies = nullptr;

  /* Calls f(ball) for the nodes that may touch */
  template <class F> static void nearOnes(const Evaluation &ev, const Instance &e, F f)
  {
    const Frame<double>       fj   = ev.bodies.template frame<true>(e.on.j);
    const Twist<double>       wj   = ev.bodies.twist(e.on.j, fj);
    const BodyMotion         &b    = ev.bodies.now[e.on.body];
    const ContactNodes       &n    = *e.on.nodes;
    const typename Near::Test near(e.data.shape, b.r, b.A, fj, e.on.slack(ev));
    for (std::size_t k = 0; k < n.node.size(); k++)
      if (near(n.place.col((Eigen::Index)k))) f(e.on.ball(ev, k, fj, wj));
  }

  void residual(Evaluation &ev) override
  {
    for (const Instance &e : all)
      nearOnes(ev, e, [&](const NodesOnBody::Ball &b) {
        Wrench<double> on[2];
        Touch<double>  t;
        if (!Kernel::template touches<double>(e.data, b.f, t)) return;
        Kernel::wrench(e.data, b.f, b.w, ev.t, nullptr, on);
        e.on.load(ev, b, on);
      });
  }

  void jacobian(Evaluation &ev) override
  {
    const Slot *slot = slot_.data();
    for (const Instance &e : all) {
      const Bodies::AngularGradient g = ev.bodies.byAngles(e.on.body, ev.v, ev.a, ev.sv, ev.sa);
      M_.count                        = 0;
      nearOnes(ev, e, [&](const NodesOnBody::Ball &b) {
        Wrench<double>      on[2];
        ForceJacobian<2, 0> J;
        Touch<double>       t;
        if (!Kernel::template touches<double>(e.data, b.f, t)) return;
        Kernel::jacobian(e.data, b.f, b.w, ev.t, nullptr, on, J);
        e.on.load(ev, b, on);
        e.on.add(ev, b, g, on, J, M_);
      });
      e.on.deliver(ev, M_, slot);
    }
  }

  double energy(const Evaluation &ev) const override
  {
    double sum = 0;
    for (const Instance &e : all)
      if (e.mine) nearOnes(ev, e, [&](const NodesOnBody::Ball &b) { sum += Kernel::energy(e.data, b.f); });
    return sum;
  }

  /* As in contact.h, except that the allowed penetration is up to the centres of both balls, because a small ball may be deep in a large one */
  bool   limitsSteps() const override { return !all.empty() && std::isfinite(Near::through(all[0].data.shape)); }
  double longestStep(const Evaluation &ev, const Horizon &) const override
  {
    double least = std::numeric_limits<double>::infinity();
    for (const Instance &e : all) {
      const double        most = Near::through(e.data.shape);
      const Frame<double> fj   = ev.bodies.template frame<true>(e.on.j);
      const Twist<double> wj   = ev.bodies.twist(e.on.j, fj);
      const PetscInt      bj   = ev.bodies.marker[e.on.j].body;
      const double        both = ev.bodies.acceleration(bj, ev.v, ev.a).norm() + ev.bodies.acceleration(e.on.body, ev.v, ev.a).norm();
      for (std::size_t k = 0; k < e.on.nodes->node.size() && std::isfinite(most); k++) {
        const NodesOnBody::Ball b = e.on.ball(ev, k, fj, wj);
        Touch<double>           t;
        Shape::template touch<double>(e.data.shape, b.f, t);
        const double way     = std::max(most - t.depth, 0.25 * most);
        const double closing = -t.n.dot(Kernel::template slip<double>(b.f, b.w, t.p)), speed = closing + std::sqrt(closing * closing + 2 * both * way);
        if (speed > 0) least = std::min(least, 2 * way / speed);
      }
    }
    return least;
  }

private:
  NodesOnBody::Matrices M_; /* scratch */
};

} // namespace hhtdae

#endif
