/*
  MUMPS with an ordering of ours, as the factorization package "mumpsnd" for MATSEQAIJ and MATMPIAIJ, LU and LDL^T.

  PETSc's own interface hands MUMPS an ordering for LU on one process only, and there it passes the list of unknowns in
  the order of elimination where PERM_IN wants each unknown's position in it. MUMPS as Debian builds it has no METIS
  inside. On 3-D elastic blocks METIS saves MUMPS up to a third of its operations against PORD (measured in ordering.cpp
  among the benchmarks).
*/
#ifndef HHTDAE_LINEAR_MUMPSND_H
#define HHTDAE_LINEAR_MUMPSND_H

#include <petscmat.h>

#define LINEAR_MUMPSND "mumpsnd"

/* Does nothing where PETSc was built without MUMPS, or not for double precision */
PetscErrorCode LinearRegisterMumpsND(void);

#endif
