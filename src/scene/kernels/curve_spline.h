/*
  Space curves: a cubic spline c(s) through points, with the chord length as parameter s, and two unit
  normals; all are twice continuously differentiable.

  An open curve has no curvature at its ends (natural spline) and continues beyond them along its end tangents, still
  twice continuously differentiable: a point that leaves the curve slides along a straight line. A closed curve is
  periodic.
*/
#ifndef HHTDAE_SCENE_CURVE_SPLINE_H
#define HHTDAE_SCENE_CURVE_SPLINE_H

#include "scene/frames.h"
#include <algorithm>
#include <cmath>
#include <limits>
#include <string>
#include <vector>

namespace hhtdae
{

/* Cubic spline through vectors at knots; if it is periodic, the last value repeats the first */
class VectorSpline
{
public:
  VectorSpline() = default;
  VectorSpline(std::vector<double> knots, const std::vector<Vec3<double>> &values, bool periodic);

  double length() const { return knots_.empty() ? 0 : knots_.back() - knots_.front(); }
  double wrapped(double s) const { return periodic_ ? s - length() * std::floor((s - knots_.front()) / length()) : s; }
  const std::vector<double> &knots() const { return knots_; }
  /* The shortest of the pieces at s and beside it; those beyond the ends of an open spline are straight, and do not count */
  double shortestPiece(double s) const
  {
    const std::ptrdiff_t n = (std::ptrdiff_t)knots_.size() - 1, at = std::upper_bound(knots_.begin(), knots_.end(), wrapped(s)) - knots_.begin() - 1;
    double               least = std::numeric_limits<double>::infinity();
    for (std::ptrdiff_t k = at - 1; k <= at + 1; k++) {
      const std::ptrdiff_t i = periodic_ ? (k + n) % n : k;
      if (i >= 0 && i < n) least = std::min(least, knots_[i + 1] - knots_[i]);
    }
    return std::isfinite(least) ? least : s < knots_.front() ? knots_.front() - s : s - knots_.back();
  }

  /* value and derivatives; s may be a dual number */
  template <class T> void operator()(const T &s, Vec3<T> &c, Vec3<T> &c1, Vec3<T> &c2) const
  {
    const double plain = wrapped(Plain(s));
    const Piece &p     = piece(plain);
    const T      u     = s + T(plain - Plain(s) - p.start);
    for (int i = 0; i < 3; i++) {
      c(i)  = ((u * T(p.a(i, 3)) + T(p.a(i, 2))) * u + T(p.a(i, 1))) * u + T(p.a(i, 0));
      c1(i) = (u * T(3 * p.a(i, 3)) + T(2 * p.a(i, 2))) * u + T(p.a(i, 1));
      c2(i) = u * T(6 * p.a(i, 3)) + T(2 * p.a(i, 2));
    }
  }

private:
  struct Piece {
    double       start;
    Matrix<3, 4> a; /* coefficients of powers of s - start */
  };
  bool                periodic_ = false;
  std::vector<double> knots_;
  std::vector<Piece>  pieces_; /* before the first knot, between the knots, beyond the last */

  const Piece &piece(double s) const
  {
    return pieces_[std::upper_bound(knots_.begin(), knots_.end(), s) - knots_.begin()];
  }
};

class Curve
{
public:
  /* planar: in the xy plane, with one normal z x t */
  Curve(std::vector<Vec3<double>> points, bool closed, bool planar);

  /* What is wrong with the points, as text; empty if nothing. A curve with an error must not be used */
  const std::string  &error() const { return error_; }
  const VectorSpline &path() const { return path_; }

  /* Parameter of the point of the curve closest to p: of the global minimum of the distance, or, given s, of the local
     minimum near s, by Newton's method */
  double closest(const Vec3<double> &p) const;
  double closest(const Vec3<double> &p, double s) const;

  /* Position and unit normals at s */
  template <class T> void at(const T &s, Vec3<T> &c, Vec3<T> &n1, Vec3<T> &n2) const
  {
    Vec3<T> c1, c2, t, m, m1, m2;
    path_(s, c, c1, c2);
    t = Unit<T>(c1);
    if (planar_) {
      n1 = Vec3<T>(-t(1), t(0), T(0));
      n2 = Vec3<T>(T(0), T(0), T(1));
      return;
    }
    normal_(s, m, m1, m2);
    const T along = m.dot(t);
    n1            = Unit<T>(m - t * along);
    for (int i = 0; i < 3; i++) {
      const int j = (i + 1) % 3, k = (i + 2) % 3;
      n2(i) = t(j) * n1(k) - t(k) * n1(j);
    }
  }

  /*
    phi_r = n_r . (c(s) - p), the distances of p from the curve along its normals at the closest point, near the parameter
    `near`. s is a function of p by g = (p - c) . c' = 0; two steps of Newton's method in dual numbers from the plain root
    make its derivatives exact up to the third order.
  */
  template <class T> void normalDistances(const Vec3<T> &p, double near, int rows, T *phi) const
  {
    Vec3<T> c, c1, c2, n1, n2;
    T       s(closest({Plain(p(0)), Plain(p(1)), Plain(p(2))}, near));
    for (int k = 0; k < 2; k++) {
      path_(s, c, c1, c2);
      const Vec3<T> off = p - c;
      const T       g = off.dot(c1), slope = c1.dot(c1) - off.dot(c2);
      s = s + g / slope;
    }
    at<T>(s, c, n1, n2);
    const Vec3<T> off = c - p;
    phi[0]            = off.dot(n1);
    if (rows > 1) phi[1] = off.dot(n2);
  }

private:
  bool         planar_ = false;
  VectorSpline path_, normal_;
  double       longest_ = 0; /* longest piece of the path: the limit of a Newton step */
  std::string  error_;

  template <class T> static Vec3<T> Unit(const Vec3<T> &v)
  {
    using std::sqrt;
    const T factor = T(1) / sqrt(v.squaredNorm());
    return v * factor;
  }
  bool checkPoints(std::vector<Vec3<double>> &points, bool closed);
  void checkShape();
  void transportNormal(bool closed);
};

} // namespace hhtdae

#endif
