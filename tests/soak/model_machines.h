/* Gears, racks, couplers; rolling and knife edges; contacts; shakers; flexible bodies with bodies attached to them */
#ifndef HHTDAE_SOAK_MODEL_MACHINES_H
#define HHTDAE_SOAK_MODEL_MACHINES_H

#include "model_trees.h"

namespace soak
{

class Machines
{
public:
  Machines(Builder &builder, const std::vector<ReducedPart> &parts)
      : b(builder), r(builder.random), trees_(builder), parts_(parts)
  {
  }

  /* two or three bodies on one base whose motions are coupled */
  int couple()
  {
    const int         base = b.bodies() && r.chance(0.4) ? b.anyRigid() : 0;
    const int         kind = r.choose({2, 2, 2});
    std::vector<bool> turns;
    if (kind == 0)
      turns = {true, true};
    else if (kind == 1)
      turns = {true, false};
    else
      for (int k = r.integer(2, 3); k > 0; k--) turns.push_back(r.chance(0.6));
    std::vector<Coupler::Term> terms;
    for (bool t : turns) {
      const std::size_t at    = b.held.size();
      const Vector3     x     = b.placed[base].at + b.length * r.uniform(1, 2) * b.direction();
      const int         child = b.addBody(x);
      trees_.hold(t ? t && !b.planar && kind == 2 && r.chance(0.2) ? Held::Cylindrical : Held::Revolute
                    : Held::Translational,
                  base, child, x + 0.2 * b.length * b.direction(), b.axes(), false);
      terms.push_back({b.held[at].i, b.held[at].j, t, (t ? b.length : 1) * r.sign() * r.uniform(0.3, 2)});
      if (b.held[at].kind == Held::Cylindrical || r.chance(0.3)) spring(base, child);
    }
    const double ratio = r.sign() * r.logarithmic(0.2, 5);
    if (kind == 0)
      b.add(Gear{terms[0].i, terms[0].j, terms[1].i, terms[1].j, ratio});
    else if (kind == 1)
      b.add(RackAndPinion{terms[0].i, terms[0].j, terms[1].i, terms[1].j, 0.5 * b.length * ratio / 2});
    else
      b.add(Coupler{terms});
    return (int)turns.size();
  }

  /* on a plane across the upward direction */
  int roll()
  {
    const double  radius = b.length * r.uniform(0.2, 0.8);
    const Matrix3 plane  = level();
    const Vector3 touch  = b.planar ? Vector3(r.uniform(-2, 2) * b.length, 0, 0)
                                    : Vector3(plane * Vector3(r.uniform(-2, 2), r.uniform(-2, 2), 0) * b.length);
    const double  m = b.mass * r.logarithmic(0.3, 3), I = 0.4 * m * radius * radius;
    b.project           = b.project || b.speed > 0;
    const Marker ground = b.at(0, touch, plane);
    if (b.planar) {
      const int ball = b.addBody(touch + radius * b.up, b.axes(), m, radius, Matrix3::Identity() * I);
      b.add(RollingDisc{b.at(ball, b.placed[ball].at), ground, radius});
      return 1 + load(ball);
    }
    switch (r.choose({1, 1, 1})) {
    case 0: {
      const int ball = b.addBody(touch + radius * plane.col(2), b.axes(), m, radius, Matrix3::Identity() * I);
      b.add(RollingSphere{b.at(ball, b.placed[ball].at), ground, radius});
      return 1 + (r.chance(0.4) ? load(ball) : 0);
    }
    case 1:
      return disc(touch, plane, ground, m, radius);
    default: {
      const int sleigh = b.addBody(touch, plane);
      b.add(KnifeEdge{b.at(sleigh, touch + 0.3 * b.length * plane.col(0), plane), ground});
      b.add(ParallelAxes{b.at(sleigh, touch, plane), ground});
      return 1 + (r.chance(0.4) ? load(sleigh) : 0);
    }
    }
  }

  int contact()
  {
    const double size = b.length * r.uniform(0.2, 0.6);
    const double m    = b.mass * r.logarithmic(0.3, 3);
    switch (b.planar ? r.choose({2, 2, 0, 2, 2}) : r.choose({2, 2, 2, 2, 2})) {
    case 0:
      return spheres(m, size, false);
    case 1:
      return ellipsoid(m, size);
    case 2:
      return tire(m, size);
    case 3:
      return spheres(m, size, true);
    default:
      return onBox(m, size);
    }
  }

  /* a table that is moved along two or three axes without rotation */
  int shaker(const std::function<TimeFunction()> &motion)
  {
    const Vector3 x     = 2 * b.length * b.direction();
    const int     table = b.addBody(x);
    const Matrix3 R     = b.axes();
    const Marker  i = b.at(table, x, R), j = b.at(0, x, R);
    if (b.planar)
      b.add(RotationalMotion{i, j, TimeFunction(0)});
    else
      b.add(Orientation{i, j});
    for (int axis = 0; axis < (b.planar ? 2 : 3); axis++)
      b.add(TranslationalMotion{i, j, r.chance(0.4) ? TimeFunction(0) : motion(), MotionOf::Displacement, axis});
    b.used["shaker"]++;
    b.project = true;
    return 1;
  }

  int flexible()
  {
    const ReducedPart part = parts_[(std::size_t)r.integer(0, (int)parts_.size() - 1)];
    const int         base = b.bodies() && r.chance(0.4) ? b.anyRigid() : 0;
    const Matrix3     R    = r.rotation();
    const Vector3     hub  = b.placed[base].at + b.length * r.direction();
    FlexibleBody      f;
    f.model               = part;
    f.rotation            = R;
    f.position            = hub - R * part->attachments[0].position;
    f.mass                = r.choose({3, 1}) ? ModalMass::Partial : ModalMass::Full;
    f.damping             = {{100, r.logarithmic(0.005, 0.05)}, {1e9, r.logarithmic(0.02, 0.2)}};
    f.velocity            = b.startVelocity();
    f.angular_velocity    = b.startSpin();
    const Body       body = b.scene.add("", f);
    std::vector<int> frame;
    for (const ModalAttachment &a : part->attachments) {
      const Placed p{
          b.scene.attachment(body, a.name), f.position + R * a.position, R, part->mass / 3, 0.5, false, true};
      frame.push_back(b.enter(p));
    }
    b.used["flexible body"]++;
    modal.push_back(body);
    hang(base, frame[0], hub);
    for (std::size_t k = 1; k < frame.size(); k++)
      if (r.chance(0.6)) tip(frame[k], part->mass);
    return (int)frame.size();
  }
  std::vector<Body> modal;

private:
  Builder                        &b;
  Random                         &r;
  Trees                           trees_;
  const std::vector<ReducedPart> &parts_;

  void spring(int a, int c)
  {
    const Stiff s = b.stiff(b.lighter(a, c));
    b.add(SpringDamper{b.at(c, b.on(c)), b.at(a, b.placed[c].at + 1.5 * b.length * b.direction()), s.k, s.c, -1, 0,
                       b.state()});
  }

  /* axes of a plane with its normal upwards; planar: a line along x */
  Matrix3 level()
  {
    if (b.planar) return b.turn(0);
    return Eigen::AngleAxisd(r.uniform(0, 0.15), r.direction()).toRotationMatrix() * b.turn(r.uniform(-M_PI, M_PI));
  }

  /* a pendulum on a rolling body */
  int load(int on)
  {
    const Vector3 x     = b.placed[on].at + b.length * b.direction();
    const int     child = b.addBody(x);
    trees_.hold(b.planar || r.chance(0.5) ? Held::Revolute : Held::Spherical, on, child, b.placed[on].at, b.axes(),
                true);
    return 1;
  }

  /* fast enough to stay upright */
  int disc(const Vector3 &touch, const Matrix3 &plane, Marker ground, double m, double radius)
  {
    const double  lean = r.uniform(-0.2, 0.2), g = b.gravity.norm() + 0.1 * b.length / (b.period * b.period);
    const Matrix3 R    = plane * Eigen::AngleAxisd(lean, Vector3::UnitX()).toRotationMatrix();
    const Vector3 axis = R.col(1), upward = (plane.col(2) - plane.col(2).dot(axis) * axis).normalized(),
                  center = touch + radius * upward;
    Matrix3 A;
    A << R.col(0), upward, R.col(0).cross(upward);
    RigidBody d;
    d.mass             = m;
    d.inertia          = Vector3(0.25, 0.25, 0.5).asDiagonal() * (m * radius * radius);
    d.position         = center;
    d.rotation         = A;
    d.angular_velocity = A.col(2) * r.sign() * std::sqrt(g / radius) * r.uniform(1.2, 3);
    d.velocity         = d.angular_velocity.cross(center - touch);
    b.project          = true; /* other bodies attached to it must move along */
    const int wheel    = b.enter({b.scene.add("", d), center, A, m, radius, false, false});
    b.add(RollingDisc{b.at(wheel, center, A), ground, radius});
    return 1;
  }

  ContactLaw law(double m, double size)
  {
    const double g = std::max(b.gravity.norm(), b.length / (b.period * b.period));
    ContactLaw   c;
    c.exponent = r.choose({2, 1, 1}) == 0 ? 1.5 : r.uniform(1, 2.2);
    if (r.chance(0.2)) c.exponent = 1;
    c.stiffness     = m * g / std::pow(size * r.logarithmic(1e-3, 2e-2), c.exponent);
    c.damping       = r.chance(0.7) ? r.uniform(0.05, 1) / std::sqrt(g * b.length) : 0;
    c.friction      = r.chance(0.6) ? r.uniform(0.05, 0.8) : 0;
    c.slip_velocity = std::sqrt(g * b.length) * r.logarithmic(1e-3, 1e-2);
    if (c.friction > 0) b.used["contact with friction"]++;
    return c;
  }
  double  gap(double size) { return size * r.uniform(-0.001, 0.5); }
  Matrix3 plane() { return b.planar ? Matrix3(Matrix3::Identity()) : level(); }
  Vector3 normal(const Matrix3 &R) const { return b.planar ? R.col(1) : R.col(2); }
  Vector3 place()
  {
    Vector3 x = 3 * b.length * r.vector();
    if (b.planar) x(2) = 0;
    return x;
  }

  int spheres(double m, double size, bool two)
  {
    const Vector3 x = place();
    const Matrix3 R = plane(), I = Matrix3::Identity() * (0.4 * m * size * size);
    const int     below  = b.addBody(x, b.axes(), m, size, I);
    const Marker  center = b.at(below, x);
    b.add(SpherePlane{center, b.at(0, x - (size + gap(size)) * normal(R), R), size, law(m, size), b.state()});
    if (!two) return 1;
    const double  other = size * r.uniform(0.5, 1);
    const Vector3 off = (normal(R) + 0.3 * b.direction()).normalized(), y = x + (size + other + gap(size)) * off;
    const int     above = b.addBody(y, b.axes(), m, other, Matrix3::Identity() * (0.4 * m * other * other));
    b.add(SphereSphere{b.at(above, y), center, other, size, law(m, other), b.state()});
    return 2;
  }

  int ellipsoid(double m, double size)
  {
    const Vector3 x = place();
    const Matrix3 R = plane(), A = b.axes();
    Vector3       s = size * Vector3(1, r.uniform(0.5, 1), r.uniform(0.5, 1)), e = 2 * s / std::sqrt(5. / 3);
    const int     body  = b.addBody(x, A, m, size, Builder::inertiaOfBox(m, e));
    const Vector3 n     = A.transpose() * normal(R);
    const double  reach = std::sqrt(s.cwiseProduct(n).squaredNorm());
    b.add(
        EllipsoidPlane{b.at(body, x, A), b.at(0, x - (reach + gap(size)) * normal(R), R), s, law(m, size), b.state()});
    return 1;
  }

  int tire(double m, double size)
  {
    const Vector3 x    = place();
    const Matrix3 R    = plane(),
                  A    = R * Eigen::AngleAxisd(M_PI / 2 + r.uniform(-0.3, 0.3), Vector3::UnitX()).toRotationMatrix();
    const double tube  = size * r.uniform(0.1, 0.3);
    const int    wheel = b.addBody(x, A, m, size, Vector3(0.3, 0.3, 0.5).asDiagonal() * (m * size * size));
    b.add(TorusPlane{b.at(wheel, x, A), b.at(0, x - (size + tube + gap(size)) * R.col(2), R), size, tube, law(m, size),
                     b.state()});
    return 1;
  }

  /* a ball above a face of a box that is fixed or held by a bushing */
  int onBox(double m, double size)
  {
    const Vector3 x = place(), half = size * Vector3(r.uniform(1, 3), r.uniform(1, 3), r.uniform(1, 3));
    const Matrix3 R = plane();
    const Vector3 y = x - (size + gap(size) + (b.planar ? half(1) : half(2))) * normal(R) +
                      0.3 * size * (b.planar ? R.col(0) : R.col(1));
    const int  ball = b.addBody(x, b.axes(), m, size, Matrix3::Identity() * (0.4 * m * size * size));
    const bool hung = r.chance(0.5);
    const int  box  = hung ? b.addBody(y, R, 3 * m, size, Builder::inertiaOfBox(3 * m, 2 * half)) : 0;
    if (hung) {
      const Stiff  s = b.stiff(3 * m);
      const double I = m * half.squaredNorm();
      Bushing      hold{b.at(box, y, R), b.at(0, y, R)};
      hold.stiffness           = Vector3::Constant(s.k);
      hold.damping             = Vector3::Constant(s.c + 0.1 * s.k / s.omega);
      hold.torsional_stiffness = Vector3::Constant(I * s.omega * s.omega);
      hold.torsional_damping   = Vector3::Constant(0.4 * I * s.omega);
      b.add(hold);
    }
    b.add(SphereBox{b.at(ball, x), b.at(box, y, R), size, half, law(m, size), b.state()});
    return hung ? 2 : 1;
  }

  void hang(int base, int frame, const Vector3 &x)
  {
    const Matrix3 R = r.rotation();
    if (r.chance(0.4)) {
      const Marker i = b.at(frame, x, R), j = b.at(base, x, R);
      b.add(Fixed{i, j});
    } else
      trees_.hold(r.chance(0.6) ? Held::Revolute : Held::Spherical, base, frame, x, R, true);
  }
  void tip(int frame, double m)
  {
    const double  before = b.mass;
    const Vector3 x      = b.placed[frame].at;
    b.mass               = m * r.logarithmic(0.1, 1);
    const int child      = b.addBody(x + 0.3 * b.length * r.direction());
    b.mass               = before;
    trees_.hold(r.chance(0.6) ? Held::Revolute : Held::Spherical, frame, child, x, r.rotation(), true);
  }
};

} // namespace soak

#endif
