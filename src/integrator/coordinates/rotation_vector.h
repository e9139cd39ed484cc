/*
  Rotation vectors x, which are attitudes exp([x]) relative to a reference; their composition, by unit quaternions; and the tangent T
  of the exponential map, d exp([x]) = [T(x) dx] exp([x]) in axes of space:

    T(x) = 1 + S_2 [x] + S_3 [x]^2,    S_2 = (1 - cos a)/a^2,  S_3 = (a - sin a)/a^3,  a = |x|
*/
#ifndef HHTDAE_ROTATION_VECTOR_H
#define HHTDAE_ROTATION_VECTOR_H

#include <petscsys.h>

namespace hht3
{

/* c = factor a x b */
inline void Cross(PetscReal factor, const PetscScalar *a, const PetscScalar *b, PetscScalar *c)
{
  for (int i = 0; i < 3; i++) c[i] = factor * (a[(i + 1) % 3] * b[(i + 2) % 3] - a[(i + 2) % 3] * b[(i + 1) % 3]);
}

inline PetscReal Dot(const PetscScalar *a, const PetscScalar *b) { return PetscRealPart(a[0] * b[0] + a[1] * b[1] + a[2] * b[2]); }

inline PetscReal VectorLength(const PetscScalar *a) { return PetscSqrtReal(Dot(a, a)); }

/* Scalar and vector part of the unit quaternion of exp([x]) */
struct Turn {
  PetscReal   scalar;
  PetscScalar vector[3];

  explicit Turn(const PetscScalar *x)
  {
    const PetscReal a = VectorLength(x), factor = a > 1e-8 ? PetscSinReal(0.5 * a) / a : 0.5;
    scalar = PetscCosReal(0.5 * a);
    for (int i = 0; i < 3; i++) vector[i] = factor * x[i];
  }
};

/* The rotation vector of exp([x]) q^{-1}, at most half a turn */
inline void RelativeRotation(const PetscScalar *x, const Turn &q, PetscScalar *result)
{
  const Turn        p(x);
  PetscScalar       v[3], c[3];
  Cross(-1, p.vector, q.vector, c);
  for (int i = 0; i < 3; i++) v[i] = q.scalar * p.vector[i] - p.scalar * q.vector[i] + c[i];
  const PetscReal s = p.scalar * q.scalar + Dot(p.vector, q.vector), sine = VectorLength(v), sign = s < 0 ? -1 : 1;
  const PetscReal factor = sine > 1e-8 ? 2 * sign * PetscAtan2Real(sine, sign * s) / sine : 2 * sign;
  for (int i = 0; i < 3; i++) result[i] = factor * v[i];
}

/* S_2 to S_5 at z */
struct Stumpff {
  PetscReal s2, s3, s4, s5;

  explicit Stumpff(PetscReal z)
  {
    if (z > 1) {
      const PetscReal a = PetscSqrtReal(z);
      s2 = (1 - PetscCosReal(a)) / z;
      s3 = (a - PetscSinReal(a)) / (z * a);
      s4 = (1. / 2 - s2) / z;
      s5 = (1. / 6 - s3) / z;
      return;
    }
    s4 = s5 = 0;
    for (int k = 7; k >= 0; k--) { /* 1/4! (1 - z/(5 6) (1 - z/(7 8) ...)) */
      s4 = 1 - z / ((2 * k + 5) * (2 * k + 6)) * s4;
      s5 = 1 - z / ((2 * k + 6) * (2 * k + 7)) * s5;
    }
    s4 /= 24;
    s5 /= 120;
    s2 = 1. / 2 - z * s4;
    s3 = 1. / 6 - z * s5;
  }
};

/* A x = b by Cramer's rule, A by rows */
inline void Solve3(const PetscScalar A[3][3], const PetscScalar *b, PetscScalar *x)
{
  PetscScalar c[3][3]; /* cross products of rows: columns of the inverse times the determinant */
  for (int i = 0; i < 3; i++) Cross(1, A[(i + 1) % 3], A[(i + 2) % 3], c[i]);
  const PetscScalar inverse = (PetscReal)1 / Dot(A[0], c[0]);
  for (int k = 0; k < 3; k++) x[k] = inverse * (c[0][k] * b[0] + c[1][k] * b[1] + c[2][k] * b[2]);
}

/* x with x - base = T(x)^{-1} g, in other words x = g + T(x) base, by Newton's method with the exact derivative

     d(T(x) b)/dx = -S_2 [b] + S_3 ((x.b) 1 + x b^T - 2 b x^T) + ((2 S_4 - S_3) x x b + (3 S_5 - S_4) x x (x x b)) x^T,   S_m = sum (-z)^k/(2k + m)!,  z = x.x

   It ends when the last change was so small that its square is rounding, or after 20 iterations: near a full turn it does not converge. */
inline void ImplicitRotation(const PetscScalar *base, const PetscScalar *g, PetscScalar *x)
{
  constexpr int       most = 20;
  constexpr PetscReal last = 1e-8; /* its square is rounding */
  for (int i = 0; i < 3; i++) x[i] = base[i] + g[i];
  for (int it = 0; it < most; it++) {
    const Stumpff     f(Dot(x, x));
    const PetscReal   along = Dot(x, base), d2 = 2 * f.s4 - f.s3, d3 = 3 * f.s5 - f.s4;
    PetscScalar       once[3], twice[3], r[3], d[3], row[3][3];
    PetscReal         size = 0;
    Cross(1, x, base, once);
    Cross(1, x, once, twice);
    for (int i = 0; i < 3; i++) {
      r[i] = g[i] + base[i] - x[i] + f.s2 * once[i] + f.s3 * twice[i];
      for (int j = 0; j < 3; j++) row[i][j] = -f.s3 * (x[i] * base[j] - 2 * base[i] * x[j]) - (d2 * once[i] + d3 * twice[i]) * x[j];
      row[i][i] += 1 - f.s3 * along;
      row[i][(i + 1) % 3] -= f.s2 * base[(i + 2) % 3];
      row[i][(i + 2) % 3] += f.s2 * base[(i + 1) % 3];
    }
    Solve3(row, r, d);
    for (int i = 0; i < 3; i++) {
      x[i] += d[i];
      size = PetscMax(size, PetscAbsScalar(d[i]));
    }
    if (!(size > last)) return;
  }
}

} // namespace hht3

#endif
