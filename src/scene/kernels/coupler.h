/*
  Couplers of N joint motions: the sum of factor_k s_k keeps its initial value, where s_k is the angle of marker i_k
  about the z axis of j_k, over full turns, or the advance of i_k along an axis of j_k. The first R terms are
  angles. Markers: i_1, j_1, i_2, j_2, ...

  Each term depends on its own pair of markers, so that gradient and curvature are those of the pairs times the factors. The row is "start minus sum",
  so that factor_k times the multiplier is the moment on i_k's body about z_j, or the force on it along the axis of j.
*/
#ifndef HHTDAE_SCENE_KERNELS_COUPLER_H
#define HHTDAE_SCENE_KERNELS_COUPLER_H

#include "angle.h"
#include <algorithm>

namespace hhtdae
{

template <int N, int R> struct CouplerRow : Constraint<CouplerRow<N, R>, 2 * N, 1> {
  static_assert(N >= 1 && R >= 0 && R <= N, "R of the N terms are angles");
  static constexpr const char *name   = "coupler";
  static constexpr int         memory = N, angles = R;
  using Base                          = Constraint<CouplerRow<N, R>, 2 * N, 1>;
  using Gradient                      = typename Base::Gradient;
  using Hessian                       = typename Base::Hessian;
  struct Data {
    double memory[N] = {}; /* angles at the last accepted step, with full turns; zero for advances */
    double factor[N] = {};
    double start     = 0;
    double moved     = 0; /* by which continueFrom() has moved `start` from the value of the description */
    int    axis      = 2; /* axis of j for advances */
  };

  static constexpr unsigned depends = [] {
    unsigned mask = 0;
    for (int k = 0; k < N; k++)
      mask |=
          k < R ? Rotation(2 * k) | Rotation(2 * k + 1) : Position(2 * k) | Position(2 * k + 1) | Rotation(2 * k + 1);
    return mask;
  }();
  static constexpr bool curved(int a, int b)
  {
    return a / 4 == b / 4 && (a / 4 < R ? AngleCurved(a % 4, b % 4) : AdvanceCurved(a % 4, b % 4));
  }

  template <class T> static T sum(const Data &d, const Frame<T> *f)
  {
    T s(0);
    for (int k = 0; k < N; k++) {
      const Frame<T> &i = f[2 * k], &j = f[2 * k + 1];
      s += T(d.factor[k]) * (k < R ? UnwoundAngle<T>(i, j, d.memory[k]) : Advance<T>(i, j, d.axis));
    }
    return s;
  }
  template <class T> static void value(const Data &d, const Frame<T> *f, const T &, T *phi)
  {
    phi[0] = T(d.start) - sum<T>(d, f);
  }

  static void gradient(const Data &d, const Frame<double> *f, double, Gradient &J)
  {
    J.setZero();
    for (int k = 0; k < N; k++) {
      auto part = J.template segment<12>(12 * k);
      if (k < R)
        AddAngleGradient(f[2 * k], f[2 * k + 1], -d.factor[k], part);
      else
        AddAdvanceGradient(f[2 * k], f[2 * k + 1], d.axis, -d.factor[k], part);
    }
  }
  static void curvature(const Data &d, const Frame<double> *f, double, const double *lambda, Hessian &H)
  {
    H.setZero();
    for (int k = 0; k < N; k++) {
      auto part = H.template block<12, 12>(12 * k, 12 * k);
      if (k < R)
        AddAngleCurvature(f[2 * k], f[2 * k + 1], -lambda[0] * d.factor[k], part);
      else
        AddAdvanceCurvature(f[2 * k], f[2 * k + 1], d.axis, -lambda[0] * d.factor[k], part);
    }
  }

  static void accept(Data &d, const Frame<double> *f)
  {
    for (int k = 0; k < R; k++) d.memory[k] = UnwoundAngle<double>(f[2 * k], f[2 * k + 1], d.memory[k]);
  }
  static double longestStep(const Data &, const Frame<double> *f, const Twist<double> *w, double, double angular)
  {
    double least = std::numeric_limits<double>::infinity();
    for (int k = 0; k < R; k++)
      least = std::min(least, LongestTurn(AngleRate<double>(f[2 * k], f[2 * k + 1], w[2 * k], w[2 * k + 1]), angular));
    return least;
  }
  /* Sets memory and `start` from the pose at the start */
  static void begin(Data &d, const Frame<double> *f)
  {
    for (int k = 0; k < R; k++) d.memory[k] = PrincipalAngle<double>(f[2 * k], f[2 * k + 1]);
    d.start = sum<double>(d, f);
  }
  /* In a run that goes on from another one the sum keeps its initial value while the factors are the same; with others it has the value of the present pose from then on */
  static void continueFrom(Data &d, const Data *before, const Frame<double> *f)
  {
    const bool same = before && std::equal(d.factor, d.factor + N, before->factor);
    d.moved         = same ? before->moved : sum<double>(d, f) - d.start;
    d.start += d.moved;
  }
};

/* The advance along z_j minus pitch/(2 pi) times the angle keeps its initial value. Multiplier: force on i's body along z_j;
   the moment about z_j is -pitch/(2 pi) times this force. */
struct ScrewRow : Constraint<ScrewRow, 2, 1> {
  static constexpr const char *name   = "screw";
  static constexpr int         memory = 1, angles = 1;
  using Base                          = Constraint<ScrewRow, 2, 1>;
  struct Data {
    double memory[1] = {};
    double pitch     = 0; /* advance per turn */
    double start     = 0;
    double moved     = 0; /* as that of CouplerRow */
  };
  static constexpr bool curved(int a, int b) { return AngleCurved(a, b) || AdvanceCurved(a, b); }

  template <class T> static T lead(const Data &d, const Frame<T> *f)
  {
    const T angle = UnwoundAngle<T>(f[0], f[1], d.memory[0]), advance = Advance<T>(f[0], f[1], 2);
    return advance - T(d.pitch / kTurn) * angle;
  }
  template <class T> static void value(const Data &d, const Frame<T> *f, const T &, T *phi)
  {
    phi[0] = T(d.start) - lead<T>(d, f);
  }

  static void gradient(const Data &d, const Frame<double> *f, double, Base::Gradient &J)
  {
    J.setZero();
    AddAdvanceGradient(f[0], f[1], 2, -1, J);
    AddAngleGradient(f[0], f[1], d.pitch / kTurn, J);
  }
  static void curvature(const Data &d, const Frame<double> *f, double, const double *lambda, Base::Hessian &H)
  {
    H.setZero();
    AddAdvanceCurvature(f[0], f[1], 2, -lambda[0], H);
    AddAngleCurvature(f[0], f[1], lambda[0] * d.pitch / kTurn, H);
  }
  static void accept(Data &d, const Frame<double> *f) { d.memory[0] = UnwoundAngle<double>(f[0], f[1], d.memory[0]); }
  static double longestStep(const Data &, const Frame<double> *f, const Twist<double> *w, double, double angular)
  {
    return LongestTurn(AngleRate<double>(f[0], f[1], w[0], w[1]), angular);
  }
  static void begin(Data &d, const Frame<double> *f)
  {
    d.memory[0] = PrincipalAngle<double>(f[0], f[1]);
    d.start     = lead<double>(d, f);
  }
  static void continueFrom(Data &d, const Data *before, const Frame<double> *f)
  {
    d.moved = before && d.pitch == before->pitch ? before->moved : lead<double>(d, f) - d.start;
    d.start += d.moved;
  }
};

} // namespace hhtdae

#endif
