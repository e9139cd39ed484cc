/*
  Rotation vectors x, attitudes exp([x]) relative to a reference, as unit quaternions where they are composed, and the tangent T of the exponential map,
  d exp([x]) = [T(x) dx] exp([x]) in axes of space:

    T(x) = 1 + S_2 [x] + S_3 [x]^2,    S_2 = (1 - cos a)/a^2,  S_3 = (a - sin a)/a^3,  a = |x|
*/
#ifndef HHTDAE_ROTATION_VECTOR_H
#define HHTDAE_ROTATION_VECTOR_H

#include <petscsystypes.h>
#include <petscmath.h>

namespace hht3
{

/* c = factor a x b */
inline void Cross(PetscReal factor, const PetscScalar *a, const PetscScalar *b, PetscScalar *c)
{
  for (int i = 0; i < 3; i++) c[i] = factor * (a[(i + 1) % 3] * b[(i + 2) % 3] - a[(i + 2) % 3] * b[(i + 1) % 3]);
}

inline PetscReal Dot(const PetscScalar *a, const PetscScalar *b) { return PetscRealPart(a[0] * b[0] + a[1] * b[1] + a[2] * b[2]); }

inline PetscReal Length(const PetscScalar *a) { return PetscSqrtReal(Dot(a, a)); }

/* Scalar and vector of the unit quaternion of exp([x]) */
struct Turn {
  PetscReal   scalar;
  PetscScalar vector[3];

  explicit Turn(const PetscScalar *x)
  {
    const PetscReal a = Length(x), factor = a > 1e-8 ? PetscSinReal(0.5 * a) / a : 0.5;
    scalar = PetscCosReal(0.5 * a);
    for (int i = 0; i < 3; i++) vector[i] = factor * x[i];
  }
};

/* The vector of exp([x]) exp([-y]), at most half a turn */
inline void Relative(const PetscScalar *x, const PetscScalar *y, PetscScalar *result)
{
  const Turn        p(x), q(y);
  PetscScalar       v[3], c[3];
  Cross(-1, p.vector, q.vector, c);
  for (int i = 0; i < 3; i++) v[i] = q.scalar * p.vector[i] - p.scalar * q.vector[i] + c[i];
  const PetscReal s = p.scalar * q.scalar + Dot(p.vector, q.vector), sine = Length(v), sign = s < 0 ? -1 : 1;
  const PetscReal factor = sine > 1e-8 ? 2 * sign * PetscAtan2Real(sine, sign * s) / sine : 2 * sign;
  for (int i = 0; i < 3; i++) result[i] = factor * v[i];
}

/* T(x) y */
inline void Tangent(const PetscScalar *x, const PetscScalar *y, PetscScalar *result)
{
  const PetscReal z = Dot(x, x), a = PetscSqrtReal(z);
  const PetscReal s2 = z > 0.01 ? (1 - PetscCosReal(a)) / z : 1. / 2 - z * (1. / 24 - z * (1. / 720 - z * (1. / 40320 - z / 3628800)));
  const PetscReal s3 = z > 0.01 ? (a - PetscSinReal(a)) / (z * a) : 1. / 6 - z * (1. / 120 - z * (1. / 5040 - z * (1. / 362880 - z / 39916800)));
  PetscScalar     once[3], twice[3];
  Cross(1, x, y, once);
  Cross(1, x, once, twice);
  for (int i = 0; i < 3; i++) result[i] = y[i] + s2 * once[i] + s3 * twice[i];
}

/* x with x - base = T(x)^{-1} g, which is x = g + T(x) base, by Newton's method with the matrix 1 + [base]/2. Stops at rounding, or where it does not converge, which a
   rotation of more than about a turn brings about. */
inline void ImplicitRotation(const PetscScalar *base, const PetscScalar *g, PetscScalar *x)
{
  constexpr int   most = 50;
  const PetscReal half2 = 0.25 * Dot(base, base);
  for (int i = 0; i < 3; i++) x[i] = base[i] + g[i];
  for (int it = 0; it < most; it++) {
    PetscScalar b[3], r[3], c[3];
    Tangent(x, base, b);
    for (int i = 0; i < 3; i++) r[i] = g[i] + b[i] - x[i];
    Cross(0.5, base, r, c);
    const PetscReal along = 0.25 * Dot(base, r);
    PetscReal       size  = 0;
    for (int i = 0; i < 3; i++) {
      const PetscScalar d = (r[i] - c[i] + along * base[i]) / (1 + half2); /* (1 + [e])^{-1} = (1 - [e] + e e^T)/(1 + e^2) */
      x[i] += d;
      size = PetscMax(size, PetscAbsScalar(d));
    }
    if (!(size > 4 * PETSC_MACHINE_EPSILON * (1 + Length(x)))) return;
  }
}

} // namespace hht3

#endif
