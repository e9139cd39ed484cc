/* What a factor of "kluparts" holds */
#ifndef HHTDAE_LINEAR_KLUPARTS_DATA_H
#define HHTDAE_LINEAR_KLUPARTS_DATA_H

#include "klupair.h"
#include "klupair_data.h"
#include "kluparts.h"

/* An entry between interior and interface, or within the interface: where it is in the block, where its value is */
enum class PartsSource { Diagonal, Offdiagonal, Received };

struct PartsEntry {
  PetscInt    row, col;
  PetscInt    place;
  PartsSource source;
};

/* A run of entries of the rank's diagonal block that are neighbours in the interior, too */
struct PartsRun {
  PetscInt from, to, count;
};

/* A rank's rows, and which of them are where. Interface unknowns are numbered alike on all ranks, by their global rows
 */
struct PartsSplit {
  PetscInt              begin = 0, end = 0; /* own global rows */
  std::vector<PetscInt> interface;          /* global rows, ascending; the same on every rank */
  std::vector<PetscInt> local;              /* interface unknowns coupled to the interior, ascending */
  std::vector<PetscInt> inner_row;          /* own row of every interior unknown */
  std::vector<PetscInt> top_row;            /* own rows of the interface */
  std::vector<PetscInt> number;             /* of own rows: interior unknown, or -1 - interface unknown */

  /* the interior as a matrix */
  std::vector<PetscInt>    start, col;
  std::vector<PetscScalar> val;
  std::vector<PartsRun>    runs;

  /* right: interior rows, columns of `local`; below: rows of `local`, interior columns; corner: interface by interface
   */
  std::vector<PartsEntry>  right, below, corner;
  std::vector<PetscScalar> right_val, below_val, corner_val;

  /* entries of interface rows in columns that are other ranks' interior: everybody gets all of them */
  std::vector<PetscInt>    sent; /* places in the off-diagonal block */
  std::vector<PetscScalar> send, received;
  std::vector<PetscMPIInt> counts, first;
};

/* What the next factorization goes by, besides the interior's factor: saved and restored as it is */
struct KluPartsState {
  PetscInt  factorizations = 0; /* of the interior with new pivots, when the reach was found */
  PetscReal checked_rcond  = 0; /* KLU's rough measure when a solve was last checked */
  PetscReal residual       = 0; /* of that solve: the largest part of what a row sums up */
  PetscInt  checks = 0, splits = 0;
};

struct KluParts : KluPartsState {
  MPI_Comm    comm;
  PetscMPIInt rank, size;
  PartsSplit  split;

  PetscBool check = PETSC_TRUE;

  std::vector<PetscInt> moved; /* global rows that went to the interface because an interior needed it */

  PetscObjectId    matrix  = 0;
  PetscObjectState pattern = 0;

  Mat      inner = NULL, factor = NULL; /* the interior and its factor by "klupair"; NULL where there is none */
  KluPair *klu = NULL;                  /* what that factor holds */

  /* Columns k of KLU's factors that the interface reaches, ascending; where[k] is its place in the list or -1 */
  std::vector<PetscInt> reach, where;
  std::vector<PetscInt> right_at, below_at; /* places in the list of the entries of the split's `right` and `below` */
  std::vector<PetscInt> in, out;            /* own row of right-hand side and solution number k */
  /* One row per column reached, one column per unknown of `local`: what the elimination leaves of `right` and `below`
   */
  std::vector<PetscScalar> right_part, below_part;

  std::vector<PetscScalar>  schur, sums; /* the interface's matrix and its factors; room for sums over ranks */
  std::vector<PetscReal>    row_scale, col_scale;
  std::vector<PetscBLASInt> pivots;
  std::vector<PetscScalar>  work, top, top_local; /* interior; interface; of it `local` */
};

inline KluParts *PartsOf(Mat F) { return static_cast<KluParts *>(F->data); }

/* ---- kluparts.cpp ---- */

/* Interface, interiors, and what is known of their patterns */
PetscErrorCode PartsAnalyse(Mat F, Mat A, KluParts *p);

/* ---- kluparts_factor.cpp ---- */

PetscErrorCode PartsFactorNumeric(Mat F, Mat A, const MatFactorInfo *);
PetscErrorCode PartsSaveState(Mat F, Archive *archive);
PetscErrorCode PartsLoadState(Mat F, Mat A, Archive *archive, PetscBool *same);

/* ---- kluparts_interface.cpp ---- */

/* Entries between ranks, in all */
PetscErrorCode PartsCountCouplings(Mat A, double *couplings);

/* The interface of A, with the rows `moved`; collective, the same on every rank */
PetscErrorCode PartsFindInterface(Mat A, const std::vector<PetscInt> &moved, std::vector<PetscInt> *interface);

/* The lists of all ranks, ascending, each row once */
PetscErrorCode PartsGather(MPI_Comm comm, const std::vector<PetscInt> &mine, std::vector<PetscInt> *all);

/* ---- kluparts_split.cpp ---- */

PetscErrorCode PartsBuildSplit(Mat A, PartsSplit *split);
PetscErrorCode PartsCopyValues(Mat A, PartsSplit *split);

/* Interior unknowns that are coupled to the interface */
std::vector<PetscInt> PartsEnds(const PartsSplit &split);

/* The interior as a matrix that uses the arrays of the split */
PetscErrorCode PartsInnerMatrix(PartsSplit *split, Mat *inner);

/* ---- kluparts_schur.cpp ---- */

/* After a factorization with new pivots: what the interface reaches in it */
PetscErrorCode PartsFindReach(KluParts *p);

/* The Schur complement and its factors; *singular is the interface unknown without a pivot, or -1; *finite on all ranks
 */
PetscErrorCode PartsFactorSchur(KluParts *p, PetscInt *singular, PetscBool *finite);

/* Both arrays have the rank's rows */
PetscErrorCode PartsSolve(KluParts *p, const PetscScalar b[], PetscScalar x[]);

/* ---- kluparts_check.cpp ---- */

/* A solve with a fixed right-hand side: what is left of it, relative to the terms that every row sums up; the largest
 */
PetscErrorCode PartsResidual(KluParts *p, PetscReal *residual);

/* The size of the interior's inverse, rows and columns scaled to one; above the threshold the unknowns that its largest
   vectors have most of (own rows) are added to the list */
PetscErrorCode PartsNearNull(KluParts *p, PetscReal threshold, PetscReal *inverse, std::vector<PetscInt> *move);

/* After KLU met a zero pivot: own rows that have to leave the interior. Its values and factor are lost. */
PetscErrorCode PartsAfterFailure(KluParts *p, std::vector<PetscInt> *move);

#endif
