static char help[] = "Time per element of the finite-element kernels, one core.\n"
                     "  -seconds <0.3>  for each kernel\n";

#include "flexible/element.h"
#include <hhtdae/hhtdae.h>
#include <petsctime.h>
#include <vector>

using namespace hhtdae;

/* Elements near the reference shape, each distorted differently, so that the compiler cannot precompute anything */
template <class Shape> static std::vector<fe::NodeVectors<Shape>> Elements(int count)
{
  std::vector<fe::NodeVectors<Shape>> list(count);
  std::srand(1);
  for (auto &X : list)
    for (int i = 0; i < Shape::nodes; i++) X.col(i) = Shape::place(i) + 0.02 * Eigen::Vector3d::Random();
  return list;
}

/* Microseconds per call of f */
template <class F> static double Microseconds(double seconds, F &&f)
{
  PetscLogDouble start, now;
  long           calls = 0;
  PetscTime(&start);
  do {
    for (int k = 0; k < 100; k++) f(k);
    calls += 100;
    PetscTime(&now);
  } while (now - start < seconds);
  return 1e6 * (now - start) / (double)calls;
}

template <class Shape> static PetscErrorCode TimeKernels(double seconds)
{
  const Material                            steel{2.1e11, 0.3, 7850};
  const fe::Lame                            lame(steel);
  const std::vector<fe::NodeVectors<Shape>> X = Elements<Shape>(100);
  fe::Stiffness<Shape>                      K;
  fe::Mass<Shape>                           m;
  fe::NodeVectors<Shape>                    f, u = 0.01 * fe::NodeVectors<Shape>::Random();
  fe::NodeStress<Shape>                     s;
  double                                    sum = 0; /* uses every result, so that none is optimized away */
  const double k = Microseconds(seconds, [&](int i) { sum += fe::ElementStiffness<Shape>(X[i], lame, K) + K(0, 1); });
  const double w =
      Microseconds(seconds, [&](int i) { sum += fe::ElementMass<Shape>(X[i], steel.density, m) + m(0, 1); });
  const double large = Microseconds(seconds, [&](int i) { sum += fe::LargeForce<Shape>(X[i], u, lame, f) + f(0, 0); });
  const double tangent =
      Microseconds(seconds, [&](int i) { sum += fe::LargeForce<Shape>(X[i], u, lame, f, &K) + K(0, 1); });
  const double stress = Microseconds(seconds, [&](int i) {
    fe::StressAtNodes<Shape> kernel(X[i]);
    kernel(u, lame, s);
    sum += s(0, 0);
  });
  PetscFunctionBegin;
  PetscCall(PetscPrintf(PETSC_COMM_SELF, "%-26s %8.2f %8.2f %8.2f %10.2f %10.2f %8.2f%s\n", fe::ShapeName(Shape::type),
                        k, w, k + w, large, tangent, stress, PetscIsInfOrNanReal(sum) ? "  not finite" : ""));
  PetscFunctionReturn(0);
}

int main(int argc, char **argv)
{
  PetscReal seconds = 0.3;
  PetscCall(PetscInitialize(&argc, &argv, NULL, help));
  PetscCall(PetscOptionsGetReal(NULL, NULL, "-seconds", &seconds, NULL));
  PetscCall(PetscPrintf(PETSC_COMM_SELF,
                        "microseconds per element         K        M    K + M   SVK force  + tangent   stress\n"));
  PetscCall(TimeKernels<fe::Tetrahedron4>(seconds));
  PetscCall(TimeKernels<fe::Tetrahedron10>(seconds));
  PetscCall(TimeKernels<fe::Brick8>(seconds));
  PetscCall(TimeKernels<fe::Brick20>(seconds));
  PetscCall(PetscFinalize());
  return 0;
}
