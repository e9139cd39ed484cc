/* Messages between ranks as vectors of plain structs, parts of distributed things, and errors that all ranks raise
 * together. */
#ifndef HHTDAE_FLEXIBLE_EXCHANGE_H
#define HHTDAE_FLEXIBLE_EXCHANGE_H

#include <petscsys.h>
#include <string>
#include <type_traits>
#include <vector>

namespace hhtdae
{

/* If a rank has a problem, all ranks raise the error with the text of the first such rank. Collective */
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

/* Pieces of a distributed thing, one after the other: this rank's first and the number of all. Collective */
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

/* Begin of part r of n things divided among `parts` as evenly as possible */
inline PetscInt64 PartBegin(PetscInt64 n, PetscMPIInt parts, PetscMPIInt r)
{
  return n / parts * r + (n % parts < r ? n % parts : r);
}

namespace detail
{
/* A type of T's size, so that counts are of entries and not of bytes */
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

/* out[r] goes to rank r; what came from rank r is at in[from[r]] .. in[from[r + 1]] */
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

/* Answers to an Exchange: answer[k] belongs to in[k]; what comes back from rank r is in the order of out[r], put end to
 * end */
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

/* All of every rank's, in the order of ranks, on rank 0; of[r] is where rank r's begin */
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

/* The way back of GatherTo0 */
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

/* All of every rank's on every rank */
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
