/* Which row and which unknown is what (roles.cpp), and what constraints may depend on (variables.cpp). RoleOf() is in state.h. */
#ifndef HHTDAE_ROLES_H
#define HHTDAE_ROLES_H

#include "integrator/state.h"

namespace hht3
{

PetscErrorCode SetUpRoles(TS ts);
PetscErrorCode ViewRoles(TS ts, PetscViewer viewer);

/* Once the roles are known: refuses constraints whose derivatives in time would not be had */
PetscErrorCode CheckDependence(TS ts);

/* The residual at a place along the motion, where variables that stand in constraints follow their definitions V - v(...) = 0 in U */
PetscErrorCode ResidualAlong(TS ts, PetscReal t, Vec U, Vec V, Vec A, Vec F);

} // namespace hht3

#endif
