/*
  The rows of a rank of a MATAIJ by local columns: those of own unknowns are 0 to own - 1, those of other ranks' unknowns follow in the order of their global numbers.
*/
#ifndef HHTDAE_LINEAR_LOCAL_ROWS_H
#define HHTDAE_LINEAR_LOCAL_ROWS_H

#include <petscmat.h>

struct LocalRows {
  Mat             diagonal = nullptr, off = nullptr; /* blocks of own columns and of other columns; borrowed references */
  const PetscInt *garray = nullptr;                  /* global numbers of the other columns */
  PetscInt        begin = 0, own = 0, others = 0;    /* first global row; numbers of own and of other columns */

  PetscInt global(PetscInt column) const { return column < own ? begin + column : garray[column - own]; }

  /* Calls use(column, value) for each entry of own row i, counted from 0 */
  template <class Use> PetscErrorCode forRow(PetscInt i, Use use) const
  {
    const Mat part[2] = {diagonal, off};

    PetscFunctionBegin;
    for (int k = 0; k < 2; k++) {
      PetscInt           n;
      const PetscInt    *column;
      const PetscScalar *value;
      if (!part[k]) continue;
      PetscCall(MatGetRow(part[k], i, &n, &column, &value));
      for (PetscInt j = 0; j < n; j++) use(column[j] + (k ? own : 0), value[j]);
      PetscCall(MatRestoreRow(part[k], i, &n, &column, &value));
    }
    PetscFunctionReturn(0);
  }
};

inline PetscErrorCode LinearLocalRows(Mat A, LocalRows *rows)
{
  PetscBool mpi;

  PetscFunctionBegin;
  *rows = LocalRows();
  PetscCall(MatGetOwnershipRange(A, &rows->begin, NULL));
  PetscCall(MatGetLocalSize(A, &rows->own, NULL));
  PetscCall(PetscObjectBaseTypeCompare((PetscObject)A, MATMPIAIJ, &mpi));
  rows->diagonal = A;
  if (mpi) PetscCall(MatMPIAIJGetSeqAIJ(A, &rows->diagonal, &rows->off, &rows->garray));
  if (mpi) PetscCall(MatGetLocalSize(rows->off, NULL, &rows->others));
  PetscFunctionReturn(0);
}

#endif
