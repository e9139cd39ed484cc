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

  void                        resume(PetscReal t); /* after loading a checkpoint at t: removes what was recorded after t */
  PetscErrorCode              look(TS ts, PetscInt step, PetscReal t);
  PetscErrorCode              lookAtEnd(TS ts, PetscInt step, PetscReal t);
  const std::vector<double>  &times() const { return times_; }
  const std::vector<double>  &values() const { return values_; } /* the values of all channels at the first time, then at the second, and so on */

private:
  std::shared_ptr<Scene> scene_;
  double                 dt_; /* time between samples; 0: at the ends of steps */
  std::vector<double>    times_, values_, one_;
  PetscInt64             next_    = 0; /* number of the next sample time, in multiples of dt_ */
  bool                   resumed_ = false; /* the first state that the monitor sees is that of the checkpoint, not the end of a step */

  PetscErrorCode add(TS ts, PetscReal t);
};

} // namespace python
} // namespace hhtdae

#endif
