/* "kluparts": the numeric factorization, which moves unknowns to the interface where an interior is singular, and its state */
#include "kluparts.h"

#if defined(HHTDAE_HAVE_KLU)
#include "kluparts_data.h"
#include "linear.h"
#include <algorithm>

/* A larger residual of a solve, relative to the sum of the absolute values of a row's terms, is more than rounding */
static const PetscReal MAX_RESIDUAL = 1e-8;

/* Limits of the norm of the scaled interior's inverse. Above the first one half of the digits are lost: unknowns are moved
   if the residual is bad, too. Above the second one the interior differs from a singular one by rounding only: unknowns are
   moved in any case. */
static const PetscReal MAX_INVERSE_BAD_RESIDUAL = 1e8, MAX_INVERSE = 1e14;

/* With old pivots a solve is checked again if KLU's estimate of the reciprocal condition number falls below this part of its value at the last check */
static const PetscReal RECHECK_RCOND_RATIO = 1e-3;

/* Limits of moving unknowns to the interface: rounds per factorization, and the size that the interface may reach by it (or twice its size, if that is more) */
static const PetscInt MAX_ROUNDS = 20, MAX_GROWN_INTERFACE = 4000;

namespace
{

/* Maxima over the ranks: the error other than a zero pivot, whether there was a zero pivot, whether a solve is to be checked, whether pivots are new */
struct Outcome {
  PetscInt error, singular, check, new_pivots;
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
    mine.singular   = error == MAT_FACTOR_NUMERIC_ZEROPIVOT || error == MAT_FACTOR_STRUCT_ZEROPIVOT;
    mine.error      = mine.singular ? 0 : (PetscInt)error;
    mine.new_pivots = k->factorizations != p->factorizations;
    mine.check      = !error && (mine.new_pivots || k->common.rcond < RECHECK_RCOND_RATIO * p->checked_rcond);
  } else
    mine.new_pivots = p->factorizations == 0;
  PetscCallMPI(MPI_Allreduce(&mine, all, 4, MPIU_INT, MPI_MAX, p->comm));
  if (!error && mine.new_pivots) {
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

/* Moves own rows of all ranks to the interface; *first is the least global row, or -1. *moved = PETSC_FALSE if there are none or too many. */
static PetscErrorCode Move(KluParts *p, std::vector<PetscInt> rows, PetscBool *moved, PetscInt *first)
{
  std::vector<PetscInt> all;

  PetscFunctionBegin;
  for (PetscInt &row : rows) row += p->split.begin;
  PetscCall(PartsGather(p->comm, rows, &all));
  *first = all.empty() ? -1 : all.front();
  *moved = !all.empty() && (PetscInt)(p->split.interface.size() + all.size()) <=
                               PetscMax(MAX_GROWN_INTERFACE, 2 * (PetscInt)p->split.interface.size())
               ? PETSC_TRUE
               : PETSC_FALSE;
  if (*moved) p->moved.insert(p->moved.end(), all.begin(), all.end());
  PetscFunctionReturn(0);
}

/* Checks after a new choice of pivots whether the interiors are regular; *again if unknowns have been moved out of them */
static PetscErrorCode Check(Mat F, bool last, bool *again)
{
  KluParts             *p = PartsOf(F);
  std::vector<PetscInt> move;
  PetscReal             inverse;
  PetscInt              row;
  PetscBool             moved;

  PetscFunctionBegin;
  PetscCall(PartsResidual(p, &p->residual));
  PetscCall(PartsNearNull(p, p->residual > MAX_RESIDUAL ? MAX_INVERSE_BAD_RESIDUAL : MAX_INVERSE, &inverse, &move));
  if (p->klu) p->checked_rcond = p->klu->common.rcond;
  PetscCall(PetscInfo(p->inner ? (PetscObject)p->inner : (PetscObject)F,
                      "Residual of a solve %g; inverse of the scaled interior %g\n", (double)p->residual,
                      (double)inverse));
  if (last) PetscFunctionReturn(0);
  PetscCall(Move(p, move, &moved, &row));
  *again = moved;
  PetscFunctionReturn(0);
}

/* One attempt with the present interface; *again if it has been enlarged */
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
    /* an interior that is singular up to rounding has a huge contribution, beside which all others vanish in the Schur complement (tests/python, Ranks.test_driven_whole_body) */
    if (!last && p->check) {
      PetscCall(PartsNearNull(p, MAX_INVERSE_BAD_RESIDUAL, &inverse, &move));
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
    PetscCall(Attempt(F, A, round > MAX_ROUNDS, &again));
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

/* Restores the interface and the interior's factor, and computes the Schur complement from both */
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
  p->matrix          = 0; /* forces a new analysis unless loading succeeds */
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
