/*
  Checks that every kernel of constraints and forces has to pass, over random states far from equilibrium: derivatives
  against differences, masks against what they exclude, loads against balance.

    CheckConstraint<K>(make);           K : Constraint
    CheckVelocityConstraint<K>(make);   K : VelocityConstraint
    CheckForce<K>(make);                K : Force

  `make` gives the Data of one state; it may adjust the random frames, where the kernel is not defined everywhere:

    [](Random &random) { return K::Data{random(1, 2)}; }
    [](Random &random, Frame<double> *f) { ... }
    [](Random &random, Frame<double> *f, Twist<double> *w) { ... }

  and may be left out if K has no data. Positions and rates are of order one, rotations are spread over all of SO(3).
  What the masks `acts`, `depends` and `curved` exclude has to be zero exactly.
*/
#ifndef HHTDAE_TESTS_KERNEL_CHECKS_H
#define HHTDAE_TESTS_KERNEL_CHECKS_H

#include "scene/frames.h"
#include "scene/kernel.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <random>
#include <type_traits>
#include <vector>

namespace hhtdae
{

using DynamicMatrix = Eigen::MatrixXd;
using DynamicVector = Eigen::VectorXd;

class Random
{
public:
  explicit Random(unsigned seed = 1) : engine_(seed) {}

  double       operator()(double low, double high) { return low + (high - low) * (engine_() * (1 / 4294967296.)); }
  Vec3<double> vector(double size = 1)
  {
    const double x = (*this)(-size, size), y = (*this)(-size, size), z = (*this)(-size, size);
    return {x, y, z};
  }
  Vec3<double> direction()
  {
    for (;;) {
      const Vec3<double> v = vector();
      if (v.norm() > .1 && v.norm() < 1) return v.normalized();
    }
  }
  Mat3<double> rotation()
  {
    const double angle = (*this)(-M_PI, M_PI); /* not uniformly distributed, but covering all rotations */
    return Eigen::AngleAxisd(angle, direction()).toRotationMatrix();
  }
  Frame<double> frame(double size = 2)
  {
    const Vec3<double> x = vector(size);
    return {x, rotation()};
  }
  Twist<double> twist(double size = 2)
  {
    const Vec3<double> v = vector(size);
    return {v, vector(size)};
  }

private:
  std::mt19937 engine_;
};

/* The frame moved by h in direction a: 0..2 translation, 3..5 rotation about space axes through the origin */
inline Frame<double> Moved(Frame<double> f, int a, double h)
{
  if (a < 3)
    f.x(a) += h;
  else
    f.R = Eigen::AngleAxisd(h, Vec3<double>::Unit(a - 3)).toRotationMatrix() * f.R;
  return f;
}

/* Derivative of g at 0 by differences of fourth order */
inline DynamicVector Difference(const std::function<DynamicVector(double)> &g, double h = 1e-4)
{
  return (8 * (g(h) - g(-h)) - (g(2 * h) - g(-2 * h))) / (12 * h);
}

inline void ExpectClose(const DynamicMatrix &exact, const DynamicMatrix &differences, double tolerance,
                        const char *what)
{
  ASSERT_EQ(exact.rows(), differences.rows());
  ASSERT_EQ(exact.cols(), differences.cols());
  ASSERT_TRUE(exact.allFinite()) << what << " is not finite:\n" << exact;
  ASSERT_TRUE(differences.allFinite()) << "differences of " << what << " are not finite:\n" << differences;
  const double scale = 1 + std::max(exact.cwiseAbs().maxCoeff(), differences.cwiseAbs().maxCoeff());
  EXPECT_LT((exact - differences).cwiseAbs().maxCoeff(), tolerance * scale) << what << " is\n"
                                                                            << exact << "\nbut should be\n"
                                                                            << differences;
}

namespace checks
{

constexpr int    states    = 30;
constexpr double tolerance = 1e-7;

struct Nothing {
};

template <class K, class Make>
typename K::Data MakeData(const Make &make, Random &random, Frame<double> *f, Twist<double> *w)
{
  if constexpr (std::is_same_v<Make, Nothing>)
    return {};
  else if constexpr (std::is_invocable_v<Make, Random &, Frame<double> *, Twist<double> *>)
    return make(random, f, w);
  else if constexpr (std::is_invocable_v<Make, Random &, Frame<double> *>)
    return make(random, f);
  else
    return make(random);
}

/* A random state of kernel K with its additional inputs z */
template <class K> struct Sample {
  static constexpr int M = K::markers, Z = K::inputs > 0 ? K::inputs : 1;
  Frame<double>        f[M];
  Twist<double>        w[M];
  double               t;
  Matrix<Z, 1>         z;
  typename K::Data     data;

  template <class Make> Sample(const Make &make, Random &random) : t(random(-1, 2))
  {
    for (int k = 0; k < M; k++) {
      f[k] = random.frame();
      w[k] = random.twist();
    }
    for (int i = 0; i < Z; i++) z(i) = random(-2, 2);
    data = MakeData<K>(make, random, f, w);
    if (!K::needs_rotation) /* NaN, so that any use of it becomes visible */
      for (int k = 0; k < M; k++) f[k].R.setConstant(std::numeric_limits<double>::quiet_NaN());
  }
  /* Derivative of g along direction a of each frame or twist in turn */
  DynamicVector alongFrames(int a, const std::function<DynamicVector(const Sample &)> &g) const
  {
    return Difference([&](double h) {
      Sample s(*this);
      if (a % 6 < 3 || K::needs_rotation) s.f[a / 6] = Moved(f[a / 6], a % 6, h);
      return g(s);
    });
  }
  DynamicVector alongTwists(int a, const std::function<DynamicVector(const Sample &)> &g) const
  {
    return Difference([&](double h) {
      Sample s(*this);
      (a % 6 < 3 ? s.w[a / 6].v(a % 6) : s.w[a / 6].w(a % 6 - 3)) += h;
      return g(s);
    });
  }
  DynamicVector alongInput(int i, const std::function<DynamicVector(const Sample &)> &g) const
  {
    return Difference([&](double h) {
      Sample s(*this);
      s.z(i) += h;
      return g(s);
    });
  }
  DynamicVector alongTime(const std::function<DynamicVector(const Sample &)> &g) const
  {
    return Difference([&](double h) {
      Sample s(*this);
      s.t += h;
      return g(s);
    });
  }
};

template <int N> DynamicVector ToVector(const double *x) { return Eigen::Map<const Matrix<N, 1>>(x); }

/* J must be exactly zero where the kernel declares no dependence, H where it declares no curvature */
template <class K, class Derived> void ExpectMasked(const Eigen::MatrixBase<Derived> &J, const char *what)
{
  for (int a = 0; a < 2 * K::markers; a++) {
    if (Depends(K::depends, a)) continue;
    EXPECT_EQ(J.middleCols(3 * a, 3).cwiseAbs().maxCoeff(), 0) << what << " has entries in excluded block " << a;
  }
}

template <class K> void ExpectUncurved(const typename K::Hessian &H)
{
  for (int a = 0; a < 2 * K::markers; a++)
    for (int b = 0; b < 2 * K::markers; b++) {
      if (K::curved(a, b)) continue;
      const double largest = H.template block<3, 3>(3 * a, 3 * b).cwiseAbs().maxCoeff();
      EXPECT_EQ(largest, 0) << "curvature in excluded block " << a << ", " << b;
    }
}

template <class K> DynamicVector Multipliers(Random &random)
{
  DynamicVector lambda(K::rows);
  for (int r = 0; r < K::rows; r++) lambda(r) = random(-2, 2);
  return lambda;
}

} // namespace checks

/* ---- holonomic constraints ---- */

namespace checks
{

template <class K> DynamicVector Value(const Sample<K> &s)
{
  double phi[K::rows];
  K::template value<double>(s.data, s.f, s.t, phi);
  return ToVector<K::rows>(phi);
}

template <class K> typename K::Gradient Gradient(const Sample<K> &s)
{
  typename K::Gradient J;
  J.setConstant(std::numeric_limits<double>::quiet_NaN()); /* NaN, because a kernel must set every entry */
  K::gradient(s.data, s.f, s.t, J);
  return J;
}

template <class K> typename K::Hessian Curvature(const Sample<K> &s, const DynamicVector &lambda)
{
  typename K::Hessian H;
  H.setConstant(std::numeric_limits<double>::quiet_NaN());
  K::curvature(s.data, s.f, s.t, lambda.data(), H);
  return H;
}

/* Compares with the automatic derivatives of Constraint<>, which a kernel may replace by its own */
template <class K> void CompareWithAutomatic(const Sample<K> &s, const DynamicVector &lambda)
{
  using Automatic = Constraint<K, K::markers, K::rows>;
  typename K::Gradient J;
  typename K::Hessian  H;
  if (!K::needs_rotation) return;
  Automatic::gradient(s.data, s.f, s.t, J);
  Automatic::curvature(s.data, s.f, s.t, lambda.data(), H);
  ExpectClose(Gradient(s), J, 1e-11, "gradient");
  ExpectClose(Curvature(s, lambda), H, 1e-10, "curvature");
}

template <class K> void CheckTimeDerivative(const Sample<K> &s)
{
  double rate[K::rows];
  K::time(s.data, s.f, s.t, rate);
  ExpectClose(Eigen::Map<Matrix<K::rows, 1>>(rate), s.alongTime(Value<K>), tolerance, "Phi_t");
}

} // namespace checks

template <class K, class Make = checks::Nothing>
void CheckConstraint(const Make &make = {}, unsigned seed = 1, double tolerance = checks::tolerance)
{
  Random random(seed);
  for (int k = 0; k < checks::states && !testing::Test::HasFatalFailure(); k++) {
    SCOPED_TRACE(std::string(K::name) + ", random state " + std::to_string(k));
    const checks::Sample<K>    s(make, random);
    const DynamicVector        lambda = checks::Multipliers<K>(random);
    const typename K::Gradient J      = checks::Gradient(s);
    const typename K::Hessian  H      = checks::Curvature(s, lambda);
    DynamicMatrix              dPhi(K::rows, K::size), dLoad(K::size, K::size);
    for (int a = 0; a < K::size; a++) {
      dPhi.col(a)  = s.alongFrames(a, checks::Value<K>);
      dLoad.col(a) = s.alongFrames(a, [&](const checks::Sample<K> &moved) {
        return DynamicVector(checks::Gradient(moved).transpose() * lambda);
      });
    }
    ExpectClose(J, dPhi, tolerance, "gradient");
    ExpectClose(H, dLoad, tolerance, "curvature");
    checks::ExpectMasked<K>(J, "gradient");
    checks::ExpectUncurved<K>(H);
    if constexpr (!K::own_units) checks::CompareWithAutomatic(s, lambda);
    checks::CheckTimeDerivative(s);
  }
}

/* ---- velocity-level constraints ---- */

namespace checks
{

template <class K> DynamicVector VelocityValue(const Sample<K> &s)
{
  double psi[K::rows];
  if constexpr (K::inputs > 0)
    K::template value<double>(s.data, s.f, s.w, s.t, s.z.data(), psi);
  else
    K::template value<double>(s.data, s.f, s.w, s.t, psi);
  return ToVector<K::rows>(psi);
}

/* dPsi/d(twists), dPsi/d(frames), dPsi/d(inputs) */
template <class K>
void VelocityGradient(const Sample<K> &s, typename K::Gradient &J, typename K::Gradient &P,
                      Matrix<K::rows, Sample<K>::Z> &Jz)
{
  double zj[K::rows * Sample<K>::Z] = {};
  J.setConstant(std::numeric_limits<double>::quiet_NaN());
  P.setConstant(std::numeric_limits<double>::quiet_NaN());
  K::gradient(s.data, s.f, s.w, s.t, s.z.data(), J, P, zj);
  for (int r = 0; r < K::rows; r++)
    for (int i = 0; i < Sample<K>::Z; i++) Jz(r, i) = zj[r * Sample<K>::Z + i];
}

template <class K> DynamicVector VelocityLoad(const Sample<K> &s, const DynamicVector &lambda)
{
  typename K::Gradient          J, P;
  Matrix<K::rows, Sample<K>::Z> Jz;
  VelocityGradient(s, J, P, Jz);
  return J.transpose() * lambda;
}

/* Psi is affine in the twists, Psi(w) = J w + Psi(0), and its reaction J^T lambda does not depend on the inputs */
template <class K> void CheckLinear(const Sample<K> &s, const typename K::Gradient &J, const DynamicVector &lambda)
{
  Sample<K>     rest(s), twice(s), other(s);
  DynamicVector w(K::size);
  for (int k = 0; k < K::markers; k++) {
    w.segment<3>(6 * k)     = s.w[k].v;
    w.segment<3>(6 * k + 3) = s.w[k].w;
    rest.w[k].v.setZero();
    rest.w[k].w.setZero();
    twice.w[k].v *= 2;
    twice.w[k].w *= 2;
  }
  other.z.array() += 1;
  ExpectClose(J * w, VelocityValue(s) - VelocityValue(rest), 1e-12, "J times twists");
  ExpectClose(2 * J * w, VelocityValue(twice) - VelocityValue(rest), 1e-12, "J times twice the twists");
  ExpectClose(VelocityLoad(other, lambda), VelocityLoad(s, lambda), 1e-14, "reaction with other inputs");
}

} // namespace checks

template <class K, class Make = checks::Nothing>
void CheckVelocityConstraint(const Make &make = {}, unsigned seed = 1, double tolerance = checks::tolerance)
{
  Random random(seed);
  for (int k = 0; k < checks::states && !testing::Test::HasFatalFailure(); k++) {
    SCOPED_TRACE(std::string(K::name) + ", random state " + std::to_string(k));
    const checks::Sample<K>               s(make, random);
    const DynamicVector                   lambda = checks::Multipliers<K>(random);
    typename K::Gradient                  J, P;
    typename K::Hessian                   H;
    Matrix<K::rows, checks::Sample<K>::Z> Jz;
    DynamicMatrix                         dTwists(K::rows, K::size), dFrames(K::rows, K::size), dLoad(K::size, K::size);
    checks::VelocityGradient(s, J, P, Jz);
    H.setConstant(std::numeric_limits<double>::quiet_NaN());
    K::curvature(s.data, s.f, s.w, s.t, s.z.data(), lambda.data(), H);
    for (int a = 0; a < K::size; a++) {
      dTwists.col(a) = s.alongTwists(a, checks::VelocityValue<K>);
      dFrames.col(a) = s.alongFrames(a, checks::VelocityValue<K>);
      dLoad.col(a)   = s.alongFrames(a, [&](const checks::Sample<K> &m) { return checks::VelocityLoad(m, lambda); });
    }
    ExpectClose(J, dTwists, tolerance, "dPsi/d twists");
    ExpectClose(P, dFrames, tolerance, "dPsi/d frames");
    ExpectClose(H, dLoad, tolerance, "curvature");
    for (int i = 0; i < K::inputs; i++)
      ExpectClose(Jz.col(i), s.alongInput(i, checks::VelocityValue<K>), tolerance, "dPsi/d input");
    checks::ExpectMasked<K>(J, "dPsi/d twists");
    checks::ExpectMasked<K>(P, "dPsi/d frames");
    checks::ExpectUncurved<K>(H);
    checks::CheckLinear(s, J, lambda);
  }
}

/* ---- forces ---- */

namespace checks
{

/* Forces and moments of all markers in one vector */
template <int M> DynamicVector ToVector(const Wrench<double> *on)
{
  DynamicVector x(6 * M);
  for (int k = 0; k < M; k++) {
    x.segment<3>(6 * k)     = on[k].f;
    x.segment<3>(6 * k + 3) = on[k].m;
  }
  return x;
}

template <class K> DynamicVector Load(const Sample<K> &s)
{
  Wrench<double> on[K::markers];
  K::wrench(s.data, s.f, s.w, s.t, s.z.data(), on);
  return ToVector<K::markers>(on);
}

/* The sums of forces and of moments about the space origin vanish */
template <class K> void ExpectBalance(const Sample<K> &s, const DynamicVector &load)
{
  Vec3<double> force = Vec3<double>::Zero(), moment = Vec3<double>::Zero();
  for (int k = 0; k < K::markers; k++) {
    force += load.segment<3>(6 * k);
    moment += load.segment<3>(6 * k + 3) + s.f[k].x.cross(Vec3<double>(load.segment<3>(6 * k)));
  }
  const double scale = 1 + load.cwiseAbs().maxCoeff();
  EXPECT_LT(force.norm(), 1e-11 * scale) << "the forces do not balance: " << force.transpose();
  EXPECT_LT(moment.norm(), 1e-11 * scale) << "the moments do not balance: " << moment.transpose();
}

template <class K> void ExpectActs(const DynamicVector &load)
{
  for (int a = 0; a < 2 * K::markers; a++)
    if (!Depends(K::acts, a)) {
      EXPECT_EQ(load.segment<3>(3 * a).norm(), 0) << "load in excluded block " << a;
    }
}

} // namespace checks

/* balanced: the wrenches contain both action and reaction */
template <class K, class Make = checks::Nothing>
void CheckForce(const Make &make = {}, bool balanced = true, unsigned seed = 1, double tolerance = checks::tolerance)
{
  constexpr int Z = K::inputs;
  Random        random(seed);
  for (int k = 0; k < checks::states && !testing::Test::HasFatalFailure(); k++) {
    SCOPED_TRACE(std::string(K::name) + ", random state " + std::to_string(k));
    const checks::Sample<K>      s(make, random);
    const DynamicVector          load = checks::Load(s);
    ForceJacobian<K::markers, Z> J;
    Wrench<double>               on[K::markers];
    DynamicMatrix                dFrames(K::size, K::size), dTwists(K::size, K::size);
    J.frames.setConstant(std::numeric_limits<double>::quiet_NaN());
    J.twists.setConstant(std::numeric_limits<double>::quiet_NaN());
    J.inputs.setConstant(std::numeric_limits<double>::quiet_NaN());
    K::jacobian(s.data, s.f, s.w, s.t, s.z.data(), on, J);
    for (int a = 0; a < K::size; a++) {
      dFrames.col(a) = s.alongFrames(a, checks::Load<K>);
      dTwists.col(a) = s.alongTwists(a, checks::Load<K>);
    }
    ExpectClose(checks::ToVector<K::markers>(on), load, 1e-12, "wrenches beside the jacobian");
    ExpectClose(J.frames, dFrames, tolerance, "d wrenches/d frames");
    ExpectClose(J.twists, dTwists, tolerance, "d wrenches/d twists");
    for (int i = 0; i < Z; i++)
      ExpectClose(J.inputs.col(i), s.alongInput(i, checks::Load<K>), tolerance, "d wrenches/d input");
    checks::ExpectMasked<K>(J.frames, "d wrenches/d frames");
    checks::ExpectMasked<K>(J.twists, "d wrenches/d twists");
    if (!K::damped) {
      EXPECT_EQ(J.twists.cwiseAbs().maxCoeff(), 0) << "damping of an undamped force";
    }
    checks::ExpectActs<K>(load);
    if (balanced) checks::ExpectBalance(s, load);
  }
}

} // namespace hhtdae

#endif
