/*
  A rigid body in 3-1-3 Euler angles that tumbles through sin(theta) = 0. Before it gets there it changes to a new body-fixed
  reference frame: A = A313(eps) C, with another C and other angles for the same A.

  A free body has the angles as its only unknowns. A body on a pivot has absolute coordinates, its centre of mass r and the
  angles:

    m r'' + m g e_z + lambda                    = 0
    G^T (J^ w' + w x J^ w - X^ x A313^T lambda) = 0    w = G eps', w' = G eps'' + G' eps', J^ = C J C^T, X^ = C X
    r - A313 X^                                 = 0

  in the reference frame. Reference: Euler's equations about the fixed point, extrapolation of order 20 in long double.
*/
#ifndef HHTDAE_TESTS_TUMBLING_H
#define HHTDAE_TESTS_TUMBLING_H

#include "support.h"

#include <array>
#include <complex>

namespace hhtest
{

template <class T> using Vector = std::array<T, 3>;
template <class T> using Matrix = std::array<Vector<T>, 3>; /* rows */
using Frame                     = Matrix<double>;

template <class T, class S> auto times(const Matrix<T> &A, const Vector<S> &x)
{
  Vector<decltype(T() * S())> y{};
  for (int i = 0; i < 3; i++)
    for (int j = 0; j < 3; j++) y[i] += A[i][j] * x[j];
  return y;
}
template <class T, class S> auto timesTransposed(const Matrix<T> &A, const Vector<S> &x)
{
  Vector<decltype(T() * S())> y{};
  for (int i = 0; i < 3; i++)
    for (int j = 0; j < 3; j++) y[i] += A[j][i] * x[j];
  return y;
}
template <class T> Matrix<T> product(const Matrix<T> &A, const Matrix<T> &B)
{
  Matrix<T> P{};
  for (int i = 0; i < 3; i++)
    for (int j = 0; j < 3; j++)
      for (int k = 0; k < 3; k++) P[i][j] += A[i][k] * B[k][j];
  return P;
}
template <class T> Matrix<T> transposed(const Matrix<T> &A)
{
  Matrix<T> P{};
  for (int i = 0; i < 3; i++)
    for (int j = 0; j < 3; j++) P[i][j] = A[j][i];
  return P;
}
template <class T> Vector<T> cross(const Vector<T> &a, const Vector<T> &b)
{
  return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}

/* Rz(phi) Rx(theta) Rz(psi) */
template <class T> Matrix<T> rotation313(const T *e)
{
  using std::cos;
  using std::sin;
  const T a = cos(e[0]), b = sin(e[0]), c = cos(e[1]), s = sin(e[1]), p = cos(e[2]), q = sin(e[2]);
  return {{{a * p - b * c * q, -a * q - b * c * p, b * s},
           {b * p + a * c * q, -b * q + a * c * p, -a * s},
           {s * q, s * p, c}}};
}

/* w = G eps' in the rotated frame, and G' */
template <class T> void rates313(const T *e, const T *v, Matrix<T> &G, Matrix<T> &dG)
{
  using std::cos;
  using std::sin;
  const T c = cos(e[1]), s = sin(e[1]), p = cos(e[2]), q = sin(e[2]), zero(0.), one(1.);
  G  = {{{s * q, p, zero}, {s * p, -q, zero}, {c, zero, one}}};
  dG = {{{c * q * v[1] + s * p * v[2], -q * v[2], zero},
         {c * p * v[1] - s * q * v[2], -p * v[2], zero},
         {-s * v[1], zero, zero}}};
}

/* eps of a rotation, theta in (0, pi), and x of G x = y */
inline Vector<double> angles313(const Frame &A)
{
  return {std::atan2(A[0][2], -A[1][2]), std::atan2(std::hypot(A[0][2], A[1][2]), A[2][2]),
          std::atan2(A[2][0], A[2][1])};
}
inline Vector<double> solve313(const double *e, const Vector<double> &y)
{
  const double c = std::cos(e[1]), s = std::sin(e[1]), p = std::cos(e[2]), q = std::sin(e[2]);
  const double phi = (q * y[0] + p * y[1]) / s;
  return {phi, p * y[0] - q * y[1], y[2] - c * phi};
}

inline Frame identity() { return {{{1., 0., 0.}, {0., 1., 0.}, {0., 0., 1.}}}; }

struct Tumbling : Problem {
  static constexpr double m = 1., g = 9.81;
  const bool              pivot;
  const Vector<double>    J, X, spin;
  const int               at; /* of the angles */
  const Frame             first;
  mutable Frame           frame; /* C */

  explicit Tumbling(bool onPivot, double end, Frame start = identity())
      : pivot(onPivot),
        J(onPivot ? Vector<double>{.1, .2, .3} : Vector<double>{1., 2., 3.}), X{0., 0., onPivot ? .5 : 0.},
        spin(onPivot ? Vector<double>{.4, 4., .4} : Vector<double>{.1, 1., .1}), at(onPivot ? 3 : 0), first(start),
        frame(start),
        solution_([this](long double, const long double *y, long double *f) { rates(y, f); }, 0.L, .05L, start0())
  {
    name = pivot ? "tumbling on a pivot" : "tumbling";
    n    = pivot ? 9 : 3;
    t1   = end;
    role.assign(n, TSHHT3_COORDINATE);
    if (pivot) std::fill(role.begin() + 6, role.end(), TSHHT3_HOLONOMIC);
  }

  void initial(double *u, double *v) const override
  {
    const Vector<double> e0 = angles313(product(orientation0(), transposed(first)));
    const Vector<double> v0 = solve313(e0.data(), times(first, spin));
    std::fill_n(u, n, 0.);
    std::fill_n(v, n, 0.);
    std::copy_n(e0.data(), 3, u + at);
    std::copy_n(v0.data(), 3, v + at);
    if (!pivot) return;
    const Vector<double> r = times(orientation0(), X), dr = times(orientation0(), cross(spin, X));
    std::copy_n(r.data(), 3, u);
    std::copy_n(dr.data(), 3, v);
  }

  void residual(double, const double *u, const double *v, const double *a, double *f) const override
  {
    equations(u, v, a, f);
  }

  /* Jacobian by complex steps in the direction of every unknown */
  void jacobian(double, const double *u, const double *v, const double *a, double sv, double sa,
                Entries &E) const override
  {
    using Complex             = std::complex<double>;
    const double         d    = 1e-100;
    std::vector<Complex> x[3] = {{u, u + n}, {v, v + n}, {a, a + n}};
    std::vector<Complex> f(n);
    for (PetscInt j = 0; j < n; j++) {
      const double by[3] = {d, d * sv, d * sa};
      for (int k = 0; k < 3; k++) x[k][j] += Complex(0., by[k]);
      equations(x[0].data(), x[1].data(), x[2].data(), f.data());
      for (int k = 0; k < 3; k++) x[k][j] = x[k][j].real();
      for (PetscInt i = 0; i < n; i++) E.add(i, j, f[i].imag() / d);
    }
  }

  /* Largest errors of attitude, angular velocity and angular acceleration in body axes, and of multipliers */
  struct Errors {
    double q = 0., v = 0., a = 0., lambda = 0.;
  };
  Errors errors(double t, const Array &u, const Array &v, const Array &a) const
  {
    const auto     y = solution_.at(t);
    long double    dy[12];
    Frame          G, dG;
    const double  *e = &u[at];
    const Frame    A = product(rotation313(e), frame);
    Vector<double> w, dw, v3{v[at], v[at + 1], v[at + 2]}, a3{a[at], a[at + 1], a[at + 2]};
    Errors         worst;
    rates(y.data(), dy);
    rates313(e, v3.data(), G, dG);
    w                         = times(G, v3);
    dw                        = times(G, a3);
    const Vector<double> more = times(dG, v3);
    for (int i = 0; i < 3; i++) dw[i] += more[i];
    w  = timesTransposed(frame, w);
    dw = timesTransposed(frame, dw);
    for (int i = 0; i < 3; i++) {
      for (int j = 0; j < 3; j++) widen(worst.q, std::abs(A[i][j] - (double)y[3 * i + j]));
      widen(worst.v, std::abs(w[i] - (double)y[9 + i]));
      widen(worst.a, std::abs(dw[i] - (double)dy[9 + i]));
    }
    if (!pivot) return worst;
    Vector<long double> W{y[9], y[10], y[11]}, dW{dy[9], dy[10], dy[11]}, L{X[0], X[1], X[2]};
    Vector<long double> acc = cross(W, cross(W, L)), turn = cross(dW, L);
    for (int i = 0; i < 3; i++) acc[i] += turn[i];
    for (int i = 0; i < 3; i++) {
      long double s = i == 2 ? g : 0.L;
      for (int j = 0; j < 3; j++) s += y[3 * i + j] * acc[j];
      widen(worst.lambda, std::abs(u[6 + i] + (double)(m * s)));
    }
    return worst;
  }
  Vector<double> bodyRates(double t) const
  {
    const auto y = solution_.at(t);
    return {(double)y[9], (double)y[10], (double)y[11]};
  }

private:
  mutable Extrapolation solution_; /* attitude A by rows, w in body axes */

  static Frame orientation0()
  {
    const double e[3] = {0., 1.5707963267948966, 1.5707963267948966};
    return rotation313(e);
  }
  std::vector<long double> start0() const
  {
    std::vector<long double> y;
    for (const auto &row : orientation0()) y.insert(y.end(), row.begin(), row.end());
    y.insert(y.end(), spin.begin(), spin.end());
    return y;
  }
  void rates(const long double *y, long double *f) const
  {
    const Vector<long double> w{y[9], y[10], y[11]}, L{X[0], X[1], X[2]},
        weight{-m * g * y[6], -m * g * y[7], -m * g * y[8]};
    const long double         arm = L[2] * L[2] * m, I[3]                     = {J[0] + arm, J[1] + arm, J[2]};
    const Vector<long double> Iw{I[0] * w[0], I[1] * w[1], I[2] * w[2]}, gyro = cross(w, Iw), torque = cross(L, weight);
    for (int i = 0; i < 3; i++) {
      const Vector<long double> row{y[3 * i], y[3 * i + 1], y[3 * i + 2]}, d = cross(row, w); /* A' = A [w x] */
      for (int j = 0; j < 3; j++) f[3 * i + j] = d[j];
      f[9 + i] = (torque[i] - gyro[i]) / I[i];
    }
  }

  template <class T> void equations(const T *u, const T *v, const T *a, T *f) const
  {
    const T        *e = u + at;
    const Matrix<T> A = rotation313(e);
    const Vector<T> v3{v[at], v[at + 1], v[at + 2]}, a3{a[at], a[at + 1], a[at + 2]};
    Matrix<T>       G, dG;
    rates313(e, v + at, G, dG);
    const Vector<T> w = times(G, v3), more = times(dG, v3);
    Vector<T>       dw = times(G, a3);
    for (int i = 0; i < 3; i++) dw[i] += more[i];
    Vector<T>       Jdw  = inertia(dw);
    const Vector<T> gyro = cross(w, inertia(w));
    for (int i = 0; i < 3; i++) Jdw[i] += gyro[i];
    if (pivot) {
      const Vector<double> Xf = times(frame, X);
      const Vector<T>      arm{Xf[0], Xf[1], Xf[2]}, lambda{u[6], u[7], u[8]}, tip = times(A, arm);
      const Vector<T>      torque = cross(arm, timesTransposed(A, lambda));
      for (int i = 0; i < 3; i++) {
        Jdw[i] -= torque[i];
        f[i]     = m * a[i] + lambda[i] + (i == 2 ? m * g : 0.);
        f[6 + i] = u[i] - tip[i];
      }
    }
    const Vector<T> row = timesTransposed(G, Jdw);
    for (int i = 0; i < 3; i++) f[at + i] = row[i];
  }
  /* C J C^T x */
  template <class T> Vector<T> inertia(const Vector<T> &x) const
  {
    Vector<T> y = timesTransposed(frame, x);
    for (int i = 0; i < 3; i++) y[i] *= J[i];
    return times(frame, y);
  }
};

/* Changes to new frames where sin(theta) < 0.4, and in every `often`-th step if that is not 0 */
class FrameChanges
{
public:
  int                   often;
  bool                  twist = true;    /* false: the frame is replaced by itself, a change without effect */
  int                   last  = 1 << 30; /* last step with a forced change */
  int                   tests = 0, commits = 0;
  std::function<void()> beforeChange, afterChange; /* callbacks before the change, in the test, and after the commit */

  FrameChanges(Simulation &run, const Tumbling &p, int every = 0, bool turnOver = true)
      : often(every), p_(p), turn_(turnOver)
  {
    p.frame = p.first;
    must(VecCreate(PetscObjectComm((PetscObject)run.ts), &frames_));
    must(VecSetSizes(frames_, PETSC_DECIDE, 9));
    must(VecSetFromOptions(frames_));
    store(p.frame);
    must(TSHHT3SetCheckpointVec(run.ts, frames_));
    must(TSHHT3SetCoordinateChange(run.ts, test, map, commit, this));
  }
  ~FrameChanges() { VecDestroy(&frames_); }
  FrameChanges(const FrameChanges &) = delete;

private:
  const Tumbling &p_;
  bool            turn_;
  Vec             frames_ = nullptr; /* C */
  Frame           next_{};

  void store(const Frame &C) const
  {
    PetscInt first, end;
    must(VecGetOwnershipRange(frames_, &first, &end));
    for (PetscInt i = first; i < end; i++) must(VecSetValue(frames_, i, C[i / 3][i % 3], INSERT_VALUES));
    must(VecAssemblyBegin(frames_));
    must(VecAssemblyEnd(frames_));
  }

  static PetscErrorCode test(TS ts, PetscReal, Vec U, Vec, PetscBool *change, void *ctx)
  {
    auto         *c = static_cast<FrameChanges *>(ctx);
    const Array   u = whole(U);
    const double *e = &u[c->p_.at];
    PetscInt      step;
    must(TSGetStepNumber(ts, &step));
    c->tests++;
    const bool forced = c->often && step && step % c->often == 0 && step <= c->last;
    if (!forced && !(c->turn_ && std::abs(std::sin(e[1])) < .4)) return 0;
    *change = PETSC_TRUE;
    if (c->beforeChange) c->beforeChange();
    c->next_ = c->p_.frame;
    if (!c->twist) return 0;
    const double fresh[3] = {.3, forced && step / c->often % 2 ? 1.2 : 1.7, -.5};
    c->next_              = product(transposed(rotation313(fresh)), product(rotation313(e), c->p_.frame));
    c->store(c->next_);
    return 0;
  }
  static PetscErrorCode map(TS, PetscReal, Vec U, Vec V, Vec A, void *ctx)
  {
    auto     *c  = static_cast<FrameChanges *>(ctx);
    const int at = c->p_.at;
    if (!c->twist) return 0;
    Array       x[3]  = {whole(U), whole(V), whole(A)};
    Vec         to[3] = {U, V, A};
    double     *e = &x[0][at], *v = &x[1][at], *a = &x[2][at];
    const Frame D = product(c->next_, transposed(c->p_.frame));
    Frame       G, dG;
    rates313(e, v, G, dG);
    const Vector<double> v3{v[0], v[1], v[2]}, a3{a[0], a[1], a[2]}, more = times(dG, v3);
    Vector<double>       w = times(D, times(G, v3)), dw = times(G, a3);
    for (int i = 0; i < 3; i++) dw[i] += more[i];
    dw                      = times(D, dw);
    const Vector<double> e1 = angles313(product(rotation313(e), transposed(D))), v1 = solve313(e1.data(), w);
    rates313(e1.data(), v1.data(), G, dG);
    const Vector<double> less = times(dG, v1);
    for (int i = 0; i < 3; i++) dw[i] -= less[i];
    const Vector<double> a1 = solve313(e1.data(), dw);
    for (int k = 0; k < 3; k++) {
      const Vector<double> &y = k == 0 ? e1 : k == 1 ? v1 : a1;
      PetscInt              first, end;
      PetscScalar          *z;
      must(VecGetOwnershipRange(to[k], &first, &end));
      must(VecGetArray(to[k], &z));
      for (PetscInt i = 0; i < 3; i++)
        if (at + i >= first && at + i < end) z[at + i - first] = y[i];
      must(VecRestoreArray(to[k], &z));
    }
    return 0;
  }
  static PetscErrorCode commit(TS, void *ctx)
  {
    auto       *c = static_cast<FrameChanges *>(ctx);
    const Array C = whole(c->frames_);
    for (int i = 0; i < 9; i++) c->p_.frame[i / 3][i % 3] = C[i];
    c->commits++;
    if (c->afterChange) c->afterChange();
    return 0;
  }
};

} // namespace hhtest

#endif
