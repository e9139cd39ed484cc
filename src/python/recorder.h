/* Channels of a run in memory, as a monitor of its TS. */
#ifndef HHTDAE_PYTHON_RECORDER_H
#define HHTDAE_PYTHON_RECORDER_H

#include "bind.h"
#include "hhtdae/scene.h"
#include <memory>

namespace hhtdae
{
namespace python
{

class Recorder
{
public:
  Recorder(std::shared_ptr<Scene> scene, double dt) : scene_(std::move(scene)), dt_(dt) {}

  void                        resume(PetscReal t); /* from a checkpoint at t: what was recorded after it counts no longer */
  PetscErrorCode              look(TS ts, PetscInt step, PetscReal t);
  PetscErrorCode              lookAtEnd(TS ts, PetscInt step, PetscReal t);
  const std::vector<double>  &times() const { return times_; }
  const std::vector<double>  &values() const { return values_; } /* all channels of a time behind one another */

private:
  std::shared_ptr<Scene> scene_;
  double                 dt_; /* 0: ends of steps */
  std::vector<double>    times_, values_, one_;
  PetscInt64             next_    = 0; /* multiple of dt */
  bool                   resumed_ = false; /* the first state that is seen is not the end of a step, but where the checkpoint begins */

  PetscErrorCode add(TS ts, PetscReal t);
};

} // namespace python
} // namespace hhtdae

#endif
