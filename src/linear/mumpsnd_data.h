/* The data of a factor of "mumpsnd" or "smumpsnd": one MUMPS instance each */
#ifndef HHTDAE_LINEAR_MUMPSND_DATA_H
#define HHTDAE_LINEAR_MUMPSND_DATA_H

#include "mumpsnd.h"
#include <dmumps_c.h>
#include <vector>
#if defined(HHTDAE_HAVE_SMUMPS)
#include <smumps_c.h>
#endif

/* The precision of a factor. null_pivot, CNTL(3): rows with smaller pivots, relative to the scaled matrix, count as null, because redundant constraints leave
   rounding in place of zeros. PETSc's vectors are of double precision in either case. */
struct MumpsDouble {
  using Real   = double;
  using Struct = DMUMPS_STRUC_C;
  static constexpr double null_pivot = 1e-14;
  static const char      *package() { return LINEAR_MUMPSND; }
  static void             call(Struct *id) { dmumps_c(id); }
};

#if defined(HHTDAE_HAVE_SMUMPS)
struct MumpsSingle {
  using Real   = float;
  using Struct = SMUMPS_STRUC_C;
  static constexpr double null_pivot = 1e-6;
  static const char      *package() { return LINEAR_SMUMPSND; }
  static void             call(Struct *id) { smumps_c(id); }
};
#endif

template <class Precision> struct MumpsND {
  using Real = typename Precision::Real;

  typename Precision::Struct id;

  MPI_Comm    comm; /* PETSc's duplicate for libraries: MUMPS does not duplicate its communicator */
  PetscMPIInt rank, size;

  std::vector<MUMPS_INT> row, col; /* entries of the owned rows, indices from 1; columns >= row only where symmetric */
  std::vector<Real>      val;
  std::vector<MUMPS_INT> position; /* PERM_IN on rank 0: the position of each unknown in the order of elimination, from 1 */
  char                   ordering[32];
  bool                   beyond_range; /* a finite entry of the matrix overflows in type Real */

  std::vector<MUMPS_INT> rhs_rows; /* distributed right-hand side and solution, more than one process only */
  std::vector<MUMPS_INT> sol_rows;
  std::vector<Real>      rhs_values; /* right-hand side converted to Real, where that is not PetscScalar */
  std::vector<Real>      sol_values; /* solutions of one block of right-hand sides, column by column, where MUMPS leaves them */
  std::vector<double>    column;     /* one column of them in double precision */
  Vec                    sol;        /* vector that uses the array `column` */
  VecScatter             scatter;    /* from `sol` to the solution vector */

  double    memory = -1;                     /* -mat_mumps_memory, MB */
  bool      no_room = false;                 /* the analysis predicts more memory than is free */
  PetscBool user_ordering, user_null_pivots; /* ICNTL(7) and ICNTL(24) were set from outside */

  /* MUMPS numbers its arrays from 1 */
  MUMPS_INT &icntl(int i) { return id.icntl[i - 1]; }
  Real      &cntl(int i) { return id.cntl[i - 1]; }
  MUMPS_INT  infog(int i) const { return id.infog[i - 1]; }
  double     rinfog(int i) const { return id.rinfog[i - 1]; }
};

enum MumpsJob { MUMPS_INIT = -1, MUMPS_END = -2, MUMPS_ANALYSIS = 1, MUMPS_FACTOR = 2, MUMPS_SOLVE = 3 };

template <class P> void MumpsRun(MumpsND<P> *m, MumpsJob job)
{
  m->id.job = job;
  P::call(&m->id);
}

/* Analyses A, whose pattern m holds, with the ordering given by PETSc or, if NULL, the user's ICNTL(7) or the better of METIS' and MUMPS' own */
template <class P> PetscErrorCode MumpsNDAnalyse(Mat A, IS given, MumpsND<P> *m);

/* Repeats the analysis of a saved state with ICNTL(7) = ordering and, if that is 1, the positions in m */
template <class P> void MumpsNDAnalyseAgain(MumpsND<P> *m, MUMPS_INT ordering);

/* Sets the functions for solves with one and with many right-hand sides. The scatter of solutions is valid for one factorization and must be dropped before the next. */
template <class P> void           MumpsNDSetSolves(Mat F);
template <class P> PetscErrorCode MumpsNDDropScatter(MumpsND<P> *m);

#endif
