/*
  References for the scenes of the examples: the same mechanisms in minimal coordinates, derived independently of the scene library and
  integrated by extrapolation of order 20.
*/
#ifndef HHTEX_SCENE_REFERENCES_H
#define HHTEX_SCENE_REFERENCES_H

#include "problems/extrapolation.h"

#include <hhtdae/functions.h>

#include <Eigen/Dense>
#include <algorithm>

namespace hhtex
{

/*
  Spatial slider-crank in the crank's angle p: with m(p) p'^2 / 2 the kinetic energy,

    m(p) p'' + m'(p) p'^2 / 2 + V'(p) = 0.

  The universal joint keeps a normal n of the rod perpendicular to the slider's axis e_x: n = u x e_x / |u x e_x|, u
  along the rod. Then the rod's spin about u is p' (dn/dp . u x n).
*/
class SliderCrankReference
{
public:
  explicit SliderCrankReference(double speed)
      : solution_([this](long double, const long double *y, long double *f) { rates(y, f); }, 0.L, 0.01L,
                  {0.L, (long double)speed})
  {
    using T      = hhtdae::TimeFunction::Number;
    const auto B = [](const T &p, T *b) {
      b[0] = T(0), b[1] = T(0.1) - sin(p) * T(0.08), b[2] = T(0.12) + cos(p) * T(0.08);
    };
    const auto X = [B](const T &p) {
      T b[3];
      B(p, b);
      return T(sqrt(T(T(0.09) - b[1] * b[1] - b[2] * b[2])));
    };
    x_ = hhtdae::TimeFunction::formula([X](const T &p) -> T { return X(p); });
    for (int k = 0; k < 3; k++) {
      u_[k] = hhtdae::TimeFunction::formula([=](const T &p) -> T {
        T b[3];
        B(p, b);
        return ((k == 0 ? X(p) : T(0)) - b[k]) / T(0.3);
      });
      c_[k] = hhtdae::TimeFunction::formula([=](const T &p) -> T {
        T b[3];
        B(p, b);
        return (b[k] + (k == 0 ? X(p) : T(0))) * T(0.5);
      });
      /* u x e_x = (0, u_z, -u_y), along (0, -b_z, b_y) */
      n_[k] = hhtdae::TimeFunction::formula([=](const T &p) -> T {
        T b[3];
        B(p, b);
        const T length = sqrt(T(b[1] * b[1] + b[2] * b[2]));
        return k == 0 ? T(0) : (k == 1 ? T(-b[2] / length) : T(b[1] / length));
      });
    }
  }
  SliderCrankReference(const SliderCrankReference &) = delete;

  double crank(double t) { return (double)solution_.at(t)[0]; }
  double slider(double t) { return x_(crank(t)).f; }

private:
  hhtdae::TimeFunction x_, u_[3], c_[3], n_[3]; /* slider, direction and centre of the rod, normal */
  Extrapolation        solution_;

  void rates(const long double *y, long double *f) const
  {
    using V = Eigen::Vector3d;
    struct Curve {
      V f, f1, f2;
    };
    const auto curve = [&](const hhtdae::TimeFunction *c) {
      Curve r;
      for (int k = 0; k < 3; k++) {
        const auto v = c[k]((double)y[0]);
        r.f(k) = v.f, r.f1(k) = v.f1, r.f2(k) = v.f2;
      }
      return r;
    };
    const auto   x = x_((double)y[0]);
    const Curve  u = curve(u_), c = curve(c_), n = curve(n_);
    const V      across = u.f.cross(n.f);
    const double spin = n.f1.dot(across), spin1 = n.f2.dot(across) + n.f1.dot(u.f1.cross(n.f));
    const double m = 1e-4 + 0.12 * 0.04 * 0.04 + 2 * x.f1 * x.f1 + 0.5 * c.f1.squaredNorm() +
                     4e-3 * u.f1.squaredNorm() + 4e-4 * spin * spin;
    const double half1 =
        2 * x.f1 * x.f2 + 0.5 * c.f1.dot(c.f2) + 4e-3 * u.f1.dot(u.f2) + 4e-4 * spin * spin1; /* m'/2 */
    const double V1 = 9.81 * (-0.12 * 0.04 * std::sin((double)y[0]) + 0.5 * c.f1(2));
    f[0]            = y[1];
    f[1]            = -(half1 * y[1] * y[1] + V1) / m;
  }
};

/*
  Bricard's mechanism: five rods from P0 to P5, relative angles (a, b, a, b, a) by its threefold symmetry, where

    s(a) + s(b) + s(a) s(b) = 0,   s = sin

  closes the loop (Chen, You, Tarnai: Threefold-symmetric Bricard linkages for deployable structures, 2005, for twists
  of 90 degrees, from the cube's angles). The equations are those of the open chain in (a, b) with this constraint, reduced to
  index 1.
*/
class BricardReference
{
public:
  using V     = Eigen::Matrix<long double, 3, 1>;
  using M     = Eigen::Matrix<long double, 3, 3>;
  using State = Extrapolation::State;

  explicit BricardReference(double section)
      : section_(section), solution_([this](long double, const long double *y, long double *f) { rates(y, f); }, 0.L,
                                     0.01L, {0.L, 0.L, 0.L, 0.L})
  {
  }
  BricardReference(const BricardReference &) = delete;

  static Eigen::Vector3d point(int k)
  {
    static const double P[6][3] = {{0, 0, 0}, {1, 0, 0}, {1, -1, 0}, {1, -1, 1}, {0, -1, 1}, {0, 0, 1}};
    return {P[k][0], P[k][1], P[k][2]};
  }
  static int axis(int k) { return (k + 1) % 3; } /* y, z, x, y, z, x */

  State at(double t) { return solution_.at(t); } /* a, b, a', b' */
  /* P0 .. P5 in a state */
  static void points(const State &y, Eigen::Vector3d P[6])
  {
    V c[5], p[6];
    M R[5];
    pose(y.data(), c, R, p);
    for (int k = 0; k < 6; k++) P[k] = p[k].cast<double>();
  }

private:
  long double   section_; /* edge of the rods' square section */
  Extrapolation solution_;

  static void pose(const long double *q, V *c, M *R, V *p)
  {
    M turn = M::Identity();
    p[0].setZero();
    for (int k = 0; k < 5; k++) {
      const V d = (point(k + 1) - point(k)).cast<long double>();
      turn      = turn * Eigen::AngleAxis<long double>(q[k % 2], V(V::Unit(axis(k)))).toRotationMatrix();
      R[k]      = turn;
      c[k]      = p[k] + turn * d / 2;
      p[k + 1]  = p[k] + turn * d;
    }
  }
  /* angular velocities and velocities of the centres that angular rates r give */
  static void motion(const M *R, const V *p, const V *c, const long double *r, V *w, V *v)
  {
    V spin = V::Zero(), at = V::Zero();
    for (int k = 0; k < 5; k++) {
      spin += R[k].col(axis(k)) * r[k % 2];
      w[k] = spin;
      v[k] = at + spin.cross(V(c[k] - p[k]));
      at += spin.cross(V(p[k + 1] - p[k]));
    }
  }
  void rates(const long double *y, long double *f) const
  {
    V                 c[5], p[6], w[5], v[5], wj[2][5], vj[2][5];
    M                 R[5];
    const long double unit[2][2] = {{1, 0}, {0, 1}};
    pose(y, c, R, p);
    motion(R, p, c, y + 2, w, v);
    for (int j = 0; j < 2; j++) motion(R, p, c, unit[j], wj[j], vj[j]);
    Eigen::Matrix<long double, 3, 3> A = Eigen::Matrix<long double, 3, 3>::Zero();
    V                                b = V::Zero(), turn = V::Zero(), at = V::Zero(), before = V::Zero();
    for (int k = 0; k < 5; k++) {
      /* accelerations at constant rates */
      turn += before.cross(V(R[k].col(axis(k)) * y[2 + k % 2]));
      before      = w[k];
      const V arm = c[k] - p[k], link = p[k + 1] - p[k];
      const V centre = at + turn.cross(arm) + w[k].cross(V(w[k].cross(arm))) + V(0, 9.81L, 0);
      const V d      = (point(k + 1) - point(k)).cast<long double>();
      const V J0     = (V::Ones() + d.cwiseAbs2() * -1) * ((1 + section_ * section_) / 12) +
                   d.cwiseAbs2() * (section_ * section_ / 6);
      const M J      = R[k] * J0.asDiagonal() * R[k].transpose();
      const V moment = J * turn + w[k].cross(V(J * w[k]));
      at += turn.cross(link) + w[k].cross(V(w[k].cross(link)));
      for (int i = 0; i < 2; i++) {
        for (int j = 0; j < 2; j++) A(i, j) += vj[i][k].dot(vj[j][k]) + wj[i][k].dot(V(J * wj[j][k]));
        b(i) -= vj[i][k].dot(centre) + wj[i][k].dot(moment);
      }
    }
    const long double s[2] = {std::sin(y[0]), std::sin(y[1])}, co[2] = {std::cos(y[0]), std::cos(y[1])};
    for (int i = 0; i < 2; i++) {
      A(i, 2) = A(2, i) = co[i] * (1 + s[1 - i]);
      b(2) += s[i] * (1 + s[1 - i]) * y[2 + i] * y[2 + i];
    }
    b(2) -= 2 * co[0] * co[1] * y[2] * y[3];
    const V x = A.inverse() * b;
    f[0] = y[2], f[1] = y[3], f[2] = x(0), f[3] = x(1);
  }
};

/*
  Flyball governor, both rods alike: angle p of the rods below the horizontal, height s of the slider. The angular
  momentum about the shaft is conserved, so that the shaft's angle is cyclic.
*/
class FlyballReference
{
public:
  explicit FlyballReference(double stiffness = 8e5, double damping = 4e4)
      : K_(stiffness), C_(damping), momentum_(inertia(start_).first * 2 * pi_),
        solution_([this](long double, const long double *y, long double *f) { rates(y, f); }, 0.L, 2e-4L,
                  {start_, 0.5L, 0.L, 0.L, 0.L})
  {
  }
  FlyballReference(const FlyballReference &) = delete;

  struct State {
    double p, s, turn; /* angle of the rods, height of the slider, angle of the shaft */
  };
  State at(double t)
  {
    const auto y = solution_.at(t);
    return {(double)y[0], (double)y[1], (double)y[4]};
  }

private:
  static constexpr long double pi_ = 3.14159265358979323846264338327950288L, start_ = pi_ / 6, g_ = 9.81L;
  static constexpr long double axial_ = 0.3L * 2e-4L / 12, across_ = 0.3L * 1.0001L / 12; /* of shaft and rods */
  static constexpr long double hinge_ = across_ + 0.3L * 0.25L + 5; /* of a rod with its mass about its hinge */
  long double                  K_, C_, momentum_;
  Extrapolation                solution_;

  /* about the shaft, and its derivative */
  static std::pair<long double, long double> inertia(long double p)
  {
    const long double c = std::cos(p), s = std::sin(p), x = 0.05L + c / 2, X = 0.05L + c;
    const long double rod  = axial_ * s * s + across_ * c * c + 0.3L * x * x + 5 * X * X;
    const long double rod1 = 2 * s * c * (axial_ - across_) - 0.3L * x * s - 10 * X * s;
    return {axial_ + 3 * 0.02L / 12 + 2 * rod, 2 * rod1};
  }
  void rates(const long double *y, long double *f) const
  {
    const long double c = std::cos(y[0]), s = std::sin(y[0]), up = 1 - s / 2 - y[1], across = c / 2;
    const long double l = std::sqrt(up * up + across * across), lp = (-up * c - across * s) / (2 * l), ls = -up / l;
    const long double F    = K_ * (l - 0.5L) + C_ * (lp * y[2] + ls * y[3]);
    const auto        I    = inertia(y[0]);
    const long double spin = momentum_ / I.first;
    f[0]                   = y[2];
    f[1]                   = y[3];
    f[2]                   = (I.second * spin * spin / 2 + 2 * g_ * c * 5.15L - 2 * F * lp) / (2 * hinge_);
    f[3]                   = -g_ - 2 * F * ls / 3;
    f[4]                   = spin;
  }
};

/* Quarter car: heights of body and wheel above their static equilibrium's road; contact k d^1.5 (1 + c d'), never
 * pulling */
class QuarterCarReference
{
public:
  struct Parameters {
    double               body = 300, wheel = 40, stiffness = 2e4, damping = 1500; /* of the suspension */
    double               tire = 1.2e6, tire_damping = 0.05;                       /* N/m^1.5, s/m */
    hhtdae::TimeFunction road;
    double               sink() const { return std::pow((body + wheel) * 9.81 / tire, 2. / 3); }
  };

  explicit QuarterCarReference(const Parameters &p, double step = 1e-3)
      : p_(p), solution_([this](long double t, const long double *y, long double *f) { rates(t, y, f); }, 0.L, step,
                         {0.L, 0.L, 0.L, 0.L})
  {
  }
  QuarterCarReference(const QuarterCarReference &) = delete;

  double body(double t) { return (double)solution_.at(t)[0]; }
  double wheel(double t) { return (double)solution_.at(t)[1]; }
  double tire(double t) { return force(t, solution_.at(t).data()); }

private:
  Parameters    p_;
  Extrapolation solution_;

  double force(long double t, const long double *y) const
  {
    const auto        r = p_.road((double)t);
    const long double d = p_.sink() + r.f - y[1];
    return d > 0 ? (double)std::max(0.L, p_.tire * d * std::sqrt(d) * (1 + p_.tire_damping * (r.f1 - y[3]))) : 0.;
  }
  void rates(long double t, const long double *y, long double *f) const
  {
    const long double N = force(t, y), S = p_.body * 9.81L + p_.stiffness * (y[1] - y[0]) + p_.damping * (y[3] - y[2]);
    f[0] = y[2];
    f[1] = y[3];
    f[2] = S / p_.body - 9.81L;
    f[3] = (N - S) / p_.wheel - 9.81L;
  }
};

} // namespace hhtex

#endif
