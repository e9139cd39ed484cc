/*
  Analyses other than integration in time. Each one moves a run of Scene::createTS() that has not begun to another state at time t, from
  which Snapshot, Linearization and TSSolve() continue. Repeated for increasing t they are a quasi-static or a kinematic analysis.

    PetscCall(scene.createTS(&ts));
    for (int k = 0; k <= 10; k++) {
      PetscCall(StaticEquilibrium(ts, 0.1 * k));
      PetscCall(now.take(ts));                           positions, reactions
      ...

  For other parameters, or to start from the state that a run has reached, make a new run first: scene.createTS(&next, ts). All calls are
  collective. After an error the state of the run is unchanged.

  Options of solvers have these prefixes, whatever the prefix of the TS is:

    -scene_assemble_        the linear solver that moves bodies at the start, in the metric of the masses: -scene_assemble_ksp_view
    -scene_assembly_        the linear solver of all analyses for positions that meet the constraints
    -scene_equilibrium_     the linear solver of the descent to equilibrium, also for StartPolicy::equilibrium
    -scene_response_        the linear solver of Linearization::response(), linearize.h
    -scene_modes_           SLEPc's solver of SlowestModes(), modes.h; -scene_modes_st_ that of its shifted matrix

  They are read when such a solver is created; PetscFinalize() names options that were never read.
*/
#ifndef HHTDAE_ANALYSES_H
#define HHTDAE_ANALYSES_H

#include "hhtdae/types.h"
#include <petscts.h>

namespace hhtdae
{

/* Moves the run to static equilibrium at time t, at rest: the equilibrium that a descent from the present state reaches, or the nearest one.
   Motions are held at their values at t; rates of first-order states are zero, and states that nothing reads keep their values. With motions
   of velocities or accelerations that are not zero there is no equilibrium. Friction (JointFriction, of contacts) is regularized and zero at rest, so that it
   holds nothing: what it would hold slides to where it rests without, or there is no equilibrium. Motions of positions have no velocity in it: a run in time
   gives it to the bodies as it begins, AssembleAt() for a Linearization of what turns. */
PetscErrorCode StaticEquilibrium(TS ts, PetscReal t);

/* Moves the run to the nearest positions and velocities, in the metric of the masses, that satisfy all constraints and motions at time t.
   fixed_start is ignored; multipliers and force states are computed by the next query or step. */
PetscErrorCode AssembleAt(TS ts, PetscReal t);

/* The same where motions and joints leave no freedom, which is an error otherwise: positions, velocities and, in a Snapshot,
   accelerations and loads follow from the motions alone, without the error of a step. The loads of the motions are those that the
   movement needs: inverse dynamics. Constraints of velocities are an error, what they do to positions needs a run in time.
   All of these follow the motions from the time of the run to t, in steps that are as short as need be to stay on the branch that the motion leads to
   where a linkage could be assembled in another way, also through change points, where velocities go on; the times of calls do not matter for that. Where motions return to a value
   that they have had, what they did meanwhile is not looked at. Near a position where constraints depend on one another, as at a dead centre, velocities,
   accelerations and loads have few digits or none, and a notice names time and rows. */
PetscErrorCode Kinematics(TS ts, PetscReal t);

/* Sets the velocity of a body (of its centre of mass; of a FlexibleBody: of its frame's origin) and its angular velocity, both in space axes, in the present state of a run, also between steps, as after an impact: null keeps what there is. Modal
   coordinates keep their rates. Then call TSRestartStep(). Velocities that violate joints are made consistent by a restart as TSHHT3SetStart() says. Collective. */
PetscErrorCode SetVelocity(TS ts, Body body, const Vector3 *velocity, const Vector3 *angular_velocity);

} // namespace hhtdae

#endif
