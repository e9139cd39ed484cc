/*
  "klupair": the factor matrix. Options, with the prefix of the solver:
    -mat_klupair_pivot_tol <0.001>             a pivot is left where it was planned if it is so large a part of its
  column -mat_klupair_row_scale <none,sum,max>      scaling of rows, none by default -mat_klupair_ordering
  <auto,amd,metis>     auto: METIS where AMD foresees much work and METIS less -mat_klupair_refactor <true> keep the
  pivots from one matrix to the next while they are good
    -mat_klupair_panels <true>                        dense panels for that where they pay (klupair_panels.h)
*/
#include "klupair.h"

#if defined(HHTDAE_HAVE_KLU)
#include "klupair_data.h"
#include "klupair_panels.h"
#include "linear.h"
#include <algorithm>
#include <petsc/private/matimpl.h>

/* Old pivots are kept while entries grow at most so many times as much as with the pivots chosen for their own matrix
 */
static const double GROWTH = 100;

/* Pivots as planned are good enough where no entry grows more than so (the reciprocal) */
static const double PLANNED_GROWTH = 0.01;

/* Entries that have grown so much (the reciprocal) have half the digits of the matrix at best: then the largest pivots
   are taken, whatever was planned. KluPair.PivotsAsPlannedThatLetEntriesGrow; scenes stay above 1e-6. */
static const double LEAST_GROWTH = 1e-8;

static KluPair *Data(Mat F) { return static_cast<KluPair *>(F->data); }

/* ---- rows of the matrix ---- */

PetscErrorCode KluPairGetRows(Mat A, LinearRows *rows)
{
  PetscBool done;

  PetscFunctionBegin;
  PetscCall(MatGetRowIJ(A, 0, PETSC_FALSE, PETSC_FALSE, &rows->n, &rows->start, &rows->col, &done));
  PetscCheck(done, PetscObjectComm((PetscObject)A), PETSC_ERR_SUP,
             "The matrix does not give its rows; convert it to type seqaij");
  PetscCall(MatSeqAIJGetArrayRead(A, &rows->val));
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

static PetscErrorCode Analyse(Mat A, const LinearRows &rows, KluPair *k)
{
  PetscFunctionBegin;
  PetscCall(KluPairAnalyse(A, rows, k));
  k->panels.reset();
  k->panels_looked = k->panels_used = k->plan_tried = false;
  k->analysed.assign(rows.val, rows.val + rows.start[rows.n]);
  k->pivoted.clear();
  k->start.assign(rows.start, rows.start + rows.n + 1);
  k->col.assign(rows.col, rows.col + rows.start[rows.n]);
  PetscCall(PetscObjectGetId((PetscObject)A, &k->matrix));
  PetscCall(MatGetNonzeroState(A, &k->pattern));
  PetscCall(PetscObjectStateGet((PetscObject)A, &k->values));
  PetscFunctionReturn(0);
}

/* The entries are compared only when PETSc does not know the pattern for the one analysed */
static PetscErrorCode SamePattern(Mat A, const LinearRows &rows, KluPair *k, bool *same)
{
  PetscObjectId    id;
  PetscObjectState pattern;

  PetscFunctionBegin;
  PetscCall(PetscObjectGetId((PetscObject)A, &id));
  PetscCall(MatGetNonzeroState(A, &pattern));
  *same = id == k->matrix && pattern == k->pattern;
  if (*same) PetscFunctionReturn(0);
  *same = (size_t)rows.n + 1 == k->start.size() && std::equal(k->start.begin(), k->start.end(), rows.start) &&
          std::equal(k->col.begin(), k->col.end(), rows.col);
  k->matrix  = id;
  k->pattern = pattern;
  PetscFunctionReturn(0);
}

/* ---- factorization ---- */

static KluInt *Start(const LinearRows &r) { return KluIndices(r.start); }
static KluInt *Col(const LinearRows &r) { return KluIndices(r.col); }
static double *Val(const LinearRows &r) { return const_cast<double *>(r.val); }

/* Smallest ratio, over columns, of the largest entry of the matrix to the largest in U; 0 if a pivot is zero or not
 * finite */
static double ReciprocalGrowth(const LinearRows &rows, KluPair *k)
{
  if (!KLU(rcond)(k->symbolic, k->numeric, &k->common) || !(k->common.rcond > 0)) return 0;
  if (!KLU(rgrowth)(Start(rows), Col(rows), Val(rows), k->symbolic, k->numeric, &k->common)) return 0;
  return k->common.rgrowth;
}

/* Row scaling and the interface of kluparts want KLU's factors */
static bool PanelsAllowed(const KluPair *k) { return k->panels_wanted && !k->whole && !(k->common.scale > 0); }

static PetscErrorCode ReportPanels(Mat F, const KluPanels &p)
{
  PetscFunctionBegin;
  PetscCall(PetscInfo(F, "%zu panels with %g entries, %g operations, estimated at %g s; KLU at %g s\n", p.panel.size(),
                      p.entries, p.flops, p.seconds, p.scalar));
  PetscFunctionReturn(0);
}

/* Panels for KLU's pivots are built when these are kept for the first time */
static PetscErrorCode FindPanels(Mat F, const LinearRows &rows, KluPair *k)
{
  bool pays;

  PetscFunctionBegin;
  if (k->panels_looked || !PanelsAllowed(k)) PetscFunctionReturn(0);
  if (k->rejected > k->refactorizations) PetscFunctionReturn(0); /* pivots are not kept for long */
  k->panels_looked = true;
  k->panels        = std::make_shared<KluPanels>();
  PetscCall(KluPanelsBuild(rows, k, k->panels.get(), &pays));
  PetscCall(ReportPanels(F, *k->panels));
  if (!pays) k->panels.reset();
  PetscFunctionReturn(0);
}

/* The reciprocal growth with the old pivots, 0 if they cannot be used any more */
static PetscErrorCode FactorWithOldPivots(const LinearRows &rows, KluPair *k, double *growth)
{
  PetscFunctionBegin;
  *growth        = 0;
  k->panels_used = k->panels != nullptr;
  if (k->panels_used) {
    PetscCall(KluPanelsFactor(rows, k->panels.get(), growth));
    ++k->panels_made;
  } else if (KLU(refactor)(Start(rows), Col(rows), Val(rows), k->symbolic, k->numeric, &k->common) &&
             k->common.status == KLU_OK)
    *growth = ReciprocalGrowth(rows, k);
  PetscFunctionReturn(0);
}

static PetscErrorCode Refactor(Mat F, const LinearRows &rows, bool *good)
{
  KluPair *k = Data(F);
  double   growth;

  PetscFunctionBegin;
  *good = false;
  if (!k->factored() || !k->refactor) PetscFunctionReturn(0);
  PetscCall(FindPanels(F, rows, k));
  PetscCall(FactorWithOldPivots(rows, k, &growth));
  *good = growth > 0 && growth * GROWTH >= k->growth;
  PetscCall(
      PetscInfo(F, "Old pivots %s: reciprocal growth %g, was %g\n", *good ? "kept" : "given up", growth, k->growth));
  if (*good)
    ++k->refactorizations;
  else
    ++k->rejected;
  PetscFunctionReturn(0);
}

/* Most often these are the values analysed, which are not kept twice */
static void NotePivots(const LinearRows &rows, KluPair *k)
{
  if (std::equal(k->analysed.begin(), k->analysed.end(), rows.val))
    k->pivoted.clear();
  else
    k->pivoted.assign(rows.val, rows.val + rows.start[rows.n]);
}

/* The first factorization after an analysis, by panels where they pay at once */
static PetscErrorCode FactorAsPlanned(Mat F, const LinearRows &rows, bool *good)
{
  KluPair *k = Data(F);

  PetscFunctionBegin;
  *good = false;
  if (k->factored() || k->plan_tried || !k->refactor || !PanelsAllowed(k)) PetscFunctionReturn(0);
  k->plan_tried     = true;
  const auto panels = std::make_shared<KluPanels>();
  KluPanelsPlan(rows, *k, panels.get(), good);
  if (!*good) PetscFunctionReturn(0);
  PetscCall(ReportPanels(F, *panels));
  PetscCall(KluPanelsFactor(rows, panels.get(), &k->growth));
  *good = k->growth >= PLANNED_GROWTH;
  PetscCall(PetscInfo(F, "Pivots as planned %s: reciprocal growth %g\n", *good ? "taken" : "not good enough", k->growth));
  if (!*good) PetscFunctionReturn(0);
  NotePivots(rows, k);
  k->panels        = panels;
  k->panels_looked = k->panels_used = true;
  ++k->panels_made;
  ++k->factorizations;
  PetscFunctionReturn(0);
}

/* Planned pivots that are at least so large a part of their column stay */
static PetscErrorCode FactorWithTolerance(const LinearRows &rows, KluPair *k, double tolerance)
{
  const double given = k->common.tol;

  PetscFunctionBegin;
  KLU(free_numeric)(&k->numeric, &k->common);
  k->common.tol = tolerance;
  k->numeric    = KLU(factor)(Start(rows), Col(rows), Val(rows), k->symbolic, &k->common);
  k->common.tol = given;
  ++k->factorizations;
  if (!k->numeric) PetscFunctionReturn(0);
  KLU(sort)(k->symbolic, k->numeric, &k->common);
  KLU(flops)(k->symbolic, k->numeric, &k->common);
  k->growth = ReciprocalGrowth(rows, k);
  PetscFunctionReturn(0);
}

static PetscErrorCode FactorWithPivoting(Mat F, const LinearRows &rows, KluPair *k)
{
  PetscFunctionBegin;
  NotePivots(rows, k);
  k->panels.reset();
  k->panels_looked = k->panels_used = false;
  PetscCall(FactorWithTolerance(rows, k, k->common.tol));
  if (!k->numeric || k->growth >= LEAST_GROWTH) PetscFunctionReturn(0);
  PetscCall(PetscInfo(F, "Pivots found with tolerance %g let entries grow (reciprocal %g): the largest are taken\n",
                      k->common.tol, k->growth));
  PetscCall(FactorWithTolerance(rows, k, 1));
  PetscFunctionReturn(0);
}

/* Much more fill than foreseen: the pivots were planned for values that are no longer those of the matrix */
static PetscErrorCode PlanAnew(Mat F, Mat A, const LinearRows &rows)
{
  KluPair         *k = Data(F);
  PetscObjectState values;

  PetscFunctionBegin;
  if (!k->numeric) PetscFunctionReturn(0);
  const double entries = (double)k->numeric->lnz + (double)k->numeric->unz;
  PetscCall(PetscObjectStateGet((PetscObject)A, &values));
  if (entries <= k->tolerated || values == k->values) PetscFunctionReturn(0);
  PetscCall(PetscInfo(F, "%g entries in L and U, %g were foreseen: the pivots are planned anew\n", entries,
                      2 * k->work.factor));
  PetscCall(Analyse(A, rows, k));
  PetscCall(FactorWithPivoting(F, rows, k));
  /* where a new plan does not help, it is not tried again for the same fill */
  if (k->numeric) k->tolerated = PetscMax(k->tolerated, 1.5 * ((double)k->numeric->lnz + (double)k->numeric->unz));
  PetscFunctionReturn(0);
}

static PetscErrorCode ReportError(Mat F, Mat A)
{
  KluPair *k = Data(F);

  PetscFunctionBegin;
  if (k->factored() && k->growth > 0) PetscFunctionReturn(0);
  KLU(free_numeric)(&k->numeric, &k->common);
  if (k->common.status < 0) {
    PetscCheck(!A->erroriffailure, PETSC_COMM_SELF, PETSC_ERR_LIB,
               "KLU's factorization of the matrix with %" PetscInt_FMT " rows failed with status %d", A->rmap->N,
               (int)k->common.status);
    F->factorerrortype = k->common.status == KLU_OUT_OF_MEMORY ? MAT_FACTOR_OUTMEMORY : MAT_FACTOR_OTHER;
  } else if (k->common.singular_col >= (KluInt)A->rmap->N) {
    PetscCheck(!A->erroriffailure, PETSC_COMM_SELF, PETSC_ERR_FP,
               "The matrix with %" PetscInt_FMT " rows or its factors are not finite", A->rmap->N);
    F->factorerrortype = MAT_FACTOR_OTHER;
  } else {
    PetscCheck(!A->erroriffailure, PETSC_COMM_SELF, PETSC_ERR_MAT_LU_ZRPVT,
               "The matrix with %" PetscInt_FMT " rows is singular: KLU met a zero pivot in row %" PetscInt_FMT,
               A->rmap->N, (PetscInt)k->common.singular_col);
    F->factorerrortype             = MAT_FACTOR_NUMERIC_ZEROPIVOT;
    F->factorerror_zeropivot_row   = (PetscInt)k->common.singular_col;
    F->factorerror_zeropivot_value = 0;
  }
  PetscCall(PetscInfo(F, "KLU failed: status %d, row %" PetscInt_FMT "\n", (int)k->common.status,
                      (PetscInt)k->common.singular_col));
  PetscFunctionReturn(0);
}

static PetscErrorCode FactorNumeric(Mat F, Mat A, const MatFactorInfo *)
{
  KluPair   *k = Data(F);
  LinearRows rows;
  bool       same, good;

  PetscFunctionBegin;
  F->factorerrortype = MAT_FACTOR_NOERROR;
  PetscCall(KluPairGetRows(A, &rows));
  PetscCall(SamePattern(A, rows, k, &same));
  if (!same) PetscCall(Analyse(A, rows, k));
  PetscCall(Refactor(F, rows, &good));
  k->old_pivots = good;
  if (!good) PetscCall(FactorAsPlanned(F, rows, &good));
  if (!good) {
    PetscCall(FactorWithPivoting(F, rows, k));
    PetscCall(PlanAnew(F, A, rows));
  }
  PetscCall(KluPairRestoreRows(A, &rows));
  PetscCall(ReportError(F, A));
  F->assembled = PETSC_TRUE;
  if (k->factored()) PetscCall(PetscLogFlops(k->panels_used ? k->panels->flops : k->common.flops));
  PetscFunctionReturn(0);
}

/* ---- state ---- */

namespace
{
enum class Pivots { None, Planned, Found };
}

static PetscErrorCode SaveState(Mat F, Archive *archive)
{
  KluPair     *k      = Data(F);
  Pivots       pivots = k->numeric ? Pivots::Found : k->panels_used ? Pivots::Planned : Pivots::None;
  bool         panels = k->panels != nullptr;
  KluPairState state  = *k;

  PetscFunctionBegin;
  archive->plain(state);
  archive->plain(pivots);
  archive->plain(panels);
  archive->list(k->analysed);
  archive->list(k->pivoted);
  PetscFunctionReturn(0);
}

/* The pivots again from the matrix that they were found with, and the panels that had been built for them */
static PetscErrorCode RepeatPivots(Mat F, const LinearRows &rows, Pivots pivots, bool panels, bool *good)
{
  KluPair *k = Data(F);

  PetscFunctionBegin;
  *good = pivots == Pivots::None;
  if (pivots == Pivots::Planned) PetscCall(FactorAsPlanned(F, rows, good));
  if (pivots != Pivots::Found) PetscFunctionReturn(0);
  PetscCall(FactorWithPivoting(F, rows, k));
  *good = k->numeric != NULL;
  if (!*good || !panels) PetscFunctionReturn(0);
  k->panels = std::make_shared<KluPanels>();
  PetscCall(KluPanelsBuild(rows, k, k->panels.get(), good));
  PetscFunctionReturn(0);
}

static PetscErrorCode LoadState(Mat F, Mat A, Archive *archive, PetscBool *same)
{
  KluPair                 *k = Data(F);
  LinearRows               rows, old;
  KluPairState             state;
  Pivots                   pivots = Pivots::None;
  bool                     panels = false, good;
  std::vector<PetscScalar> analysed, pivoted;
  double                   growth;

  PetscFunctionBegin;
  archive->plain(state);
  archive->plain(pivots);
  archive->plain(panels);
  archive->list(analysed);
  archive->list(pivoted);
  PetscCall(KluPairGetRows(A, &rows));
  const size_t entries = rows.start[rows.n];
  *same = (PetscBool)(archive->good && analysed.size() == entries && (pivoted.empty() || pivoted.size() == entries));
  if (*same) {
    old     = rows;
    old.val = analysed.data();
    PetscCall(Analyse(A, old, k));
    if (!pivoted.empty()) old.val = pivoted.data();
    PetscCall(RepeatPivots(F, old, pivots, panels, &good));
    good = good && (!state.old_pivots || k->factored());
    if (good && state.old_pivots) PetscCall(FactorWithOldPivots(rows, k, &growth));
    good = good && (state.panels_used ? k->panels != nullptr : k->numeric || pivots == Pivots::None);
    if (good) static_cast<KluPairState &>(*k) = state;
    k->values = 0; /* of a matrix before this one */
    *same     = (PetscBool)good;
  }
  PetscCall(KluPairRestoreRows(A, &rows));
  F->factorerrortype = *same ? MAT_FACTOR_NOERROR : MAT_FACTOR_OTHER;
  PetscFunctionReturn(0);
}

/* ---- solve ---- */

static PetscErrorCode Solve(Mat F, Vec b, Vec x, bool transposed)
{
  KluPair     *k = Data(F);
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
  KluPair *k        = Data(F);
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
  KluPair        *k = Data(F);
  LinearRows      rows;
  const PetscInt *order;

  PetscFunctionBegin;
  PetscCall(ReadOptions(F));
  k->given.clear();
  if (row) {
    PetscCall(ISGetIndices(row, &order));
    k->given.assign(order, order + A->rmap->n);
    PetscCall(ISRestoreIndices(row, &order));
  }
  PetscCall(KluPairGetRows(A, &rows));
  PetscCall(Analyse(A, rows, k));
  PetscCall(KluPairRestoreRows(A, &rows));
  F->ops->lufactornumeric = FactorNumeric;
  F->ops->solve           = MatSolve_KLUPair;
  F->ops->solvetranspose  = MatSolveTranspose_KLUPair;
  PetscFunctionReturn(0);
}

/* ---- what can be asked of the factor ---- */

static PetscErrorCode GetSolverType(Mat, MatSolverType *type) { return *type = LINEAR_KLUPAIR, 0; }

static PetscErrorCode GetInfo(Mat F, MatInfoType, MatInfo *info)
{
  const KluPair *k        = Data(F);
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
  const KluPair    *k = Data(F);
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
        k->panels->panel.size(), k->panels->entries, k->panels->flops, k->panels_made));
  else
    PetscCall(PetscViewerASCIIPrintf(viewer, "  no dense panels%s\n",
                                     k->panels_looked ? ": they would not pay" : " looked for"));
  PetscCall(PetscViewerASCIIPrintf(viewer,
                                   "  analyses: %" PetscInt_FMT ", factorizations with pivoting: %" PetscInt_FMT
                                   ", with old pivots: %" PetscInt_FMT ", of these given up: %" PetscInt_FMT "\n",
                                   k->analyses, k->factorizations, k->refactorizations + k->rejected, k->rejected));
  PetscFunctionReturn(0);
}

/* ---- create and destroy ---- */

static PetscErrorCode Destroy(Mat F)
{
  KluPair *k = Data(F);

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
  F->assembled             = PETSC_TRUE; /* so that -ksp_view shows it */
  F->canuseordering        = PETSC_TRUE;
  F->ops->lufactorsymbolic = FactorSymbolic;
  F->ops->getinfo          = GetInfo;
  F->ops->view             = View;
  F->ops->destroy          = Destroy;
  PetscCall(PetscFree(F->solvertype));
  PetscCall(PetscStrallocpy(LINEAR_KLUPAIR, &F->solvertype));
  PetscCall(PetscStrallocpy(MATORDERINGEXTERNAL, (char **)&F->preferredordering[type]));
  PetscCall(PetscObjectComposeFunction((PetscObject)F, "MatFactorGetSolverType_C", GetSolverType));
  PetscCall(PetscObjectComposeFunction((PetscObject)F, LINEAR_SAVE_STATE, SaveState));
  PetscCall(PetscObjectComposeFunction((PetscObject)F, LINEAR_LOAD_STATE, LoadState));
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
