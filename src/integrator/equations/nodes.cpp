/* Which unknowns belong to the nodes of finite elements, for the preconditioner "hhtconstraint" (src/linear/constraint.h) */
#include "integrator/entries.h"
#include "linear/constraint.h"
#include "solver.h"

namespace
{

constexpr char reference_name[] = "hhtdae_reference"; /* on the matrix: what TSHHT3SetNodes() was given */

PetscErrorCode CheckReference(TS ts, Mat P, IS nodes, Vec reference)
{
  PetscInt rows, n, size = 3;
  bool     same;

  PetscFunctionBegin;
  PetscCall(MatGetLocalSize(P, &rows, NULL));
  PetscCall(VecGetLocalSize(reference, &n));
  if (nodes) PetscCall(ISGetBlockSize(nodes, &size));
  PetscCall(hht3::OnAllRanks(ts, n == rows && size == 3, &same));
  PetscCheck(same, PetscObjectComm((PetscObject)ts), PETSC_ERR_ARG_SIZ, "TSHHT3SetNodes(): positions need nodes of three unknowns, and a vector of the layout of the solution");
  PetscFunctionReturn(PETSC_SUCCESS);
}

} // namespace

/*@
  TSHHT3SetNodes - Tells which unknowns belong to nodes of finite elements, and where these are, for `-pc_type hhtconstraint`

  Collective, after `TSSetI2Jacobian()`

  Input Parameters:
+ ts        - the `TS` context
. nodes     - of each rank its own unknowns by their global numbers, those of a node one after the other, as many as the block size of the `IS` (`ISSetBlockSize()`); `NULL`
              to take back what was told
- reference - where nodes of three unknowns are when these are zero, in the rows of these unknowns: zeros if the unknowns are positions in space; `NULL` if that is not
              known, which costs iterations

  Level: advanced

  Notes:
  The preconditioner `hhtconstraint` leaves out of the Newton matrix what couples different nodes, and factors the rest, with rigid bodies, modes and multipliers whole. So it
  satisfies the constraints exactly, at a cost that grows as the number of nodes, and a Krylov method does what it leaves to do,
.vb
  -ksp_type cg -pc_type hhtconstraint         (fgmres where so much is not symmetric that these do not serve)
.ve
  where a factorization of the whole matrix has no room.

  Where `reference` is given, at least half of the unknowns are those of nodes, and the factor would have more than 1e7 entries (some 20,000 unknowns), this call makes that the
  default: conjugate gradients with hhtconstraint in place of a factorization, which `-pc_type lu` or `cholesky` bring back. Where a solve fails or takes more than 100 iterations
  a factor takes over for good. Each correction of a step is solved to a relative tolerance of 1e-2, unless `-ksp_rtol` says otherwise, and the matrix is renewed at a rate of
  convergence above 0.1 (`TSHHT3SetReuse()`). -ts_view and -info show the choice.

  The preconditioner's own solver has the prefix `constraint_`. Without this call consecutive unknowns that are coupled to the same others,
  but for multipliers, are taken for a node. Scenes make the call themselves.

  Where positions are known, neighbouring nodes, `-pc_hhtconstraint_aggregate <200>` of them, 400 where there are 200,000 and more, move together as a rigid body on a coarse level, whose solver has the prefix
  `coarse_`; with 0 there is none.

  At relative tolerances (`-ksp_rtol`) from 1e-4 on the Krylov method's products are of single precision in what couples nodes of three unknowns, `-pc_hhtconstraint_single <true>`; where
  rounding would be a tenth of what a solve leaves they are of double precision.

.seealso: `TSHHT3`, `TSSetI2Jacobian()`
@*/
PetscErrorCode TSHHT3SetNodes(TS ts, IS nodes, Vec reference)
{
  Mat P;

  PetscFunctionBegin;
  PetscValidHeaderSpecific(ts, TS_CLASSID, 1);
  if (nodes) PetscValidHeaderSpecific(nodes, IS_CLASSID, 2);
  if (reference) PetscValidHeaderSpecific(reference, VEC_CLASSID, 3);
  PetscCall(TSGetI2Jacobian(ts, NULL, &P, NULL, NULL));
  PetscCheck(P, PetscObjectComm((PetscObject)ts), PETSC_ERR_ARG_WRONGSTATE, "TSHHT3SetNodes() tells of the rows of the matrix: call TSSetI2Jacobian() before it");
  if (reference) PetscCall(CheckReference(ts, P, nodes, reference));
  PetscCall(PetscObjectCompose((PetscObject)P, LINEAR_NODES, (PetscObject)nodes));
  PetscCall(PetscObjectCompose((PetscObject)P, reference_name, (PetscObject)(nodes ? reference : NULL)));
  PetscCall(PetscObjectCompose((PetscObject)P, LINEAR_POSITIONS, NULL));
  PetscFunctionReturn(PETSC_SUCCESS);
}

namespace hht3
{

PetscErrorCode TellPositions(Mat P, Vec U)
{
  Vec reference, positions;

  PetscFunctionBegin;
  PetscCall(PetscObjectQuery((PetscObject)P, reference_name, (PetscObject *)&reference));
  if (!reference) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(PetscObjectQuery((PetscObject)P, LINEAR_POSITIONS, (PetscObject *)&positions));
  if (!positions) {
    PetscCall(VecDuplicate(U, &positions));
    PetscCall(PetscObjectCompose((PetscObject)P, LINEAR_POSITIONS, (PetscObject)positions));
    PetscCall(PetscObjectDereference((PetscObject)positions)); /* the matrix has it */
  }
  PetscCall(VecWAXPY(positions, 1, U, reference));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode CopyNodes(Mat from, Mat to)
{
  PetscObject told;

  PetscFunctionBegin;
  for (const char *name : {(const char *)LINEAR_NODES, reference_name}) {
    PetscCall(PetscObjectQuery((PetscObject)from, name, &told));
    PetscCall(PetscObjectCompose((PetscObject)to, name, told));
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

} // namespace hht3
