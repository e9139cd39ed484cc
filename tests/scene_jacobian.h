/* A scene in an arbitrary state: its residual, and its Jacobian compared with differences of the residual */
#ifndef HHTDAE_TESTS_SCENE_JACOBIAN_H
#define HHTDAE_TESTS_SCENE_JACOBIAN_H

#include "euler_run.h"
#include "scene_run.h"
#include <random>

namespace hhtest
{

constexpr hhtdae::Rotations all_rotations[] = {hhtdae::Rotations::Local, hhtdae::Rotations::Euler313};

/* On one rank; the scene has been set up */
class AnyState
{
  std::unique_ptr<hhtdae::Runtime> run_;

public:
  hhtdae::Runtime &R;
  double           t = 0.3;
  Vec              U = nullptr, V = nullptr, A = nullptr, F = nullptr;

  AnyState(hhtdae::Scene &s, unsigned seed, double spread = 0.4, hhtdae::Rotations rotations = hhtdae::Rotations::Local)
      : run_(layOut(s)), R(*run_)
  {
    if (rotations == hhtdae::Rotations::Euler313) must(UseEulerAngles(R));
    must(MatCreateVecs(R.J, &U, &F));
    must(VecDuplicate(U, &V));
    must(VecDuplicate(U, &A));
    must(hhtdae::InitialState(R, U, V));
    std::mt19937                           random(seed);
    std::uniform_real_distribution<double> any(-1, 1);
    for (Vec x : {U, V, A})
      for (PetscInt i = 0; i < R.n; i++) add(x, i, (x == U ? spread : 1) * any(random));
  }
  ~AnyState()
  {
    for (Vec *x : {&U, &V, &A, &F}) VecDestroy(x);
  }
  AnyState(const AnyState &) = delete;

  static void add(Vec x, PetscInt i, double d)
  {
    double *a;
    must(VecGetArray(x, &a));
    a[i] += d;
    must(VecRestoreArray(x, &a));
  }
  Array residual()
  {
    must(hhtdae::Residual(R, t, U, V, A, F));
    return whole(F);
  }
  double get(Vec x, PetscInt i) const { return whole(x)[i]; }
  /* the value that a variable's definition gives in this state */
  double definition(hhtdae::Variable v)
  {
    const PetscInt row = R.number.variable[v.id];
    return get(U, row) - residual()[row];
  }
  /* makes the present attitudes the reference of the local rotation vectors, so that du/dt = u' and du'/dt = u'' */
  void refer() { must(hhtdae::RenewAxes(R, U, V)); }
  /* moves along the motion from the reference: du = u' d + u'' d^2/2, du' = u'' d */
  void advance(double d)
  {
    must(VecAXPY(U, d, V));
    must(VecAXPY(U, d * d / 2, A));
    must(VecAXPY(V, d, A));
    t += d;
  }

  /* changes u of the body with the rotation coordinate c by w0 x e_c times `by` */
  void turn(PetscInt c, double by)
  {
    if (by == 0) return;
    for (PetscInt b = 0; b < R.bodies.own; b++) {
      const PetscInt first = R.bodies.body[b].first + 3, k = c - first;
      if (!hhtdae::TurnsInSpace(R.bodies.body[b].kind) || k < 0 || k > 2) continue;
      const hhtdae::Vector3 &w0 = R.bodies.now[b].w0;
      add(U, first + (k + 1) % 3, by * w0((k + 2) % 3));
      add(U, first + (k + 2) % 3, -by * w0((k + 1) % 3));
    }
  }
  /* Largest difference between the Jacobian F_u + sv F_u' + sa F_u'' and differences, relative to max(1, entry).
     factor: TSHHT3GetRotationFactor(); du of a rotation vector is (1 - factor sv [w0]) du, with an arbitrary w0 */
  double jacobianError(double sv, double sa, double factor = 0)
  {
    const double d     = 1e-6;
    double       worst = 0;
    Mat          J;
    must(MatDuplicate(R.J, MAT_DO_NOT_COPY_VALUES, &J));
    for (std::size_t b = 0; b < R.bodies.now.size(); b++) R.bodies.now[b].w0 = hhtdae::Vector3(1. + (double)b, -2., 0.5);
    R.bodies.commutator = sv * factor;
    must(hhtdae::Jacobian(R, t, U, V, A, sv, sa, J));
    R.bodies.commutator = 0;
    for (PetscInt c = 0; c < R.n; c++) {
      const auto shifted = [&](double by) {
        turn(c, -by * sv * factor);
        add(U, c, by);
        add(V, c, sv * by);
        add(A, c, sa * by);
      };
      shifted(d);
      const Array up = residual();
      shifted(-2 * d);
      const Array down = residual();
      shifted(d);
      for (PetscInt r = 0; r < R.n; r++) {
        double       entry;
        const double difference = (up[r] - down[r]) / (2 * d);
        must(MatGetValue(J, r, c, &entry));
        const double error = std::abs(entry - difference) / std::max(1., std::abs(difference));
        if (!(error < 1e-5))
          std::printf("row %d, column %d: %.9g, by differences %.9g\n", (int)r, (int)c, entry, difference);
        widen(worst, error);
      }
    }
    must(MatDestroy(&J));
    return worst;
  }
};

} // namespace hhtest

#endif
