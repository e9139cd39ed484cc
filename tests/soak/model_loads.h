/* Forces of every type between bodies of a model, friction in its joints, user-defined variables and states, motions
   of its joints */
#ifndef HHTDAE_SOAK_MODEL_LOADS_H
#define HHTDAE_SOAK_MODEL_LOADS_H

#include "model_builder.h"

namespace soak
{

class Loads
{
public:
  explicit Loads(Builder &builder) : b(builder), r(builder.random) {}
  std::vector<State>    states;
  std::vector<Variable> variables;

  void any()
  {
    switch (r.choose({4, 2, 2, 1.5, 2, 2, 2, 2, 1.5, 1.5, 1, 1})) {
    case 0:
      spring();
      return;
    case 1:
      nonlinearSpring();
      return;
    case 2:
      torsion();
      return;
    case 3:
      nonlinearTorsion();
      return;
    case 4:
      bushing();
      return;
    case 5:
      beam();
      return;
    case 6:
      friction();
      return;
    case 7:
      actuator();
      return;
    case 8:
      wind();
      return;
    case 9:
      moment();
      return;
    case 10:
      alias();
      return;
    default:
      follower();
    }
  }

  /* bodies in a net of springs, bushings and beams, without joints */
  int net(int bodies)
  {
    const Vector3 start = 2 * b.length * b.direction();
    int           last  = 0;
    for (int k = 0; k < bodies; k++) {
      const int child = b.addBody(start + b.length * (k + 1.) * (b.planar ? Vector3(1, 0, 0) : Vector3(1, 0.2, 0)) +
                                  0.3 * b.length * b.direction());
      switch (r.choose({1, 1, 1})) {
      case 0:
        beamBetween(last, child);
        break;
      case 1:
        bushingBetween(last, child);
        break;
      default:
        for (int n = 0; n < (b.planar ? 2 : 4); n++) springBetween(last, child);
      }
      last = child;
    }
    b.used["net of springs"]++;
    return bodies;
  }

  /* ---- motions ---- */
  void drive()
  {
    std::vector<std::size_t> may;
    for (std::size_t k = 0; k < b.held.size(); k++)
      if (b.held[k].free && (b.held[k].kind == Held::Revolute || b.held[k].kind == Held::Translational ||
                             b.held[k].kind == Held::Cylindrical))
        may.push_back(k);
    if (may.empty()) return;
    Held      &h         = b.held[may[(std::size_t)r.integer(0, (int)may.size() - 1)]];
    const bool turn      = h.kind == Held::Revolute || (h.kind == Held::Cylindrical && r.chance(0.5));
    h.free               = false;
    b.project            = true;
    const double   reach = turn ? r.uniform(0.2, 1.5) : b.length * r.uniform(0.1, 0.5);
    const MotionOf of    = (MotionOf)r.choose({3, 1, 1});
    b.used[of == MotionOf::Displacement ? "motion by displacement"
           : of == MotionOf::Velocity   ? "motion by velocity"
                                        : "motion by acceleration"]++;
    const double rate = 2 * M_PI / b.period;
    TimeFunction f    = of == MotionOf::Displacement
                            ? motion(reach)
                            : motion(reach * rate * (of == MotionOf::Acceleration ? 0.5 * rate : 1));
    if (turn)
      b.add(RotationalMotion{h.i, h.j, f, of});
    else
      b.add(TranslationalMotion{h.i, h.j, f, of, b.planar ? 0 : 2});
  }

  /* zero at t = 0; functions of every kind */
  TimeFunction motion(double reach)
  {
    const double T = b.period, w = 2 * M_PI / T * r.uniform(0.3, 2);
    switch (r.choose({3, 1, 2, 1, 1, 1})) {
    case 0:
      return TimeFunction::harmonic(reach, w);
    case 1:
      return TimeFunction::polynomial({0, reach / T, -0.3 * reach / (T * T)});
    case 2:
      return TimeFunction::step5(0.1 * T, 0, (0.1 + r.uniform(0.3, 1)) * T, reach);
    case 3:
      return TimeFunction::spline({0, 0.4 * T, 0.9 * T, 1.7 * T, 3 * T}, {0, 0.5 * reach, -0.2 * reach, reach, 0});
    case 4:
      return TimeFunction::formula(
          [=](const TimeFunction::Number &t) -> TimeFunction::Number { return reach * sin(w * t) * sin(w * t); });
    default:
      return TimeFunction::values([=](double t) -> TimeFunction::Value {
        return {reach * (1 - std::cos(w * t)), reach * w * std::sin(w * t), reach * w * w * std::cos(w * t)};
      });
    }
  }

private:
  Builder &b;
  Random  &r;

  void pair(int &a, int &c) /* two bodies, the first of which may be the ground */
  {
    c = b.anyBody();
    a = r.chance(0.5) ? 0 : r.integer(0, b.bodies());
    if (a == c) a = 0;
  }
  /* markers whose distance is at least a third of the model's length */
  void ends(int a, int c, Marker &i, Marker &j)
  {
    const Vector3 x = b.on(c);
    Vector3       y = b.on(a);
    if (a == 0) y = x + b.length * r.uniform(0.5, 2) * b.direction();
    for (int k = 0; k < 10 && (x - y).norm() < b.length / 3; k++)
      y = b.placed[a].point || b.placed[a].flexible ? y : Vector3(b.on(a) + 0.5 * b.length * b.direction());
    i = b.at(c, x);
    j = b.at(a, y);
  }
  bool apart(Marker i, Marker j)
  {
    return (DataOf(b.scene).frame(i).x - DataOf(b.scene).frame(j).x).norm() > 0.1 * b.length;
  }

  void springBetween(int a, int c)
  {
    Marker      i, j;
    const Stiff s = b.stiff(b.lighter(a, c));
    ends(a, c, i, j);
    if (!apart(i, j)) return;
    const double distance = (DataOf(b.scene).frame(i).x - DataOf(b.scene).frame(j).x).norm();
    /* initial strain such that forces have the size of weights */
    const double strain = b.weight(c) / s.k * r.uniform(-0.5, 0.5);
    const bool   zero   = r.chance(0.1) && s.omega * b.period < 40;
    b.add(SpringDamper{i, j, s.k, s.c,
                       zero            ? 0
                       : r.chance(0.5) ? -1
                                       : std::max(0.2 * distance, distance + strain),
                       0, b.state()});
  }
  void spring()
  {
    int a, c;
    pair(a, c);
    springBetween(a, c);
  }

  void nonlinearSpring()
  {
    int    a, c;
    Marker i, j;
    pair(a, c);
    ends(a, c, i, j);
    if (!apart(i, j)) return;
    const Stiff  s = b.stiff(b.lighter(a, c));
    const double l = (DataOf(b.scene).frame(i).x - DataOf(b.scene).frame(j).x).norm(), hard = 1 / (b.length * b.length),
                 k = s.k, d = s.c;
    b.add(NonlinearSpring{
        i, j,
        [=](const Real &x, const Real &v) -> Real { return k * (x - l) * (1. + hard * (x - l) * (x - l)) + d * v; },
        b.state()});
  }

  const Held *revolute()
  {
    std::vector<std::size_t> may;
    for (std::size_t k = 0; k < b.held.size(); k++)
      if (b.held[k].kind == Held::Revolute || b.held[k].kind == Held::Cylindrical) may.push_back(k);
    return may.empty() ? nullptr : &b.held[may[(std::size_t)r.integer(0, (int)may.size() - 1)]];
  }
  void torsion()
  {
    const Held *h = revolute();
    if (!h) return;
    const Stiff s = b.stiff(0.08 * h->mass * h->size * h->size);
    b.add(TorsionalSpringDamper{h->i, h->j, s.k, s.c,
                                r.chance(0.5) ? 0 : r.uniform(-1, 1) * std::min(1., 10 / (s.omega * b.period)), 0,
                                b.state()});
  }
  void nonlinearTorsion()
  {
    const Held *h = revolute();
    if (!h) return;
    const Stiff  s = b.stiff(0.08 * h->mass * h->size * h->size);
    const double k = s.k, c = s.c;
    b.add(NonlinearTorsionalSpring{
        h->i, h->j, [=](const Real &x, const Real &v) -> Real { return -k * sin(x) - c * v; }, b.state()});
  }

  void bushingBetween(int a, int c)
  {
    if (b.placed[c].point || b.placed[a].point) return;
    const Stiff   s = b.stiff(b.lighter(a, c));
    const double  I = b.lighterInertia(a, c);
    const Vector3 x = b.placed[c].flexible || a == 0 ? b.placed[c].at : Vector3((b.placed[a].at + b.placed[c].at) / 2);
    const Matrix3 R = b.axes();
    if (b.placed[a].flexible && (x - b.placed[a].at).norm() > 2 * b.length) return;
    Bushing f{b.at(c, x, R), b.at(a, x, R)};
    for (int k = 0; k < 3; k++) {
      f.stiffness(k)           = s.k * r.uniform(0.3, 1);
      f.torsional_stiffness(k) = I * s.omega * s.omega * r.uniform(0.3, 1);
      f.damping(k)             = s.c * r.uniform(0.3, 1);
      f.torsional_damping(k)   = 2 * s.zeta * I * s.omega * r.uniform(0.3, 1);
    }
    if (r.chance(0.2)) f.force = 0.1 * b.weight(c) * b.direction();
    f.state = b.state();
    b.lossy = b.lossy || !f.force.isZero(0);
    b.add(f);
  }
  void bushing()
  {
    int a, c;
    pair(a, c);
    bushingBetween(a, c);
  }

  void beamBetween(int a, int c)
  {
    if (b.placed[c].point || b.placed[a].point) return;
    const Vector3 to   = b.placed[c].at;
    Vector3       from = b.placed[a].at;
    if (a == 0) from = to + b.length * r.uniform(0.7, 1.5) * b.direction();
    const double l = (to - from).norm();
    if (l < 0.3 * b.length) return;
    const Matrix3 R = b.axesFrom(to - from);
    const Stiff   s = b.stiff(b.lighter(a, c));
    Beam          f{b.at(c, to, R), b.at(a, from, R)};
    f.E       = 1e9;
    f.G       = 4e8;
    f.Izz     = s.k * l * l * l / (3 * f.E);
    f.Iyy     = f.Izz * r.uniform(0.5, 2);
    f.J       = f.Izz + f.Iyy;
    f.area    = r.uniform(5, 50) * s.k * l / f.E;
    f.damping = std::max(0.01 / s.omega, 2 * s.zeta / s.omega);
    if (r.chance(0.3)) f.shear_y = f.shear_z = 0.8 * f.area;
    f.state = b.state();
    b.add(f);
  }
  void beam()
  {
    int a, c;
    pair(a, c);
    beamBetween(a, c);
  }

  void friction()
  {
    std::vector<std::size_t> may;
    for (std::size_t k = 0; k < b.held.size(); k++)
      if (b.held[k].kind != Held::Other && b.held[k].joint.id >= 0) may.push_back(k);
    if (may.empty()) return;
    Held        &h = b.held[may[(std::size_t)r.integer(0, (int)may.size() - 1)]];
    const double v = b.length / b.period;
    b.add(JointFriction{h.joint, r.logarithmic(0.02, 0.3), 0.05 * b.length, v * r.logarithmic(3e-3, 3e-2)});
    h.joint = Element{};
  }

  /* a first-order actuator that pulls two bodies to a varying distance */
  void actuator()
  {
    int    a, c;
    Marker i, j;
    pair(a, c);
    ends(a, c, i, j);
    if (!apart(i, j)) return;
    const double l   = (DataOf(b.scene).frame(i).x - DataOf(b.scene).frame(j).x).norm(),
                 tau = b.period * r.logarithmic(0.01, 0.3), w = 2 * M_PI / b.period;
    const double gain = b.weight(c) / b.length * r.uniform(0.5, 2);
    const State  x    = b.scene.state(
            "",
            Expression{
            {Measure::distance(i, j), Measure::time(), Measure::value(State{(PetscInt)DataOf(b.scene).states.size()})},
            [=](const Real *m) -> Real { return (l * (1. + 0.2 * sin(w * m[1])) - m[0] - m[2]) / tau; }},
            0);
    states.push_back(x);
    b.add(UserScalarForce{i, j,
                          Expression{{Measure::value(x), Measure::rate(i, j)},
                                     [=](const Real *m) -> Real { return gain * m[0] - 0.05 * gain / w * m[1]; }},
                          false, b.state(0.4)});
  }

  /* quadratic drag by expressions; a force without reaction */
  void wind()
  {
    const int    c = b.anyBody();
    const Marker i = b.at(c, b.placed[c].at);
    const double v = b.length / b.period, k = 0.3 * b.weight(c) / (v * v);
    UserForce    f;
    f.i = i;
    for (int d = 0; d < 3; d++)
      f.force.push_back(Expression{{Measure::velocity(i, 0), Measure::velocity(i, 1), Measure::velocity(i, 2)},
                                   [=](const Real *m) -> Real {
                                     const Real speed = sqrt(m[0] * m[0] + m[1] * m[1] + m[2] * m[2] + 1e-4 * v * v);
                                     return -k * speed * m[d];
                                   }});
    f.state = b.state(0.3);
    b.add(f);
  }

  void moment()
  {
    const Held *h = revolute();
    if (!h) return;
    const double w = 2 * M_PI / b.period * r.uniform(0.5, 3),
                 M = 0.1 * h->mass * h->size * b.weightPerMass() * r.uniform(-1, 1);
    b.add(UserScalarForce{
        h->i, h->j,
        Expression{{Measure::time(), Measure::angle(h->i, h->j)},
                   [=](const Real *m) -> Real { return M * sin(w * m[0]) - 0.3 * std::abs(M) * sin(m[1]); }},
        true, b.state(0.4)});
  }

  /* a variable that other expressions use; sometimes of accelerations or reactions */
  void alias()
  {
    const int    c = b.anyBody();
    const Marker i = b.at(c, b.placed[c].at);
    const double v = b.length / b.period, m0 = b.placed[c].mass;
    const int    kind = r.choose({2, 1, lastJoint().id < 0 ? 0. : 1});
    Expression   e;
    if (kind == 0)
      e = Expression{{Measure::velocity(i, 0), Measure::velocity(i, 1)},
                     [=](const Real *m) -> Real { return v * tanh((m[0] + m[1]) / v); }};
    else if (kind == 1)
      e = Expression{{Measure::acceleration(i, 0)}, [=](const Real *m) -> Real { return 0.05 * m[0]; }};
    else
      e = Expression{{Measure::jointForce(lastJoint(), 0)}, [=](const Real *m) -> Real { return 0.02 / m0 * m[0]; }};
    const Variable V = b.scene.variable("", e, 0);
    variables.push_back(V);
    b.used[kind == 0 ? "variable of velocities" : kind == 1 ? "variable of accelerations" : "variable of reactions"]++;
    const double k = kind == 0 ? 0.2 * m0 / b.period : 0.5 * m0;
    UserForce    f;
    f.i = i;
    for (int d = 0; d < 3; d++)
      f.force.push_back(
          Expression{{Measure::value(V)}, [=](const Real *m) -> Real { return (d == 0 ? -k : 0.) * m[0]; }});
    b.add(f);
  }
  Element lastJoint()
  {
    for (std::size_t k = b.held.size(); k-- > 0;)
      if (b.held[k].joint.id >= 0) return b.held[k].joint;
    return Element{};
  }

  /* a force in the axes of a body, with reaction and moment */
  void follower()
  {
    int a, c;
    pair(a, c);
    if (b.placed[a].point || b.placed[a].flexible || b.placed[c].point) return;
    const Marker i = b.at(c, b.placed[c].at, b.placed[c].axes), j = b.at(a, b.placed[c].at);
    const double F = 0.3 * b.weight(c) * r.uniform(-1, 1), w = 2 * M_PI / b.period;
    UserForce    f{i, j, i, {}, {}, false};
    for (int d = 0; d < 3; d++)
      f.force.push_back(
          Expression{{Measure::time()}, [=](const Real *m) -> Real { return (d == 0 ? F : 0.) * cos(w * m[0]); }});
    for (int d = 0; d < 3; d++)
      f.moment.push_back(Expression{{Measure::time()},
                                    [=](const Real *m) -> Real { return (d == 2 ? 0.05 * F : 0.) * sin(w * m[0]); }});
    f.state = b.state(0.3);
    b.add(f);
  }
};

} // namespace soak

#endif
