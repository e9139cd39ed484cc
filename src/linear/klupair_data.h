/* The data of a factor of "klupair", and KLU's functions for the size of PETSc's integers */
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

/* What decides how the next matrix is factored, besides the pivots; checkpoints store it as it is */
struct KluPairState {
  double   replan_entries    = 0; /* with more entries in L and U pivots are planned anew */
  double   reciprocal_growth = 0; /* of the last factorization with pivoting: least ratio, over columns, of the largest entry of the matrix to that of U */
  bool     panels_tried = false, panels_used = false, plan_tried = false;
  bool     pivots_reused        = false; /* the last factorization kept the pivots of an earlier one */
  PetscInt panel_factorizations = 0;
  PetscInt analyses = 0, factorizations = 0, refactorizations = 0, rejected = 0;
};

struct KluPair : KluPairState {
  KLU(common) common;
  KLU(symbolic) *symbolic = NULL;
  KLU(numeric) *numeric   = NULL;

  std::vector<PetscInt> start, col;  /* the pattern that was analysed */
  std::vector<PetscInt> given_order; /* order of elimination given by PETSc; empty: chosen here */
  PetscObjectId         matrix        = 0;
  PetscObjectState      pattern_state = 0, value_state = 0; /* of that matrix, at its analysis */

  /* For the interiors of "kluparts": unknowns coupled to the interface, whose interface_size rows and columns are eliminated
     last. The choice of the ordering takes the work for the interface into account. */
  std::vector<PetscInt> coupled_unknowns;
  PetscInt              interface_size = 0;
  bool                  single_block   = false; /* KLU is not to split the matrix into diagonal blocks (BTF) */

  KluPairOrdering ordering = KLUPAIR_AUTO;
  PetscBool       refactor = PETSC_TRUE;

  LinearPivots pivots;
  LinearWork   work;                                     /* predicted for L of the symmetrized pattern */
  double       reached_columns = 0, reached_entries = 0; /* columns of L on paths from coupled unknowns to the root of the elimination tree, and entries in them */
  const char  *ordering_used = "";
  /* Values of the matrix that was analysed, and of the one whose pivots are in use (empty: the same). A resumed run repeats analysis and pivoting with them. */
  std::vector<PetscScalar> analysed_values, pivot_values;
  /* Dense panels for the pivots of `numeric`, or for the planned pivots where `numeric` is NULL. While panels_used, the values of `numeric` are outdated. */
  std::shared_ptr<KluPanels> panels;
  PetscBool                  panels_wanted = PETSC_TRUE;

  bool factored() const { return numeric || panels_used; }
};

inline KluPair *KluPairOf(Mat F) { return static_cast<KluPair *>(F->data); }

inline KluInt *KluIndices(const PetscInt *i) { return reinterpret_cast<KluInt *>(const_cast<PetscInt *>(i)); }

/* Rows of a SEQAIJ matrix, to be restored before its values change */
PetscErrorCode KluPairGetRows(Mat A, LinearRows *rows);
PetscErrorCode KluPairRestoreRows(Mat A, LinearRows *rows);

/* Pivots, ordering and KLU's analysis for the pattern and values of A */
PetscErrorCode KluPairAnalyse(Mat A, const LinearRows &rows, KluPair *k);

/* klupair_factor.cpp: KluPairAnalyse() that also resets panels and pivots and stores the values; MatLUFactorNumeric(); state for checkpoints */
PetscErrorCode KluPairAnalyseValues(Mat A, const LinearRows &rows, KluPair *k);
PetscErrorCode KluPairFactorNumeric(Mat F, Mat A, const MatFactorInfo *);
PetscErrorCode KluPairSaveState(Mat F, Archive *archive);
PetscErrorCode KluPairLoadState(Mat F, Mat A, Archive *archive, PetscBool *same);

#endif
