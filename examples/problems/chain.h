/*
  Planar chain of N slender rods (1 kg, 1 m each), pinned to each other, the first one to the ground at the origin;
  starts straight and at rest at an angle from the horizontal (0: horizontal, -90: hanging).

  Body b has the unknowns (x, y, phi, lambda_x, lambda_y) number 5b..5b+4, lambda being the pin of its left end: the
  matrix is a narrow band, and residual and Jacobian take one sweep along the chain.
*/
#ifndef HHTEX_CHAIN_H
#define HHTEX_CHAIN_H

#include "planar.h"

#include <algorithm>

namespace hhtex
{

struct Chain : Problem {
  const double   m = 1., l = 1., I = m * l * l / 12., g = 9.81;
  const PetscInt bodies;
  const double   angle; /* rad */

  explicit Chain(PetscInt numberOfBodies = 10, double startAngle = 0., double end = 1.) /* degrees, s */
      : bodies(numberOfBodies), angle(startAngle * std::atan(1.) / 45.)
  {
    name = "chain";
    n    = 5 * bodies;
    t1   = end;
    role.assign(n, TSHHT3_COORDINATE);
    for (PetscInt b = 0; b < bodies; b++) role[5 * b + 3] = role[5 * b + 4] = TSHHT3_HOLONOMIC;
  }

  planar::Point left(PetscInt b) const { return {5 * b, -l / 2., 0.}; }
  planar::Point leftPartner(PetscInt b) const
  {
    return b > 0 ? planar::Point{5 * (b - 1), l / 2., 0.} : planar::Point{planar::GROUND, 0., 0.};
  }

  void initial(double *u, double *v) const override
  {
    for (PetscInt b = 0; b < bodies; b++) {
      double *body = u + 5 * b;
      body[0]      = (b + .5) * l * std::cos(angle);
      body[1]      = (b + .5) * l * std::sin(angle);
      body[2]      = angle;
      body[3] = body[4] = 0.;
    }
    std::fill_n(v, n, 0.);
  }

  void residual(double, const double *u, const double *, const double *a, double *f) const override
  {
    for (PetscInt b = 0; b < bodies; b++) {
      planar::setBody(5 * b, m, I, g, a, f);
      f[5 * b + 3] = f[5 * b + 4] = 0.;
      planar::addPin(left(b), leftPartner(b), 5 * b + 3, u, f);
    }
  }

  void jacobian(double, const double *u, const double *, const double *, double, double sa, Entries &J) const override
  {
    for (PetscInt b = 0; b < bodies; b++) {
      planar::addBody(5 * b, m, I, sa, J);
      planar::addPin(left(b), leftPartner(b), 5 * b + 3, u, J);
    }
  }

  /* Kinetic and potential energy, for runs without a reference */
  double energy(const double *u, const double *v) const
  {
    double E = 0.;
    for (PetscInt b = 0; b < 5 * bodies; b += 5)
      E += m / 2. * (v[b] * v[b] + v[b + 1] * v[b + 1]) + I / 2. * v[b + 2] * v[b + 2] + m * g * u[b + 1];
    return E;
  }
};

} // namespace hhtex

#endif
