/* Which unknowns belong to the nodes of finite elements, for the preconditioner "hhtconstraint" (src/linear/constraint.h) */
#include "impl.h"
#include "linear/constraint.h"

/*@
  TSHHT3SetNodes - Tells which unknowns belong to nodes of finite elements, for `-pc_type hhtconstraint`

  Collective, after `TSSetI2Jacobian()`

  Input Parameters:
+ ts    - the `TS` context
- nodes - of each rank its own unknowns by their global numbers, those of a node one after the other, as many as the block size of the `IS` (`ISSetBlockSize()`); `NULL`
          to take back what was told

  Level: advanced

  Notes:
  The preconditioner `hhtconstraint` leaves out of the Newton matrix what couples different nodes, and factors the rest, with rigid bodies, modes and multipliers whole. So it
  satisfies the constraints exactly, at a cost that grows as the number of nodes, and a Krylov method does what it leaves to do,
.vb
  -ksp_type cg -pc_type hhtconstraint -ksp_rtol 0.1         (fgmres where the matrix is not symmetric)
.ve
  where a factorization of the whole matrix has no room. Its own solver has the prefix `constraint_`. Without this call consecutive unknowns that are coupled to the same others,
  but for multipliers, are taken for a node. Scenes make the call themselves.

.seealso: `TSHHT3`, `TSSetI2Jacobian()`
@*/
PetscErrorCode TSHHT3SetNodes(TS ts, IS nodes)
{
  Mat       P;
  PetscInt  n, size;
  PetscBool whole = PETSC_TRUE;

  PetscFunctionBegin;
  PetscValidHeaderSpecific(ts, TS_CLASSID, 1);
  if (nodes) PetscValidHeaderSpecific(nodes, IS_CLASSID, 2);
  PetscCall(TSGetI2Jacobian(ts, NULL, &P, NULL, NULL));
  PetscCheck(P, PetscObjectComm((PetscObject)ts), PETSC_ERR_ARG_WRONGSTATE, "TSHHT3SetNodes() tells of the rows of the matrix: call TSSetI2Jacobian() before it");
  if (nodes) {
    PetscCall(ISGetLocalSize(nodes, &n));
    PetscCall(ISGetBlockSize(nodes, &size));
    whole = (PetscBool)(n % size == 0);
  }
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &whole, 1, MPIU_BOOL, MPI_LAND, PetscObjectComm((PetscObject)ts)));
  PetscCheck(whole, PetscObjectComm((PetscObject)ts), PETSC_ERR_ARG_SIZ, "TSHHT3SetNodes(): the unknowns of a rank are no multiple of the block size of the index set, which is that of a node");
  PetscCall(PetscObjectCompose((PetscObject)P, LINEAR_NODES, (PetscObject)nodes));
  PetscFunctionReturn(PETSC_SUCCESS);
}
