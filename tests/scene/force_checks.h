/* Properties that forces between two markers must have in addition to CheckForce(): a potential, dissipation, objectivity */
#ifndef HHTDAE_TESTS_FORCE_CHECKS_H
#define HHTDAE_TESTS_FORCE_CHECKS_H

#include "hhtdae/types.h"
#include "kernel_checks.h"

namespace hhtdae
{

/* Turns j from i by a random rotation that stays away from half a turn, where rotation vectors jump */
inline void RelativeRotation(Random &random, Frame<double> *f, double largest = 2.9)
{
  const Vec3<double> axis = random.direction();
  f[0].R                  = f[1].R * Eigen::AngleAxisd(random(0, largest), axis).toRotationMatrix();
}

/* Compares the hand-written jacobian() with automatic differentiation of components() and apply(), which force states use */
template <class K, class Make> void CompareForce(const Make &make)
{
  Random random(7);
  for (int k = 0; k < 30; k++) {
    SCOPED_TRACE(K::name);
    const checks::Sample<K> s(make, random);
    ForceJacobian<2, 0>     hand, automatic;
    Wrench<double>          on[2], on2[2], load[2];
    Frame<double>           f[2] = {s.f[0], s.f[1]};
    if (!K::needs_rotation) f[0].R = f[1].R = Matrix3::Identity();
    K::jacobian(s.data, f, s.w, s.t, nullptr, on, hand);
    Force<K, 2, K::count>::jacobian(s.data, f, s.w, s.t, nullptr, on2, automatic);
    Force<K, 2, K::count>::wrench(s.data, f, s.w, s.t, nullptr, load);
    ExpectClose(hand.frames, automatic.frames, 1e-11, "d wrenches/d frames");
    ExpectClose(hand.twists, automatic.twists, 1e-11, "d wrenches/d twists");
    ExpectClose(checks::ToVector<2>(on), checks::ToVector<2>(on2), 1e-12, "wrenches");
    ExpectClose(checks::ToVector<2>(load), checks::ToVector<2>(on2), 1e-12, "wrenches");
  }
}

/* The derivatives of kernels without damping are second derivatives of a potential: along R -> (1 + [theta]) R they
   are symmetric except for the commutator of rotations, -[m] in the blocks of moments */
template <class K, class Make> void ExpectSymmetric(const Make &make)
{
  static_assert(!K::damped, "a potential alone makes a symmetric matrix");
  Random random(3);
  for (int k = 0; k < 30; k++) {
    SCOPED_TRACE(K::name);
    const checks::Sample<K> s(make, random);
    ForceJacobian<2, 0>     J;
    Wrench<double>          on[2];
    K::jacobian(s.data, s.f, s.w, s.t, nullptr, on, J);
    DynamicMatrix skew = J.frames - J.frames.transpose(), expected = DynamicMatrix::Zero(12, 12);
    for (int b = 0; b < 2; b++) expected.block<3, 3>(6 * b + 3, 6 * b + 3) = -Cross<double>(on[b].m);
    ExpectClose(skew, expected, 1e-12, "skew part");
  }
}

/* The wrenches are minus the gradient of an energy */
template <class K, class Make, class Energy> void ExpectPotential(const Make &make, const Energy &energy)
{
  Random random(5);
  for (int k = 0; k < 30; k++) {
    SCOPED_TRACE(K::name);
    const checks::Sample<K> s(make, random);
    DynamicMatrix           gradient(12, 1);
    for (int a = 0; a < 12; a++)
      gradient.row(a) = s.alongFrames(a, [&](const checks::Sample<K> &m) {
        return DynamicVector(DynamicVector::Constant(1, energy(m.data, m.f)));
      });
    ExpectClose(checks::Load(s), -gradient, 1e-8, "wrenches of a potential");
  }
}

/* The damping alone, load(twists) - load(no twists), never does positive work */
template <class K, class Make> void ExpectDissipative(const Make &make)
{
  Random random(11);
  double largest = 0;
  for (int k = 0; k < 100; k++) {
    const checks::Sample<K> s(make, random);
    checks::Sample<K>       rest(s);
    DynamicVector           twists(12);
    for (int m = 0; m < 2; m++) {
      twists.segment<3>(6 * m)     = s.w[m].v;
      twists.segment<3>(6 * m + 3) = s.w[m].w;
      rest.w[m]                    = {Vector3::Zero(), Vector3::Zero()};
    }
    const double power = twists.dot(checks::Load(s) - checks::Load(rest));
    EXPECT_LE(power, 1e-12) << K::name;
    largest = std::max(largest, -power);
  }
  EXPECT_GT(largest, .1) << "nothing was dissipated";
}

/* A rigid motion of all markers turns the wrenches and leaves the components unchanged; a rigid twist produces no
   damping force */
template <class K, class Make> void ExpectObjective(const Make &make)
{
  Random random(13);
  for (int k = 0; k < 30; k++) {
    SCOPED_TRACE(K::name);
    const checks::Sample<K> s(make, random);
    checks::Sample<K>       moved(s);
    const Matrix3           Q     = random.rotation();
    const Vector3           shift = random.vector(5), spin = random.vector(), velocity = random.vector();
    Wrench<double>          on[2], after[2];
    double                  c[K::count], c2[K::count];
    for (int m = 0; m < 2; m++) {
      moved.f[m] = {shift + Q * s.f[m].x, Q * s.f[m].R};
      moved.w[m] = {velocity + Q * s.w[m].v + spin.cross(Vector3(Q * s.f[m].x)), spin + Q * s.w[m].w};
    }
    K::wrench(s.data, s.f, s.w, 0, nullptr, on);
    K::wrench(moved.data, moved.f, moved.w, 0, nullptr, after);
    K::template components<double>(s.data, s.f, s.w, 0., nullptr, c);
    K::template components<double>(moved.data, moved.f, moved.w, 0., nullptr, c2);
    for (int i = 0; i < K::count; i++) EXPECT_NEAR(c[i], c2[i], 1e-11 * (1 + std::abs(c[i])));
    for (int m = 0; m < 2; m++) {
      EXPECT_LT((after[m].f - Q * on[m].f).norm(), 1e-11 * (1 + on[m].f.norm()));
      EXPECT_LT((after[m].m - Q * on[m].m).norm(), 1e-11 * (1 + on[m].m.norm()));
    }
  }
}

} // namespace hhtdae

#endif
