/* The work of a factorization, by which its package is chosen (choose.cpp) */
#include "choose.h"
#include "graph.h"
#include "kluparts.h"

/*
  KLU works column by column in scalar loops; MUMPS works on dense fronts with BLAS, at a cost per call and per front.
  The number of unknowns says little: what counts is the work, and how much of it there is per entry of the factor. A run
  needs dozens of factorizations, the first of which is klupair's dearest. The measurements are in README.md, made by
  tests/bench/linear_crossover.cpp. PETSc's "klu", without klupair's panels, leaves the field earlier.
*/
#if defined(HHTDAE_HAVE_KLU)
static const double LARGE_SYMMETRIC = 6e7, LARGE_UNSYMMETRIC = 1e8;
#else
static const double LARGE_SYMMETRIC = 2.5e6, LARGE_UNSYMMETRIC = 7e6;
#endif
static const double LARGE_PER_ENTRY = 40;

/* Where hundreds of solves follow a factorization the time of a solve counts, in which MUMPS has the greater overhead: coarse matrices of 308,028 and 1,043,130 unknowns (README.md) */
static const double MANY_SOLVES = 30;

/*
  Matrices distributed over ranks: KLU on every rank and a dense matrix for the interface (kluparts.h), or MUMPS.
  Both are weighed by operations on one rank, in units of KLU's, of one factorization and three solves: dense ones cost a
  fifth of them, those of MUMPS' fronts a quarter, and where fronts are small MUMPS takes its time per unknown (README.md).
*/
static const double DENSE_OPERATION = 0.2, MUMPS_UNKNOWN = 6500, MUMPS_OPERATION = 0.25;

/* More than this between ranks is left to MUMPS without a closer look */
static const double   MANY_COUPLINGS  = 2e5;
static const PetscInt LARGE_INTERFACE = 2000;

/* Counting stops here: a factor with this many entries is large by any measure */
static const double COUNT_LIMIT = 1e7;

/* Matrices distributed over ranks, or of one triangle: entries of the whole matrix from which its factor is as large in all likelihood. Fewer are factored in a
   fraction of a second in any precision. */
static const double MANY_ENTRIES = 4e6;

PetscErrorCode LinearHasManyEntries(Mat P, PetscBool *yes)
{
  MatInfo   info;
  PetscBool triangle;

  PetscFunctionBegin;
  PetscCall(LinearStoresTriangle(P, &triangle));
  PetscCall(MatGetInfo(P, MAT_GLOBAL_SUM, &info));
  *yes = (PetscBool)((triangle ? 2 : 1) * info.nz_used > MANY_ENTRIES);
  PetscFunctionReturn(0);
}

static PetscErrorCode MeasureDistributed(Mat P, PetscBool symmetric, LinearSize *size)
{
  LinearPartsWork w;
  PetscMPIInt     ranks;

  PetscFunctionBegin;
  PetscCallMPI(MPI_Comm_size(PetscObjectComm((PetscObject)P), &ranks));
  size->large = PETSC_TRUE;
  PetscCall(LinearPartsCount(P, MANY_COUPLINGS, LARGE_INTERFACE, &w));
  if (!w.possible) {
    PetscCall(PetscSNPrintf(size->text, sizeof size->text,
                            w.couplings > 0 ? "matrix distributed over %d processes, %g entries between them"
                                            : "matrix distributed over %d processes",
                            ranks, w.couplings));
    PetscFunctionReturn(0);
  }
  const double N = (double)w.interface, dense = N * N * N / 3;
  const double parts = 2 * w.flops + 12 * w.factor + w.sweeps + DENSE_OPERATION * (w.products + 2 * dense);
  const double mumps = MUMPS_UNKNOWN * (w.unknowns + N / ranks) +
                       MUMPS_OPERATION * (symmetric ? 1 : 2) * (w.flops + w.sweeps / 2 + dense / ranks);
  size->parts = parts < mumps ? PETSC_TRUE : PETSC_FALSE;
  PetscCall(PetscSNPrintf(size->text, sizeof size->text,
                          "interface of %" PetscInt_FMT " between %d processes, work of %.2g operations, with MUMPS as much as %.2g",
                          w.interface, ranks, parts, mumps));
  PetscFunctionReturn(0);
}

/* By counting; with rows elsewhere only the packages for distributed matrices come into question */
PetscErrorCode LinearMeasure(Mat P, PetscBool symmetric, PetscBool many_solves, LinearSize *size)
{
  PetscMPIInt     processes;
  PetscBool       seqaij, triangle, bounded, done;
  IS              row, col;
  const PetscInt *order;
  LinearGraph     graph;
  LinearWork      work;

  PetscFunctionBegin;
  *size = LinearSize();
  PetscCall(LinearStoresTriangle(P, &triangle));
  PetscCall(LinearHasManyEntries(P, &size->single));
  if (triangle) { /* MUMPS reads it, KLU and the like do not: a chain of 50 unknowns takes 0.28 ms in place of 0.007 ms (above) */
    size->large = PETSC_TRUE;
    PetscCall(PetscStrncpy(size->text, "the matrix holds one triangle", sizeof size->text));
    PetscFunctionReturn(0);
  }
  PetscCallMPI(MPI_Comm_size(PetscObjectComm((PetscObject)P), &processes));
  PetscCall(PetscObjectTypeCompare((PetscObject)P, MATSEQAIJ, &seqaij));
  if (processes > 1) {
    PetscCall(MeasureDistributed(P, symmetric, size));
    PetscFunctionReturn(0);
  }
  if (!seqaij) {
    PetscCall(PetscStrncpy(size->text, "matrix not of type seqaij", sizeof size->text));
    PetscFunctionReturn(0);
  }
  PetscCall(LinearGraphFromMat(P, &graph, &done));
  PetscCall(MatGetOrdering(P, PetscDefined(HAVE_SUITESPARSE) ? "amd" : "metisnd", &row, &col));
  PetscCall(ISGetIndices(row, &order));
  LinearCountWork(graph, order, COUNT_LIMIT, &work, &bounded);
  PetscCall(ISRestoreIndices(row, &order));
  PetscCall(ISDestroy(&row));
  PetscCall(ISDestroy(&col));
  const double threshold = (symmetric ? LARGE_SYMMETRIC : LARGE_UNSYMMETRIC) * (many_solves ? MANY_SOLVES : 1);
  const double per_entry = work.flops / PetscMax(work.factor, 1.0);
  size->single = (PetscBool)!bounded;
  size->large = !bounded || (work.flops > threshold && per_entry > LARGE_PER_ENTRY) ? PETSC_TRUE : PETSC_FALSE;
  PetscCall(PetscSNPrintf(size->text, sizeof size->text, "factor with %s%.2g entries, %.2g operations",
                          bounded ? "" : "more than ", work.factor, work.flops));
  PetscFunctionReturn(0);
}
