/* The analysis of "mumpsnd": finds the ordering for MUMPS */
#include <petscconf.h>
#if defined(PETSC_HAVE_MUMPS) && defined(PETSC_USE_REAL_DOUBLE) && !defined(PETSC_USE_COMPLEX)

#include "graph.h"
#include "linear.h"
#include "mumpsnd_data.h"
#include <cstring>
#include <string>
#include <unordered_set>

static_assert(sizeof(MUMPS_INT) == sizeof(int), "MUMPS with 64-bit integers throughout is not supported");

namespace
{

/* An off-diagonal entry of a row without a value on its diagonal: the row's multiplier can be eliminated right after the unknown `col` */
struct EliminationPartner {
  PetscInt  col;
  PetscReal size;
};

} // namespace

/* (*of)[row - begin] lists the possible partners, none if the diagonal has a value. If A stores one triangle, the mirrored entries of own rows are
   included, too, those of other ranks' rows are not. */
static PetscErrorCode FindEliminationPartners(Mat A, std::vector<std::vector<EliminationPartner>> *of)
{
  PetscInt           begin, end, count;
  const PetscInt    *cols;
  const PetscScalar *vals;
  PetscBool          triangle;

  PetscFunctionBegin;
  PetscCall(LinearStoresTriangle(A, &triangle));
  PetscCall(MatGetOwnershipRange(A, &begin, &end));
  std::vector<char> no_diagonal(end - begin, 1);
  of->assign(end - begin, {});
  PetscCall(MatGetRowUpperTriangular(A));
  for (int pass = 0; pass < 2; ++pass)
    for (PetscInt i = begin; i < end; ++i) {
      PetscCall(MatGetRow(A, i, &count, &cols, &vals));
      for (PetscInt k = 0; k < count; ++k) {
        const PetscInt  j    = cols[k];
        const PetscReal size = PetscAbsScalar(vals[k]);
        if (pass == 0) {
          if (j == i && size > 0) no_diagonal[i - begin] = 0;
          continue;
        }
        if (j == i || !(size > 0) || (triangle && j < i)) continue;
        if (no_diagonal[i - begin]) (*of)[i - begin].push_back({j, size});
        if (triangle && j < end && no_diagonal[j - begin]) (*of)[j - begin].push_back({i, size});
      }
      PetscCall(MatRestoreRow(A, i, &count, &cols, &vals));
    }
  PetscCall(MatRestoreRowUpperTriangular(A));
  PetscFunctionReturn(0);
}

/* For every owned row without a value on the diagonal: the column of its largest entry that no other such row took */
static PetscErrorCode FindPartners(Mat A, std::vector<int> *partner)
{
  std::vector<std::vector<EliminationPartner>> candidates;
  std::unordered_set<PetscInt>        taken;

  PetscFunctionBegin;
  PetscCall(FindEliminationPartners(A, &candidates));
  partner->assign(candidates.size(), -1);
  for (size_t i = 0; i < candidates.size(); ++i) {
    PetscReal largest = 0;
    for (const EliminationPartner &c : candidates[i])
      if (c.size > largest && !taken.count(c.col)) {
        largest       = c.size;
        (*partner)[i] = (int)c.col;
      }
    if (largest > 0) taken.insert((*partner)[i]);
  }
  PetscFunctionReturn(0);
}

template <class P>
static PetscErrorCode GatherToFirst(const MumpsND<P> *m, const std::vector<int> &local, std::vector<int> *all)
{
  PetscMPIInt              count = (PetscMPIInt)local.size();
  PetscInt64               total = (PetscInt64)local.size();
  std::vector<PetscMPIInt> counts(m->size), starts(m->size + 1, 0);

  PetscFunctionBegin;
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &total, 1, MPIU_INT64, MPI_SUM, m->comm));
  PetscCheck(total <= PETSC_MPI_INT_MAX, m->comm, PETSC_ERR_ARG_OUTOFRANGE,
             "The matrix has more entries than one MPI message can carry; use -pc_factor_mat_solver_type mumps");
  PetscCallMPI(MPI_Gather(&count, 1, MPI_INT, counts.data(), 1, MPI_INT, 0, m->comm));
  for (PetscMPIInt r = 0; r < m->size && m->rank == 0; ++r) starts[r + 1] = starts[r] + counts[r];
  all->resize(starts[m->size]);
  PetscCallMPI(
      MPI_Gatherv(local.data(), count, MPI_INT, all->data(), counts.data(), starts.data(), MPI_INT, 0, m->comm));
  PetscFunctionReturn(0);
}

/* Inverts an ordering, which lists unknowns, or blocks of them, by position, to positions of unknowns as PERM_IN wants them. PETSc orders the blocks of MATSBAIJ
   (MatrixTypes.OrderingsOfBlocks). */
template <class P> static void SetPositions(const PetscInt order[], PetscInt count, MumpsND<P> *m)
{
  const PetscInt block = m->id.n / PetscMax(count, 1);
  m->position.resize(m->id.n);
  for (PetscInt k = 0; k < count; ++k)
    for (PetscInt b = 0; b < block; ++b) m->position[block * order[k] + b] = (MUMPS_INT)(block * k + b + 1);
}

template <class P>
static PetscErrorCode OrderOnFirst(const std::vector<int> &row, const std::vector<int> &col, const std::vector<int> &partners, MumpsND<P> *m)
{
  std::vector<PetscInt> order;
  LinearGraph           graph;

  PetscFunctionBegin;
  LinearGraphFromEntries<int>(m->id.n, row.size(), row.data(), col.data(), 1, &graph);
  PetscCall(LinearMetisOrder(graph, std::vector<PetscInt>(partners.begin(), partners.end()), &order));
  SetPositions(order.data(), (PetscInt)order.size(), m);
  PetscFunctionReturn(0);
}

template <class P> static PetscErrorCode OrderByMetis(Mat A, MumpsND<P> *m)
{
  std::vector<int> partner, row, col, partners;
  PetscMPIInt      failed = 0;

  PetscFunctionBegin;
  PetscCall(FindPartners(A, &partner));
  PetscCall(GatherToFirst(m, partner, &partners));
  PetscCall(GatherToFirst(m, m->row, &row));
  PetscCall(GatherToFirst(m, m->col, &col));
  if (!m->rank) failed = OrderOnFirst(row, col, partners, m);
  PetscCallMPI(MPI_Bcast(&failed, 1, MPI_INT, 0, m->comm)); /* else the other ranks would wait in MUMPS for rank 0, which returns with an error */
  if (!m->rank) PetscCall((PetscErrorCode)failed);
  PetscCheck(!failed, m->comm, (PetscErrorCode)failed, "METIS could not order the matrix on the first rank");
  PetscFunctionReturn(0);
}

template <class P> static void AnalyseGiven(MumpsND<P> *m, const char name[])
{
  m->icntl(7)   = 1;
  m->id.perm_in = m->rank ? NULL : m->position.data();
  strcpy(m->ordering, name);
  MumpsRun(m, MUMPS_ANALYSIS);
}

template <class P> static void AnalyseBuiltIn(MumpsND<P> *m, MUMPS_INT choice)
{
  static const char *const names[] = {"AMD", "given", "AMF", "Scotch", "PORD", "METIS", "QAMD"};
  m->icntl(7)                      = choice;
  MumpsRun(m, MUMPS_ANALYSIS);
  const int used = m->infog(7);
  strcpy(m->ordering, used >= 0 && used <= 6 ? names[used] : "MUMPS's own");
}

/* Takes METIS' ordering or MUMPS' own choice, whichever has fewer predicted operations, RINFOG(1) */
template <class P> static PetscErrorCode AnalyseBest(Mat A, MumpsND<P> *m)
{
  const MUMPS_INT automatic = 7;

  PetscFunctionBegin;
  PetscCall(OrderByMetis(A, m));
  AnalyseBuiltIn(m, automatic);
  const bool   failed = m->infog(1) < 0;
  const double own    = m->rinfog(1);
  AnalyseGiven(m, "METIS");
  PetscCall(PetscInfo(A, "Operations foreseen by MUMPS: %g with METIS, %g with its own ordering\n", m->rinfog(1), own));
  if (!failed && (m->infog(1) < 0 || m->rinfog(1) > own)) AnalyseBuiltIn(m, automatic);
  PetscFunctionReturn(0);
}

template <class P> void MumpsNDAnalyseAgain(MumpsND<P> *m, MUMPS_INT ordering)
{
  if (ordering == 1)
    AnalyseGiven(m, std::string(m->ordering).c_str());
  else
    AnalyseBuiltIn(m, ordering);
}

template <class P> PetscErrorCode MumpsNDAnalyse(Mat A, IS given, MumpsND<P> *m)
{
  PetscFunctionBegin;
  if (given) {
    const PetscInt *order;
    PetscInt        count;
    PetscCall(ISGetLocalSize(given, &count));
    PetscCall(ISGetIndices(given, &order));
    SetPositions(order, count, m);
    PetscCall(ISRestoreIndices(given, &order));
    AnalyseGiven(m, "given by PETSc");
  } else if (m->user_ordering)
    AnalyseBuiltIn(m, m->icntl(7));
  else
    PetscCall(AnalyseBest(A, m));
  PetscFunctionReturn(0);
}

template void           MumpsNDAnalyseAgain(MumpsND<MumpsDouble> *, MUMPS_INT);
template PetscErrorCode MumpsNDAnalyse(Mat, IS, MumpsND<MumpsDouble> *);
#if defined(HHTDAE_HAVE_SMUMPS)
template void           MumpsNDAnalyseAgain(MumpsND<MumpsSingle> *, MUMPS_INT);
template PetscErrorCode MumpsNDAnalyse(Mat, IS, MumpsND<MumpsSingle> *);
#endif

#endif
