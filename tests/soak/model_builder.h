/* Shared by the generators of models: the scene under construction; its bodies with pose and mass; joints that may be
   driven or have friction; scales of length, time and velocity from which stiffness, damping and forces are drawn */
#ifndef HHTDAE_SOAK_MODEL_BUILDER_H
#define HHTDAE_SOAK_MODEL_BUILDER_H

#include "balance/specs.h"
#include "hhtdae/scene.h"
#include "model_parts.h"
#include "model_random.h"
#include "scene/model.h"
#include <map>
#include <memory>
#include <string>
#include <vector>

namespace soak
{

using namespace hhtdae;

/* A body and its initial position; entry 0 is the ground */
struct Placed {
  Body    body;
  Vector3 at; /* position of the centre */
  Matrix3 axes;
  double  mass, size; /* size: a typical length */
  bool    point = false, flexible = false;
};

struct Held {
  enum Kind { Revolute, Translational, Cylindrical, Spherical, Other };
  Element joint;
  Marker  i, j;
  Kind    kind;
  bool    free; /* nothing else determines its motion, so that it may be driven */
  double  mass, size;
};

/* Stiffness and damping of a mass */
struct Stiff {
  double k, c, omega, zeta;
};

class Builder
{
public:
  Scene                     &scene;
  Random                    &random;
  const bool                 planar;
  hhtest::Specs              specs; /* descriptions of the elements, for the balances */
  std::vector<Placed>        placed;
  std::vector<Held>          held;
  std::map<std::string, int> used;                             /* numbers of features that the types of elements do not show */
  double                     length = 1, mass = 1, period = 2; /* scales of the model */
  double                     speed   = 0;     /* initial speed of bodies in lengths per period; 0: at rest */
  bool                       lossy   = false; /* energy is not conserved */
  bool                       project = false; /* initial velocities must be projected onto the constraints */
  Vector3                    up, gravity;
  double                     stiffest = 0, softest = 1e300;
  Vector3 push = Vector3::Zero(); /* a small displacement of bodies and points, in lengths of the model */

  Builder(Scene &s, Random &r, bool plane)
      : scene(s), random(r), planar(plane), up(plane ? Vector3(0, 1, 0) : Vector3(0, 0, 1))
  {
    placed.push_back({s.ground(), Vector3::Zero(), Matrix3::Identity(), 0, 1, false, false});
  }

  int bodies() const { return (int)placed.size() - 1; }

  template <class Spec> Element add(const Spec &spec) { return specs.add(scene, "", spec); }

  /* ---- positions and axes ---- */
  Vector3 direction()
  {
    const Vector3 d = random.direction();
    return planar ? inPlane(d) : d;
  }
  Vector3 inPlane(const Vector3 &d)
  {
    return std::hypot(d(0), d(1)) > 1e-3 ? Vector3(d(0), d(1), 0).normalized() : Vector3(1, 0, 0);
  }
  Matrix3 axes() { return planar ? turn(random.uniform(-M_PI, M_PI)) : random.rotation(); }
  Matrix3 turn(double angle) const { return Eigen::AngleAxisd(angle, Vector3::UnitZ()).toRotationMatrix(); }
  /* the third axis along z */
  Matrix3 axesAlong(const Vector3 &z)
  {
    const Vector3 n = z.normalized(), other = std::abs(n(0)) < 0.8 ? Vector3::UnitX() : Vector3::UnitY();
    Matrix3       R;
    R.col(2) = n;
    R.col(0) = (other - n.dot(other) * n).normalized();
    R.col(1) = R.col(2).cross(R.col(0));
    return R;
  }
  /* the first axis along x */
  Matrix3 axesFrom(const Vector3 &x)
  {
    if (planar) return turn(std::atan2(x(1), x(0)));
    const Matrix3 A = axesAlong(x);
    Matrix3       R;
    R << A.col(2), A.col(0), A.col(1);
    return R;
  }
  Marker at(int b, const Vector3 &x, const Matrix3 &R = Matrix3::Identity())
  {
    return scene.markerAt(placed[b].body, x, R);
  }
  /* a random point of body b */
  Vector3 on(int b)
  {
    const Placed &p = placed[b];
    if (p.point || p.flexible) return p.at;
    Vector3 d = random.vector();
    if (planar) d(2) = 0;
    return p.at + (b == 0 ? 2 : 0.5) * p.size * d + disturbance();
  }

  /* in alternating directions, so that it is not a motion of the whole model */
  Vector3 disturbance()
  {
    Vector3 d = (pushed_++ % 2 ? -length : length) * push;
    if (planar) d(2) = 0;
    return d;
  }

  /* ---- bodies ---- */
  int addBody(const Vector3 &x) { return addBody(x, axes()); }
  int addBody(const Vector3 &x, const Matrix3 &R)
  {
    const double size = length * random.logarithmic(0.5, 1.5), m = mass * random.logarithmic(0.3, 3);
    Vector3      edges(random.uniform(0.3, 1), random.uniform(0.15, 0.6), random.uniform(0.1, 0.5));
    edges *= size;
    return addBody(x + disturbance(), R, m, size, inertiaOfBox(m, edges));
  }
  int addBody(const Vector3 &x, const Matrix3 &R, double m, double size, const Matrix3 &inertia)
  {
    RigidBody b;
    b.mass     = m;
    b.inertia  = inertia;
    b.rotation = R;
    b.position = x;
    if (random.chance(0.2)) { /* an origin other than the centre of mass */
      b.center = 0.2 * size * random.vector();
      if (planar) b.center(2) = 0;
      b.position = x - R * b.center;
    }
    b.velocity         = startVelocity();
    b.angular_velocity = startSpin();
    return enter({scene.add("", b), x, R, m, size, false, false});
  }
  int addPoint(const Vector3 &x)
  {
    PointMass b;
    b.mass     = mass * random.logarithmic(0.3, 3);
    b.position = x;
    b.velocity = startVelocity();
    used["point mass"]++;
    return enter({scene.add("", b), x, Matrix3::Identity(), b.mass, length, true, false});
  }
  int enter(const Placed &p)
  {
    placed.push_back(p);
    return bodies();
  }
  static Matrix3 inertiaOfBox(double m, const Vector3 &e)
  {
    return Vector3(e(1) * e(1) + e(2) * e(2), e(0) * e(0) + e(2) * e(2), e(0) * e(0) + e(1) * e(1)).asDiagonal() *
           (m / 12);
  }
  Vector3 startVelocity()
  {
    if (speed == 0) return Vector3::Zero();
    Vector3 v = speed * length / period * random.vector();
    if (planar) v(2) = 0;
    return v;
  }
  Vector3 startSpin()
  {
    if (speed == 0) return Vector3::Zero();
    const Vector3 w = 2 * speed / period * random.vector();
    return planar ? Vector3(0, 0, w(2)) : w;
  }

  /* ---- scales ---- */
  /* with a frequency between about that of the model and 1e4 times that; fast ones are damped, because the runs last
     only a few periods of the model */
  Stiff stiff(double m)
  {
    Stiff        s;
    const double ratio = random.logarithmic(1.5, random.chance(0.3) ? 1e4 : 60);
    s.omega            = 2 * M_PI / period * ratio;
    s.zeta = ratio > 25 ? random.logarithmic(0.05, 1) : random.chance(0.3) ? 0 : random.logarithmic(0.003, 0.5);
    s.k    = m * s.omega * s.omega;
    if (s.k > 1e8) {
      s.k     = 1e8;
      s.omega = std::sqrt(s.k / m);
    }
    s.c      = 2 * s.zeta * m * s.omega;
    lossy    = lossy || s.zeta > 0;
    stiffest = std::max(stiffest, s.k);
    softest  = std::min(softest, s.k);
    return s;
  }
  double inertia(int b) const { return 0.08 * placed[b].mass * placed[b].size * placed[b].size; }
  /* mass of the lighter of two bodies, one of which may be the ground */
  double lighter(int a, int b) const
  {
    return a == 0 ? placed[b].mass : b == 0 ? placed[a].mass : std::min(placed[a].mass, placed[b].mass);
  }
  double lighterInertia(int a, int b) const
  {
    return a == 0 ? inertia(b) : b == 0 ? inertia(a) : std::min(inertia(a), inertia(b));
  }
  double weightPerMass() const { return std::max(gravity.norm(), length / (period * period)); }
  double weight(int b) const { return placed[b].mass * weightPerMass(); }
  bool   state(double p = 0.15) /* whether to use a force state */
  {
    const bool yes = random.chance(p);
    if (yes) used["force state"]++;
    return yes;
  }
  int anyBody() { return random.integer(1, bodies()); }
  int anyRigid() /* 0: there is none */
  {
    for (int tries = 0; tries < 20; tries++) {
      const int b = anyBody();
      if (!placed[b].point) return b;
    }
    return 0;
  }

private:
  int pushed_ = 0;
};

} // namespace soak

#endif
