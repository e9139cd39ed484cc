/*
  The preconditioner "hhtconstraint", constraint.h. The solver of its fine level has the prefix "constraint_" after that of the preconditioner's own options,
  and is chosen as any other direct solver where the user chooses none.
*/
#include "constraint.h"
#include "coarse.h"
#include "fine.h"
#include "linear.h"
#include "node_product.h"
#include <petsc/private/pcimpl.h>

namespace
{

constexpr PetscInt  in_aggregate = 200;  /* nodes: of 60 to 200 the best at 17,000 and 120,000 unknowns, src/flexible/README.md */
constexpr PetscInt  in_large = 400, large = 200000; /* of so many nodes: as good as 200 at 100,000, and half the time of coarse solves at 350,000 */
constexpr PetscReal few_digits   = 1e-4; /* relative tolerances from here on are a matter of single precision */
constexpr PetscReal a_part       = 0.1;  /* of the residual that a solve leaves: more may not be rounding of single precision */

struct ConstraintOptions {
  PetscBool single    = PETSC_TRUE; /* products in single precision */
  PetscInt  aggregate = PETSC_DECIDE;
};

/* Saved and restored as it is, with what the levels keep */
struct ConstraintState {
  PetscBool fallen   = PETSC_FALSE; /* back to double precision, for good */
  PetscBool measured = PETSC_FALSE; /* what products in single precision leave of this matrix' solves */
};

struct Constraint : ConstraintOptions, ConstraintState {
  MatrixNodes      nodes;
  FineLevel        fine;
  CoarseLevel      coarse;
  NodeProduct      product;
  PetscBool        in_range = PETSC_FALSE; /* there is a product in single precision */
  PetscObjectId    matrix = 0, told = 0; /* the matrix, and the index set of nodes that was composed with it */
  PetscObjectState pattern   = -1;
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

/* *fresh: another matrix, another pattern or other nodes than before */
PetscErrorCode FindNodes(PC pc, Constraint &c, PetscBool *fresh)
{
  PetscObjectId    id, told = 0;
  PetscObjectState pattern;
  PetscObject      is;

  PetscFunctionBegin;
  PetscCall(PetscObjectGetId((PetscObject)pc->pmat, &id));
  PetscCall(MatGetNonzeroState(pc->pmat, &pattern));
  PetscCall(PetscObjectQuery((PetscObject)pc->pmat, LINEAR_NODES, &is));
  if (is) PetscCall(PetscObjectGetId(is, &told));
  *fresh = (PetscBool)(id != c.matrix || pattern != c.pattern || told != c.told);
  if (*fresh) PetscCall(FindMatrixNodes(pc->pmat, &c.nodes));
  c.matrix  = id;
  c.pattern = pattern;
  c.told    = told;
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
      PetscCall(CoarseCreate({c.nodes, pc->pmat, positions}, c.aggregate > 0 ? c.aggregate : nodes < large ? in_aggregate : in_large, &c.coarse));
    }
    PetscCall(CoarseFill(pc, positions, &c.coarse, failed));
  }
  PetscFunctionReturn(0);
}

PetscErrorCode SetUpProduct(PC pc, Constraint &c, PetscBool fresh)
{
  PetscFunctionBegin;
  c.in_range = c.measured = PETSC_FALSE;
  if (!c.single || c.fallen || !c.nodes.threes || pc->mat != pc->pmat) {
    PetscCall(NodeProductDestroy(&c.product));
    PetscFunctionReturn(0);
  }
  PetscCall(NodeProductFill(pc->pmat, c.nodes.node, !fresh, &c.product, &c.in_range));
  if (!c.in_range) PetscCall(PetscInfo(pc, "products in double precision: single precision has no room for the entries of this matrix\n"));
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

/* Conjugate gradients need a first iterate on the constraints: P^-1 b. A few digits take products of single precision. */
PetscErrorCode PreSolve(PC pc, KSP ksp, Vec, Vec)
{
  Constraint &c = Of(pc);
  PetscReal   rtol;
  PetscBool   cg;

  PetscFunctionBegin;
  PetscCall(PCSetUp(pc)); /* KSPSetUp() leaves it to the first PCApply() where nobody has set the operators again */
  PetscCall(PetscObjectTypeCompareAny((PetscObject)ksp, &cg, KSPCG, KSPFCG, KSPPIPECG, ""));
  if (cg) PetscCall(KSPSetInitialGuessKnoll(ksp, PETSC_TRUE));
  PetscCall(KSPGetTolerances(ksp, &rtol, NULL, NULL, NULL));
  if (c.in_range && pc->mat == pc->pmat && rtol >= few_digits) PetscCall(PCSetOperators(pc, c.product.shell, pc->pmat));
  PetscFunctionReturn(0);
}

/* After the first solve with a matrix, and one that failed: where rounding of the products in single precision is what is left, double precision from now on */
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
  if (reason > 0 && rounding <= a_part * left) PetscFunctionReturn(0);
  c.fallen   = PETSC_TRUE;
  c.in_range = PETSC_FALSE;
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

/* Nodes and positions are in P^-1 as they were when the matrix was made, aggregates as with the first one of its pattern */
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

/* Where the user wishes otherwise now, or nodes are others, the preconditioner stays as it was set up. */
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
  c.fallen = was.fallen;
  PetscCall(SetUpProduct(pc, c, PETSC_FALSE));
  c.measured = was.measured;
  PetscFunctionReturn(0);
}

PetscErrorCode View(PC pc, PetscViewer viewer)
{
  const Constraint &c = Of(pc);
  PetscBool         ascii;
  PetscInt          nodes = c.nodes.count, alone = (PetscInt)c.nodes.alone.size();
  MatInfo           all, kept = {};

  PetscFunctionBegin;
  PetscCall(PetscObjectTypeCompare((PetscObject)viewer, PETSCVIEWERASCII, &ascii));
  if (!ascii || !pc->setupcalled) PetscFunctionReturn(0);
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &nodes, 1, MPIU_INT, MPI_SUM, PetscObjectComm((PetscObject)pc)));
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &alone, 1, MPIU_INT, MPI_SUM, PetscObjectComm((PetscObject)pc)));
  PetscCall(MatGetInfo(pc->pmat, MAT_GLOBAL_SUM, &all));
  if (c.fine.apart) PetscCall(MatGetInfo(c.fine.apart, MAT_GLOBAL_SUM, &kept));
  PetscCall(PetscViewerASCIIPrintf(viewer, "  %" PetscInt_FMT " nodes without couplings among them, %g entries of %g\n", nodes, (double)kept.nz_used + 9. * (double)alone, (double)all.nz_used));
  PetscCall(PetscViewerASCIIPrintf(viewer, c.in_range ? "  products with nodes in single precision, at relative tolerances from %g on\n" : "  products in double precision\n", (double)few_digits));
  if (c.fine.apart) PetscCall(PetscViewerASCIIPrintf(viewer, "  inverses of %" PetscInt_FMT " nodes; all else: %s\n", alone, c.fine.inner.choice.text));
  if (c.fine.apart) PetscCall(InnerView(c.fine.inner, viewer));
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
