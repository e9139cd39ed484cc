/*
  Car axis (IVP test set): an axis of length L on two stiff springs, the right wheel driven over a bumpy road.
  Coordinates of the two ends (xl, yl, xr, yr), two constraints of which the first depends on time. With k = M eps^2 /
  2:

    k p'' - f(t,p) + Phi_p^T lambda = 0
    Phi_1 = -(xb xl + yb yl)                       yb = r sin(w t), xb = sqrt(L^2 - yb^2)
    Phi_2 = L^2 - (xl - xr)^2 - (yl - yr)^2        signs chosen so that lambda is the test set's

  Reference at t = 3: long-double extrapolation of order 20 (600 and 1200 steps agree).
*/
#ifndef HHTEX_CARAXIS_H
#define HHTEX_CARAXIS_H

#include "../problem.h"

#include <algorithm>
#include <cmath>

namespace hhtex
{

struct CarAxis : Problem {
  const double eps = 1e-2, M = 10., L = 1., L0 = 0.5, r = 0.1, w = 10., g = 1., k = M * eps * eps / 2.;

  CarAxis()
  {
    name = "caraxis";
    n    = 6;
    t1   = 3.;
    role.assign(6, TSHHT3_COORDINATE);
    role[4] = role[5] = TSHHT3_HOLONOMIC;
  }

  void initial(double *u, double *v) const override
  {
    const double u0[6] = {0., L0, L, L0, 0., 0.}, v0[6] = {-L0 / L, 0., -L0 / L, 0., 0., 0.};
    std::copy_n(u0, 6, u);
    std::copy_n(v0, 6, v);
  }

  void road(double t, double &xb, double &yb) const
  {
    yb = r * std::sin(w * t);
    xb = std::sqrt(L * L - yb * yb);
  }

  void residual(double t, const double *u, const double *, const double *a, double *f) const override
  {
    double xb, yb;
    road(t, xb, yb);
    const double xl = u[0], yl = u[1], xr = u[2], yr = u[3], dx = xr - xb, dy = yr - yb, sx = xl - xr, sy = yl - yr;
    const double Ll = std::hypot(xl, yl), Lr = std::hypot(dx, dy), l1 = u[4], l2 = u[5];
    f[0] = k * a[0] - (L0 - Ll) * xl / Ll - xb * l1 - 2. * sx * l2;
    f[1] = k * a[1] - (L0 - Ll) * yl / Ll + k * g - yb * l1 - 2. * sy * l2;
    f[2] = k * a[2] - (L0 - Lr) * dx / Lr + 2. * sx * l2;
    f[3] = k * a[3] - (L0 - Lr) * dy / Lr + k * g + 2. * sy * l2;
    f[4] = -(xb * xl + yb * yl);
    f[5] = L * L - sx * sx - sy * sy;
  }

  /* Adds the stiffness of a spring of free length L0 that ends at a distance (dx,dy) from its foot, and the mass */
  void addSpring(PetscInt i, double dx, double dy, double l2, double sa, Entries &J) const
  {
    const double l = std::hypot(dx, dy), c = L0 / (l * l * l);
    J.add(i, i, sa * k + 1. - c * dy * dy - 2. * l2);
    J.add(i, i + 1, c * dx * dy);
    J.add(i + 1, i, c * dx * dy);
    J.add(i + 1, i + 1, sa * k + 1. - c * dx * dx - 2. * l2);
  }

  void jacobian(double t, const double *u, const double *, const double *, double, double sa, Entries &J) const override
  {
    double xb, yb;
    road(t, xb, yb);
    const double l2 = u[5], sx = u[0] - u[2], sy = u[1] - u[3];
    addSpring(0, u[0], u[1], l2, sa, J);
    addSpring(2, u[2] - xb, u[3] - yb, l2, sa, J);
    for (PetscInt i = 0; i < 2; i++) {
      J.add(i, i + 2, 2. * l2);
      J.add(i + 2, i, 2. * l2);
    }
    const double G1[2] = {-xb, -yb}, G2[4] = {-2. * sx, -2. * sy, 2. * sx, 2. * sy};
    for (PetscInt i = 0; i < 2; i++) {
      J.add(i, 4, G1[i]);
      J.add(4, i, G1[i]);
    }
    for (PetscInt i = 0; i < 4; i++) {
      J.add(i, 5, G2[i]);
      J.add(5, i, G2[i]);
    }
  }

  bool reference(double t, double *u, double *v, double *a) const override
  {
    static const double end[3][6] = {
        {0.049345578427524, 0.496989460230008, 1.041742524885426, 0.373911027265366, -0.00473688659085331,
         -0.00110468033125956},
        {-0.077058368403592, 0.00744686659206, 0.017556815753541, 0.770341043779597, 0., 0.},
        {-4.930286874842, 0.520265802739, 0.522011199915, 49.284321166943, 0., 0.}};
    setUnknown(u, v, a);
    if (std::abs(t) < 1e-12) {
      const double a0[4] = {0., -g, 0., -g};
      initial(u, v);
      std::copy_n(a0, 4, a);
      return true;
    }
    if (std::abs(t - 3.) > 1e-12) return false;
    std::copy_n(end[0], 6, u);
    std::copy_n(end[1], 4, v);
    std::copy_n(end[2], 4, a);
    return true;
  }

  std::vector<double> referenceTimes() const override { return {0., 3.}; }
};

} // namespace hhtex

#endif
