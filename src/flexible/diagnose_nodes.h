/* Functions shared by the checks of a finite-element model: nodes to be named in messages, and the largest entry of a matrix. */
#ifndef HHTDAE_FLEXIBLE_DIAGNOSE_NODES_H
#define HHTDAE_FLEXIBLE_DIAGNOSE_NODES_H

#include "diagnose.h"
#include <string>
#include <vector>

namespace hhtdae
{

/* Smaller entries of K, relative to its largest one, are rounding of cancelled terms and do not couple nodes */
constexpr double coupling_tolerance = 1e-15;

struct NodeValue {
  double   value;
  PetscInt label;
};

/* The largest values of all ranks, at most five */
PetscErrorCode Highest(MPI_Comm comm, std::vector<NodeValue> mine, std::vector<NodeValue> *all);
/* bad: own nodes; *count: their number on all ranks; *labels: the first ones, for a message */
PetscErrorCode NameNodes(const FeModel &model, const std::vector<PetscInt> &bad, PetscInt *count, std::string *labels);
/* Largest absolute entry of A, on all ranks */
PetscErrorCode LargestEntry(MPI_Comm comm, Mat A, double *largest);

} // namespace hhtdae

#endif
