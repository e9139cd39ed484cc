/* The elements that -extras adds to a model: stops and ropes, massless links, joints given by expressions */
#ifndef HHTDAE_SOAK_MODEL_EXTRAS_H
#define HHTDAE_SOAK_MODEL_EXTRAS_H

#include "model_builder.h"

namespace soak
{

class Extras
{
public:
  explicit Extras(Builder &builder) : b(builder), r(builder.random) {}

  void any()
  {
    switch (r.choose({2, 1, 2, 1, b.planar ? 0. : 1, 1, 1})) {
    case 0:
      return stop();
    case 1:
      return rope();
    case 2:
      return massless();
    case 3:
      return ball();
    case 4:
      return screw();
    case 5:
      return link();
    default:
      return servo();
    }
  }

private:
  Builder &b;
  Random  &r;

  int base() { return b.bodies() && r.chance(0.6) ? b.anyRigid() : 0; }
  int axis() const { return b.planar ? 0 : 2; }

  /* contact law for a coordinate with this inertia and this travel */
  ContactLaw law(double inertia, double travel)
  {
    const Stiff s = b.stiff(inertia);
    ContactLaw  c;
    c.exponent  = r.chance(0.5) ? 1 : r.uniform(1, 2);
    c.stiffness = s.k / std::pow(0.01 * travel, c.exponent - 1);
    c.damping   = r.chance(0.7) ? r.uniform(0.05, 1) * b.period / travel : 0;
    b.lossy     = b.lossy || c.damping > 0;
    return c;
  }

  void stop()
  {
    std::vector<const Held *> may;
    for (const Held &h : b.held)
      if (h.kind == Held::Revolute || h.kind == Held::Cylindrical || h.kind == Held::Translational) may.push_back(&h);
    if (may.empty()) return rope();
    const Held &h     = *may[(std::size_t)r.integer(0, (int)may.size() - 1)];
    const bool  turns = h.kind == Held::Revolute || (h.kind == Held::Cylindrical && r.chance(0.5));
    const double way = turns ? 1 : b.length, lower = -way * r.uniform(0.02, 1), upper = way * r.uniform(0.02, 1);
    if (turns) {
      RotationalStop s{h.i, h.j};
      s.lower = lower;
      s.upper = upper;
      s.law   = law(0.1 * h.mass * h.size * h.size, upper - lower);
      s.state = b.state();
      b.add(s);
    } else {
      TranslationalStop s{h.i, h.j};
      s.lower = lower;
      s.upper = upper;
      s.axis  = axis();
      s.law   = law(h.mass, upper - lower);
      s.state = b.state();
      b.add(s);
    }
  }

  void rope()
  {
    if (!b.bodies()) return;
    const int     i = b.anyBody(), j = base();
    const Vector3 x = b.on(i), y = j == i ? Vector3(x + b.length * b.direction()) : b.on(j);
    const double  l = (x - y).norm();
    DistanceStop  s{b.at(i, x), b.at(j == i ? 0 : j, y)};
    if (r.chance(0.3)) s.lower = l * r.uniform(0.5, 0.99);
    s.upper = l * r.uniform(1.001, 1.5);
    s.law   = law(b.lighter(i, j == i ? 0 : j), s.upper - s.lower);
    s.state = b.state();
    b.add(s);
  }

  /* a body on a massless link between two pins, or between a spherical and a universal joint */
  void massless()
  {
    const int     from = base();
    const Vector3 x = b.on(from), y = x + b.length * b.direction(), d = (y - x).normalized();
    const int     child = b.addBody(y + 0.3 * b.length * b.direction());
    RigidBody     nothing;
    nothing.mass = 0;
    nothing.inertia.setZero();
    nothing.position         = x;
    nothing.rotation         = b.axesFrom(d);
    nothing.velocity         = b.startVelocity();
    nothing.angular_velocity = b.startSpin();
    const Body    rod    = b.scene.add("", nothing);
    const Vector3 across = b.planar ? Vector3::UnitZ() : Vector3(b.axesAlong(d).col(0));
    const Matrix3 one = b.planar ? b.axes() : b.axesAlong(across), two = b.planar ? b.axes() : b.axesAlong(d.cross(across));
    if (b.planar) {
      b.add(Revolute{b.scene.markerAt(rod, x, one), b.at(from, x, one)});
      b.add(Revolute{b.at(child, y, two), b.scene.markerAt(rod, y, two)});
    } else {
      b.add(Spherical{b.scene.markerAt(rod, x, one), b.at(from, x, one)});
      b.add(Universal{b.at(child, y, two), b.scene.markerAt(rod, y, one)});
    }
    b.used["link without mass"]++;
    b.project = b.project || b.speed > 0;
  }

  struct Pair {
    Marker i, j;
  };
  Pair hung(const Matrix3 &R)
  {
    const int     from = base();
    const Vector3 x = b.on(from), y = x + 0.5 * b.length * b.direction();
    const int     child = b.addBody(y);
    b.project           = b.project || b.speed > 0;
    return {b.at(child, x, R), b.at(from, x, R)};
  }

  void ball()
  {
    const Pair     p = hung(b.axes());
    UserConstraint c;
    const double   k = r.logarithmic(1e-2, 1);
    for (int row = 0; row < (b.planar ? 2 : 3); row++)
      c.rows.push_back({{Measure::displacement(p.i, row, p.j, p.j)}, [k, l = b.length](const Real *m) { return k * sin(m[0] / l); }});
    b.add(c);
  }

  void screw()
  {
    const Pair   p     = hung(b.axes());
    const double pitch = 0.3 * r.sign() * b.length * r.logarithmic(0.3, 1);
    b.add(Cylindrical{p.i, p.j});
    b.add(UserConstraint{{Expression{{Measure::displacement(p.i, 2, p.j, p.j), Measure::angle(p.i, p.j)}, [pitch](const Real *m) { return m[0] - pitch * (m[1] + 0.2 * sin(m[1])); }}}});
  }

  void link()
  {
    const int     from = base();
    const Vector3 x = b.on(from), y = x + b.length * b.direction();
    const int     child = b.addBody(y);
    const double  l     = (b.placed[(std::size_t)child].at - x).norm();
    b.add(UserConstraint{{Expression{{Measure::distance(b.at(child, b.placed[(std::size_t)child].at), b.at(from, x))}, [l](const Real *m) { return log(m[0] / l); }}}});
    b.project = b.project || b.speed > 0;
  }

  /* a slide whose velocity is a function of time */
  void servo()
  {
    const Pair   p = hung(b.axes());
    const double v = 0.2 * b.length / b.period * r.uniform(0.2, 1), omega = 2 * M_PI / b.period * r.uniform(0.3, 3);
    b.add(Translational{p.i, p.j});
    b.add(UserConstraint{{Expression{{Measure::velocity(p.i, axis(), p.j, p.j), Measure::time()}, [v, omega](const Real *m) { return m[0] - v * sin(omega * m[1]); }}}});
  }
};

} // namespace soak

#endif
