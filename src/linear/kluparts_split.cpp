/* The blocks A, B, C and D of "kluparts" (kluparts_data.h), and the copying of values from the matrix to them */
#if defined(HHTDAE_HAVE_KLU)
#include "kluparts_data.h"
#include <algorithm>

typedef std::vector<PetscInt> Indices;

namespace
{

/* Read access to the diagonal and the off-diagonal block of a rank's rows */
struct RankBlocks {
  Mat             diagonal, off;
  LinearRows      d, o;
  const PetscInt *garray;
};

} // namespace

static PetscErrorCode GetBlocks(Mat A, RankBlocks *b)
{
  PetscFunctionBegin;
  PetscCall(MatMPIAIJGetSeqAIJ(A, &b->diagonal, &b->off, &b->garray));
  PetscCall(KluPairGetRows(b->diagonal, &b->d));
  PetscCall(KluPairGetRows(b->off, &b->o));
  PetscFunctionReturn(0);
}

static PetscErrorCode RestoreBlocks(RankBlocks *b)
{
  PetscFunctionBegin;
  PetscCall(KluPairRestoreRows(b->diagonal, &b->d));
  PetscCall(KluPairRestoreRows(b->off, &b->o));
  PetscFunctionReturn(0);
}

static void NumberRows(PartsSplit *s)
{
  const PetscInt n = s->end - s->begin;
  s->number.assign(n, 0);
  for (size_t g = 0; g < s->interface.size(); ++g)
    if (s->interface[g] >= s->begin && s->interface[g] < s->end)
      s->number[s->interface[g] - s->begin] = -1 - (PetscInt)g;
  for (PetscInt i = 0; i < n; ++i)
    if (s->number[i] < 0) {
      s->interface_row.push_back(i);
    } else {
      s->number[i] = (PetscInt)s->inner_row.size();
      s->inner_row.push_back(i);
    }
}

/* Number of a global row within the interface, or -1 */
static PetscInt InterfaceNumber(const PartsSplit &s, PetscInt row)
{
  const auto at = std::lower_bound(s.interface.begin(), s.interface.end(), row);
  return at != s.interface.end() && *at == row ? (PetscInt)(at - s.interface.begin()) : -1;
}

static void AddInner(PartsSplit *s, PetscInt col, PetscInt place)
{
  const PetscInt to = (PetscInt)s->col.size();
  s->col.push_back(col);
  if (!s->runs.empty() && s->runs.back().from + s->runs.back().count == place)
    ++s->runs.back().count; /* entries of the interior are appended without gaps */
  else
    s->runs.push_back({place, to, 1});
}

static void ClassifyDiagonal(const LinearRows &d, PartsSplit *s)
{
  s->start.assign(1, 0);
  for (PetscInt i = 0; i < d.n; ++i) {
    const PetscInt row = s->number[i];
    for (PetscInt k = d.start[i]; k < d.start[i + 1]; ++k) {
      const PetscInt col = s->number[d.col[k]];
      if (row >= 0 && col >= 0)
        AddInner(s, col, k);
      else
        (row >= 0   ? s->right
         : col >= 0 ? s->below
                    : s->corner)
            .push_back({row >= 0 ? row : -1 - row, col >= 0 ? col : -1 - col, k, PartsSource::Diagonal});
    }
    if (row >= 0) s->start.push_back((PetscInt)s->col.size());
  }
}

/* Entries of interface rows in columns of other ranks' interiors are listed as pairs of interface number and global column */
static PetscErrorCode ClassifyOffdiagonal(Mat A, const RankBlocks &b, PartsSplit *s, Indices *sent_positions)
{
  PetscFunctionBegin;
  for (PetscInt i = 0; i < b.o.n; ++i) {
    const PetscInt row = s->number[i];
    for (PetscInt k = b.o.start[i]; k < b.o.start[i + 1]; ++k) {
      const PetscInt global = b.garray[b.o.col[k]], col = InterfaceNumber(*s, global);
      if (row >= 0) {
        PetscCheck(col >= 0, PetscObjectComm((PetscObject)A), PETSC_ERR_PLIB,
                   "Coupling of rows %" PetscInt_FMT " and %" PetscInt_FMT " is not covered", s->begin + i, global);
        s->right.push_back({row, col, k, PartsSource::Offdiagonal});
      } else if (col >= 0) {
        s->corner.push_back({-1 - row, col, k, PartsSource::Offdiagonal});
      } else {
        s->sent.push_back(k);
        sent_positions->insert(sent_positions->end(), {-1 - row, global});
      }
    }
  }
  PetscFunctionReturn(0);
}

/* Exchanges the positions of sent entries; each rank adds those in its own columns to C */
static PetscErrorCode ExchangeSentEntries(MPI_Comm comm, const Indices &sent_positions, PartsSplit *s)
{
  PetscMPIInt size;
  PetscFunctionBegin;
  PetscCallMPI(MPI_Comm_size(comm, &size));
  const PetscMPIInt n = (PetscMPIInt)s->sent.size();
  s->counts.resize(size);
  s->first.assign(size, 0);
  PetscCallMPI(MPI_Allgather(&n, 1, MPI_INT, s->counts.data(), 1, MPI_INT, comm));
  for (PetscMPIInt r = 1; r < size; ++r) s->first[r] = s->first[r - 1] + s->counts[r - 1];
  const PetscMPIInt        total = s->first.back() + s->counts.back();
  std::vector<PetscMPIInt> counts2(s->counts), first2(s->first);
  for (PetscMPIInt r = 0; r < size; ++r) {
    counts2[r] *= 2;
    first2[r] *= 2;
  }
  Indices all(2 * (size_t)total);
  PetscCallMPI(MPI_Allgatherv(sent_positions.data(), 2 * n, MPIU_INT, all.data(), counts2.data(), first2.data(), MPIU_INT, comm));
  for (PetscMPIInt k = 0; k < total; ++k) {
    const PetscInt global = all[2 * k + 1];
    if (global < s->begin || global >= s->end) continue;
    s->below.push_back({all[2 * k], s->number[global - s->begin], k, PartsSource::Received});
  }
  s->send.resize(n);
  s->received.resize(total);
  PetscFunctionReturn(0);
}

/* Replaces interface numbers in B and C by numbers within `local` */
static void NumberLocal(PartsSplit *s)
{
  Indices number(s->interface.size(), -1);
  s->local.clear();
  for (const PartsEntry &e : s->right) number[e.col] = 0;
  for (const PartsEntry &e : s->below) number[e.row] = 0;
  for (PetscInt g = 0; g < (PetscInt)number.size(); ++g)
    if (number[g] == 0) {
      number[g] = (PetscInt)s->local.size();
      s->local.push_back(g);
    }
  for (PartsEntry &e : s->right) e.col = number[e.col];
  for (PartsEntry &e : s->below) e.row = number[e.row];
}

/* Divides the rank's rows for the interface that *split contains */
PetscErrorCode PartsBuildSplit(Mat A, PartsSplit *split)
{
  PartsSplit s;
  RankBlocks b;
  Indices    sent_positions;

  PetscFunctionBegin;
  s.interface.swap(split->interface);
  PetscCall(MatGetOwnershipRange(A, &s.begin, &s.end));
  PetscCall(GetBlocks(A, &b));
  NumberRows(&s);
  ClassifyDiagonal(b.d, &s);
  PetscCall(ClassifyOffdiagonal(A, b, &s, &sent_positions));
  PetscCall(RestoreBlocks(&b));
  PetscCall(ExchangeSentEntries(PetscObjectComm((PetscObject)A), sent_positions, &s));
  NumberLocal(&s);
  s.val.assign(s.col.size(), 0);
  s.right_val.resize(s.right.size());
  s.below_val.resize(s.below.size());
  s.corner_val.resize(s.corner.size());
  *split = std::move(s);
  PetscFunctionReturn(0);
}

/* ---- values ---- */

PetscErrorCode PartsCopyValues(Mat A, PartsSplit *s)
{
  const MPI_Comm     comm = PetscObjectComm((PetscObject)A);
  Mat                diagonal, off;
  const PetscInt    *garray;
  const PetscScalar *d, *o;

  PetscFunctionBegin;
  PetscCall(MatMPIAIJGetSeqAIJ(A, &diagonal, &off, &garray));
  PetscCall(MatSeqAIJGetArrayRead(diagonal, &d));
  PetscCall(MatSeqAIJGetArrayRead(off, &o));
  for (size_t k = 0; k < s->sent.size(); ++k) s->send[k] = o[s->sent[k]];
  if (!s->received.empty())
    PetscCallMPI(MPI_Allgatherv(s->send.data(), (PetscMPIInt)s->send.size(), MPIU_SCALAR, s->received.data(),
                                s->counts.data(), s->first.data(), MPIU_SCALAR, comm));
  for (const PartsRun &r : s->runs) std::copy(d + r.from, d + r.from + r.count, s->val.begin() + r.to);
  const PetscScalar *const sources[] = {d, o, s->received.data()};
  const auto               copy      = [&](const std::vector<PartsEntry> &entries, std::vector<PetscScalar> *val) {
    for (size_t k = 0; k < entries.size(); ++k) (*val)[k] = sources[(int)entries[k].source][entries[k].place];
  };
  copy(s->right, &s->right_val);
  copy(s->below, &s->below_val);
  copy(s->corner, &s->corner_val);
  PetscCall(MatSeqAIJRestoreArrayRead(off, &o));
  PetscCall(MatSeqAIJRestoreArrayRead(diagonal, &d));
  PetscFunctionReturn(0);
}

Indices PartsCoupledUnknowns(const PartsSplit &s)
{
  Indices ends;
  for (const PartsEntry &e : s.right) ends.push_back(e.row);
  for (const PartsEntry &e : s.below) ends.push_back(e.col);
  std::sort(ends.begin(), ends.end());
  ends.erase(std::unique(ends.begin(), ends.end()), ends.end());
  return ends;
}

PetscErrorCode PartsInnerMatrix(PartsSplit *s, Mat *inner)
{
  const PetscInt n = (PetscInt)s->inner_row.size();

  PetscFunctionBegin;
  PetscCall(MatCreateSeqAIJWithArrays(PETSC_COMM_SELF, n, n, s->start.data(), s->col.data(), s->val.data(), inner));
  PetscFunctionReturn(0);
}

#endif
