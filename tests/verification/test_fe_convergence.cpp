/*
  Frequencies of meshes against exact solutions of three-dimensional elasticity, and the rate at which their errors
  fall: with the square of the element's size for linear elements, with its fourth power for quadratic ones.

    bar      longitudinal wave without lateral strain (Poisson's ratio 0): omega = pi / L sqrt(E / rho)
    tube     a quarter of a tube in torsion, u = r cos(pi x / L) about the axis: omega = pi / L sqrt(G / rho); the cut
  faces move in themselves only round the axis and along the radius plate    simply supported, sides may not move in
  themselves: bending of a layer with the wave number k = sqrt((pi / a)^2 + (pi / b)^2), the first antisymmetric branch
  of Rayleigh and Lamb
*/
#include "fe_mesh.h"
#include "flexible/element.h"

#include <slepceps.h>

using namespace hhtest;

namespace
{

/* The eigenvalue of the free part of (K, M) nearest to a given one; held: degrees of freedom that are fixed */
double nearest(const FeModel &model, const std::function<bool(const Vector3 &, int)> &held, double target)
{
  std::vector<PetscInt> rows;
  for (PetscInt n = 0; n < model.own; n++)
    for (int d = 0; d < 3; d++)
      if (!held(Eigen::Map<const Vector3>(&model.coordinates[3 * n]), d)) rows.push_back(3 * (model.first + n) + d);
  IS  free;
  Mat K, M;
  EPS eps;
  ST  st;
  KSP ksp;
  PC  pc;
  must(ISCreateGeneral(model.comm, (PetscInt)rows.size(), rows.data(), PETSC_COPY_VALUES, &free));
  must(MatCreateSubMatrix(model.K, free, free, MAT_INITIAL_MATRIX, &K));
  must(MatCreateSubMatrix(model.M, free, free, MAT_INITIAL_MATRIX, &M));
  must(EPSCreate(model.comm, &eps));
  must(EPSSetOperators(eps, K, M));
  must(EPSSetProblemType(eps, EPS_GHEP));
  must(EPSSetTarget(eps, 1.01 * target)); /* shifted, because the target must not be an eigenvalue to the last digit */
  must(EPSSetWhichEigenpairs(eps, EPS_TARGET_MAGNITUDE));
  must(EPSSetTolerances(eps, 1e-12, 1000));
  must(EPSGetST(eps, &st));
  must(STSetType(st, STSINVERT));
  must(STGetKSP(st, &ksp));
  must(KSPSetType(ksp, KSPPREONLY));
  must(KSPGetPC(ksp, &pc));
  must(PCSetType(pc, PCCHOLESKY));
  must(PCFactorSetMatSolverType(pc, MATSOLVERMUMPS));
  must(EPSSolve(eps));
  PetscInt    converged;
  PetscScalar value;
  must(EPSGetConverged(eps, &converged));
  if (!converged) throw std::runtime_error("no eigenvalue converged");
  must(EPSGetEigenvalue(eps, 0, &value, nullptr));
  must(EPSDestroy(&eps));
  must(MatDestroy(&K));
  must(MatDestroy(&M));
  must(ISDestroy(&free));
  return value;
}

struct SlepcHere { /* initializes SLEPc after PETSc, which has been initialized by main() */
  SlepcHere()
  {
    PetscBool there;
    must(SlepcInitialized(&there));
    if (!there) must(SlepcInitializeNoArguments());
  }
};

/* Errors of frequencies on successively refined meshes, and the rate of convergence of the last two */
struct Study {
  const char                               *name;
  std::function<MeshBox(ElementType, int)>      box;
  Material                                  material;
  std::function<bool(const Vector3 &, int)> held;
  double                                    omega;
};

void run(const Study &study, ElementType type, const std::vector<int> &sizes, double rate)
{
  static SlepcHere    slepc;
  std::vector<double> error;
  for (int n : sizes) {
    FeModel model(PETSC_COMM_SELF);
    must(readBox(model, study.box(type, n), {{"", study.material}}));
    const double omega = std::sqrt(nearest(model, study.held, study.omega * study.omega));
    error.push_back(omega / study.omega - 1);
    MEASURED("%s, %s, %d: frequency off by %.3g", study.name, hhtdae::fe::ShapeName(type), n, error.back());
  }
  const size_t last = sizes.size() - 1;
  const double measured =
      order(std::abs(error[last - 1]), std::abs(error[last]), (double)sizes[last] / sizes[last - 1]);
  MEASURED("%s, %s: rate %.2f", study.name, hhtdae::fe::ShapeName(type), measured);
  EXPECT_GT(measured, rate - .35);
  EXPECT_LT(measured, rate + 1.);
  EXPECT_GT(error[last], 0); /* conforming displacements make a body too stiff */
  EXPECT_LT(error[last], rate > 3 ? 2e-3 : .12);
}

Study bar()
{
  const Material m{2, 0, 3};
  return {
      "bar",
      [](ElementType t, int n) { return MeshBox{t, 2 * n, n, n, 2, .5, .5, false, [](const Vector3 &x) { return x; }}; }, m,
      [](const Vector3 &x, int d) { return d > 0 && std::abs(x[d]) < 1e-9; }, /* supported on two planes */
      PETSC_PI / 2 * std::sqrt(m.young / m.density)};
}

Study tube()
{
  const Material m{2, .3, 3};
  const auto     bend = [](const Vector3 &x) { /* x: axis, y: angle, z: radius */
                                           const double a = PETSC_PI / 2 * (1 - x[1]), r = 1 + x[2];
                                           return Vector3(x[0], r * std::cos(a), r * std::sin(a));
  };
  return {"tube", [=](ElementType t, int n) { return MeshBox{t, 2 * n, 2 * n, n, 4, 1, 1, false, bend}; }, m,
          [](const Vector3 &x, int d) { return d == 0 && (std::abs(x[1]) < 1e-9 || std::abs(x[2]) < 1e-9); },
          PETSC_PI / 4 * std::sqrt(m.young / (2.6 * m.density))};
}

/* tanh(h q) / tanh(h p) = (k^2 + q^2)^2 / (4 k^2 p q) with p^2 = k^2 - (omega / c_L)^2, q^2 = k^2 - (omega / c_T)^2, h
   half the thickness: the lowest root (Lamb 1917) */
double bendingWave(const Material &m, double k, double h)
{
  const hhtdae::fe::Lame lame(m);
  const double           cl2 = (lame.lambda + 2 * lame.mu) / m.density, ct2 = lame.mu / m.density;
  const auto             f = [&](double w) {
    const double p = std::sqrt(k * k - w * w / cl2), q = std::sqrt(k * k - w * w / ct2);
    return (k * k + q * q) * (k * k + q * q) * std::tanh(h * p) - 4 * k * k * p * q * std::tanh(h * q);
  };
  /* the function has opposite signs on the two sides of the root; at omega = 0 both parts agree */
  double low = 1e-3 * k * std::sqrt(ct2), high = (1 - 1e-12) * k * std::sqrt(ct2);
  if (f(low) * f(high) > 0) throw std::runtime_error("no root of the equation of Rayleigh and Lamb");
  for (int i = 0; i < 200; i++) {
    const double w                   = (low + high) / 2;
    (f(w) * f(low) > 0 ? low : high) = w;
  }
  return low;
}

Study plate()
{
  const Material m{2, .3, 3};
  const double   a = 2, b = 1.5, h = .1;
  return {"plate",
          [=](ElementType t, int n) {
            return MeshBox{t, 4 * n, 3 * n, std::max(1, n / 2), a, b, 2 * h, false, [](const Vector3 &x) { return x; }};
          },
          m,
          [=](const Vector3 &x, int d) {
            const bool on_x = std::abs(x[0]) < 1e-9 || std::abs(x[0] - a) < 1e-9,
                       on_y = std::abs(x[1]) < 1e-9 || std::abs(x[1] - b) < 1e-9;
            return (on_x && d > 0) || (on_y && d != 1);
          },
          bendingWave(m, std::hypot(PETSC_PI / a, PETSC_PI / b), h)};
}

class FeConvergence : public testing::TestWithParam<ElementType>
{
};
INSTANTIATE_TEST_SUITE_P(Types, FeConvergence,
                         testing::Values(ElementType::Tetrahedron4, ElementType::Tetrahedron10, ElementType::Brick8,
                                         ElementType::Brick20));

bool quadratic(ElementType t) { return t == ElementType::Tetrahedron10 || t == ElementType::Brick20; }

} // namespace

TEST_P(FeConvergence, BarAlongItself)
{
  if (quadratic(GetParam()))
    run(bar(), GetParam(), {2, 4}, 4);
  else
    run(bar(), GetParam(), {4, 8}, 2);
}

TEST_P(FeConvergence, TubeInTorsion)
{
  if (quadratic(GetParam()))
    run(tube(), GetParam(), {2, 4}, 4);
  else
    run(tube(), GetParam(), {4, 8}, 2);
}

TEST_P(FeConvergence, PlateInBending)
{
  if (quadratic(GetParam()))
    run(plate(), GetParam(), {2, 4}, 4);
  else
    run(plate(), GetParam(), {4, 8}, 2);
}

/* In the thin limit the exact solution is that of Kirchhoff's plate */
TEST(FeConvergenceReference, RayleighLambHasKirchhoffsLimit)
{
  const Material m{2, .3, 3};
  const double   k = 1.7, h = .002, D = m.young * 8 * h * h * h / (12 * (1 - .09));
  EXPECT_NEAR(bendingWave(m, k, h) / (k * k * std::sqrt(D / (m.density * 2 * h))), 1, 2e-5);
}
