/*
  Residual of the equations of motion of each body at the end of a step, according to the scene, and the residual that a
  converged corrector may leave.

  The corrector may leave an error dq in every position, and therefore dq gamma/(beta h) in velocities and dq/(beta h^2) in
  accelerations. These contribute to the equations of a body at most the sum of |J_ij| dq_j over all coordinates j, with
  J = F_u + sigma_v F_v + sigma_a F_a: inertia times the error of an acceleration, and stiffness and damping times the
  errors of positions and velocities, which are far larger where h omega is large. The errors of force states and variables
  follow from dq by their definitions.

  The corrector may also miss accelerations that move a position by less than a tenth of the tolerance within the step,
  which is what the integrator proves (src/integrator/proofs/verify.cpp): around an event, where steps are short, forces are
  no more accurate.

  Loads computed from channels have additional rounding errors: stiffness and damping times some last digits of the unknowns.
*/
#ifndef HHTDAE_SOAK_MODEL_RESIDUAL_H
#define HHTDAE_SOAK_MODEL_RESIDUAL_H

#include "balance/newton_euler.h"
#include "hhtdae/hhtdae.h"
#include "scene/runtime.h"
#include "scene/start.h"

namespace soak
{

class BodyResiduals
{
public:
  BodyResiduals(TS ts, double dq, double tolerance) : R_(*hhtdae::RunOf(ts)), dq_(dq), tolerance_(tolerance) {}

  /* to be called at the end of a step */
  PetscErrorCode make(TS ts, PetscReal t)
  {
    Vec       U, V, A, F, inertia, stiffness; /* inertia: M/(beta h^2); stiffness: the diagonal without it */
    Mat       J;
    PetscReal before;

    PetscFunctionBegin;
    PetscCall(TSGetPrevTime(ts, &before));
    PetscCall(TS2GetSolution(ts, &U, &V));
    PetscCall(TSHHT3GetAcceleration(ts, &A));
    const double h = t - before;
    PetscCall(VecDuplicate(U, &F));
    PetscCall(MatDuplicate(R_.J, MAT_DO_NOT_COPY_VALUES, &J));
    PetscCall(hhtdae::Residual(R_, t, U, V, A, F));
    PetscCall(hhtdae::Jacobian(R_, t, U, V, A, gamma / (beta * h), 0, J));
    PetscCall(VecDuplicate(U, &inertia));
    PetscCall(VecDuplicate(U, &stiffness));
    PetscCall(MatGetDiagonal(J, stiffness));
    PetscCall(errors(ts, U, J, 16 * PETSC_MACHINE_EPSILON));
    PetscCall(rounding(J));
    PetscCall(hhtdae::Jacobian(R_, t, U, V, A, gamma / (beta * h), 1 / (beta * h * h), J));
    PetscCall(MatGetDiagonal(J, inertia));
    PetscCall(VecAXPY(inertia, -1, stiffness));
    PetscCall(errors(ts, U, J, dq_));
    PetscCall(missing(U, inertia));
    PetscCall(loads(F, J));
    PetscCall(VecDestroy(&stiffness));
    PetscCall(VecDestroy(&inertia));
    PetscCall(VecDestroy(&F));
    PetscCall(MatDestroy(&J));
    PetscFunctionReturn(0);
  }
  const std::vector<hhtest::BodyResidual> &get() const { return of_; }

private:
  static constexpr double           beta = 0.4225, gamma = 0.8; /* for the default alpha, -0.3 */
  hhtdae::Runtime                  &R_;
  double                            dq_, tolerance_;
  std::vector<double>               error_; /* allowed error of each unknown */
  std::vector<double>               missing_; /* force in each row that moves its coordinate by a tenth of the tolerance */
  std::vector<double>               rounding_; /* rounding of the loads of each row that follows from the rounding of the unknowns */
  std::vector<hhtest::BodyResidual> of_;

  PetscErrorCode rounding(Mat J)
  {
    double diagonal;

    PetscFunctionBegin;
    rounding_.assign((std::size_t)R_.n, 0);
    for (PetscInt i = 0; i < R_.n; i++) PetscCall(row(J, i, &rounding_[(std::size_t)i], &diagonal));
    PetscFunctionReturn(0);
  }
  /* sum of |J_ij| error_j */
  PetscErrorCode row(Mat J, PetscInt i, double *sum, double *diagonal)
  {
    PetscInt           n;
    const PetscInt    *column;
    const PetscScalar *value;

    PetscFunctionBegin;
    PetscCall(MatGetRow(J, i, &n, &column, &value));
    for (PetscInt k = 0; k < n; k++) {
      *sum += std::abs(value[k]) * error_[(std::size_t)column[k]];
      if (column[k] == i) *diagonal = std::abs(value[k]);
    }
    PetscCall(MatRestoreRow(J, i, &n, &column, &value));
    PetscFunctionReturn(0);
  }
  /* errors of variables and force states come after those of the unknowns on which they depend */
  PetscErrorCode errors(TS ts, Vec U, Mat J, double dq)
  {
    const PetscScalar *u;
    IS                 is;
    PetscInt           n;
    const PetscInt    *at;

    PetscFunctionBegin;
    error_.assign((std::size_t)R_.n, 0);
    PetscCall(VecGetArrayRead(U, &u));
    for (TSHHT3Role role : {TSHHT3_COORDINATE, TSHHT3_STATE, TSHHT3_VARIABLE, TSHHT3_FORCE}) {
      const bool          defined = role == TSHHT3_VARIABLE || role == TSHHT3_FORCE;
      std::vector<double> own;
      PetscCall(TSHHT3GetIS(ts, role, &is));
      PetscCall(ISGetLocalSize(is, &n));
      PetscCall(ISGetIndices(is, &at));
      for (PetscInt k = 0; k < n; k++) {
        double sum = 0, diagonal = 1;
        if (defined)
          PetscCall(row(J, at[k], &sum, &diagonal));
        else
          sum = dq * std::sqrt((double)n) * std::max(1., std::abs(u[at[k]]));
        own.push_back(sum / diagonal);
      }
      for (PetscInt k = 0; k < n; k++) error_[(std::size_t)at[k]] = own[(std::size_t)k];
      PetscCall(ISRestoreIndices(is, &at));
    }
    PetscCall(VecRestoreArrayRead(U, &u));
    PetscFunctionReturn(0);
  }
  /* M a with a h^2/2 = a tenth of the tolerance */
  PetscErrorCode missing(Vec U, Vec inertia)
  {
    const PetscScalar *u, *m;

    PetscFunctionBegin;
    missing_.assign((std::size_t)R_.n, 0);
    PetscCall(VecGetArrayRead(U, &u));
    PetscCall(VecGetArrayRead(inertia, &m));
    for (PetscInt i = 0; i < R_.n; i++)
      missing_[(std::size_t)i] = 2 * beta * std::abs(m[i]) * 0.1 * tolerance_ * std::sqrt((double)R_.n) * std::max(1., std::abs(u[i]));
    PetscCall(VecRestoreArrayRead(inertia, &m));
    PetscCall(VecRestoreArrayRead(U, &u));
    PetscFunctionReturn(0);
  }
  /* sums over the rows of each body */
  PetscErrorCode loads(Vec F, Mat J)
  {
    const PetscScalar *f;

    PetscFunctionBegin;
    of_.assign(R_.scene.bodies.size(), {});
    PetscCall(VecGetArrayRead(F, &f));
    for (std::size_t b = 0; b < of_.size(); b++) {
      if (R_.number.body[b] < 0) continue; /* an attachment, whose loads act on the flexible body */
      const PetscInt           local  = R_.local_body[b];
      const hhtdae::LocalBody &body   = R_.bodies.body[(std::size_t)local];
      Vector3                  left[] = {Vector3::Zero(), Vector3::Zero()}, most[] = {Vector3::Zero(), Vector3::Zero()},
                               noise[] = {Vector3::Zero(), Vector3::Zero()};
      for (int g = 0; g < hhtdae::Groups(body.kind); g++)
        for (int c = 0; c < hhtdae::GroupSize(body.kind, g); c++) {
          const PetscInt i = R_.number.body[b] + hhtdae::GroupOffset(body.kind, g) + c;
          const int      to = body.kind == hhtdae::BodyKind::Planar && g == 1 ? 2 : c;
          double         diagonal;
          left[g](to) = f[i];
          PetscCall(row(J, i, &most[g](to), &diagonal));
          most[g](to) += missing_[(std::size_t)i];
          noise[g](to) = rounding_[(std::size_t)i];
        }
      hhtdae::Matrix3 G = hhtdae::Matrix3::Identity(); /* rotational rows are G^T times the moment */
      if (hhtdae::TurnsInSpace(body.kind)) G = R_.bodies.now[(std::size_t)local].G.inverse().transpose().eval();
      of_[b] = {left[0], G * left[1], most[0].norm(), G.norm() * most[1].norm(), noise[0].norm(), G.norm() * noise[1].norm()};
    }
    PetscCall(VecRestoreArrayRead(F, &f));
    PetscCall(withoutInertia());
    PetscFunctionReturn(0);
  }
  /* A massless body transmits what is left of the equations of its neighbours */
  PetscErrorCode withoutInertia()
  {
    double force = 0, moment = 0;

    PetscFunctionBegin;
    for (const hhtest::BodyResidual &b : of_) {
      force  = std::max(force, b.force_allowed);
      moment = std::max(moment, b.moment_allowed);
    }
    for (std::size_t b = 0; b < of_.size(); b++)
      if (R_.scene.bodies[b].mass == 0) {
        of_[b].force_allowed  = force;
        of_[b].moment_allowed = moment + force * hhtdae::SceneSize(R_.scene);
      }
    PetscFunctionReturn(0);
  }
};

} // namespace soak

#endif
