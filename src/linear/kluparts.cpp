/*
  "kluparts": the factor matrix. Option, with the prefix of the solver:
    -mat_kluparts_check <true>   checks the residual of one solve after pivots were chosen anew
  and those of "klupair" for the interiors (klupair.cpp).
*/
#include "kluparts.h"

#if defined(HHTDAE_HAVE_KLU)
#include "kluparts_data.h"
#include "linear.h"
#include <algorithm>

/* ---- analysis ---- */

static PetscErrorCode Reset(KluParts *p)
{
  PetscFunctionBegin;
  PetscCall(MatDestroy(&p->factor));
  PetscCall(MatDestroy(&p->inner));
  p->klu            = NULL;
  p->split          = PartsSplit();
  p->factorizations = 0;
  p->checked_rcond  = 0;
  PetscFunctionReturn(0);
}

/* Creates the interior's matrix and factor; it has the options of F, unless F is NULL */
static PetscErrorCode AnalyseInner(Mat F, KluParts *p)
{
  MatFactorInfo info;

  PetscFunctionBegin;
  if (p->split.inner_row.empty()) PetscFunctionReturn(0);
  PetscCall(PartsInnerMatrix(&p->split, &p->inner));
  PetscCall(LinearKLUPairFactor(p->inner, MAT_FACTOR_LU, &p->factor));
  p->klu = static_cast<KluPair *>(p->factor->data);
  if (F) {
    PetscCall(MatSetOptionsPrefix(p->factor, ((PetscObject)F)->prefix));
    PetscCall(PetscObjectSetOptions((PetscObject)p->factor, ((PetscObject)F)->options));
  }
  p->klu->coupled_unknowns = PartsCoupledUnknowns(p->split);
  p->klu->interface_size   = (PetscInt)p->split.local.size();
  p->klu->single_block     = true;
  PetscCall(MatFactorInfoInitialize(&info));
  PetscCall(MatLUFactorSymbolic(p->factor, p->inner, NULL, NULL, &info));
  PetscFunctionReturn(0);
}

/* Interface and interiors for the pattern and values of A */
static PetscErrorCode FindSplit(Mat A, KluParts *p)
{
  PetscFunctionBegin;
  PetscCall(Reset(p));
  PetscCall(PartsFindInterface(A, p->moved, &p->split.interface));
  PetscCall(PartsBuildSplit(A, &p->split));
  PetscCall(PartsCopyValues(A, &p->split));
  ++p->splits;
  PetscCall(PetscInfo(A, "Interface of %zu unknowns, %zu of them moved there; interior of %zu\n",
                      p->split.interface.size(), p->moved.size(), p->split.inner_row.size()));
  PetscFunctionReturn(0);
}

PetscErrorCode PartsAnalyse(Mat F, Mat A, KluParts *p)
{
  PetscFunctionBegin;
  PetscCall(FindSplit(A, p));
  PetscCall(AnalyseInner(F, p));
  PetscCall(PetscObjectGetId((PetscObject)A, &p->matrix));
  PetscCall(MatGetNonzeroState(A, &p->pattern));
  PetscFunctionReturn(0);
}

static PetscErrorCode CheckType(Mat A, PetscBool *yes)
{
  PetscFunctionBegin;
  PetscCall(PetscObjectBaseTypeCompare((PetscObject)A, MATMPIAIJ, yes));
  PetscFunctionReturn(0);
}

static PetscErrorCode Create(Mat A, KluParts **parts)
{
  KluParts *p = new KluParts();

  PetscFunctionBegin;
  PetscCall(PetscCommGetComm(PetscObjectComm((PetscObject)A), &p->comm));
  PetscCallMPI(MPI_Comm_rank(p->comm, &p->rank));
  PetscCallMPI(MPI_Comm_size(p->comm, &p->size));
  *parts = p;
  PetscFunctionReturn(0);
}

static PetscErrorCode Delete(MPI_Comm comm, KluParts *p)
{
  PetscFunctionBegin;
  PetscCall(Reset(p));
  PetscCall(PetscCommRestoreComm(comm, &p->comm));
  delete p;
  PetscFunctionReturn(0);
}

static void CountInner(const KluParts &p, double count[5])
{
  const double w = (double)p.split.local.size();
  if (!p.klu) return;
  count[0] = (double)p.split.inner_row.size();
  count[1] = p.klu->work.factor;
  count[2] = p.klu->work.flops;
  count[3] = 2 * p.klu->reached_entries * w;
  count[4] = p.klu->reached_columns * w * w;
}

PetscErrorCode LinearPartsCount(Mat A, double max_couplings, PetscInt max_interface, LinearPartsWork *work)
{
  KluParts *p;
  double    count[5] = {0, 0, 0, 0, 0};

  PetscFunctionBegin;
  *work = LinearPartsWork();
  PetscCall(CheckType(A, &work->possible));
  if (!work->possible) PetscFunctionReturn(0);
  PetscCall(PartsCountCouplings(A, &work->couplings));
  work->possible = work->couplings <= max_couplings ? PETSC_TRUE : PETSC_FALSE;
  if (!work->possible) PetscFunctionReturn(0);
  PetscCall(Create(A, &p));
  PetscCall(FindSplit(A, p));
  work->interface = (PetscInt)p->split.interface.size();
  work->possible  = work->interface <= max_interface ? PETSC_TRUE : PETSC_FALSE;
  if (work->possible) {
    PetscCall(AnalyseInner(NULL, p));
    CountInner(*p, count);
    PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, count, 5, MPI_DOUBLE, MPI_MAX, p->comm));
  }
  work->unknowns = count[0];
  work->factor   = count[1];
  work->flops    = count[2];
  work->sweeps   = count[3];
  work->products = count[4];
  PetscCall(Delete(PetscObjectComm((PetscObject)A), p));
  PetscFunctionReturn(0);
}

/* ---- solve ---- */

static PetscErrorCode MatSolve_KLUParts(Mat F, Vec b, Vec x)
{
  const PetscScalar *from;
  PetscScalar       *to;

  PetscFunctionBegin;
  if (F->factorerrortype) {
    PetscCall(PetscInfo(F, "Solve with a factor that failed: the result is Inf\n"));
    PetscCall(VecSet(x, PETSC_INFINITY));
    PetscFunctionReturn(0);
  }
  PetscCall(VecGetArrayRead(b, &from));
  PetscCall(VecGetArrayWrite(x, &to));
  PetscCall(PartsSolve(PartsOf(F), from, to));
  PetscCall(VecRestoreArrayWrite(x, &to));
  PetscCall(VecRestoreArrayRead(b, &from));
  PetscFunctionReturn(0);
}

/* An error on purpose: without this function PETSc 3.18 would solve with A in place of A^T if the symmetry of A is unknown */
static PetscErrorCode MatSolveTranspose_KLUParts(Mat F, Vec, Vec)
{
  PetscFunctionBegin;
  SETERRQ(PetscObjectComm((PetscObject)F), PETSC_ERR_SUP,
          "Solver type %s does not solve with the transpose; choose another one", LINEAR_KLUPARTS);
}

static PetscErrorCode FactorSymbolic(Mat F, Mat A, IS, IS, const MatFactorInfo *)
{
  KluParts *p = PartsOf(F);

  PetscFunctionBegin;
  PetscObjectOptionsBegin((PetscObject)F);
  PetscCall(PetscOptionsBool("-mat_kluparts_check", "Look at the residual of one solve after pivots were chosen anew",
                             "None", p->check, &p->check, NULL));
  PetscOptionsEnd();
  p->moved.clear();
  PetscCall(PartsAnalyse(F, A, p));
  F->ops->lufactornumeric = PartsFactorNumeric;
  F->ops->solve           = MatSolve_KLUParts;
  F->ops->solvetranspose  = MatSolveTranspose_KLUParts;
  PetscFunctionReturn(0);
}

/* ---- information and view ---- */

static PetscErrorCode GetSolverType(Mat, MatSolverType *type) { return *type = LINEAR_KLUPARTS, 0; }

static double Entries(const KluParts *p)
{
  const KluPair *k = p->klu;
  const double   w = (double)p->split.local.size(), N = (double)p->split.interface.size();
  double         entries = p->rank == 0 ? N * N : 0;
  if (k && k->numeric)
    entries += (double)k->numeric->lnz + (double)k->numeric->unz - (double)k->start.size() + 1 +
               2 * w * (double)p->reach.size();
  else if (k)
    entries += 2 * k->work.factor;
  return entries;
}

/* This rank's part for MAT_LOCAL; sum or maximum over the ranks otherwise */
static PetscErrorCode GetInfo(Mat F, MatInfoType type, MatInfo *info)
{
  const KluParts *p          = PartsOf(F);
  double          entries[2] = {Entries(p), (double)p->split.col.size()};

  PetscFunctionBegin;
  PetscCall(PetscMemzero(info, sizeof *info));
  if (type != MAT_LOCAL)
    PetscCallMPI(
        MPI_Allreduce(MPI_IN_PLACE, entries, 2, MPI_DOUBLE, type == MAT_GLOBAL_SUM ? MPI_SUM : MPI_MAX, p->comm));
  info->block_size   = 1;
  info->nz_allocated = info->nz_used = entries[0];
  info->fill_ratio_needed            = entries[0] / PetscMax(entries[1], 1.0);
  PetscFunctionReturn(0);
}

static PetscErrorCode View(Mat F, PetscViewer viewer)
{
  const KluParts   *p = PartsOf(F);
  const KluPair    *k = p->klu;
  PetscBool         ascii;
  PetscViewerFormat format;
  double            largest[3] = {(double)p->split.inner_row.size(), k ? k->work.flops : 0, (double)p->reach.size()};

  PetscFunctionBegin;
  PetscCall(PetscObjectTypeCompare((PetscObject)viewer, PETSCVIEWERASCII, &ascii));
  if (!ascii) PetscFunctionReturn(0);
  PetscCall(PetscViewerGetFormat(viewer, &format));
  if (format != PETSC_VIEWER_ASCII_INFO && format != PETSC_VIEWER_ASCII_INFO_DETAIL) PetscFunctionReturn(0);
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, largest, 3, MPI_DOUBLE, MPI_MAX, p->comm));
  PetscCall(PetscViewerASCIIPrintf(viewer, "KLU on every rank, interface of %zu unknowns, %zu of them moved there\n",
                                   p->split.interface.size(), p->moved.size()));
  PetscCall(PetscViewerASCIIPrintf(viewer,
                                   "  largest interior: %g unknowns, %g operations foreseen, %g columns reached\n",
                                   largest[0], 2 * largest[1], largest[2]));
  if (k)
    PetscCall(PetscViewerASCIIPrintf(viewer,
                                     "  first rank: ordering %s; factorizations with pivoting: %" PetscInt_FMT
                                     ", with old pivots: %" PetscInt_FMT ", of these given up: %" PetscInt_FMT "\n",
                                     k->ordering_used, k->factorizations, k->refactorizations + k->rejected,
                                     k->rejected));
  PetscCall(PetscViewerASCIIPrintf(viewer, "  solves checked: %" PetscInt_FMT ", residual of the last %g\n", p->checks,
                                   (double)p->residual));
  PetscFunctionReturn(0);
}

/* ---- create and destroy ---- */

static PetscErrorCode Destroy(Mat F)
{
  PetscFunctionBegin;
  PetscCall(Delete(PetscObjectComm((PetscObject)F), PartsOf(F)));
  F->data = NULL;
  for (const char *name : {"MatFactorGetSolverType_C", LINEAR_SAVE_STATE, LINEAR_LOAD_STATE})
    PetscCall(PetscObjectComposeFunction((PetscObject)F, name, NULL));
  PetscFunctionReturn(0);
}

static PetscErrorCode MatGetFactor_KLUParts(Mat A, MatFactorType type, Mat *factor)
{
  Mat       F;
  KluParts *p;

  PetscFunctionBegin;
  PetscCall(Create(A, &p));
  PetscCall(MatCreate(PetscObjectComm((PetscObject)A), &F));
  PetscCall(MatSetSizes(F, A->rmap->n, A->cmap->n, A->rmap->N, A->cmap->N));
  PetscCall(PetscStrallocpy(LINEAR_KLUPARTS, &((PetscObject)F)->type_name));
  PetscCall(MatSetUp(F));
  F->data                  = p;
  F->factortype            = type;
  F->assembled             = PETSC_TRUE; /* otherwise -ksp_view does not show the factor */
  F->ops->lufactorsymbolic = FactorSymbolic;
  F->ops->getinfo          = GetInfo;
  F->ops->view             = View;
  F->ops->destroy          = Destroy;
  PetscCall(PetscFree(F->solvertype));
  PetscCall(PetscStrallocpy(LINEAR_KLUPARTS, &F->solvertype));
  PetscCall(PetscStrallocpy(MATORDERINGEXTERNAL, (char **)&F->preferredordering[type]));
  PetscCall(PetscObjectComposeFunction((PetscObject)F, "MatFactorGetSolverType_C", GetSolverType));
  PetscCall(PetscObjectComposeFunction((PetscObject)F, LINEAR_SAVE_STATE, PartsSaveState));
  PetscCall(PetscObjectComposeFunction((PetscObject)F, LINEAR_LOAD_STATE, PartsLoadState));
  *factor = F;
  PetscFunctionReturn(0);
}

/* A matrix on one rank is a single interior, factored by "klupair". The factor is named "kluparts", because PCFactorSetMatSolverType() compares the names. */
static PetscErrorCode MatGetFactor_OnePart(Mat A, MatFactorType type, Mat *factor)
{
  PetscFunctionBegin;
  PetscCall(LinearKLUPairFactor(A, type, factor));
  PetscCall(PetscFree((*factor)->solvertype));
  PetscCall(PetscStrallocpy(LINEAR_KLUPARTS, &(*factor)->solvertype));
  PetscCall(PetscObjectComposeFunction((PetscObject)*factor, "MatFactorGetSolverType_C", GetSolverType));
  PetscFunctionReturn(0);
}

PetscErrorCode LinearRegisterKLUParts(void)
{
  PetscFunctionBegin;
  PetscCall(MatSolverTypeRegister(LINEAR_KLUPARTS, MATMPIAIJ, MAT_FACTOR_LU, MatGetFactor_KLUParts));
  PetscCall(MatSolverTypeRegister(LINEAR_KLUPARTS, MATSEQAIJ, MAT_FACTOR_LU, MatGetFactor_OnePart));
  PetscFunctionReturn(0);
}

#else

PetscErrorCode LinearRegisterKLUParts(void) { return 0; }

PetscErrorCode LinearPartsCount(Mat, double, PetscInt, LinearPartsWork *work)
{
  *work = LinearPartsWork();
  return 0;
}

#endif
