/* "klupair": the numeric factorization, which keeps its pivots from one matrix to the next while they are good, and its state */
#include "klupair.h"

#if defined(HHTDAE_HAVE_KLU)
#include "klupair_data.h"
#include "klupair_panels.h"
#include "linear.h"
#include <algorithm>

/* Old pivots are kept while entries grow at most so many times as much as with the pivots chosen for their own matrix
 */
static const double GROWTH = 100;

/* Pivots as planned are good enough where no entry grows more than so (the reciprocal) */
static const double PLANNED_GROWTH = 0.01;

/* Entries that have grown so much (the reciprocal) have half the digits of the matrix at best: then the largest pivots
   are taken, whatever was planned. KluPair.PivotsAsPlannedThatLetEntriesGrow; scenes stay above 1e-6. */
static const double LEAST_GROWTH = 1e-8;

PetscErrorCode KluPairAnalyseValues(Mat A, const LinearRows &rows, KluPair *k)
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
  PetscCall(PetscInfo(F, "%zu panels with %g entries, %g operations; estimated cost %g, of KLU %g operations of a dense product\n", p.panel.size(),
                      p.entries, p.flops, p.cost, p.klu_cost));
  PetscFunctionReturn(0);
}

static PetscErrorCode FindPanels(Mat F, const LinearRows &rows, KluPair *k)
{
  bool pays;

  PetscFunctionBegin;
  if (k->panels_looked || !PanelsAllowed(k)) PetscFunctionReturn(0);
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
  KluPair *k = KluPairOf(F);
  double   growth;

  PetscFunctionBegin;
  *good = false;
  if (!k->factored() || !k->refactor) PetscFunctionReturn(0);
  if (k->rejected <= k->refactorizations) PetscCall(FindPanels(F, rows, k)); /* else pivots are not kept for long */
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
  KluPair *k = KluPairOf(F);

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
  KluPair         *k = KluPairOf(F);
  PetscObjectState values;

  PetscFunctionBegin;
  if (!k->numeric) PetscFunctionReturn(0);
  const double entries = (double)k->numeric->lnz + (double)k->numeric->unz;
  PetscCall(PetscObjectStateGet((PetscObject)A, &values));
  if (entries <= k->tolerated || values == k->values) PetscFunctionReturn(0);
  PetscCall(PetscInfo(F, "%g entries in L and U, %g were foreseen: the pivots are planned anew\n", entries,
                      2 * k->work.factor));
  PetscCall(KluPairAnalyseValues(A, rows, k));
  PetscCall(FactorWithPivoting(F, rows, k));
  /* where a new plan does not help, it is not tried again for the same fill */
  if (k->numeric) k->tolerated = PetscMax(k->tolerated, 1.5 * ((double)k->numeric->lnz + (double)k->numeric->unz));
  PetscFunctionReturn(0);
}

/* Solves go by panels in half the time of KLU's, so that for hundreds of them the factorization is made again at once with the pivots just found
   (KluPairPanels.AtOnceForManySolves) */
static PetscErrorCode PanelsForManySolves(Mat F, Mat A, const LinearRows &rows)
{
  KluPair  *k = KluPairOf(F);
  PetscBool often;
  double    growth;

  PetscFunctionBegin;
  PetscCall(LinearSolvesOften(A, &often));
  if (!often || !k->numeric || !k->refactor || k->growth <= 0) PetscFunctionReturn(0);
  PetscCall(FindPanels(F, rows, k));
  if (!k->panels) PetscFunctionReturn(0);
  PetscCall(FactorWithOldPivots(rows, k, &growth));
  k->old_pivots = growth > 0 && growth * GROWTH >= k->growth;
  if (k->old_pivots) PetscFunctionReturn(0);
  k->panels.reset();
  k->panels_used = false; /* the values of `numeric` are those of this matrix */
  PetscFunctionReturn(0);
}

static PetscErrorCode ReportError(Mat F, Mat A)
{
  KluPair *k = KluPairOf(F);

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
  k->old_pivots = good;
  if (!good) PetscCall(FactorAsPlanned(F, rows, &good));
  if (!good) {
    PetscCall(FactorWithPivoting(F, rows, k));
    PetscCall(PlanAnew(F, A, rows));
    PetscCall(PanelsForManySolves(F, A, rows));
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
  archive->list(k->analysed);
  archive->list(k->pivoted);
  PetscFunctionReturn(0);
}

/* The pivots again from the matrix that they were found with, and the panels that had been built for them */
static PetscErrorCode RepeatPivots(Mat F, const LinearRows &rows, Pivots pivots, bool panels, bool *good)
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
    PetscCall(KluPairAnalyseValues(A, old, k));
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

#endif
