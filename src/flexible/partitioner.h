/* METIS as a PetscPartitioner, and the partition of a mesh by its graph of cells. */
#ifndef HHTDAE_FLEXIBLE_PARTITIONER_H
#define HHTDAE_FLEXIBLE_PARTITIONER_H

#include <petscpartitioner.h>
#include <vector>

namespace hhtdae
{

/* Name of the type; PETSc's own interface, if installed, is "parmetis" */
#define PETSCPARTITIONERMETISHHTDAE "metis_hhtdae"

PetscErrorCode RegisterMetisPartitioner();

/*
  Computes the new rank of each of this rank's cells. The neighbours of cell c, by global number, are adjacent[start[c]]
  to adjacent[start[c + 1] - 1]; cells are numbered in rank order. Uses METIS unless -petscpartitioner_type selects another type.
*/
PetscErrorCode PartitionCells(MPI_Comm comm, std::vector<PetscInt> &start, std::vector<PetscInt> &adjacent,
                              std::vector<PetscInt> *rank);

} // namespace hhtdae

#endif
