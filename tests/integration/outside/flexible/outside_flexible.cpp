/* Four unit masses and six unit springs in a regular tetrahedron: its modes, w^2 = 1, 1, 2, 2, 2, 4, from matrices in memory; then one
   of them in a scene, let go and looked at after half a period. Prints the larger of both errors. */
#include <cmath>
#include <hhtdae/flexible.h>
#include <hhtdae/scene.h>

using namespace hhtdae;

static PetscErrorCode Tetrahedron(FeModel *model)
{
  const Vector3       corner[4] = {{1, 1, 1}, {1, -1, -1}, {-1, 1, -1}, {-1, -1, 1}};
  std::vector<double> x;
  Mat                 K, M;
  PetscFunctionBegin;
  PetscCall(MatCreateSeqAIJ(PETSC_COMM_SELF, 12, 12, 12, nullptr, &K));
  PetscCall(MatCreateSeqAIJ(PETSC_COMM_SELF, 12, 12, 1, nullptr, &M));
  for (int i = 0; i < 4; i++) {
    x.insert(x.end(), corner[i].data(), corner[i].data() + 3);
    for (int c = 0; c < 3; c++) PetscCall(MatSetValue(M, 3 * i + c, 3 * i + c, 1, INSERT_VALUES));
    for (int j = 0; j < 4; j++) {
      if (i == j) continue;
      const Vector3 e = (corner[j] - corner[i]).normalized();
      for (int c = 0; c < 3; c++)
        for (int d = 0; d < 3; d++) {
          PetscCall(MatSetValue(K, 3 * i + c, 3 * i + d, e(c) * e(d), ADD_VALUES));
          PetscCall(MatSetValue(K, 3 * i + c, 3 * j + d, -e(c) * e(d), ADD_VALUES));
        }
    }
  }
  for (Mat A : {K, M}) {
    PetscCall(MatAssemblyBegin(A, MAT_FINAL_ASSEMBLY));
    PetscCall(MatAssemblyEnd(A, MAT_FINAL_ASSEMBLY));
  }
  PetscCall(model->setMatrices(K, M, x));
  PetscCall(MatDestroy(&K));
  PetscCall(MatDestroy(&M));
  PetscFunctionReturn(0);
}

static PetscErrorCode Run()
{
  const double squares[6] = {1, 1, 2, 2, 2, 4};
  FeModel      model(PETSC_COMM_SELF);
  Reduction    reduction;
  ReducedBody  reduced;
  TS           ts;
  TSType       type;
  double       error = 0;
  PetscFunctionBegin;
  PetscCall(Tetrahedron(&model));
  reduction.method = Method::FreeFree;
  reduction.modes  = 6;
  PetscCall(Reduce(model, reduction, &reduced));
  PetscCheck(reduced.modal.modes() == 6, PETSC_COMM_SELF, PETSC_ERR_PLIB, "%d modes", (int)reduced.modal.modes());
  for (int k = 0; k < 6; k++) error = std::fmax(error, std::fabs(reduced.modal.omega(k) - std::sqrt(squares[k])));

  Scene        scene(PETSC_COMM_SELF);
  FlexibleBody body;
  body.model       = std::make_shared<ModalBody>(reduced.modal);
  body.deformation = 0.01 * Eigen::VectorXd::Unit(6, 5); /* breathing, w = 2 */
  scene.channel("eta", Measure::modal(scene.add("tetrahedron", body), 5));
  PetscCall(scene.createTS(&ts));
  PetscCall(TSSetMaxTime(ts, M_PI / 2));
  PetscCall(TSSetTolerances(ts, 1e-8, nullptr, 1e-8, nullptr));
  PetscCall(TSSetMaxSteps(ts, 100000));
  PetscCall(TSSetFromOptions(ts));
  PetscCall(scene.solve(ts));
  std::vector<double> eta;
  PetscCall(scene.sample(ts, M_PI / 2, eta));
  error = std::fmax(error, std::fabs(eta[0] + 0.01));
  PetscCall(TSGetType(ts, &type));
  PetscCall(PetscPrintf(PETSC_COMM_WORLD, "type %s error %g\n", type, error));
  PetscCall(TSDestroy(&ts));
  PetscFunctionReturn(0);
}

int main(int argc, char **argv)
{
  PetscCall(PetscInitialize(&argc, &argv, nullptr, nullptr));
  PetscCall(Run());
  return PetscFinalize();
}
