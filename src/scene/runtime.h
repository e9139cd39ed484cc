/* A scene at work: its part on this rank, numbered, with all that an evaluation needs. */
#ifndef HHTDAE_SCENE_RUNTIME_H
#define HHTDAE_SCENE_RUNTIME_H

#include "scene_data.h"
#include <functional>
#include <petscsf.h>
#include <petscts.h>

namespace hhtdae
{

/* Numbers of all unknowns of the scene, known on every rank; within a rank: bodies, multipliers and force states kernel by
   kernel, variables, states */
struct Numbering {
  std::vector<PetscMPIInt> owner;    /* of bodies; empty on one rank */
  std::vector<PetscInt>    first;    /* of ranks, and the total */
  std::vector<PetscInt>    body;     /* first coordinate */
  std::vector<PetscInt>    variable, state;
  std::vector<PetscMPIInt> variable_owner, state_owner;
};

struct Recorder;    /* output/recorder.h */
struct ChannelWork; /* output/channels.h */

struct Runtime {
  SceneData  &scene;
  PetscMPIInt rank = 0, size = 1;
  Numbering   number;
  PetscInt    n = 0, start = 0; /* own unknowns, global number of the first */

  Pattern                             pattern;
  Bodies                              bodies;
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

  Mat  J = nullptr;      /* of the first TS; others get a duplicate */
  /* one triangle of it: asked for, and so stored; off-diagonal values of own rows, which PETSc takes row by row there */
  bool                  wants_triangle = false, triangle = false;
  std::string           full_because; /* why the whole matrix is stored */
  std::vector<PetscInt> off_start, off_column;
  std::vector<double>   off_value;
  bool given = false;
  IS   roles[TSHHT3_NUM_ROLES] = {};
  Vec  axes = nullptr;   /* what a checkpoint has to keep: quaternions of the axes of own rigid bodies, memories, and as kept.cpp says */
  bool changing = false; /* between the test that asked for other axes and their commit */
  bool turns = false, remembers = false; /* on any rank: rigid bodies in space, elements with memory */
  Vec       rtol    = nullptr; /* relative tolerances, none for angles */
  PetscReal rtol_of = -1;
  PetscSF axes_sf = nullptr; /* axes of others' bodies */
  std::vector<double> axes_start;                         /* the vector before the first step of a run */
  PetscObjectId       ts = 0;                             /* the TS made last: axes and memories are those of its run */
  PetscReal           accepted = PETSC_NINFINITY;         /* time of the state that they belong to */
  std::vector<Matrix3>  next_axes; /* chosen for bodies that near the singularity, see reframe.cpp */
  std::vector<PetscInt> next_body;
  PetscInt              reframed = 0; /* changes of axes so far, own bodies */

  std::shared_ptr<ChannelWork> channels;
  std::shared_ptr<Recorder>    recorder; /* none unless output was asked for */

  explicit Runtime(SceneData &s) : scene(s) {}
  ~Runtime();
};

/* partition.cpp: owners of bodies, METIS */
PetscErrorCode Partition(SceneData &s, PetscMPIInt size, std::vector<PetscMPIInt> &owner);
/* numbering.cpp */
PetscMPIInt    OwnerOf(const Runtime &R, const StoreBase &s, PetscInt e);
PetscErrorCode Number(Runtime &R);
/* layout.cpp: this rank's bodies, markers, batches, pattern, exchange */
PetscErrorCode Layout(Runtime &R);
BodyKind       KindOf(const SceneData &s, const BodyData &b);
PetscInt       CoordinatesOf(const SceneData &s, const BodyData &b); /* modal ones too */
/* initial.cpp: state of the description, with the axes of the Euler angles chosen by it */
PetscErrorCode InitialState(Runtime &R, Vec U, Vec V);
/* evaluate.cpp */
PetscErrorCode LocalState(Runtime &R, const double *u, const double *v, const double *a, const double *local[3]);
PetscErrorCode Residual(Runtime &R, double t, Vec U, Vec V, Vec A, Vec F);
PetscErrorCode Jacobian(Runtime &R, double t, Vec U, Vec V, Vec A, double sv, double sa, Mat J);
/* reframe.cpp: change of the axes of the Euler angles in the course of a run */
PetscErrorCode AttachReframing(Runtime &R, TS ts);
PetscErrorCode MakeAxes(Runtime &R);
PetscErrorCode UseAxes(Runtime &R);
PetscErrorCode RewindAxes(Runtime &R);
PetscErrorCode AngleTolerances(Runtime &R, TS ts);
/* kept.cpp: the end of the vector of checkpoints, of that many entries */
constexpr PetscInt kept = 56;
PetscErrorCode     WriteKept(Runtime &R);                 /* before a checkpoint is written */
PetscErrorCode     ReadKept(Runtime &R, const double *x); /* after one was read */
/* step_limit.cpp: no step goes through a contact, or loses a turn of an angle */
PetscErrorCode AttachStepLimit(Runtime &R, TS ts);
/* expressions.cpp: variables, states, user's forces */
PetscErrorCode LocalizeExpressions(Runtime &R, Localizer &l);
PetscMPIInt    OwnerOf(const Runtime &R, const Expression &e);
/* output/channels.cpp: markers and unknowns that own channels read; output/recorder.cpp */
PetscErrorCode LocalizeChannels(Runtime &R, Localizer &l);
PetscErrorCode AttachOutput(Runtime &R, TS ts);
PetscErrorCode FinishOutput(Runtime &R);
constexpr PetscInt recorded = 52; /* numbers by which a recording goes on */
PetscErrorCode     SaveOutput(Runtime &R, double *x);
PetscErrorCode     ResumeOutput(Runtime &R, const double *x);
/* triangle.cpp: one triangle of the matrix, MATSBAIJ, where nothing breaks its symmetry */
PetscErrorCode WantTriangle(Runtime &R);  /* before Layout() */
PetscErrorCode StoreTriangle(Runtime &R); /* after it */
PetscErrorCode ResolvePattern(Runtime &R, bool triangle, bool again);
PetscErrorCode FillTriangle(Runtime &R, Evaluation &e, Mat J, const std::function<void()> &add);
/* ts.cpp: whether a TS is one of the scene's, for the call that is named */
PetscErrorCode CheckTS(const SceneData &s, TS ts, const char *call);
/* check.cpp: everything that is wrong with the description, as one error */
PetscErrorCode CheckDescription(SceneData &s);
PetscErrorCode CheckUnchanged(const SceneData &s);

} // namespace hhtdae

#endif
