/* What reading and writing share: an error that one rank has found becomes the error of all of them. */
#ifndef HHTDAE_FLEXIBLE_AGREE_H
#define HHTDAE_FLEXIBLE_AGREE_H

#include <petscsys.h>
#include <string>

namespace hhtdae
{

/* Every rank gets the message of the lowest rank that has one; no message stays none. Collective */
inline PetscErrorCode Agree(MPI_Comm comm, std::string *message)
{
  PetscMPIInt rank, size, first, length;
  PetscFunctionBegin;
  PetscCallMPI(MPI_Comm_rank(comm, &rank));
  PetscCallMPI(MPI_Comm_size(comm, &size));
  const PetscMPIInt mine = message->empty() ? size : rank;
  PetscCallMPI(MPI_Allreduce(&mine, &first, 1, MPI_INT, MPI_MIN, comm));
  if (first == size) PetscFunctionReturn(0);
  length = (PetscMPIInt)message->size();
  PetscCallMPI(MPI_Bcast(&length, 1, MPI_INT, first, comm));
  message->resize((std::size_t)length);
  PetscCallMPI(MPI_Bcast(&(*message)[0], length, MPI_CHAR, first, comm));
  PetscFunctionReturn(0);
}

/* The same, and the message is raised as an error on all ranks */
inline PetscErrorCode RaiseTogether(MPI_Comm comm, PetscErrorCode code, std::string message)
{
  PetscFunctionBegin;
  PetscCall(Agree(comm, &message));
  PetscCheck(message.empty(), comm, code, "%s", message.c_str());
  PetscFunctionReturn(0);
}

/* Pieces of a distributed thing, one after the other: this rank's first and the number of all. Collective */
inline PetscErrorCode Place(MPI_Comm comm, PetscInt64 own, PetscInt64 *first, PetscInt64 *all)
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

} // namespace hhtdae

#endif
