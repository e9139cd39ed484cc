/*
  Functions that the user provides: of time, with exact derivatives, and of the state, through measures.
*/
#ifndef HHTDAE_FUNCTIONS_H
#define HHTDAE_FUNCTIONS_H

#include "hhtdae/dual.h"
#include "hhtdae/types.h"
#include <functional>
#include <memory>
#include <string>
#include <utility>
#include <vector>

namespace hhtdae
{

/* f(t) with f'(t) and f''(t) */
class TimeFunction
{
public:
  using Number = Dual<1, Dual<1>>; /* t with its first and second derivative by t */
  struct Value {
    double f, f1, f2;
  };

  TimeFunction(double constant = 0);
  /* c0 + c1 t + c2 t^2 + ... */
  static TimeFunction polynomial(const std::vector<double> &coefficients);
  /* offset + amplitude sin(omega t + phase) */
  static TimeFunction harmonic(double amplitude, double omega, double phase = 0, double offset = 0);
  /* From x0 before t0 to x1 after t1, as Adams' STEP and STEP5: step() is the cubic x0 + (x1 - x0) s^2 (3 - 2 s) with
     s = (t - t0)/(t1 - t0), whose second derivative jumps at both ends; step5() is the quintic x0 + (x1 - x0) s^3 (10 - 15 s + 6 s^2), which
     is twice continuously differentiable. Use the quintic for a motion of positions: with the cubic, accelerations and reactions jump. */
  static TimeFunction step(double t0, double x0, double t1, double x1);
  static TimeFunction step5(double t0, double x0, double t1, double x1);
  /* natural cubic spline through (t_k, x_k), t increasing, continued linearly */
  static TimeFunction spline(const std::vector<double> &t, const std::vector<double> &x);
  /* any formula in t, differentiated automatically: [](TimeFunction::Number t) { return sin(t) * t; } */
  static TimeFunction formula(std::function<Number(const Number &)> f);
  /* f, f' and f'' computed by the user's function */
  static TimeFunction values(std::function<Value(double)> f);

  Value operator()(double t) const { return f_ ? f_(t) : Value{constant_, 0, 0}; }
  bool  isConstant() const { return !f_; }
  const std::string &error() const { return error_; } /* error in the arguments it was made from; empty: none */

private:
  static TimeFunction faulty(const std::string &error);

  double                       constant_ = 0;
  std::function<Value(double)> f_;
  std::string                  error_;
};

/*
  A scalar function of the state: an argument of expressions, a term of couplers, an output channel.
  Components are 0, 1, 2 for x, y, z of the marker `frame` (default: the ground's, space axes).
*/
struct Measure {
  enum Kind {
    Time,
    Displacement,        /* of marker i from marker j (default: the space origin), component in frame */
    Distance,            /* |x_i - x_j| */
    Velocity,            /* of i relative to j (time derivative taken in space), component in frame */
    Rate,                /* d Distance / dt; 0 where the markers coincide, since the distance has no derivative there */
    Acceleration,        /* of i relative to j, component in frame */
    Angle,               /* of i's x axis about j's z axis, from j's x axis; in (-pi, pi] at the start, counted over full turns from there */
    AngularVelocity,     /* of i relative to j, component in frame */
    AngularAcceleration, /* likewise */
    Multiplier,          /* of row `component` of a joint or motion; which row is what: joints.h */
    JointForce,          /* of a joint or motion on its marker i's body, component in frame (default: marker j) */
    JointMoment,         /* likewise, about marker i's origin */
    Component,           /* component of a force element (forces.h): the force state F if the element has `state`, else the computed value */
    Value,               /* of a variable V */
    StateValue,          /* of a first-order state */
    Modal,               /* modal coordinate `component` of a flexible body */
    ElementForce,        /* of any element on the body of marker i, component in frame (default: space axes); for output only. A body that the
                            element does not act on is an error here, so that no channel is zero by mistake (Snapshot::load() gives zero) */
    ElementMoment,       /* likewise, about marker i's origin */
    KineticEnergy,       /* of the whole scene; for output only */
    PotentialEnergy      /* likewise: of gravity, modes, FE models, SpringDamper, TorsionalSpringDamper, Bushing, Beam, contacts and stops.
                            Forces from user functions (NonlinearSpring, NonlinearTorsionalSpring, UserForce, UserScalarForce) and
                            groundAcceleration(), constant or not, are not included */
  };
  Kind     kind      = Time;
  Marker   i, j, frame;
  int      component = 0;
  PetscInt target    = -1; /* element, variable, state or flexible body */
  PetscInt scene     = 0;  /* of the target */

  static Measure time() { return {}; }
  static Measure displacement(Marker i, int component, Marker j = {}, Marker frame = {}) { return {Displacement, i, j, frame, component}; }
  static Measure distance(Marker i, Marker j) { return {Distance, i, j, {}}; }
  static Measure velocity(Marker i, int component, Marker j = {}, Marker frame = {}) { return {Velocity, i, j, frame, component}; }
  static Measure rate(Marker i, Marker j) { return {Rate, i, j, {}}; }
  static Measure acceleration(Marker i, int component, Marker j = {}, Marker frame = {}) { return {Acceleration, i, j, frame, component}; }
  static Measure angle(Marker i, Marker j) { return {Angle, i, j, {}}; }
  static Measure angularVelocity(Marker i, int component, Marker j = {}, Marker frame = {}) { return {AngularVelocity, i, j, frame, component}; }
  static Measure angularAcceleration(Marker i, int component, Marker j = {}, Marker frame = {}) { return {AngularAcceleration, i, j, frame, component}; }
  static Measure multiplier(Element joint, int row) { return {Multiplier, {}, {}, {}, row, joint.id, joint.scene}; }
  static Measure jointForce(Element joint, int component, Marker frame = {}) { return {JointForce, {}, {}, frame, component, joint.id, joint.scene}; }
  static Measure jointMoment(Element joint, int component, Marker frame = {}) { return {JointMoment, {}, {}, frame, component, joint.id, joint.scene}; }
  static Measure force(Element force, int component) { return {Component, {}, {}, {}, component, force.id, force.scene}; }
  static Measure elementForce(Element e, Marker on, int component, Marker frame = {}) { return {ElementForce, on, {}, frame, component, e.id, e.scene}; }
  static Measure elementMoment(Element e, Marker on, int component, Marker frame = {}) { return {ElementMoment, on, {}, frame, component, e.id, e.scene}; }
  static Measure value(Variable v) { return {Value, {}, {}, {}, 0, v.id, v.scene}; }
  static Measure value(State s) { return {StateValue, {}, {}, {}, 0, s.id, s.scene}; }
  static Measure modal(Body flexible, int mode) { return {Modal, {}, {}, {}, mode, flexible.id, flexible.scene}; }
  static Measure kineticEnergy() { return {KineticEnergy, {}, {}, {}}; }
  static Measure potentialEnergy() { return {PotentialEnergy, {}, {}, {}}; }
};

/* STEP and STEP5 of a Real x, for expressions and force laws: from h0 for x <= x0 to h1 for x >= x1, by the cubic of TimeFunction::step()
   and the quintic of TimeFunction::step5() */
Real step(const Real &x, double x0, double h0, double x1, double h1);
Real step5(const Real &x, double x0, double h0, double x1, double h1);

/* A user's function of Reals, which is differentiated automatically (dual.h); it returns a Real or a constant. */
template <class... Arguments> using RealFunction = std::function<Real(Arguments...)>;

/* A force or moment as a function of a position and its rate */
using ForceLaw = RealFunction<const Real &, const Real &>;

/* f(m_1, ..., m_n) of at most 16 measures, differentiated automatically:
     Expression{{Measure::distance(a, b), Measure::value(s)}, [](const Real *m) { return 3 * m[0] * m[0] + sin(m[1]); }} */
struct Expression {
  std::vector<Measure>       arguments;
  RealFunction<const Real *> f;

  Expression() = default;
  Expression(std::vector<Measure> a, RealFunction<const Real *> g) : arguments(std::move(a)), f(std::move(g)) {}
  Expression(const Measure &m) : arguments{m}, f([](const Real *x) { return x[0]; }) {}
  Expression(const TimeFunction &g) /* of time alone */
    : arguments{Measure::time()}, f([g](const Real *t) {
        const TimeFunction::Value v = g(t[0].value());
        return chain(t[0], v.f, v.f1);
      })
  {
  }
};

} // namespace hhtdae

#endif
