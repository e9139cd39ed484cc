/* Estimates the work of a factorization, by which its package is chosen (choose.cpp) */
#include "choose.h"
#include "graph.h"
#include "kluparts.h"

/*
  From these numbers of operations of L D L^T on, MUMPS is chosen in place of KLU, provided that there are more than
  MUMPS_FLOPS_PER_ENTRY operations per entry of L. KLU works column by column in scalar loops; MUMPS works on dense fronts
  with BLAS, at a cost per call and per front. The number of unknowns says little about which is faster. A run makes dozens of
  factorizations, and klupair's first one takes the most time. Measurements in README.md, by tests/bench/linear_crossover.cpp. Without
  klupair's panels, that is with PETSc's "klu", the limits are lower.
*/
#if defined(HHTDAE_HAVE_KLU)
static const double MUMPS_FLOPS_LDLT = 6e7, MUMPS_FLOPS_LU = 1e8;
#else
static const double MUMPS_FLOPS_LDLT = 2.5e6, MUMPS_FLOPS_LU = 7e6;
#endif
static const double MUMPS_FLOPS_PER_ENTRY = 40;

/* Multiplies the limits above where hundreds of solves follow each factorization: the time of a solve counts then, in which MUMPS has the larger overhead. Measured
   with coarse matrices of bodies of 308,028 and 1,043,130 unknowns. */
static const double MANY_SOLVES_FACTOR = 30;

/*
  Cost model for matrices distributed over ranks, which either "kluparts" (kluparts.h) or MUMPS factors: operations on one rank
  for one factorization and three solves, in units of KLU's. A dense operation costs 0.2 of KLU's, one in MUMPS' fronts
  0.25, and MUMPS needs 6500 for each unknown, which dominates where fronts are small (README.md).
*/
static const double DENSE_OPERATION = 0.2, MUMPS_UNKNOWN = 6500, MUMPS_OPERATION = 0.25;

/* Matrices with more entries between ranks, or interface unknowns, go to MUMPS without an estimate of the work */
static const double   MAX_COUPLINGS = 2e5;
static const PetscInt MAX_INTERFACE = 2000;

/* Counting of the factor's entries stops here: for a larger factor KLU is out of the question, and single precision pays */
static const double MAX_COUNTED_ENTRIES = 1e7;

/* For matrices whose factor is not counted, as distributed ones and MATSBAIJ: from this number of entries of the matrix on its factor is taken to exceed
   MAX_COUNTED_ENTRIES. Smaller ones are factored in a fraction of a second in any precision. */
static const double LARGE_MATRIX_ENTRIES = 4e6;

PetscErrorCode LinearHasManyEntries(Mat P, PetscBool *yes)
{
  MatInfo   info;
  PetscBool triangle;

  PetscFunctionBegin;
  PetscCall(LinearStoresTriangle(P, &triangle));
  PetscCall(MatGetInfo(P, MAT_GLOBAL_SUM, &info));
  *yes = (PetscBool)((triangle ? 2 : 1) * info.nz_used > LARGE_MATRIX_ENTRIES);
  PetscFunctionReturn(0);
}

static PetscErrorCode MeasureDistributed(Mat P, PetscBool symmetric, LinearSize *size)
{
  LinearPartsWork w;
  PetscMPIInt     ranks;

  PetscFunctionBegin;
  PetscCallMPI(MPI_Comm_size(PetscObjectComm((PetscObject)P), &ranks));
  size->large = PETSC_TRUE;
  PetscCall(LinearPartsCount(P, MAX_COUPLINGS, MAX_INTERFACE, &w));
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

/* Counts the work in AMD's order, METIS' where AMD is not installed; for distributed matrices see MeasureDistributed() */
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
  if (triangle) { /* only MUMPS reads MATSBAIJ: a chain of 50 unknowns takes 0.28 ms in place of KLU's 0.007 ms (README.md) */
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
  LinearCountWork(graph, order, MAX_COUNTED_ENTRIES, &work, &bounded);
  PetscCall(ISRestoreIndices(row, &order));
  PetscCall(ISDestroy(&row));
  PetscCall(ISDestroy(&col));
  const double threshold = (symmetric ? MUMPS_FLOPS_LDLT : MUMPS_FLOPS_LU) * (many_solves ? MANY_SOLVES_FACTOR : 1);
  const double per_entry = work.flops / PetscMax(work.factor, 1.0);
  size->single           = (PetscBool)!bounded;
  size->large            = !bounded || (work.flops > threshold && per_entry > MUMPS_FLOPS_PER_ENTRY) ? PETSC_TRUE : PETSC_FALSE;
  PetscCall(PetscSNPrintf(size->text, sizeof size->text, "factor with %s%.2g entries, %.2g operations",
                          bounded ? "" : "more than ", work.factor, work.flops));
  PetscFunctionReturn(0);
}
