/* "kluparts": the numeric factorization, which moves unknowns to the interface where an interior is singular, and its state */
#include "kluparts.h"

#if defined(HHTDAE_HAVE_KLU)
#include "kluparts_data.h"
#include "linear.h"
#include <algorithm>

/* A residual above this part of the terms that a row sums up is not rounding */
static const PetscReal RESIDUAL = 1e-8;

/* An interior is nearly singular from this size of its inverse on, rows and columns scaled to one: half of the digits
   are lost. It counts if the residual is bad; from the second on, only rounding lies between the interior and a
   singular one. */
static const PetscReal NEARLY_SINGULAR = 1e8, SINGULAR = 1e14;

/* KLU's measure of the pivots may fall so far before a solve is looked at again */
static const PetscReal RCOND_FALL = 1e-3;

/* Unknowns are moved so many times, each time at least one; the interface does not grow beyond this by it */
static const PetscInt ROUNDS = 20, LARGEST = 4000;

namespace
{

/* How it went on the ranks: the worst error other than a zero pivot, the first row with a zero pivot, wishes */
struct Outcome {
  PetscInt error, singular, check, anew;
};

} // namespace

static PetscErrorCode FactorInner(KluParts *p, Outcome *all)
{
  MatFactorInfo  info;
  MatFactorError error = MAT_FACTOR_NOERROR;
  Outcome        mine  = {0, 0, 0, 0};
  KluPair       *k     = p->klu;

  PetscFunctionBegin;
  if (k) {
    PetscCall(MatFactorInfoInitialize(&info));
    PetscCall(PetscObjectStateIncrease((PetscObject)p->inner));
    PetscCall(MatLUFactorNumeric(p->factor, p->inner, &info));
    PetscCall(MatFactorGetError(p->factor, &error));
    mine.singular = error == MAT_FACTOR_NUMERIC_ZEROPIVOT || error == MAT_FACTOR_STRUCT_ZEROPIVOT;
    mine.error    = mine.singular ? 0 : (PetscInt)error;
    mine.anew     = k->factorizations != p->factorizations;
    mine.check    = !error && (mine.anew || k->common.rcond < RCOND_FALL * p->checked_rcond);
  } else
    mine.anew = p->factorizations == 0;
  PetscCallMPI(MPI_Allreduce(&mine, all, 4, MPIU_INT, MPI_MAX, p->comm));
  if (!error && mine.anew) {
    PetscCall(PartsFindReach(p));
    p->factorizations = k ? k->factorizations : 1;
  }
  PetscFunctionReturn(0);
}

static PetscErrorCode ReportZeroPivot(Mat F, Mat A, PetscInt row)
{
  PetscFunctionBegin;
  PetscCheck(!A->erroriffailure, PetscObjectComm((PetscObject)F), PETSC_ERR_MAT_LU_ZRPVT,
             "The matrix with %" PetscInt_FMT " rows is singular: there is no pivot in row %" PetscInt_FMT, A->rmap->N,
             row);
  PetscCall(PetscInfo(F, "Zero pivot in row %" PetscInt_FMT "\n", row));
  F->factorerrortype             = MAT_FACTOR_NUMERIC_ZEROPIVOT;
  F->factorerror_zeropivot_row   = row;
  F->factorerror_zeropivot_value = 0;
  PetscFunctionReturn(0);
}

static PetscErrorCode ReportError(Mat F, Mat A, MatFactorError error)
{
  PetscFunctionBegin;
  PetscCheck(
      !A->erroriffailure, PetscObjectComm((PetscObject)F), error == MAT_FACTOR_OUTMEMORY ? PETSC_ERR_MEM : PETSC_ERR_FP,
      error == MAT_FACTOR_OUTMEMORY ? "There is not enough memory to factor the matrix with %" PetscInt_FMT " rows"
                                    : "The matrix with %" PetscInt_FMT " rows or its factors are not finite",
      A->rmap->N);
  PetscCall(PetscInfo(F, "The factorization failed: error %d\n", (int)error));
  F->factorerrortype = error;
  PetscFunctionReturn(0);
}

/* Global rows that leave the interiors, with the first of them; *moved = PETSC_FALSE where there are none or too many
 */
static PetscErrorCode Move(KluParts *p, std::vector<PetscInt> rows, PetscBool *moved, PetscInt *first)
{
  std::vector<PetscInt> all;

  PetscFunctionBegin;
  for (PetscInt &row : rows) row += p->split.begin;
  PetscCall(PartsGather(p->comm, rows, &all));
  *first = all.empty() ? -1 : all.front();
  *moved = !all.empty() && (PetscInt)(p->split.interface.size() + all.size()) <=
                               PetscMax(LARGEST, 2 * (PetscInt)p->split.interface.size())
               ? PETSC_TRUE
               : PETSC_FALSE;
  if (*moved) p->moved.insert(p->moved.end(), all.begin(), all.end());
  PetscFunctionReturn(0);
}

/* After pivots were chosen anew: whether the interiors are regular; *again if unknowns have left them */
static PetscErrorCode Check(Mat F, bool last, bool *again)
{
  KluParts             *p = PartsOf(F);
  std::vector<PetscInt> move;
  PetscReal             inverse;
  PetscInt              row;
  PetscBool             moved;

  PetscFunctionBegin;
  PetscCall(PartsResidual(p, &p->residual));
  PetscCall(PartsNearNull(p, p->residual > RESIDUAL ? NEARLY_SINGULAR : SINGULAR, &inverse, &move));
  if (p->klu) p->checked_rcond = p->klu->common.rcond;
  PetscCall(PetscInfo(p->inner ? (PetscObject)p->inner : (PetscObject)F,
                      "Residual of a solve %g; inverse of the scaled interior %g\n", (double)p->residual,
                      (double)inverse));
  if (last) PetscFunctionReturn(0);
  PetscCall(Move(p, move, &moved, &row));
  *again = moved;
  PetscFunctionReturn(0);
}

/* One attempt with the interface as it is; *again where it has been made larger */
static PetscErrorCode Attempt(Mat F, Mat A, bool last, bool *again)
{
  KluParts             *p = PartsOf(F);
  Outcome               o;
  std::vector<PetscInt> move;
  PetscReal             inverse;
  PetscInt              row, first;
  PetscBool             finite, moved = PETSC_FALSE;

  PetscFunctionBegin;
  *again = false;
  PetscCall(PartsCopyValues(A, &p->split));
  PetscCall(FactorInner(p, &o));
  if (o.error) {
    PetscCall(ReportError(F, A, (MatFactorError)o.error));
    PetscFunctionReturn(0);
  }
  if (o.singular) {
    if (p->factor && p->factor->factorerrortype) PetscCall(PartsAfterFailure(p, &move));
    PetscCall(Move(p, move, &moved, &row));
    if (last || !moved)
      PetscCall(ReportZeroPivot(F, A, row));
    else
      *again = true;
    PetscFunctionReturn(0);
  }
  PetscCall(PartsFactorSchur(p, &row, &finite));
  if (!finite || row >= 0) {
    /* an interior that is singular but for rounding makes all others small in the Schur complement (tests/python, Ranks.test_driven_whole_body) */
    if (!last && p->check) {
      PetscCall(PartsNearNull(p, NEARLY_SINGULAR, &inverse, &move));
      PetscCall(Move(p, move, &moved, &first));
    }
    if (moved)
      *again = true;
    else if (!finite)
      PetscCall(ReportError(F, A, MAT_FACTOR_OTHER));
    else
      PetscCall(ReportZeroPivot(F, A, p->split.interface[row]));
    PetscFunctionReturn(0);
  }
  if (o.check && p->check) PetscCall(Check(F, last, again));
  PetscFunctionReturn(0);
}

PetscErrorCode PartsFactorNumeric(Mat F, Mat A, const MatFactorInfo *)
{
  KluParts        *p = PartsOf(F);
  PetscObjectId    id;
  PetscObjectState pattern;
  bool             again = true;

  PetscFunctionBegin;
  F->factorerrortype = MAT_FACTOR_NOERROR;
  PetscCall(PetscObjectGetId((PetscObject)A, &id));
  PetscCall(MatGetNonzeroState(A, &pattern));
  if (id != p->matrix || pattern != p->pattern) {
    p->moved.clear();
    PetscCall(PartsAnalyse(F, A, p));
  }
  for (PetscInt round = 1; again; ++round) {
    PetscCall(Attempt(F, A, round > ROUNDS, &again));
    if (again) PetscCall(PartsAnalyse(F, A, p));
  }
  F->assembled = PETSC_TRUE;
  PetscFunctionReturn(0);
}

PetscErrorCode PartsSaveState(Mat F, Archive *archive)
{
  KluParts     *p     = PartsOf(F);
  KluPartsState state = *p;

  PetscFunctionBegin;
  archive->plain(state);
  archive->list(p->moved);
  if (p->factor) PetscTryMethod(p->factor, LINEAR_SAVE_STATE, (Mat, Archive *), (p->factor, archive));
  PetscFunctionReturn(0);
}

/* The same interface, the interior's factor as it was, and from both the Schur complement */
PetscErrorCode PartsLoadState(Mat F, Mat A, Archive *archive, PetscBool *same)
{
  KluParts     *p = PartsOf(F);
  KluPartsState state;
  PetscInt      row, rows;
  PetscBool     finite;

  PetscFunctionBegin;
  archive->plain(state);
  archive->list(p->moved);
  PetscCall(MatGetSize(A, &rows, NULL));
  for (const PetscInt i : p->moved) archive->good = archive->good && i >= 0 && i < rows;
  *same = (PetscBool)archive->good;
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, same, 1, MPIU_BOOL, MPI_LAND, p->comm));
  if (!*same) p->moved.clear();
  PetscCall(PartsAnalyse(F, A, p));
  if (*same && p->factor)
    PetscTryMethod(p->factor, LINEAR_LOAD_STATE, (Mat, Mat, Archive *, PetscBool *), (p->factor, p->inner, archive, same));
  if (p->klu && !p->klu->numeric) *same = PETSC_FALSE;
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, same, 1, MPIU_BOOL, MPI_LAND, p->comm));
  F->factorerrortype = MAT_FACTOR_OTHER;
  p->matrix          = 0; /* looked at anew unless all goes well */
  if (!*same) PetscFunctionReturn(0);
  static_cast<KluPartsState &>(*p) = state;
  PetscCall(PartsFindReach(p));
  PetscCall(PartsFactorSchur(p, &row, &finite));
  *same = (PetscBool)(finite && row < 0);
  if (!*same) PetscFunctionReturn(0);
  F->factorerrortype = MAT_FACTOR_NOERROR;
  PetscCall(PetscObjectGetId((PetscObject)A, &p->matrix));
  PetscFunctionReturn(0);
}

#endif
