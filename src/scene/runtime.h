/* A run of a scene: this rank's part of the model, laid out, and everything that changes from step to step. It belongs to a TS. */
#ifndef HHTDAE_SCENE_RUNTIME_H
#define HHTDAE_SCENE_RUNTIME_H

#include "model.h"
#include "projection.h"
#include <functional>
#include <petscsf.h>
#include <petscts.h>

namespace hhtdae
{

struct DroppedRows; /* dropped_rows.cpp */
struct Recorder;    /* output/recorder.h */
struct ChannelWork; /* output/channels.h */

/* An angle that a question has asked for, over full turns, at the last accepted step or where it was asked for first */
struct CountedAngle {
  PetscInt i, j; /* markers, in the scene */
  double   angle;
  double   turned; /* planar scenes: by the bodies' own angles, which count turns whatever the length of a step */
};

struct Runtime {
  const std::shared_ptr<const Model> model;
  const SceneData                   &scene; /* of the model, as the next four */
  const Numbering                   &number;
  const PetscMPIInt                  rank, size;
  const PetscInt                     n, start;

  Pattern                             pattern;
  Bodies                              bodies;
  Projection                          projection; /* of the matrix, from attachments' frames */
  std::vector<std::unique_ptr<Batch>> batches;
  std::vector<Slot>                   body_slot; /* diagonal blocks of own bodies, group by group; all nine of a flexible one */
  std::vector<PetscInt>               local_body; /* of bodies in the scene, -1: not here */
  bool                                uses_acceleration = false; /* somebody reads q'' of other bodies */

  /* exchange: values of others' unknowns; packs (u, v) or (u, v, a) */
  PetscSF                sf = nullptr;
  MPI_Datatype           unit = MPI_DATATYPE_NULL;
  std::vector<PetscInt>  boundary; /* own unknowns that others read */
  std::vector<PetscInt>  others;   /* global numbers of others' unknowns, sorted */
  std::vector<double>    send, receive;
  std::vector<double>    u, v, a; /* local unknowns, where there are others */

  Mat  J = nullptr;
  IS   roles[TSHHT3_NUM_ROLES] = {};
  Vec  axes = nullptr;   /* what a checkpoint has to keep: quaternions of the axes of own rigid bodies, memories, and as kept.cpp says */
  bool changing = false; /* between the test that asked for other axes and their commit */
  bool turns = false, remembers = false; /* on any rank: rigid bodies in space, elements with memory */
  Vec       tolerance[2] = {}; /* absolute and relative: angles have their own, and none; those of all others, below */
  PetscReal tolerance_of[2] = {-1, -1};
  PetscSF axes_sf = nullptr; /* axes of others' bodies */
  /* Not begun, but analyses have found accelerations, and multipliers, for this state: u, u', u'' at a time */
  Vec       start_state[3] = {};
  PetscReal start_time     = 0;
  std::vector<double> start_parameters; /* values then, which functions read */
  std::vector<double> step_parameters; /* values when the last step began */
  PetscReal           accepted = PETSC_NINFINITY;         /* time of the state that axes and memories belong to */
  bool                  steps_limited = false; /* some element says how long a step may be */
  std::vector<double>   reference_before; /* of local rotations, own bodies: quaternions */
  std::vector<Matrix3>  next_axes; /* chosen for bodies that near the singularity, see reframe.cpp */
  std::vector<PetscInt> next_body;
  PetscInt              reframed = 0; /* changes of axes so far, own bodies */

  std::map<std::pair<const StoreBase *, PetscInt>, std::unique_ptr<Probe>> readers; /* of parts of elements that were asked for, ReaderOf() */
  std::vector<CountedAngle>    asked;
  long                         accepts  = 0; /* accepted states that `asked` and the memories have seen */
  PetscInt                     followed = 0; /* steps of a TS of another type among them */
  long                         moved = -1;  /* which move of the bodies was to the last of them; -1: none, or in other axes */
  std::shared_ptr<DroppedRows> dropped;     /* none unless rows were dropped as redundant, on any rank */
  std::shared_ptr<ChannelWork> channels;
  std::shared_ptr<Recorder>    recorder; /* none unless output was asked for */

  explicit Runtime(std::shared_ptr<const Model> m)
      : model(std::move(m)), scene(model->scene), number(model->number), rank(model->rank), size(model->size), n(model->n), start(model->start)
  {
  }
  ~Runtime();
  Runtime(const Runtime &) = delete;
};

/* The run that a TS of Scene::createTS() owns; null if it owns none */
constexpr const char *run_of_ts = "hhtdae scene run";
inline Runtime       *RunOf(TS ts)
{
  PetscContainer box = nullptr;
  void          *run = nullptr;
  PetscCallAbort(PETSC_COMM_SELF, PetscObjectQuery((PetscObject)ts, run_of_ts, (PetscObject *)&box));
  if (box) PetscCallAbort(PETSC_COMM_SELF, PetscContainerGetPointer(box, &run));
  return static_cast<Runtime *>(run);
}
/* layout.cpp: this rank's bodies, markers, batches, pattern, exchange */
PetscErrorCode Layout(Runtime &R);
Probe         &ReaderOf(Runtime &R, const Part &p); /* on the rank that has it */
PetscErrorCode RolesOf(const Runtime &R, std::vector<unsigned char> &role); /* of own unknowns */
/* initial.cpp: state of the description, with what rotations count from chosen by it */
PetscErrorCode InitialState(Runtime &R, Vec U, Vec V);
/* evaluate.cpp */
PetscErrorCode NoteBeginning(Runtime &R, Vec V);
PetscErrorCode LocalState(Runtime &R, const double *u, const double *v, const double *a, const double *local[3]);
/* with accelerations even where no element reads them, which the exchange then leaves out; room: for those of others */
PetscErrorCode LocalMotion(Runtime &R, const double *u, const double *v, const double *a, std::vector<double> &room, const double *local[3]);
PetscErrorCode Residual(Runtime &R, double t, Vec U, Vec V, Vec A, Vec F);
PetscErrorCode Jacobian(Runtime &R, double t, Vec U, Vec V, Vec A, double sv, double sa, Mat J);
/* reframe.cpp: change of the axes of the Euler angles in the course of a run */
PetscErrorCode AttachReframing(Runtime &R, TS ts);
PetscErrorCode MakeAxes(Runtime &R);
PetscErrorCode UseAxes(Runtime &R);
PetscErrorCode KeepMemories(Runtime &R);
PetscInt       Memories(const Runtime &R); /* numbers that elements and functions of this rank remember of accepted steps */
void           CopyMemories(Runtime &R, double *x, bool in); /* out to x, or in from it */
PetscErrorCode Remember(Runtime &R, Vec U, Vec V);
PetscErrorCode RenewAxes(Runtime &R, Vec U, Vec V);
PetscErrorCode AngleTolerances(Runtime &R, TS ts);
/* counted_angles.cpp: the angles at the state where the bodies have been moved to, which u is the own unknowns of; one more of them: its
   turns are those that a spring, a motion, a channel count, or in a planar scene those from the start, else it is in (-pi, pi]. Collective */
PetscErrorCode CountAngles(const Runtime &R, const double *u, std::vector<CountedAngle> &all);
double StartAngle(const Model &M, Marker i, Marker j); /* of assembly and equilibrium too: less than half a turn from how the bodies are described */
PetscErrorCode FirstAngle(const Runtime &R, const double *u, double t, PetscInt i, PetscInt j, CountedAngle *first);
PetscErrorCode CarryAngles(Runtime &from, Vec U, Vec V, Runtime &to, Vec X, Vec Y); /* to a run that goes on in another vector */
/* reframe.cpp: others' bodies too */
PetscErrorCode MoveBodies(Runtime &R, Vec U, Vec V);
/* dropped_rows.cpp: an error where one is violated */
PetscErrorCode LocalizeDropped(Runtime &R, Localizer &l);
PetscErrorCode CheckDropped(Runtime &R, PetscReal t, Vec U, Vec V);
/* kept.cpp: the end of the vector of checkpoints, of Kept() entries: parameters, and behind them these */
constexpr PetscInt kept = 72;
PetscInt           Kept(const Runtime &R);
PetscErrorCode     WriteKept(Runtime &R);                 /* before a checkpoint is written */
PetscErrorCode     ReadKept(Runtime &R, const double *x); /* after one was read */
/* step_limit.cpp: no step goes through a contact, or loses a turn of an angle */
PetscErrorCode AttachStepLimit(Runtime &R, TS ts);
/* expressions.cpp: variables, states, user's forces */
PetscErrorCode LocalizeExpressions(Runtime &R, Localizer &l);
/* output/channels.cpp: markers and unknowns that own channels read; output/recorder.cpp */
PetscErrorCode LocalizeChannels(Runtime &R, Localizer &l);
PetscErrorCode AttachOutput(Runtime &R, const OutputSettings &settings, TS ts);
PetscErrorCode FinishOutput(Runtime &R);
/* output/recorder.cpp: Scene::output() was set when the TS was made, and Scene::solve() has not been called yet; a notice if the TS is solved all the same */
PetscErrorCode ExpectOutput(TS ts, const OutputSettings &settings);
PetscErrorCode OutputIsAttached(TS ts);
PetscErrorCode TellOfNoOutput(const Runtime &R, TS ts);
constexpr PetscInt recorded = 68; /* numbers by which a recording goes on */
PetscErrorCode     SaveOutput(Runtime &R, double *x);
PetscErrorCode     ResumeOutput(Runtime &R, const double *x);
/* ts.cpp: a run from the start, which the TS owns; the run of this scene that the TS owns, for the call that is named */
PetscErrorCode CreateRun(std::shared_ptr<const Model> model, TS *ts);
PetscErrorCode FindRun(const Scene &scene, TS ts, const char *call, Runtime **R);
/* continue.cpp: the run of a TS that has made no step yet, for the call that is named; a run of the same model that has made its first step from where ts is, before its own first one: it has accelerations and
   multipliers of the start; the caller destroys it */
PetscErrorCode NotBegun(TS ts, const char *call, Runtime **R);
PetscErrorCode BeginCopy(TS ts, TSHHT3Start start, TS *copy);
PetscErrorCode ReadCheckpoint(TS ts);      /* a file that TSHHT3CheckpointLoad() has noted for the set-up */
PetscErrorCode StartWithMotions(TS ts);    /* a run from rest, where a motion moves something: its start finds the velocities, unless the user says how it is to start */
PetscErrorCode ToNearestConsistent(TS ts); /* the state of a run that has not begun, in the metric of its mass matrix, with the axes of its angles */
PetscErrorCode KeepStart(TS ts, Vec A); /* accelerations of the present state, which has its multipliers */
/* state: u, u', u'' of a run that has not begun, with the accelerations and multipliers of its start or equilibrium; copy: the run that has
   found them, null if none was needed */
PetscErrorCode StateOfStart(TS ts, PetscReal t, Vec state[3], TS *copy);
std::vector<double> ParametersNow(const SceneData &s); /* functions of the state read present values */
/* u, u', u'' of a run at t: of the start; within the last step, from the equations or, where nobody needs these, interpolated; at the present time, where parameters
   or the solution have been changed since the last step or a restart is due, those that a start from there has. TS types other than hhtdae: the end of the last
   step, without accelerations. copy: as above */
PetscErrorCode StateAt(TS ts, PetscReal t, bool from_equations, Vec state[3], TS *copy);

} // namespace hhtdae

#endif
