/*
  Pairs of shapes in contact, shape i on the first marker, shape j on the second. touch() gives the penetration (negative: the
  gap), the unit normal from j to i and the contact point, all in space axes. Normal and point are consistent: for every
  motion of the markers the rate of penetration is -n.v, where v is the velocity of i's material at the contact point relative
  to that of j. The contact point is the deepest point of shape i, so that a wheel of radius R rolls at the speed R w for any
  penetration; between two spheres it is the middle of the overlap.
*/
#ifndef HHTDAE_SCENE_KERNELS_CONTACT_SHAPES_H
#define HHTDAE_SCENE_KERNELS_CONTACT_SHAPES_H

#include "scene/frames.h"
#include <algorithm>
#include <cmath>

namespace hhtdae
{

template <class T> struct Touch {
  T       depth;
  Vec3<T> n, p;
};

/* A sphere at i on the plane through j's origin, with matter below it. The normal of the plane is z_j in space, and y_j in a planar scene, where
   the "sphere" is a disc on the line along x_j */
struct SpherePlaneShape {
  static constexpr const char *name      = "sphere on plane";
  static constexpr bool        axes_of_j = true;
  struct Data {
    double radius;
    int    axis;
  };
  static double extent(const Data &) { return 0; } /* largest distance from i's origin of points that move where i turns */
  template <class T> static void touch(const Data &d, const Frame<T> *f, Touch<T> &t)
  {
    t.n             = f[1].R.col(d.axis);
    const Vec3<T> x = f[0].x - f[1].x;
    const T       h = t.n.dot(x);
    t.depth         = T(d.radius) - h;
    t.p             = f[0].x - t.n * T(d.radius);
  }
};

/* An ellipsoid with semiaxes a along i's axes. Its lowest point above the plane, where the gradient of the quadric is
   along n, is x_i - A m/|m|, m = A n, A = R_i diag(a) R_i^T. The lowest point is |m| below x_i. m is never zero. */
struct EllipsoidPlaneShape {
  static constexpr const char *name      = "ellipsoid on plane";
  static constexpr bool        axes_of_j = true;
  struct Data {
    double a[3];
    int    axis;
  };
  static double extent(const Data &d) { return std::max({d.a[0], d.a[1], d.a[2]}); }
  template <class T> static void touch(const Data &d, const Frame<T> *f, Touch<T> &t)
  {
    using std::sqrt;
    t.n               = f[1].R.col(d.axis);
    const Vec3<T> x   = f[0].x - f[1].x;
    Vec3<T>       low = f[0].R.transpose() * t.n; /* becomes -diag(a^2) n/reach, in i's axes */
    T             reach2(0);
    for (int k = 0; k < 3; k++) {
      const T m = low(k) * T(d.a[k]);
      reach2 += m * m;
      low(k) = m * T(-d.a[k]);
    }
    const T       reach = sqrt(reach2), h = t.n.dot(x), inverse = T(1) / reach;
    const Vec3<T> support = f[0].R * low;
    t.depth               = reach - h;
    t.p                   = f[0].x + support * inverse;
  }
};

/* A torus about z_i: a circle of radius R in i's xy plane, and a tube of radius r. Let u be the projection of the plane's
   normal n on the xy plane of i. The lowest point of the circle is x_i - R u/|u|, R |u| below x_i. A torus that lies flat
   (u = 0) has no lowest point: for |u| < 1e-3, a tilt of 0.06 degrees, |u| is replaced by an even polynomial that is
   twice continuously differentiable at |u| = 1e-3 and 3/8 of 1e-3 at u = 0; the contact point then moves through the
   middle of the ring. */
struct TorusPlaneShape {
  static constexpr const char *name      = "torus on plane";
  static constexpr bool        axes_of_j = true;
  static constexpr double      flat_sine = 1e-3; /* sine of the angle between the torus' plane and the plane, below which |u| is replaced */
  struct Data {
    double radius, tube;
  };
  static double extent(const Data &d) { return d.radius + d.tube; }
  template <class T> static void touch(const Data &d, const Frame<T> *f, Touch<T> &t)
  {
    using std::sqrt;
    t.n                = f[1].R.col(2);
    const Vec3<T> axis = f[0].R.col(2), x = f[0].x - f[1].x;
    const T       c = t.n.dot(axis), h = t.n.dot(x);
    const Vec3<T> u  = t.n - axis * c;
    const T       uu = u.squaredNorm();
    T             reach, slope; /* |u| and 1/|u| = 2 d|u|/d(u.u) */
    if (Plain(uu) >= flat_sine * flat_sine) {
      reach = sqrt(uu);
      slope = T(1) / reach;
    } else {
      const T y = uu * T(1 / (flat_sine * flat_sine));
      reach     = T(flat_sine) * (T(0.375) + y * (T(0.75) - T(0.125) * y));
      slope     = T(1 / flat_sine) * (T(1.5) - T(0.5) * y);
    }
    t.depth = reach * T(d.radius) + T(d.tube) - h;
    slope   = slope * T(d.radius);
    t.p     = f[0].x - u * slope - t.n * T(d.tube);
  }
};

/* Two spheres, each outside the other. The length of the normal decreases smoothly to zero where the centres coincide to 1e-6 of the radii */
struct SphereSphereShape {
  static constexpr const char *name      = "sphere on sphere";
  static constexpr bool        axes_of_j = false; /* the components of the force are in space axes */
  struct Data {
    double radius_i, radius_j;
  };
  static double through(const Data &d) { return 0.5 * std::min(d.radius_i, d.radius_j); }
  static double extent(const Data &) { return 0; }
  template <class T> static void touch(const Data &d, const Frame<T> *f, Touch<T> &t)
  {
    using std::sqrt;
    const double  sum = d.radius_i + d.radius_j, guard = 1e-6 * sum;
    const Vec3<T> x       = f[0].x - f[1].x;
    const T       length2 = x.squaredNorm() + T(guard * guard), length = sqrt(length2), inverse = T(1) / length;
    const T       arm = T(0.5 * (d.radius_i - d.radius_j)) + length * T(0.5); /* radius_i - depth/2 */
    t.n               = x * inverse;
    t.depth           = T(sum) - length;
    t.p               = f[0].x - t.n * arm;
  }
};

/* A sphere at i against the box |x| <= half in j's axes. If the sphere's centre is outside the box, the nearest point of
   the box is the centre clamped to the box, on a face, an edge or a corner; depth and normal are continuous between these
   (the normal's derivative jumps). A centre inside the box is pushed out through the nearest face, and the normal jumps
   where two faces are equally near: radius and stiffness must be large enough to keep the centre outside. half may be
   infinite along an axis. */
struct SphereBoxShape {
  static constexpr const char *name      = "sphere on box";
  static constexpr bool        axes_of_j = true;
  struct Data {
    double radius, half[3];
  };
  static double through(const Data &d) { return 0.5 * std::min({d.radius, d.half[0], d.half[1], d.half[2]}); }
  static double extent(const Data &) { return 0; }
  template <class T> static void touch(const Data &d, const Frame<T> *f, Touch<T> &t)
  {
    using std::sqrt;
    const Vec3<T> x = f[0].x - f[1].x, c = f[1].R.transpose() * x;
    double        excess[3]; /* |c| - half along each axis */
    int           nearest = 0, out = 0;
    for (int k = 0; k < 3; k++) {
      excess[k] = std::abs(Plain(c(k))) - d.half[k];
      if (excess[k] > excess[nearest]) nearest = k;
      if (excess[k] > 0) out++;
    }
    Vec3<T> n(T(0), T(0), T(0));
    T       distance;
    if (out < 2) {
      const double sign = Plain(c(nearest)) < 0 ? -1 : 1;
      n(nearest)        = T(sign);
      distance          = c(nearest) * T(sign) - T(d.half[nearest]);
    } else {
      T sum(0);
      for (int k = 0; k < 3; k++) {
        if (excess[k] <= 0) continue;
        n(k) = c(k) - T(Plain(c(k)) < 0 ? -d.half[k] : d.half[k]);
        sum += n(k) * n(k);
      }
      distance        = sqrt(sum);
      const T inverse = T(1) / distance;
      n               = n * inverse;
    }
    t.n     = f[1].R * n;
    t.depth = T(d.radius) - distance;
    t.p     = f[0].x - t.n * T(d.radius);
  }
};

} // namespace hhtdae

#endif
