/*
  Stiff elements that are released or engaged: springs, dampers, brakes and bushings whose stiffness or damping is 1e2 to
  1e12 times that formed from the mass and the time scale of the model, and hard contacts. A gate between 1 and 0 multiplies
  their force; it is a function of time, a jump or a transition, or of the state: the displacement of a body that is pushed
  past a latch. The time of the event is known and divides the run into a motion with and one without the stiff element.
*/
#ifndef HHTDAE_SOAK_MODEL_SWITCHES_H
#define HHTDAE_SOAK_MODEL_SWITCHES_H

#include "model_trees.h"

namespace soak
{

/* 1 for s < at - width, 0 for s > at + width, between them a quintic; width 0: a jump */
struct Gate {
  Measure of;
  double  at = 0, width = 0;
  bool    holds_later = false; /* from 0 to 1 instead */

  Real operator()(const Real &s) const
  {
    const double u = width > 0 ? (s.value() - at) / width : s.value() < at ? -1 : 1;
    Real         g = 0. * s + (u < 0 ? 1. : 0.); /* with as many derivatives as s */
    if (std::abs(u) < 1) {
      const Real x = (s - at) * (0.5 / width) + 0.5;
      g            = 1. - x * x * x * (10. - x * (15. - x * 6.));
    }
    return holds_later ? Real(1. - g) : g;
  }
};

struct Impact {
  double time = 1e300, speed = 0, frequency = 0; /* the first time, the largest speed and the highest frequency */
};

class Switches
{
public:
  Switches(Builder &builder, double end) : b(builder), r(builder.random), end_(end) {}
  std::vector<Marker> seen; /* on the bodies that are released or held */
  Impact              impact;

  void any()
  {
    switch (r.choose({2, 2, 2, 2, b.planar ? 0. : 2, 2})) {
    case 0:
      return onGuide("switched damper", gate(true), [](double k, double v) { return Damper{k, v}; });
    case 1:
      return onGuide("switched brake", gate(true), [T = b.period](double k, double v) { return Brake{k, v, T}; });
    case 2:
      return spring();
    case 3:
      return turning();
    case 4:
      return bushing();
    default:
      return contact();
    }
  }

private:
  Builder &b;
  Random  &r;
  double   end_;

  /* Forces per unit of mass as functions of velocity; k: decay rate times the period, v: velocity of the model */
  struct Damper {
    double k, v;
    Real   operator()(const Real &speed) const { return -k * speed; }
  };
  struct Brake { /* as steep as the damper at zero velocity; its force stays below 1e6 m v / T */
    double k, v, period;
    Real   operator()(const Real &speed) const
    {
      const double slip = v * std::min(1e-3, 1e6 / (k * period));
      return -k * slip * tanh(speed / slip);
    }
  };

  double rate() const { return 1 / b.period; }
  double stiffness(double most = 1e12)
  {
    return r.logarithmic(1e2, most);
  }

  /* base for elements: a rigid body of the model, or the ground */
  int base() { return b.bodies() && r.chance(0.4) ? firm(b.anyRigid()) : 0; }
  int firm(int body) const { return b.placed[(std::size_t)body].flexible ? 0 : body; }

  Gate gate(bool may_hold)
  {
    Gate         g;
    const double when = end_ * r.uniform(0.2, 0.8);
    g.holds_later     = may_hold && r.chance(0.3);
    switch (r.choose({1, 1, 1})) {
    case 0:
      g.of = Measure::time();
      g.at = when;
      b.used["gate at once"]++;
      break;
    case 1:
      g.of    = Measure::time();
      g.at    = when;
      g.width = end_ * r.logarithmic(1e-6, 1e-1);
      b.used["gate within a span"]++;
      break;
    default:
      latch(g, when);
    }
    b.used[g.holds_later ? "takes hold" : "lets go"]++;
    return g;
  }

  /* A mass pushed from rest along a guide across the upward direction: s = a t^2/2 */
  void latch(Gate &g, double when)
  {
    const Vector3 up    = b.gravity.norm() > 0 ? Vector3(-b.gravity.normalized()) : b.up;
    Vector3       along = b.planar ? Vector3(up(1), -up(0), 0)
                                   : Vector3(up.cross(std::abs(up(0)) < 0.8 ? Vector3::UnitX() : Vector3::UnitY()));
    along.normalize();
    const Vector3 x     = 5 * b.length * b.direction();
    const double  speed = b.speed, push = b.weightPerMass();
    b.speed         = 0;
    const int mass  = b.addBody(x);
    b.speed         = speed;
    const Matrix3 R = b.planar ? b.axesFrom(along) : b.axesAlong(along);
    const Marker  i = b.at(mass, b.placed[(std::size_t)mass].at, R), j = b.at(0, b.placed[(std::size_t)mass].at, R);
    b.add(Translational{i, j});
    along_(i, j, {Measure::time()},
           [f = push * b.placed[(std::size_t)mass].mass](const Real *) -> Real { return Real(f); });
    g.of    = Measure::displacement(i, axis(), j, j);
    g.at    = 0.5 * push * when * when;
    g.width = g.at * r.logarithmic(1e-4, 1e-1);
    b.used["gate of the state"]++;
  }
  int axis() const { return b.planar ? 0 : 2; }

  /* a force on i along the guide of j, with its reaction */
  template <class F> void along_(Marker i, Marker j, const std::vector<Measure> &of, const F &f)
  {
    UserForce u{i, j, j, {}, {}, b.state()};
    for (int c = 0; c < 3; c++)
      u.force.push_back(c == axis() ? Expression{of, f}
                                    : Expression{{Measure::time()}, [](const Real *) -> Real { return Real(0.); }});
    b.add(u);
  }

  struct Held {
    int     body;
    Marker  i, j;
    double  mass;
    Vector3 x;
  };
  Held guided(bool along_gravity)
  {
    const int     on = base();
    const Vector3 x  = b.placed[(std::size_t)on].at + b.length * r.uniform(1, 3) * b.direction();
    Vector3       d  = b.direction();
    if (along_gravity && b.gravity.norm() > 0) d = -b.gravity.normalized();
    const int     body = b.addBody(x);
    const Matrix3 R    = b.planar ? b.axesFrom(d) : b.axesAlong(d);
    const Held    h{body, b.at(body, x, R), b.at(on, x, R), b.placed[(std::size_t)body].mass, x};
    b.add(Translational{h.i, h.j});
    b.project = b.project || b.speed > 0;
    seen.push_back(h.i);
    return h;
  }

  /* a body on a guide, held by a damper or a brake */
  template <class Make> void onGuide(const char *name, const Gate &g, const Make &make)
  {
    const Held   h   = guided(true);
    const auto   law = make(stiffness() * rate(), b.length * rate());
    const double m   = h.mass;
    along_(h.i, h.j, {g.of, Measure::velocity(h.i, axis(), h.j, h.j)},
           [=](const Real *a) -> Real { return m * g(a[0]) * law(a[1]); });
    b.used[name]++;
  }

  /* a body on a guide, held by a damped spring until its release */
  void spring()
  {
    const Held   h = guided(false);
    const Gate   g = gate(false);
    const double k = h.mass * stiffness() * rate() * rate(), c = 2 * r.uniform(0.2, 2) * std::sqrt(k * h.mass);
    along_(h.i, h.j, {g.of, Measure::displacement(h.i, axis(), h.j, h.j), Measure::velocity(h.i, axis(), h.j, h.j)},
           [=](const Real *a) -> Real { return -g(a[0]) * (k * a[1] + c * a[2]); });
    b.used["switched spring"]++;
  }

  /* a pendulum on a pin, held by a damper, a brake or a torsional spring */
  void turning()
  {
    const int     on = base(), kind = r.choose({1, 1, 1});
    const Gate    g    = gate(kind < 2);
    const Vector3 x    = b.placed[(std::size_t)on].at + b.length * r.uniform(1, 3) * b.direction();
    const int     body = b.addBody(x + b.length * r.uniform(0.3, 1) * b.direction());
    const Matrix3 R    = b.axes();
    const Marker  i = b.at(body, x, R), j = b.at(on, x, R);
    const double  m = b.placed[(std::size_t)body].mass * b.length * b.length, k = stiffness() * rate(), w = rate(),
                 T = b.period;
    b.add(Revolute{i, j});
    b.project = b.project || b.speed > 0;
    Expression e;
    if (kind == 0)
      e = Expression{{g.of, Measure::angularVelocity(i, 2, j, j)}, [=](const Real *a) -> Real {
                       return m * g(a[0]) * Damper{k, w}(a[1]);
                     }};
    else if (kind == 1)
      e = Expression{{g.of, Measure::angularVelocity(i, 2, j, j)}, [=](const Real *a) -> Real {
                       return m * g(a[0]) * Brake{k, w, T}(a[1]);
                     }};
    else {
      const double spring = m * k * w, damper = 2 * r.uniform(0.2, 2) * std::sqrt(spring * m);
      e = Expression{{g.of, Measure::angle(i, j), Measure::angularVelocity(i, 2, j, j)},
                     [=](const Real *a) -> Real { return -g(a[0]) * (spring * a[1] + damper * a[2]); }};
    }
    b.add(UserScalarForce{i, j, e, true, b.state()});
    seen.push_back(b.at(body, b.placed[(std::size_t)body].at));
    b.used[kind == 0   ? "switched damper of a pin"
           : kind == 1 ? "switched friction of a pin"
                       : "switched torsional spring"]++;
  }

  /* A free body in a bushing: three springs and dampers, and three rotational ones for small angles, which are
     measured by the end points of unit axes */
  void bushing()
  {
    const int     on    = base();
    const Gate    g     = gate(false);
    const Vector3 x     = b.placed[(std::size_t)on].at + b.length * r.uniform(1, 3) * b.direction();
    const double  speed = b.speed;
    b.speed             = 0;
    const int body      = b.addBody(x);
    b.speed             = speed;
    const Vector3 at    = b.placed[(std::size_t)body].at;
    const Matrix3 R     = b.axes();
    const Marker  i = b.at(body, at, R), j = b.at(on, at, R),
                 tip[2] = {b.at(body, at + R.col(0), R), b.at(body, at + R.col(1), R)};
    const double m = b.placed[(std::size_t)body].mass, zeta = r.uniform(0.3, 2);
    const double k = m * stiffness() * rate() * rate(), c = 2 * zeta * std::sqrt(k * m),
                 turn = 0.1 * b.length * b.length;
    UserForce u{i, j, j, {}, {}, b.state()};
    for (int d = 0; d < 3; d++)
      u.force.push_back(Expression{{g.of, Measure::displacement(i, d, j, j), Measure::velocity(i, d, j, j)},
                                   [=](const Real *a) -> Real { return -g(a[0]) * (k * a[1] + c * a[2]); }});
    /* small angles about x, y, z: y's end goes along z, x's end against z, x's end along y */
    const Measure angle[3] = {Measure::displacement(tip[1], 2, i, j), Measure::displacement(tip[0], 2, i, j),
                              Measure::displacement(tip[0], 1, i, j)};
    for (int d = 0; d < 3; d++) {
      const double sign = d == 1 ? -1 : 1;
      u.moment.push_back(Expression{{g.of, angle[d], Measure::angularVelocity(i, d, j, j)}, [=](const Real *a) -> Real {
                                      return -g(a[0]) * turn * (k * sign * a[1] + c * a[2]);
                                    }});
    }
    b.add(u);
    b.project = b.project || b.speed > 0;
    seen.push_back(i);
    b.used["switched bushing"]++;
  }

  /* A mass m at rest reaches a contact after a distance `gap` with the acceleration a. The frequency of the contact is
     the speed v over the depth at which the contact's energy is m v^2/2 */
  void meets(double m, double gap, double a, const ContactLaw &law)
  {
    const double v     = std::sqrt(2 * a * gap),
                 depth = std::pow(0.5 * (law.exponent + 1) * m * v * v / law.stiffness, 1 / (law.exponent + 1));
    impact.time      = std::min(impact.time, v / a);
    impact.speed     = std::max(impact.speed, v);
    impact.frequency = std::max(impact.frequency, v / depth);
  }

  /* A ball that falls on a hard plane, or is pushed to it */
  void contact()
  {
    const double  size = b.length * r.uniform(0.2, 0.6), push = b.weightPerMass();
    const Vector3 x     = 4 * b.length * b.direction();
    const double  speed = b.speed;
    b.speed             = 0;
    const int ball      = b.addBody(x);
    b.speed             = speed;
    const Vector3 at    = b.placed[(std::size_t)ball].at,
                  up    = b.gravity.norm() > 0 ? Vector3(-b.gravity.normalized()) : b.up;
    const double m = b.placed[(std::size_t)ball].mass, gap = 0.5 * push * std::pow(end_ * r.uniform(0.2, 0.7), 2);
    ContactLaw   law;
    law.exponent      = r.chance(0.5) ? 1.5 : 1;
    law.stiffness     = m * r.logarithmic(1e2, 1e10) * rate() * rate() * std::pow(b.length, 1 - law.exponent);
    law.damping       = r.uniform(0.5, 2) / (push * end_);
    law.friction      = r.chance(0.5) ? r.uniform(0.1, 0.8) : 0;
    meets(m, gap, push, law);
    law.slip_velocity = b.length * rate() * r.logarithmic(1e-3, 1e-2);
    const Matrix3 R   = b.planar ? b.axesFrom(Vector3(up(1), -up(0), 0)) : b.axesAlong(up);
    b.add(SpherePlane{b.at(ball, at), b.at(0, at - (size + gap) * up, R), size, law, b.state()});
    if (b.gravity.norm() == 0) {
      UserForce u{b.at(ball, at), {}, {}, {}, {}, false};
      for (int c = 0; c < 3; c++)
        u.force.push_back(
            Expression{{Measure::time()}, [f = -m * push * up(c)](const Real *) -> Real { return Real(f); }});
      b.add(u);
    }
    seen.push_back(b.at(ball, at));
    b.used["hard contact"]++;
  }
};

} // namespace soak

#endif
