/*
  Records results of a run. A monitor of the TS calls every task at its sample times within the step that was just accepted and at
  its end, with the bodies moved to that time.
*/
#ifndef HHTDAE_SCENE_OUTPUT_RECORDER_H
#define HHTDAE_SCENE_OUTPUT_RECORDER_H

#include "scene/runtime.h"

namespace hhtdae
{

class Task
{
public:
  explicit Task(double dt) : dt(dt) {}
  virtual ~Task() = default;
  virtual PetscErrorCode record(Runtime &R, Evaluation &e) = 0; /* adds a sample; all functions are collective */
  virtual PetscErrorCode stepped(Runtime &) { return 0; }       /* called after all samples of a step */
  virtual PetscErrorCode finish(Runtime &) { return 0; }        /* called at the end of TSSolve(), which may be called again */
  virtual int            slot() const                        = 0; /* number of the task's block of task_numbers values in a checkpoint */
  virtual PetscErrorCode save(Runtime &R, double *x)         = 0; /* writes all samples to the files and stores their lengths in x */
  virtual PetscErrorCode resume(Runtime &R, const double *x) = 0; /* truncates the files to these lengths and continues there */

  double dt;                     /* time between samples, s; 0: a sample at the end of every step */
  double done           = 0;     /* number of sample times since the recording began, even if this task began later */
  bool   from_equations = false; /* whether the task reads accelerations, multipliers or quantities that depend on them */
};

/* Largest number of tasks, and number of values of each in a checkpoint */
constexpr int task_slots = 4, task_numbers = 15;
static_assert(recorder_numbers >= 4 + task_slots * (task_numbers + 1), "room for all tasks");

struct Recorder {
  Runtime                           &R;
  bool                               dense = true; /* whether the TS is of type TSHHT3, which has states within steps, and accelerations */
  bool                               begun = false;
  double                             begin = 0, last = 0; /* times of the first sample and of the end of the last recorded step */
  Vec                                U = nullptr, V = nullptr, A = nullptr;
  std::vector<double>                acceleration; /* accelerations of the local unknowns */
  std::vector<std::unique_ptr<Task>> tasks;

  explicit Recorder(Runtime &r) : R(r) {}
  ~Recorder();
};

/* Create the tasks; null if the output was not requested */
PetscErrorCode MakeTable(Runtime &R, const OutputSettings &o, std::unique_ptr<Task> &task);     /* table.cpp */
PetscErrorCode MakeAnimation(Runtime &R, const OutputSettings &o, std::unique_ptr<Task> &task); /* animation.cpp */
PetscErrorCode MakeBalanceSheet(Runtime &R, const OutputSettings &o, std::unique_ptr<Task> &task); /* balance.cpp */
PetscErrorCode MakePage(Runtime &R, const OutputSettings &o, std::unique_ptr<Task> &task);      /* page.cpp */

} // namespace hhtdae

#endif
