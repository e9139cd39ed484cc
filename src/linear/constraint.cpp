/*
  The preconditioner "hhtconstraint", constraint.h. The options of the direct solvers of its levels have the preconditioner's prefix followed by "constraint_" (fine level) and
  "coarse_" (coarse level).
*/
#include "constraint.h"
#include "coarse.h"
#include "fine.h"
#include "linear.h"
#include "node_product.h"
#include <petsc/private/pcimpl.h>

namespace
{

/* Largest number of nodes of an aggregate: 200 is the fastest of 60 to 200 with 17,000 and 120,000 unknowns (src/flexible/README.md). For bodies of at least
   large_body_nodes nodes 400, as fast as 200 at 100,000 nodes, with half the time of coarse solves at 350,000. */
constexpr PetscInt aggregate_nodes = 200, aggregate_nodes_large = 400, large_body_nodes = 200000;

/* Relative tolerance of the Krylov method from which on its products are computed in single precision */
constexpr PetscReal single_precision_rtol = 1e-4;

/* Largest part of a solve's final residual that may be rounding of single precision: above it products are computed in double precision from then on.
   NodeProductTest.RoundingIsMeasured. */
constexpr PetscReal max_rounding_part = 0.1;

struct ConstraintOptions {
  PetscBool single    = PETSC_TRUE; /* products in single precision */
  PetscInt  aggregate = PETSC_DECIDE;
};

/* Stored in checkpoints as it is, together with the state of the levels */
struct ConstraintState {
  PetscBool keep_double = PETSC_FALSE; /* products stay in double precision for all later matrices */
  PetscBool measured    = PETSC_FALSE; /* the rounding of products in single precision has been measured for this matrix */
};

struct Constraint : ConstraintOptions, ConstraintState {
  MatrixNodes      nodes;
  FineLevel        fine;
  CoarseLevel      coarse;
  NodeProduct      product;
  PetscBool        single_usable = PETSC_FALSE; /* a product in single precision exists, and the entries are within its range */
  PetscObjectId    matrix = 0, node_set = 0;    /* the matrix, and the index set LINEAR_NODES composed with it */
  PetscObjectState pattern = -1;
};

Constraint &Of(PC pc) { return *static_cast<Constraint *>(pc->data); }

PetscErrorCode CheckType(PC pc)
{
  PetscBool aij;
  MatType   type;

  PetscFunctionBegin;
  PetscCall(PetscObjectBaseTypeCompareAny((PetscObject)pc->pmat, &aij, MATSEQAIJ, MATMPIAIJ, ""));
  PetscCall(MatGetType(pc->pmat, &type));
  PetscCheck(aij, PetscObjectComm((PetscObject)pc), PETSC_ERR_SUP, "-pc_type " PCHHTCONSTRAINT " reads the rows of a matrix of type " MATAIJ ", not of %s", type);
  PetscFunctionReturn(0);
}

/* Finds the nodes if matrix, pattern or index set of nodes are others than before, and sets *fresh in that case */
PetscErrorCode FindNodes(PC pc, Constraint &c, PetscBool *fresh)
{
  PetscObjectId    id, node_set = 0;
  PetscObjectState pattern;
  PetscObject      is;

  PetscFunctionBegin;
  PetscCall(PetscObjectGetId((PetscObject)pc->pmat, &id));
  PetscCall(MatGetNonzeroState(pc->pmat, &pattern));
  PetscCall(PetscObjectQuery((PetscObject)pc->pmat, LINEAR_NODES, &is));
  if (is) PetscCall(PetscObjectGetId(is, &node_set));
  *fresh = (PetscBool)(id != c.matrix || pattern != c.pattern || node_set != c.node_set);
  if (*fresh) PetscCall(FindMatrixNodes(pc->pmat, &c.nodes));
  c.matrix   = id;
  c.pattern  = pattern;
  c.node_set = node_set;
  PetscFunctionReturn(0);
}

PetscErrorCode ReadOptions(PC pc, Constraint &c)
{
  const char *prefix;

  PetscFunctionBegin;
  PetscCall(PCGetOptionsPrefix(pc, &prefix));
  PetscCall(PetscOptionsGetInt(((PetscObject)pc)->options, prefix, "-pc_hhtconstraint_aggregate", &c.aggregate, NULL));
  if (!pc->setupcalled) PetscCall(PetscOptionsGetBool(((PetscObject)pc)->options, prefix, "-pc_hhtconstraint_single", &c.single, NULL));
  PetscFunctionReturn(0);
}

PetscErrorCode SetUpCoarse(PC pc, Constraint &c, PetscBool fresh, PetscBool *failed)
{
  Vec      positions;
  PetscInt nodes;

  PetscFunctionBegin;
  *failed = PETSC_FALSE;
  PetscCall(PetscObjectQuery((PetscObject)pc->pmat, LINEAR_POSITIONS, (PetscObject *)&positions));
  if (!c.aggregate || !positions) PetscCall(CoarseDestroy(&c.coarse));
  else {
    if (fresh || !c.coarse.R) {
      nodes = c.nodes.count;
      PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &nodes, 1, MPIU_INT, MPI_SUM, PetscObjectComm((PetscObject)pc)));
      PetscCall(CoarseCreate({c.nodes, pc->pmat, positions}, c.aggregate > 0 ? c.aggregate : nodes < large_body_nodes ? aggregate_nodes : aggregate_nodes_large, &c.coarse));
    }
    PetscCall(CoarseFill(pc, positions, &c.coarse, failed));
  }
  PetscFunctionReturn(0);
}

PetscErrorCode SetUpProduct(PC pc, Constraint &c, PetscBool fresh)
{
  PetscFunctionBegin;
  c.single_usable = c.measured = PETSC_FALSE;
  if (!c.single || c.keep_double || !c.nodes.three_unknowns || pc->mat != pc->pmat) {
    PetscCall(NodeProductDestroy(&c.product));
    PetscFunctionReturn(0);
  }
  PetscCall(NodeProductFill(pc->pmat, c.nodes.node, !fresh, &c.product, &c.single_usable));
  if (!c.single_usable) PetscCall(PetscInfo(pc, "products in double precision: single precision has no room for the entries of this matrix\n"));
  PetscFunctionReturn(0);
}

PetscErrorCode SetUp(PC pc)
{
  Constraint &c = Of(pc);
  PetscBool   fresh = PETSC_FALSE, fine, coarse;

  PetscFunctionBegin;
  PetscCall(CheckType(pc));
  PetscCall(ReadOptions(pc, c));
  PetscCall(FindNodes(pc, c, &fresh));
  PetscCall(SetUpCoarse(pc, c, fresh, &coarse));
  PetscCall(FineFill(pc, c.nodes, (PetscBool)!!c.coarse.R, fresh, &c.fine, &fine));
  PetscCall(SetUpProduct(pc, c, fresh));
  pc->failedreason = fine || coarse ? PC_SUBPC_ERROR : PC_NOERROR;
  PetscFunctionReturn(0);
}

PetscErrorCode Apply(PC pc, Vec x, Vec y)
{
  Constraint &c = Of(pc);
  PetscBool   fine, coarse = PETSC_FALSE;

  PetscFunctionBegin;
  PetscCall(FineSolve(&c.fine, c.nodes, x, y, &fine));
  if (c.coarse.R) PetscCall(CoarseAdd(&c.coarse, x, y, &coarse));
  if (fine || coarse) pc->failedreason = PC_SUBPC_ERROR;
  PetscFunctionReturn(0);
}

/* Conjugate gradients need a first iterate that satisfies the constraints: P^-1 b. At loose tolerances the operator becomes the product in single precision. */
PetscErrorCode PreSolve(PC pc, KSP ksp, Vec, Vec)
{
  Constraint &c = Of(pc);
  PetscReal   rtol;
  PetscBool   cg;

  PetscFunctionBegin;
  PetscCall(PCSetUp(pc)); /* if the operators were not set again, KSPSetUp() would leave it to the first PCApply(), which is too late to exchange the operator */
  PetscCall(PetscObjectTypeCompareAny((PetscObject)ksp, &cg, KSPCG, KSPFCG, KSPPIPECG, ""));
  if (cg) PetscCall(KSPSetInitialGuessKnoll(ksp, PETSC_TRUE));
  PetscCall(KSPGetTolerances(ksp, &rtol, NULL, NULL, NULL));
  if (c.single_usable && pc->mat == pc->pmat && rtol >= single_precision_rtol) PetscCall(PCSetOperators(pc, c.product.shell, pc->pmat));
  PetscFunctionReturn(0);
}

/* Called after the first solve with a matrix, and after failed ones: if the final residual is mainly rounding of products in single precision, or the solve failed, products are
   computed in double precision from then on */
PetscErrorCode Measure(PC pc, KSP ksp, Constraint &c, Vec b, Vec x)
{
  Vec                in_single, in_double;
  PetscReal          left, rounding;
  KSPConvergedReason reason;

  PetscFunctionBegin;
  PetscCall(KSPGetConvergedReason(ksp, &reason));
  if (c.measured && reason > 0) PetscFunctionReturn(0);
  c.measured = PETSC_TRUE;
  PetscCall(VecDuplicate(b, &in_single));
  PetscCall(VecDuplicate(b, &in_double));
  PetscCall(MatMult(c.product.shell, x, in_single));
  PetscCall(MatMult(pc->pmat, x, in_double));
  PetscCall(VecAXPY(in_double, -1, in_single));
  PetscCall(VecAYPX(in_single, -1, b));
  PetscCall(VecNorm(in_double, NORM_2, &rounding));
  PetscCall(VecNorm(in_single, NORM_2, &left));
  PetscCall(VecDestroy(&in_single));
  PetscCall(VecDestroy(&in_double));
  if (reason > 0 && rounding <= max_rounding_part * left) PetscFunctionReturn(0);
  c.keep_double   = PETSC_TRUE;
  c.single_usable = PETSC_FALSE;
  PetscCall(PetscInfo(pc, "products in double precision from now on: rounding of single precision is %g of the residual that a solve has left, %s\n", (double)(left > 0 ? rounding / left : 1),
                      KSPConvergedReasons[reason]));
  PetscFunctionReturn(0);
}

PetscErrorCode PostSolve(PC pc, KSP ksp, Vec b, Vec x)
{
  Constraint &c = Of(pc);

  PetscFunctionBegin;
  if (pc->mat == c.product.shell) {
    PetscCall(PCSetOperators(pc, pc->pmat, pc->pmat));
    PetscCall(Measure(pc, ksp, c, b, x));
  }
  PetscFunctionReturn(0);
}

/* ---- state ---- */

/* P^-1 depends on nodes and positions at the time when the matrix was computed, and on aggregates formed with the first matrix of its pattern */
PetscErrorCode SaveState(PC pc, Archive *archive)
{
  Constraint           &c       = Of(pc);
  ConstraintOptions     options = c;
  ConstraintState       state   = c;
  bool                  coarse  = c.coarse.R != nullptr;
  std::vector<PetscInt> node    = c.nodes.node;

  PetscFunctionBegin;
  archive->plain(options);
  archive->plain(state);
  archive->plain(coarse);
  archive->list(node);
  if (coarse) PetscCall(CoarseSaveState(c.coarse, archive));
  else PetscCall(FineSaveState(c.fine, archive));
  PetscFunctionReturn(0);
}

/* If options or nodes are others than those of the saved state, the preconditioner stays as it was set up, and *same = PETSC_FALSE */
PetscErrorCode LoadState(PC pc, Archive *archive, PetscBool *same)
{
  Constraint           &c = Of(pc);
  ConstraintOptions     options;
  ConstraintState       was;
  bool                  coarse = false;
  PetscBool             failed = PETSC_FALSE;
  std::vector<PetscInt> node;

  PetscFunctionBegin;
  archive->plain(options);
  archive->plain(was);
  archive->plain(coarse);
  archive->list(node);
  *same = (PetscBool)(archive->good && options.single == c.single && options.aggregate == c.aggregate && coarse == (c.coarse.R != nullptr) && node == c.nodes.node);
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, same, 1, MPIU_BOOL, MPI_LAND, PetscObjectComm((PetscObject)pc)));
  if (!*same) PetscFunctionReturn(0);
  if (coarse) PetscCall(CoarseLoadState(pc, &c.coarse, archive, same, &failed));
  else PetscCall(FineLoadState(pc, &c.fine, archive, same, &failed));
  if (failed) pc->failedreason = PC_SUBPC_ERROR;
  c.keep_double = was.keep_double;
  PetscCall(SetUpProduct(pc, c, PETSC_FALSE));
  c.measured = was.measured;
  PetscFunctionReturn(0);
}

PetscErrorCode View(PC pc, PetscViewer viewer)
{
  const Constraint &c = Of(pc);
  PetscBool         ascii;
  PetscInt          nodes = c.nodes.count, node_blocks = (PetscInt)c.nodes.node_blocks.size();
  MatInfo           all, kept                          = {};

  PetscFunctionBegin;
  PetscCall(PetscObjectTypeCompare((PetscObject)viewer, PETSCVIEWERASCII, &ascii));
  if (!ascii || !pc->setupcalled) PetscFunctionReturn(0);
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &nodes, 1, MPIU_INT, MPI_SUM, PetscObjectComm((PetscObject)pc)));
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &node_blocks, 1, MPIU_INT, MPI_SUM, PetscObjectComm((PetscObject)pc)));
  PetscCall(MatGetInfo(pc->pmat, MAT_GLOBAL_SUM, &all));
  if (c.fine.rest) PetscCall(MatGetInfo(c.fine.rest, MAT_GLOBAL_SUM, &kept));
  PetscCall(PetscViewerASCIIPrintf(viewer, "  %" PetscInt_FMT " nodes without couplings among them, %g entries of %g\n", nodes, (double)kept.nz_used + 9. * (double)node_blocks, (double)all.nz_used));
  PetscCall(PetscViewerASCIIPrintf(viewer, c.single_usable ? "  products with nodes in single precision, at relative tolerances from %g on\n" : "  products in double precision\n", (double)single_precision_rtol));
  if (c.fine.rest) PetscCall(PetscViewerASCIIPrintf(viewer, "  inverses of %" PetscInt_FMT " nodes; all else: %s\n", node_blocks, c.fine.inner.choice.text));
  if (c.fine.rest) PetscCall(InnerView(c.fine.inner, viewer));
  if (c.coarse.A) PetscCall(CoarseView(c.coarse, viewer));
  PetscFunctionReturn(0);
}

PetscErrorCode Reset(PC pc)
{
  Constraint &c = Of(pc);

  PetscFunctionBegin;
  PetscCall(FineDestroy(&c.fine));
  PetscCall(CoarseDestroy(&c.coarse));
  PetscCall(NodeProductDestroy(&c.product));
  c.matrix = 0;
  PetscFunctionReturn(0);
}

PetscErrorCode Destroy(PC pc)
{
  PetscFunctionBegin;
  PetscCall(Reset(pc));
  delete static_cast<Constraint *>(pc->data);
  pc->data = NULL;
  for (const char *name : {LINEAR_SAVE_STATE, LINEAR_LOAD_STATE}) PetscCall(PetscObjectComposeFunction((PetscObject)pc, name, NULL));
  PetscFunctionReturn(0);
}

PetscErrorCode Create(PC pc)
{
  PetscFunctionBegin;
  pc->data          = new Constraint();
  pc->ops->setup    = SetUp;
  pc->ops->apply    = Apply;
  pc->ops->presolve = PreSolve;
  pc->ops->postsolve = PostSolve;
  pc->ops->view     = View;
  pc->ops->reset    = Reset;
  pc->ops->destroy  = Destroy;
  PetscCall(PetscObjectComposeFunction((PetscObject)pc, LINEAR_SAVE_STATE, SaveState));
  PetscCall(PetscObjectComposeFunction((PetscObject)pc, LINEAR_LOAD_STATE, LoadState));
  PetscFunctionReturn(0);
}

} // namespace

PetscErrorCode LinearRegisterConstraint(void)
{
  PetscFunctionBegin;
  PetscCall(PCRegister(PCHHTCONSTRAINT, Create));
  PetscFunctionReturn(0);
}
