/* The Craig-Bampton subspace: constraint modes followed by fixed-interface normal modes. */
#include "craig_bampton.h"

namespace hhtdae
{

static PetscErrorCode StartSpace(const FeModel &model, const std::vector<Tied> &tied, const Interior &in,
                                 const Reduction &reduction, KSP ksp, ReductionSpace *space)
{
  const PetscInt n = 6 * (PetscInt)tied.size();
  Phase          phase(model.comm, reduction.progress);

  PetscFunctionBegin;
  PetscCall(phase.begin("constraint modes"));
  space->x.resize(3 * model.own, n);
  PetscCall(ConstraintModes(model, tied, in, ksp, &space->x));
  space->motion.setIdentity(n, n);
  space->holds_rigid = true;
  PetscCall(phase.end(std::to_string(n) + " modes"));
  PetscFunctionReturn(0);
}

static PetscErrorCode AddNormalModes(const FeModel &model, const Interior &in, const BodyScales &scales,
                                     const NormalModes &normal, ReductionSpace *space)
{
  const PetscInt n = (PetscInt)space->x.cols(), m = (PetscInt)normal.lambda.size();

  PetscFunctionBegin;
  space->x.conservativeResize(Eigen::NoChange, n + m);
  space->x.rightCols(m).setZero();
  for (PetscInt k = 0; k < m; k++)
    for (std::size_t i = 0; i < in.dof.size(); i++) space->x(in.dof[i], n + k) = normal.x(i, k);
  space->motion.conservativeResize(Eigen::NoChange, n + m);
  space->motion.rightCols(m).setZero();
  PetscCall(CutModes(model, scales, normal, space));
  PetscFunctionReturn(0);
}

MatrixXd InteriorRows(const Interior &in, const MatrixXd &force)
{
  MatrixXd rows = MatrixXd::Zero(in.rows, force.cols());
  for (std::size_t i = 0; i < in.dof.size(); i++) rows.row(i) = force.row(in.dof[i]);
  return rows;
}

static PetscErrorCode FactorPhase(const FeModel &model, const Interior &in, const Reduction &reduction,
                                  const BodyScales &scales, KSP *ksp)
{
  PetscInt unknowns;
  Phase    phase(model.comm, reduction.progress);

  PetscFunctionBegin;
  PetscCall(phase.begin("factorization"));
  PetscCall(FactorInterior(model, in, scales, ksp));
  PetscCall(MatGetSize(in.pencil.K, &unknowns, nullptr));
  PetscCall(phase.end(std::to_string(unknowns) + " unknowns"));
  PetscFunctionReturn(0);
}

PetscErrorCode CraigBamptonSpace(const FeModel &model, const std::vector<Tied> &tied, const Reduction &reduction,
                                 const BodyScales &scales, ReductionSpace *space)
{
  Interior     in;
  WantedModes  wanted;
  NormalModes  normal;
  ScopedSolver solver;

  PetscFunctionBegin;
  PetscCall(CreateInterior(model, tied, scales, &in));
  if (reduction.method == Method::CraigBampton) PetscCall(Want(in.pencil, reduction, model.comm, &wanted));
  PetscCall(FactorPhase(model, in, reduction, scales, &solver.ksp));
  PetscCall(StartSpace(model, tied, in, reduction, solver.ksp, space));
  const PetscInt constraints = (PetscInt)space->x.cols();

  const auto use = [&](KSP factored, NormalModes *modes) {
    PetscFunctionBegin;
    PetscCall(AddNormalModes(model, in, scales, *modes, space));
    PetscCall(SolveSpace(model, reduction, scales, space));
    PetscCall(ModeResiduals(
        model, reduction, 0., factored,
        [&in](const MatrixXd &force, MatrixXd *rows) {
          *rows = InteriorRows(in, force);
          return (PetscErrorCode)0;
        },
        space));
    /* frees the copies of the normal modes, which `modes` holds as well: the next factorization needs the memory */
    space->x.conservativeResize(Eigen::NoChange, constraints);
    space->motion.conservativeResize(Eigen::NoChange, constraints);
    PetscFunctionReturn(0);
  };
  PetscCall(FindNormalModes(model, in.pencil, reduction, wanted, use, &solver.ksp, &normal));
  PetscCall(AddNormalModes(model, in, scales, normal, space));
  PetscFunctionReturn(0);
}

} // namespace hhtdae
