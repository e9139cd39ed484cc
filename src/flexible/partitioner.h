/* METIS as a PetscPartitioner, and helpers for graphs of cells. */
#ifndef HHTDAE_FLEXIBLE_PARTITIONER_H
#define HHTDAE_FLEXIBLE_PARTITIONER_H

#include <petscpartitioner.h>
#include <vector>

namespace hhtdae
{

/* The type's name: METIS inside PETSc, where it has one, is "parmetis" */
#define PETSCPARTITIONERMETISHHTDAE "metis_hhtdae"

PetscErrorCode RegisterMetisPartitioner();

/*
  The rank of each of this rank's cells. The graph has the neighbours of cell c (by global number) at adjacent[start[c]]
  .. adjacent[start[c + 1]]; cells are numbered through the ranks. METIS unless -petscpartitioner_type says otherwise.
*/
PetscErrorCode PartitionCells(MPI_Comm comm, std::vector<PetscInt> &start, std::vector<PetscInt> &adjacent,
                              std::vector<PetscInt> *rank);

} // namespace hhtdae

#endif
