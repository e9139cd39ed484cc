/* What the checks of a finite-element model share: nodes that stand out and are named in messages, and the size of entries. */
#ifndef HHTDAE_FLEXIBLE_DIAGNOSE_NODES_H
#define HHTDAE_FLEXIBLE_DIAGNOSE_NODES_H

#include "diagnose.h"
#include <string>
#include <vector>

namespace hhtdae
{

/* Couplings in K that count as none, relative to its largest entry: what is left of cancelling terms */
constexpr double no_coupling = 1e-15;

struct Ranked {
  double   value;
  PetscInt label;
};

/* The highest of all ranks, at most five */
PetscErrorCode Highest(MPI_Comm comm, std::vector<Ranked> mine, std::vector<Ranked> *all);
/* Own nodes that are bad: how many on all ranks and the first labels */
PetscErrorCode NameNodes(const FeModel &model, const std::vector<PetscInt> &bad, PetscInt *count, std::string *labels);
/* Largest absolute entry of A, on all ranks */
PetscErrorCode LargestEntry(MPI_Comm comm, Mat A, double *largest);

} // namespace hhtdae

#endif
