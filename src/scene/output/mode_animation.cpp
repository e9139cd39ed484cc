/* A mode as an animation: frames show the state of the linearization displaced by the mode shape at successive phases. */
#include "scene/linearization.h"
#include "scene/output/recorder.h"
#include <cmath>

namespace hhtdae
{

PetscErrorCode Linearization::animate(const Mode &m, const std::string &prefix, double amplitude, int frames) const
{
  const Work           &w = *work_;
  OutputSettings        settings;
  std::unique_ptr<Task> task;
  Vec                   d[3], at[3];
  PetscFunctionBegin;
  PetscCall(w.check("Linearization::animate()", m));
  PetscCheck(frames > 0 && std::isfinite(amplitude), w.comm(), PETSC_ERR_ARG_OUTOFRANGE, "Linearization::animate(): %d frames with the amplitude %g; the number must be positive and the amplitude, in metres and radians, finite", frames, amplitude);
  Runtime &R         = *w.R;
  settings.animation = prefix;
  PetscCall(MakeAnimation(R, settings, task));
  PetscCheck(task, w.comm(), PETSC_ERR_ARG_OUTOFRANGE, "Linearization::animate(): the files have no name");
  for (int c = 0; c < 3; c++) {
    PetscCall(VecDuplicate(w.state[0], &d[c]));
    PetscCall(VecDuplicate(w.state[0], &at[c]));
  }
  const CountFrom then(R, w.origin);
  for (int k = 0; k < frames; k++) {
    const auto          phase = std::polar(amplitude, 2 * M_PI * k / frames);
    SmallMotion         x;
    const double       *u[3], *local[3];
    std::vector<double> room;
    for (auto &order : x) order.assign(R.n, 0);
    for (PetscInt i = 0; i < R.n; i++) x[0][i] = w.coordinate(i) ? (phase * m.shape[i]).real() : 0;
    PetscCall(w.toState(x, d));
    for (int c = 0; c < 3; c++) {
      PetscCall(VecWAXPY(at[c], 1, d[c], w.state[c]));
      PetscCall(VecGetArrayRead(at[c], &u[c]));
    }
    PetscCall(LocalMotion(R, u[0], u[1], u[2], room, local));
    R.bodies.move(local[0], local[1]);
    Evaluation e{(double)k / frames, local[0], local[1], local[2], R.bodies, R.n};
    PetscCall(task->record(R, e));
    for (int c = 0; c < 3; c++) PetscCall(VecRestoreArrayRead(at[c], &u[c]));
  }
  PetscCall(task->finish(R));
  for (int c = 0; c < 3; c++) {
    PetscCall(VecDestroy(&d[c]));
    PetscCall(VecDestroy(&at[c]));
  }
  PetscFunctionReturn(0);
}

} // namespace hhtdae
