/* Trees of bodies and closed loops: poses are chosen first, then joints with markers at the same place on both bodies,
   so that loops close */
#ifndef HHTDAE_SOAK_MODEL_TREES_H
#define HHTDAE_SOAK_MODEL_TREES_H

#include "model_builder.h"

namespace soak
{

class Trees
{
public:
  explicit Trees(Builder &builder) : b(builder), r(builder.random) {}

  /* a child of parent with any type of joint */
  int branch(int parent)
  {
    const Vector3 x = b.placed[parent].at + reach(parent);
    if (!b.planar && r.chance(0.06)) return bead(parent, x);
    const int child = b.addBody(x);
    if (b.planar)
      planarJoint(parent, child);
    else
      spatialJoint(parent, child);
    return child;
  }

  void tree(int bodies)
  {
    const double along = r.choose({1, 1}) ? 0.95 : 0.6; /* chains or bushes */
    int          last  = r.chance(0.7) || !b.bodies() ? 0 : b.anyBody();
    const int    root  = b.bodies() + 1;
    for (int k = 0; k < bodies; k++) {
      if (b.bodies() >= root && !r.chance(along)) last = r.integer(root, b.bodies());
      if (b.placed[last].point) last = 0;
      last = branch(last);
    }
  }

  /* Loops of joints about one normal: four-bars, five-bars, slider-cranks. In space, loops of revolute joints only are
     redundantly constrained */
  int planeLoop()
  {
    const int            n      = r.choose({5, 2, 1}) + 3;
    const Vector3        start  = b.placed[0].at + 2 * b.length * b.direction();
    const Matrix3        R      = b.planar ? Matrix3(Matrix3::Identity()) : b.axesAlong(r.direction());
    std::vector<Vector3> corner = {start};
    for (int k = 0; k < n; k++) { /* a convex polygon, far from flat */
      const double angle = M_PI * (0.15 + 0.9 * k / (n - 1.) + r.uniform(-0.1, 0.1));
      corner.push_back(corner.back() +
                       R * Vector3(std::cos(angle), std::sin(angle), 0) * b.length * r.uniform(0.6, 1.4));
    }
    std::vector<int> link = {0};
    for (int k = 0; k < n; k++)
      link.push_back(b.addBody((corner[k] + corner[k + 1]) / 2, frameIn(R, corner[k + 1] - corner[k])));
    for (int k = 0; k < n; k++) hold(Held::Revolute, link[k], link[k + 1], corner[k], R, false);
    closePlane(link.back(), corner, R, r.choose({4, 3, b.planar ? 0. : 1}));
    b.used["plane loop"]++;
    return n;
  }

  /* Loops of joints with arbitrary axes whose degrees of freedom sum up to seven or more */
  int spaceLoop()
  {
    const int            n      = r.integer(2, 5);
    std::vector<int>     link   = {0};
    std::vector<Vector3> corner = {2 * b.length * r.direction()};
    for (int k = 0; k < n; k++) {
      corner.push_back(corner.back() + b.length * r.uniform(0.7, 1.3) * r.direction());
      link.push_back(b.addBody((corner[k] + corner[k + 1]) / 2));
    }
    int       freedoms = 3; /* of the last joint, which is spherical */
    const int missing  = 7 - freedoms;
    for (int k = 0; k < n; k++) {
      const int rest = n - 1 - k, least = missing - (freedoms - 3) - 3 * rest; /* the remaining joints may be spherical */
      const int f = std::max(least, r.integer(1, 3));
      loopJoint(f, link[k], link[k + 1], corner[k]);
      freedoms += f;
    }
    hold(Held::Spherical, link.back(), 0, corner.back(), r.rotation(), false);
    b.used["space loop"]++;
    return n;
  }

  /* A platform connected to the ground by at most five links of constant length */
  int platform()
  {
    const int top = b.addBody(2 * b.length * r.direction());
    const int n   = r.integer(2, 5);
    for (int k = 0; k < n; k++) {
      const Vector3 x = b.on(top), y = x + b.length * r.uniform(0.8, 2) * r.direction();
      const Marker  i = b.at(top, x), j = b.at(0, y);
      b.held.push_back({b.add(PointDistance{i, j}), i, j, Held::Other, false, b.placed[top].mass, b.length});
    }
    b.used["platform of links"]++;
    return 1;
  }

  /* Adds what an element needs to drive the joint or to act in it: angular about z_j, or linear along the joint's free axis */
  Element hold(Held::Kind kind, int parent, int child, const Vector3 &x, const Matrix3 &R, bool free)
  {
    const Marker i = b.at(child, x, R), j = b.at(parent, x, R);
    Element      e;
    if (kind == Held::Revolute) e = b.add(Revolute{i, j});
    if (kind == Held::Translational) e = b.add(Translational{i, j});
    if (kind == Held::Cylindrical) e = b.add(Cylindrical{i, j});
    if (kind == Held::Spherical) e = b.add(Spherical{i, j});
    const int of = child ? child : parent;
    b.held.push_back({e, i, j, kind, free, b.placed[of].mass, b.placed[of].size});
    return e;
  }

private:
  Builder &b;
  Random  &r;

  Vector3 reach(int parent)
  {
    const Vector3 d = b.direction();
    return (parent == 0 ? 2.5 : 1) * b.length * r.uniform(0.7, 1.3) * d;
  }
  Vector3 between(int parent, int child) { return b.placed[child].at + r.uniform(0.3, 0.7) * shift(parent, child); }
  Vector3 shift(int parent, int child)
  {
    const Vector3 d = b.placed[parent].at - b.placed[child].at;
    return parent == 0 ? Vector3(d.normalized() * b.placed[child].size) : d;
  }
  Matrix3 frameIn(const Matrix3 &R, const Vector3 &along) /* z normal to the plane, x along a link */
  {
    Matrix3 F;
    F.col(2) = R.col(2);
    F.col(0) = along.normalized();
    F.col(1) = F.col(2).cross(F.col(0));
    return F;
  }

  void planarJoint(int parent, int child)
  {
    const Vector3 x = between(parent, child);
    const Matrix3 R = b.axes();
    switch (r.choose({6, 3, 0.7, 1.5})) {
    case 0:
      hold(Held::Revolute, parent, child, x, R, true);
      return;
    case 1:
      hold(Held::Translational, parent, child, x, R, true);
      tether(parent, child, x + b.length * R.col(0));
      return;
    case 2:
      add<Fixed>(parent, child, x, R);
      return;
    default:
      rod(parent, child);
    }
  }

  void spatialJoint(int parent, int child)
  {
    const Vector3 x = between(parent, child);
    const Matrix3 R = r.rotation(), across = R * Eigen::AngleAxisd(M_PI / 2, Vector3::UnitX()).toRotationMatrix();
    switch (r.choose({6, 3, 2.5, 2, 2, 1.5, 1, 1.2, 0.7, 1.5, 1.5, 0.6, 0.6, 0.6, 0.6, 0.6})) {
    case 0:
      hold(Held::Revolute, parent, child, x, R, true);
      return;
    case 1:
      hold(Held::Spherical, parent, child, x, R, true);
      return;
    case 2:
      hold(Held::Translational, parent, child, x, R, true);
      break;
    case 3:
      hold(Held::Cylindrical, parent, child, x, R, true);
      break;
    case 4:
      add<Universal>(parent, child, x, R, across);
      return;
    case 5:
      add<ConstantVelocity>(parent, child, x, R, bent(R));
      return;
    case 6:
      add<Planar>(parent, child, x, R);
      break;
    case 7:
      add<Fixed>(parent, child, x, R);
      return;
    case 8:
      screw(parent, child, x, R);
      return;
    case 9:
      rod(parent, child);
      return;
    case 10:
      curve(parent, child, x, R);
      return;
    case 11:
      add<InLine>(parent, child, x, R);
      break;
    case 12:
      add<InPlane>(parent, child, x, R);
      break;
    case 13:
      add<ParallelAxes>(parent, child, x, R);
      break;
    case 14:
      add<Perpendicular>(parent, child, x, R, across);
      break;
    default:
      add<Orientation>(parent, child, x, R);
    }
    tether(parent, child, x);
  }

  template <class Joint> Element add(int parent, int child, const Vector3 &x, const Matrix3 &Rj, const Matrix3 &Ri)
  {
    const Marker  i = b.at(child, x, Ri), j = b.at(parent, x, Rj);
    const Element e = b.add(Joint{i, j});
    b.held.push_back({e, i, j, Held::Other, false, b.placed[child].mass, b.placed[child].size});
    return e;
  }
  template <class Joint> Element add(int parent, int child, const Vector3 &x, const Matrix3 &R)
  {
    return add<Joint>(parent, child, x, R, R);
  }

  Matrix3 bent(const Matrix3 &R)
  {
    const double  phi = r.uniform(-M_PI, M_PI);
    const Vector3 axis(std::cos(phi), std::sin(phi), 0);
    return R * Eigen::AngleAxisd(r.uniform(0, 0.6), axis).toRotationMatrix();
  }

  void screw(int parent, int child, const Vector3 &x, const Matrix3 &R)
  {
    const double pitch = r.sign() * b.length * r.logarithmic(0.05, 3);
    const Marker i = b.at(child, x, R), j = b.at(parent, x, R);
    b.held.push_back({b.add(Screw{i, j, pitch}), i, j, Held::Other, false, b.placed[child].mass, b.placed[child].size});
  }

  void rod(int parent, int child)
  {
    const Vector3 x = b.on(child);
    Vector3       y = b.placed[parent].at + 0.3 * (x - b.placed[parent].at);
    if ((x - y).norm() < 0.2 * b.length) y = x + b.length * b.direction();
    const Marker i = b.at(child, x), j = b.at(parent, y);
    b.held.push_back(
        {b.add(PointDistance{i, j}), i, j, Held::Other, false, b.placed[child].mass, b.placed[child].size});
  }

  /* An arc or a closed curve through x, in the axes of a marker of the parent */
  void curve(int parent, int child, const Vector3 &x, const Matrix3 &R)
  {
    const double         radius = b.length * r.uniform(0.6, 2), rise = b.planar ? 0 : radius * r.uniform(0, 0.4);
    const int            n      = r.integer(8, 14);
    const bool           closed = r.chance(0.5);
    std::vector<Vector3> points;
    for (int k = 0; k < n; k++) {
      const double angle = closed ? 2 * M_PI * k / n : M_PI * (k / (n - 1.) - 0.5) * 1.6;
      points.emplace_back(radius * std::cos(angle), radius * std::sin(angle), rise * std::sin(2 * angle));
    }
    const std::size_t middle = closed ? 0 : n / 2;
    const Marker      i = b.at(child, x), j = b.at(parent, x - R * points[middle], R);
    b.held.push_back({b.add(PointOnCurve{i, j, points, closed}), i, j, Held::Other, false, b.placed[child].mass,
                      b.placed[child].size});
  }

  int bead(int parent, const Vector3 &x)
  {
    const int child = b.addPoint(x);
    switch (r.choose({1, 1, 1, 1})) {
    case 0:
      curve(parent, child, x, r.rotation());
      break;
    case 1:
      rod(parent, child);
      break;
    case 2:
      add<InLine>(parent, child, x, r.rotation());
      tether(parent, child, x);
      break;
    default:
      add<Spherical>(parent, child, x, Matrix3::Identity());
    }
    return child;
  }

  /* a sliding degree of freedom is usually held by a spring */
  void tether(int parent, int child, const Vector3 &x)
  {
    if (r.chance(0.15)) return;
    const Stiff s    = b.stiff(b.placed[child].mass);
    Vector3     from = b.on(child), to = x + b.length * (b.planar ? b.direction() : r.direction());
    if ((from - to).norm() < 0.3 * b.length) to += b.length * (b.planar ? Vector3(1, 0, 0) : Vector3(1, 1, 1));
    b.add(SpringDamper{b.at(child, from), b.at(parent, to), s.k, s.c, -1, 0, b.state()});
  }

  void closePlane(int last, const std::vector<Vector3> &corner, const Matrix3 &R, int kind)
  {
    const Vector3 x = corner.back();
    if (kind == 0)
      hold(Held::Revolute, 0, last, x, R, false);
    else if (kind == 1)
      slide(last, x, R);
    else { /* in space: without redundant constraints */
      const Marker i = b.at(last, x, R), j = b.at(0, x, R);
      b.add(InLine{i, j});
    }
  }
  /* guides the last link's end along a line: by a slider, or in the plane by an almost straight curve */
  void slide(int last, const Vector3 &x, const Matrix3 &R)
  {
    const double  angle  = r.uniform(-0.6, 0.6);
    const Vector3 along  = R * Vector3(std::cos(angle), std::sin(angle), 0);
    const int     slider = b.addBody(x);
    hold(Held::Revolute, last, slider, x, R, false);
    hold(Held::Translational, 0, slider, x, b.planar ? b.axesFrom(along) : b.axesAlong(along), false);
  }

  void loopJoint(int freedoms, int parent, int child, const Vector3 &x)
  {
    const Matrix3 R = r.rotation(), across = R * Eigen::AngleAxisd(M_PI / 2, Vector3::UnitX()).toRotationMatrix();
    if (freedoms >= 3)
      hold(Held::Spherical, parent, child, x, R, false);
    else if (freedoms == 1)
      hold(Held::Revolute, parent, child, x, R, false);
    else if (r.chance(0.6))
      add<Universal>(parent, child, x, R, across);
    else if (r.chance(0.5))
      add<ConstantVelocity>(parent, child, x, R, bent(R));
    else
      hold(Held::Cylindrical, parent, child, x, R, false);
  }
};

} // namespace soak

#endif
