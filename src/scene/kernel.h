/*
  Kernels: each joint, motion or force is implemented by one or more structs of static functions of marker frames in space
  axes. The assembly transforms derivatives by perturbations of markers to generalized coordinates, so that a kernel contains
  nothing about rotation vectors, Euler angles, planar bodies or modes. Kernels are compiled into loops over all their
  instances (batch.h), without virtual calls inside the loop.

  A holonomic constraint Phi(frames, t) = 0

    struct K : Constraint<K, markers, rows> {
      static constexpr const char *name = "in-plane";
      struct Data { ... };                       constants of one instance (may be empty)
      static constexpr unsigned depends = ...;   bits Position(k), Rotation(k) of what the rows depend on (default: everything)
      template <class T> static void value(const Data &, const Frame<T> *f, const T &t, T *phi);
    };

  gets its gradient and curvature by automatic differentiation from Constraint<>; kernels for which speed matters define these functions themselves:

      static void gradient(const Data &, const Frame<double> *f, double t, Matrix<rows, 6*markers> &J);    J = dPhi/d(x_0, theta_0, x_1, ...)
      static void curvature(const Data &, const Frame<double> *f, double t, const double *lambda, Matrix<6*markers, 6*markers> &H);
                                                                                                           H = d(J^T lambda)/d(...)
      static constexpr bool curved(int a, int b);   whether block (a, b) of H, 3 x 3, can be nonzero; a = 2k position of k, 2k+1 rotation

  where theta perturbs a frame as R -> (1 + [theta]) R with the origin held, see frames.h.

  A velocity-level (non-holonomic) constraint Psi(frames, twists, t) = 0, linear in the twists, derives from
  VelocityConstraint<>. Its value() has the twists as an argument after the frames, and the scalars z after t if it has
  `inputs`. The bits of `depends` for positions and rotations of markers also apply to their velocities and angular
  velocities, here and in forces.

  A force has components c(frames, twists, t, z) and the wrenches on the markers' bodies that follow from them,

    struct K : Force<K, markers, components> {
      template <class T> static void components(const Data &, const Frame<T> *f, const Twist<T> *w, const T &t, const T *z, T *c);
      template <class T> static void apply(const Data &, const Frame<T> *f, const T *c, Wrench<T> *on);
    };

  so that the components can be force states F of the paper: then c are unknowns, and the load depends on them and on the frames through apply() only.
  `damped`: components() depends on the twists. `inputs`: number of further scalar unknowns z (multipliers, V, states) on which components() depends.

  A kernel with memory of accepted steps, such as counted turns of an angle, has `static constexpr int memory = 1` (number of
  values), a Data that begins with `double memory[1]`, and accept(Data &, frames), which updates them after each accepted
  step. `angles`: number of leading values that are angles, over full turns, of marker 2k about the z axis of marker 2k+1 (or
  of the markers that markersOfAngle() returns); queries of a run read them.
*/
#ifndef HHTDAE_SCENE_KERNEL_H
#define HHTDAE_SCENE_KERNEL_H

#include "frames.h"
#include <array>

namespace hhtdae
{

struct Empty {
};

constexpr unsigned Position(int k) { return 1u << (2 * k); }
constexpr unsigned Rotation(int k) { return 2u << (2 * k); }
constexpr unsigned Everything(int markers) { return (1u << (2 * markers)) - 1; }
constexpr bool     Depends(unsigned mask, int a) { return (mask >> a) & 1u; }

/* n arguments of a kernel; n = 0: a null pointer */
template <class T, int n> struct Arguments {
  T        value[n];
  const T *data() const { return value; }
  T       &operator[](int i) { return value[i]; }
};
template <class T> struct Arguments<T, 0> {
  const T *data() const { return nullptr; }
};

template <int N, int M> void SeedAll(const Frame<double> *f, Frame<Dual<N>> *s)
{
  for (int k = 0; k < M; k++) s[k] = Seed<N>(f[k], 6 * k);
}

/* Common part of constraints at position and velocity level */
template <class K, int M, int R> struct ConstraintBase {
  static constexpr int      markers = M, rows = R, size = 6 * M;
  static constexpr int      memory = 0, inputs = 0, angles = 0;
  static constexpr unsigned depends = Everything(M);
  static constexpr bool     needs_rotation = true; /* false: f[k].R need not be set */
  /* the user's functions determine the units of the rows; otherwise rows are lengths or sines */
  static constexpr bool     own_units            = false;
  static constexpr bool     prescribes_angle     = false; /* the kernel has angleAt(data, t), the prescribed angle of marker 0 about z of marker 1 */
  static constexpr bool     purely_translational = false; /* row r is component r of the second marker's position minus that of the first */
  using Data                               = Empty;
  using Gradient                           = Matrix<R, size>;
  using Hessian                            = Matrix<size, size>;
  static constexpr bool curved(int a, int b) { return Depends(K::depends, a) && Depends(K::depends, b); }
  template <class Data> static std::array<int, 2> markersOfAngle(const Data &, int k) { return {2 * k, 2 * k + 1}; } /* markers of the k-th angle over full turns */
};

template <class K, int M, int R> struct Constraint : ConstraintBase<K, M, R> {
  using Base = ConstraintBase<K, M, R>;
  using typename Base::Gradient;
  using typename Base::Hessian;
  static constexpr bool holonomic = true;
  static constexpr int  N         = Base::size;

  template <class Data> static void gradient(const Data &d, const Frame<double> *f, double t, Gradient &J)
  {
    Frame<Dual<N>> s[M];
    Dual<N>        phi[R];
    SeedAll<N, M>(f, s);
    K::template value<Dual<N>>(d, s, Dual<N>(t), phi);
    for (int r = 0; r < R; r++) J.row(r) = DerivativeRow(phi[r]);
  }

  template <class Data>
  static void curvature(const Data &d, const Frame<double> *f, double t, const double *lambda, Hessian &H)
  {
    Frame<Dual2<N>> s[M];
    Dual2<N>        phi[R];
    for (int k = 0; k < M; k++) s[k] = Seed2<N>(f[k], 6 * k);
    K::template value<Dual2<N>>(d, s, Dual2<N>(Dual<N>(t)), phi);
    H.setZero();
    for (int r = 0; r < R; r++)
      for (int a = 0; a < N; a++) H.row(a) += lambda[r] * DerivativeRow(phi[r].derivatives()(a));
  }

  /* rate: the partial derivative Phi_t; zero for kernels that do not depend on time */
  static constexpr bool driven = false; /* value() depends on t */
  template <class Data> static void time(const Data &d, const Frame<double> *f, double t, double *rate)
  {
    for (int r = 0; r < R; r++) rate[r] = 0;
    if constexpr (K::driven) {
      using T = Dual<1>;
      Frame<T> s[M];
      T        phi[R];
      for (int k = 0; k < M; k++) s[k] = Constant<T>(f[k]);
      K::template value<T>(d, s, T(t, 0), phi);
      for (int r = 0; r < R; r++) rate[r] = phi[r].derivatives()(0);
    }
  }
};

template <class K, int M, int R> struct VelocityConstraint : ConstraintBase<K, M, R> {
  using Base = ConstraintBase<K, M, R>;
  using typename Base::Gradient;
  using typename Base::Hessian;
  static constexpr bool holonomic = false, driven = true;
  static constexpr int  N = Base::size;

  /* dPsi/d twists (J), dPsi/d frames (P), dPsi/dz (zj, rows x inputs) */
  template <class Data>
  static void gradient(const Data &d, const Frame<double> *f, const Twist<double> *w, double t, const double *z, Gradient &J, Gradient &P,
                       double *zj)
  {
    constexpr int Z = K::inputs;
    using T         = Dual<2 * N + Z>;
    Frame<T>        s[M];
    Twist<T>        u[M];
    T               psi[R];
    Arguments<T, Z> zs;
    for (int k = 0; k < M; k++) {
      s[k] = Seed<2 * N + Z>(f[k], 6 * k);
      u[k] = Seed<2 * N + Z>(w[k], N + 6 * k);
    }
    if constexpr (Z > 0)
      for (int i = 0; i < Z; i++) zs[i] = T(z[i], 2 * N + i);
    evaluate<T>(d, s, u, T(t), zs.data(), psi);
    for (int r = 0; r < R; r++) {
      P.row(r) = DerivativeRow<N>(psi[r], 0);
      J.row(r) = DerivativeRow<N>(psi[r], N);
      for (int i = 0; i < Z && zj; i++) zj[r * Z + i] = psi[r].derivatives()(2 * N + i);
    }
  }

  /* d(J^T lambda)/d frames */
  template <class Data>
  static void curvature(const Data &d, const Frame<double> *f, const Twist<double> *w, double t, const double *z, const double *lambda,
                        Hessian &H)
  {
    using T = Dual2<N>;
    Frame<T>                s[M];
    Twist<T>                u[M];
    T                       psi[R];
    Arguments<T, K::inputs> zs;
    for (int k = 0; k < M; k++) {
      const Frame<Dual<N>> inner = Seed<N>(f[k], 6 * k);
      u[k]                       = Constant<T>(w[k]);
      for (int i = 0; i < 3; i++) {
        s[k].x(i) = T(inner.x(i));
        for (int c = 0; c < 3; c++) s[k].R(i, c) = T(inner.R(i, c));
        u[k].v(i).derivatives()(6 * k + i)     = Dual<N>(1);
        u[k].w(i).derivatives()(6 * k + 3 + i) = Dual<N>(1);
      }
    }
    if constexpr (K::inputs > 0)
      for (int i = 0; i < K::inputs; i++) zs[i] = T(Dual<N>(z[i]));
    evaluate<T>(d, s, u, T(Dual<N>(t)), zs.data(), psi);
    H.setZero();
    for (int r = 0; r < R; r++)
      for (int a = 0; a < N; a++) H.row(a) += lambda[r] * DerivativeRow(psi[r].derivatives()(a));
  }

private:
  template <class T, class Data> static void evaluate(const Data &d, const Frame<T> *f, const Twist<T> *w, const T &t, const T *z, T *psi)
  {
    if constexpr (K::inputs > 0) K::template value<T>(d, f, w, t, z, psi);
    else K::template value<T>(d, f, w, t, psi);
    (void)z;
  }
};

/* Derivatives of the wrenches of all markers, stacked as one vector (f_0, m_0, f_1, ...), by frames, twists and inputs */
template <int M, int Z> struct ForceJacobian {
  Matrix<6 * M, 6 * M>          frames, twists;
  Matrix<6 * M, (Z > 0 ? Z : 1)> inputs;
};

template <class K, int M, int C> struct Force {
  static constexpr int      markers = M, count = C, size = 6 * M, inputs = 0, memory = 0, angles = 0;
  static constexpr unsigned depends = Everything(M); /* positions and rotations that components() and apply() read */
  static constexpr unsigned acts    = Everything(M); /* loads: Position(k) for a force at marker k, Rotation(k) for a moment */
  static constexpr bool     damped = true, needs_rotation = true, prescribes_angle = false;
  static constexpr bool     may_be_force_states = true; /* the user can choose force states for the components */
  using Data = Empty;
  template <class Data> static std::array<int, 2> markersOfAngle(const Data &, int k) { return {2 * k, 2 * k + 1}; } /* markers of the k-th angle over full turns */

  template <class Data>
  static void wrench(const Data &d, const Frame<double> *f, const Twist<double> *w, double t, const double *z, Wrench<double> *on)
  {
    double c[C];
    K::template components<double>(d, f, w, t, z, c);
    K::template apply<double>(d, f, c, on);
  }

  /* Derivatives of the wrenches, by automatic differentiation unless a kernel defines its own. on: the wrenches themselves */
  template <class Data, int Z>
  static void jacobian(const Data &d, const Frame<double> *f, const Twist<double> *w, double t, const double *z, Wrench<double> *on,
                       ForceJacobian<M, Z> &J)
  {
    constexpr int n = 6 * M, moving = K::damped ? n : 0, N = n + moving + Z;
    using T         = Dual<N>;
    Frame<T>                               s[M];
    T                                      c[C];
    Wrench<T>                              load[M];
    Arguments<Twist<T>, K::damped ? M : 0> u;
    Arguments<T, Z>                        zs;
    for (int k = 0; k < M; k++) {
      s[k] = Seed<N>(f[k], 6 * k);
      if constexpr (K::damped) u[k] = Seed<N>(w[k], n + 6 * k);
    }
    if constexpr (Z > 0)
      for (int i = 0; i < Z; i++) zs[i] = T(z[i], n + moving + i);
    K::template components<T>(d, s, u.data(), T(t), zs.data(), c);
    K::template apply<T>(d, s, c, load);
    J.twists.setZero();
    for (int k = 0; k < M; k++)
      for (int i = 0; i < 6; i++) {
        const T &x = i < 3 ? load[k].f(i) : load[k].m(i - 3);
        (i < 3 ? on[k].f(i) : on[k].m(i - 3)) = x.value();
        J.frames.row(6 * k + i) = DerivativeRow<n>(x, 0);
        if constexpr (K::damped) J.twists.row(6 * k + i) = DerivativeRow<n>(x, n);
        if constexpr (Z > 0) J.inputs.row(6 * k + i) = DerivativeRow<Z>(x, N - Z);
      }
  }
};

} // namespace hhtdae

#endif
