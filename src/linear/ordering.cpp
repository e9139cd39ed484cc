#include "constraint.h"
#include "graph.h"
#include "hhtdae/hhtdae.h"
#include "klupair.h"
#include "kluparts.h"
#include "linear.h"
#include "mumpsmixed.h"
#include "mumpsnd.h"

/* PETSc calls this with the diagonal block of a distributed matrix, so the matrix here is always sequential */
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
  PetscCall(ISDuplicate(*row, col)); /* not the same one: of that PCLU would destroy one reference of two */
  PetscFunctionReturn(0);
}

/* Every registration replaces an entry of the same name, so that a second call changes nothing */
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
