#include "pattern.h"
#include <algorithm>

namespace hhtdae
{

/* Columns of each row group, sorted, then offsets of every block */
void Pattern::build(PetscInt start, PetscInt n)
{
  std::vector<PetscInt> first(group.size() + 1, 0);
  for (const Request &r : request_)
    if (r.row >= 0 && group[r.row].own) first[r.row + 1]++;
  for (std::size_t g = 0; g < group.size(); g++) first[g + 1] += first[g];
  std::vector<PetscInt> columns(first.back()), fill(first.begin(), first.end() - 1);
  for (const Request &r : request_)
    if (r.row >= 0 && group[r.row].own) columns[fill[r.row]++] = r.column;

  /* unique columns by global number; own ones before others'. Column groups of one owner are contiguous, so sizes add up. */
  std::vector<PetscInt> last(group.size());
  const auto before = [&](PetscInt a, PetscInt b) {
    return group[a].own != group[b].own ? group[a].own : group[a].global < group[b].global;
  };
  for (std::size_t g = 0; g < group.size(); g++) {
    auto begin = columns.begin() + first[g], end = columns.begin() + first[g + 1];
    std::sort(begin, end, before);
    last[g] = (PetscInt)(std::unique(begin, end) - columns.begin());
  }

  di.assign(n + 1, 0);
  oi.assign(n + 1, 0);
  std::vector<PetscInt> width_own(group.size(), 0), width_other(group.size(), 0);
  for (std::size_t g = 0; g < group.size(); g++) {
    if (!group[g].own) continue;
    for (PetscInt k = first[g]; k < last[g]; k++) {
      const Group &c = group[columns[k]];
      (c.own ? width_own : width_other)[g] += c.size;
    }
    for (PetscInt r = 0; r < group[g].size; r++) {
      di[group[g].local + r + 1] = width_own[g];
      oi[group[g].local + r + 1] = width_other[g];
    }
  }
  for (PetscInt i = 0; i < n; i++) {
    di[i + 1] += di[i];
    oi[i + 1] += oi[i];
  }
  dj.resize(di[n]);
  oj.resize(oi[n]);
  for (std::size_t g = 0; g < group.size(); g++) {
    if (!group[g].own) continue;
    for (PetscInt r = 0; r < group[g].size; r++) {
      PetscInt d = di[group[g].local + r], o = oi[group[g].local + r];
      for (PetscInt k = first[g]; k < last[g]; k++) {
        const Group &c = group[columns[k]];
        for (PetscInt e = 0; e < c.size; e++) {
          if (c.own) dj[d++] = c.global + e - start;
          else oj[o++] = c.global + e;
        }
      }
    }
  }

  slot_.resize(request_.size());
  for (std::size_t q = 0; q < request_.size(); q++) {
    const PetscInt g = request_[q].row, c = request_[q].column;
    Slot          &s = slot_[q];
    if (g < 0 || !group[g].own) continue;
    s.off            = !group[c].own;
    s.stride         = s.off ? width_other[g] : width_own[g];
    PetscInt at      = s.off ? oi[group[g].local] : di[group[g].local];
    const auto found = std::lower_bound(columns.begin() + first[g], columns.begin() + last[g], c, before);
    for (auto k = columns.begin() + first[g]; k != found; ++k)
      if (group[*k].own == group[c].own) at += group[*k].size;
    s.base = at;
  }
}

void Pattern::release()
{
  std::vector<Request>().swap(request_);
  std::vector<Slot>().swap(slot_);
}

PetscErrorCode Pattern::createMat(MPI_Comm comm, PetscInt n, Mat *A) const
{
  PetscMPIInt size;
  PetscFunctionBegin;
  PetscCallMPI(MPI_Comm_size(comm, &size));
  PetscCall(MatCreate(comm, A));
  PetscCall(MatSetSizes(*A, n, n, PETSC_DETERMINE, PETSC_DETERMINE));
  PetscCall(MatSetType(*A, MATAIJ));
  if (size == 1) {
    PetscCall(MatSeqAIJSetPreallocationCSR(*A, di.data(), dj.data(), nullptr));
  } else {
    /* one list of global columns per row, sorted */
    PetscInt start;
    std::vector<PetscInt> i(n + 1, 0), j;
    PetscLayout rows;
    PetscCall(MatGetLayouts(*A, &rows, nullptr));
    PetscCall(PetscLayoutSetUp(rows));
    PetscCall(PetscLayoutGetRange(rows, &start, nullptr));
    j.reserve(dj.size() + oj.size());
    for (PetscInt r = 0; r < n; r++) {
      const std::size_t begin = j.size();
      for (PetscInt k = di[r]; k < di[r + 1]; k++) j.push_back(dj[k] + start);
      for (PetscInt k = oi[r]; k < oi[r + 1]; k++) j.push_back(oj[k]);
      std::sort(j.begin() + begin, j.end());
      i[r + 1] = (PetscInt)j.size();
    }
    PetscCall(MatMPIAIJSetPreallocationCSR(*A, i.data(), j.data(), nullptr));
  }
  PetscCall(MatSetOption(*A, MAT_NEW_NONZERO_LOCATION_ERR, PETSC_TRUE));
  PetscFunctionReturn(0);
}

} // namespace hhtdae
