/*
  A run as it is recorded. A monitor of the TS calls every task at the times it wants, within the step that was just accepted and at
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
  virtual PetscErrorCode record(Runtime &R, Evaluation &e) = 0; /* collective, as all of them */
  virtual PetscErrorCode stepped(Runtime &) { return 0; }       /* after the samples of a step */
  virtual PetscErrorCode finish(Runtime &) { return 0; }        /* at the end of a solve; there may be another one */
  virtual int            slot() const = 0;                      /* which of the numbers of a checkpoint are its own */
  virtual PetscErrorCode save(Runtime &R, double *x)         = 0; /* brings files up to date, and notes where they end */
  virtual PetscErrorCode resume(Runtime &R, const double *x) = 0; /* shortens files to that, and goes on behind it */

  double dt;       /* 0: the end of every step */
  double done = 0; /* times between samples since the recording began: a sample for each, but for one that began later */
  bool   from_equations = false; /* it reads accelerations, multipliers or what depends on them */
};

/* Numbers of a checkpoint for each task */
constexpr int task_slots = 4, task_numbers = 15;
static_assert(recorded >= 4 + task_slots * (task_numbers + 1), "room for all tasks");

struct Recorder {
  Runtime                           &R;
  bool                               dense = true;  /* TSHHT3: values between the ends of steps, accelerations */
  bool                               begun = false;
  double                             begin = 0, last = 0; /* time of the first sample, of the end of the last step seen */
  Vec                                U = nullptr, V = nullptr, A = nullptr;
  std::vector<double>                acceleration; /* of the local unknowns */
  std::vector<std::unique_ptr<Task>> tasks;

  explicit Recorder(Runtime &r) : R(r) {}
  ~Recorder();
};

/* What there is to record; null if it was not asked for */
PetscErrorCode MakeTable(Runtime &R, const OutputSettings &o, std::unique_ptr<Task> &task);     /* table.cpp */
PetscErrorCode MakeAnimation(Runtime &R, const OutputSettings &o, std::unique_ptr<Task> &task); /* animation.cpp */
PetscErrorCode MakeBalanceSheet(Runtime &R, const OutputSettings &o, std::unique_ptr<Task> &task); /* balance.cpp */
PetscErrorCode MakePage(Runtime &R, const OutputSettings &o, std::unique_ptr<Task> &task);      /* page.cpp */

} // namespace hhtdae

#endif
