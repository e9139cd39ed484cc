/*
  Linear oscillators with given angular frequencies w_i and damping ratios z_i, without constraints:

    y_i'' + 2 z_i w_i y_i' + w_i^2 y_i = 0,   y_i(0) = 1, y_i'(0) = 0,   q = y

  or coupled: q = H y with a reflection H = I - 2 h h^T / h^T h, h = (1, 2, ..., n), which leaves M = I and fills C and
  K. Exact solution for damping below, at and above critical.
*/
#ifndef HHTEX_OSCILLATORS_H
#define HHTEX_OSCILLATORS_H

#include "../problem.h"

#include <cmath>
#include <utility>

namespace hhtex
{

struct Oscillators : Problem {
  const std::vector<double> frequency, damping; /* rad/s, fraction of critical */
  const bool                coupled;

  Oscillators(std::vector<double> frequencies, std::vector<double> dampingRatios, bool couple = false, double end = 10.)
      : frequency(std::move(frequencies)), damping(std::move(dampingRatios)), coupled(couple)
  {
    name = "oscillators";
    n    = (PetscInt)frequency.size();
    t1   = end;
    role.assign(n, TSHHT3_COORDINATE);
    C_.assign(n * n, 0.);
    K_.assign(n * n, 0.);
    for (PetscInt i = 0; i < n; i++)
      for (PetscInt j = 0; j < n; j++)
        for (PetscInt k = 0; k < n; k++) {
          C_[i * n + j] += mix(i, k) * 2. * damping[k] * frequency[k] * mix(k, j);
          K_[i * n + j] += mix(i, k) * frequency[k] * frequency[k] * mix(k, j);
        }
  }

  void initial(double *u, double *v) const override
  {
    for (PetscInt i = 0; i < n; i++) {
      u[i] = v[i] = 0.;
      for (PetscInt j = 0; j < n; j++) u[i] += mix(i, j);
    }
  }

  void residual(double, const double *u, const double *v, const double *a, double *f) const override
  {
    for (PetscInt i = 0; i < n; i++) {
      f[i] = a[i];
      if (!coupled)
        f[i] += C_[i * n + i] * v[i] + K_[i * n + i] * u[i];
      else
        for (PetscInt j = 0; j < n; j++) f[i] += C_[i * n + j] * v[j] + K_[i * n + j] * u[j];
    }
  }

  void jacobian(double, const double *, const double *, const double *, double sv, double sa, Entries &J) const override
  {
    for (PetscInt i = 0; i < n; i++)
      for (PetscInt j = coupled ? 0 : i; j < (coupled ? n : i + 1); j++)
        J.add(i, j, (i == j ? sa : 0.) + sv * C_[i * n + j] + K_[i * n + j]);
  }

  bool reference(double t, double *u, double *v, double *a) const override
  {
    for (PetscInt i = 0; i < n; i++) u[i] = v[i] = a[i] = 0.;
    for (PetscInt k = 0; k < n; k++) {
      double y, dy;
      mode(frequency[k], damping[k], t - t0, y, dy);
      const double ddy = -2. * damping[k] * frequency[k] * dy - frequency[k] * frequency[k] * y;
      for (PetscInt i = 0; i < n; i++) {
        u[i] += mix(i, k) * y;
        v[i] += mix(i, k) * dy;
        a[i] += mix(i, k) * ddy;
      }
    }
    return true;
  }

  bool                referenceEverywhere() const override { return true; }
  std::vector<double> referenceTimes() const override { return equallySpaced(20); }

private:
  std::vector<double> C_, K_;

  double mix(PetscInt i, PetscInt j) const
  {
    if (!coupled) return i == j;
    return (i == j) - 12. * (i + 1.) * (j + 1.) / (n * (n + 1.) * (2. * n + 1.)); /* h^T h = n(n+1)(2n+1)/6 */
  }

  static void mode(double w, double z, double t, double &y, double &dy)
  {
    if (w == 0.) {
      y  = 1.;
      dy = 0.;
    } else if (z < 1.) {
      const double wd = w * std::sqrt(1. - z * z), e = std::exp(-z * w * t);
      y  = e * (std::cos(wd * t) + z * w / wd * std::sin(wd * t));
      dy = -e * w * w / wd * std::sin(wd * t);
    } else if (z == 1.) {
      y  = std::exp(-w * t) * (1. + w * t);
      dy = -w * w * t * std::exp(-w * t);
    } else {
      const double root = w * std::sqrt(z * z - 1.), fast = -z * w - root, slow = w * w / fast;
      y  = (slow * std::exp(fast * t) - fast * std::exp(slow * t)) / (slow - fast);
      dy = w * w * (std::exp(fast * t) - std::exp(slow * t)) / (slow - fast);
    }
  }
};

} // namespace hhtex

#endif
