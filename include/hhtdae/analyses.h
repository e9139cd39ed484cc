/*
  Analyses beside the run in time. Each of them moves a run that has not begun, one of Scene::createTS(), to another state at time t:
  Snapshot, Linearization and TSSolve() go on from there. Repeated with t after t they are a quasi-static or a kinematic analysis.

    PetscCall(scene.createTS(&ts));
    for (int k = 0; k <= 10; k++) {
      PetscCall(StaticEquilibrium(ts, 0.1 * k));
      PetscCall(now.take(ts));                           positions, reactions
      ...

  With other parameters, or from where a run has got to, the next one is made first: scene.createTS(&next, ts). All calls are collective.
  After an error the run is where it was.

  Options of solvers have these prefixes, whatever that of the TS is:

    -scene_assemble_        the linear solver that moves bodies at the start, in the metric of the masses: -scene_assemble_ksp_view
    -scene_assembly_        the linear solver of all analyses for positions that meet the constraints
    -scene_equilibrium_     the linear solver of the way downhill to equilibrium, StartPolicy::equilibrium as well
    -scene_response_        the linear solver of Linearization::response(), linearize.h
    -scene_modes_           SLEPc's solver of SlowestModes(), modes.h; -scene_modes_st_ that of its shifted matrix

  They are read where such a solver is made; an option that nobody has read is named when PETSc ends.
*/
#ifndef HHTDAE_ANALYSES_H
#define HHTDAE_ANALYSES_H

#include <petscts.h>

namespace hhtdae
{

/* To static equilibrium at time t, at rest: the one downhill from where the run is, or nearest to it. Motions hold where they are at t;
   rates of first-order states are zero, and states that nothing reads keep their values. Motions of velocities and accelerations that are not zero then have none. */
PetscErrorCode StaticEquilibrium(TS ts, PetscReal t);

/* To the nearest positions, and velocities, that meet all constraints and motions at time t, in the metric of the masses. fixed_start
   does not count, multipliers and force states are found by the next question or step. */
PetscErrorCode AssembleAt(TS ts, PetscReal t);

/* The same where motions and joints leave no freedom, which is an error otherwise: positions, velocities and, in a Snapshot,
   accelerations and loads follow from the motions alone, without the error of a step. The loads of the motions are those that the
   movement needs: inverse dynamics. Constraints of velocities are an error, what they do to positions needs a run in time. */
PetscErrorCode Kinematics(TS ts, PetscReal t);

} // namespace hhtdae

#endif
