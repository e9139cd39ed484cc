/* Whether the machines of a communicator have room for what its processes are about to take */
#ifndef HHTDAE_LINEAR_MEMORY_H
#define HHTDAE_LINEAR_MEMORY_H

#include <petscsys.h>
#include <string>

/* Of the fullest machine, in MB */
struct LinearMemory {
  double need, free;
};

/* MB that processes of this machine may still take, swap space included and limits of the control groups observed; infinite where the system does not say.
   root: before /proc and /sys, for tests */
double LinearFreeMemory(const std::string &root = "");

/* mine: MB that this process will take; limit: MB for all processes of one machine, negative: what is free there. Collective, the same answer everywhere. */
PetscErrorCode LinearMemoryOf(MPI_Comm comm, double mine, double limit, LinearMemory *fullest);

#endif
