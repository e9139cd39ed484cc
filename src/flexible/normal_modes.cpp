/* Normal modes for the subspace of a reduction: their number, the search, and the removal of those beyond the wanted ones. */
#include "craig_bampton.h"
#include <cmath>

namespace hhtdae
{

static double Eigenvalue(double frequency) { return std::pow(2 * PETSC_PI * frequency, 2); }

PetscErrorCode Want(const Pencil &pencil, const Reduction &reduction, MPI_Comm comm, WantedModes *wanted)
{
  PetscFunctionBegin;
  wanted->count = reduction.modes;
  if (reduction.modes != PETSC_DEFAULT) PetscFunctionReturn(0);
  Phase phase(comm, reduction.progress);
  PetscCall(phase.begin("count of modes"));
  wanted->below = Eigenvalue(reduction.max_frequency);
  PetscCall(CountBelow(pencil, wanted->below, &wanted->count));
  PetscCheck(wanted->count >= 0, comm, PETSC_ERR_SUP,
             "Reduction::modes = PETSC_DEFAULT needs the inertia of a factorization, which the solver chosen by "
             "options does not give; set the number of modes");
  PetscCall(phase.end(std::to_string(wanted->count) + " modes below " + std::to_string(reduction.max_frequency)));
  PetscFunctionReturn(0);
}

/* Reduces modes->wanted to the modes below the bound */
static void CutAbove(double max_frequency, NormalModes *modes)
{
  while (max_frequency > 0 && modes->wanted > 0 && modes->lambda[modes->wanted - 1] > Eigenvalue(max_frequency))
    modes->wanted--;
}

/* If the cut separates equal frequencies, the combinations that are kept are made independent of the number of ranks */
PetscErrorCode CutModes(const FeModel &model, const BodyScales &scales, const NormalModes &modes,
                        ReductionSpace *space)
{
  const PetscInt n = (PetscInt)modes.lambda.size(), before = (PetscInt)space->x.cols() - n;
  PetscInt       from = modes.wanted, to = modes.wanted;

  PetscFunctionBegin;
  space->normal = modes.wanted;
  if (from == n) PetscFunctionReturn(0);
  while (from > 0 && EqualFrequencies(modes.lambda[from - 1], modes.lambda[from])) from--;
  while (to < n && EqualFrequencies(modes.lambda[to - 1 < from ? from : to - 1], modes.lambda[to])) to++;
  if (from < modes.wanted && to > modes.wanted)
    PetscCall(TurnEqual(model, scales, before + from, before + to, &space->x, &space->motion));
  space->x.conservativeResize(Eigen::NoChange, before + modes.wanted);
  space->motion.conservativeResize(Eigen::NoChange, before + modes.wanted);
  PetscFunctionReturn(0);
}

PetscErrorCode FindNormalModes(const FeModel &model, const Pencil &pencil, const Reduction &reduction,
                               const WantedModes &wanted, const WhileFactored &use, KSP *ksp, NormalModes *found)
{
  Phase search(model.comm, reduction.progress), verification(model.comm, reduction.progress);
  bool  searching = true;

  PetscFunctionBegin;
  const auto used = [&](KSP factored, NormalModes *modes) {
    PetscFunctionBegin;
    CutAbove(reduction.max_frequency, modes);
    const std::string result = std::to_string(modes->wanted) + " modes, " + modes->how;
    PetscCall(searching ? search.end(result) : verification.end(result));
    searching = false;
    PetscCall(use(factored, modes));
    PetscCall(verification.begin("verification"));
    PetscFunctionReturn(0);
  };
  PetscCall(search.begin("normal modes"));
  PetscCall(FindModes(pencil, wanted, used, ksp, found));
  PetscCall(verification.end(found->count));
  PetscFunctionReturn(0);
}

} // namespace hhtdae
