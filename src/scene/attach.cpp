#include "attach.h"
#include "kernels/primitives_axes.h"
#include "runtime.h"

namespace hhtdae
{

namespace
{

/* Frame of the point at s after the modes have displaced it by x and rotated it by `turn`, in body axes */
Frame<double> Deformed(const Vector3 &r, const Matrix3 &A, const Vector3 &s, const Vector3 &x, const SmallTurn &turn)
{
  return {r + A * (s + x), A * turn.rotation()};
}

/* Rows of the attachment: x_i - x_e, then the products of axes that are zero if the axes are parallel */
void Value(const Frame<double> &e, const Frame<double> &i, double *phi)
{
  const Frame<double> f[2] = {e, i};
  for (int c = 0; c < 3; c++) phi[c] = i.x(c) - e.x(c);
  Orient::value<double>(Orient::Data(), f, 0, phi + 3);
}

/* The reaction of an attachment equilibrates its massless frame: it follows from the sum of the elements' loads on the frame */
class AttachProbe : public Probe
{
public:
  struct On {
    const StoreBase       *store;
    PetscInt               instance;
    std::unique_ptr<Probe> probe;
  };
  std::vector<On> on;

  AttachProbe(PetscInt i, PetscInt j) : marker_{i, j} {}
  int      markers() const override { return 2; }
  PetscInt marker(int k) const override { return marker_[k]; }

  void loads(const Evaluation &ev, Wrench<double> *load) const override
  {
    const Wrench<double> sum = onFrame(ev);
    const Vector3        arm = ev.bodies.frame(marker_[1]).x - ev.bodies.frame(marker_[0]).x;
    load[0] = {sum.f, sum.m + arm.cross(sum.f)};
    load[1] = {-sum.f, -sum.m};
  }
  void reaction(const Evaluation &ev, Wrench<double> *load) const override { loads(ev, load); }
  /* the multipliers that the rows would have as constraints: force in space axes, moment in axes of the frame */
  void components(const Evaluation &ev, double *c) const override
  {
    const Wrench<double> sum = onFrame(ev);
    Eigen::Map<Matrix<6, 1>>(c) << sum.f, ev.bodies.frame(marker_[1]).R.transpose() * sum.m;
  }

  void accept(const Bodies &B) override
  {
    for (On &x : on) x.probe->accept(B);
  }
  PetscInt memory() const override
  {
    PetscInt n = 0;
    for (const On &x : on) n += x.probe->memory();
    return n;
  }
  void copyMemory(double *x, bool in) override
  {
    for (On &o : on) {
      o.probe->copyMemory(x, in);
      x += o.probe->memory();
    }
  }

private:
  PetscInt marker_[2];

  Wrench<double> onFrame(const Evaluation &ev) const
  {
    const Bodies  &B     = ev.bodies;
    const PetscInt frame = B.marker[marker_[1]].body;
    Wrench<double> sum{Vector3::Zero(), Vector3::Zero()};
    for (const On &x : on) {
      std::vector<Wrench<double>> load(x.probe->markers());
      x.probe->loads(ev, load.data());
      for (int k = 0; k < x.probe->markers(); k++) {
        if (B.marker[x.probe->marker(k)].body != frame) continue;
        sum.f += load[k].f;
        sum.m += load[k].m + (B.frame(x.probe->marker(k)).x - B.now[frame].r).cross(load[k].f);
      }
    }
    return sum;
  }
};

} // namespace

void AttachStore::describe(const SceneData &s, PetscInt e, double, DescribedRows &rows) const
{
  const MarkerData      &m = s.markers[all[e].marker[0]];
  const BodyData        &b = s.bodies[m.body], &c = s.bodies[s.markers[all[e].marker[1]].body];
  const ModalAttachment &a = b.flexible->place(c.attachment);
  const Eigen::Map<const Eigen::VectorXd> eta(b.flexible->deformation.data(), (Eigen::Index)b.flexible->deformation.size());
  const AttachedPoint    point(a, eta);
  const SmallTurn        turn(point.motion.tail<3>());
  const Frame<double>    f[2] = {Deformed(b.r, b.A, m.s, point.motion.head<3>(), turn), {c.r, c.A}};
  Matrix<3, 12>          J;
  rows.name   = "attachment";
  rows.length = true;
  Value(f[0], f[1], rows.value);
  for (double &x : rows.rate) x = 0;
  Orient::gradient(Orient::Data(), f, 0, J);
  rows.J.topLeftCorner<6, 12>().setZero();
  rows.J.block<3, 3>(0, 0) = -Matrix3::Identity();
  rows.J.block<3, 3>(0, 6) = Matrix3::Identity();
  rows.J.block<3, 12>(3, 0) = J;
  /* the columns of J belong to perturbations of the undeformed marker, which moves by dr + theta x s */
  rows.J.block<3, 3>(0, 3)  = Cross<double>(f[0].x - b.r - b.A * m.s);
  rows.modal.resize(6, a.translation.cols());
  rows.modal << -b.A * point.by_modes.topRows<3>(), (J.middleCols<3>(3) * b.A * turn.J()) * point.by_modes.bottomRows<3>();
}

std::unique_ptr<Probe> AttachStore::probe(Localizer &l, PetscInt e) const
{
  const SceneData &s     = l.run->scene;
  const PetscInt   frame = s.markers[all[e].marker[1]].body;
  auto             probe = std::make_unique<AttachProbe>(l.marker(all[e].marker[0]), l.marker(all[e].marker[1]));
  for (const StoreBase *store : s.order)
    for (PetscInt k = 0; k < store->size() && !store->isExplicit(); k++) {
      bool acts = !store->isConstraint() || store->unknowns(k);
      int  m    = 0;
      while (acts && m < store->markers() && s.markers[store->marker(k, m)].body != frame) m++;
      if (acts && m < store->markers()) probe->on.push_back({store, k, store->probe(l, k)});
    }
  return probe;
}

void RecallMemories(Probe &p, const std::vector<std::unique_ptr<Batch>> &batches)
{
  auto *attached = dynamic_cast<AttachProbe *>(&p);
  if (!attached) return;
  for (AttachProbe::On &x : attached->on) {
    std::vector<double> memory(x.probe->memory());
    for (const auto &b : batches)
      if (!memory.empty() && b->memoryOf(x.store, x.instance, memory.data())) x.probe->copyMemory(memory.data(), true);
  }
}

} // namespace hhtdae
