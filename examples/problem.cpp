#include "problem.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace hhtex
{

void Problem::setUnknown(double *u, double *v, double *a) const
{
  const double nan = std::numeric_limits<double>::quiet_NaN();
  std::fill_n(u, n, nan);
  std::fill_n(v, n, nan);
  std::fill_n(a, n, nan);
}

std::vector<double> Problem::equallySpaced(int intervals) const
{
  std::vector<double> times;
  for (int i = 0; i <= intervals; i++) times.push_back(t0 + (t1 - t0) * i / intervals);
  return times;
}

namespace
{

/* Data for the callbacks of a TS; one per TS, destroyed with it */
struct Adaptor {
  explicit Adaptor(const Problem &p) : problem(&p) {}

  const Problem        *problem;
  Mat                   matrix = nullptr; /* the matrix with the COO pattern; not a reference */
  Entries               entries;          /* reused by every Jacobian */
  std::vector<PetscInt> emptyDiagonal;    /* rows whose diagonal the problem does not name */
  VecScatter            gather = nullptr; /* several ranks: from a distributed vector to a copy of all of it */
  Vec                   all[3] = {nullptr, nullptr, nullptr};
  std::vector<double>   f; /* several ranks: the residual's rows of all ranks */
};

PetscErrorCode AdaptorFree(Adaptor *ad)
{
  PetscFunctionBegin;
  PetscCall(VecScatterDestroy(&ad->gather));
  for (Vec &x : ad->all) PetscCall(VecDestroy(&x));
  delete ad;
  PetscFunctionReturn(0);
}

#if PETSC_VERSION_LT(3, 23, 0)
PetscErrorCode AdaptorDestroy(void *ctx) { return AdaptorFree(static_cast<Adaptor *>(ctx)); }
#else
/* PETSc passes the address of the context, as void ** up to 3.24 and as void * in later versions; each prototype takes the function that fits. */
PetscErrorCode AdaptorDestroy(void **ctx) { return AdaptorFree(static_cast<Adaptor *>(*ctx)); }
[[maybe_unused]] PetscErrorCode AdaptorDestroy(void *ctx) { return AdaptorDestroy(static_cast<void **>(ctx)); }
#endif

PetscErrorCode AttachAdaptor(TS ts, Adaptor *ad)
{
  PetscContainer container;

  PetscFunctionBegin;
  PetscCall(PetscContainerCreate(PetscObjectComm((PetscObject)ts), &container));
  PetscCall(PetscContainerSetPointer(container, ad));
#if PETSC_VERSION_LT(3, 23, 0)
  PetscCall(PetscContainerSetUserDestroy(container, AdaptorDestroy));
#else
  PetscCall(PetscContainerSetCtxDestroy(container, AdaptorDestroy));
#endif
  PetscCall(PetscObjectCompose((PetscObject)ts, "hhtex_problem", (PetscObject)container));
  PetscCall(PetscContainerDestroy(&container));
  PetscFunctionReturn(0);
}

/* Whole vectors as arrays: the vectors' own on one rank, gathered copies on several */
PetscErrorCode GetWhole(Adaptor *ad, const Vec x[3], const double *array[3])
{
  PetscFunctionBegin;
  for (int k = 0; k < 3; k++) {
    if (ad->gather) {
      PetscCall(VecScatterBegin(ad->gather, x[k], ad->all[k], INSERT_VALUES, SCATTER_FORWARD));
      PetscCall(VecScatterEnd(ad->gather, x[k], ad->all[k], INSERT_VALUES, SCATTER_FORWARD));
    }
    PetscCall(VecGetArrayRead(ad->gather ? ad->all[k] : x[k], &array[k]));
  }
  PetscFunctionReturn(0);
}

PetscErrorCode RestoreWhole(Adaptor *ad, const Vec x[3], const double *array[3])
{
  PetscFunctionBegin;
  for (int k = 0; k < 3; k++) PetscCall(VecRestoreArrayRead(ad->gather ? ad->all[k] : x[k], &array[k]));
  PetscFunctionReturn(0);
}

PetscErrorCode I2Function(TS, PetscReal t, Vec U, Vec V, Vec A, Vec F, void *ctx)
{
  auto         *ad   = static_cast<Adaptor *>(ctx);
  const Vec     x[3] = {U, V, A};
  const double *array[3];
  double       *f;

  PetscFunctionBegin;
  PetscCall(GetWhole(ad, x, array));
  PetscCall(VecGetArrayWrite(F, &f));
  if (ad->gather) {
    PetscInt first, end;
    ad->problem->residual(t, array[0], array[1], array[2], ad->f.data());
    PetscCall(VecGetOwnershipRange(F, &first, &end));
    std::copy(ad->f.begin() + first, ad->f.begin() + end, f);
  } else
    ad->problem->residual(t, array[0], array[1], array[2], f);
  PetscCall(VecRestoreArrayWrite(F, &f));
  PetscCall(RestoreWhole(ad, x, array));
  PetscFunctionReturn(0);
}

/* A matrix that CreateMatrix() did not make, such as a duplicate, has the pattern, but not the COO map from entries to values */
PetscErrorCode SetValuesOneByOne(const Entries &e, Mat P)
{
  PetscInt first, end;

  PetscFunctionBegin;
  PetscCall(MatGetOwnershipRange(P, &first, &end));
  PetscCall(MatZeroEntries(P));
  for (size_t k = 0; k < e.value.size(); k++) {
    if (e.row[k] < first || e.row[k] >= end) continue;
    PetscCall(MatSetValue(P, e.row[k], e.col[k], e.value[k], ADD_VALUES));
  }
  PetscCall(MatAssemblyBegin(P, MAT_FINAL_ASSEMBLY));
  PetscCall(MatAssemblyEnd(P, MAT_FINAL_ASSEMBLY));
  PetscFunctionReturn(0);
}

void Evaluate(Adaptor *ad, double t, const double *const x[3], double sv, double sa)
{
  ad->entries.clear();
  ad->problem->jacobian(t, x[0], x[1], x[2], sv, sa, ad->entries);
  for (PetscInt i : ad->emptyDiagonal) ad->entries.add(i, i, 0.);
}

PetscErrorCode I2Jacobian(TS, PetscReal t, Vec U, Vec V, Vec A, PetscReal sv, PetscReal sa, Mat J, Mat P, void *ctx)
{
  auto         *ad   = static_cast<Adaptor *>(ctx);
  const Vec     x[3] = {U, V, A};
  const double *array[3];

  PetscFunctionBegin;
  PetscCall(GetWhole(ad, x, array));
  Evaluate(ad, t, array, sv, sa);
  PetscCall(RestoreWhole(ad, x, array));
  if (P == ad->matrix)
    PetscCall(MatSetValuesCOO(P, ad->entries.value.data(), INSERT_VALUES));
  else
    PetscCall(SetValuesOneByOne(ad->entries, P));
  if (J != P) {
    PetscCall(MatAssemblyBegin(J, MAT_FINAL_ASSEMBLY));
    PetscCall(MatAssemblyEnd(J, MAT_FINAL_ASSEMBLY));
  }
  PetscFunctionReturn(0);
}

/* The pattern comes from a Jacobian at the initial state; every rank names the entries of its own rows */
PetscErrorCode CreateMatrix(Adaptor *ad, Vec layout, const std::vector<double> &u, const std::vector<double> &v, Mat *J)
{
  const Problem            &p = *ad->problem;
  const std::vector<double> zero(p.n, 0.);
  const double *const       x[3] = {u.data(), v.data(), zero.data()};
  std::vector<char>         hasDiagonal(p.n, 0);
  PetscInt                  local, first, end;

  PetscFunctionBegin;
  Evaluate(ad, p.t0, x, 0., 0.);
  for (size_t k = 0; k < ad->entries.row.size(); k++)
    if (ad->entries.row[k] == ad->entries.col[k]) hasDiagonal[ad->entries.row[k]] = 1;
  for (PetscInt i = 0; i < p.n; i++)
    if (!hasDiagonal[i]) ad->emptyDiagonal.push_back(i); /* PETSc's own factorizations and shifts want every diagonal */
  Evaluate(ad, p.t0, x, 0., 0.);

  std::vector<PetscInt> row(ad->entries.row), col(ad->entries.col); /* PETSc sorts them in place */
  PetscCall(VecGetLocalSize(layout, &local));
  PetscCall(VecGetOwnershipRange(layout, &first, &end));
  for (PetscInt &i : row)
    if (i < first || i >= end) i = -1; /* ignored, its value too */
  PetscCall(MatCreate(PetscObjectComm((PetscObject)layout), J));
  PetscCall(MatSetSizes(*J, local, local, p.n, p.n));
  PetscCall(MatSetType(*J, MATAIJ));
  PetscCall(MatSetFromOptions(*J));
  PetscCall(MatSetPreallocationCOO(*J, (PetscCount)row.size(), row.data(), col.data()));
  PetscCall(MatSetValuesCOO(*J, ad->entries.value.data(), INSERT_VALUES));
  ad->matrix = *J;
  PetscFunctionReturn(0);
}

PetscErrorCode FillOwn(Vec x, const std::vector<double> &whole)
{
  PetscInt first, end;
  double  *array;

  PetscFunctionBegin;
  PetscCall(VecGetOwnershipRange(x, &first, &end));
  PetscCall(VecGetArrayWrite(x, &array));
  std::copy(whole.begin() + first, whole.begin() + end, array);
  PetscCall(VecRestoreArrayWrite(x, &array));
  PetscFunctionReturn(0);
}

PetscErrorCode SetRoles(TS ts, const Problem &p, Vec layout)
{
  PetscInt first, end;

  PetscFunctionBegin;
  PetscCall(VecGetOwnershipRange(layout, &first, &end));
  for (int r = 0; r < TSHHT3_NUM_ROLES; r++) {
    std::vector<PetscInt> own;
    IS                    is;
    for (PetscInt i = first; i < end; i++)
      if (p.role[i] == r) own.push_back(i);
    PetscCall(
        ISCreateGeneral(PetscObjectComm((PetscObject)ts), (PetscInt)own.size(), own.data(), PETSC_COPY_VALUES, &is));
    PetscCall(TSHHT3SetIS(ts, (TSHHT3Role)r, is));
    PetscCall(ISDestroy(&is));
  }
  PetscFunctionReturn(0);
}

} // namespace

/*
  Creates a TS for a problem, with its initial state and an unknown type: the caller sets the type and the tolerances.
  The problem must live as long as the TS. With setRoles the integrator is told what every unknown is (set the type to
  TSHHT3 afterwards or before, but not to another one in between); without, it reads the roles off the Jacobians.
*/
PetscErrorCode ProblemCreateTS(MPI_Comm comm, const Problem &problem, TS *ts, Vec *U, Vec *V, bool setRoles)
{
  auto               *ad = new Adaptor(problem);
  std::vector<double> u(problem.n, 0.), v(problem.n, 0.);
  PetscMPIInt         size;
  Vec                 F;
  Mat                 J;

  PetscFunctionBegin;
  PetscCall(TSCreate(comm, ts));
  PetscCall(AttachAdaptor(*ts, ad));
  PetscCallMPI(MPI_Comm_size(comm, &size));
  problem.initial(u.data(), v.data());
  PetscCall(VecCreate(comm, U));
  PetscCall(VecSetSizes(*U, PETSC_DECIDE, problem.n));
  PetscCall(VecSetFromOptions(*U));
  PetscCall(VecDuplicate(*U, V));
  PetscCall(VecDuplicate(*U, &F));
  PetscCall(FillOwn(*U, u));
  PetscCall(FillOwn(*V, v));
  if (size > 1) {
    PetscCall(VecScatterCreateToAll(*U, &ad->gather, &ad->all[0]));
    PetscCall(VecDuplicate(ad->all[0], &ad->all[1]));
    PetscCall(VecDuplicate(ad->all[0], &ad->all[2]));
    ad->f.resize(problem.n);
  }
  PetscCall(CreateMatrix(ad, *U, u, v, &J));
  PetscCall(TSSetI2Function(*ts, F, I2Function, ad));
  PetscCall(TSSetI2Jacobian(*ts, J, J, I2Jacobian, ad));
  PetscCall(TS2SetSolution(*ts, *U, *V));
  PetscCall(TSSetTime(*ts, problem.t0));
  PetscCall(TSSetMaxTime(*ts, problem.t1));
  PetscCall(TSSetMaxSteps(*ts, std::numeric_limits<PetscInt>::max()));
  PetscCall(TSSetTimeStep(*ts, 1e-3 * (problem.t1 - problem.t0)));
  PetscCall(TSSetExactFinalTime(*ts, TS_EXACTFINALTIME_MATCHSTEP));
  if (setRoles) {
    PetscCall(TSSetType(*ts, TSHHT3));
    PetscCall(SetRoles(*ts, problem, *U));
  }
  PetscCall(VecDestroy(&F));
  PetscCall(MatDestroy(&J));
  PetscFunctionReturn(0);
}

namespace
{

PetscErrorCode GatherAll(Vec x, std::vector<double> &whole)
{
  VecScatter    gather;
  Vec           all;
  const double *array;
  PetscInt      n;

  PetscFunctionBegin;
  PetscCall(VecScatterCreateToAll(x, &gather, &all));
  PetscCall(VecScatterBegin(gather, x, all, INSERT_VALUES, SCATTER_FORWARD));
  PetscCall(VecScatterEnd(gather, x, all, INSERT_VALUES, SCATTER_FORWARD));
  PetscCall(VecGetSize(all, &n));
  PetscCall(VecGetArrayRead(all, &array));
  whole.assign(array, array + n);
  PetscCall(VecRestoreArrayRead(all, &array));
  PetscCall(VecDestroy(&all));
  PetscCall(VecScatterDestroy(&gather));
  PetscFunctionReturn(0);
}

/* A NaN in the computed value makes the error NaN; a NaN in the reference means that the value is unknown */
void Include(double computed, double ref, double scale, double &error)
{
  if (std::isnan(ref) || std::isnan(error)) return;
  const double e = std::abs(computed - ref) / scale;
  if (!(e <= error)) error = e;
}

} // namespace

PetscErrorCode ProblemComputeErrors(PetscReal t, const Problem &problem, Vec U, Vec V, ProblemErrors *errors)
{
  std::vector<double> u, v, ur(problem.n), vr(problem.n), ar(problem.n);
  double              lambdaMax = 0.;

  PetscFunctionBegin;
  *errors = ProblemErrors();
  if (!problem.reference(t, ur.data(), vr.data(), ar.data())) PetscFunctionReturn(0);
  PetscCall(GatherAll(U, u));
  PetscCall(GatherAll(V, v));
  auto isMultiplier = [&](PetscInt i) {
    return problem.role[i] == TSHHT3_HOLONOMIC || problem.role[i] == TSHHT3_NONHOLONOMIC;
  };
  for (PetscInt i = 0; i < problem.n; i++)
    if (isMultiplier(i)) lambdaMax = std::fmax(lambdaMax, std::abs(ur[i]));
  for (PetscInt i = 0; i < problem.n; i++) {
    if (problem.role[i] == TSHHT3_COORDINATE) {
      Include(u[i], ur[i], std::fmax(1., std::abs(ur[i])), errors->q);
      Include(v[i], vr[i], std::fmax(1., std::abs(vr[i])), errors->v);
    } else if (isMultiplier(i))
      Include(u[i], ur[i], lambdaMax > 0. ? lambdaMax : 1., errors->lambda);
    else
      Include(u[i], ur[i], std::fmax(1., std::abs(ur[i])), errors->other);
  }
  PetscFunctionReturn(0);
}

PetscErrorCode ProblemReport(TS ts, const Problem &problem, Vec U, Vec V)
{
  ProblemErrors e;
  PetscReal     t;
  MPI_Comm      comm = PetscObjectComm((PetscObject)ts);

  PetscFunctionBegin;
  PetscCall(TSGetSolveTime(ts, &t));
  PetscCall(ProblemComputeErrors(t, problem, U, V, &e));
  const std::pair<const char *, double> items[] = {{"q", e.q}, {"v", e.v}, {"lambda", e.lambda}, {"other", e.other}};
  if (std::all_of(std::begin(items), std::end(items), [](const auto &i) { return i.second < 0.; }))
    PetscFunctionReturn(0);
  PetscCall(PetscPrintf(comm, "error:"));
  for (const auto &item : items)
    if (!(item.second < 0.)) PetscCall(PetscPrintf(comm, " %s=%.3e", item.first, item.second));
  PetscCall(PetscPrintf(comm, "\n"));
  PetscFunctionReturn(0);
}

/* -ts_exact_final_time interpolate interpolates U, but leaves velocities at the end of the last step */
static PetscErrorCode VelocitiesOfTheSameTime(TS ts, Vec V)
{
  PetscReal end, reached;
  PetscBool ours;

  PetscFunctionBegin;
  PetscCall(TSGetSolveTime(ts, &end));
  PetscCall(TSGetTime(ts, &reached));
  PetscCall(PetscObjectTypeCompare((PetscObject)ts, TSHHT3, &ours));
  if (ours && end != reached) PetscCall(TSHHT3Interpolate(ts, end, nullptr, V, nullptr));
  PetscFunctionReturn(0);
}

PetscErrorCode ProblemSolve(const Problem &problem, PetscReal tolerance)
{
  TS  ts;
  Vec U, V;

  PetscFunctionBegin;
  PetscCall(ProblemCreateTS(PETSC_COMM_WORLD, problem, &ts, &U, &V));
  PetscCall(TSSetType(ts, TSHHT3));
  PetscCall(TSSetTolerances(ts, tolerance, nullptr, tolerance, nullptr));
  PetscCall(TSSetFromOptions(ts));
  PetscCall(TSSolve(ts, U));
  PetscCall(VelocitiesOfTheSameTime(ts, V));
  PetscCall(ProblemReport(ts, problem, U, V));
  PetscCall(VecDestroy(&U));
  PetscCall(VecDestroy(&V));
  PetscCall(TSDestroy(&ts));
  PetscFunctionReturn(0);
}

PetscErrorCode SummaryByDefault(void)
{
  PetscBool given;

  PetscFunctionBegin;
  PetscCall(PetscOptionsHasName(nullptr, nullptr, "-ts_hhtdae_summary", &given));
  if (!given) PetscCall(PetscOptionsSetValue(nullptr, "-ts_hhtdae_summary", nullptr));
  PetscFunctionReturn(0);
}

} // namespace hhtex
