/*
  The factors of "klupair" as dense panels (supernodes), for matrices with dense parts: a block of modes, constraints that
  act on all of them.

  KLU goes through L and U entry by entry with an index each. Where much of the work lies in columns of the same structure,
  factorizations and solves use panels of such columns with dense algebra (BLAS). The pivots are those planned for KLU, with
  row exchanges inside of panels. If element growth is large with these, or panels do not pay from the first factorization on,
  KLU chooses the pivots in its first factorization, and the following ones use panels with these pivots.

  M is the transpose of the PETSc matrix, as KLU sees it; a place is a position in the order of the pivots. A panel is a range K
  of places whose pivots have nearly the same structure by the elimination tree of M(P,Q) + its transpose, in postorder,
  within one diagonal block (BTF) of KLU. The panels are the blocks of a block factorization, with the rows R and the
  columns C after K that its pattern fills:

      lower   rows K and R, columns K   on top the factors of M(K,K) with row exchanges inside, below it L(R,K)
      upper   rows C, columns K         U(K,C)^T

  R and C differ where a multiplier and a coordinate exchange their rows. The factorization is left-looking: a panel collects the
  contributions of all panels before it, side by side in one product of dense matrices.
*/
#ifndef HHTDAE_LINEAR_KLUPAIR_PANELS_H
#define HHTDAE_LINEAR_KLUPAIR_PANELS_H

#include "klupair_data.h"

/* The places of R or C of a panel, ascending: KluPanels::reached[start] to reached[start + count - 1] */
struct KluReach {
  PetscInt start, count;
};

/* An earlier panel that contributes to the panel at hand: of its rows R those from number row_first on contribute, and those before row_last are
   places of the panel at hand; columns likewise */
struct KluPanelSource {
  PetscInt panel, row_first, row_last, col_first, col_last;
};

struct KluPanel {
  PetscInt first, width;    /* K: places first to first + width - 1 */
  KluReach rows, cols;      /* R and C */
  PetscInt source, sources; /* contributing panels: KluPanels::source[source] to source[source + sources - 1] */
  size_t   lower, upper;    /* first indices in KluPanels::value */
};

/* `count` entries of the matrix, from number `entry` on, with consecutive targets in KluPanels::value */
struct KluRun {
  PetscInt entry, count;
};

struct KluPanels {
  PetscInt                    n = 0;
  std::vector<PetscInt>       row, col; /* of M, at each place */
  std::vector<KluPanel>       panel;    /* ascending places; diagonal blocks one after the other */
  std::vector<PetscInt>       block;    /* the first panel of each diagonal block, and the end */
  std::vector<PetscInt>       reached;
  std::vector<KluPanelSource> source;
  std::vector<PetscInt>       off_block_start, off_block; /* entries between diagonal blocks: by columns, the places of their rows */
  std::vector<PetscInt>       target;                     /* index in `value` of each entry of the matrix */
  std::vector<PetscInt>       exchange;                   /* LAPACK's row exchanges in the diagonal block of each panel */
  std::vector<PetscInt>       run_start;                  /* the column of place k has the runs run_start[k] to run_start[k + 1] - 1; its other entries are copied one by one */
  std::vector<KluRun>         run;
  std::vector<char>           zero_lower, zero_upper; /* of each place: whether its column of `lower` below K is zero; likewise of `upper` */
  size_t                      off_block_values = 0;   /* first index in `value` of the entries between diagonal blocks */
  std::vector<double>         value;

  double entries = 0, flops = 0;       /* entries stored in panels, zeros included; operations of a factorization */
  double panel_cost = 0, klu_cost = 0; /* estimates for a factorization by panels, and by KLU, in operations of a dense product */

  /* scratch: row in `lower` and row in `upper` of each place, for the panel at hand; contributing panels side by side; vectors */
  std::vector<PetscInt> row_of, col_of;
  std::vector<double>   left, right, product, matrix_size, factor_size, x, y;
};

/* Builds the structure of panels for the factors of `numeric`, if they pay; values are set by KluPanelsFactor() */
PetscErrorCode KluPanelsBuild(const LinearRows &rows, KluPair *k, KluPanels *panels, bool *pays);

/* The same for the planned pivots, before KLU has factored anything */
void KluPanelsPlan(const LinearRows &rows, const KluPair &k, KluPanels *panels, bool *pays);

/* Sets row_of for the places K and R, and col_of for K and C, of this panel */
void KluPanelsSetPlaces(const KluPanel &panel, KluPanels *panels);

/* Factors with the pivots that the panels were built for; *reciprocal_growth = 0 if a pivot is zero or not finite */
PetscErrorCode KluPanelsFactor(const LinearRows &rows, KluPanels *panels, double *reciprocal_growth);

/* LU of a block of at most KLU_PANELS_NARROW columns, in place; exchange[k]: the row exchanged with row k. False if a pivot is zero. */
#define KLU_PANELS_NARROW 16
bool KluPanelsFactorNarrow(PetscInt n, double a[], PetscInt ld, PetscInt exchange[]);

/* X U^-1 and Y L^-T, in place, with these factors; the leading dimension of X is ld, that of Y is cols */
void KluPanelsDivideNarrow(PetscInt n, const double a[], PetscInt ld, double x[], PetscInt rows, double y[],
                           PetscInt cols);

/* y -= A x and y -= A^T x, where A has at most KLU_PANELS_NARROW columns; zero[k]: column k is zero and is skipped; `zero` may be NULL */
void KluPanelsSubtractNarrow(PetscInt rows, PetscInt cols, const double a[], PetscInt ld, const char zero[],
                             const double x[], double y[]);
void KluPanelsSubtractTransposedNarrow(PetscInt rows, PetscInt cols, const double a[], PetscInt ld, const char zero[],
                                       const double x[], double y[]);

/* Solves M x = b, or with the transpose of M, in place */
PetscErrorCode KluPanelsSolve(KluPanels *panels, bool transposed, double x[]);

#endif
