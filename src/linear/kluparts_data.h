/*
  The data of a factor of "kluparts". With the interior first and the interface last, the rows of a rank are

    [ A  B ]   A: interior, B: columns of the interface ("right")
    [ C  D ]   C: rows of the interface ("below"), D: interface by interface ("corner")
*/
#ifndef HHTDAE_LINEAR_KLUPARTS_DATA_H
#define HHTDAE_LINEAR_KLUPARTS_DATA_H

#include "klupair.h"
#include "klupair_data.h"
#include "kluparts.h"

/* An entry of B, C or D: its row and column there, and the place of its value in one of the sources */
enum class PartsSource { Diagonal, Offdiagonal, Received };

struct PartsEntry {
  PetscInt    row, col;
  PetscInt    place;
  PartsSource source;
};

/* Consecutive entries of the rank's diagonal block that are consecutive in the interior, too */
struct PartsRun {
  PetscInt from, to, count;
};

/* The division of a rank's rows. Interface unknowns have the same numbers on all ranks, ascending with their global rows. */
struct PartsSplit {
  PetscInt              begin = 0, end = 0; /* own global rows */
  std::vector<PetscInt> interface;          /* global rows, ascending; the same on every rank */
  std::vector<PetscInt> local;              /* interface unknowns coupled to this rank's interior, ascending */
  std::vector<PetscInt> inner_row;          /* own row of every interior unknown */
  std::vector<PetscInt> interface_row;      /* own rows of the interface */
  std::vector<PetscInt> number;             /* of each own row: its number in the interior, or -1 - its number in the interface */

  /* A in compressed rows */
  std::vector<PetscInt>    start, col;
  std::vector<PetscScalar> val;
  std::vector<PartsRun>    runs;

  /* right: rows of the interior, columns by number in `local`; below: rows by number in `local`, columns of the interior; corner: numbers of the interface */
  std::vector<PartsEntry>  right, below, corner;
  std::vector<PetscScalar> right_val, below_val, corner_val;

  /* Entries of own interface rows in columns of other ranks' interiors: every rank receives those of all ranks */
  std::vector<PetscInt>    sent; /* places in the off-diagonal block */
  std::vector<PetscScalar> send, received;
  std::vector<PetscMPIInt> counts, first;
};

/* What decides how the next matrix is factored, besides the interior's factor; checkpoints store it as it is */
struct KluPartsState {
  PetscInt  factorizations = 0; /* KluPair::factorizations, those with new pivots, when the reach was found */
  PetscReal checked_rcond  = 0; /* KLU's estimate of the reciprocal condition number when a solve was last checked */
  PetscReal residual       = 0; /* of that solve: the largest over the rows, relative to the sum of the absolute values of the row's terms */
  PetscInt  checks = 0, splits = 0;
};

struct KluParts : KluPartsState {
  MPI_Comm    comm;
  PetscMPIInt rank, size;
  PartsSplit  split;

  PetscBool check = PETSC_TRUE;

  std::vector<PetscInt> moved; /* global rows added to the interface because an interior was singular */

  PetscObjectId    matrix  = 0;
  PetscObjectState pattern = 0;

  Mat      inner = NULL, factor = NULL; /* the interior and its factor by "klupair"; NULL if the interior is empty */
  KluPair *klu = NULL;                  /* the data of that factor */

  /* Columns of KLU's factors that B and C fill, ascending; reach_index[k] is the index of column k in `reach`, or -1 */
  std::vector<PetscInt> reach, reach_index;
  std::vector<PetscInt> right_reach, below_reach; /* indices in `reach` of the entries of B and C */
  std::vector<PetscInt> rhs_row, solution_row;    /* own rows of the k-th component of right-hand side and solution in KLU's order */
  /* U^-T Q B and L^-1 P C^T / Rs (kluparts_schur.cpp): one row per column in `reach`, one column per unknown of `local` */
  std::vector<PetscScalar> right_part, below_part;

  std::vector<PetscScalar>  schur, sums; /* the Schur complement, then its LU; scratch for sums over ranks */
  std::vector<PetscReal>    row_scale, col_scale;
  std::vector<PetscBLASInt> pivots;
  std::vector<PetscScalar>  work, at_interface, at_local; /* vectors during a solve: interior, interface, and its part `local` */
};

inline KluParts *PartsOf(Mat F) { return static_cast<KluParts *>(F->data); }

/* ---- kluparts.cpp ---- */

/* Finds the interface and analyses the interiors for the pattern and values of A */
PetscErrorCode PartsAnalyse(Mat F, Mat A, KluParts *p);

/* ---- kluparts_factor.cpp ---- */

PetscErrorCode PartsFactorNumeric(Mat F, Mat A, const MatFactorInfo *);
PetscErrorCode PartsSaveState(Mat F, Archive *archive);
PetscErrorCode PartsLoadState(Mat F, Mat A, Archive *archive, PetscBool *same);

/* ---- kluparts_interface.cpp ---- */

/* Number of entries between ranks, over all ranks */
PetscErrorCode PartsCountCouplings(Mat A, double *couplings);

/* The interface of A, which includes the rows `moved`; collective, the same on every rank */
PetscErrorCode PartsFindInterface(Mat A, const std::vector<PetscInt> &moved, std::vector<PetscInt> *interface);

/* The union of the lists of all ranks, ascending */
PetscErrorCode PartsGather(MPI_Comm comm, const std::vector<PetscInt> &mine, std::vector<PetscInt> *all);

/* ---- kluparts_split.cpp ---- */

PetscErrorCode PartsBuildSplit(Mat A, PartsSplit *split);
PetscErrorCode PartsCopyValues(Mat A, PartsSplit *split);

/* Interior unknowns that are coupled to the interface */
std::vector<PetscInt> PartsCoupledUnknowns(const PartsSplit &split);

/* The interior as a matrix that uses the arrays of the split */
PetscErrorCode PartsInnerMatrix(PartsSplit *split, Mat *inner);

/* ---- kluparts_schur.cpp ---- */

/* To be called after a factorization with new pivots: finds the columns of KLU's factors that B and C fill */
PetscErrorCode PartsFindReach(KluParts *p);

/* Forms and factors the Schur complement; *singular is the first interface unknown without a pivot, or -1; *finite: whether all entries are, on all ranks */
PetscErrorCode PartsFactorSchur(KluParts *p, PetscInt *singular, PetscBool *finite);

/* Solves; both arrays have the length of the rank's rows */
PetscErrorCode PartsSolve(KluParts *p, const PetscScalar b[], PetscScalar x[]);

/* ---- kluparts_check.cpp ---- */

/* Residual of a solve with a fixed right-hand side: the largest over the rows, relative to the sum of the absolute values of the row's terms */
PetscErrorCode PartsResidual(KluParts *p, PetscReal *residual);

/* Estimates the norm of the inverse of the interior, with rows and columns scaled to one. Above the threshold, the own rows of the largest components of
   the singular vectors are added to *move. */
PetscErrorCode PartsNearNull(KluParts *p, PetscReal threshold, PetscReal *inverse, std::vector<PetscInt> *move);

/* To be called after KLU met a zero pivot: finds own rows that have to leave the interior. Destroys the values and the factor of the interior. */
PetscErrorCode PartsAfterFailure(KluParts *p, std::vector<PetscInt> *move);

#endif
