/* Connects a scene to PETSc's TS: callbacks, and the run that the TS owns. */
#include "hhtdae/analyses.h"
#include "extension.h"
#include "guard.h"
#include "runtime.h"
#include "start.h"

namespace hhtdae
{

namespace
{

/* TS types other than TSHHT3 do not report accepted states. When their step number has changed, a state has been
   accepted: the solution of the TS is that state while they solve for the next one. Local rotation vectors require
   TSHHT3, which renews their references in every step. */
PetscErrorCode FollowAcceptedSteps(TS ts, Runtime &R)
{
  PetscBool ours;
  TSType    type;
  PetscInt  steps;
  PetscReal t;
  Vec       U, V;
  PetscFunctionBegin;
  if (!R.rotates_in_space && !R.has_memory && !R.dropped) PetscFunctionReturn(0); /* nothing depends on accepted states; queries need TSHHT3 */
  PetscCall(TSGetType(ts, &type));
  PetscCall(PetscStrcmp(type, TSHHT3, &ours));
  if (ours) PetscFunctionReturn(0);
  PetscCheck(!R.rotates_in_space || !R.bodies.local, R.scene.comm, PETSC_ERR_ARG_INCOMP,
             "The scene has bodies that turn in space, whose local rotation vectors TS type %s cannot follow: use Euler angles, -scene_rotations euler313", type);
  PetscCall(TSGetStepNumber(ts, &steps));
  if (steps == R.followed_steps) PetscFunctionReturn(0);
  R.followed_steps = steps;
  PetscCall(TSGetTime(ts, &t));
  PetscCall(TS2GetSolution(ts, &U, &V));
  PetscCall(Remember(R, U, V));
  PetscCall(CheckDropped(R, t, U, V));
  PetscFunctionReturn(0);
}

PetscErrorCode I2Function(TS ts, PetscReal t, Vec U, Vec V, Vec A, Vec F, void *ctx)
{
  PetscFunctionBegin;
  PetscCall(FollowAcceptedSteps(ts, *static_cast<Runtime *>(ctx)));
  PetscCall(Guarded([&] { return Residual(*static_cast<Runtime *>(ctx), t, U, V, A, F); }));
  PetscFunctionReturn(0);
}

PetscErrorCode I2Jacobian(TS ts, PetscReal t, Vec U, Vec V, Vec A, PetscReal sv, PetscReal sa, Mat J, Mat P, void *ctx)
{
  Runtime  &R = *static_cast<Runtime *>(ctx);
  PetscReal factor = 0;
  Vec       begin;
  PetscFunctionBegin;
  if (R.rotates_in_space && R.bodies.local) PetscCall(TSHHT3GetRotationFactor(ts, &factor, &begin));
  if (factor > 0) PetscCall(NoteBeginning(R, begin));
  R.bodies.commutator = sv * factor;
  const PetscErrorCode failed = Guarded([&] { return Jacobian(R, t, U, V, A, sv, sa, P); });
  R.bodies.commutator         = 0;
  PetscCall(failed);
  if (J != P) {
    PetscCall(MatAssemblyBegin(J, MAT_FINAL_ASSEMBLY));
    PetscCall(MatAssemblyEnd(J, MAT_FINAL_ASSEMBLY));
  }
  PetscFunctionReturn(0);
}

/* Makes -ts_view show the scene, too */
PetscErrorCode ViewWithTS(const Runtime &R, TS ts)
{
  PetscOptions      options;
  PetscViewer       viewer;
  PetscViewerFormat format;
  const char       *prefix;
  PetscBool         requested;
  PetscFunctionBegin;
  PetscCall(PetscObjectGetOptions((PetscObject)ts, &options));
  PetscCall(PetscObjectGetOptionsPrefix((PetscObject)ts, &prefix));
  PetscCall(PetscOptionsGetViewer(PetscObjectComm((PetscObject)ts), options, prefix, "-ts_view", &viewer, &format, &requested));
  if (requested) PetscCall(ViewScene(*R.model, &R, viewer));
  PetscCall(PetscViewerDestroy(&viewer));
  PetscFunctionReturn(0);
}

/* Checks dropped rows at the end of the last step; at the end of other steps they are checked when the next step begins */
PetscErrorCode CheckEnd(Runtime &R, TS ts)
{
  PetscReal t;
  Vec       U, V;
  PetscFunctionBegin;
  PetscCall(TSGetTime(ts, &t));
  PetscCall(TS2GetSolution(ts, &U, &V));
  PetscCall(Guarded([&] { return CheckDropped(R, t, U, V); }));
  PetscFunctionReturn(0);
}

/* With -ts_exact_final_time interpolate TSSolve() writes the solution at the final time only to a vector of the caller.
   Here it becomes the solution of the TS, together with velocities and time. */
PetscErrorCode SolveWithFinalTime(TS ts)
{
  TSExactFinalTimeOption option;
  Vec                    U, V, u = nullptr;
  PetscReal              t, end;
  PetscFunctionBegin;
  PetscCall(TSGetExactFinalTime(ts, &option));
  PetscCall(TS2GetSolution(ts, &U, &V));
  if (option == TS_EXACTFINALTIME_INTERPOLATE) {
    PetscCall(VecDuplicate(U, &u));
    PetscCall(VecCopy(U, u));
  }
  const PetscErrorCode failed = TSSolve(ts, u);
  PetscCall(VecDestroy(&u));
  PetscCall(failed);
  PetscCall(TSGetTime(ts, &t));
  PetscCall(TSGetMaxTime(ts, &end));
  if (option != TS_EXACTFINALTIME_INTERPOLATE || t <= end) PetscFunctionReturn(0);
  PetscCall(TSHHT3Interpolate(ts, end, U, V, nullptr));
  PetscCall(TSSetTime(ts, end));
  PetscFunctionReturn(0);
}

} // namespace

namespace
{

#if PETSC_VERSION_LT(3, 23, 0)
PetscErrorCode DestroyRun(void *run)
{
  PetscFunctionBegin;
  delete static_cast<Runtime *>(run);
  PetscFunctionReturn(0);
}
  #define PetscContainerSetCtxDestroy PetscContainerSetUserDestroy
#else
PetscErrorCode DestroyRun(void **run)
{
  PetscFunctionBegin;
  delete static_cast<Runtime *>(*run);
  PetscFunctionReturn(0);
}
#endif

/* Attaches the run to the TS, which destroys it */
PetscErrorCode AttachToTS(TS ts, std::unique_ptr<Runtime> R)
{
  PetscContainer box;
  PetscFunctionBegin;
  PetscCall(PetscContainerCreate(PetscObjectComm((PetscObject)ts), &box));
  PetscCall(PetscContainerSetPointer(box, R.release()));
  PetscCall(PetscContainerSetCtxDestroy(box, DestroyRun));
  PetscCall(PetscObjectCompose((PetscObject)ts, run_of_ts, (PetscObject)box));
  PetscCall(PetscContainerDestroy(&box));
  PetscFunctionReturn(0);
}

/* Attaches the nodes of extensions to the TS, for the preconditioner -pc_type hhtconstraint */
PetscErrorCode SetNodesOfExtensions(const Runtime &R, TS ts)
{
  std::vector<PetscInt> rows;
  IS                    nodes;
  Vec                   zero; /* positions of the nodes for zero coordinates: zero, because the coordinates are positions */
  PetscFunctionBegin;
  if (R.scene.extensions.empty()) PetscFunctionReturn(0);
  for (const auto &x : R.scene.extensions)
    for (PetscInt i = 0; i < x->coordinates(); i++) rows.push_back(x->start[R.rank] + i);
  PetscCall(ISCreateGeneral(R.scene.comm, (PetscInt)rows.size(), rows.data(), PETSC_COPY_VALUES, &nodes));
  PetscCall(ISSetBlockSize(nodes, 3));
  PetscCall(VecCreateMPI(R.scene.comm, R.n, PETSC_DETERMINE, &zero));
  PetscCall(TSHHT3SetNodes(ts, nodes, zero));
  PetscCall(VecDestroy(&zero));
  PetscCall(ISDestroy(&nodes));
  PetscFunctionReturn(0);
}

} // namespace

PetscErrorCode FindRun(const Scene &scene, TS ts, const char *call, Runtime **R)
{
  const SceneData &s = DataOf(scene);
  PetscFunctionBegin;
  *R = RunOf(ts);
  PetscCheck(*R && (*R)->scene.number == s.number, s.comm, PETSC_ERR_ARG_WRONG, "%s: the TS is not of this scene, it was not made by its createTS()", call);
  PetscFunctionReturn(0);
}

PetscErrorCode Scene::createTS(TS *ts)
{
  PetscFunctionBegin;
  PetscCall(setUp());
  PetscCall(CheckUnchanged(data()));
  PetscCall(CreateRun(model_, ts));
  PetscCall(ExpectOutput(*ts, output_));
  if (model_->continues) PetscFunctionReturn(0); /* createTS(ts, from) projects the initial state */
  PetscErrorCode failed = 0;
  if (data().start.equilibrium) failed = Guarded([&] { return StartWithMotions(*ts); });
  else if (LeftToDeform(data())) failed = AssembleAt(*ts, data().start.time);
  if (failed) PetscCall(TSDestroy(ts));
  PetscCall(failed);
  PetscFunctionReturn(0);
}

/* Why an element makes a residual that is not a number */
static std::string WhatIsBad(const ElementData &e)
{
  for (const Part &p : e.parts)
    if (p.store->undefined()) return p.store->undefined();
  return std::string(e.type) + " " + e.name + " is not a number";
}

static PetscErrorCode RowName(TS, PetscInt row, char name[], size_t len, void *ctx)
{
  const Runtime &R = *static_cast<Runtime *>(ctx);
  PetscFunctionBegin;
  PetscCall(Guarded([&] {
    std::string text = UnknownName(*R.model, row);
    if (R.bad_element >= 0) text += "; " + WhatIsBad(R.scene.elements[R.bad_element]);
    PetscCall(PetscStrncpy(name, text.c_str(), len));
    return PetscErrorCode(0);
  }));
  PetscFunctionReturn(0);
}

PetscErrorCode CreateRun(std::shared_ptr<const Model> model, TS *ts)
{
  Vec      U, V, F;
  auto     run = std::make_unique<Runtime>(std::move(model));
  Runtime &R   = *run;
  PetscFunctionBegin;
  PetscCall(Guarded([&] { return Layout(R); }));
  PetscCall(VecCreate(R.scene.comm, &U));
  PetscCall(VecSetSizes(U, R.n, PETSC_DETERMINE));
  PetscCall(VecSetType(U, VECSTANDARD));
  PetscCall(VecDuplicate(U, &V));
  PetscCall(VecDuplicate(U, &F));
  PetscCall(InitialState(R, U, V));
  PetscCall(TSCreate(R.scene.comm, ts));
  PetscCall(AttachToTS(*ts, std::move(run)));
  PetscCall(TSSetProblemType(*ts, TS_NONLINEAR));
  PetscCall(TSSetType(*ts, TSHHT3));
  PetscCall(TSSetI2Function(*ts, F, I2Function, &R));
  PetscCall(TSSetI2Jacobian(*ts, R.J, R.J, I2Jacobian, &R));
  PetscCall(SetNodesOfExtensions(R, *ts));
  PetscCall(TSSetTime(*ts, R.scene.start.time));
  PetscCall(TS2SetSolution(*ts, U, V));
  PetscCall(TSSetExactFinalTime(*ts, TS_EXACTFINALTIME_MATCHSTEP));
  for (int r = 0; r < TSHHT3_NUM_ROLES; r++) PetscCall(TSHHT3SetIS(*ts, (TSHHT3Role)r, R.roles[r]));
  PetscCall(AttachReframing(R, *ts));
  PetscCall(AttachStepLimit(R, *ts));
  PetscCall(TSHHT3SetRowName(*ts, RowName, &R));
  PetscCall(VecDestroy(&U));
  PetscCall(VecDestroy(&V));
  PetscCall(VecDestroy(&F));
  PetscFunctionReturn(0);
}

PetscErrorCode Scene::solve(TS ts)
{
  Runtime *R;
  PetscInt steps;
  PetscFunctionBegin;
  PetscCall(FindRun(*this, ts, "Scene::solve()", &R));
  PetscCall(CheckSame(*R, ts));
  PetscCall(ReadCheckpoint(ts));
  PetscCall(RestartAfterChange(*R, ts));
  PetscCall(TSGetStepNumber(ts, &steps));
  if (steps) R->start_parameters.clear(); /* within the run callers restart it or not */
  PetscCall(AttachOutput(*R, output_, ts));
  PetscCall(OutputIsAttached(ts));
  const PetscErrorCode failed = SolveWithFinalTime(ts);
  PetscCall(TSGetStepNumber(ts, &steps));
  if (steps) R->start_parameters = ParametersNow(R->scene);
  /* After a failure the output sampled so far is written on one rank only: with several ranks, some may not have failed,
     and a collective call would wait forever */
  if (!failed || R->size == 1) PetscCall(FinishOutput(*R));
  PetscCall(failed);
  PetscCall(CheckEnd(*R, ts));
  PetscCall(ViewWithTS(*R, ts));
  PetscFunctionReturn(0);
}

} // namespace hhtdae
