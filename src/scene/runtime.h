/* A run of a scene: the local arrays and batches of this rank's part of the model, and everything that changes from step to step. A TS owns it. */
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

/* An angle between two markers that has been queried, rad, with full turns counted; its value at the last accepted
   step, or at the first query if that was later */
struct CountedAngle {
  PetscInt i, j; /* markers, in the scene */
  double   angle;
  double   turned; /* planar scenes: difference of the two bodies' angle coordinates, which count full turns for any step size */
};

struct Runtime {
  const std::shared_ptr<const Model> model;
  const SceneData                   &scene; /* this and the next three lines: shorthands for members of *model */
  const Numbering                   &number;
  const PetscMPIInt                  rank, size;
  const PetscInt                     n, start;

  Pattern                             pattern;
  Bodies                              bodies;
  Projection                          projection; /* transforms matrix blocks at attachments' frames to the coordinates of flexible bodies */
  std::vector<std::unique_ptr<Batch>> batches;
  /* slots of own bodies' diagonal blocks, one per group; a flexible body has all nine blocks between its three groups */
  std::vector<Slot>                   body_slot;
  std::vector<PetscInt>               local_body;                /* local numbers of the scene's bodies, -1: not on this rank */
  bool                                uses_acceleration = false; /* whether an element reads accelerations */

  /* Exchange of unknowns between ranks: for each unknown (u, v), or (u, v, a) if uses_acceleration */
  PetscSF                sf = nullptr;
  MPI_Datatype           unit = MPI_DATATYPE_NULL;
  std::vector<PetscInt>  boundary; /* own unknowns that other ranks read */
  std::vector<PetscInt>  others;   /* global numbers of other ranks' unknowns that this rank reads, sorted */
  std::vector<double>    send, receive;
  std::vector<double>    u, v, a; /* own unknowns, then those of `others`; empty on one rank */

  Mat  J = nullptr;
  IS   roles[TSHHT3_NUM_ROLES] = {};
  /* vector stored in checkpoints: quaternions of own bodies' axes (LocalBody::C), memories of elements, the numbers of
     kept.cpp */
  Vec       axes                    = nullptr;
  bool      changing_axes           = false;              /* true between the test that has requested new axes and their commit (reframe.cpp) */
  /* whether any rank has bodies with rotations in space, or elements with memory of accepted steps */
  bool      rotates_in_space = false, has_memory = false;
  /* absolute and relative tolerance of each unknown, set by AngleTolerances(); null if not needed */
  Vec       tolerance[2]    = {};
  PetscReal tolerance_of[2] = {-1, -1};                   /* absolute and relative tolerance of unknowns that are not angles */
  PetscSF   axes_sf         = nullptr;                    /* exchange of the axes of other ranks' bodies */
  /* State before the first step, if an analysis (hhtdae/analyses.h) has computed it: u, u', u'' with accelerations and multipliers, and its time */
  Vec       start_state[3] = {};
  PetscReal start_time     = 0;
  std::vector<double>   start_parameters;                        /* values of the scene's parameters at that time; after Scene::solve() those at its end; empty while the run is under way */
  std::vector<double>   step_parameters;                         /* values of the scene's parameters at the beginning of the last step */
  PetscReal           accepted = PETSC_NINFINITY;         /* time of the accepted state to which axes and memories belong */
  bool                  steps_limited = false;                   /* whether an element on any rank limits the step size */
  bool                  told_of_lost_turns = false;
  std::vector<double>   reference_before;                        /* previous reference attitudes of own bodies' local rotations: quaternions */
  std::vector<Matrix3>  next_axes;                               /* new axes of own bodies near the singularity of Euler angles, see reframe.cpp */
  std::vector<PetscInt> next_body;                               /* local numbers of these bodies */
  PetscInt              axes_changes = 0; /* number of changes of axes so far, own bodies */

  std::map<std::pair<const StoreBase *, PetscInt>, std::unique_ptr<Probe>> readers; /* probes of queried parts of elements, ReaderOf() */
  std::vector<CountedAngle>                                                queried_angles;
  bool                                                                     turns_unknown   = false; /* after a checkpoint was read, until it was said that an angle has turns that nobody had counted */
  /* numbers of the program that steers the run, such as the signs of its events: checkpoints have them. "HHTSceneNotes_C" gives it this list. */
  std::vector<double>                                                      notes;
  long                                                                     accepted_states = 0;  /* number of accepted states and read checkpoints so far */
  /* number of the last step that a TS of another type than TSHHT3 has completed, FollowAcceptedSteps() in ts.cpp */
  PetscInt                                                                 followed_steps  = 0;
  long                                                                     accepted_move   = -1; /* value of Bodies::moves when the bodies were moved to the last accepted state; -1: never, or axes may have changed since */
  std::shared_ptr<DroppedRows>                                             dropped;              /* null unless rows were dropped as redundant, on any rank */
  std::shared_ptr<ChannelWork> channels;
  std::shared_ptr<Recorder>                                                recorder; /* null without output */

  PetscInt bad_element = -1; /* element of this rank that made the last residual not a number, BadElement() */

  explicit Runtime(std::shared_ptr<const Model> m)
      : model(std::move(m)), scene(model->scene), number(model->number), rank(model->rank), size(model->size), n(model->n), start(model->start)
  {
  }
  ~Runtime();
  Runtime(const Runtime &) = delete;
};

/* The run that a TS made by Scene::createTS() owns; null for any other TS */
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
Probe         &ReaderOf(Runtime &R, const Part &p);                         /* the probe of a part of an element; called on the owner of the part */
PetscErrorCode RolesOf(const Runtime &R, std::vector<unsigned char> &role); /* TSHHT3Role of own unknowns */
/* initial.cpp: the described state as unknowns of the run */
PetscErrorCode InitialState(Runtime &R, Vec U, Vec V);
/* evaluate.cpp. NoteBeginning(): V are the velocities at the beginning of the step whose matrix is computed next; stores
   their angular velocities in BodyMotion::w0 */
PetscErrorCode NoteBeginning(Runtime &R, Vec V);
PetscErrorCode LocalState(Runtime &R, const double *u, const double *v, const double *a, const double *local[3]);
/* The same as LocalState(), but with other ranks' accelerations even if no element reads them; room: storage for these accelerations */
PetscErrorCode LocalMotion(Runtime &R, const double *u, const double *v, const double *a, std::vector<double> &room, const double *local[3]);
PetscErrorCode Residual(Runtime &R, double t, Vec U, Vec V, Vec A, Vec F);
bool           AllFinite(const double *x, PetscInt n); /* bad_element.cpp */
PetscInt       BadElement(Runtime &R, const Evaluation &e, const double *f);
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
/* counted_angles.cpp, collective. CountAngles() updates the angles to the state to which the bodies were last moved; u:
   this rank's unknowns in that state. FirstAngle(): an angle that is queried for the first time. It has the full turns
   that a spring, a motion or a channel counts for the same markers; without these, in a planar scene, the full turns
   since the start; else it is in (-pi, pi], and its full turns are unknown unless the run is at its start. */
PetscErrorCode CountAngles(const Runtime &R, const double *u, std::vector<CountedAngle> &all);
/* the angle after assembly and equilibrium, which differs by less than half a turn from the described one in (-pi, pi] */
double         StartAngle(const Model &M, Marker i, Marker j);
PetscErrorCode FirstAngle(const Runtime &R, const double *u, double t, PetscInt i, PetscInt j, CountedAngle *first, bool *turns_known);
/* copies queried angles and full turns from a run in state U, V to the run `to`, in state X, Y, that continues it */
PetscErrorCode CarryAngles(Runtime &from, Vec U, Vec V, Runtime &to, Vec X, Vec Y);
/* reframe.cpp: moves all bodies on this rank, including copies of other ranks' bodies, to the state (U, V) */
PetscErrorCode MoveBodies(Runtime &R, Vec U, Vec V);
/* dropped_rows.cpp: an error if a dropped row is violated */
PetscErrorCode LocalizeDropped(Runtime &R, Localizer &l);
PetscErrorCode CheckDropped(Runtime &R, PetscReal t, Vec U, Vec V);
/* kept.cpp: the last Kept() entries of Runtime::axes: parameters, then checkpoint_numbers entries */
constexpr PetscInt checkpoint_numbers = 72;
PetscInt           Kept(const Runtime &R);
PetscErrorCode     WriteKept(Runtime &R);                 /* before a checkpoint is written */
PetscErrorCode     ReadKept(Runtime &R, const double *x); /* after one was read */
PetscErrorCode     KeepNumbers(TS ts);                    /* lets checkpoints have the queried angles and Runtime::notes */
/* step_limit.cpp: upper bounds on the step size, so that no contact is tunnelled through and no full turn of an angle is lost */
PetscErrorCode AttachStepLimit(Runtime &R, TS ts);
/* a notice if the step h, which has ended where the bodies are, was fixed and too long for an angle over full turns */
PetscErrorCode TellOfLostTurns(Runtime &R, TS ts, PetscReal h);
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
constexpr PetscInt recorder_numbers = 68; /* number of values of the recorder's state in a checkpoint */
PetscErrorCode     SaveOutput(Runtime &R, double *x);
PetscErrorCode     ResumeOutput(Runtime &R, const double *x);
/* ts.cpp. CreateRun(): creates a TS and the run from the start that it owns. FindRun(): the run of this scene that the TS
   owns; `call` names the caller in the error message */
PetscErrorCode CreateRun(std::shared_ptr<const Model> model, TS *ts);
PetscErrorCode FindRun(const Scene &scene, TS ts, const char *call, Runtime **R);
/* continue.cpp. NotBegun(): the run of a TS that has made no step yet; else an error in which `call` names the caller.
   BeginCopy(): a run of the same model that has made its first step from the state of ts, from which the accelerations
   and multipliers of the start are read; the caller destroys it */
PetscErrorCode NotBegun(TS ts, const char *call, Runtime **R);
PetscErrorCode BeginCopy(TS ts, TSHHT3Start start, TS *copy);
PetscErrorCode ReadCheckpoint(TS ts);      /* reads the file of TSHHT3CheckpointLoad(), which is otherwise read at the set-up of the TS */
/* if motions move a run that is at rest, its start projects the velocities, unless -ts_hhtdae_start is given */
PetscErrorCode StartWithMotions(TS ts);
PetscErrorCode ToNearestConsistent(TS ts); /* moves the state of a run that has not begun to the nearest consistent one in the metric of the mass matrix */
PetscErrorCode KeepStart(TS ts, Vec A);    /* stores the solution, with its multipliers, and the accelerations A in Runtime::start_state */
/* state: u, u', u'' of a run that has not begun, with the accelerations and multipliers of its start or equilibrium;
   copy: the run by BeginCopy() that was made to compute them, null if none was needed */
PetscErrorCode StateOfStart(TS ts, PetscReal t, Vec state[3], TS *copy);
std::vector<double> ParametersNow(const SceneData &s); /* present values of all parameters */
/* Values of the parameters that belong to the state of a run at t: within the last step those of this step, at its end the present ones */
PetscErrorCode ParametersAt(const Runtime &R, TS ts, PetscReal t, std::vector<double> *values);

/* During the lifetime of this object the scene's parameters have other values; their present ones if `values` is empty */
class WithParameters
{
public:
  WithParameters(const SceneData &s, const std::vector<double> &values) : scene_(s)
  {
    if (values.empty()) return;
    now_ = ParametersNow(s);
    put(values);
  }
  ~WithParameters() { put(now_); }
  WithParameters(const WithParameters &) = delete;

private:
  const SceneData    &scene_;
  std::vector<double> now_;
  void                put(const std::vector<double> &values)
  {
    for (std::size_t k = 0; k < values.size(); k++) *scene_.parameters[k].present = values[k];
  }
};

/* u, u', u'' of a run at t. Before the first step: the state of the start. Later: a state within the last step, whose
   accelerations and multipliers satisfy the equations (from_equations) or are interpolated, with the parameters of that
   step. If parameters or the solution have been changed since the last step, or a restart is due, the state at the present
   time is that of a start from there; positions and velocities are the given ones, unless a parameter has changed what
   constraints prescribe: then it is read from a copy, whose start has projected them. With TS types other than hhtdae only
   the end of the last step is available, without accelerations. copy: as in StateOfStart() */
PetscErrorCode StateAt(TS ts, PetscReal t, bool from_equations, Vec state[3], TS *copy);

} // namespace hhtdae

#endif
