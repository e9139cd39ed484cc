/*
  The factors of "klupair" as dense panels, for matrices with dense parts: a block of modes, constraints that act on all
  of them.

  KLU goes through L and U entry by entry with an index each. Where much of the work lies in columns of the same structure,
  factorizations and solves go by panels of such columns with dense algebra (BLAS). Pivots are those planned for KLU, with
  row exchanges inside of panels; where entries grow with them, or where this promises little, KLU finds the pivots in its
  first factorization, and the following ones go by panels with these.

  M is the transpose of the PETSc matrix, as KLU sees it, and a place is one in the pivots' order. A panel is a range K
  of places whose pivots have much the same structure by the elimination tree of M(P,Q) + its transpose, in postorder,
  in one diagonal block (BTF) of KLU. The panels are the blocks of a block factorization, with the rows R and the
  columns C after K that its pattern fills:

      lower   rows K and R, columns K   on top the factors of M(K,K) with row exchanges inside, below it L(R,K)
      upper   rows C, columns K         U(K,C)^T

  Both are tall. R and C differ where a multiplier and a coordinate exchange their rows. A panel collects what all
  panels before it contribute (left-looking): these stand side by side in one product of dense matrices.
*/
#ifndef HHTDAE_LINEAR_KLUPAIR_PANELS_H
#define HHTDAE_LINEAR_KLUPAIR_PANELS_H

#include "klupair_data.h"

/* Places that a panel reaches, from KluPanels::reached[start] on, ascending */
struct KluReach {
  PetscInt start, count;
};

/* A panel before, of whose rows R those from row_first on count, and up to row_last they are places of the panel that
   looks back; columns likewise */
struct KluPanelSource {
  PetscInt panel, row_first, row_last, col_first, col_last;
};

struct KluPanel {
  PetscInt first, width; /* its places */
  KluReach rows, cols;   /* R and C */
  PetscInt source, sources;
  size_t   lower, upper; /* where the values begin */
};

/* Entries of the matrix, from that number on, whose places follow one another */
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
  std::vector<PetscInt>       outer_start, outer; /* entries between diagonal blocks: by columns, their row places */
  std::vector<PetscInt>       target;             /* where each entry of the matrix goes among the values */
  std::vector<PetscInt>       exchange;           /* LAPACK's row exchanges in the diagonal block of each panel */
  std::vector<PetscInt>       run_start; /* of each place: which runs its column has; other entries go one by one */
  std::vector<KluRun>         run;
  std::vector<char>           zero_lower, zero_upper; /* of each place: its part of `lower` below K, that of `upper` is zero */
  size_t                      outer_values = 0;   /* where the values between diagonal blocks begin */
  std::vector<double>         value;

  double entries = 0, flops = 0;  /* stored, zeros included, and operations with them */
  double cost = 0, klu_cost = 0; /* estimates for a factorization by panels, and by KLU, in operations of a dense product */

  /* scratch: rows of `lower` and `upper` of the panel at work, by place; panels side by side; vectors */
  std::vector<PetscInt> row_of, col_of;
  std::vector<double>   left, right, product, matrix_size, factor_size, x, y;
};

/* *pays tells whether the factors of `numeric` are worth panels; only then they are built. Their values come later. */
PetscErrorCode KluPanelsBuild(const LinearRows &rows, KluPair *k, KluPanels *panels, bool *pays);

/* The same for the pivots as planned, before KLU has factored anything */
void KluPanelsPlan(const LinearRows &rows, const KluPair &k, KluPanels *panels, bool *pays);

/* row_of gets K and R, col_of K and C of this panel */
void KluPanelsSetPlaces(const KluPanel &panel, KluPanels *panels);

/* With the pivots that the panels were built for; *growth is the reciprocal growth, 0 where a pivot is zero or not
 * finite */
PetscErrorCode KluPanelsFactor(const LinearRows &rows, KluPanels *panels, double *growth);

/* LU of a narrow block, n <= KLU_PANELS_NARROW, in place; exchange[k]: the row that came to k. False at a zero pivot. */
#define KLU_PANELS_NARROW 16
bool KluPanelsFactorNarrow(PetscInt n, double a[], PetscInt ld, PetscInt exchange[]);

/* X U^-1 and Y L^-T for these factors; X has the leading dimension ld, too */
void KluPanelsDivideNarrow(PetscInt n, const double a[], PetscInt ld, double x[], PetscInt rows, double y[],
                           PetscInt cols);

/* y -= A x and y -= A^T x with a narrow A, whose columns may be known to be zero; `zero` may be null */
void KluPanelsSubtractNarrow(PetscInt rows, PetscInt cols, const double a[], PetscInt ld, const char zero[],
                             const double x[], double y[]);
void KluPanelsSubtractTransposedNarrow(PetscInt rows, PetscInt cols, const double a[], PetscInt ld, const char zero[],
                                       const double x[], double y[]);

/* M x = b, or with the transpose of M, in place */
PetscErrorCode KluPanelsSolve(KluPanels *panels, bool transposed, double x[]);

#endif
