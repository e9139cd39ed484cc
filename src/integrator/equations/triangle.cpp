/*
  Matrices of which the application stores one triangle, MATSBAIJ. The Newton matrix D_r J D_c has D_r D_c = D D with a
  diagonal D, and is D J D entry by entry, if coordinates and holonomic multipliers are all there is:

    rows      1 | 1/(beta h^2)        D = sqrt(beta h^2) | 1/sqrt(beta h^2)
    columns   beta h^2 | 1

  and with h^2 for beta h^2 in the start. Rows of states, velocity-level constraints, variables and force states are scaled
  otherwise, or are no transposes of their columns in the first place: then such a matrix is refused.
*/
#include "integrator/entries.h"
#include "jacobian.h"

namespace hht3
{

/* Once the roles are known */
PetscErrorCode CheckTriangle(TS ts)
{
  static const struct {
    TSHHT3Role  role;
    const char *name, *why;
  } unfit[] = {{TSHHT3_STATE, "first-order state", "its row s' = f is not the transpose of its column"},
               {TSHHT3_NONHOLONOMIC, "velocity-level constraint", "its row is Psi by q and q' together, its column the derivative by q' alone"},
               {TSHHT3_VARIABLE, "user-defined variable", "its row is the definition, its column the forces that use it"},
               {TSHHT3_FORCE, "force state", "its row is the force law, its column where the force acts"}};
  Integrator &I = Get(ts);
  PetscBool   triangle[2];
  Mat         J, P;
  MatType     type;
  PetscInt    first;

  PetscFunctionBegin;
  PetscCall(SNESGetJacobian(ts->snes, &J, &P, NULL, NULL));
  PetscCall(LinearStoresTriangle(J, &triangle[0]));
  PetscCall(LinearStoresTriangle(P, &triangle[1]));
  if (!triangle[0] && !triangle[1]) PetscFunctionReturn(PETSC_SUCCESS);
  PetscCall(MatGetType(triangle[1] ? P : J, &type));
  for (const auto &u : unfit) {
    if (!I.count[u.role]) continue;
    PetscCall(FirstWhere([&](PetscInt i, PetscScalar) { return I.role[i] == u.role; }, &first, Read(ts->vec_sol)));
    SETERRQ(PetscObjectComm((PetscObject)ts), PETSC_ERR_ARG_INCOMP,
            "The Jacobian's type %s holds one triangle, but the Newton matrix is not symmetric: unknown %" PetscInt_FMT " is a %s (of %" PetscInt_FMT "), %s. "
            "Use a matrix of type %s; one triangle serves coordinates and holonomic constraints alone",
            type, first, u.name, I.count[u.role], u.why, MATAIJ);
  }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* D A D with the scalings of rows and columns; `row` is D on return */
PetscErrorCode ScaleTriangle(Mat A, Vec row, Vec col)
{
  PetscFunctionBegin;
  PetscCall(VecPointwiseMult(row, row, col));
  PetscCall(VecSqrtAbs(row));
  PetscCall(MatDiagonalScale(A, row, row));
  PetscFunctionReturn(PETSC_SUCCESS);
}

} // namespace hht3
