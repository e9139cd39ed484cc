/*
  "mumpsnd", and "smumpsnd" in single precision: the factor matrix. Options: -mat_mumps_memory <MB>, the memory that a factor may take on each machine (default: what
  is free there; 0: no check); -mat_mumps_icntl_<i>, -mat_mumps_cntl_<i> as with PETSc's "mumps".
  MatMumpsSetIcntl(), MatMumpsGetInfog() and the like work on the factor. Unless ICNTL(7) or PETSc's ordering is set,
  the analysis is done with METIS' ordering and with MUMPS' automatic choice, and the one with fewer operations is kept: an analysis
  costs a few percent of one factorization, and on long thin bodies PORD is sometimes better.
*/
#include "mumpsnd.h"
#include <algorithm>
#include <cmath>
#include <petsc/private/matimpl.h>

#if defined(PETSC_HAVE_MUMPS) && defined(PETSC_USE_REAL_DOUBLE) && !defined(PETSC_USE_COMPLEX)
#include "linear.h"
#include "memory.h"
#include "mumpsnd_data.h"

/* MUMPS predicts its workspace without delayed pivots, of which an indefinite matrix can need several times as much. Percentage of extra workspace,
   ICNTL(14), and number of factorizations that are repeated with more of it. MumpsND.SmallWorkspaceGrows. */
static const int WORKSPACE_PERCENT = 30, WORKSPACE_RETRIES = 5;

template <class P> static MumpsND<P> *Data(Mat F) { return static_cast<MumpsND<P> *>(F->data); }

/* ---- errors ---- */

static MatFactorError FactorError(int infog1)
{
  if (infog1 == -6) return MAT_FACTOR_STRUCT_ZEROPIVOT;
  if (infog1 == -10) return MAT_FACTOR_NUMERIC_ZEROPIVOT;
  if (infog1 == -5 || infog1 == -19 || (infog1 <= -7 && infog1 >= -15)) return MAT_FACTOR_OUTMEMORY;
  return MAT_FACTOR_OTHER;
}

template <class P> static PetscErrorCode ReportError(Mat F, Mat A, const char phase[])
{
  MumpsND<P> *m = Data<P>(F);

  PetscFunctionBegin;
  if (m->infog(1) >= 0) PetscFunctionReturn(0);
  PetscCheck(!A->erroriffailure, PetscObjectComm((PetscObject)F), PETSC_ERR_LIB,
             "MUMPS failed in its %s: INFOG(1)=%d, INFOG(2)=%d; see the list of errors in the MUMPS user's guide",
             phase, m->infog(1), m->infog(2));
  PetscCall(PetscInfo(F, "MUMPS failed in its %s: INFOG(1)=%d, INFOG(2)=%d\n", phase, m->infog(1), m->infog(2)));
  F->factorerrortype = FactorError(m->infog(1));
  PetscFunctionReturn(0);
}

template <class P> static PetscErrorCode ReportRange(Mat F, Mat A)
{
  PetscFunctionBegin;
  if (!Data<P>(F)->beyond_range) PetscFunctionReturn(0);
  PetscCheck(!A->erroriffailure, PetscObjectComm((PetscObject)F), PETSC_ERR_ARG_OUTOFRANGE,
             "The matrix has entries beyond the range of single precision; use -pc_factor_mat_solver_type %s", LINEAR_MUMPSND);
  PetscCall(PetscInfo(F, "The matrix has entries beyond the range of single precision\n"));
  F->factorerrortype = MAT_FACTOR_OTHER;
  PetscFunctionReturn(0);
}

/*
  Linux allocates more memory than there is and kills a process that uses it: a factorization for which memory does not suffice is not begun. The
  prediction of the analysis holds in core (ICNTL(22) = 0) and without compression (ICNTL(35) = 0).
*/
template <class P> static PetscErrorCode ReportMemory(Mat F, Mat A)
{
  MumpsND<P>  *m = Data<P>(F);
  LinearMemory fullest;

  PetscFunctionBegin;
  m->no_room = false;
  if (m->infog(1) < 0 || m->memory == 0 || m->icntl(22) || m->icntl(35)) PetscFunctionReturn(0);
  PetscCall(LinearMemoryOf(m->comm, m->id.info[14], m->memory, &fullest)); /* INFO(15) */
  if (fullest.need <= fullest.free) PetscFunctionReturn(0);
  PetscCheck(!A->erroriffailure, PetscObjectComm((PetscObject)F), PETSC_ERR_MEM,
             "The factor of the matrix of %" PetscInt_FMT " rows needs %.0f MB on a machine, %.0f MB are free there (-mat_mumps_memory)", A->rmap->N, fullest.need, fullest.free);
  PetscCall(PetscInfo(F, "The factor needs %.0f MB on a machine, %.0f MB are free there (-mat_mumps_memory)\n", fullest.need, fullest.free));
  m->no_room         = true;
  F->factorerrortype = MAT_FACTOR_OUTMEMORY;
  PetscFunctionReturn(0);
}

/* With null pivot detection MUMPS returns one of many solutions; unless the user set ICNTL(24), null pivots are reported as a singular matrix */
template <class P> static PetscErrorCode ReportNullPivots(Mat F, Mat A)
{
  MumpsND<P> *m = Data<P>(F);

  PetscFunctionBegin;
  if (m->infog(1) < 0 || m->infog(28) == 0 || m->user_null_pivots) PetscFunctionReturn(0);
  PetscCheck(!A->erroriffailure, PetscObjectComm((PetscObject)F), PETSC_ERR_MAT_LU_ZRPVT,
             "The matrix of %" PetscInt_FMT " rows is singular: MUMPS met %d null pivots", A->rmap->N, m->infog(28));
  PetscCall(PetscInfo(F, "The matrix is singular: MUMPS met %d null pivots\n", m->infog(28)));
  F->factorerrortype = MAT_FACTOR_NUMERIC_ZEROPIVOT;
  PetscFunctionReturn(0);
}

/* ---- the entries ---- */

template <class P> static bool IsStored(const MumpsND<P> *m, PetscInt row, PetscInt col) { return m->id.sym == 0 || col >= row; }

template <class P> static PetscErrorCode CopyPattern(Mat A, MumpsND<P> *m)
{
  PetscInt        begin, end, count;
  const PetscInt *cols;

  PetscFunctionBegin;
  m->row.clear();
  m->col.clear();
  PetscCall(MatGetOwnershipRange(A, &begin, &end));
  PetscCall(MatGetRowUpperTriangular(A)); /* allows MatGetRow() for MATSBAIJ; no effect with other types */
  for (PetscInt i = begin; i < end; ++i) {
    PetscCall(MatGetRow(A, i, &count, &cols, NULL));
    for (PetscInt k = 0; k < count; ++k)
      if (IsStored(m, i, cols[k])) {
        m->row.push_back((MUMPS_INT)(i + 1));
        m->col.push_back((MUMPS_INT)(cols[k] + 1));
      }
    PetscCall(MatRestoreRow(A, i, &count, &cols, NULL));
  }
  PetscCall(MatRestoreRowUpperTriangular(A));
  m->val.resize(m->row.size());
  m->id.n       = (MUMPS_INT)A->rmap->N;
  m->id.nnz_loc = (MUMPS_INT8)m->row.size();
  m->id.irn_loc = m->row.data();
  m->id.jcn_loc = m->col.data();
  m->id.a_loc   = m->val.data();
  PetscFunctionReturn(0);
}

template <class P> static PetscErrorCode CopyValues(Mat A, MumpsND<P> *m)
{
  PetscInt           begin, end, count;
  const PetscInt    *cols;
  const PetscScalar *vals;
  size_t             next   = 0;
  PetscMPIInt        beyond = 0;

  PetscFunctionBegin;
  PetscCall(MatGetOwnershipRange(A, &begin, &end));
  PetscCall(MatGetRowUpperTriangular(A));
  for (PetscInt i = begin; i < end; ++i) {
    PetscCall(MatGetRow(A, i, &count, &cols, &vals));
    for (PetscInt k = 0; k < count; ++k)
      if (IsStored(m, i, cols[k])) {
        PetscCheck(
            next < m->val.size() && m->col[next] == cols[k] + 1, PETSC_COMM_SELF, PETSC_ERR_ARG_INCOMP,
            "Row %" PetscInt_FMT " of the matrix has another pattern than the one analysed; set the operators anew", i);
        m->val[next] = (typename P::Real)vals[k];
        if (!std::isfinite(m->val[next]) && std::isfinite(vals[k])) beyond = 1;
        next++;
      }
    PetscCall(MatRestoreRow(A, i, &count, &cols, &vals));
  }
  PetscCall(MatRestoreRowUpperTriangular(A));
  if (sizeof(typename P::Real) < sizeof(PetscScalar)) PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &beyond, 1, MPI_INT, MPI_MAX, m->comm));
  m->beyond_range = beyond;
  PetscFunctionReturn(0);
}

/* ---- analysis and factorization ---- */

/* Controls of the way in which matrix and vectors are passed, which users cannot set */
static bool IsReserved(PetscInt i) { return i == 5 || i == 9 || i == 18 || i == 19 || i == 20 || i == 21; }

template <class P> static PetscErrorCode SetIcntl(Mat F, PetscInt i, PetscInt value)
{
  MumpsND<P> *m = Data<P>(F);

  PetscFunctionBegin;
  PetscCheck(i >= 1 && i <= 60 && !IsReserved(i) && !(i == 7 && value == 1), PetscObjectComm((PetscObject)F),
             PETSC_ERR_ARG_OUTOFRANGE, "ICNTL(%" PetscInt_FMT ")=%" PetscInt_FMT " cannot be set for solver type %s", i,
             value, P::package());
  m->icntl((int)i) = (MUMPS_INT)value;
  if (i == 7) m->user_ordering = PETSC_TRUE;
  if (i == 24) m->user_null_pivots = PETSC_TRUE;
  PetscFunctionReturn(0);
}

template <class P> static PetscErrorCode ReadOptions(Mat F)
{
  const PetscOptions options = ((PetscObject)F)->options;
  const char *const  prefix  = ((PetscObject)F)->prefix;
  char               name[32];
  PetscBool          set;

  PetscFunctionBegin;
  for (int i = 1; i <= 60; ++i) {
    PetscInt value;
    PetscCall(PetscSNPrintf(name, sizeof name, "-mat_mumps_icntl_%d", i));
    PetscCall(PetscOptionsGetInt(options, prefix, name, &value, &set));
    if (set) PetscCall(SetIcntl<P>(F, i, value));
    if (set && i == 4) Data<P>(F)->icntl(3) = 6;
  }
  PetscCall(PetscOptionsGetReal(options, prefix, "-mat_mumps_memory", &Data<P>(F)->memory, NULL));
  for (int i = 1; i <= 15; ++i) {
    PetscCall(PetscSNPrintf(name, sizeof name, "-mat_mumps_cntl_%d", i));
    PetscReal value;
    PetscCall(PetscOptionsGetReal(options, prefix, name, &value, &set));
    if (set) Data<P>(F)->cntl(i) = (typename P::Real)value;
  }
  PetscFunctionReturn(0);
}

template <class P> static PetscErrorCode FactorNumeric(Mat F, Mat A, const MatFactorInfo *)
{
  MumpsND<P> *m = Data<P>(F);

  PetscFunctionBegin;
  if (F->factorerrortype == MAT_FACTOR_STRUCT_ZEROPIVOT || m->no_room) PetscFunctionReturn(0); /* the analysis failed */
  F->factorerrortype = MAT_FACTOR_NOERROR;
  PetscCall(MumpsNDDropScatter(m));
  PetscCall(CopyValues(A, m));
  PetscCall(ReportRange<P>(F, A));
  if (m->beyond_range) PetscFunctionReturn(0);
  MumpsRun(m, MUMPS_FACTOR);
  for (int k = 0; k < WORKSPACE_RETRIES && (m->infog(1) == -8 || m->infog(1) == -9); ++k) {
    m->icntl(14) = std::max(2 * m->icntl(14), m->icntl(14) + 50);
    PetscCall(PetscInfo(F, "MUMPS ran out of workspace, again with ICNTL(14)=%d\n", m->icntl(14)));
    MumpsRun(m, MUMPS_FACTOR);
  }
  PetscCall(ReportError<P>(F, A, "factorization"));
  PetscCall(ReportNullPivots<P>(F, A));
  F->assembled = PETSC_TRUE;
  PetscCall(PetscLogFlops(m->id.rinfo[1])); /* RINFO(2) */
  PetscFunctionReturn(0);
}

template <class P> static PetscErrorCode FactorSymbolic(Mat F, Mat A, IS given)
{
  MumpsND<P> *m = Data<P>(F);

  PetscFunctionBegin;
  PetscCall(ReadOptions<P>(F));
  PetscCall(CopyPattern(A, m));
  PetscCall(CopyValues(A, m));
  PetscCall(MumpsNDAnalyse(A, m->size == 1 ? given : NULL, m));
  PetscCall(ReportError<P>(F, A, "analysis"));
  PetscCall(ReportMemory<P>(F, A));
  F->ops->lufactornumeric = F->ops->choleskyfactornumeric = FactorNumeric<P>;
  MumpsNDSetSolves<P>(F);
  PetscFunctionReturn(0);
}

template <class P> static PetscErrorCode LUFactorSymbolic(Mat F, Mat A, IS row, IS, const MatFactorInfo *)
{
  return FactorSymbolic<P>(F, A, row);
}

template <class P> static PetscErrorCode CholeskyFactorSymbolic(Mat F, Mat A, IS row, const MatFactorInfo *)
{
  return FactorSymbolic<P>(F, A, row);
}

/* ---- state ---- */

/* Pivots are chosen anew with every matrix, but the ordering depends on the values of the matrix that was analysed */
template <class P> static PetscErrorCode SaveState(Mat F, Archive *archive)
{
  MumpsND<P> *m         = Data<P>(F);
  MUMPS_INT ordering  = m->icntl(7), workspace = m->icntl(14);

  PetscFunctionBegin;
  archive->plain(ordering);
  archive->plain(workspace);
  archive->plain(m->ordering);
  m->ordering[sizeof(m->ordering) - 1] = 0;
  archive->list(m->position);
  PetscFunctionReturn(0);
}

/* Whether `position` has each of 1 to n once */
static bool IsPermutation(const std::vector<MUMPS_INT> &position, MUMPS_INT n)
{
  std::vector<bool> seen((size_t)n, false);
  for (const MUMPS_INT p : position) {
    if (p < 1 || p > n || seen[p - 1]) return false;
    seen[p - 1] = true;
  }
  return position.size() == (size_t)n;
}

template <class P> static PetscErrorCode LoadState(Mat F, Mat A, Archive *archive, PetscBool *same)
{
  MumpsND<P> *m        = Data<P>(F);
  MUMPS_INT ordering = 0, workspace = 0;

  PetscFunctionBegin;
  archive->plain(ordering);
  archive->plain(workspace);
  archive->plain(m->ordering);
  archive->list(m->position);
  *same = (PetscBool)(archive->good && (ordering != 1 || m->rank || IsPermutation(m->position, m->id.n)));
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, same, 1, MPIU_BOOL, MPI_LAND, m->comm));
  if (!*same) PetscFunctionReturn(0);
  PetscCall(MumpsNDDropScatter(m));
  m->icntl(14) = workspace;
  MumpsNDAnalyseAgain(m, ordering);
  PetscCall(ReportError<P>(F, A, "analysis"));
  if (!F->factorerrortype) PetscCall(FactorNumeric<P>(F, A, NULL));
  *same = (PetscBool)(!F->factorerrortype && m->size == 1);
  PetscFunctionReturn(0);
}

/* ---- information and view ---- */

template <class P> static PetscErrorCode GetIcntl(Mat F, PetscInt i, PetscInt *value) { return *value = Data<P>(F)->icntl((int)i), 0; }

template <class P> static PetscErrorCode SetCntl(Mat F, PetscInt i, PetscReal value) { return Data<P>(F)->cntl((int)i) = (typename P::Real)value, 0; }

template <class P> static PetscErrorCode GetCntl(Mat F, PetscInt i, PetscReal *value) { return *value = Data<P>(F)->cntl((int)i), 0; }

template <class P> static PetscErrorCode GetInfog(Mat F, PetscInt i, PetscInt *value) { return *value = Data<P>(F)->infog((int)i), 0; }

template <class P> static PetscErrorCode GetRinfog(Mat F, PetscInt i, PetscReal *value) { return *value = Data<P>(F)->rinfog((int)i), 0; }

template <class P> static PetscErrorCode GetSolverType(Mat, MatSolverType *type) { return *type = P::package(), 0; }

template <class P> static PetscErrorCode GetInertia(Mat F, PetscInt *negative, PetscInt *zero, PetscInt *positive)
{
  const MumpsND<P> *m = Data<P>(F);

  PetscFunctionBegin;
  if (negative) *negative = m->infog(12);
  if (zero) *zero = m->infog(28);
  if (positive) *positive = F->rmap->N - m->infog(12) - m->infog(28);
  PetscFunctionReturn(0);
}

template <class P> static PetscErrorCode GetInfo(Mat F, MatInfoType, MatInfo *info)
{
  const MumpsND<P> *m       = Data<P>(F);
  const double   entries = m->infog(29) < 0 ? -1e6 * m->infog(29) : m->infog(29);

  PetscFunctionBegin;
  PetscCall(PetscMemzero(info, sizeof *info));
  info->block_size   = 1;
  info->nz_allocated = info->nz_used = entries;
  PetscFunctionReturn(0);
}

template <class P> static PetscErrorCode View(Mat F, PetscViewer viewer)
{
  MumpsND<P>       *m = Data<P>(F);
  PetscBool         ascii;
  PetscViewerFormat format;

  PetscFunctionBegin;
  PetscCall(PetscObjectTypeCompare((PetscObject)viewer, PETSCVIEWERASCII, &ascii));
  if (!ascii) PetscFunctionReturn(0);
  PetscCall(PetscViewerGetFormat(viewer, &format));
  if (format != PETSC_VIEWER_ASCII_INFO && format != PETSC_VIEWER_ASCII_INFO_DETAIL) PetscFunctionReturn(0);
  PetscCall(
      PetscViewerASCIIPrintf(viewer, "MUMPS %s in %s precision, SYM=%d, ordering %s\n", m->id.version_number,
                                   sizeof(typename P::Real) < sizeof(double) ? "single" : "double", m->id.sym, m->ordering));
  PetscCall(PetscViewerASCIIPrintf(viewer, "  operations: %g foreseen, %g done; delayed pivots: %d\n", m->rinfog(1),
                                   m->rinfog(3), m->infog(13)));
  PetscCall(PetscViewerASCIIPrintf(viewer, "  memory used: %d MB on the fullest process, %d MB in all; ICNTL(14)=%d\n",
                                   m->infog(21), m->infog(22), m->icntl(14)));
  PetscFunctionReturn(0);
}

static const char *const composed[] = {"MatFactorGetSolverType_C", "MatMumpsSetIcntl_C", "MatMumpsGetIcntl_C",
                                       "MatMumpsSetCntl_C",        "MatMumpsGetCntl_C",  "MatMumpsGetInfog_C",
                                       "MatMumpsGetRinfog_C",      LINEAR_SAVE_STATE,    LINEAR_LOAD_STATE};

template <class P> static PetscErrorCode Compose(Mat F)
{
  const PetscObject f = (PetscObject)F;

  PetscFunctionBegin;
  PetscCall(PetscObjectComposeFunction(f, "MatFactorGetSolverType_C", GetSolverType<P>));
  PetscCall(PetscObjectComposeFunction(f, "MatMumpsSetIcntl_C", SetIcntl<P>));
  PetscCall(PetscObjectComposeFunction(f, "MatMumpsGetIcntl_C", GetIcntl<P>));
  PetscCall(PetscObjectComposeFunction(f, "MatMumpsSetCntl_C", SetCntl<P>));
  PetscCall(PetscObjectComposeFunction(f, "MatMumpsGetCntl_C", GetCntl<P>));
  PetscCall(PetscObjectComposeFunction(f, "MatMumpsGetInfog_C", GetInfog<P>));
  PetscCall(PetscObjectComposeFunction(f, "MatMumpsGetRinfog_C", GetRinfog<P>));
  PetscCall(PetscObjectComposeFunction(f, LINEAR_SAVE_STATE, SaveState<P>));
  PetscCall(PetscObjectComposeFunction(f, LINEAR_LOAD_STATE, LoadState<P>));
  PetscFunctionReturn(0);
}

/* ---- create and destroy ---- */

template <class P> static PetscErrorCode Destroy(Mat F)
{
  MumpsND<P> *m = Data<P>(F);

  PetscFunctionBegin;
  PetscCall(MumpsNDDropScatter(m));
  MumpsRun(m, MUMPS_END);
  PetscCall(PetscCommRestoreComm(PetscObjectComm((PetscObject)F), &m->comm));
  delete m;
  F->data = NULL;
  for (const char *name : composed) PetscCall(PetscObjectComposeFunction((PetscObject)F, name, NULL));
  PetscFunctionReturn(0);
}

template <class P> static PetscErrorCode CreateInstance(Mat A, int sym, MumpsND<P> **instance)
{
  MumpsND<P> *m = new MumpsND<P>();
  PetscInt begin, end;

  PetscFunctionBegin;
  PetscCall(PetscCommGetComm(PetscObjectComm((PetscObject)A), &m->comm));
  PetscCallMPI(MPI_Comm_rank(m->comm, &m->rank));
  PetscCallMPI(MPI_Comm_size(m->comm, &m->size));
  PetscCall(MatGetOwnershipRange(A, &begin, &end));
  for (PetscInt i = begin; i < end && m->size > 1; ++i) m->rhs_rows.push_back((MUMPS_INT)(i + 1));
  m->id.comm_fortran = (MUMPS_INT)MPI_Comm_c2f(m->comm);
  m->id.par          = 1;
  m->id.sym          = sym;
  MumpsRun(m, MUMPS_INIT);
  PetscCheck(m->infog(1) >= 0, PetscObjectComm((PetscObject)A), PETSC_ERR_LIB, "MUMPS did not start: INFOG(1)=%d",
             m->infog(1));
  for (int i = 1; i <= 4; ++i) m->icntl(i) = 0; /* no output */
  m->icntl(13) = 1;                             /* no ScaLAPACK for the root, where null pivots would not be detected */
  m->icntl(14) = WORKSPACE_PERCENT;
  m->icntl(18) = 3; /* distributed matrix: every process passes its rows */
  m->icntl(20) = m->size > 1 ? 10 : 0;
  m->icntl(21) = m->size > 1 ? 1 : 0;
  m->icntl(24) = 1;
  m->icntl(28) = 1; /* sequential ordering: parallel METIS is not available */
  m->cntl(3)   = (typename P::Real)P::null_pivot;
  *instance    = m;
  PetscFunctionReturn(0);
}

template <class P> static PetscErrorCode MatGetFactor_MumpsND(Mat A, MatFactorType type, Mat *factor)
{
  Mat       F;
  PetscBool known, spd;

  PetscFunctionBegin;
  PetscCheck(A->rmap->N <= PETSC_MPI_INT_MAX, PetscObjectComm((PetscObject)A), PETSC_ERR_ARG_OUTOFRANGE,
             "MUMPS takes at most %d rows, the matrix has %" PetscInt_FMT, PETSC_MPI_INT_MAX, A->rmap->N);
  PetscCall(MatCreate(PetscObjectComm((PetscObject)A), &F));
  PetscCall(MatSetSizes(F, A->rmap->n, A->cmap->n, A->rmap->N, A->cmap->N));
  PetscCall(PetscStrallocpy(P::package(), &((PetscObject)F)->type_name));
  PetscCall(MatSetUp(F));
  PetscCall(MatIsSPDKnown(A, &known, &spd));

  MumpsND<P> *m   = NULL;
  const int sym = type == MAT_FACTOR_LU ? 0 : (known && spd ? 1 : 2);
  PetscCall(CreateInstance<P>(A, sym, &m));
  F->data                        = m;
  F->factortype                  = type;
  F->canuseordering              = m->size == 1 ? PETSC_TRUE : PETSC_FALSE;
  F->ops->lufactorsymbolic       = LUFactorSymbolic<P>;
  F->ops->choleskyfactorsymbolic = CholeskyFactorSymbolic<P>;
  F->ops->getinertia             = sym && sizeof(typename P::Real) == sizeof(double) ? GetInertia<P> : NULL; /* signs of small pivots are rounding in single precision */
  F->ops->getinfo                = GetInfo<P>;
  F->ops->view                   = View<P>;
  F->ops->destroy                = Destroy<P>;
  PetscCall(PetscFree(F->solvertype));
  PetscCall(PetscStrallocpy(P::package(), &F->solvertype));
  PetscCall(PetscStrallocpy(MATORDERINGEXTERNAL, (char **)&F->preferredordering[type]));
  PetscCall(Compose<P>(F));
  *factor = F;
  PetscFunctionReturn(0);
}

template <class P> static PetscErrorCode Register()
{
  PetscFunctionBegin;
  PetscCall(LinearRegisterForTypes(P::package(), MatGetFactor_MumpsND<P>));
  PetscFunctionReturn(0);
}

PetscErrorCode LinearRegisterForTypes(const char package[], PetscErrorCode (*get)(Mat, MatFactorType, Mat *))
{
  PetscFunctionBegin;
  for (MatFactorType type : {MAT_FACTOR_LU, MAT_FACTOR_CHOLESKY})
    for (MatType matrix : {MATSEQAIJ, MATMPIAIJ}) PetscCall(MatSolverTypeRegister(package, matrix, type, get));
  for (MatType matrix : {MATSEQSBAIJ, MATMPISBAIJ}) PetscCall(MatSolverTypeRegister(package, matrix, MAT_FACTOR_CHOLESKY, get));
  PetscFunctionReturn(0);
}

PetscErrorCode LinearRegisterMumpsND(void)
{
  PetscFunctionBegin;
  PetscCall(Register<MumpsDouble>());
#if defined(HHTDAE_HAVE_SMUMPS)
  PetscCall(Register<MumpsSingle>());
#endif
  PetscFunctionReturn(0);
}

#else

PetscErrorCode LinearRegisterMumpsND(void) { return 0; }

#endif
