#include "attach.h"
#include "kernels/primitives_axes.h"
#include "runtime.h"

namespace hhtdae
{

SmallTurn::SmallTurn(const Vector3 &p) : phi(p)
{
  const double s = p.squaredNorm();
  if (s < 1e-2) {
    a  = 1. / 2 - s * (1. / 24 - s * (1. / 720 - s * (1. / 40320 - s / 3628800)));
    b  = 1. / 6 - s * (1. / 120 - s * (1. / 5040 - s * (1. / 362880 - s / 39916800)));
    as = -1. / 24 + s * (1. / 360 - s * (1. / 13440 - s / 907200));
    bs = -1. / 120 + s * (1. / 2520 - s * (1. / 120960 - s / 9979200));
    return;
  }
  const double angle = std::sqrt(s), sine = std::sin(angle) / angle, cosine = std::cos(angle);
  a  = (1 - cosine) / s;
  b  = (1 - sine) / s;
  as = (0.5 * sine - a) / s;
  bs = (-0.5 * (cosine - sine) / s - b) / s;
}

Matrix3 SmallTurn::momentGradient(const Vector3 &n) const
{
  const Vector3 pn = phi.cross(n);
  return a * Cross<double>(n) - 2 * as * pn * phi.transpose() + 2 * bs * phi.cross(pn) * phi.transpose() +
         b * (phi.dot(n) * Matrix3::Identity() + phi * n.transpose() - 2 * n * phi.transpose());
}

AttachedPoint::AttachedPoint(const ModalAttachment &a, const Eigen::Ref<const Eigen::VectorXd> &eta) : by_modes(6, a.translation.cols())
{
  by_modes << a.translation, a.rotation;
  motion = by_modes * eta;
  for (int c = 0; c < 6 && a.stiffening[0].size(); c++) {
    const Eigen::VectorXd bend = a.stiffening[c] * eta;
    motion(c) -= 0.5 * eta.dot(bend);
    by_modes.row(c) -= bend.transpose();
  }
}

namespace
{

constexpr int rows_of_attachment = 6;

/* Frame of the point that follows the modes, which move it by x and turn it by phi in body axes */
Frame<double> Deformed(const Vector3 &r, const Matrix3 &A, const Vector3 &s, const Vector3 &x, const SmallTurn &turn)
{
  return {r + A * (s + x), A * turn.rotation()};
}

/* Rows x_i - x_e, then the axes' products */
void Value(const Frame<double> &e, const Frame<double> &i, double *phi)
{
  const Frame<double> f[2] = {e, i};
  for (int c = 0; c < 3; c++) phi[c] = i.x(c) - e.x(c);
  Orient::value<double>(Empty(), f, 0, phi + 3);
}

/* All attachments of one flexible body: products with their modes are made for all of them at once */
struct Carrier {
  PetscInt        body = -1, count = 0;
  Eigen::MatrixXd rest, shapes; /* padded modes x 6 count: derivatives of translations of all attachments, then rotations; at rest, if that differs */
  Eigen::VectorXd motion, load; /* of all points, in the same order: from the modes, and on the modes */
  Eigen::VectorXd modes, bend;  /* padded scratch */
  std::vector<const Eigen::MatrixXd *> stiffening; /* of each column, null: none; empty: of all */

  auto   translation(PetscInt k) { return shapes.middleCols<3>(3 * k); }
  auto   rotation(PetscInt k) { return shapes.middleCols<3>(3 * (count + k)); }
  auto   rotations() { return shapes.rightCols(3 * count); }
  auto   x(PetscInt k) { return motion.segment<3>(3 * k); }
  auto   phi(PetscInt k) { return motion.segment<3>(3 * (count + k)); }
  auto   force(PetscInt k) { return load.segment<3>(3 * k); }
  auto   moment(PetscInt k) { return load.segment<3>(3 * (count + k)); }
};

class AttachBatch : public Batch
{
public:
  struct Instance {
    PetscInt               body, frame; /* local bodies */
    const ModalAttachment *attachment;
    Vector3                s; /* undeformed, from the frame's origin */
    PetscInt               lambda, group;
    PetscInt               carrier, place; /* which one of it */
  };
  std::vector<Instance> all;
  std::vector<Carrier>  carriers;
  Bodies               *bodies = nullptr;

  void finish()
  {
    std::vector<PetscInt> of(bodies->body.size(), -1);
    for (Instance &e : all) {
      if (e.body < 0) return; /* while others' bodies are collected */
      if (of[e.body] < 0) {
        of[e.body] = (PetscInt)carriers.size();
        carriers.emplace_back();
        carriers.back().body = e.body;
      }
      e.carrier = of[e.body];
      e.place   = carriers[e.carrier].count++;
    }
    for (Carrier &c : carriers) size(c);
    for (const Instance &e : all) {
      Carrier  &c = carriers[e.carrier];
      const int m = bodies->modes(e.body);
      c.translation(e.place).topRows(m) = e.attachment->translation.transpose();
      c.rotation(e.place).topRows(m)    = e.attachment->rotation.transpose();
      if (c.body < bodies->own) bodies->modal[bodies->body[c.body].modal].outer.left = c.rotations();
      if (e.attachment->stiffening[0].size()) addStiffening(e, c);
    }
    for (Carrier &c : carriers)
      if (!c.stiffening.empty()) c.rest = c.shapes;
  }

  void pattern(Pattern &p) override
  {
    for (const Instance &e : all) {
      const PetscInt b = bodies->body[e.body].group, i = bodies->body[e.frame].group;
      for (PetscInt g : {b, b + 1, b + 2, i, i + 1}) {
        request_.push_back(p.need(e.group, g));
        request_.push_back(p.need(g, e.group));
      }
      request_.push_back(p.need(b + 1, b + 1));
      request_.push_back(p.need(b + 1, i + 1));
      request_.push_back(p.need(i + 1, b + 1));
      request_.push_back(p.need(i + 1, i + 1));
      request_.push_back(p.need(i + 1, b + 2));
      request_.push_back(p.need(b + 2, i + 1));
    }
  }

  void residual(Evaluation &ev) override
  {
    move(ev);
    for (const Instance &e : all) {
      State  s(ev, e, carriers[e.carrier]);
      double phi[rows_of_attachment];
      Value(s.e, s.i, phi);
      for (int r = 0; r < rows_of_attachment; r++) ev.row(e.lambda + r, phi[r]);
      load(ev.bodies, e, s, carriers[e.carrier]);
    }
    loadModes(ev.bodies);
  }

  void jacobian(Evaluation &ev) override
  {
    const Slot *slot = slot_.data();
    move(ev);
    for (const Carrier &c : carriers)
      if (ModalPart &p = ev.bodies.modal[ev.bodies.body[c.body].modal]; c.body < ev.bodies.own) p.outer.right.resize(c.shapes.rows(), 3 * c.count);
    for (const Instance &e : all) {
      Carrier &c = carriers[e.carrier];
      State    s(ev, e, c);
      load(ev.bodies, e, s, c);
      gradientBlocks(ev, e, s, c, slot);
      curvatureBlocks(ev, e, s, c, slot);
    }
    turn(ev.bodies);
    for (const Carrier &c : carriers)
      if (c.body < ev.bodies.own && !c.stiffening.empty()) stiffen(c, ev.bodies.modal[ev.bodies.body[c.body].modal]);
  }

private:
  using Wide = Eigen::Matrix<double, rows_of_attachment, Eigen::Dynamic, Eigen::RowMajor>;
  using Tall = Eigen::Matrix<double, Eigen::Dynamic, 3>;
  Wide              wide_; /* scratch */
  Tall              tall_;
  std::vector<Tall> turned_; /* of each carrier: by the points' motions, the moment on the body */

  struct State {
    Frame<double>    e, i;
    SmallTurn        turn;
    Matrix<3, 12>    J;      /* of the axes' rows */
    const double    *lambda;
    Vector3          f, m;   /* J^T lambda on the point of the flexible body */

    State(const Evaluation &ev, const Instance &a, Carrier &on) : turn(on.phi(a.place)), lambda(ev.u + a.lambda)
    {
      const BodyMotion &b = ev.bodies.now[a.body], &c = ev.bodies.now[a.frame];
      e = Deformed(b.r, b.A, a.s, on.x(a.place), turn);
      i = {c.r, c.A};
      const Frame<double> frames[2] = {e, i};
      Orient::gradient(Empty(), frames, 0, J);
      f = -Vector3(lambda[0], lambda[1], lambda[2]);
      m = J.middleCols<3>(3).transpose() * Vector3(lambda[3], lambda[4], lambda[5]);
    }
  };

  static void addStiffening(const Instance &e, Carrier &c)
  {
    c.stiffening.resize(6 * c.count);
    for (int k = 0; k < 3; k++) {
      c.stiffening[3 * e.place + k]             = &e.attachment->stiffening[k];
      c.stiffening[3 * (c.count + e.place) + k] = &e.attachment->stiffening[3 + k];
    }
  }

  /* d(shapes load)/deta for the load that has been found */
  static void stiffen(const Carrier &c, ModalPart &p)
  {
    p.stiffening.setZero(p.dynamics->modes(), p.dynamics->modes());
    for (std::size_t k = 0; k < c.stiffening.size(); k++)
      if (c.stiffening[k]) p.stiffening -= c.load(k) * *c.stiffening[k];
    p.outer.left = c.shapes.rightCols(3 * c.count);
  }

  /* Motions less (eta^T B eta)/2, and their derivatives; c.modes holds eta */
  static void bend(Carrier &c, int m)
  {
    for (std::size_t k = 0; k < c.stiffening.size(); k++) {
      if (!c.stiffening[k]) continue;
      c.bend.noalias() = *c.stiffening[k] * c.modes.head(m);
      c.motion(k) -= 0.5 * c.bend.dot(c.modes.head(m));
      c.shapes.col(k).head(m) = c.rest.col(k).head(m) - c.bend;
    }
  }

  void size(Carrier &c)
  {
    c.shapes.setZero(ModalProducts::padded(bodies->modes(c.body)), 6 * c.count);
    c.modes.setZero(c.shapes.rows());
    c.motion.setZero(6 * c.count);
    c.load.setZero(6 * c.count);
    turned_.emplace_back(6 * c.count, 3);
  }

  void move(const Evaluation &ev)
  {
    for (Carrier &c : carriers) {
      const int m     = ev.bodies.modes(c.body);
      c.modes.head(m) = Eigen::Map<const Eigen::VectorXd>(ev.u + ev.bodies.body[c.body].first + 6, m);
      c.modes.tail(c.modes.size() - m).setZero();
      const Eigen::MatrixXd &at_rest = c.stiffening.empty() ? c.shapes : c.rest;
      ModalProducts::transposedTimes((int)at_rest.rows(), (int)at_rest.cols(), at_rest.data(), c.modes.data(), c.motion.data());
      if (!c.stiffening.empty()) bend(c, m);
    }
  }

  static void load(Bodies &B, const Instance &e, const State &s, Carrier &c)
  {
    BodyMotion &b = B.now[e.body], &i = B.now[e.frame];
    b.f -= s.f;
    b.m -= s.m + (s.e.x - b.r).cross(s.f);
    c.force(e.place)  = b.A.transpose() * s.f;
    c.moment(e.place) = s.turn.J().transpose() * (b.A.transpose() * s.m);
    i.f += s.f;
    i.m += s.m; /* the axes' rows turn both alike */
  }

  void loadModes(Bodies &B)
  {
    for (Carrier &c : carriers) {
      ModalProducts::times((int)c.shapes.rows(), (int)c.shapes.cols(), c.shapes.data(), c.load.data(), c.modes.data());
      B.modal[B.body[c.body].modal].load -= c.modes.head(B.modes(c.body));
    }
  }

  void turn(Bodies &B)
  {
    for (std::size_t k = 0; k < carriers.size(); k++) {
      Carrier &c = carriers[k];
      if (c.body < B.own) B.modal[B.body[c.body].modal].turned.noalias() = c.shapes.topRows(B.modes(c.body)) * turned_[k];
    }
  }

  template <class Block> static void add(Evaluation &ev, const Slot *&slot, const Block &D, int size)
  {
    ev.sink.add(*slot++, D, (int)D.rows(), size);
    ev.sink.add(*slot++, D.transpose(), size, (int)D.rows());
  }
  template <class Block> static void addTurn(Evaluation &ev, const Slot *&slot, const BodyMotion &b, const Block &D)
  {
    ev.sink.add(*slot++, Block(D * ev.bodies.inStep(b)), (int)D.rows(), 3);
    ev.sink.add(*slot++, D.transpose(), 3, (int)D.rows());
  }

  /* rows of wide_ from `first` on: D times the shapes */
  template <class Shapes> void byModes(const Shapes &x, const Matrix3 &D, int first)
  {
    const auto m = wide_.cols();
    for (int r = 0; r < 3; r++)
      wide_.row(first + r) = (D(r, 0) * x.col(0).head(m) + D(r, 1) * x.col(1).head(m) + D(r, 2) * x.col(2).head(m)).transpose();
  }

  /* rows of Phi, columns of lambda */
  void gradientBlocks(Evaluation &ev, const Instance &e, const State &s, Carrier &on, const Slot *&slot)
  {
    const BodyMotion &b = ev.bodies.now[e.body], &i = ev.bodies.now[e.frame];
    const Matrix3     Jl = b.A * s.turn.J();
    const auto        rows = [](const Matrix3 &top, const Matrix3 &bottom) {
      Matrix<rows_of_attachment, 3> D;
      D << top, bottom;
      return D;
    };
    const Matrix3 O = s.J.middleCols<3>(3), G = b.G, zero = Matrix3::Zero(), one = Matrix3::Identity();
    const int     m = ev.bodies.modes(e.body);
    add(ev, slot, rows(-one, zero), 3);
    addTurn(ev, slot, b, rows(Cross<double>(s.e.x - b.r) * G, O * G));
    wide_.resize(rows_of_attachment, m);
    byModes(on.translation(e.place), -b.A, 0);
    byModes(on.rotation(e.place), O * Jl, 3);
    add(ev, slot, wide_, m);
    add(ev, slot, rows(one, zero), 3);
    addTurn(ev, slot, i, rows(zero, s.J.rightCols<3>() * i.G));
  }

  /* d(Phi_q^T lambda)/dq, but for what the bodies themselves add. Blocks of modes and of modes with the body's angles are made for
     all attachments together, in turn() and by the body. They are symmetric: as a function of the coordinates it is a gradient. */
  void curvatureBlocks(Evaluation &ev, const Instance &e, const State &s, Carrier &on, const Slot *&slot)
  {
    const BodyMotion   &b = ev.bodies.now[e.body], &i = ev.bodies.now[e.frame];
    const Frame<double> frames[2] = {s.e, s.i};
    Matrix<12, 12>      H;
    Orient::curvature(Empty(), frames, 0, s.lambda + 3, H);
    const Matrix3 Hee = H.block<3, 3>(3, 3), Hei = H.block<3, 3>(3, 9), Hie = H.block<3, 3>(9, 3), Hii = H.block<3, 3>(9, 9);
    const Matrix3 G = b.G, Gi = i.G, F = Cross<double>(s.f), S = Cross<double>(s.e.x - b.r), Jl = b.A * s.turn.J();
    const Vector3 n = b.A.transpose() * s.m;
    const int     m = ev.bodies.modes(e.body);
    const Matrix3 Gb = G * ev.bodies.inStep(b), Gf = Gi * ev.bodies.inStep(i);
    ev.sink.add(*slot++, Matrix3(G.transpose() * (Hee + F * S) * Gb), 3, 3);
    ev.sink.add(*slot++, Matrix3(G.transpose() * Hei * Gf), 3, 3);
    ev.sink.add(*slot++, Matrix3(Gi.transpose() * Hie * Gb), 3, 3);
    ev.sink.add(*slot++, Matrix3(Gi.transpose() * Hii * Gf), 3, 3);
    if (s.lambda[3] != 0 || s.lambda[4] != 0 || s.lambda[5] != 0) { /* springs at the point itself leave no moment */
      tall_ = on.rotation(e.place).topRows(m).lazyProduct(Matrix3((Gi.transpose() * Hie * Jl).transpose()));
      ev.sink.add(slot[0], tall_.transpose(), 3, m);
      tall_ *= ev.bodies.inStep(i);
      ev.sink.add(slot[1], tall_, m, 3);
    }
    slot += 2;
    if (e.body >= ev.bodies.own) return;
    auto &turned = turned_[e.carrier];
    turned.middleRows<3>(3 * e.place).noalias()              = -(F * b.A).transpose();
    turned.middleRows<3>(3 * (on.count + e.place)).noalias() = (Hee * Jl).transpose();
    const Matrix3 Q = s.turn.J().transpose() * (b.A.transpose() * Hee * b.A) * s.turn.J() + s.turn.momentGradient(n);
    ev.bodies.modal[ev.bodies.body[e.body].modal].outer.right.middleCols<3>(3 * e.place) = on.rotation(e.place).lazyProduct(Matrix3(Q.transpose()));
  }
};

/* Nothing reads the reaction of an attachment: what joints on its frame carry is measured at the joints. */
class AttachProbe : public Probe
{
public:
  AttachProbe(PetscInt i, PetscInt j) : marker_{i, j} {}
  int      markers() const override { return 2; }
  PetscInt marker(int k) const override { return marker_[k]; }

private:
  PetscInt marker_[2];
};

} // namespace

void AttachStore::localize(Localizer &l, std::vector<std::unique_ptr<Batch>> &batches) const
{
  auto batch    = std::make_unique<AttachBatch>();
  batch->bodies = l.bodies;
  for (PetscInt e = 0; e < size(); e++) {
    if (!l.needed(*this, e)) continue;
    const SceneData      &s = l.run->scene;
    const MarkerData     &m = s.markers[all[e].marker[0]];
    AttachBatch::Instance i;
    const PetscInt        on[2] = {l.marker(all[e].marker[0]), l.marker(all[e].marker[1])};
    i.attachment = &s.bodies[m.body].flexible->model->attachments[s.bodies[s.markers[all[e].marker[1]].body].attachment];
    i.s          = m.s;
    i.lambda     = l.local(start[e]);
    i.group      = l.group(start[e], unknowns(e));
    i.body = i.frame = i.carrier = i.place = -1;
    if (!l.bodies->marker.empty()) { /* not while others' bodies are collected */
      i.body  = l.bodies->marker[on[0]].body;
      i.frame = l.bodies->marker[on[1]].body;
    }
    batch->all.push_back(i);
  }
  batch->finish();
  if (!batch->all.empty()) batches.push_back(std::move(batch));
}

void AttachStore::describe(const SceneData &s, PetscInt e, double, DescribedRows &rows) const
{
  const MarkerData      &m = s.markers[all[e].marker[0]];
  const BodyData        &b = s.bodies[m.body], &c = s.bodies[s.markers[all[e].marker[1]].body];
  const ModalAttachment &a = b.flexible->model->attachments[c.attachment];
  const Eigen::Map<const Eigen::VectorXd> eta(b.flexible->deformation.data(), (Eigen::Index)b.flexible->deformation.size());
  const AttachedPoint    point(a, eta);
  const SmallTurn        turn(point.motion.tail<3>());
  const Frame<double>    f[2] = {Deformed(b.r, b.A, m.s, point.motion.head<3>(), turn), {c.r, c.A}};
  Matrix<3, 12>          J;
  rows.name   = "attachment";
  rows.length = true;
  Value(f[0], f[1], rows.value);
  for (double &x : rows.rate) x = 0;
  Orient::gradient(Empty(), f, 0, J);
  rows.J.topLeftCorner<6, 12>().setZero();
  rows.J.block<3, 3>(0, 0) = -Matrix3::Identity();
  rows.J.block<3, 3>(0, 6) = Matrix3::Identity();
  rows.J.block<3, 12>(3, 0) = J;
  rows.J.block<3, 3>(0, 3) = Cross<double>(f[0].x - b.r - b.A * m.s); /* the marker moves, undeformed, by dr + theta x s */
  rows.modal.resize(6, a.translation.cols());
  rows.modal << -b.A * point.by_modes.topRows<3>(), (J.middleCols<3>(3) * b.A * turn.J()) * point.by_modes.bottomRows<3>();
}

std::unique_ptr<Probe> AttachStore::probe(Localizer &l, PetscInt e) const
{
  return std::make_unique<AttachProbe>(l.marker(all[e].marker[0]), l.marker(all[e].marker[1]));
}

} // namespace hhtdae
