/* Options that were set and that no object has read, unused.cpp. */
#ifndef HHTDAE_UNUSED_H
#define HHTDAE_UNUSED_H

#include "integrator/compat.h"
#include "hhtdae/hhtdae.h"
#include "hhtdae/options.h"

namespace hht3
{

/* Prints them; collective on PETSC_COMM_WORLD, called by PetscFinalize() */
PetscErrorCode ReportUnusedOptions(void);
void           NoteRanks(MPI_Comm comm); /* all ranks of comm use the library */
PetscErrorCode ForgetOptions(void); /* forgets the lists of TSHHT3DeclareOptions() */

} // namespace hht3

#endif
