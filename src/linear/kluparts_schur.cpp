/*
  The Schur complement of the interface of "kluparts", and solves.

  KLU factors the transpose of the interior A: row i of A is KLU's column, P and Q are its permutations, and
  A(Q,P) = U^T L^T / Rs with row k of U^T in column k of U. With the blocks B, C and D of kluparts_data.h the Schur
  complement is D - (L^-1 P C^T / Rs)^T (U^-T Q B). The two factors have nonzero rows only for the columns of L and U that B and C
  reach, which are few if the ordering eliminates the unknowns coupled to the interface last.
*/
#if defined(HHTDAE_HAVE_KLU)
#include "kluparts_data.h"
#include <algorithm>
#include <petscblaslapack.h>

/* Smaller pivots of the Schur complement count as zero; it is scaled so that the absolute values of the terms of every row and column sum up to about one */
static const PetscReal MIN_SCHUR_PIVOT = 1e-13;

namespace
{

/* One column of L without its diagonal, or of U without its diagonal, as KLU stores it */
struct Column {
  const KluInt *index;
  const double *value;
  KluInt        count;
};

/* The columns of one factor in KLU's storage: indices, padded to whole doubles, then values. For a single unknown KLU stores the pivot only, and
   data is NULL. */
struct FactorColumns {
  const double *data;
  const KluInt *start, *length;

  Column operator[](PetscInt k) const
  {
    if (!data) return {NULL, NULL, 0};
    const double *at    = data + start[k];
    const size_t  units = ((size_t)length[k] * sizeof(KluInt) + sizeof(double) - 1) / sizeof(double);
    return {reinterpret_cast<const KluInt *>(at), at + units, length[k]};
  }
};

} // namespace

static FactorColumns Lower(const KluPair &k)
{
  return {static_cast<const double *>(k.numeric->LUbx[0]), k.numeric->Lip, k.numeric->Llen};
}

static FactorColumns Upper(const KluPair &k)
{
  return {static_cast<const double *>(k.numeric->LUbx[0]), k.numeric->Uip, k.numeric->Ulen};
}

static const double *Pivots(const KluPair &k) { return static_cast<const double *>(k.numeric->Udiag); }

/* ---- columns that the interface reaches ---- */

static std::vector<PetscInt> Inverse(const KluInt *permutation, PetscInt n)
{
  std::vector<PetscInt> inverse(n);
  for (PetscInt k = 0; k < n; ++k) inverse[permutation[k]] = k;
  return inverse;
}

static void MarkLower(const FactorColumns &L, PetscInt n, std::vector<char> *met)
{
  for (PetscInt k = 0; k < n; ++k) {
    if (!(*met)[k]) continue;
    const Column c = L[k];
    for (KluInt j = 0; j < c.count; ++j) (*met)[c.index[j]] = 1;
  }
}

static void MarkUpper(const FactorColumns &U, PetscInt n, std::vector<char> *met)
{
  PetscInt k = 0;
  while (k < n && !(*met)[k]) ++k;
  for (; k < n; ++k) {
    if ((*met)[k]) continue;
    const Column c = U[k];
    (*met)[k]      = std::any_of(c.index, c.index + c.count, [met](KluInt i) { return (*met)[i] != 0; });
  }
}

PetscErrorCode PartsFindReach(KluParts *p)
{
  const KluPair    *klu = p->klu;
  PartsSplit       &s   = p->split;
  const PetscInt    n   = (PetscInt)s.inner_row.size();
  std::vector<char> lower(n, 0), upper(n, 0);

  PetscFunctionBegin;
  p->reach.clear();
  p->reach_index.assign(n, -1);
  p->rhs_row.resize(n);
  p->solution_row.resize(n);
  if (!klu) PetscFunctionReturn(0);
  PetscCheck(klu->symbolic->nblocks == 1, PETSC_COMM_SELF, PETSC_ERR_PLIB,
             "KLU found %d diagonal blocks, one was asked for", (int)klu->symbolic->nblocks);
  const std::vector<PetscInt> row = Inverse(klu->symbolic->Q, n), col = Inverse(klu->numeric->Pnum, n);
  for (PetscInt k = 0; k < n; ++k) {
    p->rhs_row[k]      = s.inner_row[klu->symbolic->Q[k]];
    p->solution_row[k] = s.inner_row[klu->numeric->Pnum[k]];
  }
  p->right_reach.clear();
  p->below_reach.clear();
  for (const PartsEntry &e : s.right) upper[row[e.row]] = 1;
  for (const PartsEntry &e : s.below) lower[col[e.col]] = 1;
  MarkLower(Lower(*klu), n, &lower);
  MarkUpper(Upper(*klu), n, &upper);
  for (PetscInt k = 0; k < n; ++k)
    if (lower[k] || upper[k]) {
      p->reach_index[k] = (PetscInt)p->reach.size();
      p->reach.push_back(k);
    }
  for (const PartsEntry &e : s.right) p->right_reach.push_back(p->reach_index[row[e.row]]);
  for (const PartsEntry &e : s.below) p->below_reach.push_back(p->reach_index[col[e.col]]);
  p->right_part.resize(p->reach.size() * s.local.size());
  p->below_part.resize(p->reach.size() * s.local.size());
  p->work.resize(n);
  PetscFunctionReturn(0);
}

/* ---- elimination of the interior from B and C ---- */

static void Subtract(PetscScalar *to, PetscScalar factor, const PetscScalar *from, PetscInt width)
{
  for (PetscInt j = 0; j < width; ++j) to[j] -= factor * from[j];
}

/* U^-T Q B */
static void EliminateRight(KluParts *p, const KluPair &klu)
{
  const PetscInt      w = (PetscInt)p->split.local.size();
  const FactorColumns U = Upper(klu);
  PetscScalar        *Y = p->right_part.data();

  std::fill(p->right_part.begin(), p->right_part.end(), 0);
  for (size_t e = 0; e < p->split.right.size(); ++e)
    Y[(size_t)p->right_reach[e] * w + p->split.right[e].col] += p->split.right_val[e];
  for (size_t r = 0; r < p->reach.size(); ++r) {
    const Column       c     = U[p->reach[r]];
    const PetscScalar  pivot = Pivots(klu)[p->reach[r]];
    PetscScalar *const y     = Y + r * w;
    for (KluInt j = 0; j < c.count; ++j) {
      const PetscInt i = p->reach_index[c.index[j]];
      if (i >= 0) Subtract(y, c.value[j], Y + (size_t)i * w, w);
    }
    for (PetscInt j = 0; j < w; ++j) y[j] /= pivot;
  }
}

/* L^-1 P C^T / Rs */
static void EliminateBelow(KluParts *p, const KluPair &klu)
{
  const PetscInt      w  = (PetscInt)p->split.local.size();
  const FactorColumns L  = Lower(klu);
  const double       *Rs = klu.numeric->Rs;
  PetscScalar        *V  = p->below_part.data();

  std::fill(p->below_part.begin(), p->below_part.end(), 0);
  for (size_t e = 0; e < p->split.below.size(); ++e) {
    const PetscInt r = p->below_reach[e];
    V[(size_t)r * w + p->split.below[e].row] += p->split.below_val[e] / (Rs ? Rs[p->reach[r]] : 1);
  }
  for (size_t r = 0; r < p->reach.size(); ++r) {
    const Column c = L[p->reach[r]];
    for (KluInt j = 0; j < c.count; ++j) {
      const PetscInt i = p->reach_index[c.index[j]];
      if (i >= 0) Subtract(V + (size_t)i * w, c.value[j], V + r * w, w);
    }
  }
}

/* ---- the Schur complement ---- */

/* This rank's contribution to the Schur complement, column by column: from its interior and its interface rows */
static PetscErrorCode Contribution(KluParts *p, PetscScalar *S)
{
  const PartsSplit        &s = p->split;
  const size_t             N = s.interface.size(), w = s.local.size();
  std::vector<PetscScalar> product(w * w, 0);

  PetscFunctionBegin;
  std::fill(S, S + N * N, 0);
  for (size_t e = 0; e < s.corner.size(); ++e) S[s.corner[e].row + N * (size_t)s.corner[e].col] += s.corner_val[e];
  if (!p->factor || p->reach.empty() || !w) PetscFunctionReturn(0);
  EliminateRight(p, *p->klu);
  EliminateBelow(p, *p->klu);
  PetscBLASInt      bw, br;
  const PetscScalar one = 1, zero = 0;
  PetscCall(PetscBLASIntCast((PetscInt)w, &bw));
  PetscCall(PetscBLASIntCast((PetscInt)p->reach.size(), &br));
  /* the parts are stored by rows: BLAS sees their transposes */
  PetscCallBLAS("BLASgemm", BLASgemm_("N", "T", &bw, &bw, &br, &one, p->below_part.data(), &bw, p->right_part.data(),
                                      &bw, &zero, product.data(), &bw));
  for (size_t j = 0; j < w; ++j)
    for (size_t i = 0; i < w; ++i) S[s.local[i] + N * (size_t)s.local[j]] -= product[i + w * j];
  PetscCall(PetscLogFlops(2.0 * (double)w * (double)w * (double)p->reach.size()));
  PetscFunctionReturn(0);
}

/* Sums over the absolute values of all terms in each row of the Schur complement, its columns multiplied by col */
static PetscErrorCode RowSums(KluParts *p, const std::vector<PetscReal> &col, std::vector<PetscReal> *row)
{
  const PartsSplit      &s = p->split;
  const size_t           w = s.local.size();
  std::vector<PetscReal> local(w, 0);

  PetscFunctionBegin;
  row->assign(s.interface.size(), 0);
  for (size_t e = 0; e < s.corner.size(); ++e)
    (*row)[s.corner[e].row] += PetscAbsScalar(s.corner_val[e]) * col[s.corner[e].col];
  for (size_t r = 0; r < p->reach.size(); ++r) {
    PetscReal sum = 0;
    for (size_t j = 0; j < w; ++j) sum += PetscAbsScalar(p->right_part[r * w + j]) * col[s.local[j]];
    for (size_t i = 0; i < w; ++i) local[i] += PetscAbsScalar(p->below_part[r * w + i]) * sum;
  }
  for (size_t i = 0; i < w; ++i) (*row)[s.local[i]] += local[i];
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, row->data(), (PetscMPIInt)row->size(), MPIU_REAL, MPI_SUM, p->comm));
  PetscFunctionReturn(0);
}

static PetscErrorCode ColumnSums(KluParts *p, const std::vector<PetscReal> &row, std::vector<PetscReal> *col)
{
  const PartsSplit      &s = p->split;
  const size_t           w = s.local.size();
  std::vector<PetscReal> local(w, 0);

  PetscFunctionBegin;
  col->assign(s.interface.size(), 0);
  for (size_t e = 0; e < s.corner.size(); ++e)
    (*col)[s.corner[e].col] += PetscAbsScalar(s.corner_val[e]) * row[s.corner[e].row];
  for (size_t r = 0; r < p->reach.size(); ++r) {
    PetscReal sum = 0;
    for (size_t i = 0; i < w; ++i) sum += PetscAbsScalar(p->below_part[r * w + i]) * row[s.local[i]];
    for (size_t j = 0; j < w; ++j) local[j] += PetscAbsScalar(p->right_part[r * w + j]) * sum;
  }
  for (size_t j = 0; j < w; ++j) (*col)[s.local[j]] += local[j];
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, col->data(), (PetscMPIInt)col->size(), MPIU_REAL, MPI_SUM, p->comm));
  PetscFunctionReturn(0);
}

static void Invert(std::vector<PetscReal> *sums)
{
  for (PetscReal &v : *sums) v = v > 0 && !PetscIsInfOrNanReal(1 / v) ? 1 / v : 1;
}

/* Scales the Schur complement by the sums of the absolute values of its terms, not of its entries: where terms cancel, the entry is rounding */
static PetscErrorCode Scale(KluParts *p)
{
  const size_t N = p->split.interface.size();

  PetscFunctionBegin;
  p->col_scale.assign(N, 1);
  PetscCall(RowSums(p, p->col_scale, &p->row_scale));
  Invert(&p->row_scale);
  PetscCall(ColumnSums(p, p->row_scale, &p->col_scale));
  Invert(&p->col_scale);
  for (size_t j = 0; j < N; ++j)
    for (size_t i = 0; i < N; ++i) p->schur[i + N * j] *= p->row_scale[i] * p->col_scale[j];
  PetscFunctionReturn(0);
}

/* LU with row exchanges; *first is the first column without a pivot, or the number of columns */
static PetscErrorCode FactorDense(KluParts *p, PetscInt *first)
{
  const size_t N = p->split.interface.size();
  PetscBLASInt n, info;

  PetscFunctionBegin;
  PetscCall(PetscBLASIntCast((PetscInt)N, &n));
  PetscCallBLAS("LAPACKgetrf", LAPACKgetrf_(&n, &n, p->schur.data(), &n, p->pivots.data(), &info));
  PetscCheck(info >= 0, PETSC_COMM_SELF, PETSC_ERR_LIB, "LAPACK's getrf refused argument %d", (int)-info);
  PetscReal least = PETSC_MAX_REAL;
  *first          = (PetscInt)N;
  for (size_t k = N; k-- > 0;) {
    const PetscReal pivot = PetscAbsScalar(p->schur[k + N * k]);
    least                 = PetscMin(least, pivot);
    if (!(pivot > MIN_SCHUR_PIVOT)) *first = (PetscInt)k;
  }
  PetscCall(
      PetscInfo(NULL, "Schur complement of %zu rows: least pivot %g of the terms that it sums up\n", N, (double)least));
  PetscCall(PetscLogFlops(2.0 / 3 * (double)N * (double)N * (double)N));
  PetscFunctionReturn(0);
}

PetscErrorCode PartsFactorSchur(KluParts *p, PetscInt *singular, PetscBool *finite)
{
  const size_t             N = p->split.interface.size();
  std::vector<PetscScalar> mine(N * N);
  PetscScalar              sum      = 0;
  PetscInt                 found[2] = {(PetscInt)N, 1}; /* a row without pivot; whether all is finite */

  PetscFunctionBegin;
  *singular = -1;
  *finite   = PETSC_TRUE;
  p->schur.resize(N * N);
  p->sums.resize(N);
  p->at_interface.resize(N);
  p->at_local.resize(p->split.local.size());
  p->pivots.resize(N);
  if (!N) PetscFunctionReturn(0);
  PetscCall(Contribution(p, mine.data()));
  PetscCheck(N * N < (size_t)PETSC_MPI_INT_MAX, p->comm, PETSC_ERR_ARG_OUTOFRANGE,
             "An interface of %zu unknowns is too large for solver type %s; choose another one", N, LINEAR_KLUPARTS);
  PetscCallMPI(MPI_Allreduce(mine.data(), p->schur.data(), (PetscMPIInt)(N * N), MPIU_SCALAR, MPI_SUM, p->comm));
  PetscCall(Scale(p));
  for (PetscScalar v : p->schur) sum += v;
  if (PetscIsInfOrNanScalar(sum))
    found[1] = 0;
  else
    PetscCall(FactorDense(p, &found[0]));
  /* all ranks take the least result, because rounding may differ */
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, found, 2, MPIU_INT, MPI_MIN, p->comm));
  *singular = found[0] < (PetscInt)N ? found[0] : -1;
  *finite   = found[1] ? PETSC_TRUE : PETSC_FALSE;
  PetscFunctionReturn(0);
}

/* ---- solve ---- */

/* Forward sweep in the interior from the right-hand side b */
static void SolveForward(KluParts *p, const KluPair &klu, const PetscScalar b[])
{
  const PetscInt      n     = (PetscInt)p->rhs_row.size();
  const FactorColumns U     = Upper(klu);
  const double       *pivot = Pivots(klu);
  PetscScalar        *z     = p->work.data();
  for (PetscInt k = 0; k < n; ++k) {
    const Column c   = U[k];
    PetscScalar  sum = b[p->rhs_row[k]];
    for (KluInt j = 0; j < c.count; ++j) sum -= c.value[j] * z[c.index[j]];
    z[k] = sum / pivot[k];
  }
}

static void SolveBackward(KluParts *p, const KluPair &klu, PetscScalar x[])
{
  const PetscInt      n  = (PetscInt)p->rhs_row.size();
  const FactorColumns L  = Lower(klu);
  const double       *Rs = klu.numeric->Rs;
  PetscScalar        *z  = p->work.data();
  for (PetscInt k = n - 1; k >= 0; --k) {
    const Column c   = L[k];
    PetscScalar  sum = z[k];
    for (KluInt j = 0; j < c.count; ++j) sum -= c.value[j] * z[c.index[j]];
    z[k]                  = sum;
    x[p->solution_row[k]] = Rs ? sum / Rs[k] : sum;
  }
}

/* Reduces the interface's right-hand side by the contributions of the interiors and solves for p->at_interface */
static PetscErrorCode SolveInterface(KluParts *p, const PetscScalar b[])
{
  const PartsSplit &s = p->split;
  const size_t      N = s.interface.size(), w = s.local.size();
  PetscBLASInt      n, one                    = 1, info;

  PetscFunctionBegin;
  std::fill(p->sums.begin(), p->sums.end(), 0);
  std::fill(p->at_local.begin(), p->at_local.end(), 0);
  for (PetscInt i : s.interface_row) p->sums[-1 - s.number[i]] = b[i];
  for (size_t r = 0; r < p->reach.size(); ++r)
    Subtract(p->at_local.data(), p->work[p->reach[r]], p->below_part.data() + r * w, (PetscInt)w);
  for (size_t j = 0; j < w; ++j) p->sums[s.local[j]] += p->at_local[j];
  PetscCallMPI(MPI_Allreduce(p->sums.data(), p->at_interface.data(), (PetscMPIInt)N, MPIU_SCALAR, MPI_SUM, p->comm));
  for (size_t g = 0; g < N; ++g) p->at_interface[g] *= p->row_scale[g];
  PetscCall(PetscBLASIntCast((PetscInt)N, &n));
  PetscCallBLAS("LAPACKgetrs",
                LAPACKgetrs_("N", &n, &one, p->schur.data(), &n, p->pivots.data(), p->at_interface.data(), &n, &info));
  PetscCheck(info == 0, PETSC_COMM_SELF, PETSC_ERR_LIB, "LAPACK's getrs refused argument %d", (int)-info);
  for (size_t g = 0; g < N; ++g) p->at_interface[g] *= p->col_scale[g];
  for (size_t j = 0; j < w; ++j) p->at_local[j] = p->at_interface[s.local[j]];
  PetscFunctionReturn(0);
}

PetscErrorCode PartsSolve(KluParts *p, const PetscScalar b[], PetscScalar x[])
{
  const PartsSplit &s   = p->split;
  const KluPair    *klu = p->klu;
  const size_t      w   = s.local.size();

  PetscFunctionBegin;
  if (klu) SolveForward(p, *klu, b);
  if (!s.interface.empty()) {
    PetscCall(SolveInterface(p, b));
    for (size_t r = 0; r < p->reach.size(); ++r) {
      const PetscScalar *y   = p->right_part.data() + r * w;
      PetscScalar        sum = 0;
      for (size_t j = 0; j < w; ++j) sum += y[j] * p->at_local[j];
      p->work[p->reach[r]] -= sum;
    }
    for (PetscInt i : s.interface_row) x[i] = p->at_interface[-1 - s.number[i]];
  }
  if (klu) {
    SolveBackward(p, *klu, x);
    PetscCall(PetscLogFlops(2.0 * ((double)klu->numeric->lnz + (double)klu->numeric->unz) +
                            4.0 * (double)w * (double)p->reach.size()));
  }
  PetscFunctionReturn(0);
}

#endif
