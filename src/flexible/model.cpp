/* FeModel: construction, destruction and node sets, common to all its origins. */
#include "hhtdae/flexible.h"
#include "flexible/exchange.h"
#include <algorithm>

namespace hhtdae
{

FeModel::FeModel(MPI_Comm c) : comm(c) {}

FeModel::~FeModel()
{
  PetscBool gone = PETSC_FALSE;
  if (PetscFinalized(&gone) || gone) return; /* PETSc has been finalized: its objects no longer exist */
  PetscCallAbort(PETSC_COMM_SELF, MatDestroy(&K));
  PetscCallAbort(PETSC_COMM_SELF, MatDestroy(&M));
}

PetscErrorCode FeModel::addSet(const std::string &name, const std::vector<PetscInt> &own_nodes)
{
  std::vector<PetscInt> set = own_nodes;
  std::string           error;
  PetscFunctionBegin;
  if (name.empty())
    error = "a set of nodes needs a name";
  else if (sets.count(name))
    error = "there is a set of nodes " + name + " already";
  for (PetscInt n : own_nodes)
    if ((n < first || n >= first + own) && error.empty())
      error = "set " + name + ": node " + std::to_string(n) + " is not among the rank's own nodes " +
              std::to_string(first) + " .. " + std::to_string(first + own - 1);
  PetscCall(Agree(comm, error, PETSC_ERR_ARG_WRONG));
  std::sort(set.begin(), set.end());
  set.erase(std::unique(set.begin(), set.end()), set.end());
  sets[name] = set;
  PetscFunctionReturn(0);
}

} // namespace hhtdae
