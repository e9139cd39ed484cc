/* What a factor of "mumpsnd" holds; one MUMPS instance each */
#ifndef HHTDAE_LINEAR_MUMPSND_DATA_H
#define HHTDAE_LINEAR_MUMPSND_DATA_H

#include <dmumps_c.h>
#include <petscmat.h>
#include <vector>

struct MumpsND {
  DMUMPS_STRUC_C id;
  MPI_Comm       comm; /* PETSc's inner duplicate: MUMPS does not make one of its own */
  PetscMPIInt    rank, size;

  std::vector<MUMPS_INT> row, col; /* entries of the owned rows, indices from 1; columns >= row only where symmetric */
  std::vector<double>    val;
  std::vector<MUMPS_INT> position; /* PERM_IN on rank 0: where in the elimination each unknown stands, from 1 */
  char                   ordering[32];

  std::vector<MUMPS_INT> rhs_rows; /* distributed right-hand side and solution, more than one process only */
  std::vector<MUMPS_INT> sol_rows;
  std::vector<double>    sol_values; /* of one block, column by column */
  Vec                    sol;        /* one column of them, placed there */
  VecScatter             scatter;

  PetscBool user_ordering, user_null_pivots; /* ICNTL(7) and ICNTL(24) were set from outside */

  /* MUMPS numbers its arrays from 1 */
  MUMPS_INT &icntl(int i) { return id.icntl[i - 1]; }
  double    &cntl(int i) { return id.cntl[i - 1]; }
  MUMPS_INT  infog(int i) const { return id.infog[i - 1]; }
  double     rinfog(int i) const { return id.rinfog[i - 1]; }
};

enum MumpsJob { MUMPS_INIT = -1, MUMPS_END = -2, MUMPS_ANALYSIS = 1, MUMPS_FACTOR = 2, MUMPS_SOLVE = 3 };

inline void MumpsRun(MumpsND *m, MumpsJob job)
{
  m->id.job = job;
  dmumps_c(&m->id);
}

/* Runs the analysis of A, whose pattern m holds, with the ordering given by PETSc or else the best we can get */
PetscErrorCode MumpsNDAnalyse(Mat A, IS given, MumpsND *m);

/* The analysis once more, with ICNTL(7) as it was and the positions that m has */
void MumpsNDAnalyseAgain(MumpsND *m, MUMPS_INT ordering);

/* Solves with one right-hand side and with many; the scatter of solutions holds for one factorization */
void           MumpsNDSetSolves(Mat F);
PetscErrorCode MumpsNDDropScatter(MumpsND *m);

#endif
