#include "pattern.h"
#include <algorithm>

namespace hhtdae
{

/* Determines the sorted columns of each group of rows, then the slots of all requests */
void Pattern::build(PetscInt start, PetscInt n)
{
  struct Column {
    PetscInt group;
    bool     diagonal;
    PetscInt at; /* position of the first entry in the row of the diagonal or off-diagonal part */
  };
  const std::size_t     groups = group.size();
  std::vector<PetscInt> first(groups + 1, 0);
  const auto            stored = [&](const Request &r) { return r.row >= 0 && !toFrame(r) && group[r.row].own; };
  for (const Request &r : request_)
    if (stored(r)) first[r.row + 1]++;
  for (std::size_t g = 0; g < groups; g++) first[g + 1] += first[g];
  std::vector<Column>   columns(first.back());
  std::vector<PetscInt> fill(first.begin(), first.end() - 1), last(groups);
  for (const Request &r : request_)
    if (stored(r)) columns[fill[r.row]++] = {r.column, r.diagonal, 0};

  /* Columns become unique and sorted by global number, own ones first. A block is diagonal if all requests for it are */
  const auto before = [&](const Column &a, const Column &b) {
    const Group &x = group[a.group], &y = group[b.group];
    return x.own != y.own ? x.own : x.global < y.global;
  };
  const auto width = [&](const Column &c) { return c.diagonal ? 1 : group[c.group].size; };
  std::vector<PetscInt> width_own(groups, 0), width_other(groups, 0);
  di.assign(n + 1, 0);
  oi.assign(n + 1, 0);
  for (std::size_t g = 0; g < groups; g++) {
    std::sort(columns.begin() + first[g], columns.begin() + first[g + 1], before);
    last[g] = first[g];
    for (PetscInt k = first[g]; k < first[g + 1]; k++) {
      if (last[g] > first[g] && columns[last[g] - 1].group == columns[k].group) columns[last[g] - 1].diagonal &= columns[k].diagonal;
      else columns[last[g]++] = columns[k];
    }
    for (PetscInt k = first[g]; k < last[g]; k++) {
      PetscInt &sum = (group[columns[k].group].own ? width_own : width_other)[g];
      columns[k].at = sum;
      sum += width(columns[k]);
    }
    for (PetscInt r = 0; r < group[g].size && group[g].own; r++) {
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
  for (std::size_t g = 0; g < groups; g++)
    for (PetscInt r = 0; r < group[g].size && group[g].own; r++) {
      PetscInt d = di[group[g].local + r], o = oi[group[g].local + r];
      for (PetscInt k = first[g]; k < last[g]; k++) {
        const Group &c = group[columns[k].group];
        for (PetscInt e = columns[k].diagonal ? r : 0; e < (columns[k].diagonal ? r + 1 : c.size); e++) {
          if (c.own) dj[d++] = c.global + e - start;
          else oj[o++] = c.global + e;
        }
      }
    }

  slot_.resize(request_.size());
  for (std::size_t q = 0; q < request_.size(); q++) {
    const PetscInt g = request_[q].row, c = request_[q].column;
    Slot          &s = slot_[q];
    s = Slot();
    if (!stored(request_[q])) continue;
    const auto found = std::lower_bound(columns.begin() + first[g], columns.begin() + last[g], Column{c, false, 0}, before);
    s.off            = !group[c].own;
    s.stride         = (s.off ? width_other : width_own)[g];
    s.diagonal       = found->diagonal;
    s.base           = (s.off ? oi : di)[group[g].local] + found->at;
  }
}

void Pattern::release()
{
  std::vector<Request>().swap(request_);
  std::vector<Slot>().swap(slot_);
  for (std::vector<PetscInt> *x : {&di, &dj, &oi, &oj}) std::vector<PetscInt>().swap(*x);
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
    /* MatMPIAIJSetPreallocationCSR() takes one sorted list of global columns per row */
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
