/* "klupair": the numeric factorization, which keeps its pivots from one matrix to the next while element growth stays small, and its state for checkpoints */
#include "klupair.h"

#if defined(HHTDAE_HAVE_KLU)
#include "klupair_data.h"
#include "klupair_panels.h"
#include "linear.h"
#include <algorithm>

/* Old pivots are given up when element growth exceeds this multiple of the growth with the matrix they were chosen for.
   KluPair.GivesUpBadPivots. */
static const double MAX_GROWTH_RATIO = 100;

/* A first factorization by panels, with the planned pivots, is accepted if the reciprocal growth is at least this; else KLU
   chooses pivots */
static const double MIN_RECIPROCAL_GROWTH_PLANNED = 0.01;

/* Below this reciprocal growth U retains at best half of the digits of the matrix: KLU then factors again with partial
   pivoting, regardless of the planned pivots. KluPair.PivotsAsPlannedThatLetEntriesGrow; scenes stay above 1e-6. */
static const double MIN_RECIPROCAL_GROWTH = 1e-8;

PetscErrorCode KluPairAnalyseValues(Mat A, const LinearRows &rows, KluPair *k)
{
  PetscFunctionBegin;
  PetscCall(KluPairAnalyse(A, rows, k));
  k->panels.reset();
  k->panels_tried = k->panels_used = k->plan_tried = false;
  k->analysed_values.assign(rows.val, rows.val + rows.start[rows.n]);
  k->pivot_values.clear();
  k->start.assign(rows.start, rows.start + rows.n + 1);
  k->col.assign(rows.col, rows.col + rows.start[rows.n]);
  PetscCall(PetscObjectGetId((PetscObject)A, &k->matrix));
  PetscCall(MatGetNonzeroState(A, &k->pattern_state));
  PetscCall(PetscObjectStateGet((PetscObject)A, &k->value_state));
  PetscFunctionReturn(0);
}

/* Compares the patterns entry by entry only if PETSc's states do not show that the pattern is the one analysed */
static PetscErrorCode SamePattern(Mat A, const LinearRows &rows, KluPair *k, bool *same)
{
  PetscObjectId    id;
  PetscObjectState pattern_state;

  PetscFunctionBegin;
  PetscCall(PetscObjectGetId((PetscObject)A, &id));
  PetscCall(MatGetNonzeroState(A, &pattern_state));
  *same = id == k->matrix && pattern_state == k->pattern_state;
  if (*same) PetscFunctionReturn(0);
  *same = (size_t)rows.n + 1 == k->start.size() && std::equal(k->start.begin(), k->start.end(), rows.start) &&
          std::equal(k->col.begin(), k->col.end(), rows.col);
  k->matrix        = id;
  k->pattern_state = pattern_state;
  PetscFunctionReturn(0);
}

static KluInt *Start(const LinearRows &r) { return KluIndices(r.start); }
static KluInt *Col(const LinearRows &r) { return KluIndices(r.col); }
static double *Val(const LinearRows &r) { return const_cast<double *>(r.val); }

/* Smallest ratio, over columns, of the largest entry of the matrix to the largest of U; 0 if a pivot is zero or not finite */
static double ReciprocalGrowth(const LinearRows &rows, KluPair *k)
{
  if (!KLU(rcond)(k->symbolic, k->numeric, &k->common) || !(k->common.rcond > 0)) return 0;
  if (!KLU(rgrowth)(Start(rows), Col(rows), Val(rows), k->symbolic, k->numeric, &k->common)) return 0;
  return k->common.rgrowth;
}

/* Panels do not implement row scaling, and "kluparts" reads KLU's own factors */
static bool PanelsAllowed(const KluPair *k) { return k->panels_wanted && !k->single_block && !(k->common.scale > 0); }

static PetscErrorCode ReportPanels(Mat F, const KluPanels &p)
{
  PetscFunctionBegin;
  PetscCall(PetscInfo(F, "%zu panels with %g entries, %g operations; estimated cost %g, of KLU %g operations of a dense product\n", p.panel.size(),
                      p.entries, p.flops, p.panel_cost, p.klu_cost));
  PetscFunctionReturn(0);
}

/* Builds panels for the pivots of `numeric`, once for each choice of pivots, if they pay */
static PetscErrorCode FindPanels(Mat F, const LinearRows &rows, KluPair *k)
{
  bool pays;

  PetscFunctionBegin;
  if (k->panels_tried || !PanelsAllowed(k)) PetscFunctionReturn(0);
  k->panels_tried = true;
  k->panels       = std::make_shared<KluPanels>();
  PetscCall(KluPanelsBuild(rows, k, k->panels.get(), &pays));
  PetscCall(ReportPanels(F, *k->panels));
  if (!pays) k->panels.reset();
  PetscFunctionReturn(0);
}

/* Factors with the old pivots, by panels or by klu_refactor(); *reciprocal_growth = 0 if a pivot is zero or not finite */
static PetscErrorCode FactorWithOldPivots(const LinearRows &rows, KluPair *k, double *reciprocal_growth)
{
  PetscFunctionBegin;
  *reciprocal_growth = 0;
  k->panels_used     = k->panels != nullptr;
  if (k->panels_used) {
    PetscCall(KluPanelsFactor(rows, k->panels.get(), reciprocal_growth));
    ++k->panel_factorizations;
  } else if (KLU(refactor)(Start(rows), Col(rows), Val(rows), k->symbolic, k->numeric, &k->common) &&
             k->common.status == KLU_OK)
    *reciprocal_growth = ReciprocalGrowth(rows, k);
  PetscFunctionReturn(0);
}

static PetscErrorCode Refactor(Mat F, const LinearRows &rows, bool *good)
{
  KluPair *k = KluPairOf(F);
  double   reciprocal_growth;

  PetscFunctionBegin;
  *good = false;
  if (!k->factored() || !k->refactor) PetscFunctionReturn(0);
  if (k->rejected <= k->refactorizations) PetscCall(FindPanels(F, rows, k)); /* panels do not pay if pivots are mostly given up */
  PetscCall(FactorWithOldPivots(rows, k, &reciprocal_growth));
  *good = reciprocal_growth > 0 && reciprocal_growth * MAX_GROWTH_RATIO >= k->reciprocal_growth;
  PetscCall(
      PetscInfo(F, "Old pivots %s: reciprocal growth %g, was %g\n", *good ? "kept" : "given up", reciprocal_growth, k->reciprocal_growth));
  if (*good)
    ++k->refactorizations;
  else
    ++k->rejected;
  PetscFunctionReturn(0);
}

/* Stores the values that the pivots are chosen for, unless they are the analysed ones, as is mostly the case */
static void StorePivotValues(const LinearRows &rows, KluPair *k)
{
  if (std::equal(k->analysed_values.begin(), k->analysed_values.end(), rows.val))
    k->pivot_values.clear();
  else
    k->pivot_values.assign(rows.val, rows.val + rows.start[rows.n]);
}

/* The first factorization after an analysis: by panels with the planned pivots, if panels pay even before KLU has factored */
static PetscErrorCode FactorAsPlanned(Mat F, const LinearRows &rows, bool *good)
{
  KluPair *k = KluPairOf(F);

  PetscFunctionBegin;
  *good = false;
  if (k->factored() || k->plan_tried || !k->refactor || !PanelsAllowed(k)) PetscFunctionReturn(0);
  k->plan_tried     = true;
  const auto panels = std::make_shared<KluPanels>();
  KluPanelsPlan(rows, *k, panels.get(), good);
  if (!*good) PetscFunctionReturn(0);
  PetscCall(ReportPanels(F, *panels));
  PetscCall(KluPanelsFactor(rows, panels.get(), &k->reciprocal_growth));
  *good = k->reciprocal_growth >= MIN_RECIPROCAL_GROWTH_PLANNED;
  PetscCall(PetscInfo(F, "Pivots as planned %s: reciprocal growth %g\n", *good ? "taken" : "not good enough", k->reciprocal_growth));
  if (!*good) PetscFunctionReturn(0);
  StorePivotValues(rows, k);
  k->panels       = panels;
  k->panels_tried = k->panels_used = true;
  ++k->panel_factorizations;
  ++k->factorizations;
  PetscFunctionReturn(0);
}

/* KLU's factorization; planned pivots stay if they are at least `tolerance` times the largest entry of their column */
static PetscErrorCode FactorWithTolerance(const LinearRows &rows, KluPair *k, double tolerance)
{
  const double user_tolerance = k->common.tol;

  PetscFunctionBegin;
  KLU(free_numeric)(&k->numeric, &k->common);
  k->common.tol = tolerance;
  k->numeric    = KLU(factor)(Start(rows), Col(rows), Val(rows), k->symbolic, &k->common);
  k->common.tol = user_tolerance;
  ++k->factorizations;
  if (!k->numeric) PetscFunctionReturn(0);
  KLU(sort)(k->symbolic, k->numeric, &k->common);
  KLU(flops)(k->symbolic, k->numeric, &k->common);
  k->reciprocal_growth = ReciprocalGrowth(rows, k);
  PetscFunctionReturn(0);
}

static PetscErrorCode FactorWithPivoting(Mat F, const LinearRows &rows, KluPair *k)
{
  PetscFunctionBegin;
  StorePivotValues(rows, k);
  k->panels.reset();
  k->panels_tried = k->panels_used = false;
  PetscCall(FactorWithTolerance(rows, k, k->common.tol));
  if (!k->numeric || k->reciprocal_growth >= MIN_RECIPROCAL_GROWTH) PetscFunctionReturn(0);
  PetscCall(PetscInfo(F, "Pivots found with tolerance %g let entries grow (reciprocal %g): the largest are taken\n",
                      k->common.tol, k->reciprocal_growth));
  PetscCall(FactorWithTolerance(rows, k, 1));
  PetscFunctionReturn(0);
}

/* Plans pivots anew if there is much more fill than predicted and the values have changed since the analysis */
static PetscErrorCode PlanAnew(Mat F, Mat A, const LinearRows &rows)
{
  KluPair         *k = KluPairOf(F);
  PetscObjectState value_state;

  PetscFunctionBegin;
  if (!k->numeric) PetscFunctionReturn(0);
  const double entries = (double)k->numeric->lnz + (double)k->numeric->unz;
  PetscCall(PetscObjectStateGet((PetscObject)A, &value_state));
  if (entries <= k->replan_entries || value_state == k->value_state) PetscFunctionReturn(0);
  PetscCall(PetscInfo(F, "%g entries in L and U, %g were foreseen: the pivots are planned anew\n", entries,
                      2 * k->work.factor));
  PetscCall(KluPairAnalyseValues(A, rows, k));
  PetscCall(FactorWithPivoting(F, rows, k));
  /* a plan that does not reduce the fill is not repeated for the same fill */
  if (k->numeric) k->replan_entries = PetscMax(k->replan_entries, 1.5 * ((double)k->numeric->lnz + (double)k->numeric->unz));
  PetscFunctionReturn(0);
}

/* Solves with panels take half the time of KLU's. If hundreds of solves follow, the matrix is factored again by panels at once, with the pivots that KLU
   has just chosen (KluPairPanels.AtOnceForManySolves). */
static PetscErrorCode SwitchToPanelsForManySolves(Mat F, Mat A, const LinearRows &rows)
{
  KluPair  *k = KluPairOf(F);
  PetscBool often;
  double    reciprocal_growth;

  PetscFunctionBegin;
  PetscCall(LinearSolvesOften(A, &often));
  if (!often || !k->numeric || !k->refactor || k->reciprocal_growth <= 0) PetscFunctionReturn(0);
  PetscCall(FindPanels(F, rows, k));
  if (!k->panels) PetscFunctionReturn(0);
  PetscCall(FactorWithOldPivots(rows, k, &reciprocal_growth));
  k->pivots_reused = reciprocal_growth > 0 && reciprocal_growth * MAX_GROWTH_RATIO >= k->reciprocal_growth;
  if (k->pivots_reused) PetscFunctionReturn(0);
  k->panels.reset();
  k->panels_used = false; /* the values of `numeric` are those of this matrix */
  PetscFunctionReturn(0);
}

static PetscErrorCode ReportError(Mat F, Mat A)
{
  KluPair *k = KluPairOf(F);

  PetscFunctionBegin;
  if (k->factored() && k->reciprocal_growth > 0) PetscFunctionReturn(0);
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

PetscErrorCode KluPairFactorNumeric(Mat F, Mat A, const MatFactorInfo *)
{
  KluPair   *k = KluPairOf(F);
  LinearRows rows;
  bool       same, good;

  PetscFunctionBegin;
  F->factorerrortype = MAT_FACTOR_NOERROR;
  PetscCall(KluPairGetRows(A, &rows));
  PetscCall(SamePattern(A, rows, k, &same));
  if (!same) PetscCall(KluPairAnalyseValues(A, rows, k));
  PetscCall(Refactor(F, rows, &good));
  k->pivots_reused = good;
  if (!good) PetscCall(FactorAsPlanned(F, rows, &good));
  if (!good) {
    PetscCall(FactorWithPivoting(F, rows, k));
    PetscCall(PlanAnew(F, A, rows));
    PetscCall(SwitchToPanelsForManySolves(F, A, rows));
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

PetscErrorCode KluPairSaveState(Mat F, Archive *archive)
{
  KluPair     *k      = KluPairOf(F);
  Pivots       pivots = k->numeric ? Pivots::Found : k->panels_used ? Pivots::Planned : Pivots::None;
  bool         panels = k->panels != nullptr;
  KluPairState state  = *k;

  PetscFunctionBegin;
  archive->plain(state);
  archive->plain(pivots);
  archive->plain(panels);
  archive->list(k->analysed_values);
  archive->list(k->pivot_values);
  PetscFunctionReturn(0);
}

/* Restores pivots by factoring the matrix that they were chosen for, and builds the panels that belonged to them */
static PetscErrorCode RestorePivots(Mat F, const LinearRows &rows, Pivots pivots, bool panels, bool *good)
{
  KluPair *k = KluPairOf(F);

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

PetscErrorCode KluPairLoadState(Mat F, Mat A, Archive *archive, PetscBool *same)
{
  KluPair                 *k = KluPairOf(F);
  LinearRows               rows, old;
  KluPairState             state;
  Pivots                   pivots = Pivots::None;
  bool                     panels = false, good;
  std::vector<PetscScalar> analysed_values, pivot_values;
  double                   reciprocal_growth;

  PetscFunctionBegin;
  archive->plain(state);
  archive->plain(pivots);
  archive->plain(panels);
  archive->list(analysed_values);
  archive->list(pivot_values);
  PetscCall(KluPairGetRows(A, &rows));
  const size_t entries = rows.start[rows.n];
  *same                = (PetscBool)(archive->good && analysed_values.size() == entries && (pivot_values.empty() || pivot_values.size() == entries));
  if (*same) {
    old     = rows;
    old.val = analysed_values.data();
    PetscCall(KluPairAnalyseValues(A, old, k));
    if (!pivot_values.empty()) old.val = pivot_values.data();
    PetscCall(RestorePivots(F, old, pivots, panels, &good));
    good = good && (!state.pivots_reused || k->factored());
    if (good && state.pivots_reused) PetscCall(FactorWithOldPivots(rows, k, &reciprocal_growth));
    good = good && (state.panels_used ? k->panels != nullptr : k->numeric || pivots == Pivots::None);
    if (good) static_cast<KluPairState &>(*k) = state;
    k->value_state = 0; /* the analysed values are those of an earlier matrix */
    *same          = (PetscBool)good;
  }
  PetscCall(KluPairRestoreRows(A, &rows));
  F->factorerrortype = *same ? MAT_FACTOR_NOERROR : MAT_FACTOR_OTHER;
  PetscFunctionReturn(0);
}

#endif
