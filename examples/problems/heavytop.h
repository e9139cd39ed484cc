/*
  Heavy top (Bruels and Cardona): a body spinning fast about a fixed point, with its centre of mass x and a unit
  quaternion e as coordinates. X is the centre of mass in the body's frame, J the central inertia, G(e) the 3x4 matrix
  with the angular velocity in the body's frame Omega = 2 G e'.

    m x'' + m g e_z + lambda                                              = 0
    4 G^T J G e'' + 8 G(e')^T J G e' - (d(R X)/de)^T lambda + e lambda_4  = 0
    x - R(e) X = 0,   (e^T e - 1) / 2 = 0

  The mass matrix has rank 6 of 7: it is positive definite only on the motions that keep the quaternion's length.

  Reference: Euler's equations about the fixed point and e' = G^T Omega / 2, extrapolation of order 20 in long double.
  Halving its step changes the state at t = 1 by less than 1e-12 (velocities reach 1e2).
*/
#ifndef HHTEX_HEAVYTOP_H
#define HHTEX_HEAVYTOP_H

#include "../problem.h"
#include "extrapolation.h"

#include <algorithm>

namespace hhtex
{

struct HeavyTop : Problem {
  static constexpr double m = 15., g = 9.81, J[3] = {.234375, .46875, .234375}, spin[3] = {0., 150., -4.61538};
  /* X = (0,1,0) */

  explicit HeavyTop(double end = 1., double referenceStep = 0.005)
      : solution_(rates, 0.L, referenceStep,
                  {1.L, 0.L, 0.L, 0.L, (long double)spin[0], (long double)spin[1], (long double)spin[2]})
  {
    name = "heavytop";
    n    = 11;
    t1   = end;
    role.assign(11, TSHHT3_COORDINATE);
    std::fill(role.begin() + 7, role.end(), TSHHT3_HOLONOMIC);
  }

  void initial(double *u, double *v) const override
  {
    const double u0[11] = {0., 1., 0., 1., 0., 0., 0., 0., 0., 0., 0.};
    const double v0[11] = {-spin[2], 0., spin[0], 0., spin[0] / 2., spin[1] / 2., spin[2] / 2., 0., 0., 0., 0.};
    std::copy_n(u0, 11, u);
    std::copy_n(v0, 11, v);
  }

  void residual(double, const double *u, const double *v, const double *a, double *f) const override
  {
    const double *e = u + 3, *de = v + 3, *lambda = u + 7;
    double        G[3][4], dG[3][4], B[3][4], JGa[3] = {}, JGv[3] = {};
    matrixG(e, G);
    matrixG(de, dG);
    arm(e, B);
    for (int i = 0; i < 3; i++)
      for (int j = 0; j < 4; j++) {
        JGa[i] += J[i] * G[i][j] * a[3 + j];
        JGv[i] += J[i] * G[i][j] * de[j];
      }
    for (int i = 0; i < 3; i++) f[i] = m * a[i] + lambda[i] + (i == 2 ? m * g : 0.);
    for (int j = 0; j < 4; j++) {
      f[3 + j] = e[j] * lambda[3];
      for (int i = 0; i < 3; i++) f[3 + j] += 4. * G[i][j] * JGa[i] + 8. * dG[i][j] * JGv[i] - B[i][j] * lambda[i];
    }
    for (int i = 0; i < 3; i++) {
      f[7 + i] = u[i];
      for (int j = 0; j < 4; j++) f[7 + i] -= B[i][j] * e[j] / 2.; /* R X is quadratic in e */
    }
    f[10] = (e[0] * e[0] + e[1] * e[1] + e[2] * e[2] + e[3] * e[3] - 1.) / 2.;
  }

  void jacobian(double, const double *u, const double *v, const double *a, double sv, double sa,
                Entries &E) const override
  {
    const double *e = u + 3, *lambda = u + 7;
    double        B[3][4], K[4][4];
    arm(e, B);
    rotation(e, v + 3, a + 3, sv, sa, K);
    addArmGradient(lambda, K);
    for (PetscInt i = 0; i < 3; i++) {
      E.add(i, i, sa * m);
      E.add(i, 7 + i, 1.);
      E.add(7 + i, i, 1.);
      for (PetscInt j = 0; j < 4; j++) {
        E.add(7 + i, 3 + j, -B[i][j]);
        E.add(3 + j, 7 + i, -B[i][j]);
      }
    }
    for (PetscInt i = 0; i < 4; i++) {
      for (PetscInt j = 0; j < 4; j++) E.add(3 + i, 3 + j, K[i][j] + (i == j ? lambda[3] : 0.));
      E.add(3 + i, 10, e[i]);
      E.add(10, 3 + i, e[i]);
    }
  }

  bool reference(double t, double *u, double *v, double *a) const override
  {
    const auto         y = solution_.at(t - t0);
    const long double *e = y.data(), *w = e + 4;
    long double        d[7], G[3][4], dG[3][4], B[3][4], dB[3][4], dde[4] = {}, energy = 0.L, pull = 0.L;
    rates(t, e, d);
    matrixG(e, G);
    matrixG(d, dG);
    arm(e, B);
    arm(d, dB);
    for (int j = 0; j < 4; j++)
      for (int i = 0; i < 3; i++) dde[j] += (dG[i][j] * w[i] + G[i][j] * d[4 + i]) / 2.L;
    setUnknown(u, v, a);
    for (int i = 0; i < 3; i++) {
      long double x = 0.L, dx = 0.L, ddx = 0.L;
      for (int j = 0; j < 4; j++) {
        x += B[i][j] * e[j] / 2.L;
        dx += B[i][j] * d[j];
        ddx += B[i][j] * dde[j] + dB[i][j] * d[j];
      }
      const long double lambda = -m * (ddx + (i == 2 ? g : 0.));
      u[i]                     = x;
      v[i]                     = dx;
      a[i]                     = ddx;
      u[7 + i]                 = lambda;
      energy += J[i] * w[i] * w[i];
      pull += x * lambda;
    }
    for (int j = 0; j < 4; j++) {
      u[3 + j] = e[j];
      v[3 + j] = d[j];
      a[3 + j] = dde[j];
    }
    u[10] = 2.L * (energy + pull); /* the quaternion's own equation times e^T */
    return true;
  }

  bool                referenceEverywhere() const override { return true; }
  std::vector<double> referenceTimes() const override { return equallySpaced(10); }

private:
  mutable Extrapolation solution_; /* e, Omega */

  /* Linear in e, with G(e) e = 0 and G(e) d = -G(d) e */
  template <class T> static void matrixG(const T *e, T G[3][4])
  {
    const T rows[3][4] = {{-e[1], e[0], e[3], -e[2]}, {-e[2], -e[3], e[0], e[1]}, {-e[3], e[2], -e[1], e[0]}};
    std::copy(&rows[0][0], &rows[0][0] + 12, &G[0][0]);
  }

  /* B = d(R X)/de for X = (0,1,0): linear in e, R X = B e / 2 */
  template <class T> static void arm(const T *e, T B[3][4])
  {
    const T rows[3][4] = {{-2 * e[3], 2 * e[2], 2 * e[1], -2 * e[0]},
                          {2 * e[0], -2 * e[1], 2 * e[2], -2 * e[3]},
                          {2 * e[1], 2 * e[0], 2 * e[3], 2 * e[2]}};
    std::copy(&rows[0][0], &rows[0][0] + 12, &B[0][0]);
  }

  /* K -= d(B^T lambda)/de */
  static void addArmGradient(const double *lambda, double K[4][4])
  {
    for (int j = 0; j < 4; j++) {
      double unit[4] = {}, B[3][4];
      unit[j]        = 1.;
      arm(unit, B);
      for (int i = 0; i < 4; i++)
        for (int r = 0; r < 3; r++) K[i][j] -= B[r][i] * lambda[r];
    }
  }

  /* K = derivative of 4 G^T J G e'' + 8 G(e')^T J G e' by e, and sv, sa times those by e' and e'' */
  static void rotation(const double *e, const double *v, const double *a, double sv, double sa, double K[4][4])
  {
    double G[3][4], Gv[3][4], Ga[3][4], JGa[3] = {}, JGv[3] = {};
    matrixG(e, G);
    matrixG(v, Gv);
    matrixG(a, Ga);
    for (int r = 0; r < 3; r++)
      for (int j = 0; j < 4; j++) {
        JGa[r] += J[r] * G[r][j] * a[j];
        JGv[r] += J[r] * G[r][j] * v[j];
      }
    for (int j = 0; j < 4; j++) {
      double unit[4] = {}, D[3][4]; /* dG/de_j */
      unit[j]        = 1.;
      matrixG(unit, D);
      for (int i = 0; i < 4; i++) {
        K[i][j] = 0.;
        for (int r = 0; r < 3; r++) {
          K[i][j] += 4. * (D[r][i] * JGa[r] - G[r][i] * J[r] * Ga[r][j]) - 8. * Gv[r][i] * J[r] * Gv[r][j];
          K[i][j] += sv * 8. * (D[r][i] * JGv[r] + Gv[r][i] * J[r] * G[r][j]) + sa * 4. * G[r][i] * J[r] * G[r][j];
        }
      }
    }
  }

  static void rates(long double, const long double *y, long double *f)
  {
    const long double *e = y, *w = y + 4;
    const long double  I[3] = {J[0] + m, J[1], J[2] + m}; /* about the fixed point */
    long double        G[3][4];
    matrixG(e, G);
    for (int j = 0; j < 4; j++) {
      f[j] = 0.L;
      for (int i = 0; i < 3; i++) f[j] += G[i][j] * w[i] / 2.L;
    }
    /* torque X x R^T (0,0,-m g): R^T e_z is the last row of R */
    const long double zx = 2.L * (e[1] * e[3] - e[0] * e[2]),
                      zz = e[0] * e[0] - e[1] * e[1] - e[2] * e[2] + e[3] * e[3];
    f[4]                 = (-m * g * zz - (I[2] - I[1]) * w[1] * w[2]) / I[0];
    f[5]                 = -(I[0] - I[2]) * w[2] * w[0] / I[1];
    f[6]                 = (m * g * zx - (I[1] - I[0]) * w[0] * w[1]) / I[2];
  }
};

} // namespace hhtex

#endif
