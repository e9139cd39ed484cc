/*
  N-four-bar mechanism (IFToMM benchmark A02): N + 1 uprights hinged to the ground at x = 0..N and N couplers between
  their tops, all slender rods of 1 m and 1 kg; starts upright with the tops at 1 m/s. One degree of freedom, except
  when all rods lie flat: there Phi_q loses rank, and the mechanism could leave the parallelogram. It passes that
  position twice a turn.

  Upright i: centre, angle (0 when vertical). Coupler i: centre, angle (0 when horizontal). Phi as in planar.h, rows
  last.

  Reference: with phi from the vertical, Mt = (N+1)/3 + N, W = g ((N+1)/2 + N), energy gives phi'' = W/Mt sin phi, a
  pendulum that goes over the top, theta = phi + pi (18 digits); the reactions follow from the rods' equations, from
  left to right.
*/
#ifndef HHTEX_FOURBAR_H
#define HHTEX_FOURBAR_H

#include "elliptic.h"
#include "planar.h"

#include <algorithm>

namespace hhtex
{

struct FourBar : Problem {
  const double   g = 9.81, I = 1. / 12.; /* rods of length 1 and mass 1 */
  const PetscInt windows;

  explicit FourBar(PetscInt numberOfWindows = 2, double end = 10.)
      : windows(numberOfWindows),
        rate_(std::sqrt(g * ((windows + 1) / 2.L + windows) / ((windows + 1) / 3.L + windows)))
  {
    name = "fourbar";
    t1   = end;
    role.assign(pins(), TSHHT3_COORDINATE);
    n = pins() + 2 * (windows + 1 + 2 * windows);
    role.resize(n, TSHHT3_HOLONOMIC);
  }

  PetscInt upright(PetscInt i) const { return 3 * i; }
  PetscInt coupler(PetscInt i) const { return 3 * (windows + 1 + i); }
  PetscInt pins() const { return 3 * (2 * windows + 1); }
  PetscInt footPin(PetscInt i) const { return pins() + 2 * i; }
  PetscInt couplerPin(PetscInt i, int side) const { return pins() + 2 * (windows + 1 + 2 * i + side); }

  /* Calls visit(P, Q, row) for every pin */
  template <class Visit> void forEachPin(Visit visit) const
  {
    using planar::Point;
    for (PetscInt i = 0; i <= windows; i++)
      visit(Point{upright(i), 0., -.5}, Point{planar::GROUND, double(i), 0.}, footPin(i));
    for (PetscInt i = 0; i < windows; i++)
      for (int side = 0; side < 2; side++)
        visit(Point{coupler(i), side - .5, 0.}, Point{upright(i + side), 0., .5}, couplerPin(i, side));
  }

  void initial(double *u, double *v) const override
  {
    setMotion({0.L, 0.L, 1.L, 1.L, 0.L}, [&](PetscInt i, double x, double dx, double) {
      u[i] = x;
      v[i] = dx;
    });
    std::fill(u + pins(), u + n, 0.);
    std::fill(v + pins(), v + n, 0.);
  }

  void residual(double, const double *u, const double *, const double *a, double *f) const override
  {
    std::fill(f + pins(), f + n, 0.);
    for (PetscInt body = 0; body < pins(); body += 3) planar::setBody(body, 1., I, g, a, f);
    forEachPin([&](const planar::Point &p, const planar::Point &q, PetscInt row) { planar::addPin(p, q, row, u, f); });
  }

  void jacobian(double, const double *u, const double *, const double *, double, double sa, Entries &J) const override
  {
    for (PetscInt body = 0; body < pins(); body += 3) planar::addBody(body, 1., I, sa, J);
    forEachPin([&](const planar::Point &p, const planar::Point &q, PetscInt row) { planar::addPin(p, q, row, u, J); });
  }

  bool reference(double t, double *u, double *v, double *a) const override
  {
    const PendulumMotion p(rate_, 4.L * std::atan(1.L), 1.L, t - t0);
    const Lean           lean = {p.theta - 4.L * std::atan(1.L), -p.sine, -p.cosine, p.omega, p.alpha};
    setUnknown(u, v, a);
    setMotion(lean, [&](PetscInt i, double x, double dx, double ddx) {
      u[i] = x;
      v[i] = dx;
      a[i] = ddx;
    });
    if (std::abs(lean.c) > 1e-6L) setReactions(lean, u);
    return true;
  }

  bool                referenceEverywhere() const override { return true; }
  std::vector<double> referenceTimes() const override { return equallySpaced(10); }

private:
  long double rate_; /* sqrt(W/Mt) */

  struct Lean {
    long double phi, s, c, omega, alpha; /* of the uprights from the vertical: angle, sine, cosine, derivatives */

    long double dx() const { return c * omega; } /* velocity and acceleration of the tops */
    long double dy() const { return -s * omega; }
    long double ddx() const { return c * alpha - s * omega * omega; }
    long double ddy() const { return -s * alpha - c * omega * omega; }
  };

  /* Calls set(unknown, position, velocity, acceleration) for the coordinates of all bodies on the parallelogram branch
   */
  template <class Set> void setMotion(const Lean &p, Set set) const
  {
    for (PetscInt i = 0; i <= windows; i++) {
      set(upright(i), i + p.s / 2.L, p.dx() / 2.L, p.ddx() / 2.L);
      set(upright(i) + 1, p.c / 2.L, p.dy() / 2.L, p.ddy() / 2.L);
      set(upright(i) + 2, -p.phi, -p.omega, -p.alpha);
    }
    for (PetscInt i = 0; i < windows; i++) {
      set(coupler(i), i + .5L + p.s, p.dx(), p.ddx());
      set(coupler(i) + 1, p.c, p.dy(), p.ddy());
      set(coupler(i) + 2, 0., 0., 0.);
    }
  }

  void setReactions(const Lean &p, double *u) const
  {
    const long double ax = p.ddx(), ay = p.ddy();
    const long double endY   = (ay + g) / 2.L; /* couplers do not rotate: both ends carry the same vertical force */
    long double       rightX = 0.L;            /* horizontal force on the previous coupler's right end */
    for (PetscInt i = 0; i <= windows; i++) {
      const long double topY  = -endY * ((i > 0) + (i < windows));
      const long double topX  = (p.s * (topY - g / 2.L) + p.alpha / 3.L) / p.c; /* moments about the foot */
      const long double leftX = -topX - rightX;
      u[footPin(i)]           = topX - ax / 2.L;
      u[footPin(i) + 1]       = topY - g - ay / 2.L;
      if (i == windows) break;
      rightX                  = ax - leftX;
      u[couplerPin(i, 0)]     = -leftX;
      u[couplerPin(i, 0) + 1] = -endY;
      u[couplerPin(i, 1)]     = -rightX;
      u[couplerPin(i, 1) + 1] = -endY;
    }
  }
};

} // namespace hhtex

#endif
