/*
  Load cases of flexible bodies times a scale s, a function of time or of the state. A load case has the force f, the moment m
  about the centre of mass and the modal forces q, each of first order in eta (modal.h). With the body's axes A it adds s A f
  and s A m to the load of the floating frame and s q to the load of the modes.
*/
#include "requirements.h"
#include "scene/expression_batch.h"
#include "scene/runtime.h"
#include <array>

namespace hhtdae
{

namespace
{

/* A load case of one body, evaluated at a state of the body */
struct CaseOnBody {
  PetscInt             body = -1; /* local number */
  const ModalLoadCase *load = nullptr;

  struct Value {
    Vector3         f, m; /* space axes */
    Eigen::VectorXd q;
  };
  Value at(const Evaluation &ev) const
  {
    const Matrix3                          &A = ev.bodies.now[body].A;
    const Eigen::Map<const Eigen::VectorXd> eta(ev.u + ev.bodies.body[body].first + 6, load->modal.size());
    Value                                   x{load->force, load->moment + load->moment_gradient * eta, load->modal};
    if (load->force_gradient.size()) x.f += load->force_gradient * eta;
    if (load->modal_gradient.size()) x.q += load->modal_gradient * eta;
    x.f = A * x.f;
    x.m = A * x.m;
    return x;
  }
};

class ModalLoadBatch : public ReadingBatch<Batch>
{
public:
  struct Instance {
    CaseOnBody    on;
    LocalFunction scale;
    Input         state; /* the scale, if it is a force state */
    bool          as_force_states;
  };
  std::vector<Instance> all;
  InstancesOf           of;

  explicit ModalLoadBatch(const Bodies &B) : bodies_(B) {}

  void pattern(Pattern &p) override
  {
    for (Instance &e : all) {
      const PetscInt g = bodies_.body[e.on.body].group;
      for (const auto &block : own(*e.on.load)) request_.push_back(p.need(g + block[0], g + block[1]));
      if (!e.as_force_states) e.scale.arguments.connect(bodies_, p);
      for (int row = 0; row < 3; row++) {
        if (e.as_force_states) request_.push_back(p.need(g + row, e.state.group));
        for (const Columns::Part &c : e.scale.arguments.columns().parts) request_.push_back(p.need(g + row, c.group));
      }
    }
  }

  void residual(Evaluation &ev) override
  {
    for (const Instance &e : all) {
      double s = 0;
      if (e.as_force_states) s = ev.input(e.state);
      else e.scale.value(ev, &s);
      apply(ev, e, s, e.on.at(ev));
    }
  }

  void jacobian(Evaluation &ev) override
  {
    const Slot *slot = slot_.data();
    for (const Instance &e : all) {
      const CaseOnBody::Value x = e.on.at(ev);
      double                  s = 0;
      if (e.as_force_states) s = ev.input(e.state);
      else e.scale.gradient(ev, &s, G_);
      apply(ev, e, s, x);
      ownBlocks(ev, e, s, x, slot);
      scaleColumns(ev, e, x, slot);
    }
  }

  bool memoryOf(const StoreBase *s, PetscInt number, double *x) const override
  {
    const PetscInt i = of.find(s, number);
    if (i >= 0) const_cast<LocalFunction &>(all[i].scale).arguments.copyMemory(x, false);
    return i >= 0;
  }

protected:
  void each(const Visit &visit) override
  {
    for (Instance &e : all)
      for (LocalMeasure &m : e.scale.arguments.all()) visit(m);
  }

private:
  const Bodies           &bodies_;
  LocalFunction::Gradient G_;

  /* The nonzero blocks between the body's position, angles and modes, in the order in which ownBlocks() adds them */
  static std::vector<std::array<int, 2>> own(const ModalLoadCase &l)
  {
    std::vector<std::array<int, 2>> blocks{{0, 1}, {1, 1}, {1, 2}};
    if (l.force_gradient.size()) blocks.push_back({0, 2});
    if (l.modal_gradient.size()) blocks.push_back({2, 2});
    return blocks;
  }

  static void apply(Evaluation &ev, const Instance &e, double s, const CaseOnBody::Value &x)
  {
    BodyMotion &b = ev.bodies.now[e.on.body];
    b.f += s * x.f;
    b.m += s * x.m;
    ev.bodies.modal[ev.bodies.body[e.on.body].modal].load += s * x.q;
  }

  /* Adds - d load/dq for the body's coordinates q. Bodies::modalJacobian() adds d(G^T m)/dq for fixed moments m */
  static void ownBlocks(Evaluation &ev, const Instance &e, double s, const CaseOnBody::Value &x, const Slot *&slot)
  {
    const BodyMotion    &b = ev.bodies.now[e.on.body];
    const ModalLoadCase &l = *e.on.load;
    const int            m = (int)l.modal.size();
    const Matrix3        G = b.G * ev.bodies.inStep(b), GA = b.G.transpose() * b.A;
    ev.sink.add(*slot++, Matrix3(s * Cross<double>(x.f) * G), 3, 3);
    ev.sink.add(*slot++, Matrix3(s * b.G.transpose() * Cross<double>(x.m) * G), 3, 3);
    ev.sink.add(*slot++, Eigen::MatrixXd(-s * GA * l.moment_gradient), 3, m);
    if (l.force_gradient.size()) ev.sink.add(*slot++, Eigen::MatrixXd(-s * b.A * l.force_gradient), 3, m);
    if (l.modal_gradient.size()) ev.sink.add(*slot++, Eigen::MatrixXd(-s * l.modal_gradient), m, m);
  }

  /* Adds minus the load for scale 1, times the derivatives of the scale */
  void scaleColumns(Evaluation &ev, const Instance &e, const CaseOnBody::Value &x, const Slot *&slot) const
  {
    const BodyMotion     &b       = ev.bodies.now[e.on.body];
    const Eigen::VectorXd rows[3] = {-x.f, -b.G.transpose() * x.m, -x.q};
    for (const Eigen::VectorXd &row : rows) {
      if (e.as_force_states) ev.sink.add((slot++)->column(e.state.offset), row, (int)row.size(), 1);
      for (const Columns::Part &c : e.scale.arguments.columns().parts)
        ev.sink.add(*slot++, Eigen::MatrixXd(row * G_.middleCols(c.start, c.size)), (int)row.size(), c.size);
    }
  }
};

/* For measures: the scale, which is the component, and the load on the floating frame */
class ModalLoadProbe : public Probe
{
public:
  ModalLoadProbe(PetscInt marker, const CaseOnBody &on, LocalFunction f, PetscInt state) : marker_(marker), on_(on), f_(std::move(f)), state_(state) {}
  int      markers() const override { return 1; }
  PetscInt marker(int) const override { return marker_; }
  void     loads(const Evaluation &ev, Wrench<double> *on) const override
  {
    const CaseOnBody::Value x = on_.at(ev);
    double                  s;
    if (state_ >= 0) s = ev.u[state_];
    else f_.value(ev, &s);
    on[0] = {s * x.f, s * x.m};
  }
  void     components(const Evaluation &ev, double *c) const override { f_.value(ev, c); }
  void     accept(const Bodies &B) override { f_.arguments.accept(B); }
  PetscInt memory() const override { return f_.arguments.memory(); }
  void     copyMemory(double *x, bool in) override { f_.arguments.copyMemory(x, in); }

private:
  PetscInt      marker_;
  CaseOnBody    on_;
  LocalFunction f_;
  PetscInt      state_;
};

class ModalLoadStore : public StoreBase
{
public:
  struct Item {
    PetscInt                element = -1, marker = -1, load = -1;
    std::vector<Expression> scale;
    bool                    as_force_states = false;
  };
  std::vector<Item> all;

  PetscInt      size() const override { return (PetscInt)all.size(); }
  int           markers() const override { return 1; }
  PetscInt      marker(PetscInt e, int) const override { return all[e].marker; }
  PetscInt      element(PetscInt e) const override { return all[e].element; }
  int           rows() const override { return 1; }
  bool          asForceStates(PetscInt e) const override { return all[e].as_force_states; }

  const std::vector<Expression> *expressions(PetscInt e) const override { return &all[e].scale; }

  void localize(Localizer &l, std::vector<std::unique_ptr<Batch>> &batches) const override
  {
    auto loads      = std::make_unique<ModalLoadBatch>(*l.bodies);
    auto rows       = std::make_unique<ExpressionBatch>(*l.bodies);
    loads->of.store = this;
    for (PetscInt e = 0; e < size(); e++) {
      if (!l.needed(*this, e)) continue;
      ModalLoadBatch::Instance i;
      i.on      = onBody(l, e);
      i.as_force_states = all[e].as_force_states;
      if (i.as_force_states) {
        i.state = l.input({ScalarRef::ForceState, all[e].element, 0});
        if (OwnerOf(*l.run->model, *this, e) == l.run->rank) rows->add(ExpressionBatch::Definition, function(l, e), l.local(start[e]), l.group(start[e], 1));
      } else
        i.scale = function(l, e);
      loads->all.push_back(std::move(i));
      loads->of.add(e);
    }
    if (!rows->empty()) batches.push_back(std::move(rows));
    if (!loads->all.empty()) batches.push_back(std::move(loads));
  }

  std::unique_ptr<Probe> probe(Localizer &l, PetscInt e) const override
  {
    const PetscInt marker = l.marker(all[e].marker);
    return std::make_unique<ModalLoadProbe>(marker, onBody(l, e), function(l, e), all[e].as_force_states ? l.local(start[e]) : -1);
  }

private:
  CaseOnBody onBody(Localizer &l, PetscInt e) const
  {
    const SceneData &s    = l.run->scene;
    const PetscInt   body = s.markers[all[e].marker].body, marker = l.marker(all[e].marker);
    return {l.bodies->marker.empty() ? -1 : l.bodies->marker[marker].body, &s.bodies[body].flexible->model->loads[all[e].load]};
  }
  LocalFunction function(Localizer &l, PetscInt e) const { return LocalFunction(l, "modal load " + l.run->scene.elements[all[e].element].name, all[e].scale.data(), 1); }
};

} // namespace

template <> Element Scene::enter(const std::string &name, const ModalLoad &x)
{
  SceneData &s        = data();
  const bool flexible = s.valid(x.body) && s.bodies[x.body.id].flexible;
  if (!flexible) { /* an ElementBuilder needs the marker of the floating frame, which does not exist */
    const Element none = absent(name);
    s.errors.push_back("modal load " + s.elements[none.id].name + ": its body is not a flexible one of this scene");
    return none;
  }
  const Marker at{s.bodies[x.body.id].flexible->frame, number_};
  ElementBuilder e(*this, name, "modal load", ElementData::Force, at, Marker{}, false);
  if (!e.good()) return e.done();
  const ModalBody     &m = *s.bodies[x.body.id].flexible->model;
  ModalLoadStore::Item item;
  std::string          known;
  for (const ModalLoadCase &l : m.loads) known += (known.empty() ? "" : ", ") + l.name;
  item.load    = m.load(x.load);
  item.marker  = at.id;
  item.scale   = {x.scale};
  item.as_force_states = x.state || NeedsAcceleration(x.scale);
  e.require(item.load >= 0, s.bodyName(x.body.id) + " has no load case " + x.load + (known.empty() ? ", in fact none" : ", but " + known));
  e.put<ModalLoadStore>(std::move(item));
  return e.done();
}

} // namespace hhtdae
