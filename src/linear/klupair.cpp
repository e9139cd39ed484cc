/*
  "klupair": the factor matrix. Options, with the prefix of the solver:

    -mat_klupair_pivot_tol <0.001>              the planned pivot is kept if it is at least this part of the largest entry of its column
    -mat_klupair_row_scale <none,sum,max>       scaling of rows, none by default
    -mat_klupair_ordering <auto,amd,metis>      auto: AMD, or METIS where AMD predicts much work and METIS less
    -mat_klupair_refactor <true>                keep the pivots from one matrix to the next while element growth stays small
    -mat_klupair_panels <true>                  refactor with dense panels where they pay (klupair_panels.h)
*/
#include "klupair.h"

#if defined(HHTDAE_HAVE_KLU)
#include "klupair_data.h"
#include "klupair_panels.h"
#include "linear.h"

/* ---- rows of the matrix ---- */

PetscErrorCode KluPairGetRows(Mat A, LinearRows *rows)
{
  static const PetscInt    none = 0;
  static const PetscScalar zero = 0;
  PetscBool                done;

  PetscFunctionBegin;
  PetscCall(MatGetRowIJ(A, 0, PETSC_FALSE, PETSC_FALSE, &rows->n, &rows->start, &rows->col, &done));
  PetscCheck(done, PetscObjectComm((PetscObject)A), PETSC_ERR_SUP,
             "The matrix does not give its rows; convert it to type seqaij");
  PetscCall(MatSeqAIJGetArrayRead(A, &rows->val));
  if (!rows->col) rows->col = &none; /* a matrix without entries has no arrays, but KLU refuses null pointers */
  if (!rows->val) rows->val = &zero;
  PetscFunctionReturn(0);
}

PetscErrorCode KluPairRestoreRows(Mat A, LinearRows *rows)
{
  PetscBool done;

  PetscFunctionBegin;
  PetscCall(MatSeqAIJRestoreArrayRead(A, &rows->val));
  PetscCall(MatRestoreRowIJ(A, 0, PETSC_FALSE, PETSC_FALSE, &rows->n, &rows->start, &rows->col, &done));
  PetscFunctionReturn(0);
}

/* ---- solve ---- */

static PetscErrorCode Solve(Mat F, Vec b, Vec x, bool transposed)
{
  KluPair     *k = KluPairOf(F);
  PetscScalar *array;

  PetscFunctionBegin;
  if (F->factorerrortype || !k->factored()) {
    PetscCall(PetscInfo(F, "Solve with a factor that failed: the result is Inf\n"));
    PetscCall(VecSet(x, PETSC_INFINITY));
    PetscFunctionReturn(0);
  }
  PetscCall(VecCopy(b, x));
  PetscCall(VecGetArray(x, &array));
  if (k->panels_used) {
    PetscCall(KluPanelsSolve(k->panels.get(), !transposed, array));
    PetscCall(VecRestoreArray(x, &array));
    PetscCall(PetscLogFlops(2.0 * k->panels->entries));
    PetscFunctionReturn(0);
  }
  /* KLU holds the factors of the transpose */
  const KluInt n  = k->symbolic->n;
  const KluInt ok = transposed ? KLU(solve)(k->symbolic, k->numeric, n, 1, array, &k->common)
                               : KLU(tsolve)(k->symbolic, k->numeric, n, 1, array, &k->common);
  PetscCall(VecRestoreArray(x, &array));
  PetscCheck(ok, PETSC_COMM_SELF, PETSC_ERR_LIB, "KLU's solve with %" PetscInt_FMT " rows failed with status %d",
             (PetscInt)n, (int)k->common.status);
  PetscCall(PetscLogFlops(2.0 * ((double)k->numeric->lnz + (double)k->numeric->unz)));
  PetscFunctionReturn(0);
}

static PetscErrorCode MatSolve_KLUPair(Mat F, Vec b, Vec x) { return Solve(F, b, x, false); }

static PetscErrorCode MatSolveTranspose_KLUPair(Mat F, Vec b, Vec x) { return Solve(F, b, x, true); }

/* ---- analysis ---- */

static PetscErrorCode ReadOptions(Mat F)
{
  static const char *const orderings[] = {"auto", "amd", "metis"}, *const scalings[] = {"none", "sum", "max"};
  KluPair *k        = KluPairOf(F);
  PetscInt ordering = k->ordering, scaling = (PetscInt)k->common.scale;

  PetscFunctionBegin;
  PetscObjectOptionsBegin((PetscObject)F);
  PetscCall(PetscOptionsReal("-mat_klupair_pivot_tol", "Part of its column that a planned pivot must have", "None",
                             k->common.tol, &k->common.tol, NULL));
  PetscCall(PetscOptionsEList("-mat_klupair_row_scale", "Scaling of rows", "None", scalings, 3, scalings[scaling],
                              &scaling, NULL));
  PetscCall(PetscOptionsEList("-mat_klupair_ordering", "Ordering of the pairs", "None", orderings, 3,
                              orderings[ordering], &ordering, NULL));
  PetscCall(PetscOptionsBool("-mat_klupair_refactor", "Keep pivots while they are good", "None", k->refactor,
                             &k->refactor, NULL));
  PetscCall(PetscOptionsBool("-mat_klupair_panels", "Dense panels where they pay", "None", k->panels_wanted,
                             &k->panels_wanted, NULL));
  PetscOptionsEnd();
  PetscCheck(k->common.tol >= 0 && k->common.tol <= 1, PetscObjectComm((PetscObject)F), PETSC_ERR_ARG_OUTOFRANGE,
             "-mat_klupair_pivot_tol %g is not between 0 and 1", k->common.tol);
  k->ordering     = (KluPairOrdering)ordering;
  k->common.scale = (KluInt)scaling;
  PetscFunctionReturn(0);
}

static PetscErrorCode FactorSymbolic(Mat F, Mat A, IS row, IS, const MatFactorInfo *)
{
  KluPair        *k = KluPairOf(F);
  LinearRows      rows;
  const PetscInt *order;

  PetscFunctionBegin;
  PetscCall(ReadOptions(F));
  k->given_order.clear();
  if (row) {
    PetscCall(ISGetIndices(row, &order));
    k->given_order.assign(order, order + A->rmap->n);
    PetscCall(ISRestoreIndices(row, &order));
  }
  PetscCall(KluPairGetRows(A, &rows));
  PetscCall(KluPairAnalyseValues(A, rows, k));
  PetscCall(KluPairRestoreRows(A, &rows));
  F->ops->lufactornumeric = KluPairFactorNumeric;
  F->ops->solve           = MatSolve_KLUPair;
  F->ops->solvetranspose  = MatSolveTranspose_KLUPair;
  PetscFunctionReturn(0);
}

/* ---- information and view ---- */

static PetscErrorCode GetSolverType(Mat, MatSolverType *type) { return *type = LINEAR_KLUPAIR, 0; }

static PetscErrorCode GetInfo(Mat F, MatInfoType, MatInfo *info)
{
  const KluPair *k        = KluPairOf(F);
  const double   matrix   = k->col.empty() ? 1 : (double)k->col.size();
  const double   foreseen = 2 * k->work.factor - (double)F->rmap->n;

  PetscFunctionBegin;
  PetscCall(PetscMemzero(info, sizeof *info));
  info->block_size = 1;
  /* L has ones on its diagonal */
  info->nz_used = foreseen;
  if (k->numeric)
    info->nz_used = (double)k->numeric->lnz + (double)k->numeric->unz + (double)k->numeric->nzoff - (double)F->rmap->n;
  info->nz_allocated = info->nz_used;
  info->memory       = (double)k->common.memusage;
  if (k->panels) info->memory += sizeof(double) * k->panels->entries;
  info->fill_ratio_given  = foreseen / matrix;
  info->fill_ratio_needed = info->nz_used / matrix;
  PetscFunctionReturn(0);
}

static PetscErrorCode View(Mat F, PetscViewer viewer)
{
  const KluPair    *k = KluPairOf(F);
  PetscBool         ascii;
  PetscViewerFormat format;

  PetscFunctionBegin;
  PetscCall(PetscObjectTypeCompare((PetscObject)viewer, PETSCVIEWERASCII, &ascii));
  if (!ascii) PetscFunctionReturn(0);
  PetscCall(PetscViewerGetFormat(viewer, &format));
  if (format != PETSC_VIEWER_ASCII_INFO && format != PETSC_VIEWER_ASCII_INFO_DETAIL) PetscFunctionReturn(0);
  PetscCall(PetscViewerASCIIPrintf(viewer, "KLU, ordering %s, pivot tolerance %g\n", k->ordering_used, k->common.tol));
  PetscCall(PetscViewerASCIIPrintf(viewer,
                                   "  %" PetscInt_FMT " rows without diagonal, %" PetscInt_FMT
                                   " of them in pairs; foreseen: %g entries in L, %g operations\n",
                                   k->pivots.zeros, k->pivots.pairs, k->work.factor, k->work.flops));
  if (k->numeric)
    PetscCall(PetscViewerASCIIPrintf(viewer, "  %g entries in L and U, %g operations; %d pivots not as planned\n",
                                     (double)k->numeric->lnz + (double)k->numeric->unz, k->common.flops,
                                     (int)k->common.noffdiag));
  if (k->panels)
    PetscCall(PetscViewerASCIIPrintf(
        viewer, "  dense panels for these pivots: %zu, %g entries, %g operations; used %" PetscInt_FMT " times\n",
        k->panels->panel.size(), k->panels->entries, k->panels->flops, k->panel_factorizations));
  else
    PetscCall(PetscViewerASCIIPrintf(viewer, "  no dense panels%s\n",
                                     k->panels_tried ? ": they would not pay" : " looked for"));
  PetscCall(PetscViewerASCIIPrintf(viewer,
                                   "  analyses: %" PetscInt_FMT ", factorizations with pivoting: %" PetscInt_FMT
                                   ", with old pivots: %" PetscInt_FMT ", of these given up: %" PetscInt_FMT "\n",
                                   k->analyses, k->factorizations, k->refactorizations + k->rejected, k->rejected));
  PetscFunctionReturn(0);
}

/* ---- create and destroy ---- */

static PetscErrorCode Destroy(Mat F)
{
  KluPair *k = KluPairOf(F);

  PetscFunctionBegin;
  KLU(free_numeric)(&k->numeric, &k->common);
  KLU(free_symbolic)(&k->symbolic, &k->common);
  delete k;
  F->data = NULL;
  for (const char *name : {"MatFactorGetSolverType_C", LINEAR_SAVE_STATE, LINEAR_LOAD_STATE})
    PetscCall(PetscObjectComposeFunction((PetscObject)F, name, NULL));
  PetscFunctionReturn(0);
}

PetscErrorCode LinearKLUPairFactor(Mat A, MatFactorType type, Mat *factor)
{
  Mat      F;
  KluPair *k = new KluPair();

  PetscFunctionBegin;
  PetscCall(MatCreate(PetscObjectComm((PetscObject)A), &F));
  PetscCall(MatSetSizes(F, A->rmap->n, A->cmap->n, A->rmap->N, A->cmap->N));
  PetscCall(PetscStrallocpy(LINEAR_KLUPAIR, &((PetscObject)F)->type_name));
  PetscCall(MatSetUp(F));
  PetscCheck(KLU(defaults)(&k->common), PETSC_COMM_SELF, PETSC_ERR_LIB, "KLU did not start");
  k->common.scale          = 0;
  F->data                  = k;
  F->factortype            = type;
  F->assembled             = PETSC_TRUE; /* otherwise -ksp_view does not show the factor */
  F->canuseordering        = PETSC_TRUE;
  F->ops->lufactorsymbolic = FactorSymbolic;
  F->ops->getinfo          = GetInfo;
  F->ops->view             = View;
  F->ops->destroy          = Destroy;
  PetscCall(PetscFree(F->solvertype));
  PetscCall(PetscStrallocpy(LINEAR_KLUPAIR, &F->solvertype));
  PetscCall(PetscStrallocpy(MATORDERINGEXTERNAL, (char **)&F->preferredordering[type]));
  PetscCall(PetscObjectComposeFunction((PetscObject)F, "MatFactorGetSolverType_C", GetSolverType));
  PetscCall(PetscObjectComposeFunction((PetscObject)F, LINEAR_SAVE_STATE, KluPairSaveState));
  PetscCall(PetscObjectComposeFunction((PetscObject)F, LINEAR_LOAD_STATE, KluPairLoadState));
  *factor = F;
  PetscFunctionReturn(0);
}

PetscErrorCode LinearRegisterKLUPair(void)
{
  PetscFunctionBegin;
  PetscCall(MatSolverTypeRegister(LINEAR_KLUPAIR, MATSEQAIJ, MAT_FACTOR_LU, LinearKLUPairFactor));
  PetscFunctionReturn(0);
}

#else

PetscErrorCode LinearRegisterKLUPair(void) { return 0; }

#endif
