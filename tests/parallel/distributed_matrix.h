/* Distributed matrices for the tests of linear solvers */
#ifndef HHTDAE_TEST_DISTRIBUTED_MATRIX_H
#define HHTDAE_TEST_DISTRIBUTED_MATRIX_H

#include "../bench/linear_matrices.h"
#include "support.h"

namespace hhtest
{

/* This rank has the rows begin to end - 1 */
inline Mat distributed(const Triplets &e, PetscInt begin, PetscInt end)
{
  Mat                      A;
  std::vector<PetscInt>    row, col;
  std::vector<PetscScalar> val;
  for (std::size_t k = 0; k < e.row.size(); k++)
    if (e.row[k] >= begin && e.row[k] < end) {
      row.push_back(e.row[k]);
      col.push_back(e.col[k]);
      val.push_back(e.val[k]);
    }
  must(MatCreate(PETSC_COMM_WORLD, &A));
  must(MatSetSizes(A, end - begin, end - begin, e.n, e.n));
  must(MatSetType(A, MATAIJ));
  must(MatSetPreallocationCOO(A, (PetscCount)row.size(), row.data(), col.data()));
  must(MatSetValuesCOO(A, val.data(), INSERT_VALUES));
  return A;
}

/* Almost all rows on the first ranks, so that one of three ranks has almost none */
inline Mat distributed(const Triplets &e)
{
  PetscMPIInt rank, size;
  MPI_Comm_rank(PETSC_COMM_WORLD, &rank);
  MPI_Comm_size(PETSC_COMM_WORLD, &size);
  return distributed(e, rank == 0 ? 0 : e.n * 2 / 3 + rank - 1, rank == size - 1 ? e.n : e.n * 2 / 3 + rank);
}

} // namespace hhtest

#endif
