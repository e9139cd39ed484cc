/* Lists the contents of a scene, and the features that it does not use, which therefore cost nothing (-scene_view, -ts_view). */
#include "extension.h"
#include "runtime.h"
#include "start.h"

namespace hhtdae
{

namespace
{

struct Contents {
  PetscInt multipliers = 0, forces = 0;
  PetscInt modes = 0;
  bool     velocities = false, curved = false, turning = false, flexible = false;
};

Contents Count(const SceneData &s)
{
  Contents c;
  for (const BodyData &b : s.bodies) {
    c.turning |= TurnsInSpace(KindOf(s, b));
    c.flexible |= (bool)b.flexible;
    if (b.flexible) c.modes += b.flexible->model->modes();
  }
  for (const StoreBase *store : s.order) {
    PetscInt n = 0;
    for (PetscInt e = 0; e < store->size(); e++) n += store->unknowns(e);
    (store->isConstraint() ? c.multipliers : c.forces) += n;
    c.velocities |= store->usesVelocities();
    c.curved |= store->isConstraint() && store->hasGeometricStiffness();
  }
  return c;
}

} // namespace

PetscErrorCode Scene::view(PetscViewer viewer) const
{
  PetscFunctionBegin;
  PetscCheck(model_->compiled, data().comm, PETSC_ERR_ARG_WRONGSTATE, "the scene can be viewed after setUp()");
  PetscCall(ViewScene(*model_, nullptr, viewer));
  PetscFunctionReturn(0);
}

PetscErrorCode ViewScene(const Model &M, const Runtime *R, PetscViewer viewer)
{
  const SceneData &s = M.scene;
  std::string      left;
  PetscFunctionBegin;
  PetscCall(ViewStart(s, viewer));
  const Contents c = Count(s);
  const auto     without = [&](bool is, const char *what) {
    if (!is) left += (left.empty() ? "" : ", ") + std::string(what);
  };
  without(c.multipliers, "multipliers");
  without(c.forces, "force states");
  without(!s.variables.empty(), "variables");
  without(!s.states.empty(), "first-order states");
  without(c.velocities, "velocity terms of forces");
  without(c.curved, "second derivatives of constraints");
  without(c.flexible, "flexible bodies");
  without(c.turning, "rotations in space and gyroscopic terms");
  if (R) {
    without(R->has_memory, "angles over full turns");
    without(R->uses_acceleration, "accelerations in definitions");
    without((bool)R->recorder, "output");
  }
  without(M.size > 1, "exchange between ranks");
  without(!s.extensions.empty(), "finite-element bodies");
  PetscCall(PetscViewerASCIIPrintf(viewer, "  unknowns: %d, of these %d multipliers, %d force states, %d variables, %d states\n",
                                   (int)M.number.first.back(), (int)c.multipliers, (int)c.forces, (int)s.variables.size(), (int)s.states.size()));
  if (c.flexible) PetscCall(PetscViewerASCIIPrintf(viewer, "  modal coordinates of flexible bodies: %d\n", (int)c.modes));
  if (c.turning) PetscCall(PetscViewerASCIIPrintf(viewer, "  rotations: %s\n", s.start.rotations == Rotations::Local ? "local rotation vectors" : "Euler angles"));
  if (R && R->rotates_in_space && !R->bodies.local) PetscCall(PetscViewerASCIIPrintf(viewer, "  changes of the axes of Euler angles, own bodies: %d\n", (int)R->axes_changes));
  if (!left.empty()) PetscCall(PetscViewerASCIIPrintf(viewer, "  left out: %s\n", left.c_str()));
  PetscFunctionReturn(0);
}

} // namespace hhtdae
