/*
  The smallest change d of poses or velocities, in the metric of the masses, that satisfies Phi_q d = rhs:

    d = d_0 + M^-1 Phi_q^T mu,   (Phi_q M^-1 Phi_q^T + delta) mu = rhs - Phi_q d_0

  The components of d are velocities and angular velocities in space axes, for which M has one small block per body. delta = 1e-11 times the
  diagonal keeps the matrix positive definite if constraints are redundant; the iterations of the caller remove the error that it causes.
*/
#include "products.h"
#include "start.h"
#include <Eigen/Dense>

namespace hhtdae
{

namespace
{

constexpr double regularization = 1e-11; /* delta relative to the diagonal */

/* M^-1 of a body in its directions of motion */
Eigen::MatrixXd Mobility(const SceneData &s, const BodyData &b)
{
  const std::vector<int>     &d = Directions(KindOf(s, b));
  Eigen::Matrix<double, 6, 6> M = Eigen::Matrix<double, 6, 6>::Zero();
  if (b.massless) {
    M.diagonal() << Vector3::Constant(1 / b.light_mass), Vector3::Constant(1 / b.light_inertia);
    return M;
  }
  M.topLeftCorner<3, 3>().diagonal().setConstant(1 / std::max(b.mass, b.light_mass));
  if (s.planar)
    M(5, 5) = b.point ? 0 : 1 / (b.inertia(2, 2) + b.light_inertia);
  else if (!b.point)
    M.bottomRightCorner<3, 3>() = b.A * Matrix3(b.inertia + b.light_inertia * Matrix3::Identity()).inverse() * b.A.transpose();
  Eigen::MatrixXd W(d.size(), d.size());
  for (std::size_t i = 0; i < d.size(); i++)
    for (std::size_t j = 0; j < d.size(); j++) W(i, j) = M(d[i], d[j]);
  return W;
}

/* The columns of a block's k-th body; inactive rows are zero */
Eigen::MatrixXd ColumnsOf(const RowBlock &b, std::size_t k)
{
  Eigen::MatrixXd J = b.J.middleCols(b.column[k], b.column[k + 1] - b.column[k]);
  for (int r = 0; r < b.rows; r++)
    if (!b.has(r)) J.row(r).setZero();
  return J;
}

} // namespace

NearestSystem::~NearestSystem()
{
  PetscCallAbort(PETSC_COMM_SELF, KSPDestroy(&ksp_));
  PetscCallAbort(PETSC_COMM_SELF, MatDestroy(&S_));
  PetscCallAbort(PETSC_COMM_SELF, VecDestroy(&b_));
  PetscCallAbort(PETSC_COMM_SELF, VecDestroy(&x_));
  PetscCallAbort(PETSC_COMM_SELF, VecDestroy(&all_));
  PetscCallAbort(PETSC_COMM_SELF, VecScatterDestroy(&scatter_));
}

/* Assigns global numbers to the rows; the owner of an element owns its rows */
PetscErrorCode NearestSystem::number(const std::vector<RowBlock> &blocks)
{
  std::vector<PetscInt>    next(M.size + 1, 0);
  std::vector<PetscMPIInt> owner(blocks.size());
  PetscFunctionBegin;
  for (std::size_t k = 0; k < blocks.size(); k++) {
    owner[k] = OwnerOf(M, *blocks[k].store, blocks[k].instance);
    next[owner[k] + 1] += blocks[k].rows;
  }
  for (PetscMPIInt r = 0; r < M.size; r++) next[r + 1] += next[r];
  start_ = next[M.rank];
  n_     = next[M.rank + 1] - start_;
  row_.resize(blocks.size());
  for (std::size_t k = 0; k < blocks.size(); k++) {
    row_[k] = next[owner[k]];
    next[owner[k]] += blocks[k].rows;
  }
  PetscCall(VecCreate(M.scene.comm, &b_));
  PetscCall(VecSetSizes(b_, n_, PETSC_DETERMINE));
  PetscCall(VecSetType(b_, VECSTANDARD));
  PetscCall(VecDuplicate(b_, &x_));
  PetscCall(VecScatterCreateToAll(b_, &scatter_, &all_));
  PetscFunctionReturn(0);
}

/* Computes this rank's rows of Phi_q M^-1 Phi_q^T + delta; each body couples all blocks of rows that contain it */
PetscErrorCode NearestSystem::assemble(const std::vector<RowBlock> &blocks)
{
  struct BodyColumns {
    std::size_t block, body;
  };
  const SceneData             &s = M.scene;
  std::vector<std::vector<BodyColumns>> at(s.bodies.size());
  std::vector<PetscInt>        I, J;
  std::vector<PetscScalar>     values;
  std::vector<std::size_t>     first(blocks.size());
  std::size_t                  rows = 0;
  PetscFunctionBegin;
  for (std::size_t k = 0; k < blocks.size(); rows += blocks[k++].rows) {
    first[k] = rows;
    for (std::size_t b = 0; b < blocks[k].body.size(); b++) at[blocks[k].body[b]].push_back({k, b});
  }
  weight_.assign(rows, 0);
  for (std::size_t b = 0; b < at.size(); b++) {
    if (at[b].empty()) continue;
    const Eigen::MatrixXd W = Mobility(s, s.bodies[b]);
    for (const BodyColumns &p : at[b]) {
      const Eigen::MatrixXd JW = ColumnsOf(blocks[p.block], p.body) * W;
      for (int r = 0; r < blocks[p.block].rows; r++)
        weight_[first[p.block] + r] += JW.row(r).dot(ColumnsOf(blocks[p.block], p.body).row(r));
      if (!mine(row_[p.block])) continue;
      for (const BodyColumns &q : at[b]) {
        const Eigen::MatrixXd B = JW * ColumnsOf(blocks[q.block], q.body).transpose();
        for (int r = 0; r < B.rows(); r++)
          for (int c = 0; c < B.cols(); c++) {
            I.push_back(row_[p.block] + r);
            J.push_back(row_[q.block] + c);
            values.push_back(B(r, c));
          }
      }
    }
  }
  for (std::size_t k = 0; k < blocks.size(); k++)
    for (int r = 0; r < blocks[k].rows && mine(row_[k]); r++) {
      I.push_back(row_[k] + r);
      J.push_back(row_[k] + r);
      values.push_back(weight_[first[k] + r] > 0 ? regularization * weight_[first[k] + r] : 1);
    }
  PetscCall(MatDestroy(&S_));
  PetscCall(MatCreate(s.comm, &S_));
  PetscCall(MatSetSizes(S_, n_, n_, PETSC_DETERMINE, PETSC_DETERMINE));
  PetscCall(MatSetType(S_, MATAIJ));
  PetscCall(MatSetPreallocationCOO(S_, (PetscCount)I.size(), I.data(), J.data()));
  PetscCall(MatSetValuesCOO(S_, values.data(), INSERT_VALUES));
  PetscCall(MatSetOption(S_, MAT_SYMMETRIC, PETSC_TRUE));
  PetscCall(MatSetOption(S_, MAT_SPD, PETSC_TRUE));
  PetscFunctionReturn(0);
}

PetscErrorCode NearestSystem::factor(const std::vector<RowBlock> &blocks)
{
  PC        pc;
  PetscBool mumps;
  PetscFunctionBegin;
  if (!b_) PetscCall(number(blocks));
  PetscCall(assemble(blocks));
  if (!ksp_) {
    PetscCall(KSPCreate(M.scene.comm, &ksp_));
    PetscCall(KSPSetOptionsPrefix(ksp_, "scene_assemble_"));
    PetscCall(KSPSetType(ksp_, KSPPREONLY));
    PetscCall(KSPGetPC(ksp_, &pc));
    PetscCall(PCSetType(pc, PCCHOLESKY));
    PetscCall(MatGetFactorAvailable(S_, MATSOLVERMUMPS, MAT_FACTOR_CHOLESKY, &mumps));
    /* CHOLMOD's threads, which OMP_NUM_THREADS does not limit, make it up to 50 times slower on a busy machine */
    if (mumps) PetscCall(PCFactorSetMatSolverType(pc, MATSOLVERMUMPS));
    PetscCall(KSPSetFromOptions(ksp_));
  }
  PetscCall(KSPSetOperators(ksp_, S_, S_));
  PetscFunctionReturn(0);
}

PetscErrorCode NearestSystem::solve(const std::vector<RowBlock> &blocks, const std::vector<double> &rhs,
                                    const std::vector<double> *from, std::vector<double> &d)
{
  const SceneData   &s = M.scene;
  PetscScalar       *b;
  const PetscScalar *x;
  KSPConvergedReason reason;
  PetscFunctionBegin;
  if (from)
    d = *from;
  else
    d.assign(6 * s.bodies.size(), 0);
  PetscCall(VecGetArray(b_, &b));
  std::size_t row = 0;
  for (std::size_t k = 0; k < blocks.size(); row += blocks[k++].rows) {
    if (!mine(row_[k])) continue;
    Eigen::VectorXd f = Eigen::Map<const Eigen::VectorXd>(&rhs[row], blocks[k].rows);
    for (std::size_t m = 0; m < blocks[k].body.size() && from; m++) {
      const PetscInt          body      = blocks[k].body[m];
      const std::vector<int> &direction = Directions(KindOf(s, s.bodies[body]));
      const Eigen::MatrixXd   J         = ColumnsOf(blocks[k], m);
      for (std::size_t c = 0; c < direction.size(); c++) f -= J.col(c) * d[6 * body + direction[c]];
    }
    for (int r = 0; r < blocks[k].rows; r++) b[row_[k] + r - start_] = blocks[k].has(r) ? f(r) : 0;
  }
  PetscCall(VecRestoreArray(b_, &b));
  PetscCall(KSPSolve(ksp_, b_, x_));
  PetscCall(KSPGetConvergedReason(ksp_, &reason));
  PetscCheck(reason > 0, s.comm, PETSC_ERR_CONV_FAILED,
             "The linear solver of the assembly failed (%s); see -scene_assemble_ksp_view",
             KSPConvergedReasons[reason]);
  PetscCall(VecScatterBegin(scatter_, x_, all_, INSERT_VALUES, SCATTER_FORWARD));
  PetscCall(VecScatterEnd(scatter_, x_, all_, INSERT_VALUES, SCATTER_FORWARD));
  PetscCall(VecGetArrayRead(all_, &x));
  std::vector<Eigen::Matrix<double, 6, 1>> load(s.bodies.size(), Eigen::Matrix<double, 6, 1>::Zero());
  for (std::size_t k = 0; k < blocks.size(); k++) {
    const Eigen::Map<const Eigen::VectorXd> mu(x + row_[k], blocks[k].rows);
    for (std::size_t m = 0; m < blocks[k].body.size(); m++) {
      const Eigen::MatrixXd J = ColumnsOf(blocks[k], m);
      load[blocks[k].body[m]].head(J.cols()) += J.transpose() * mu;
    }
  }
  PetscCall(VecRestoreArrayRead(all_, &x));
  for (std::size_t i = 0; i < s.bodies.size(); i++) {
    const std::vector<int> &direction = Directions(KindOf(s, s.bodies[i]));
    const Eigen::VectorXd   change    = Mobility(s, s.bodies[i]) * load[i].head(direction.size());
    for (std::size_t c = 0; c < direction.size(); c++) d[6 * i + direction[c]] += change(c);
  }
  PetscFunctionReturn(0);
}

} // namespace hhtdae
