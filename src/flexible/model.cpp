/* A finite-element model: what all its sources share. */
#include "hhtdae/flexible.h"

namespace hhtdae
{

FeModel::FeModel(MPI_Comm c) : comm(c) {}

FeModel::~FeModel()
{
  PetscBool gone = PETSC_FALSE;
  if (PetscFinalized(&gone) || gone) return; /* PETSc has taken everything with it */
  PetscCallAbort(PETSC_COMM_SELF, MatDestroy(&K));
  PetscCallAbort(PETSC_COMM_SELF, MatDestroy(&M));
}

} // namespace hhtdae
