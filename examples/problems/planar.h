/*
  Planar rigid bodies with three coordinates (x, y, phi) each, pinned together; used by fourbar.h and chain.h.

  A pin makes two points meet, Phi = r_P + A(phi_P) s_P - r_Q - A(phi_Q) s_Q = 0, and costs two multipliers: -lambda is
  the force on P's body, +lambda the one on Q's.
*/
#ifndef HHTEX_PLANAR_H
#define HHTEX_PLANAR_H

#include "../problem.h"

#include <cmath>

namespace hhtex
{
namespace planar
{

constexpr PetscInt GROUND = -1;

struct Point {
  PetscInt body;   /* index of the body's x among the unknowns; y and phi follow. Or GROUND */
  double   sx, sy; /* in the body's frame */
};

inline void addPinSide(const Point &p, double sign, PetscInt row, const double *u, double *f)
{
  if (p.body == GROUND) {
    f[row] += sign * p.sx;
    f[row + 1] += sign * p.sy;
    return;
  }
  const double c = std::cos(u[p.body + 2]), s = std::sin(u[p.body + 2]);
  const double ax = c * p.sx - s * p.sy, ay = s * p.sx + c * p.sy; /* A s; its derivative by phi is (-ay, ax) */
  f[row] += sign * (u[p.body] + ax);
  f[row + 1] += sign * (u[p.body + 1] + ay);
  f[p.body] += sign * u[row];
  f[p.body + 1] += sign * u[row + 1];
  f[p.body + 2] += sign * (ax * u[row + 1] - ay * u[row]);
}

/* f += [Phi_q^T lambda; Phi] of a pin with multipliers u[row], u[row+1] */
inline void addPin(const Point &p, const Point &q, PetscInt row, const double *u, double *f)
{
  addPinSide(p, 1., row, u, f);
  addPinSide(q, -1., row, u, f);
}

inline void addPinSide(const Point &p, double sign, PetscInt row, const double *u, Entries &J)
{
  if (p.body == GROUND) return;
  const double   c = std::cos(u[p.body + 2]), s = std::sin(u[p.body + 2]);
  const double   ax = c * p.sx - s * p.sy, ay = s * p.sx + c * p.sy;
  const PetscInt x = p.body, y = x + 1, phi = x + 2;
  J.add(x, row, sign);
  J.add(row, x, sign);
  J.add(y, row + 1, sign);
  J.add(row + 1, y, sign);
  J.add(phi, row, -sign * ay);
  J.add(row, phi, -sign * ay);
  J.add(phi, row + 1, sign * ax);
  J.add(row + 1, phi, sign * ax);
  J.add(phi, phi, -sign * (ax * u[row] + ay * u[row + 1]));
}

inline void addPin(const Point &p, const Point &q, PetscInt row, const double *u, Entries &J)
{
  addPinSide(p, 1., row, u, J);
  addPinSide(q, -1., row, u, J);
}

/* f = inertia and weight of a body; writes its three rows */
inline void setBody(PetscInt body, double m, double I, double g, const double *a, double *f)
{
  f[body]     = m * a[body];
  f[body + 1] = m * (a[body + 1] + g);
  f[body + 2] = I * a[body + 2];
}

inline void addBody(PetscInt body, double m, double I, double sa, Entries &J)
{
  J.add(body, body, sa * m);
  J.add(body + 1, body + 1, sa * m);
  J.add(body + 2, body + 2, sa * I);
}

} // namespace planar
} // namespace hhtex

#endif
