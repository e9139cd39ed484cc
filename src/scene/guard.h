/* Users' functions may throw. Exceptions are converted to PETSc's error codes, since they must not pass through PETSc's C functions. */
#ifndef HHTDAE_SCENE_GUARD_H
#define HHTDAE_SCENE_GUARD_H

#include <exception>
#include <petscsys.h>

namespace hhtdae
{

template <class Call> PetscErrorCode Guarded(Call call)
{
  try {
    return call();
  } catch (const std::exception &e) {
    SETERRQ(PETSC_COMM_SELF, PETSC_ERR_USER, "A function of the scene's user has failed: %s", e.what());
  } catch (...) {
    SETERRQ(PETSC_COMM_SELF, PETSC_ERR_USER, "A function of the scene's user has thrown something that is no std::exception");
  }
}

/* Raises an error of one rank, with its text, on all ranks. A user's function may fail on one rank only, and the others
   would wait forever in their next collective call. Collective; on one rank it costs nothing. Test:
   Ranks.test_errors_of_one_rank of test_parallel.py. */
inline PetscErrorCode OnAllRanks(MPI_Comm comm, PetscErrorCode code)
{
  PetscMPIInt size, rank, mine, first;
  char        text[1024] = "";
  PetscFunctionBegin;
  PetscCallMPI(MPI_Comm_size(comm, &size));
  if (size == 1) PetscFunctionReturn(code);
  PetscCallMPI(MPI_Comm_rank(comm, &rank));
  mine = code ? rank : size;
  PetscCallMPI(MPI_Allreduce(&mine, &first, 1, MPI_INT, MPI_MIN, comm));
  if (first == size) PetscFunctionReturn(PetscErrorCode(0));
  if (rank == first) {
    char *specific = nullptr;
    PetscCall(PetscErrorMessage(code, nullptr, &specific));
    PetscCall(PetscStrncpy(text, specific ? specific : "", sizeof(text)));
  }
  PetscCallMPI(MPI_Bcast(text, sizeof(text), MPI_CHAR, first, comm));
  if (code) PetscFunctionReturn(code);
  SETERRQ(PETSC_COMM_SELF, PETSC_ERR_USER, "On rank %d: %s", (int)first, text);
}

} // namespace hhtdae

#endif
