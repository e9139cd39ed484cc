/*
  Slowest modes of a linearization: the quadratic eigenvalue problem (value^2 M + value C + K) x = 0 in all unknowns, solved by SLEPc's TOAR (Lu, Su and
  Bai, SIAM J. Matrix Anal. Appl. 37, 2016) with shift and invert. Constraints and definitions contain no rates, so that M is singular: their
  eigenvalues are infinite, farthest from any shift.

  SLEPc scales time so that stiffness and masses are of the same size, and the shift has to be of the size of the eigenvalues: for a much smaller shift
  slow modes and infinite ones cannot be distinguished. So the search is repeated about the fastest mode that was found, and the residuals of the modes are checked
  (mode_check.cpp). "value" is an eigenvalue in 1/s.
*/
#include "flexible/mode_check.h"
#include "flexible/modes.h"
#include "hhtdae/modes.h"
#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <slepcpep.h>

namespace hhtdae
{

namespace
{

constexpr PetscReal pep_tolerance = 1e-10; /* tolerance of SLEPc's residuals */

/* Largest ratio |shift| / |value| for which a search gives accurate eigenvalues; the counterpart is max_value_per_shift (mode_check.h) */
constexpr PetscReal max_shift_per_value = 100;

/* Modes whose values differ by less than this part may belong to one multiple eigenvalue, which is found with fewer digits and of which any combination of shapes is a shape */
constexpr PetscReal close_values = 1e-2;

/* A shape is a new one only if at least this part of its norm is orthogonal to the shapes of modes with close values (SmallBodies.SlowestModesOfAFreeBody) */
constexpr PetscReal min_new_part = 0.1;

/* Differences of values, and remainders of orthogonalized shapes, below this part are rounding */
constexpr PetscReal rounding_part = 1e-6;

/* Largest number of searches from different random vectors (SmallBodies.SlowestModesOfEqualParts), and of those that may fail in SLEPc's Schur form */
constexpr int random_starts = 20, max_schur_failures = 3;

PetscErrorCode SetUp(PEP pep, Mat operators[3], PetscInt count, PetscReal shift)
{
  ST       st;
  KSP      ksp;
  PC       pc;
  PetscInt n;
  PetscFunctionBegin;
  PetscCall(MatGetSize(operators[0], &n, nullptr));
  PetscCall(PEPSetOptionsPrefix(pep, "scene_modes_"));
  PetscCall(PEPSetOperators(pep, 3, operators));
  PetscCall(PEPSetProblemType(pep, PEP_GENERAL));
  PetscCall(PEPSetType(pep, PEPTOAR));
  PetscCall(PEPSetWhichEigenpairs(pep, PEP_TARGET_MAGNITUDE));
  PetscCall(PEPSetTarget(pep, shift));
  PetscCall(PEPSetScale(pep, PEP_SCALE_SCALAR, PETSC_DEFAULT, nullptr, nullptr, PETSC_DEFAULT, PETSC_DEFAULT));
  PetscCall(PEPSetTolerances(pep, pep_tolerance, PETSC_DEFAULT));
  const PetscInt wanted = 2 * count; /* conjugate pairs count twice */
  PetscCall(PEPSetDimensions(pep, PetscMin(wanted, n), PetscMin(2 * wanted + 20, n), PETSC_DEFAULT));
  PetscCall(PEPGetST(pep, &st));
  PetscCall(STSetType(st, STSINVERT));
  PetscCall(STSetTransform(st, PETSC_TRUE));
  PetscCall(STGetKSP(st, &ksp));
  PetscCall(KSPSetType(ksp, KSPPREONLY));
  PetscCall(KSPGetPC(ksp, &pc));
  PetscCall(PCSetType(pc, PCLU));
#if defined(PETSC_HAVE_MUMPS)
  PetscCall(PCFactorSetMatSolverType(pc, MATSOLVERMUMPS));
#endif
  PetscCall(PEPSetFromOptions(pep));
  PetscCall(GiveFactorWorkspace(ksp, operators[0]));
  PetscFunctionReturn(0);
}

void SortAndTruncate(PetscInt count, std::vector<Mode> *modes)
{
  std::stable_sort(modes->begin(), modes->end(), [](const Mode &a, const Mode &b) { return std::abs(a.value) < std::abs(b.value); });
  if ((PetscInt)modes->size() > count) modes->resize(count);
}

/* Copies the `count` slowest modes, of conjugate pairs the one with positive imaginary part */
PetscErrorCode CollectSlowest(PEP pep, const Balanced &by, PetscInt count, std::vector<Mode> *modes)
{
  const Vec D = by.D;
  Vec       re, im;
  PetscInt  n, converged;
  PetscFunctionBegin;
  modes->clear();
  PetscCall(PEPGetConverged(pep, &converged));
  PetscCall(VecDuplicate(D, &re));
  PetscCall(VecDuplicate(D, &im));
  PetscCall(VecGetLocalSize(re, &n));
  for (PetscInt k = 0; k < converged; k++) {
    PetscScalar        a, b;
    const PetscScalar *x, *y;
    Mode               m;
    PetscCall(PEPGetEigenpair(pep, k, &a, &b, re, im));
    if (PetscRealPart(b) < 0) continue;
    PetscCall(VecPointwiseMult(re, re, D));
    PetscCall(VecPointwiseMult(im, im, D));
    m.value = {PetscRealPart(a), PetscRealPart(b)};
    m.shape.resize(n);
    PetscCall(VecGetArrayRead(re, &x));
    PetscCall(VecGetArrayRead(im, &y));
    for (PetscInt i = 0; i < n; i++) m.shape[i] = {PetscRealPart(x[i]), PetscRealPart(y[i])};
    PetscCall(VecRestoreArrayRead(re, &x));
    PetscCall(VecRestoreArrayRead(im, &y));
    modes->push_back(m);
  }
  PetscCall(VecDestroy(&re));
  PetscCall(VecDestroy(&im));
  SortAndTruncate(count, modes);
  PetscFunctionReturn(0);
}

/* Orthogonalizes a shape to unit vectors; *norm: norm of the remainder */
PetscErrorCode Orthogonalize(MPI_Comm comm, const std::vector<Eigen::VectorXcd> &units, Eigen::VectorXcd *x, PetscReal *norm)
{
  PetscFunctionBegin;
  for (int twice = 0; twice < 2; twice++)
    for (const Eigen::VectorXcd &e : units) {
      std::complex<double> product = e.dot(*x);
      PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &product, 1, MPI_CXX_DOUBLE_COMPLEX, MPI_SUM, comm));
      *x -= product * e;
    }
  *norm = x->squaredNorm();
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, norm, 1, MPIU_REAL, MPI_SUM, comm));
  *norm = PetscSqrtReal(*norm);
  PetscFunctionReturn(0);
}

/* The shape in the balanced unknowns; in the original ones, multipliers and rigid motions have other units and would dominate the norm */
PetscErrorCode BalancedShape(const Mode &m, const Balanced &by, Eigen::VectorXcd *x)
{
  const PetscScalar *d;
  PetscFunctionBegin;
  *x = Eigen::VectorXcd::Map(m.shape.data(), (Eigen::Index)m.shape.size());
  PetscCall(VecGetArrayRead(by.D, &d));
  for (Eigen::Index i = 0; i < x->size(); i++) (*x)[i] /= d[i];
  PetscCall(VecRestoreArrayRead(by.D, &d));
  PetscFunctionReturn(0);
}

/* Adds the mode unless its shape is a combination of the shapes of modes with close values */
PetscErrorCode AddNew(const Mode &m, const Balanced &by, PetscReal shift, std::vector<Mode> *modes, bool *added)
{
  const MPI_Comm                comm = PetscObjectComm((PetscObject)by.D);
  std::vector<Eigen::VectorXcd> units;
  Eigen::VectorXcd              x;
  PetscReal                     norm, whole;
  PetscFunctionBegin;
  for (const Mode &k : *modes) {
    const bool rest = IsRigidMotion(m, *modes, shift) && IsRigidMotion(k, *modes, shift);
    if (!rest && std::abs(k.value - m.value) > close_values * std::abs(m.value)) continue;
    PetscCall(BalancedShape(k, by, &x));
    PetscCall(Orthogonalize(comm, {}, &x, &whole));
    PetscCall(Orthogonalize(comm, units, &x, &norm));
    if (norm > rounding_part * whole) units.push_back(x / norm);
  }
  PetscCall(BalancedShape(m, by, &x));
  PetscCall(Orthogonalize(comm, {}, &x, &whole));
  PetscCall(Orthogonalize(comm, units, &x, &norm));
  *added = norm > min_new_part * whole;
  if (*added) modes->push_back(m);
  PetscFunctionReturn(0);
}

/* PEPSolve(), errors ignored: with many zero eigenvalues SLEPc's Schur form does not always converge, but does so from other start vectors */
PetscErrorCode TrySolve(PEP pep, bool *solved)
{
  PetscFunctionBegin;
  PetscCall(PetscPushErrorHandler(PetscIgnoreErrorHandler, nullptr));
  *solved = PEPSolve(pep) == 0;
  PetscCall(PetscPopErrorHandler());
  PetscFunctionReturn(0);
}

/* Adds those of the solver's modes that are new and among the `count` slowest; *news: their number */
PetscErrorCode Merge(const Mat given[3], PEP pep, const Balanced &b, PetscReal shift, PetscInt count, std::vector<Mode> *modes, int *news)
{
  std::vector<Mode> found;
  Balanced          here;
  PetscReal         at = 0;
  PetscFunctionBegin;
  *news = 0;
  PetscCall(CollectSlowest(pep, b, count, &found));
  if (modes->empty()) {
    *modes = found;
    *news  = (int)found.size();
    PetscFunctionReturn(0);
  }
  const PetscReal slow = (PetscInt)modes->size() < count ? PETSC_MAX_REAL : (1 - rounding_part) * std::abs(modes->back().value);
  for (const Mode &m : found) {
    const PetscReal where = IsRigidMotion(m, *modes, shift) ? std::abs(shift) : std::abs(m.value);
    bool            added = false;
    if (std::abs(m.value) >= slow) continue;
    if (!(where <= max_value_per_shift * at && at <= max_value_per_shift * where)) {
      PetscCall(DestroyBalanced(&here));
      PetscCall(BalanceOperators(given, where, &here));
      at = where;
    }
    PetscCall(AddNew(m, here, shift, modes, &added));
    *news += added;
  }
  PetscCall(DestroyBalanced(&here));
  SortAndTruncate(count, modes);
  PetscFunctionReturn(0);
}

/* A Krylov space from one vector contains one shape of each eigenvalue, and further ones of a multiple eigenvalue by rounding only: the search is repeated from other random
   vectors until no new mode is found among the slowest */
PetscErrorCode Search(const Mat given[3], PetscReal shift, PetscInt count, std::vector<Mode> *modes)
{
  Balanced    b;
  PEP         pep = nullptr;
  Vec         begin;
  PetscRandom numbers;
  bool        solved = false;
  PetscFunctionBegin;
  modes->clear();
  PetscCall(BalanceOperators(given, shift, &b));
  PetscCall(VecDuplicate(b.D, &begin));
  PetscCall(PetscRandomCreate(PetscObjectComm((PetscObject)given[0]), &numbers));
  for (int k = 0, news = 1, failed = 0; k < random_starts && news > 0; k++) {
    if (!pep) {
      PetscCall(PEPCreate(PetscObjectComm((PetscObject)given[0]), &pep));
      PetscCall(SetUp(pep, b.operators, count, shift));
    }
    if (k > 0) {
      PetscCall(VecSetRandom(begin, numbers));
      PetscCall(PEPSetInitialSpace(pep, 1, &begin));
    }
    if (modes->empty() && failed == max_schur_failures) {
      PetscCall(PEPSolve(pep)); /* raises SLEPc's error */
      solved = true;
    } else PetscCall(TrySolve(pep, &solved));
    if (solved) PetscCall(Merge(given, pep, b, shift, count, modes, &news));
    else {
      PetscCall(PEPDestroy(&pep));
      if (failed++ == max_schur_failures) break;
    }
    PetscCall(PetscInfo(given[0], "search %d about %g 1/s: %s, %d modes more\n", k + 1, (double)shift, solved ? "done" : "no Schur form", news));
  }
  PetscCall(PetscRandomDestroy(&numbers));
  PetscCall(VecDestroy(&begin));
  PetscCall(PEPDestroy(&pep));
  PetscCall(DestroyBalanced(&b));
  PetscFunctionReturn(0);
}

/* The modes found, the last shift, the largest residual relative to inertia and damping forces, and the frequency of that mode in Hz */
struct SearchResult {
  std::vector<Mode> modes; /* not normalized */
  PetscReal         shift = 0, residual = 0, frequency = 0;
};

/* The first value from `from` on that differs from all values of both lists by more than the part close_values */
PetscReal SplitValue(PetscReal from, const std::vector<Mode> &a, const std::vector<Mode> &b)
{
  for (bool clear = false; !clear;) {
    clear = true;
    for (const std::vector<Mode> *modes : {&a, &b})
      for (const Mode &m : *modes)
        if (std::abs(std::abs(m.value) / from - 1) < close_values) {
          from *= 1 + 2 * close_values;
          clear = false;
        }
  }
  return from;
}

void EraseFrom(PetscReal value, std::vector<Mode> *modes)
{
  modes->erase(std::remove_if(modes->begin(), modes->end(), [&](const Mode &m) { return std::abs(m.value) >= value; }), modes->end());
}

/* A search is accurate for values up to max_value_per_shift times the shift. If it has found faster modes, the search is repeated about a shift
   of the fastest value divided by max_value_per_shift. Modes too slow for the new shift are taken from the previous search if both searches
   agree on their number, and the loop continues with these. If they disagree, all results of the previous search are
   discarded: rounding of fast modes creates spurious rigid motions, the more the farther these are from the shift
   (SmallBodies.SlowestModesOfAFreeBody). */
PetscErrorCode SearchRepeatedly(const Mat given[3], PetscReal shift, PetscInt count, SearchResult *found)
{
  std::vector<Mode> slow, &all = found->modes;
  PetscReal         limit = PETSC_MAX_REAL;
  PetscFunctionBegin;
  found->shift = shift;
  PetscCall(Search(given, shift, count, &slow));
  while (!slow.empty() && std::abs(slow.back().value) > max_value_per_shift * std::abs(shift)) {
    std::vector<Mode> again;
    const PetscReal   about = std::copysign(std::abs(slow.back().value) / max_value_per_shift, shift);
    if (all.empty()) found->shift = about;
    PetscCall(Search(given, about, (PetscInt)slow.size(), &again));
    const PetscReal split  = SplitValue(std::abs(about) / max_shift_per_value, slow, again);
    const auto      slower = [&](const Mode &m) { return std::abs(m.value) < split; };
    const bool      agree  = std::count_if(slow.begin(), slow.end(), slower) == std::count_if(again.begin(), again.end(), slower);
    EraseFrom(limit, &again);
    std::copy_if(again.begin(), again.end(), std::back_inserter(all), [&](const Mode &m) { return !agree || !slower(m); });
    EraseFrom(agree ? split : 0, &slow);
    limit = split;
  }
  all.insert(all.end(), slow.begin(), slow.end());
  SortAndTruncate(count, &all);
  PetscFunctionReturn(0);
}

PetscErrorCode Find(const Mat given[3], PetscReal shift, PetscInt count, SearchResult *found)
{
  PetscFunctionBegin;
  PetscCall(SearchRepeatedly(given, shift, count, found));
  PetscCall(CheckModes(given, found->shift, &found->modes, &found->residual, &found->frequency));
  PetscCall(PetscInfo(given[0], "modes about %g 1/s: slowest %g 1/s, at most %g of inertia and damping without balance\n", (double)found->shift,
                      found->modes.empty() ? 0. : std::abs(found->modes.front().value), (double)found->residual));
  PetscFunctionReturn(0);
}

/* Searches on the communicator of the ranks that have unknowns, with the same rows on each */
PetscErrorCode FindOnRanks(MPI_Comm nonempty, const Mat given[3], PetscReal shift, PetscInt count, SearchResult *found)
{
  Mat      operators[3];
  PetscInt n;
  PetscFunctionBegin;
  PetscCall(MatGetLocalSize(given[0], &n, nullptr));
  for (int k = 0; k < 3; k++) {
    Mat rows;
    PetscCall(MatMPIAIJGetLocalMat(given[k], MAT_INITIAL_MATRIX, &rows));
    PetscCall(MatCreateMPIMatConcatenateSeqMat(nonempty, rows, n, MAT_INITIAL_MATRIX, &operators[k]));
    PetscCall(MatDestroy(&rows));
  }
  PetscCall(Find(operators, shift, count, found));
  for (Mat &A : operators) PetscCall(MatDestroy(&A));
  PetscFunctionReturn(0);
}

/* Broadcasts the result to ranks without unknowns, whose parts of the shapes are empty */
PetscErrorCode BroadcastResult(MPI_Comm comm, PetscMPIInt from, SearchResult *found)
{
  PetscMPIInt count      = (PetscMPIInt)found->modes.size();
  PetscReal   numbers[3] = {found->shift, found->residual, found->frequency};
  PetscFunctionBegin;
  PetscCallMPI(MPI_Bcast(&count, 1, MPI_INT, from, comm));
  PetscCallMPI(MPI_Bcast(numbers, 3, MPIU_REAL, from, comm));
  found->shift     = numbers[0];
  found->residual  = numbers[1];
  found->frequency = numbers[2];
  found->modes.resize(count);
  for (Mode &m : found->modes) PetscCallMPI(MPI_Bcast(&m.value, 1, MPI_CXX_DOUBLE_COMPLEX, from, comm));
  PetscFunctionReturn(0);
}

/* Excludes ranks without unknowns, as a scene of few bodies has them: SLEPc 3.18 deadlocks with these, because not all decisions that each rank takes by itself agree there
   (LinearizeRanks.SlowestModesWhereRanksHaveNoUnknowns). */
PetscErrorCode FindWithoutEmptyRanks(const Mat given[3], PetscReal shift, PetscInt count, SearchResult *found)
{
  const MPI_Comm comm = PetscObjectComm((PetscObject)given[0]);
  MPI_Comm       nonempty;
  PetscMPIInt    rank, size, first, failed = 0;
  PetscInt       n, least;
  PetscFunctionBegin;
  PetscCall(MatGetLocalSize(given[0], &n, nullptr));
  PetscCallMPI(MPI_Allreduce(&n, &least, 1, MPIU_INT, MPI_MIN, comm));
  if (least > 0) {
    PetscCall(Find(given, shift, count, found));
    PetscFunctionReturn(0);
  }
  PetscCallMPI(MPI_Comm_rank(comm, &rank));
  PetscCallMPI(MPI_Comm_size(comm, &size));
  first = n ? rank : size;
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &first, 1, MPI_INT, MPI_MIN, comm));
  PetscCallMPI(MPI_Comm_split(comm, n ? 0 : MPI_UNDEFINED, rank, &nonempty));
  const PetscErrorCode own = n ? FindOnRanks(nonempty, given, shift, count, found) : 0;
  failed                   = own;
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &failed, 1, MPI_INT, MPI_MAX, comm));
  if (n) PetscCallMPI(MPI_Comm_free(&nonempty));
  PetscCall(own);
  PetscCheck(!failed, PETSC_COMM_SELF, (PetscErrorCode)failed, "SlowestModes(): the search has failed on ranks that have unknowns");
  PetscCall(BroadcastResult(comm, first, found));
  PetscFunctionReturn(0);
}

} // namespace

PetscErrorCode SlowestModes(const Linearization &of, PetscInt count, std::vector<Mode> *modes, PetscReal shift)
{
  Mat          given[3];
  PetscInt     unknowns;
  SearchResult found;
  PetscFunctionBegin;
  PetscCall(of.operators(&given[2], &given[1], &given[0]));
  const MPI_Comm comm = PetscObjectComm((PetscObject)given[0]);
  PetscCheck(count > 0, comm, PETSC_ERR_ARG_OUTOFRANGE, "SlowestModes(): the number of modes is %" PetscInt_FMT ", it must be positive", count);
  PetscCheck(std::isfinite(shift), comm, PETSC_ERR_ARG_OUTOFRANGE, "SlowestModes(): the shift is %g 1/s, it must be finite", (double)shift);
  PetscCall(MatGetSize(given[0], &unknowns, nullptr));
  PetscCheck(2 * count < unknowns, comm, PETSC_ERR_ARG_OUTOFRANGE,
             "SlowestModes(): %" PetscInt_FMT " modes are too many of %" PetscInt_FMT " unknowns for a search; Linearization::modes() has all modes of so small a scene", count, unknowns);
  PetscCall(StartSlepc());
  PetscCall(FindWithoutEmptyRanks(given, shift, count, &found));
  PetscCheck((PetscInt)found.modes.size() >= count, comm, PETSC_ERR_NOT_CONVERGED,
             "SlowestModes(): %d of %" PetscInt_FMT " modes about %g 1/s were found; a scene of few unknowns has all of them by Linearization::modes(), else try another shift or -scene_modes_pep_ncv",
             (int)found.modes.size(), count, (double)found.shift);
  PetscCheck(found.residual <= max_residual, comm, PETSC_ERR_NOT_CONVERGED,
             "SlowestModes(): the mode of %g Hz leaves %g of its inertia and damping without balance: it is none; try another shift than %g 1/s, or Linearization::modes() if there are few unknowns",
             (double)found.frequency, (double)found.residual, (double)found.shift);
  for (Mode &m : found.modes) PetscCall(of.normalize(&m));
  *modes = std::move(found.modes);
  PetscFunctionReturn(0);
}

} // namespace hhtdae
