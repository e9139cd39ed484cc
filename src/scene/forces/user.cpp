/*
  Users' forces. Components are expressions, by default evaluated in the equations of motion, which then depend on all arguments of the
  expressions; with `state = true` they are force states with rows F - f(...) = 0. Components that read accelerations are
  always force states, because the integrator requires equations of motion that are affine in q''.
*/
#include "requirements.h"
#include "scene/expression_batch.h"
#include "scene/kernels/user_force.h"
#include "scene/runtime.h"

namespace hhtdae
{

namespace
{

template <class K> struct UserItem {
  PetscInt                element = -1;
  PetscInt                marker[K::markers];
  std::vector<Expression> expressions;
  bool                    as_force_states;
  typename K::Data        data;
};

/* Users' forces without force states: the inputs of the kernel are functions of the unknowns */
template <class K> class UserBatch : public ReadingBatch<ForceBatchBase<K>>
{
  using Base = ForceBatchBase<K>;
  using Base::M, Base::Z, Base::request_, Base::slot_;

public:
  using Base::bodies;
  std::vector<LocalFunction> functions; /* the components of each instance */

  void pattern(Pattern &p) override
  {
    for (std::size_t i = 0; i < this->all.size(); i++) {
      const auto &e = this->all[i];
      functions[i].arguments.connect(*bodies, p);
      this->bodyPattern(e, p);
      for (const Columns::Part &c : functions[i].arguments.columns().parts)
        for (int k = 0; k < M; k++) {
          const LocalBody &b = Base::bodyOf(*bodies, e, k);
          for (int g = 0; g < Groups(b.kind); g++)
            if (Base::loads(b.kind, g, k)) request_.push_back(p.need(b.group + g, c.group));
        }
    }
  }

  void residual(Evaluation &ev) override
  {
    for (std::size_t i = 0; i < this->all.size(); i++) {
      Frame<double>  f[M];
      Wrench<double> on[M];
      double         z[Z];
      frames(ev, this->all[i], f);
      functions[i].value(ev, z);
      K::wrench(this->all[i].data, f, nullptr, ev.t, z, on);
      Base::apply(ev, this->all[i], f, on);
    }
  }

  void jacobian(Evaluation &ev) override
  {
    const Slot *slot = slot_.data();
    for (std::size_t i = 0; i < this->all.size(); i++) {
      const auto         &e = this->all[i];
      Frame<double>       f[M];
      Wrench<double>      on[M];
      double              z[Z];
      ForceJacobian<M, Z> J;
      frames(ev, e, f);
      functions[i].gradient(ev, z, G_);
      K::jacobian(e.data, f, nullptr, ev.t, z, on, J);
      Base::apply(ev, e, f, on);
      Base::bodyBlocks(ev, e, f, on, J.frames, nullptr, slot);
      argumentBlocks(ev, e, f, J, functions[i].arguments.columns(), slot);
    }
  }

  bool memoryOf(const StoreBase *s, PetscInt number, double *x) const override
  {
    const PetscInt i = this->of.find(s, number);
    if (i >= 0) const_cast<LocalFunction &>(functions[i]).arguments.copyMemory(x, false);
    return i >= 0;
  }

protected:
  void each(const typename ReadingBatch<Base>::Visit &visit) override
  {
    for (LocalFunction &f : functions)
      for (LocalMeasure &m : f.arguments.all()) visit(m);
  }

private:
  LocalFunction::Gradient G_; /* derivatives of the components */

  static void frames(const Evaluation &ev, const ForceInstance<K> &e, Frame<double> *f)
  {
    for (int k = 0; k < M; k++) f[k] = ev.bodies.template frame<true>(e.marker[k]);
  }

  /* Adds - d load / d components times d components / d arguments */
  void argumentBlocks(Evaluation &ev, const ForceInstance<K> &e, const Frame<double> *f, const ForceJacobian<M, Z> &J,
                      const Columns &columns, const Slot *&slot) const
  {
    Matrix<Z, 6> T[M];
    for (int k = 0; k < M; k++) {
      T[k].setZero();
      ev.bodies.columns(e.marker[k], f[k], Matrix<Z, 6>(-J.inputs.template middleRows<6>(6 * k).transpose()), T[k]);
    }
    for (const Columns::Part &c : columns.parts)
      for (int k = 0; k < M; k++) {
        const LocalBody &b = Base::bodyOf(ev.bodies, e, k);
        for (int g = 0; g < Groups(b.kind); g++) {
          if (!Base::loads(b.kind, g, k)) continue;
          const LocalFunction::Gradient block =
              T[k].middleCols(GroupOffset(b.kind, g), GroupSize(b.kind, g)).transpose() * G_.middleCols(c.start, c.size);
          ev.sink.add(*slot++, block, GroupSize(b.kind, g), c.size);
        }
      }
  }
};

/* For measures: values of the components, and the loads */
template <class K> class UserProbe : public Probe
{
public:
  UserProbe(const ForceInstance<K> &i, LocalFunction f) : e_(i), f_(std::move(f)) {}
  int      markers() const override { return K::markers; }
  PetscInt marker(int k) const override { return e_.marker[k]; }
  void     loads(const Evaluation &ev, Wrench<double> *on) const override
  {
    Frame<double> f[K::markers];
    double        c[K::count];
    for (int k = 0; k < K::markers; k++) f[k] = ev.bodies.template frame<true>(e_.marker[k]);
    if (e_.state >= 0) std::copy(ev.u + e_.state, ev.u + e_.state + K::count, c);
    else f_.value(ev, c);
    K::template apply<double>(e_.data, f, c, on);
  }
  void     components(const Evaluation &e, double *c) const override { f_.value(e, c); }
  void     accept(const Bodies &B) override { f_.arguments.accept(B); }
  PetscInt memory() const override { return f_.arguments.memory(); }
  void     copyMemory(double *x, bool in) override { f_.arguments.copyMemory(x, in); }

private:
  ForceInstance<K> e_;
  LocalFunction    f_;
};

template <class K> class UserStore : public StoreBase
{
public:
  using Item = UserItem<K>;
  std::vector<Item> all;

  PetscInt      size() const override { return (PetscInt)all.size(); }
  int           markers() const override { return K::markers; }
  PetscInt      marker(PetscInt e, int k) const override { return all[e].marker[k]; }
  PetscInt      element(PetscInt e) const override { return all[e].element; }
  bool          loads(int k) const override { return Depends(K::acts, 2 * k) || Depends(K::acts, 2 * k + 1); }
  int           rows() const override { return K::count; }
  bool          asForceStates(PetscInt e) const override { return all[e].as_force_states; }

  const std::vector<Expression> *expressions(PetscInt e) const override { return &all[e].expressions; }

  void localize(Localizer &l, std::vector<std::unique_ptr<Batch>> &batches) const override
  {
    auto eliminated    = std::make_unique<UserBatch<K>>();
    auto loads         = std::make_unique<ForceBatch<K>>(); /* applies the loads of instances with force states */
    auto rows          = std::make_unique<ExpressionBatch>(*l.bodies);
    eliminated->bodies = loads->bodies = l.bodies;
    eliminated->of.store               = this;
    for (PetscInt e = 0; e < size(); e++) {
      if (!l.needed(*this, e)) continue;
      ForceInstance<K> i;
      for (int k = 0; k < K::markers; k++) i.marker[k] = l.marker(all[e].marker[k]);
      i.data = all[e].data;
      if (!all[e].as_force_states) {
        eliminated->all.push_back(i);
        eliminated->functions.push_back(function(l, e));
        eliminated->of.add(e);
        continue;
      }
      for (int c = 0; c < K::count; c++) i.input[c] = l.input({ScalarRef::ForceState, all[e].element, c});
      loads->all.push_back(i);
      if (OwnerOf(*l.run->model, *this, e) == l.run->rank)
        rows->add(ExpressionBatch::Definition, function(l, e), l.local(start[e]), l.group(start[e], K::count));
    }
    if (!eliminated->all.empty()) batches.push_back(std::move(eliminated));
    if (!rows->empty()) batches.push_back(std::move(rows));
    if (!loads->all.empty()) batches.push_back(std::move(loads));
  }

  std::unique_ptr<Probe> probe(Localizer &l, PetscInt e) const override
  {
    ForceInstance<K> i;
    for (int k = 0; k < K::markers; k++) i.marker[k] = l.marker(all[e].marker[k]);
    i.data = all[e].data;
    if (all[e].as_force_states) i.state = l.local(start[e]);
    return std::make_unique<UserProbe<K>>(i, function(l, e));
  }

private:
  LocalFunction function(Localizer &l, PetscInt e) const
  {
    const ElementData &element = l.run->scene.elements[all[e].element];
    return LocalFunction(l, std::string(element.type) + " " + element.name, all[e].expressions.data(),
                         all[e].expressions.size());
  }
};

template <class K>
void Enter(ElementBuilder &e, const std::vector<Marker> &markers, const typename K::Data &data,
           std::vector<Expression> f, bool state)
{
  UserItem<K> item;
  for (int k = 0; k < K::markers; k++) item.marker[k] = markers[k].id;
  item.data    = data;
  item.as_force_states = state;
  for (const Expression &x : f) item.as_force_states |= NeedsAcceleration(x);
  item.expressions = std::move(f);
  e.put<UserStore<K>>(std::move(item));
}

} // namespace

/* Removes components of users' forces that are out of the plane of a planar scene, that is other than forces in the plane
   and moments about z. It is an error if they are nonzero constants. */
static void LeaveInPlane(ElementBuilder &e, std::vector<Expression> &force, std::vector<Expression> &moment)
{
  const auto leave = [&](Expression &x, const char *what) {
    double value = 0;
    if (x.arguments.empty() && x.f) value = x.f(nullptr).value();
    e.require(value == 0, std::string(what) + " is " + Show(value) + "; a planar scene has forces in its plane and moments about z");
    x = Expression{{}, [](const Real *) -> Real { return 0.0; }};
  };
  if (!force.empty()) leave(force[2], "the force along z");
  if (moment.empty()) return;
  leave(moment[0], "the moment about x");
  leave(moment[1], "the moment about y");
}

/* The order of components, for measures and force states, is: forces, then moments. */
template <> Element Scene::enter(const std::string &name, const UserForce &s)
{
  /* ElementBuilder takes two markers; a force without reaction has only one */
  const bool     reaction = s.j.id != -1, framed = s.frame.id != -1;
  ElementBuilder e(*this, name, "user force", ElementData::Force, s.i, reaction ? s.j : Marker{}, reaction);
  UserWrenchData d;
  for (const auto *list : {&s.force, &s.moment})
    e.require(list->empty() || list->size() == 3,
              std::to_string(list->size()) + (list == &s.force ? " components of force" : " components of moment") +
                  ", must be none or three");
  e.require(!s.force.empty() || !s.moment.empty(), "neither force nor moment is given");
  if (framed) e.require(s.frame, "marker `frame`");
  if (!s.moment.empty()) RequireTurning(e, s.i, "i");
  if (reaction) RequireTurning(e, s.j, "j"); /* the reaction acts at i's origin, which causes a moment about j's origin */
  if (!e.good()) return e.done();
  std::vector<Expression> f = s.force, moment = s.moment;
  if (e.planar()) LeaveInPlane(e, f, moment);
  if (!e.good()) return e.done();
  f.insert(f.end(), moment.begin(), moment.end());
  d.force                           = s.force.empty() ? -1 : 0;
  d.moment                          = s.moment.empty() ? -1 : (int)s.force.size();
  d.reaction                        = reaction;
  d.framed                          = framed;
  const std::vector<Marker> markers = {s.i, reaction ? s.j : s.i, framed ? s.frame : s.i};
  if (f.size() == 6)
    Enter<UserWrench<6>>(e, markers, d, std::move(f), s.state);
  else
    Enter<UserWrench<3>>(e, markers, d, std::move(f), s.state);
  return e.done();
}

/* The one component is the force, or the moment on i's body. */
template <> Element Scene::enter(const std::string &name, const UserScalarForce &s)
{
  ElementBuilder e(*this, name, s.rotational ? "user scalar moment" : "user scalar force", ElementData::Force, s.i,
                   s.j);
  if (e.good() && !s.rotational)
    e.require(!e.coincident(s.i, s.j),
              "the origins of markers i and j coincide, the line between them has no direction");
  if (s.rotational) {
    RequireTurning(e, s.i, "i");
    RequireTurning(e, s.j, "j");
  }
  if (!e.good()) return e.done();
  if (s.rotational)
    Enter<UserAboutAxis>(e, {s.i, s.j}, {}, {s.value}, s.state);
  else
    Enter<UserAlongLine>(e, {s.i, s.j}, {}, {s.value}, s.state);
  return e.done();
}

} // namespace hhtdae
