/*
  Constraints between nodes of a finite-element body and frames, for a frame at r with axes A, y_n = x_n - r and arms A a_n:

    rigid:     x_n - r - A a_n = 0 for every node; with FeLaw::Small x_n - r - a_n - s x a_n = 0, where s is the linearized rotation of the frame since its start:
               an exact rotation would strain a face by half of its square, which the linear K resists
    average:   sum w_n (y_n - A a_n) = 0,  sum w_n A d_n x y_n = 0,  d_n = a_n - c with the mean arm c = sum w_n a_n
*/
#include "flexible/full_nodes.h"
#include "scene/runtime.h"

namespace hhtdae
{

namespace
{

/* [a], the matrix of the cross product a x */
Matrix3 Skew(const Vector3 &a) { return Cross<double>(a); }

/* Base of the batches of ties: access to the frames */
class TieBatch : public Batch
{
protected:
  Bodies *bodies_;
  explicit TieBatch(Bodies *b) : bodies_(b) {}
  PetscInt          frameGroup(PetscInt marker) const { return bodies_->body[bodies_->marker[marker].body].group; }
  const BodyMotion &frame(const Bodies &B, PetscInt marker) const { return B.now[B.marker[marker].body]; }
  static BodyMotion &loaded(Bodies &B, PetscInt marker) { return B.now[B.marker[marker].body]; }
};

/* Linearized rotation: s has the direction of the axis of the rotation matrix B and the length of the sine of its angle; a further small rotation w changes s by D w */
struct LinearizedRotation {
  Matrix3 B, D;
  Vector3 s;
  explicit LinearizedRotation(const Matrix3 &b) : B(b), D((b.trace() * Matrix3::Identity() - b) / 2), s(b(2, 1) - b(1, 2), b(0, 2) - b(2, 0), b(1, 0) - b(0, 1)) { s /= 2; }
};

class RigidTies : public TieBatch
{
public:
  struct Instance {
    NodePlace       node;
    PetscInt        lambda, group, marker;
    Vector3         arm;
    const FullBody *body;
  };
  std::vector<Instance> all;

  explicit RigidTies(Bodies *b) : TieBatch(b) {}

  void pattern(Pattern &p) override
  {
    for (const Instance &e : all) {
      const PetscInt f = frameGroup(e.marker);
      for (PetscInt g : {e.node.group, f, f + 1}) {
        request_.push_back(p.need(e.group, g, g != f + 1));
        request_.push_back(p.need(g, e.group, g != f + 1));
      }
      request_.push_back(p.need(f + 1, f + 1));
    }
  }

  void residual(Evaluation &ev) override
  {
    for (const Instance &e : all) {
      const BodyMotion &b   = frame(ev.bodies, e.marker);
      const Vector3     phi = At(ev.u, e.node) - b.r - Arm(e, b).at;
      for (int c = 0; c < 3; c++) ev.row(e.lambda + c, phi(c));
      AddRows(ev, e.node, load(ev, e));
    }
  }

  void jacobian(Evaluation &ev) override
  {
    const Slot   *slot = slot_.data();
    const Matrix3 one  = Matrix3::Identity();
    for (const Instance &e : all) {
      const BodyMotion &b = frame(ev.bodies, e.marker);
      const Vector3     l = load(ev, e);
      const Arm         arm(e, b);
      const Matrix3     G = b.G, turn = -arm.by_turn * G;
      for (double sign : {1., -1.}) {
        ev.sink.add(*slot++, Matrix3(sign * one), 3, 3);
        ev.sink.add(*slot++, Matrix3(sign * one), 3, 3);
      }
      ev.sink.add(*slot++, Matrix3(turn * ev.bodies.inStep(b)), 3, 3);
      ev.sink.add(*slot++, Matrix3(turn.transpose()), 3, 3);
      ev.sink.add(*slot++, Matrix3(-G.transpose() * arm.momentByTurn(l) * G * ev.bodies.inStep(b)), 3, 3);
    }
  }

private:
  /* The arm from the frame's origin to the node, and its derivative by a small rotation of the frame; a force l at the node has the moment by_turn^T l */
  struct Arm {
    Vector3            at, start;
    Matrix3            by_turn;
    bool               linear;
    LinearizedRotation turn;

    Arm(const Instance &e, const BodyMotion &b)
      : start(e.body->rotation * e.arm), linear(e.body->law == FeLaw::Small), turn(linear ? Matrix3(b.A * e.body->rotation.transpose()) : Matrix3(Matrix3::Identity()))
    {
      at      = linear ? Vector3(start + turn.s.cross(start)) : Vector3(b.A * e.arm);
      by_turn = linear ? Matrix3(-Skew(start) * turn.D) : Matrix3(-Skew(at));
    }
    Matrix3 momentByTurn(const Vector3 &l) const
    {
      if (!linear) return Skew(l) * Skew(at);
      const Vector3 c = start.cross(l);
      return -c * turn.s.transpose() - turn.B.transpose() * Skew(c) / 2;
    }
  };

  static Vector3 load(Evaluation &ev, const Instance &e)
  {
    BodyMotion   &b = loaded(ev.bodies, e.marker);
    const Vector3 l = Eigen::Map<const Vector3>(ev.u + e.lambda);
    b.f += l;
    b.m += Arm(e, b).by_turn.transpose() * l;
    return l;
  }
};

class AverageTies : public TieBatch
{
public:
  struct Instance {
    std::vector<NodePlace> node;
    std::vector<double>    w;
    std::vector<Vector3>   d; /* arms relative to the mean arm */
    Vector3                c; /* the mean arm */
    PetscInt               lambda, group, marker;
  };
  std::vector<Instance> all;

  explicit AverageTies(Bodies *b) : TieBatch(b) {}

  void pattern(Pattern &p) override
  {
    const auto both = [&](PetscInt g, PetscInt h) {
      request_.push_back(p.need(g, h));
      request_.push_back(p.need(h, g));
    };
    for (const Instance &e : all) {
      const PetscInt f = frameGroup(e.marker);
      for (const NodePlace &n : e.node) {
        both(e.group, n.group);
        both(f + 1, n.group);
      }
      both(e.group, f);
      both(e.group, f + 1);
      request_.push_back(p.need(f + 1, f + 1));
    }
  }

  void residual(Evaluation &ev) override
  {
    for (const Instance &e : all) {
      const BodyMotion &b = frame(ev.bodies, e.marker);
      Vector3           t = -b.A * e.c, turn = Vector3::Zero();
      for (std::size_t i = 0; i < e.node.size(); i++) {
        const Vector3 y = At(ev.u, e.node[i]) - b.r;
        t += e.w[i] * y;
        turn += e.w[i] * (b.A * e.d[i]).cross(y);
        AddRows(ev, e.node[i], e.w[i] * (force(ev, e) + moment(ev, e).cross(b.A * e.d[i])));
      }
      for (int c = 0; c < 3; c++) {
        ev.row(e.lambda + c, t(c));
        ev.row(e.lambda + 3 + c, turn(c));
      }
      load(ev, e);
    }
  }

  void jacobian(Evaluation &ev) override
  {
    using Six        = Eigen::Matrix<double, 6, 3>;
    const Slot *slot = slot_.data();
    const auto  both = [&](const auto &B, int rows, int columns) {
      ev.sink.add(*slot++, B, rows, columns);
      ev.sink.add(*slot++, B.transpose(), columns, rows);
    };
    for (const Instance &e : all) {
      const BodyMotion &b = frame(ev.bodies, e.marker);
      const Vector3     l = force(ev, e), m = moment(ev, e), c = b.A * e.c;
      const Matrix3     G = b.G;
      Matrix3           turn = Matrix3::Zero(), second = -Skew(l) * Skew(c);
      Six               B;
      load(ev, e);
      for (std::size_t i = 0; i < e.node.size(); i++) {
        const Vector3 d = b.A * e.d[i], y = At(ev.u, e.node[i]) - b.r;
        turn += e.w[i] * Skew(y) * Skew(d);
        second += e.w[i] * Skew(y.cross(m)) * Skew(d);
        B << e.w[i] * Matrix3::Identity(), e.w[i] * Skew(d);
        both(B, 6, 3);
        const Matrix3 by_node = -e.w[i] * G.transpose() * Skew(d) * Skew(m);
        ev.sink.add(*slot++, by_node, 3, 3);
        ev.sink.add(*slot++, Matrix3(by_node.transpose() * ev.bodies.inStep(b)), 3, 3);
      }
      B << -Matrix3::Identity(), Matrix3::Zero();
      both(B, 6, 3);
      B << Skew(c) * G, turn * G;
      ev.sink.add(*slot++, Six(B * ev.bodies.inStep(b)), 6, 3);
      ev.sink.add(*slot++, B.transpose(), 3, 6);
      ev.sink.add(*slot++, Matrix3(G.transpose() * second * G * ev.bodies.inStep(b)), 3, 3);
    }
  }

private:
  static Vector3 force(const Evaluation &ev, const Instance &e) { return Eigen::Map<const Vector3>(ev.u + e.lambda); }
  static Vector3 moment(const Evaluation &ev, const Instance &e) { return Eigen::Map<const Vector3>(ev.u + e.lambda + 3); }

  static void load(Evaluation &ev, const Instance &e)
  {
    BodyMotion   &b = loaded(ev.bodies, e.marker);
    const Vector3 l = force(ev, e), m = moment(ev, e);
    b.f += l;
    b.m += (b.A * e.c).cross(l);
    for (std::size_t i = 0; i < e.node.size(); i++) b.m -= e.w[i] * (b.A * e.d[i]).cross((At(ev.u, e.node[i]) - b.r).cross(m));
  }
};

bool IsNeededHere(const FullExtension &x, const Localizer &l, Marker frame, PetscMPIInt owner)
{
  const Runtime &R = *l.run;
  return owner == R.rank || R.number.owner.empty() || R.number.owner[R.scene.markers[frame.id].body] == R.rank || x.node_first.size() == 2;
}

void AddRigidTies(const FullExtension &x, const TieNodes &t, Localizer &l, RigidTies &batch)
{
  for (std::size_t i = 0; i < t.node.size(); i++) {
    const PetscMPIInt owner = x.ownerOf(t.node[i]);
    if (!IsNeededHere(x, l, t.frame, owner)) continue;
    RigidTies::Instance e;
    const PetscInt      number = x.multiplier(owner, t.lambda[i]);
    e.node   = PlaceNode(x, l, t.node[i]);
    e.group  = l.group(number, 3);
    e.lambda = l.local(number);
    e.marker = l.marker(t.frame.id);
    e.arm    = t.arm[i];
    e.body   = &x.spec;
    batch.all.push_back(e);
  }
}

void AddAverageTie(const FullExtension &x, const TieNodes &t, Localizer &l, AverageTies &batch)
{
  bool here = IsNeededHere(x, l, t.frame, t.owner);
  for (PetscInt n : t.node) here = here || x.ownerOf(n) == l.run->rank;
  if (!here) return;
  AverageTies::Instance e;
  const PetscInt        number = x.multiplier(t.owner, t.first);
  e.c = Vector3::Zero();
  for (std::size_t i = 0; i < t.node.size(); i++) e.c += t.weight[i] * t.arm[i];
  for (std::size_t i = 0; i < t.node.size(); i++) {
    e.node.push_back(PlaceNode(x, l, t.node[i]));
    e.w.push_back(t.weight[i]);
    e.d.push_back(t.arm[i] - e.c);
  }
  e.group  = l.group(number, 6);
  e.lambda = l.local(number);
  e.marker = l.marker(t.frame.id);
  batch.all.push_back(e);
}

} // namespace

void LocalizeTies(const FullExtension &x, Localizer &l, std::vector<std::unique_ptr<Batch>> &batches)
{
  auto rigid   = std::make_unique<RigidTies>(l.bodies);
  auto average = std::make_unique<AverageTies>(l.bodies);
  for (const TieNodes &t : x.ties) {
    if (t.tie == Tie::Rigid) AddRigidTies(x, t, l, *rigid);
    else AddAverageTie(x, t, l, *average);
  }
  if (!rigid->all.empty()) batches.push_back(std::move(rigid));
  if (!average->all.empty()) batches.push_back(std::move(average));
}

} // namespace hhtdae
