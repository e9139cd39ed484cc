/*
  Questions to a run: motion of any marker, loads of any element and energies at any time of the last step. Nothing has to be requested
  before the run.

    Snapshot now;
    PetscCall(now.take(ts, t));                         the state of the run at time t
    Motion m;
    PetscCall(now.motion(tip, &m));                     position, axes, velocities, accelerations; space axes
    Load pin_load;
    PetscCall(now.load(pin, tip, &pin_load));           force and moment (about the tip) of the joint on the tip's body
    double l;
    PetscCall(now.value(Measure::distance(a, b), &l));  any measure

  All calls are collective: every rank asks the same questions and gets the same answers. A snapshot is valid as long as its TS exists.
*/
#ifndef HHTDAE_QUERY_H
#define HHTDAE_QUERY_H

#include "hhtdae/functions.h"
#include "hhtdae/types.h"
#include <memory>
#include <petscts.h>

namespace hhtdae
{

struct Runtime;

/* Motion of a marker or body; all components are in the axes that the call asks for. */
struct Motion {
  Vector3 position = Vector3::Zero(), velocity = Vector3::Zero(), acceleration = Vector3::Zero();
  Matrix3 axes = Matrix3::Identity(); /* axes of the marker or body, as columns */
  Vector3 angular_velocity = Vector3::Zero(), angular_acceleration = Vector3::Zero();

  Eigen::Quaterniond quaternion() const { return Eigen::Quaterniond(axes); }
  Vector3 euler() const;  /* 3-1-3: phi, theta, psi with axes = Rz(phi) Rx(theta) Rz(psi), theta in [0, pi]; psi is 0 where theta is 0 or pi */
  Vector3 bryant() const; /* 1-2-3: a, b, c with axes = Rx(a) Ry(b) Rz(c), b in [-pi/2, pi/2]; c is 0 where b is -pi/2 or pi/2 */
};

struct Load {
  Vector3 force = Vector3::Zero(), moment = Vector3::Zero();
};

class Snapshot
{
public:
  Snapshot();
  ~Snapshot();
  Snapshot(const Snapshot &)            = delete;
  Snapshot &operator=(const Snapshot &) = delete;

  /* Takes the state of a run of Scene::createTS() at time t within the last step. Accelerations, multipliers, variables and force states
     are solved for from the interpolated positions and velocities at t (TSHHT3EvaluateAt()), at about the cost of a factorization. At the
     end of the step they are the results of the step: they cost nothing, but their error is, as a rule, many times as large. With fast
     and hardly damped modes, above all of flexible bodies, the opposite holds: within the step, the error of interpolated positions enters
     accelerations and reactions multiplied by the square of the highest frequency. Then ask at the ends of steps, or lower the tolerance.
     Before the first step the state is the start, whose accelerations and multipliers cost a consistent start and one step of a copy of the
     run; after StaticEquilibrium() it is the equilibrium, with all motions held still. */
  PetscErrorCode take(TS ts, PetscReal t);
  PetscErrorCode take(TS ts); /* at the end of the last step */
  PetscReal      time() const;

  /* Absolute motion of a marker, relative to the space origin, with components in the axes of another marker (default: space axes) */
  PetscErrorCode motion(Marker m, Motion *x, Marker axes = {});
  /* Motion of marker m relative to marker `to`, as an observer fixed to `to` sees it: position from the origin of `to`, components in its axes */
  PetscErrorCode relativeMotion(Marker m, Marker to, Motion *x);
  /* Absolute motion of a body's centre of mass (of a flexible body: the undeformed one) and of the body axes, in space axes */
  PetscErrorCode motion(Body b, Motion *x);
  PetscErrorCode modes(Body flexible, std::vector<double> *coordinates);

  /* Load of an element (joint, motion or force) on the body of marker `on`: force, and moment about the marker's origin, in the axes of
     another marker (default: space axes). The load is zero if the element does not act on that body (Measure::elementForce() reports an
     error there). On a flexible body it is the load on the attachment that the marker belongs to; an element that acts only on another
     attachment is an error. Modal loads and node contacts have no attachment: their load is that on the whole body. */
  PetscErrorCode load(Element e, Marker on, Load *x, Marker axes = {});

  /* Value of a measure. Angles count full turns: from the start in planar scenes and where an element, a channel or an expression reads the
     angle, otherwise from the first call that asks for it */
  PetscErrorCode value(const Measure &m, double *x);
  /* Kinetic and potential energy of the scene; Measure::PotentialEnergy lists what has a potential */
  PetscErrorCode energy(double *kinetic, double *potential);

private:
  friend class Linearization;
  PetscErrorCode take(Runtime &run, PetscReal t, Vec state[3]);
  struct Work;
  std::unique_ptr<Work> work_;
};

} // namespace hhtdae

#endif
