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

/* An angle between two markers that a query has asked for, over full turns, at the last accepted step or at the first query */
struct CountedAngle {
  PetscInt i, j; /* markers, in the scene */
  double   angle;
  double   turned; /* planar scenes: difference of the bodies' own angles, which count turns whatever the length of a step */
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
  std::vector<PetscInt>               local_body;                /* local numbers of the scene's bodies, -1: not on this rank */
  bool                                uses_acceleration = false; /* an element reads accelerations */

  /* exchange of unknowns between ranks: (u, v) or (u, v, a) of each */
  PetscSF                sf = nullptr;
  MPI_Datatype           unit = MPI_DATATYPE_NULL;
  std::vector<PetscInt>  boundary; /* own unknowns that other ranks read */
  std::vector<PetscInt>  others;   /* global numbers of other ranks' unknowns that this rank reads, sorted */
  std::vector<double>    send, receive;
  std::vector<double>    u, v, a; /* own unknowns, then those of `others`; empty on one rank */

  Mat  J = nullptr;
  IS   roles[TSHHT3_NUM_ROLES] = {};
  Vec       axes                    = nullptr;            /* data for checkpoints: quaternions of the axes of own bodies, memories of elements, the numbers of kept.cpp */
  bool      changing_axes           = false;              /* between the test that has requested new axes and their commit */
  bool      rotates_in_space = false, has_memory = false; /* on any rank: bodies with rotations in space; elements with memory of accepted steps */
  Vec       tolerance[2]    = {};                         /* absolute and relative, by unknowns: angles have an absolute one of their own and no relative one */
  PetscReal tolerance_of[2] = {-1, -1};                   /* absolute and relative, of all other unknowns */
  PetscSF   axes_sf         = nullptr;                    /* exchange of the axes of other ranks' bodies */
  /* Before the first step: u, u', u'' with the accelerations and multipliers that an analysis has found, and its time */
  Vec       start_state[3] = {};
  PetscReal start_time     = 0;
  std::vector<double>   start_parameters;                        /* values of the scene's parameters at that time */
  std::vector<double>   step_parameters;                         /* values of the scene's parameters at the beginning of the last step */
  PetscReal           accepted = PETSC_NINFINITY;         /* time of the state that axes and memories belong to */
  bool                  steps_limited = false;                   /* an element limits the step size, on any rank */
  std::vector<double>   reference_before;                        /* previous reference attitudes of own bodies' local rotations: quaternions */
  std::vector<Matrix3>  next_axes;                               /* new axes of bodies near the singularity of Euler angles, see reframe.cpp */
  std::vector<PetscInt> next_body;
  PetscInt              axes_changes = 0; /* number of changes of axes so far, own bodies */

  std::map<std::pair<const StoreBase *, PetscInt>, std::unique_ptr<Probe>> readers; /* probes of queried parts of elements, ReaderOf() */
  std::vector<CountedAngle>                                                queried_angles;
  long                                                                     accepted_states = 0;  /* number of accepted states so far */
  PetscInt                                                                 followed_steps  = 0;  /* step number of the last one from a TS of another type, ts.cpp */
  long                                                                     accepted_move   = -1; /* value of Bodies::moves when the bodies were moved to the last accepted state; -1: never, or axes may have changed since */
  std::shared_ptr<DroppedRows>                                             dropped;              /* null unless rows were dropped as redundant, on any rank */
  std::shared_ptr<ChannelWork> channels;
  std::shared_ptr<Recorder>                                                recorder; /* null without output */

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
Probe         &ReaderOf(Runtime &R, const Part &p);                         /* on the owner of the part */
PetscErrorCode RolesOf(const Runtime &R, std::vector<unsigned char> &role); /* TSHHT3Role of own unknowns */
/* initial.cpp: the described state as unknowns of the run */
PetscErrorCode InitialState(Runtime &R, Vec U, Vec V);
/* evaluate.cpp. NoteBeginning(): stores the angular velocities of V, those at the beginning of the step whose matrix is computed next */
PetscErrorCode NoteBeginning(Runtime &R, Vec V);
PetscErrorCode LocalState(Runtime &R, const double *u, const double *v, const double *a, const double *local[3]);
/* like LocalState(), but with other ranks' accelerations even if no element reads them; room: storage for these */
PetscErrorCode LocalMotion(Runtime &R, const double *u, const double *v, const double *a, std::vector<double> &room, const double *local[3]);
PetscErrorCode Residual(Runtime &R, double t, Vec U, Vec V, Vec A, Vec F);
PetscErrorCode Jacobian(Runtime &R, double t, Vec U, Vec V, Vec A, double sv, double sa, Mat J);
/* reframe.cpp: reference attitudes of local rotations, axes of Euler angles, memories of accepted steps */
PetscErrorCode AttachReframing(Runtime &R, TS ts);
PetscErrorCode MakeAxes(Runtime &R);
PetscErrorCode UseAxes(Runtime &R);
PetscErrorCode KeepMemories(Runtime &R);
PetscInt       Memories(const Runtime &R);                   /* number of values that this rank's elements and functions store of accepted steps */
void           CopyMemories(Runtime &R, double *x, bool in); /* in: from x, else to x */
PetscErrorCode Remember(Runtime &R, Vec U, Vec V);
PetscErrorCode RenewAxes(Runtime &R, Vec U, Vec V);
PetscErrorCode AngleTolerances(Runtime &R, TS ts);
/* counted_angles.cpp. CountAngles(): the angles at the present state of the bodies; u: its own unknowns. FirstAngle(): an angle that is queried for the first time. It has the full turns
   that a spring, a motion or a channel counts, in a planar scene those from the start, else it is in (-pi, pi]. Collective */
PetscErrorCode CountAngles(const Runtime &R, const double *u, std::vector<CountedAngle> &all);
double         StartAngle(const Model &M, Marker i, Marker j); /* after assembly and equilibrium, less than half a turn from the angle of the description, which is in (-pi, pi] */
PetscErrorCode FirstAngle(const Runtime &R, const double *u, double t, PetscInt i, PetscInt j, CountedAngle *first);
PetscErrorCode CarryAngles(Runtime &from, Vec U, Vec V, Runtime &to, Vec X, Vec Y); /* to a run that continues `from`, with the state X, Y */
/* reframe.cpp: moves all bodies of this rank, also those owned by others, to the state (U, V) */
PetscErrorCode MoveBodies(Runtime &R, Vec U, Vec V);
/* dropped_rows.cpp: an error if a dropped row is violated */
PetscErrorCode LocalizeDropped(Runtime &R, Localizer &l);
PetscErrorCode CheckDropped(Runtime &R, PetscReal t, Vec U, Vec V);
/* kept.cpp: the last Kept() entries of Runtime::axes: parameters, then checkpoint_numbers entries */
constexpr PetscInt checkpoint_numbers = 72;
PetscInt           Kept(const Runtime &R);
PetscErrorCode     WriteKept(Runtime &R);                 /* before a checkpoint is written */
PetscErrorCode     ReadKept(Runtime &R, const double *x); /* after one was read */
/* step_limit.cpp: upper bounds on the step size, so that no contact is tunnelled through and no full turn of an angle is lost */
PetscErrorCode AttachStepLimit(Runtime &R, TS ts);
/* expressions.cpp: variables, states, user's forces */
PetscErrorCode LocalizeExpressions(Runtime &R, Localizer &l);
/* output/channels.cpp: markers and unknowns that own channels read; output/recorder.cpp */
PetscErrorCode LocalizeChannels(Runtime &R, Localizer &l);
PetscErrorCode AttachOutput(Runtime &R, const OutputSettings &settings, TS ts);
PetscErrorCode FinishOutput(Runtime &R);
/* output/recorder.cpp: a notice if a TS with output settings is solved by TSSolve() and not by Scene::solve(), which attaches the output */
PetscErrorCode ExpectOutput(TS ts, const OutputSettings &settings);
PetscErrorCode OutputIsAttached(TS ts);
PetscErrorCode TellOfNoOutput(const Runtime &R, TS ts);
constexpr PetscInt recorder_numbers = 68; /* of the state of the recorder in a checkpoint */
PetscErrorCode     SaveOutput(Runtime &R, double *x);
PetscErrorCode     ResumeOutput(Runtime &R, const double *x);
/* ts.cpp. CreateRun(): a run from the start, which the TS owns. FindRun(): the run of this scene that the TS owns; call: for the error message */
PetscErrorCode CreateRun(std::shared_ptr<const Model> model, TS *ts);
PetscErrorCode FindRun(const Scene &scene, TS ts, const char *call, Runtime **R);
/* continue.cpp. NotBegun(): the run of a TS that has made no step yet; call: for the error message. BeginCopy(): a run of the same model that has made its first step from the state of ts, so
   that it has the accelerations and multipliers of the start; the caller destroys it */
PetscErrorCode NotBegun(TS ts, const char *call, Runtime **R);
PetscErrorCode BeginCopy(TS ts, TSHHT3Start start, TS *copy);
PetscErrorCode ReadCheckpoint(TS ts);      /* reads the file of TSHHT3CheckpointLoad(), which is otherwise read at the set-up of the TS */
PetscErrorCode StartWithMotions(TS ts);    /* a run from rest with moving motions: its start projects the velocities, unless -ts_hhtdae_start is given */
PetscErrorCode ToNearestConsistent(TS ts); /* moves the state of a run that has not begun to the nearest consistent one in the metric of the mass matrix */
PetscErrorCode KeepStart(TS ts, Vec A);    /* stores the solution, with its multipliers, and the accelerations A in Runtime::start_state */
/* state: u, u', u'' of a run that has not begun, with the accelerations and multipliers of its start or equilibrium; copy: the run that was
   made to find them, null if none was needed */
PetscErrorCode StateOfStart(TS ts, PetscReal t, Vec state[3], TS *copy);
std::vector<double> ParametersNow(const SceneData &s); /* present values of all parameters */
/* u, u', u'' of a run at t: before the first step of the start; else within the last step, from the equations or, without from_equations, interpolated. If parameters or the solution have been
   changed since the last step, or a restart is due, the state at the present time is that of a start from there. TS types other than hhtdae: the end of the last
   step, without accelerations. copy: as above */
PetscErrorCode StateAt(TS ts, PetscReal t, bool from_equations, Vec state[3], TS *copy);

} // namespace hhtdae

#endif
