/* Space curves: construction and checks of the spline, its normals, and the search for the closest point */
#include "scene/kernels/curve_spline.h"

#include <Eigen/Geometry>

namespace hhtdae
{

namespace
{

using Points = std::vector<Vec3<double>>;

/* Solves a symmetric, diagonally dominant tridiagonal system: diagonal d, off-diagonals e (e[k] between k and k + 1); x is the
   right-hand side on entry, the solution on return */
void SolveTridiagonal(std::vector<double> d, const std::vector<double> &e, Points &x)
{
  const std::size_t n = d.size();
  for (std::size_t k = 1; k < n; k++) {
    const double f = e[k - 1] / d[k - 1];
    d[k] -= f * e[k - 1];
    x[k] -= f * x[k - 1];
  }
  for (std::size_t k = n; k-- > 0;) {
    if (k + 1 < n) x[k] -= e[k] * x[k + 1];
    x[k] /= d[k];
  }
}

/* The same with an additional entry e[n - 1] between the last and the first unknown, by the Sherman-Morrison formula for A' + u v^T with
   u = (g, 0, ..., corner), v = (1, 0, ..., corner/g), g = -d[0] */
void SolveCyclic(std::vector<double> d, const std::vector<double> &e, Points &x)
{
  const std::size_t last   = d.size() - 1;
  const double      corner = e[last], g = -d[0], v = corner / g;
  Points           y(d.size(), Vec3<double>::Zero());
  d[0] -= g;
  d[last] -= corner * v;
  y[0].setConstant(g);
  y[last].setConstant(corner);
  SolveTridiagonal(d, e, x);
  SolveTridiagonal(d, e, y);
  const Vec3<double> f = (x[0] + v * x[last]) / (1 + y[0](0) + v * y[last](0));
  for (std::size_t k = 0; k <= last; k++) x[k] -= y[k](0) * f;
}

/* Second derivatives at the knots */
Points SecondDerivatives(const std::vector<double> &s, const Points &y, bool periodic)
{
  const std::size_t   n = s.size() - 1; /* number of pieces */
  std::vector<double> d, e;
  Points             b, m(n + 1, Vec3<double>::Zero());
  const auto          h     = [&](std::size_t k) { return s[k + 1] - s[k]; };
  const auto          slope = [&](std::size_t k) -> Vec3<double> { return (y[k + 1] - y[k]) / h(k); };
  for (std::size_t k = periodic ? 0 : 1; k < n; k++) {
    const std::size_t before = k == 0 ? n - 1 : k - 1;
    d.push_back(2 * (h(before) + h(k)));
    e.push_back(h(k));
    b.push_back(6 * (slope(k) - slope(before)));
  }
  if (periodic) {
    SolveCyclic(d, e, b);
    std::copy(b.begin(), b.end(), m.begin());
    m[n] = m[0];
  } else {
    SolveTridiagonal(d, e, b);
    std::copy(b.begin(), b.end(), m.begin() + 1);
  }
  return m;
}

std::string Number(std::size_t k) { return std::to_string(k); }

constexpr int normals_per_piece = 4; /* nodes of the normal's spline per piece of the path */

/* Rotates the normal m by the smallest rotation that takes the unit tangent a into b; if b = -a, m is normal to both and is returned unchanged */
Vec3<double> TransportNormal(const Vec3<double> &a, const Vec3<double> &b, const Vec3<double> &m)
{
  const double c = 1 + a.dot(b);
  return c > 1e-12 ? Vec3<double>(m - b.dot(m) / c * (a + b)) : m;
}

} // namespace

VectorSpline::VectorSpline(std::vector<double> knots, const Points &y, bool periodic)
    : periodic_(periodic), knots_(std::move(knots))
{
  const std::size_t n = knots_.size() - 1;
  const Points     m = SecondDerivatives(knots_, y, periodic);
  pieces_.resize(n + 2);
  for (std::size_t k = 0; k < n; k++) {
    const double h = knots_[k + 1] - knots_[k];
    Piece       &p = pieces_[k + 1];
    p.start        = knots_[k];
    p.a << y[k], (y[k + 1] - y[k]) / h - h / 6 * (2 * m[k] + m[k + 1]), m[k] / 2, (m[k + 1] - m[k]) / (6 * h);
  }
  /* Straight lines continue the curve beyond its ends; in a periodic spline parameters are beyond the ends only by rounding */
  Vec3<double> c, c1, c2;
  for (std::size_t k : {std::size_t(0), n + 1}) {
    const double end = k == 0 ? knots_.front() : knots_.back(), u = k == 0 ? 0 : end - pieces_[n].start;
    const Piece &p   = pieces_[k == 0 ? 1 : n];
    c                = ((p.a.col(3) * u + p.a.col(2)) * u + p.a.col(1)) * u + p.a.col(0);
    c1               = (3 * p.a.col(3) * u + 2 * p.a.col(2)) * u + p.a.col(1);
    pieces_[k].start = end;
    pieces_[k].a << c, c1, Vec3<double>::Zero(), Vec3<double>::Zero();
  }
}

Curve::Curve(Points points, bool closed, bool planar) : planar_(planar)
{
  if (!checkPoints(points, closed)) return;
  if (closed) points.push_back(points.front());
  std::vector<double> s{0};
  for (std::size_t k = 1; k < points.size(); k++) {
    s.push_back(s.back() + (points[k] - points[k - 1]).norm());
    longest_ = std::max(longest_, s[k] - s[k - 1]);
  }
  path_ = VectorSpline(s, points, closed);
  if (!planar) transportNormal(closed);
  checkShape();
}

/* Checks the points; a closed curve may repeat its first point at the end, which is then removed. */
bool Curve::checkPoints(Points &points, bool closed)
{
  double size = 0;
  for (std::size_t k = 0; k < points.size(); k++) {
    if (!points[k].allFinite())
      error_ = "point " + Number(k) + " of the curve is not finite";
    else if (planar_ && points[k](2) != 0)
      error_ = "point " + Number(k) + " of the curve has z other than 0 in a planar scene";
    if (!error_.empty()) return false;
    size = std::max(size, (points[k] - points[0]).norm());
  }
  if (closed && points.size() > 1 && (points.back() - points.front()).norm() <= 1e-12 * size) points.pop_back();
  const std::size_t n = points.size(), least = closed ? 3 : 2;
  if (n < least) {
    error_ = "the curve has " + Number(n) + " points, a" + (closed ? " closed one" : "n open one") +
             " needs at least " + Number(least);
    return false;
  }
  for (std::size_t k = 1; k < n; k++)
    if ((points[k] - points[k - 1]).norm() <= 1e-12 * size) {
      error_ = "points " + Number(k - 1) + " and " + Number(k) + " of the curve coincide";
      return false;
    }
  return true;
}

/*
  Computes the first normal at nodes along the path. The smallest rotation that takes a tangent into the next one transports
  the normal from node to node. In a closed curve an additional rotation about the tangent, proportional to arc length, makes
  the normals at both ends equal. Between the nodes the normal is a spline; its component normal to the tangent is used.
*/
void Curve::transportNormal(bool closed)
{
  std::vector<double> s;
  Points             t, m;
  Vec3<double>        c, c1, c2;
  const auto         &knots = path_.knots();
  for (std::size_t k = 0; k < knots.size(); k++)
    for (int i = 0; i < (k + 1 < knots.size() ? normals_per_piece : 1); i++)
      s.push_back(k + 1 < knots.size() ? knots[k] + (knots[k + 1] - knots[k]) * i / normals_per_piece : knots[k]);
  for (double x : s) {
    path_(closed && x == s.back() ? s.front() : x, c, c1, c2);
    t.push_back(c1.normalized());
    if (m.empty())
      m.push_back(t[0].unitOrthogonal());
    else
      m.push_back(TransportNormal(t[t.size() - 2], t.back(), m.back()));
  }
  if (closed) {
    const double angle = std::atan2(m.back().cross(m[0]).dot(t[0]), m.back().dot(m[0]));
    for (std::size_t k = 0; k < s.size(); k++) m[k] = Eigen::AngleAxisd(angle * s[k] / s.back(), t[k]) * m[k];
    m.back() = m.front();
  }
  normal_ = VectorSpline(s, m, closed);
}

/* An error if the curve has cusps or loops, where it has no tangent or no unique closest point: too few points at a sharp bend cause them. */
void Curve::checkShape()
{
  Vec3<double> c, c1, c2, m, m1, m2;
  const auto  &knots = path_.knots();
  for (std::size_t k = 0; k + 1 < knots.size(); k++)
    for (int i = 0; i < 4 * normals_per_piece; i++) {
      const double s = knots[k] + (knots[k + 1] - knots[k]) * i / (4 * normals_per_piece);
      path_(s, c, c1, c2);
      const double       speed = c1.norm();
      const Vec3<double> t     = c1 / speed;
      bool               good  = speed > .1;
      if (good && !planar_) {
        normal_(s, m, m1, m2);
        good = (m - m.dot(t) * t).norm() > .3;
      }
      if (good) continue;
      error_ = "the curve turns too sharply between point " + Number(k) + " and the next one; give more points there";
      return;
    }
}

double Curve::closest(const Vec3<double> &p) const
{
  Vec3<double> c, c1, c2;
  const auto  &knots = path_.knots();
  double       best = knots[0], least = -1;
  for (std::size_t k = 0; k + 1 < knots.size(); k++)
    for (int i = 0; i <= normals_per_piece; i++) {
      const double s = knots[k] + (knots[k + 1] - knots[k]) * i / normals_per_piece;
      path_(s, c, c1, c2);
      const double distance = (p - c).squaredNorm();
      if (least >= 0 && distance >= least) continue;
      least = distance;
      best  = s;
    }
  return closest(p, best);
}

/* Minimizes |p - c(s)|^2 / 2 by Newton's method, with Gauss-Newton steps where this function is not convex. Steps are at
   most as long as the longest piece and must decrease the distance */
double Curve::closest(const Vec3<double> &p, double s) const
{
  Vec3<double> c, c1, c2;
  const double size = longest_ + path_.length() + p.norm();
  if (!std::isfinite(size)) return s; /* p is from a diverged iteration; the search would not end, since comparisons with NaN are false */
  path_(s, c, c1, c2);
  for (int k = 0; k < 100; k++) {
    const double distance = (p - c).squaredNorm(), speed = c1.squaredNorm(), bend = speed - (p - c).dot(c2);
    double       step = (p - c).dot(c1) / (bend > .1 * speed ? bend : speed);
    step              = std::max(-longest_, std::min(longest_, step));
    for (;;) {
      path_(s + step, c, c1, c2);
      if (std::abs(step) < 1e-11 * size || (p - c).squaredNorm() <= distance * (1 + 1e-13)) break;
      step /= 2;
    }
    s += step;
    if (std::abs(step) < 1e-14 * size) break;
  }
  return s;
}

} // namespace hhtdae
