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

namespace
{

constexpr int rows_of_attachment = 6;

/* Frame of the point that follows the modes */
Frame<double> Deformed(const ModalAttachment &a, const Vector3 &r, const Matrix3 &A, const Vector3 &s, const Eigen::Ref<const Eigen::VectorXd> &eta,
                       SmallTurn *turn)
{
  *turn = SmallTurn(a.rotation * eta);
  return {r + A * (s + a.translation * eta), A * turn->rotation()};
}

/* Rows x_i - x_e, then the axes' products */
void Value(const Frame<double> &e, const Frame<double> &i, double *phi)
{
  const Frame<double> f[2] = {e, i};
  for (int c = 0; c < 3; c++) phi[c] = i.x(c) - e.x(c);
  Orient::value<double>(Empty(), f, 0, phi + 3);
}

class AttachBatch : public Batch
{
public:
  struct Instance {
    PetscInt               body, frame; /* local bodies */
    const ModalAttachment *attachment;
    Vector3                s; /* undeformed, from the frame's origin */
    PetscInt               lambda, group;
  };
  std::vector<Instance> all;
  Bodies               *bodies = nullptr;

  void pattern(Pattern &p) override
  {
    for (const Instance &e : all) {
      const PetscInt b = bodies->body[e.body].group, i = bodies->body[e.frame].group;
      for (PetscInt g : {b, b + 1, b + 2, i, i + 1}) {
        request_.push_back(p.need(e.group, g));
        request_.push_back(p.need(g, e.group));
      }
      for (PetscInt g : {b + 1, b + 2, i + 1})
        for (PetscInt h : {b + 1, b + 2, i + 1}) request_.push_back(p.need(g, h));
    }
  }

  void residual(Evaluation &ev) override
  {
    for (const Instance &e : all) {
      State  s(ev, e);
      double phi[rows_of_attachment];
      Value(s.e, s.i, phi);
      for (int r = 0; r < rows_of_attachment; r++) ev.row(e.lambda + r, phi[r]);
      load(ev.bodies, e, s);
    }
  }

  void jacobian(Evaluation &ev) override
  {
    const Slot *slot = slot_.data();
    for (const Instance &e : all) {
      State s(ev, e);
      load(ev.bodies, e, s);
      gradientBlocks(ev, e, s, slot);
      curvatureBlocks(ev, e, s, slot);
    }
  }

private:
  struct State {
    Frame<double>    e, i;
    SmallTurn        turn;
    Matrix<3, 12>    J;      /* of the axes' rows */
    const double    *lambda;
    Vector3          f, m;   /* J^T lambda on the point of the flexible body */

    State(const Evaluation &ev, const Instance &a) : turn(Vector3::Zero()), lambda(ev.u + a.lambda)
    {
      const BodyMotion &b = ev.bodies.now[a.body], &c = ev.bodies.now[a.frame];
      const int         n = ev.bodies.modes(a.body);
      e = Deformed(*a.attachment, b.r, b.A, a.s, Eigen::Map<const Eigen::VectorXd>(ev.u + ev.bodies.body[a.body].first + 6, n), &turn);
      i = {c.r, c.A};
      const Frame<double> frames[2] = {e, i};
      Orient::gradient(Empty(), frames, 0, J);
      f = -Vector3(lambda[0], lambda[1], lambda[2]);
      m = J.middleCols<3>(3).transpose() * Vector3(lambda[3], lambda[4], lambda[5]);
    }
  };

  static void load(Bodies &B, const Instance &e, const State &s)
  {
    BodyMotion             &b = B.now[e.body], &i = B.now[e.frame];
    const ModalAttachment  &a = *e.attachment;
    const Vector3           n = b.A.transpose() * s.m;
    b.f -= s.f;
    b.m -= s.m + (s.e.x - b.r).cross(s.f);
    B.modal[B.body[e.body].modal].load.noalias() -=
        a.translation.transpose() * (b.A.transpose() * s.f) + a.rotation.transpose() * (s.turn.J().transpose() * n);
    i.f += s.f;
    i.m += s.m; /* the axes' rows turn both alike */
  }

  template <class Block> static void add(Evaluation &ev, const Slot *&slot, const Block &D, int size)
  {
    ev.sink.add(*slot++, D, (int)D.rows(), size);
    ev.sink.add(*slot++, D.transpose(), size, (int)D.rows());
  }

  /* rows of Phi, columns of lambda */
  static void gradientBlocks(Evaluation &ev, const Instance &e, const State &s, const Slot *&slot)
  {
    using Wide = Eigen::Matrix<double, rows_of_attachment, Eigen::Dynamic>;
    const BodyMotion &b = ev.bodies.now[e.body], &i = ev.bodies.now[e.frame];
    const Matrix3     Jl = b.A * s.turn.J();
    const auto        rows = [](const auto &top, const auto &bottom) {
      Wide D(rows_of_attachment, top.cols());
      D << top, bottom;
      return D;
    };
    const Matrix3 O = s.J.middleCols<3>(3), G = b.euler.G(), zero = Matrix3::Zero(), one = Matrix3::Identity();
    add(ev, slot, rows(-one, zero), 3);
    add(ev, slot, rows(Cross<double>(s.e.x - b.r) * G, O * G), 3);
    const Eigen::Matrix<double, 3, Eigen::Dynamic> x = -b.A * e.attachment->translation, turn = (O * Jl) * e.attachment->rotation;
    add(ev, slot, rows(x, turn), (int)x.cols());
    add(ev, slot, rows(one, zero), 3);
    add(ev, slot, rows(zero, s.J.rightCols<3>() * i.euler.G()), 3);
  }

  /* d(Phi_q^T lambda)/dq, but for what the bodies themselves add */
  static void curvatureBlocks(Evaluation &ev, const Instance &e, const State &s, const Slot *&slot)
  {
    using Wide = Eigen::Matrix<double, 3, Eigen::Dynamic>;
    const BodyMotion      &b = ev.bodies.now[e.body], &i = ev.bodies.now[e.frame];
    const ModalAttachment &a = *e.attachment;
    const Frame<double>    frames[2] = {s.e, s.i};
    Matrix<12, 12>         H;
    Orient::curvature(Empty(), frames, 0, s.lambda + 3, H);
    const Matrix3 Hee = H.block<3, 3>(3, 3), Hei = H.block<3, 3>(3, 9), Hie = H.block<3, 3>(9, 3), Hii = H.block<3, 3>(9, 9);
    const Matrix3 G = b.euler.G(), Gi = i.euler.G(), F = Cross<double>(s.f), S = Cross<double>(s.e.x - b.r);
    const Wide    Wx = b.A * a.translation, Wt = (b.A * s.turn.J()) * a.rotation;
    const Vector3 n  = b.A.transpose() * s.m;
    const int     m  = (int)Wx.cols();
    ev.sink.add(*slot++, Matrix3(G.transpose() * (Hee + F * S) * G), 3, 3);
    ev.sink.add(*slot++, Wide(G.transpose() * (Hee * Wt - F * Wx)), 3, m);
    ev.sink.add(*slot++, Matrix3(G.transpose() * Hei * Gi), 3, 3);
    ev.sink.add(*slot++, Wide(G.transpose() * ((Hee + Cross<double>(s.m)).transpose() * Wt - F * Wx)).transpose(), m, 3);
    const Matrix3 Q = s.turn.J().transpose() * (b.A.transpose() * Hee * b.A) * s.turn.J() + s.turn.momentGradient(n);
    ev.sink.add(*slot++, Eigen::MatrixXd(a.rotation.transpose() * (Q * a.rotation)), m, m);
    ev.sink.add(*slot++, Wide((Hei * Gi).transpose() * Wt).transpose(), m, 3);
    ev.sink.add(*slot++, Matrix3(Gi.transpose() * Hie * G), 3, 3);
    ev.sink.add(*slot++, Wide(Gi.transpose() * Hie * Wt), 3, m);
    ev.sink.add(*slot++, Matrix3(Gi.transpose() * Hii * Gi), 3, 3);
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

void AttachStore::localize(Localizer &l, std::vector<std::unique_ptr<Batch>> &batches)
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
    i.body = i.frame = -1;
    if (!l.bodies->marker.empty()) { /* not while others' bodies are collected */
      i.body  = l.bodies->marker[on[0]].body;
      i.frame = l.bodies->marker[on[1]].body;
    }
    batch->all.push_back(i);
  }
  if (!batch->all.empty()) batches.push_back(std::move(batch));
}

void AttachStore::describe(const SceneData &s, PetscInt e, double, DescribedRows &rows) const
{
  const MarkerData      &m = s.markers[all[e].marker[0]];
  const BodyData        &b = s.bodies[m.body], &c = s.bodies[s.markers[all[e].marker[1]].body];
  const ModalAttachment &a = b.flexible->model->attachments[c.attachment];
  SmallTurn              turn(Vector3::Zero());
  Eigen::VectorXd        eta = Eigen::Map<const Eigen::VectorXd>(b.flexible->deformation.data(), b.flexible->deformation.size());
  const Frame<double>    f[2] = {Deformed(a, b.r, b.A, m.s, eta, &turn), {c.r, c.A}};
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
  rows.modal << -b.A * a.translation, (J.middleCols<3>(3) * b.A * turn.J()) * a.rotation;
}

std::unique_ptr<Probe> AttachStore::probe(Localizer &l, PetscInt e) const
{
  return std::make_unique<AttachProbe>(l.marker(all[e].marker[0]), l.marker(all[e].marker[1]));
}

} // namespace hhtdae
