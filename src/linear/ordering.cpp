/* The ordering "metisnd", and registration of everything in this directory that is selected by name */
#include "constraint.h"
#include "graph.h"
#include "hhtdae/hhtdae.h"
#include "klupair.h"
#include "kluparts.h"
#include "linear.h"
#include "mumpsmixed.h"
#include "mumpsnd.h"

/* A is always sequential: for a distributed matrix PETSc passes its diagonal block */
static PetscErrorCode MatGetOrdering_MetisND(Mat A, MatOrderingType type, IS *row, IS *col)
{
  LinearGraph           graph;
  std::vector<PetscInt> order;
  PetscBool             done;
  MatType               mat_type;

  PetscFunctionBegin;
  PetscCall(MatGetType(A, &mat_type));
  PetscCall(LinearGraphFromMat(A, &graph, &done));
  PetscCheck(done, PetscObjectComm((PetscObject)A), PETSC_ERR_SUP,
             "Ordering %s needs the rows of the matrix, which type %s does not give; convert it to MATAIJ", type,
             mat_type);
  PetscCall(LinearMetisOrder(graph, {}, &order));
  PetscCall(ISCreateGeneral(PETSC_COMM_SELF, graph.n, order.data(), PETSC_COPY_VALUES, row));
  PetscCall(ISDuplicate(*row, col)); /* not *row itself, of which PCLU would destroy only one of two references */
  PetscFunctionReturn(0);
}

/* May be called repeatedly: a registration replaces an entry of the same name */
PetscErrorCode LinearRegister(void)
{
  PetscFunctionBegin;
  PetscCall(MatOrderingRegister(MATORDERINGMETISND, MatGetOrdering_MetisND));
  PetscCall(LinearRegisterMumpsND());
  PetscCall(LinearRegisterMumpsMixed());
  PetscCall(LinearRegisterKLUPair());
  PetscCall(LinearRegisterKLUParts());
  PetscCall(LinearRegisterConstraint());
  PetscFunctionReturn(0);
}
