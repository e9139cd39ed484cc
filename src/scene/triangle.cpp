/*
  One triangle of the matrix in place of all of it, MATSBAIJ, where nothing breaks its symmetry: coordinates whose inertia is
  constant, forces with a potential that go with no marker's axes, holonomic constraints. Bodies that turn in space have
  gyroscopic terms and velocities, states, variables and force states are no gradients. What the kinds of bodies and elements
  say is tried once on the whole matrix, at a state off the initial one, before half of it is given up.

  It is not the default, since it hardly pays: the matrix is small beside its factor, of which LDL^T stores half anyway.
  `fullbody -law large`, all of the matrix | one triangle: peak of memory on all ranks and processor time of the whole run,
  means of two interleaved runs for the first two rows, one pair for the others, on a machine that others used, too:

      -size 30,8,8 -steps 4, one rank                          456 | 450 MB     7.5 | 7.5 s
      the same, two ranks                                      615 | 584 MB    14.5 | 14.1 s
      -size 40,12,12 -steps 2, 80898 unknowns               1577 | 1501 MB   30.2 | 31.3 s
      the same, two ranks                                    1880 | 1753 MB   47.1 | 46.2 s
      -size 30,8,8 -steps 2 -held free -ksp_type cg
        -pc_type icc -ksp_rtol 1e-6                            241 | 241 MB     2.4 | 2.1 s

  And much of what a user may choose wants whole rows: LU, PCFIELDSPLIT, algebraic multigrid.
*/
#include "extension.h"
#include "runtime.h"
#include <algorithm>

namespace hhtdae
{

namespace
{

/* The first thing that breaks the symmetry, empty if nothing does */
std::string Breaks(const SceneData &s)
{
  for (const BodyData &b : s.bodies) {
    if (b.flexible) return "the flexible body " + b.name + " turns with its frame";
    if (TurnsInSpace(KindOf(s, b)) && !(b.massless && b.mass == 0 && b.inertia.isZero(0))) return "the body " + b.name + " turns in space";
  }
  if (!s.states.empty()) return "state " + s.states[0].name;
  if (!s.variables.empty()) return "variable " + s.variables[0].name;
  for (const StoreBase *store : s.order)
    for (PetscInt e = 0; e < store->size(); e++)
      if (!store->symmetric(e)) {
        const ElementData &of = s.elements[store->element(e)];
        return std::string(of.type) + " " + of.name;
      }
  for (const auto &x : s.extensions)
    if (!x->symmetric()) return "coordinates of another library";
  return "";
}

/* x += amount * random numbers in [-1, 1], the same in every run */
PetscErrorCode Shake(Vec x, double amount, PetscRandom random)
{
  Vec y;
  PetscFunctionBegin;
  PetscCall(VecDuplicate(x, &y));
  PetscCall(VecSetRandom(y, random));
  PetscCall(VecAXPY(x, amount, y));
  PetscCall(VecDestroy(&y));
  PetscFunctionReturn(0);
}

/* |y^T J x - x^T J y| beside the rounding in it, rows and columns scaled by their largest entries */
PetscErrorCode Asymmetry(Mat J, PetscRandom random, double *relative)
{
  Vec     x, y, w, d;
  double  a, b, *s;
  PetscInt n;
  MatInfo info;
  PetscFunctionBegin;
  PetscCall(MatCreateVecs(J, &x, &w));
  PetscCall(VecDuplicate(x, &y));
  PetscCall(VecDuplicate(x, &d));
  PetscCall(MatGetRowMaxAbs(J, d, nullptr));
  PetscCall(VecGetLocalSize(d, &n));
  PetscCall(VecGetArray(d, &s));
  for (PetscInt i = 0; i < n; i++) s[i] = s[i] != 0 ? 1 / std::sqrt(std::abs(s[i])) : 1;
  PetscCall(VecRestoreArray(d, &s));
  for (Vec v : {x, y}) {
    PetscCall(VecSetRandom(v, random));
    PetscCall(VecPointwiseMult(v, v, d));
  }
  PetscCall(MatMult(J, x, w));
  PetscCall(VecDot(w, y, &a));
  PetscCall(MatMult(J, y, w));
  PetscCall(VecDot(w, x, &b));
  PetscCall(MatGetInfo(J, MAT_GLOBAL_SUM, &info));
  *relative = std::abs(a - b) / (100 * PETSC_MACHINE_EPSILON * std::sqrt(std::max(info.nz_used, 1.)));
  for (Vec *v : {&x, &y, &w, &d}) PetscCall(VecDestroy(v));
  PetscFunctionReturn(0);
}

/* On the whole matrix: everything off the initial state by a little, with multipliers and velocities */
PetscErrorCode TryWhole(Runtime &R, double *asymmetry)
{
  Vec         U, V, A;
  PetscRandom random;
  PetscFunctionBegin;
  PetscCall(PetscRandomCreate(R.scene.comm, &random));
  PetscCall(PetscRandomSetInterval(random, -1, 1));
  PetscCall(VecCreate(R.scene.comm, &U));
  PetscCall(VecSetSizes(U, R.n, PETSC_DETERMINE));
  PetscCall(VecSetType(U, VECSTANDARD));
  PetscCall(VecDuplicate(U, &V));
  PetscCall(VecDuplicate(U, &A));
  PetscCall(InitialState(R, U, V));
  PetscCall(VecZeroEntries(A));
  PetscCall(Shake(U, 1e-6, random));
  PetscCall(Shake(V, 1, random));
  PetscCall(Shake(A, 1, random));
  PetscCall(Jacobian(R, R.scene.start.time, U, V, A, 1e2, 1e4, R.J));
  PetscCall(Asymmetry(R.J, random, asymmetry));
  for (Vec *v : {&U, &V, &A}) PetscCall(VecDestroy(v));
  PetscCall(PetscRandomDestroy(&random));
  PetscFunctionReturn(0);
}

} // namespace

/* -mat_type decides as well: what the user wants wins, but not against the physics */
PetscErrorCode WantTriangle(Model &M)
{
  const SceneData &s      = M.scene;
  PetscBool        wanted = PETSC_FALSE, given;
  char             type[64] = "";
  PetscFunctionBegin;
  PetscOptionsBegin(s.comm, nullptr, "Matrix of a multibody scene", "Scene");
  PetscCall(PetscOptionsBool("-scene_symmetric_storage", "Store one triangle of the matrix", "Scene", wanted, &wanted, &given));
  PetscCall(PetscOptionsString("-mat_type", "Type of the matrix", "MatSetType", type, type, sizeof type, nullptr));
  PetscOptionsEnd();
  if (!given) PetscCall(PetscStrendswith(type, MATSBAIJ, &wanted));
  const std::string breaks = Breaks(s);
  PetscCheck(!wanted || breaks.empty(), s.comm, PETSC_ERR_ARG_INCOMP, "one triangle of the matrix (%s) does not hold this scene: %s makes it unsymmetric",
             given ? "-scene_symmetric_storage" : "-mat_type", breaks.c_str());
  M.wants_triangle = wanted;
  M.full_because   = breaks.empty() ? "though it is symmetric (-scene_symmetric_storage stores one triangle)" : breaks + " makes it unsymmetric";
  PetscCall(PetscInfo(nullptr, "scene: matrix: %s\n", wanted ? "one triangle" : ("all of it, " + M.full_because).c_str()));
  PetscFunctionReturn(0);
}

/* Slots and the matrix; again: for a second time with other storage */
PetscErrorCode ResolvePattern(Runtime &R, bool triangle, bool again)
{
  PetscFunctionBegin;
  R.pattern.build(R.start, R.n, triangle);
  for (std::size_t i = 0; i < R.body_slot.size(); i++) R.body_slot[i] = R.pattern.slot((PetscInt)i);
  R.projection.resolve(R.pattern, again);
  for (auto &b : R.batches) b->resolve(R.pattern, again);
  PetscCall(MatDestroy(&R.J));
  PetscCall(R.pattern.createMat(R.scene.comm, R.n, &R.J));
  R.triangle = triangle;
  if (triangle && R.size > 1) {
    R.off_start  = R.pattern.oi;
    R.off_column = R.pattern.oj;
    R.off_value.assign(R.off_column.size(), 0);
  }
  if (!again) R.pattern.release();
  PetscFunctionReturn(0);
}

PetscErrorCode StoreTriangle(Runtime &R)
{
  double asymmetry = 0;
  PetscFunctionBegin;
  if (!R.model->wants_triangle) PetscFunctionReturn(0);
  PetscCall(TryWhole(R, &asymmetry));
  PetscCheck(asymmetry <= 1, R.scene.comm, PETSC_ERR_ARG_INCOMP, "one triangle of the matrix does not hold this scene: off its initial state the matrix is unsymmetric by %g times rounding",
             asymmetry);
  PetscCall(ResolvePattern(R, true, false));
  PetscFunctionReturn(0);
}

/* The diagonal part in place; PETSc lets nobody at the other part of MPISBAIJ, which takes the few values there row by row */
PetscErrorCode FillTriangle(Runtime &R, Evaluation &e, Mat J, const std::function<void()> &add)
{
  Mat     diagonal = J;
  MatInfo info;
  PetscFunctionBegin;
  if (R.size > 1) PetscCall(MatGetDiagonalBlock(J, &diagonal));
  PetscCall(MatGetInfo(diagonal, MAT_LOCAL, &info));
  PetscCall(MatSeqSBAIJGetArray(diagonal, &e.sink.diagonal));
  std::fill(e.sink.diagonal, e.sink.diagonal + (std::size_t)info.nz_used, 0.0);
  std::fill(R.off_value.begin(), R.off_value.end(), 0.0);
  e.sink.off = R.off_value.data();
  add();
  PetscCall(MatSeqSBAIJRestoreArray(diagonal, &e.sink.diagonal));
  for (PetscInt i = 0; i < R.n && R.size > 1; i++) {
    const PetscInt row = R.start + i, from = R.off_start[i], count = R.off_start[i + 1] - from;
    if (count) PetscCall(MatSetValues(J, 1, &row, count, &R.off_column[from], &R.off_value[from], INSERT_VALUES));
  }
  PetscCall(MatAssemblyBegin(J, MAT_FINAL_ASSEMBLY));
  PetscCall(MatAssemblyEnd(J, MAT_FINAL_ASSEMBLY));
  PetscFunctionReturn(0);
}

} // namespace hhtdae
