/* Exchange of vectors of plain structs between ranks, division of distributed data, and errors that all ranks raise together. */
#ifndef HHTDAE_FLEXIBLE_EXCHANGE_H
#define HHTDAE_FLEXIBLE_EXCHANGE_H

#include <petscsys.h>
#include <string>
#include <type_traits>
#include <vector>

namespace hhtdae
{

/* If `problem` is not empty on a rank, all ranks raise the error with the text of the first such rank. Collective */
inline PetscErrorCode Agree(MPI_Comm comm, const std::string &problem, PetscErrorCode code = PETSC_ERR_FILE_UNEXPECTED)
{
  PetscMPIInt rank, size, mine, first;
  PetscFunctionBegin;
  PetscCallMPI(MPI_Comm_rank(comm, &rank));
  PetscCallMPI(MPI_Comm_size(comm, &size));
  mine = problem.empty() ? size : rank;
  PetscCallMPI(MPI_Allreduce(&mine, &first, 1, MPI_INT, MPI_MIN, comm));
  if (first == size) PetscFunctionReturn(0);
  int length = (int)problem.size();
  PetscCallMPI(MPI_Bcast(&length, 1, MPI_INT, first, comm));
  std::string text = problem;
  text.resize(length);
  PetscCallMPI(MPI_Bcast(&text[0], length, MPI_CHAR, first, comm));
  SETERRQ(comm, code, "%s", text.c_str());
}

/* For data distributed in rank order, `own` items on this rank: number of its first item and of all items. Collective */
inline PetscErrorCode RangeOnRank(MPI_Comm comm, PetscInt64 own, PetscInt64 *first, PetscInt64 *all)
{
  PetscMPIInt rank;
  PetscFunctionBegin;
  PetscCallMPI(MPI_Comm_rank(comm, &rank));
  PetscCallMPI(MPI_Allreduce(&own, all, 1, MPIU_INT64, MPI_SUM, comm));
  *first = 0;
  PetscCallMPI(MPI_Exscan(&own, first, 1, MPIU_INT64, MPI_SUM, comm));
  if (!rank) *first = 0; /* MPI leaves it undefined there */
  PetscFunctionReturn(0);
}

/* First item of part r when n items are divided among `parts` as evenly as possible */
inline PetscInt64 PartBegin(PetscInt64 n, PetscMPIInt parts, PetscMPIInt r)
{
  return n / parts * r + (n % parts < r ? n % parts : r);
}

namespace detail
{
/* An MPI type of T's size, so that counts are numbers of entries, not of bytes */
template <class T> struct Type {
  MPI_Datatype type;
  Type()
  {
    static_assert(std::is_trivially_copyable<T>::value, "plain data");
    MPI_Type_contiguous(sizeof(T), MPI_BYTE, &type);
    MPI_Type_commit(&type);
  }
  ~Type() { MPI_Type_free(&type); }
  Type(const Type &) = delete;
};
} // namespace detail

/* Sends out[r] to rank r; the data from rank r are in[from[r]] to in[from[r + 1] - 1] */
template <class T>
PetscErrorCode Exchange(MPI_Comm comm, const std::vector<std::vector<T>> &out, std::vector<T> *in,
                        std::vector<std::size_t> *from)
{
  PetscMPIInt size;
  PetscFunctionBegin;
  PetscCallMPI(MPI_Comm_size(comm, &size));
  std::vector<int> to_count(size), to(size + 1, 0), count(size), place(size + 1, 0);
  for (int r = 0; r < size; r++) {
    to_count[r] = (int)out[r].size();
    to[r + 1]   = to[r] + to_count[r];
  }
  PetscCallMPI(MPI_Alltoall(to_count.data(), 1, MPI_INT, count.data(), 1, MPI_INT, comm));
  for (int r = 0; r < size; r++) place[r + 1] = place[r] + count[r];
  std::vector<T> packed;
  packed.reserve(to[size] + 1);
  for (const std::vector<T> &o : out) packed.insert(packed.end(), o.begin(), o.end());
  in->clear();
  in->resize(place[size]);
  in->reserve(1);
  const detail::Type<T> type;
  PetscCallMPI(MPI_Alltoallv(packed.data(), to_count.data(), to.data(), type.type, in->data(), count.data(),
                             place.data(), type.type, comm));
  from->assign(place.begin(), place.end());
  PetscFunctionReturn(0);
}

/* Returns answers to an Exchange(): answer[k] belongs to in[k]; *back has the answers in the order of out[0], out[1], ..., those of rank r from place[r] on */
template <class T>
PetscErrorCode Answer(MPI_Comm comm, const std::vector<T> &answer, const std::vector<std::size_t> &from,
                      std::vector<T> *back, std::vector<std::size_t> *place)
{
  PetscFunctionBegin;
  std::vector<std::vector<T>> out(from.size() - 1);
  for (std::size_t r = 0; r + 1 < from.size(); r++)
    out[r].assign(answer.begin() + from[r], answer.begin() + from[r + 1]);
  PetscCall(Exchange(comm, out, back, place));
  PetscFunctionReturn(0);
}

/* Gathers the data of all ranks, in rank order, on rank 0; those of rank r begin at of[r] */
template <class T>
PetscErrorCode GatherTo0(MPI_Comm comm, const T *mine, std::size_t n, std::vector<T> *all, std::vector<std::size_t> *of)
{
  PetscMPIInt size, rank;
  PetscFunctionBegin;
  PetscCallMPI(MPI_Comm_size(comm, &size));
  PetscCallMPI(MPI_Comm_rank(comm, &rank));
  std::vector<int> count(size), place(size + 1, 0);
  int              own = (int)n;
  PetscCallMPI(MPI_Gather(&own, 1, MPI_INT, count.data(), 1, MPI_INT, 0, comm));
  for (int r = 0; r < size; r++) place[r + 1] = place[r] + count[r];
  all->clear();
  if (rank == 0) all->resize(place[size]);
  const detail::Type<T> type;
  PetscCallMPI(MPI_Gatherv(mine, own, type.type, all->data(), count.data(), place.data(), type.type, 0, comm));
  of->assign(place.begin(), place.end());
  PetscFunctionReturn(0);
}

/* The reverse of GatherTo0() */
template <class T>
PetscErrorCode ScatterFrom0(MPI_Comm comm, const std::vector<T> &all, const std::vector<std::size_t> &of, std::size_t n,
                            std::vector<T> *mine)
{
  PetscMPIInt size;
  PetscFunctionBegin;
  PetscCallMPI(MPI_Comm_size(comm, &size));
  std::vector<int> count(size), place(size);
  for (int r = 0; r < size; r++) {
    place[r] = (int)of[r];
    count[r] = (int)(of[r + 1] - of[r]);
  }
  mine->resize(n);
  const detail::Type<T> type;
  PetscCallMPI(
      MPI_Scatterv(all.data(), count.data(), place.data(), type.type, mine->data(), (int)n, type.type, 0, comm));
  PetscFunctionReturn(0);
}

/* Gathers the data of all ranks, in rank order, on every rank */
template <class T> PetscErrorCode GatherAll(MPI_Comm comm, const std::vector<T> &mine, std::vector<T> *all)
{
  PetscMPIInt size;
  PetscFunctionBegin;
  PetscCallMPI(MPI_Comm_size(comm, &size));
  std::vector<int> count(size), place(size + 1, 0);
  int              own = (int)mine.size();
  PetscCallMPI(MPI_Allgather(&own, 1, MPI_INT, count.data(), 1, MPI_INT, comm));
  for (int r = 0; r < size; r++) place[r + 1] = place[r] + count[r];
  all->resize(place[size]);
  const detail::Type<T> type;
  PetscCallMPI(MPI_Allgatherv(mine.data(), own, type.type, all->data(), count.data(), place.data(), type.type, comm));
  PetscFunctionReturn(0);
}

} // namespace hhtdae

#endif
