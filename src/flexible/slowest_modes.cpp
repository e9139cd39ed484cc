/*
  Slowest modes of a linearization: SLEPc's quadratic eigenvalue problem (value^2 M + value C + K) x = 0 over all unknowns, by TOAR (Lu, Su and
  Bai, SIAM J. Matrix Anal. Appl. 37, 2016) with shift and invert. Constraints and definitions have no rates, so that M is singular: their
  eigenvalues are infinite, farthest from any shift.

  Time is taken in a unit in which stiffness and masses are of one size, and the shift has to be of the size of the values: next to a shift far below them
  slow modes and infinite ones look alike. So the search is repeated about the fastest that it has found, and the modes are held against the equations (mode_check.cpp).
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

constexpr PetscReal accuracy = 1e-10;
constexpr PetscReal below    = 100;  /* the shift, of a value: beyond it, too */
constexpr PetscReal as_fast  = 1e-2; /* part of the value: modes that close may be of one value, of which each combination is one, found with less digits */
constexpr PetscReal apart    = 0.1;  /* part of its norm that a shape has beside those of modes as fast, or it is none of its own (SmallBodies.SlowestModesOfAFreeBody) */
constexpr PetscReal accurate = 1e-6; /* values differ by less than this part are not told apart */
constexpr int       searches = 20, failures = 3; /* at most, from other random vectors (SmallBodies.SlowestModesOfEqualParts); without a Schur form */

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
  PetscCall(PEPSetTolerances(pep, accuracy, PETSC_DEFAULT));
  const PetscInt wanted = 2 * count; /* pairs count twice */
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
  PetscCall(GiveFactorRoom(ksp, operators[0]));
  PetscFunctionReturn(0);
}

void Sort(PetscInt count, std::vector<Mode> *modes)
{
  std::stable_sort(modes->begin(), modes->end(), [](const Mode &a, const Mode &b) { return std::abs(a.value) < std::abs(b.value); });
  if ((PetscInt)modes->size() > count) modes->resize(count);
}

/* Of pairs the one with a positive imaginary part; the `count` slowest of all */
PetscErrorCode Collect(PEP pep, const Balanced &by, PetscInt count, std::vector<Mode> *modes)
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
  Sort(count, modes);
  PetscFunctionReturn(0);
}

/* Takes from a shape its parts along unit vectors, and leaves its norm */
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

/* The shape in the balanced unknowns: beside multipliers and rigid motions, in units of their own, others would not be seen */
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

/* Adds the mode if its shape is no combination of those that are there and as fast */
PetscErrorCode AddNew(const Mode &m, const Balanced &by, PetscReal shift, std::vector<Mode> *modes, bool *added)
{
  const MPI_Comm                comm = PetscObjectComm((PetscObject)by.D);
  std::vector<Eigen::VectorXcd> units;
  Eigen::VectorXcd              x;
  PetscReal                     norm, whole;
  PetscFunctionBegin;
  for (const Mode &k : *modes) {
    const bool rest = IsAtRest(m, *modes, shift) && IsAtRest(k, *modes, shift);
    if (!rest && std::abs(k.value - m.value) > as_fast * std::abs(m.value)) continue;
    PetscCall(BalancedShape(k, by, &x));
    PetscCall(Orthogonalize(comm, {}, &x, &whole));
    PetscCall(Orthogonalize(comm, units, &x, &norm));
    if (norm > accurate * whole) units.push_back(x / norm);
  }
  PetscCall(BalancedShape(m, by, &x));
  PetscCall(Orthogonalize(comm, {}, &x, &whole));
  PetscCall(Orthogonalize(comm, units, &x, &norm));
  *added = norm > apart * whole;
  if (*added) modes->push_back(m);
  PetscFunctionReturn(0);
}

/* PEPSolve(); SLEPc's Schur form does not always come to an end beside many values 0, from other vectors it does */
PetscErrorCode Solved(PEP pep, bool *solved)
{
  PetscFunctionBegin;
  PetscCall(PetscPushErrorHandler(PetscIgnoreErrorHandler, nullptr));
  *solved = PEPSolve(pep) == 0;
  PetscCall(PetscPopErrorHandler());
  PetscFunctionReturn(0);
}

/* Adds what is new among the slowest */
PetscErrorCode Merge(const Mat given[3], PEP pep, const Balanced &b, PetscReal shift, PetscInt count, std::vector<Mode> *modes, int *news)
{
  std::vector<Mode> found;
  Balanced          here;
  PetscReal         at = 0;
  PetscFunctionBegin;
  *news = 0;
  PetscCall(Collect(pep, b, count, &found));
  if (modes->empty()) {
    *modes = found;
    *news  = (int)found.size();
    PetscFunctionReturn(0);
  }
  const PetscReal slow = (PetscInt)modes->size() < count ? PETSC_MAX_REAL : (1 - accurate) * std::abs(modes->back().value);
  for (const Mode &m : found) {
    const PetscReal where = IsAtRest(m, *modes, shift) ? std::abs(shift) : std::abs(m.value);
    bool            added = false;
    if (std::abs(m.value) >= slow) continue;
    if (!(where <= beside * at && at <= beside * where)) {
      PetscCall(DestroyBalanced(&here));
      PetscCall(BalanceOperators(given, where, &here));
      at = where;
    }
    PetscCall(AddNew(m, here, shift, modes, &added));
    *news += added;
  }
  PetscCall(DestroyBalanced(&here));
  Sort(count, modes);
  PetscFunctionReturn(0);
}

/* A Krylov space from one vector has one vector of each value, and others of a multiple one by rounding alone: so it is searched from other ones until
   there is nothing new among the slowest */
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
  for (int k = 0, news = 1, failed = 0; k < searches && news > 0; k++) {
    if (!pep) {
      PetscCall(PEPCreate(PetscObjectComm((PetscObject)given[0]), &pep));
      PetscCall(SetUp(pep, b.operators, count, shift));
    }
    if (k > 0) {
      PetscCall(VecSetRandom(begin, numbers));
      PetscCall(PEPSetInitialSpace(pep, 1, &begin));
    }
    if (modes->empty() && failed == failures) {
      PetscCall(PEPSolve(pep)); /* the error for the user */
      solved = true;
    } else PetscCall(Solved(pep, &solved));
    if (solved) PetscCall(Merge(given, pep, b, shift, count, modes, &news));
    else {
      PetscCall(PEPDestroy(&pep));
      if (failed++ == failures) break;
    }
    PetscCall(PetscInfo(given[0], "search %d about %g 1/s: %s, %d modes more\n", k + 1, (double)shift, solved ? "done" : "no Schur form", news));
  }
  PetscCall(PetscRandomDestroy(&numbers));
  PetscCall(VecDestroy(&begin));
  PetscCall(PEPDestroy(&pep));
  PetscCall(DestroyBalanced(&b));
  PetscFunctionReturn(0);
}

/* What a search has found, and its last shift; the largest part of inertia and damping without balance, and the frequency of that mode */
struct Found {
  std::vector<Mode> modes; /* not normalized */
  PetscReal         shift = 0, left = 0, frequency = 0;
};

/* Where values of both are far apart, from `from` on: none is within a hundredth */
PetscReal Gap(PetscReal from, const std::vector<Mode> &a, const std::vector<Mode> &b)
{
  for (bool clear = false; !clear;) {
    clear = true;
    for (const std::vector<Mode> *modes : {&a, &b})
      for (const Mode &m : *modes)
        if (std::abs(std::abs(m.value) / from - 1) < as_fast) {
          from *= 1 + 2 * as_fast;
          clear = false;
        }
  }
  return from;
}

void EraseFrom(PetscReal value, std::vector<Mode> *modes)
{
  modes->erase(std::remove_if(modes->begin(), modes->end(), [&](const Mode &m) { return std::abs(m.value) >= value; }), modes->end());
}

/* A search has the digits of values that are at most `beside` times as fast as the shift. Where it has found faster ones, there is another one about a shift that is so near
   to the fastest. Those too slow for it remain as they were, or are looked at in the same way, unless the searches do not agree on how many there are: rounding of fast
   ones makes more out of rigid motions the farther they are from the shift, and nothing of the search before is believed (SmallBodies.SlowestModesOfAFreeBody). */
PetscErrorCode SearchOften(const Mat given[3], PetscReal shift, PetscInt count, Found *found)
{
  std::vector<Mode> slow, &all = found->modes;
  PetscReal         limit = PETSC_MAX_REAL;
  PetscFunctionBegin;
  found->shift = shift;
  PetscCall(Search(given, shift, count, &slow));
  while (!slow.empty() && std::abs(slow.back().value) > beside * std::abs(shift)) {
    std::vector<Mode> again;
    const PetscReal   about = std::copysign(std::abs(slow.back().value) / beside, shift);
    if (all.empty()) found->shift = about;
    PetscCall(Search(given, about, (PetscInt)slow.size(), &again));
    const PetscReal split  = Gap(std::abs(about) / below, slow, again);
    const auto      slower = [&](const Mode &m) { return std::abs(m.value) < split; };
    const bool      agree  = std::count_if(slow.begin(), slow.end(), slower) == std::count_if(again.begin(), again.end(), slower);
    EraseFrom(limit, &again);
    std::copy_if(again.begin(), again.end(), std::back_inserter(all), [&](const Mode &m) { return !agree || !slower(m); });
    EraseFrom(agree ? split : 0, &slow);
    limit = split;
  }
  all.insert(all.end(), slow.begin(), slow.end());
  Sort(count, &all);
  PetscFunctionReturn(0);
}

PetscErrorCode Find(const Mat given[3], PetscReal shift, PetscInt count, Found *found)
{
  PetscFunctionBegin;
  PetscCall(SearchOften(given, shift, count, found));
  PetscCall(CheckModes(given, found->shift, &found->modes, &found->left, &found->frequency));
  PetscCall(PetscInfo(given[0], "modes about %g 1/s: slowest %g 1/s, at most %g of inertia and damping without balance\n", (double)found->shift,
                      found->modes.empty() ? 0. : std::abs(found->modes.front().value), (double)found->left));
  PetscFunctionReturn(0);
}

/* On the ranks that have unknowns, the rows of which are those of their rank as before */
PetscErrorCode FindOn(MPI_Comm some, const Mat given[3], PetscReal shift, PetscInt count, Found *found)
{
  Mat      operators[3];
  PetscInt n;
  PetscFunctionBegin;
  PetscCall(MatGetLocalSize(given[0], &n, nullptr));
  for (int k = 0; k < 3; k++) {
    Mat rows;
    PetscCall(MatMPIAIJGetLocalMat(given[k], MAT_INITIAL_MATRIX, &rows));
    PetscCall(MatCreateMPIMatConcatenateSeqMat(some, rows, n, MAT_INITIAL_MATRIX, &operators[k]));
    PetscCall(MatDestroy(&rows));
  }
  PetscCall(Find(operators, shift, count, found));
  for (Mat &A : operators) PetscCall(MatDestroy(&A));
  PetscFunctionReturn(0);
}

/* The others are told what was found; their shapes have no unknowns */
PetscErrorCode Tell(MPI_Comm comm, PetscMPIInt from, Found *found)
{
  PetscMPIInt count = (PetscMPIInt)found->modes.size();
  PetscReal   left[3] = {found->shift, found->left, found->frequency};
  PetscFunctionBegin;
  PetscCallMPI(MPI_Bcast(&count, 1, MPI_INT, from, comm));
  PetscCallMPI(MPI_Bcast(left, 3, MPIU_REAL, from, comm));
  found->shift     = left[0];
  found->left      = left[1];
  found->frequency = left[2];
  found->modes.resize(count);
  for (Mode &m : found->modes) PetscCallMPI(MPI_Bcast(&m.value, 1, MPI_CXX_DOUBLE_COMPLEX, from, comm));
  PetscFunctionReturn(0);
}

/* SLEPc 3.18 waits for ever where ranks without unknowns take part: not all of what its ranks find out each by itself is the same on these
   (LinearizeRanks.SlowestModesWhereRanksHaveNoUnknowns). A scene of few bodies has such ranks. */
PetscErrorCode FindWithoutEmptyRanks(const Mat given[3], PetscReal shift, PetscInt count, Found *found)
{
  const MPI_Comm comm = PetscObjectComm((PetscObject)given[0]);
  MPI_Comm       some;
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
  PetscCallMPI(MPI_Comm_split(comm, n ? 0 : MPI_UNDEFINED, rank, &some));
  const PetscErrorCode own = n ? FindOn(some, given, shift, count, found) : 0;
  failed                   = own;
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &failed, 1, MPI_INT, MPI_MAX, comm));
  if (n) PetscCallMPI(MPI_Comm_free(&some));
  PetscCall(own);
  PetscCheck(!failed, PETSC_COMM_SELF, (PetscErrorCode)failed, "SlowestModes(): the search has failed on ranks that have unknowns");
  PetscCall(Tell(comm, first, found));
  PetscFunctionReturn(0);
}

} // namespace

PetscErrorCode SlowestModes(const Linearization &of, PetscInt count, std::vector<Mode> *modes, PetscReal shift)
{
  Mat      given[3];
  PetscInt unknowns;
  Found    found;
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
  PetscCheck(found.left <= balanced, comm, PETSC_ERR_NOT_CONVERGED,
             "SlowestModes(): the mode of %g Hz leaves %g of its inertia and damping without balance: it is none; try another shift than %g 1/s, or Linearization::modes() if there are few unknowns",
             (double)found.frequency, (double)found.left, (double)found.shift);
  for (Mode &m : found.modes) PetscCall(of.normalize(&m));
  *modes = std::move(found.modes);
  PetscFunctionReturn(0);
}

} // namespace hhtdae
