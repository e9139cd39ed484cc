/* Whether the machines of a communicator have enough free memory for what its processes are about to allocate */
#ifndef HHTDAE_LINEAR_MEMORY_H
#define HHTDAE_LINEAR_MEMORY_H

#include <petscsys.h>
#include <string>

/* MB needed and free on the machine with the least left over */
struct LinearMemory {
  double need, free;
};

/* MB that processes of this machine may still allocate: available memory and swap space, or less where control groups limit it; infinite where the system does not say.
   root: directory that contains proc and sys, for tests */
double LinearFreeMemory(const std::string &root = "");

/* mine: MB that this process will allocate; limit: MB for all processes of one machine, or negative for what is free there. Collective, the same result on all ranks. */
PetscErrorCode LinearMemoryOf(MPI_Comm comm, double mine, double limit, LinearMemory *fullest);

#endif
