/* Options that were set and never read, unused.cpp. */
#ifndef HHTDAE_UNUSED_H
#define HHTDAE_UNUSED_H

#include "integrator/compat.h"
#include "hhtdae/hhtdae.h"
#include "hhtdae/options.h"

namespace hht3
{

/* Prints them; collective on PETSC_COMM_WORLD, called when PETSc ends */
PetscErrorCode ReportUnusedOptions(void);
void           NoteRanks(MPI_Comm comm); /* the library is at work on all ranks of this one */
PetscErrorCode ForgetOptions(void); /* but our own */

} // namespace hht3

#endif
