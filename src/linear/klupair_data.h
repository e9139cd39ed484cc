/* What a factor of "klupair" holds, and KLU's names for the size of PETSc's integers */
#ifndef HHTDAE_LINEAR_KLUPAIR_DATA_H
#define HHTDAE_LINEAR_KLUPAIR_DATA_H

#include "archive.h"
#include "graph.h"
#include "klupair_matching.h"
#include <klu.h>
#include <memory>
#include <petsc/private/matimpl.h>

#if defined(PETSC_USE_64BIT_INDICES)
typedef SuiteSparse_long KluInt;
#define KLU(name) klu_l_##name
#define AMD(name) amd_l_##name
#else
typedef int KluInt;
#define KLU(name) klu_##name
#define AMD(name) amd_##name
#endif
static_assert(sizeof(KluInt) == sizeof(PetscInt), "KLU's integers have the size of PETSc's");

struct KluPanels; /* klupair_panels.h */

enum KluPairOrdering { KLUPAIR_AUTO, KLUPAIR_AMD, KLUPAIR_METIS };

/* What the next factorization goes by, besides the pivots: saved and restored as it is */
struct KluPairState {
  double   tolerated     = 0; /* entries of L and U from which the pivots are looked for anew */
  double   growth        = 0; /* reciprocal pivot growth of the last factorization with pivoting */
  bool     panels_looked = false, panels_used = false, plan_tried = false;
  bool     old_pivots    = false; /* the last factorization went with pivots that were there before it */
  PetscInt panels_made   = 0;     /* factorizations by panels */
  PetscInt analyses = 0, factorizations = 0, refactorizations = 0, rejected = 0;
};

struct KluPair : KluPairState {
  KLU(common) common;
  KLU(symbolic) *symbolic = NULL;
  KLU(numeric) *numeric   = NULL;

  std::vector<PetscInt> start, col; /* the pattern analysed */
  std::vector<PetscInt> given;      /* an order of the unknowns from PETSc; empty: ours */
  PetscObjectId         matrix  = 0;
  PetscObjectState      pattern = 0, values = 0; /* of that matrix, when the pattern and the pivots were looked at */

  /* Unknowns coupled to the outside, by so many rows and columns that are eliminated after all of these: the ordering
     counts what it takes to carry them along */
  std::vector<PetscInt> ends;
  PetscInt              width = 0;
  bool                  whole = false; /* no diagonal blocks are looked for */

  KluPairOrdering ordering = KLUPAIR_AUTO;
  PetscBool       refactor = PETSC_TRUE;

  LinearPivots pivots;
  LinearWork   work;                               /* foreseen for L of the symmetrized pattern */
  double       path_columns = 0, path_entries = 0; /* columns of L that the ends reach, and entries in them */
  const char  *ordering_used = "";
  /* Values of the matrices that were analysed, and whose pivots are in use: from them comes all that a factor takes over */
  std::vector<PetscScalar> analysed, pivoted;
  /* Dense panels for the pivots of `numeric`, whose own values are old while panels_used, or without it for those planned */
  std::shared_ptr<KluPanels> panels;
  PetscBool                  panels_wanted = PETSC_TRUE;

  bool factored() const { return numeric || panels_used; }
};

inline KluPair *KluPairOf(Mat F) { return static_cast<KluPair *>(F->data); }

inline KluInt *KluIndices(const PetscInt *i) { return reinterpret_cast<KluInt *>(const_cast<PetscInt *>(i)); }

/* Rows of a SEQAIJ matrix, to be given back before its values change */
PetscErrorCode KluPairGetRows(Mat A, LinearRows *rows);
PetscErrorCode KluPairRestoreRows(Mat A, LinearRows *rows);

/* Pivots, ordering and KLU's analysis for the pattern and values of A */
PetscErrorCode KluPairAnalyse(Mat A, const LinearRows &rows, KluPair *k);

/* klupair_factor.cpp: the same, with the values kept and what was known of others forgotten; MatLUFactorNumeric(); and what a checkpoint needs */
PetscErrorCode KluPairAnalyseValues(Mat A, const LinearRows &rows, KluPair *k);
PetscErrorCode KluPairFactorNumeric(Mat F, Mat A, const MatFactorInfo *);
PetscErrorCode KluPairSaveState(Mat F, Archive *archive);
PetscErrorCode KluPairLoadState(Mat F, Mat A, Archive *archive, PetscBool *same);

#endif
