#include "user_constraint.h"

namespace hhtdae
{

namespace
{

constexpr int N = 18; /* number of directions of the three markers of a measure */

using Argument = UserRow::Argument;

bool OfMarkers(const Argument &a) { return a.marker[0] >= 0; }

double Remembered(const Argument &a, const UserRow::At &at) { return a.kind == Measure::Angle ? at.remembered[a.number] : 0; }

template <class T> T Formula(const Argument &a, const UserRow::At &at, const MarkerMotion<T> *x)
{
  return MarkerMeasure<T>(a.kind, a.component, Remembered(a, at), x[0], a.marker[1] < 0 ? nullptr : &x[1], a.marker[2] < 0 ? nullptr : &x[2]);
}

/* x: motions of a measure's markers, computed by seed(number of the marker in the row, number in the measure) */
template <class T, class Seeds> void Markers(const Argument &a, const Seeds &seed, MarkerMotion<T> *x)
{
  for (int i = 0; i < 3; i++) {
    for (Vec3<T> *v : {&x[i].w.v, &x[i].w.w, &x[i].a, &x[i].alpha}) v->fill(T(0));
    if (a.marker[i] >= 0) seed(a.marker[i], i, x[i]);
  }
}

/* A measure with derivatives by the frames of its markers; the twists are constant */
Dual<N> ByFrames(const Argument &a, const UserRow::At &at)
{
  MarkerMotion<Dual<N>> x[3];
  Markers(a, [&](int k, int i, MarkerMotion<Dual<N>> &m) {
    m.f = Seed<N>(at.f[k], 6 * i);
    if (at.w) m.w = Constant<Dual<N>>(at.w[k]);
  }, x);
  return Formula(a, at, x);
}

/* A measure with derivatives by the twists of its markers */
Dual<N> ByTwists(const Argument &a, const UserRow::At &at)
{
  MarkerMotion<Dual<N>> x[3];
  Markers(a, [&](int k, int i, MarkerMotion<Dual<N>> &m) {
    m.f = Constant<Dual<N>>(at.f[k]);
    m.w = Seed<N>(at.w[k], 6 * i);
  }, x);
  return Formula(a, at, x);
}

/* A measure with second derivatives by the frames of its markers; measures of velocities have derivatives by twists
   (outer directions) and frames (inner) */
Dual2<N> Twice(const Argument &a, const UserRow::At &at)
{
  MarkerMotion<Dual2<N>> x[3];
  Markers(a, [&](int k, int i, MarkerMotion<Dual2<N>> &m) {
    if (!at.w) {
      m.f = Seed2<N>(at.f[k], 6 * i);
      return;
    }
    const Frame<Dual<N>> inner = Seed<N>(at.f[k], 6 * i);
    m.w                        = Constant<Dual2<N>>(at.w[k]);
    for (int c = 0; c < 3; c++) {
      m.f.x(c) = Dual2<N>(inner.x(c));
      for (int d = 0; d < 3; d++) m.f.R(c, d) = Dual2<N>(inner.R(c, d));
      m.w.v(c).derivatives()(6 * i + c)     = Dual<N>(1);
      m.w.w(c).derivatives()(6 * i + 3 + c) = Dual<N>(1);
    }
  }, x);
  return Formula(a, at, x);
}

/* The direction of the row's markers to which direction d of a measure's markers corresponds; -1 if the measure does not have this marker */
int Direction(const Argument &a, int d) { return a.marker[d / 6] < 0 ? -1 : 6 * a.marker[d / 6] + d % 6; }

void Scatter(const Argument &a, double factor, const Dual<N> &x, double *row)
{
  for (int d = 0; d < N; d++)
    if (Direction(a, d) >= 0) row[Direction(a, d)] += factor * x.derivatives()(d);
}

} // namespace

void UserRow::measure(const At &at, double *m) const
{
  for (std::size_t k = 0; k < arguments.size(); k++) {
    const Argument &a = arguments[k];
    if (a.kind == Measure::Time) m[k] = at.t;
    else if (!OfMarkers(a)) m[k] = at.z[a.number];
    else {
      MarkerMotion<double> x[3];
      Markers(a, [&](int marker, int, MarkerMotion<double> &y) {
        y.f = at.f[marker];
        if (at.w) y.w = at.w[marker];
      }, x);
      m[k] = Formula(a, at, x);
    }
  }
}

double UserRow::value(const At &at) const
{
  double m[Real::most];
  measure(at, m);
  return f.value(m);
}

void UserRow::gradient(const At &at, double *frames, double *twists, double *inputs) const
{
  double m[Real::most], g[Real::most];
  measure(at, m);
  f.gradient(m, g);
  for (std::size_t k = 0; k < arguments.size(); k++) {
    const Argument &a = arguments[k];
    if (a.kind == Measure::Time) continue;
    if (!OfMarkers(a)) {
      inputs[a.number] += g[k];
      continue;
    }
    Scatter(a, g[k], ByFrames(a, at), frames);
    if (ofVelocities(a.kind)) Scatter(a, g[k], ByTwists(a, at), twists);
  }
}

/* Second derivatives by the chain rule: sum_k f_k m_k'' + sum_kl f_kl m_k' m_l', primes for derivatives by the frames or twists */
void UserRow::curvature(const At &at, double factor, Eigen::Ref<Eigen::MatrixXd> H) const
{
  const int       n = f.arguments();
  double          m[Real::most], g[Real::most], by[Real::most * Real::most], reach[Real::most];
  Eigen::MatrixXd frames = Eigen::MatrixXd::Zero(n, H.cols()), outer = Eigen::MatrixXd::Zero(n, H.rows());
  measure(at, m);
  f.gradient(m, g);
  for (int k = 0; k < n; k++) {
    const Argument &a = arguments[k];
    reach[k]          = 1e-5 * std::max(std::abs(m[k]), a.reach);
    if (!OfMarkers(a)) continue;
    std::vector<double> row(H.cols());
    Scatter(a, 1, ByFrames(a, at), row.data());
    frames.row(k) = Eigen::Map<Eigen::RowVectorXd>(row.data(), (Eigen::Index)row.size());
    if (!at.w) outer.row(k) = frames.row(k);
    if (at.w && !ofVelocities(a.kind)) continue;
    if (at.w) {
      std::fill(row.begin(), row.end(), 0.0);
      Scatter(a, 1, ByTwists(a, at), row.data());
      outer.row(k) = Eigen::Map<Eigen::RowVectorXd>(row.data(), (Eigen::Index)row.size());
    }
    const Dual2<N> twice = Twice(a, at);
    for (int c = 0; c < N; c++)
      for (int d = 0; d < N; d++)
        if (Direction(a, c) >= 0 && Direction(a, d) >= 0)
          H(Direction(a, c), Direction(a, d)) += factor * g[k] * twice.derivatives()(c).derivatives()(d);
  }
  f.curvature(m, reach, by);
  H.noalias() += factor * outer.transpose() * Eigen::Map<Eigen::MatrixXd>(by, n, n) * frames;
}

double UserRow::rate(const At &at) const
{
  double m[Real::most], g[Real::most], sum = 0;
  measure(at, m);
  f.gradient(m, g);
  for (std::size_t k = 0; k < arguments.size(); k++)
    if (arguments[k].kind == Measure::Time) sum += g[k];
  return sum;
}

bool UserRow::linear(const At &at) const
{
  double m[Real::most], g[2][Real::most];
  measure(at, m);
  for (int trial = 0; trial < 2; trial++) {
    double speed = trial;
    for (std::size_t k = 0; k < arguments.size(); k++) {
      if (ofVelocities(arguments[k].kind)) m[k] = speed *= -0.7;
      else if (!OfMarkers(arguments[k]) && arguments[k].kind != Measure::Time) m[k] += trial;
    }
    f.gradient(m, g[trial]);
  }
  for (std::size_t k = 0; k < arguments.size(); k++)
    /* the negated comparison also rejects NaN */
    if (ofVelocities(arguments[k].kind) && !(std::abs(g[1][k] - g[0][k]) <= 1e-9 * std::max(std::abs(g[0][k]), std::abs(g[1][k])))) return false;
  return true;
}

std::array<int, 2> UserRow::markersOfAngle(int k) const
{
  for (const Argument &a : arguments)
    if (a.kind == Measure::Angle && a.number == k) return {a.marker[0], a.marker[1]};
  return {-1, -1};
}

void UserRow::accept(const Frame<double> *f, double *remembered) const
{
  for (const Argument &a : arguments)
    if (a.kind == Measure::Angle) remembered[a.number] = UnwoundAngle<double>(f[a.marker[0]], f[a.marker[1]], remembered[a.number]);
}

double UserRow::longestStep(const Frame<double> *f, const Twist<double> *w, double angular) const
{
  double least = std::numeric_limits<double>::infinity();
  for (const Argument &a : arguments)
    if (a.kind == Measure::Angle)
      least = std::min(least, LongestTurn(AngleRate<double>(f[a.marker[0]], f[a.marker[1]], w[a.marker[0]], w[a.marker[1]]), angular));
  return least;
}

} // namespace hhtdae
