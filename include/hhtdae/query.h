/*
  What a run is doing: motion of any marker, loads of any element, energies, at any time of its last step, without having been asked
  for beforehand.

    Snapshot now;
    PetscCall(now.take(ts, t));                         the state of the run at time t
    Motion m;
    PetscCall(now.motion(tip, &m));                     position, axes, velocities, accelerations; space axes
    Load pin_load;
    PetscCall(now.load(pin, tip, &pin_load));           what the joint does to the tip's body, moment about the tip
    double l;
    PetscCall(now.value(Measure::distance(a, b), &l));  any measure

  All calls are collective: every rank asks the same questions and gets the same answers. A snapshot is of use as long as its TS is.
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

/* Of a marker or body: everything in the axes asked for. */
struct Motion {
  Vector3 position = Vector3::Zero(), velocity = Vector3::Zero(), acceleration = Vector3::Zero();
  Matrix3 axes = Matrix3::Identity(); /* its axes as columns */
  Vector3 angular_velocity = Vector3::Zero(), angular_acceleration = Vector3::Zero();

  Eigen::Quaterniond quaternion() const { return Eigen::Quaterniond(axes); }
  Vector3 euler() const;  /* 3-1-3: phi, theta, psi with axes = Rz(phi) Rx(theta) Rz(psi), theta in [0, pi]; psi is 0 where theta is 0 or pi */
  Vector3 bryant() const; /* 1-2-3: axes = Rx(a) Ry(b) Rz(c), b in [-pi/2, pi/2]; c is 0 at its ends */
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

  /* The state of a run that Scene::createTS() has begun, at time t between the ends of its last step. Accelerations, multipliers,
     variables and force states are those that belong to positions and velocities at t, TSHHT3EvaluateAt(), at about the cost of a
     factorization between the ends of a step; at its end at none, and then with the error of the step's own, which is many times as large, as a rule. With
     fast modes that hardly anything damps, of flexible bodies above all, it is the other way round: what the interpolation of positions misses comes out in
     accelerations and reactions within the step times the square of the highest frequency. Then ask at the ends of steps, or lower the tolerance. Before the first
     step it is the start, whose accelerations and multipliers cost a consistent start and a step of a copy; after StaticEquilibrium() the equilibrium, with what
     the motions would have moved held still. */
  PetscErrorCode take(TS ts, PetscReal t);
  PetscErrorCode take(TS ts); /* at the end of the last step */
  PetscReal      time() const;

  /* of a marker in the axes of another one (default: space axes), seen from space: its velocity is that relative to the space
     origin, resolved in these axes; position from the space origin */
  PetscErrorCode motion(Marker m, Motion *x, Marker axes = {});
  /* relative to another marker: position from its origin, and the motion that somebody on it sees, all in its axes */
  PetscErrorCode relativeMotion(Marker m, Marker to, Motion *x);
  /* of a body: its centre of mass (undeformed, of a flexible one) and its body axes, in space axes */
  PetscErrorCode motion(Body b, Motion *x);
  PetscErrorCode modes(Body flexible, std::vector<double> *coordinates);

  /* What an element, joint, motion or force, does to the body of a marker: its force and its moment about the marker's origin, in the
     axes of another marker (default: space axes). Zero if it does not touch that body, which Measure::elementForce() takes for an error. Of a flexible
     body: to the attachment that the marker is on, or by loads and contacts of its modes, which have no attachment, to all of it; an error if it touches
     another attachment alone. */
  PetscErrorCode load(Element e, Marker on, Load *x, Marker axes = {});

  /* An angle counts full turns: from the start in planar scenes and where an element, a channel or an expression reads it, else from the first
     question for it on */
  PetscErrorCode value(const Measure &m, double *x);
  /* kinetic, potential energy of the scene, of what Measure::PotentialEnergy names */
  PetscErrorCode energy(double *kinetic, double *potential);

private:
  friend class Linearization;
  PetscErrorCode take(Runtime &run, PetscReal t, Vec state[3]);
  struct Work;
  std::unique_ptr<Work> work_;
};

} // namespace hhtdae

#endif
