#include "marker_motion.h"
#include "runtime.h"

namespace hhtdae
{

MarkerMotion<double> MotionOfMarker(const Evaluation &e, PetscInt marker, bool accelerations)
{
  const LocalMarker   &k = e.bodies.marker[marker];
  const LocalBody     &l = e.bodies.body[k.body];
  const BodyMotion    &b = e.bodies.now[k.body];
  MarkerMotion<double> m;
  m.f.R = b.A * k.R;
  m.w   = {b.v, b.w};
  m.a.setZero();
  m.alpha.setZero();
  if (accelerations && l.kind != BodyKind::Ground) {
    m.a     = e.bodies.acceleration(k.body, e.v, e.a);
    m.alpha = e.bodies.angularAcceleration(k.body, e.v, e.a);
  }
  Attach<double>(b.r, b.A * k.s, m);
  return m;
}

namespace
{

/* Attitude and angular motion of a body with a local rotation vector, from coordinates q, velocities p and accelerations
   s as dual numbers: dA = [G dq] A */
template <class T> void LocalMotion(const Bodies &bodies, const BodyMotion &b, const T *q, const T *p, const T *s, Mat3<T> &A, MarkerMotion<T> &m)
{
  const Matrix3 G = b.G * bodies.inStep(b);
  Vec3<T>       turn;
  for (int i = 0; i < 3; i++) {
    m.w.w(i)   = p[i];
    m.alpha(i) = s[i];
    turn(i)    = T(0);
    for (int c = 0; c < 3; c++) turn(i) = turn(i) + T(G(i, c)) * (q[c] - T(Plain(q[c])));
  }
  for (int j = 0; j < 3; j++) {
    const Vec3<T> x(T(b.A(0, j)), T(b.A(1, j)), T(b.A(2, j)));
    A.col(j) = x + turn.cross(x);
  }
}

/* The same for Euler angles, with the formulas of euler.h and bodies.cpp */
template <class T>
void EulerMotion(const LocalBody &l, const T *q, const T *p, const T *s, Mat3<T> &A, MarkerMotion<T> &m)
{
  using std::cos;
  using std::sin;
  const T       sp = sin(q[0]), cp = cos(q[0]), st = sin(q[1]), ct = cos(q[1]), ss = sin(q[2]), cs = cos(q[2]), zero(0);
  const Vec3<T> z(zero, zero, T(1)), g2(cp, sp, zero), g3(sp * st, -cp * st, ct), y(-sp * ct, cp * ct, st),
      g23 = g2.cross(g3);
  Mat3<T> E;
  E.col(0)          = g2 * cs + y * ss;
  E.col(1)          = y * cs - g2 * ss;
  E.col(2)          = g3;
  A                 = E * Constant<T>(l.C);
  m.w.w             = z * p[0] + g2 * p[1] + g3 * p[2];
  const Vec3<T> zw  = z.cross(m.w.w);
  const T       p12 = p[1] * p[2];
  m.alpha           = z * s[0] + g2 * s[1] + g3 * s[2] + zw * p[0] + g23 * p12;
}

template <class T>
void PlanarMotion(const T &angle, const T &rate, const T &acceleration, Mat3<T> &A, MarkerMotion<T> &m)
{
  using std::cos;
  using std::sin;
  const T c = cos(angle), s = sin(angle);
  A(0, 0) = A(1, 1) = c;
  A(0, 1)           = -s;
  A(1, 0)           = s;
  m.w.w(2)          = rate;
  m.alpha(2)        = acceleration;
}

/* Motion of a marker on an attachment's frame. The six directions from `first` on are x and theta of the frame (order 0),
   v and w (1), or a and alpha (2); the others stay constant */
MarkerMotion<MeasureDual> FrameMotion(const Evaluation &e, PetscInt marker, int first, int order)
{
  using T              = MeasureDual;
  constexpr int N      = measured_coordinates;
  const LocalMarker &k = e.bodies.marker[marker];
  const BodyMotion  &b = e.bodies.now[k.body];
  const Frame<double>   at{b.r, b.A};
  const Twist<double>   rates{b.v, b.w}, second{e.bodies.acceleration(k.body, e.v, e.a), e.bodies.angularAcceleration(k.body, e.v, e.a)};
  const Frame<T>        f = order == 0 ? Seed<N>(at, first) : Constant<T>(at);
  const Twist<T>        a = order == 2 ? Seed<N>(second, first) : Constant<T>(second);
  MarkerMotion<T>       m;
  m.w     = order == 1 ? Seed<N>(rates, first) : Constant<T>(rates);
  m.a     = a.v;
  m.alpha = a.w;
  m.f.R   = f.R * Constant<T>(k.R);
  const Vec3<T> arm = f.R * Constant<T>(k.s);
  Attach<T>(f.x, arm, m);
  return m;
}

} // namespace

MarkerMotion<MeasureDual> MotionOfMarker(const Evaluation &e, PetscInt marker, int first, int order)
{
  using T              = MeasureDual;
  const LocalMarker &k = e.bodies.marker[marker];
  const LocalBody   &l = e.bodies.body[k.body];
  if (l.kind == BodyKind::Attached) return FrameMotion(e, marker, first, order);
  const int          n = Coordinates(l.kind), directions = n == 2 || l.kind == BodyKind::Planar ? 2 : n ? 3 : 0;
  T                  q[6], p[6], s[6];
  for (int c = 0; c < n; c++) {
    q[c] = T(e.u[l.first + c]);
    p[c] = T(e.v[l.first + c]);
    s[c] = T(e.a[l.first + c]);
    if (order) continue;
    q[c].derivatives()(first + c) = 1;
    p[c].derivatives()(first + c) = e.sv;
    s[c].derivatives()(first + c) = e.sa;
  }
  MarkerMotion<T> m;
  Vec3<T>         r;
  Mat3<T>         A;
  for (Vec3<T> *x : {&r, &m.w.v, &m.w.w, &m.a, &m.alpha}) x->fill(T(0));
  for (int i = 0; i < 9; i++) A(i % 3, i / 3) = T(i % 4 ? 0 : 1);
  for (int i = 0; i < directions; i++) {
    r(i)     = q[i];
    m.w.v(i) = p[i];
    m.a(i)   = s[i];
  }
  if (l.kind == BodyKind::Rigid && e.bodies.local) LocalMotion<T>(e.bodies, e.bodies.now[k.body], q + 3, p + 3, s + 3, A, m);
  if (l.kind == BodyKind::Rigid && !e.bodies.local) EulerMotion<T>(l, q + 3, p + 3, s + 3, A, m);
  if (l.kind == BodyKind::Planar) PlanarMotion<T>(q[2], p[2], s[2], A, m);
  m.f.R             = A * Constant<T>(k.R);
  const Vec3<T> arm = A * Constant<T>(k.s);
  Attach<T>(r, arm, m);
  return m;
}

} // namespace hhtdae
