/*
  Meshing teeth of two bodies on one carrier. The direction e of the tooth force and the pitch point P are fixed in the carrier.
  The points of both bodies at P have equal displacements along e,

    start + s_2 - s_1 = 0,     s = e . d + m . phi,     m = (P - x) x e,

  where d is the displacement of a body's marker relative to the carrier, phi its rotation and x the marker's position. About the axis of a
  wheel, phi is the angle over full turns. About the other axes, and for a rack, the joint of the body keeps phi zero, and only the
  derivatives of phi matter: because of them the load of the row on either body is exactly a force along e through P, and the row puts
  no load on the carrier, so that the bearings carry the force. s is the displacement only as long as a wheel's marker stays on its axis,
  which the rows of its joint ensure.

  Frames: markers of body 1 and body 2, and the marker on the carrier, which has the origin P and e as an axis. Multiplier: force on body 1 along e.
*/
#ifndef HHTDAE_SCENE_KERNELS_MESH_H
#define HHTDAE_SCENE_KERNELS_MESH_H

#include "angle.h"

namespace hhtdae
{

/* The joint that holds a body, in the axes of the carrier's marker */
struct MeshSide {
  Vec3<double> bearing = Vec3<double>::Zero();     /* origin of the joint's marker on the carrier */
  Mat3<double> axes    = Mat3<double>::Identity(); /* axes of that marker */
  Mat3<double> start   = Mat3<double>::Identity(); /* axes of the body's marker at the start */
};

template <bool Rack> struct MeshRow : Constraint<MeshRow<Rack>, 3, 1> {
  static constexpr const char *name   = Rack ? "rack mesh" : "gear mesh";
  static constexpr int         memory = Rack ? 1 : 2;
  struct Data {
    double   memory[2] = {}; /* angles of the wheels at the last accepted step, with full turns */
    MeshSide side[2];
    double   start = 0;
    double   moved = 0; /* as that of CouplerRow, coupler.h */
    int      axis  = 2; /* number of the axis of the carrier's marker that is e */
  };

  /* A body's marker in the axes of the carrier's marker */
  template <class T> static Frame<T> onCarrier(const Frame<T> &body, const Frame<T> &carrier)
  {
    const Vec3<T> u = body.x - carrier.x;
    Frame<T>      f;
    for (int r = 0; r < 3; r++) {
      f.x(r) = u.dot(carrier.R.col(r));
      for (int c = 0; c < 3; c++) f.R(r, c) = body.R.col(c).dot(carrier.R.col(r));
    }
    return f;
  }

  static Vec3<double> lever(const Vec3<double> &x, int axis) { return Vec3<double>::Unit(axis).cross(x); } /* (P - x) x e with P = 0 */

  /* Component c of (P - x) x e, also for dual numbers */
  template <class T> static T leverComponent(const Vec3<T> &x, int axis, int c)
  {
    const int a = (axis + 1) % 3, b = (axis + 2) % 3; /* e x x = -x_b a + x_a b, with (e, a, b) right-handed */
    return c == a ? -x(b) : c == b ? x(a) : T(0);
  }

  /* m . phi of a wheel that rotates about z of its bearing; z_i is parallel or opposite to z_j, as at the start */
  template <class T> static T wheel(const MeshSide &s, const Frame<T> &f, double remembered, int axis)
  {
    const Frame<T> bearing = Constant<T>(Frame<double>{s.bearing, s.axes});
    const double   side    = s.start.col(2).dot(s.axes.col(2)) < 0 ? -1 : 1;
    const Vec3<T>  z       = f.R.col(2) * T(side);
    const T        about_x = -z.dot(bearing.R.col(1)), about_y = z.dot(bearing.R.col(0)); /* z = z_j + phi x z_j */
    const Vec3<T>  phi     = bearing.R.col(0) * about_x + bearing.R.col(1) * about_y;
    T              tilt(0);
    for (int c = 0; c < 3; c++) tilt += leverComponent<T>(f.x, axis, c) * phi(c);
    return tilt + T(lever(s.bearing, axis).dot(s.axes.col(2))) * UnwoundAngle<T>(f, bearing, remembered);
  }

  /* m . phi of a body that does not rotate: from R start^T = 1 + [phi] */
  template <class T> static T rack(const MeshSide &s, const Frame<T> &f, int axis)
  {
    T sum(0);
    for (int c = 0; c < 3; c++) {
      const int a = (c + 1) % 3, b = (c + 2) % 3;
      T         phi(0);
      for (int k = 0; k < 3; k++) phi += f.R(b, k) * T(0.5 * s.start(a, k)) - f.R(a, k) * T(0.5 * s.start(b, k));
      sum += leverComponent<T>(f.x, axis, c) * phi;
    }
    return sum;
  }

  template <class T> static T toothDisplacement(const Data &d, const Frame<T> *f, int k)
  {
    const Frame<T> on   = onCarrier<T>(f[k], f[2]);
    const T        turn = Rack && k == 1 ? rack<T>(d.side[k], on, d.axis) : wheel<T>(d.side[k], on, d.memory[k], d.axis);
    return on.x(d.axis) + turn;
  }

  template <class T> static void value(const Data &d, const Frame<T> *f, const T &, T *phi)
  {
    phi[0] = T(d.start) + toothDisplacement<T>(d, f, 1) - toothDisplacement<T>(d, f, 0);
  }

  static void accept(Data &d, const Frame<double> *f)
  {
    for (int k = 0; k < MeshRow::memory; k++)
      d.memory[k] = UnwoundAngle<double>(onCarrier<double>(f[k], f[2]), {d.side[k].bearing, d.side[k].axes}, d.memory[k]);
  }
  static double longestStep(const Data &, const Frame<double> *, const Twist<double> *w, double, double angular)
  {
    double least = std::numeric_limits<double>::infinity();
    for (int k = 0; k < MeshRow::memory; k++) least = std::min(least, LongestTurn((w[k].w - w[2].w).norm(), angular));
    return least;
  }

  /* Sets the data from the pose at the start; bearing: frames of the joints' markers on the carrier */
  static void begin(Data &d, const Frame<double> *f, const Frame<double> *bearing)
  {
    for (int k = 0; k < 2; k++) {
      const Frame<double> j = onCarrier<double>(bearing[k], f[2]), i = onCarrier<double>(f[k], f[2]);
      d.side[k]             = {j.x, j.R, i.R};
      if (k < MeshRow::memory) d.memory[k] = PrincipalAngle<double>(i, j);
    }
    d.start = toothDisplacement<double>(d, f, 0) - toothDisplacement<double>(d, f, 1);
  }
  /* As that of CouplerRow; the teeth are others if they have other levers */
  static void continueFrom(Data &d, const Data *before, const Frame<double> *f)
  {
    const bool same = before && perAngle(d, 0) == perAngle(*before, 0) && perAngle(d, 1) == perAngle(*before, 1);
    d.moved         = same ? before->moved : toothDisplacement<double>(d, f, 0) - toothDisplacement<double>(d, f, 1) - d.start;
    d.start += d.moved;
  }

  /* Displacement at P along e per angle of a wheel, and per advance of the rack along axis `along` of its bearing */
  static double perAngle(const Data &d, int k) { return lever(d.side[k].bearing, d.axis).dot(d.side[k].axes.col(2)); }
  static double perAdvance(const Data &d, int along) { return d.side[1].axes(d.axis, along); }
};

} // namespace hhtdae

#endif
