/* The scene as a problem of PETSc's TS. */
#include "guard.h"
#include "runtime.h"

namespace hhtdae
{

namespace
{

PetscErrorCode I2Function(TS, PetscReal t, Vec U, Vec V, Vec A, Vec F, void *ctx)
{
  PetscFunctionBegin;
  PetscCall(Guarded([&] { return Residual(*static_cast<Runtime *>(ctx), t, U, V, A, F); }));
  PetscFunctionReturn(0);
}

PetscErrorCode I2Jacobian(TS, PetscReal t, Vec U, Vec V, Vec A, PetscReal sv, PetscReal sa, Mat J, Mat P, void *ctx)
{
  PetscFunctionBegin;
  PetscCall(Guarded([&] { return Jacobian(*static_cast<Runtime *>(ctx), t, U, V, A, sv, sa, P); }));
  if (J != P) {
    PetscCall(MatAssemblyBegin(J, MAT_FINAL_ASSEMBLY));
    PetscCall(MatAssemblyEnd(J, MAT_FINAL_ASSEMBLY));
  }
  PetscFunctionReturn(0);
}

/* The scene belongs to what -ts_view shows */
PetscErrorCode ViewWithTS(const Scene &scene, TS ts)
{
  PetscOptions      options;
  PetscViewer       viewer;
  PetscViewerFormat format;
  const char       *prefix;
  PetscBool         asked;
  PetscFunctionBegin;
  PetscCall(PetscObjectGetOptions((PetscObject)ts, &options));
  PetscCall(PetscObjectGetOptionsPrefix((PetscObject)ts, &prefix));
  PetscCall(PetscOptionsGetViewer(PetscObjectComm((PetscObject)ts), options, prefix, "-ts_view", &viewer, &format, &asked));
  if (asked) PetscCall(scene.view(viewer));
  PetscCall(PetscViewerDestroy(&viewer));
  PetscFunctionReturn(0);
}

/* With -ts_exact_final_time interpolate PETSc writes the solution at the final time into a vector of the caller's, and nowhere
   without one. Here the TS itself has it at the end, with its velocities and time. */
PetscErrorCode Solve(TS ts)
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

/* What a TS has to be for a run of this scene */
PetscErrorCode CheckTS(const SceneData &s, TS ts, const char *call)
{
  void *ctx = nullptr;
  PetscFunctionBegin;
  PetscCheck(s.run, s.comm, PETSC_ERR_ORDER, "%s: the scene has no TS yet, call Scene::createTS() first", call);
  PetscCall(CheckUnchanged(s));
  PetscCall(TSGetI2Function(ts, nullptr, nullptr, &ctx));
  PetscCheck(ctx == s.run.get(), s.comm, PETSC_ERR_ARG_WRONG, "%s: the TS is not of this scene, it was not made by its createTS()", call);
  PetscFunctionReturn(0);
}

PetscErrorCode Scene::createTS(TS *ts)
{
  Vec U, V, F;
  Mat J;
  PetscFunctionBegin;
  PetscCall(Guarded([&] { return setUp(); }));
  PetscCall(CheckUnchanged(*data_));
  Runtime &R = *data_->run;
  PetscCall(RewindAxes(R));
  PetscCall(VecCreate(data_->comm, &U));
  PetscCall(VecSetSizes(U, R.n, PETSC_DETERMINE));
  PetscCall(VecSetType(U, VECSTANDARD));
  PetscCall(VecDuplicate(U, &V));
  PetscCall(VecDuplicate(U, &F));
  PetscCall(InitialState(R, U, V));
  if (!R.given) {
    J = R.J; /* a matrix of its own for each further one */
    PetscCall(PetscObjectReference((PetscObject)J));
    R.given = true;
  } else PetscCall(MatDuplicate(R.J, MAT_DO_NOT_COPY_VALUES, &J));
  PetscCall(TSCreate(data_->comm, ts));
  PetscCall(PetscObjectGetId((PetscObject)*ts, &R.ts));
  PetscCall(TSSetProblemType(*ts, TS_NONLINEAR));
  PetscCall(TSSetType(*ts, TSHHT3));
  PetscCall(TSSetI2Function(*ts, F, I2Function, &R));
  PetscCall(TSSetI2Jacobian(*ts, J, J, I2Jacobian, &R));
  PetscCall(TSSetTime(*ts, data_->start.time));
  PetscCall(TS2SetSolution(*ts, U, V));
  PetscCall(TSSetExactFinalTime(*ts, TS_EXACTFINALTIME_MATCHSTEP));
  for (int r = 0; r < TSHHT3_NUM_ROLES; r++) PetscCall(TSHHT3SetIS(*ts, (TSHHT3Role)r, R.roles[r]));
  PetscCall(AttachReframing(R, *ts));
  PetscCall(AttachStepLimit(R, *ts));
  PetscCall(VecDestroy(&U));
  PetscCall(VecDestroy(&V));
  PetscCall(VecDestroy(&F));
  PetscCall(MatDestroy(&J));
  PetscFunctionReturn(0);
}

PetscErrorCode Scene::solve(TS ts)
{
  PetscFunctionBegin;
  PetscCall(CheckTS(*data_, ts, "Scene::solve()"));
  PetscCall(AttachOutput(*data_->run, ts));
  const PetscErrorCode failed = Solve(ts);
  /* what was sampled before a failure; other ranks may not have failed, so that a collective write could wait for ever */
  if (!failed || data_->run->size == 1) PetscCall(FinishOutput(*data_->run));
  PetscCall(failed);
  PetscCall(ViewWithTS(*this, ts));
  PetscFunctionReturn(0);
}

} // namespace hhtdae
