/* A matrix distributed over the ranks in a given way, with the solver type "kluparts", and references for it */
#ifndef HHTDAE_TESTS_KLUPARTS_TEST_H
#define HHTDAE_TESTS_KLUPARTS_TEST_H

#include "../bench/linear_matrices.h"
#include "linear/kluparts.h"
#include "linear/linear.h"
#include "linear/mumpsnd.h"
#include "support.h"
#include <algorithm>
#include <hhtdae/hhtdae.h>
#include <random>

namespace kluparts_test
{

using namespace hhtest;

inline int ranks()
{
  int size;
  MPI_Comm_size(PETSC_COMM_WORLD, &size);
  return size;
}

inline int rank()
{
  int r;
  MPI_Comm_rank(PETSC_COMM_WORLD, &r);
  return r;
}

/* ---- matrices ---- */

typedef std::vector<int> Owners;

/* Pieces of equal length along a breadth-first walk through the graph: cuts across chains and nets */
inline Owners pieces(const Triplets &e, int count)
{
  std::vector<std::vector<PetscInt>> neighbours(e.n);
  std::vector<PetscInt>              walk;
  std::vector<bool>                  met(e.n, false);
  const auto                         meet = [&](PetscInt i) {
    if (!met[i]) walk.push_back(i);
    met[i] = true;
  };
  for (size_t k = 0; k < e.row.size(); ++k) {
    neighbours[e.row[k]].push_back(e.col[k]);
    neighbours[e.col[k]].push_back(e.row[k]);
  }
  for (PetscInt root = 0; root < e.n; ++root) {
    size_t head = walk.size();
    for (meet(root); head < walk.size(); ++head)
      for (PetscInt j : neighbours[walk[head]]) meet(j);
  }
  Owners owner(e.n);
  for (PetscInt k = 0; k < e.n; ++k) owner[walk[k]] = (int)(count * (double)k / (double)e.n);
  return owner;
}

/* Unknowns distributed at random: a large interface */
inline Owners scattered(const Triplets &e, int count)
{
  std::mt19937 random(7);
  Owners       owner(e.n);
  for (int &o : owner) o = (int)(random() % (unsigned)count);
  return owner;
}

/* Knots that are point masses, connected by rods with three multipliers at each end: rows x columns closed loops */
inline Triplets net(PetscInt rows, PetscInt columns)
{
  Triplets                               e;
  std::mt19937                           random(3);
  std::uniform_real_distribution<double> number(-1, 1);
  std::vector<PetscInt>                  knot(columns, -1);
  const auto                             body = [&e](PetscInt size) {
    const PetscInt q = e.n;
    e.n += size;
    for (PetscInt i = 0; i < 3; ++i) e.add(q + i, q + i, 2.0);
    for (PetscInt i = 3; i < size; ++i)
      for (PetscInt j = 3; j < size; ++j) e.add(q + i, q + j, i == j ? 0.5 : 0.05);
    return q;
  };
  const auto joint = [&](PetscInt rod, PetscInt to) {
    for (PetscInt d = 0; d < 3; ++d) {
      const PetscInt lambda = e.n++;
      e.add_symmetric(lambda, rod + d, 1);
      for (PetscInt a = 3; a < 6; ++a) e.add_symmetric(lambda, rod + a, 0.5 * number(random));
      if (to >= 0) e.add_symmetric(lambda, to + d, -1);
    }
  };
  const auto tie = [&](PetscInt from, PetscInt to) {
    const PetscInt rod = body(6);
    joint(rod, from);
    joint(rod, to);
  };
  for (PetscInt r = 0; r < rows; ++r)
    for (PetscInt c = 0; c < columns; ++c) {
      const PetscInt above = knot[c];
      knot[c]              = body(3);
      tie(above, knot[c]);
      if (c > 0) tie(knot[c - 1], knot[c]);
    }
  return e;
}

/* n coordinates with random couplings and m multipliers of four coordinates each */
inline Triplets saddle(PetscInt n, PetscInt m, unsigned seed)
{
  Triplets                               e;
  std::mt19937                           random(seed);
  std::uniform_real_distribution<double> number(-1, 1);
  e.n = n + m;
  for (PetscInt i = 0; i < n; ++i) {
    e.add(i, i, 4 + number(random));
    e.add_symmetric(i, (PetscInt)(random() % n), 0.3 * number(random));
  }
  for (PetscInt l = n; l < n + m; ++l) {
    e.add_symmetric(l, l - n, 2);
    for (int k = 0; k < 3; ++k) e.add_symmetric(l, (PetscInt)(random() % n), number(random));
  }
  return e;
}

/* With different values on the two sides of the diagonal */
inline Triplets unsymmetric(Triplets e)
{
  std::mt19937                           random(11);
  std::uniform_real_distribution<double> number(0.6, 1.4);
  for (double &v : e.val) v *= number(random);
  return e;
}

/* ---- a matrix on all ranks with its solver ---- */

class System
{
public:
  Mat                   A   = nullptr;
  KSP                   ksp = nullptr;
  std::vector<PetscInt> place; /* number of every unknown in the distributed matrix */
  PetscInt              n;

  System(const Triplets &e, const Owners &owner, const char *package = LINEAR_KLUPARTS) : place(e.n), n(e.n)
  {
    PetscInt next = 0;
    for (int r = 0; r < ranks(); ++r)
      for (PetscInt i = 0; i < e.n; ++i)
        if (owner[i] == r) place[i] = next++;
    mine_ = (PetscInt)std::count(owner.begin(), owner.end(), rank());
    A     = matrix(e);
    must(KSPCreate(PETSC_COMM_WORLD, &ksp));
    must(KSPSetType(ksp, KSPPREONLY));
    PC pc;
    must(KSPGetPC(ksp, &pc));
    must(PCSetType(pc, PCLU));
    must(PCFactorSetMatSolverType(pc, package));
    must(PCFactorSetMatOrderingType(pc, MATORDERINGEXTERNAL));
    must(KSPSetOperators(ksp, A, A));
  }
  ~System()
  {
    KSPDestroy(&ksp);
    MatDestroy(&A);
  }
  System(const System &) = delete;

  void exchange(const Triplets &e)
  {
    must(MatDestroy(&A));
    A = matrix(e);
    must(KSPSetOperators(ksp, A, A));
  }

  /* Sets other values in the same pattern */
  void values(const Triplets &e)
  {
    must(MatSetValuesCOO(A, own(e).val.data(), INSERT_VALUES));
    must(KSPSetOperators(ksp, A, A));
  }

  /* Solves for a right-hand side with entries between -1 and 1; the result is in the numbering of the entries, on every rank */
  Array solve()
  {
    Vec b, x;
    must(MatCreateVecs(A, &x, &b));
    rightHandSide(b);
    must(KSPSolve(ksp, b, x));
    const Array all = whole(x);
    Array       result(n);
    for (PetscInt i = 0; i < n; ++i) result[i] = all[place[i]];
    must(VecDestroy(&x));
    must(VecDestroy(&b));
    return result;
  }

  Mat factor()
  {
    PC  pc;
    Mat F;
    must(KSPGetPC(ksp, &pc));
    must(PCFactorGetMatrix(pc, &F));
    return F;
  }

  /* The text that the factor prints, on the first rank */
  std::string view()
  {
    Printed     printed;
    PetscViewer out = PETSC_VIEWER_STDOUT_WORLD;
    must(PetscViewerPushFormat(out, PETSC_VIEWER_ASCII_INFO));
    must(MatView(factor(), out));
    must(PetscViewerPopFormat(out));
    return printed.text();
  }

  static double rhs(PetscInt i) { return std::sin(1. + 3 * (double)i); }

private:
  PetscInt mine_ = 0;

  Triplets own(const Triplets &e) const
  {
    Triplets local;
    PetscInt begin = 0;
    MPI_Exscan(&mine_, &begin, 1, MPIU_INT, MPI_SUM, PETSC_COMM_WORLD);
    if (rank() == 0) begin = 0;
    local.n = e.n;
    for (size_t k = 0; k < e.row.size(); ++k)
      if (place[e.row[k]] >= begin && place[e.row[k]] < begin + mine_)
        local.add(place[e.row[k]], place[e.col[k]], e.val[k]);
    return local;
  }

  Mat matrix(const Triplets &e) const
  {
    Triplets local = own(e);
    Mat      M;
    must(MatCreate(PETSC_COMM_WORLD, &M));
    must(MatSetSizes(M, mine_, mine_, n, n));
    must(MatSetType(M, MATAIJ));
    must(MatSetPreallocationCOO(M, (PetscCount)local.row.size(), local.row.data(), local.col.data()));
    must(MatSetValuesCOO(M, local.val.data(), INSERT_VALUES));
    return M;
  }

  void rightHandSide(Vec b) const
  {
    PetscInt     begin, end;
    PetscScalar *array;
    must(VecGetOwnershipRange(b, &begin, &end));
    must(VecGetArray(b, &array));
    for (PetscInt i = 0; i < n; ++i)
      if (place[i] >= begin && place[i] < end) array[place[i] - begin] = rhs(i);
    must(VecRestoreArray(b, &array));
  }
};

/* Largest residual of a row relative to the terms of its sum */
inline double residual(const Triplets &e, const Array &x)
{
  Array left(e.n), size(e.n);
  for (PetscInt i = 0; i < e.n; ++i) {
    left[i] = System::rhs(i);
    size[i] = std::abs(left[i]);
  }
  for (size_t k = 0; k < e.row.size(); ++k) {
    left[e.row[k]] -= e.val[k] * x[e.col[k]];
    size[e.row[k]] += std::abs(e.val[k] * x[e.col[k]]);
  }
  double r = 0;
  for (PetscInt i = 0; i < e.n; ++i) widen(r, std::abs(left[i]) / size[i]);
  return r;
}

/* Solves the same system on each rank alone */
inline Array alone(const Triplets &e)
{
  Mat A;
  KSP ksp;
  PC  pc;
  Vec b, x;
  must(create_matrix(e, &A));
  must(KSPCreate(PETSC_COMM_SELF, &ksp));
  must(KSPSetType(ksp, KSPPREONLY));
  must(KSPGetPC(ksp, &pc));
  must(PCSetType(pc, PCLU));
  must(PCFactorSetMatSolverType(pc, "klupair"));
  must(KSPSetOperators(ksp, A, A));
  must(MatCreateVecs(A, &x, &b));
  for (PetscInt i = 0; i < e.n; ++i) must(VecSetValue(b, i, System::rhs(i), INSERT_VALUES));
  must(KSPSolve(ksp, b, x));
  const Array result = whole(x);
  must(VecDestroy(&x));
  must(VecDestroy(&b));
  must(KSPDestroy(&ksp));
  must(MatDestroy(&A));
  return result;
}

/* Compares with the solution on one rank, and with MUMPS if asked for, which is slow on few cores because it
   communicates much */
inline void compare(const char *what, const Triplets &e, const Owners &owner, bool mumps = false)
{
  System       s(e, owner);
  const Array  x    = s.solve();
  const double left = residual(e, x), klupair = relativeDifference(x, alone(e));
  if (rank() == 0) MEASURED("%s on %d ranks: residual %.1e, against klupair %.1e", what, ranks(), left, klupair);
  EXPECT_LT(left, 1e-10) << what;
  EXPECT_LT(klupair, 1e-9) << what;
  if (!mumps) return;
  System       other(e, owner, LINEAR_MUMPSND);
  const double difference = relativeDifference(x, other.solve());
  if (rank() == 0) MEASURED("%s on %d ranks: against MUMPS %.1e", what, ranks(), difference);
  EXPECT_LT(difference, 1e-9) << what;
}

inline MatFactorError factorError(System &s)
{
  MatFactorError error;
  must(KSPSetUp(s.ksp));
  must(MatFactorGetError(s.factor(), &error));
  return error;
}

/* Whether all ranks have the same value */
inline bool agreed(int value)
{
  int both[2] = {value, -value};
  MPI_Allreduce(MPI_IN_PLACE, both, 2, MPI_INT, MPI_MAX, PETSC_COMM_WORLD);
  return both[0] == -both[1];
}

} // namespace kluparts_test

#endif
