/* The solver type "kluparts" on all ranks together: what it solves, when it keeps its pivots, what moves to its
   interface, what it says of singular matrices, when it is chosen */
#include "../bench/linear_matrices.h"
#include "linear/kluparts.h"
#include "linear/linear.h"
#include "linear/mumpsnd.h"
#include "support.h"
#include <algorithm>
#include <hhtdae/hhtdae.h>
#include <random>

using namespace hhtest;

namespace
{

using Triplets = ::Entries; /* the examples have a type of this name, too */

int ranks()
{
  int size;
  MPI_Comm_size(PETSC_COMM_WORLD, &size);
  return size;
}

int rank()
{
  int r;
  MPI_Comm_rank(PETSC_COMM_WORLD, &r);
  return r;
}

/* ---- matrices ---- */

typedef std::vector<int> Owners;

/* Pieces of equal length along a walk through the graph, breadth first: cuts across chains and nets */
Owners pieces(const Triplets &e, int count)
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

/* Anything anywhere: much interface */
Owners scattered(const Triplets &e, int count)
{
  std::mt19937 random(7);
  Owners       owner(e.n);
  for (int &o : owner) o = (int)(random() % (unsigned)count);
  return owner;
}

/* Knots that are point masses, rods with three multipliers at either end: rows x columns closed loops */
Triplets net(PetscInt rows, PetscInt columns)
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
Triplets saddle(PetscInt n, PetscInt m, unsigned seed)
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

/* Other values on either side of the diagonal */
Triplets unsymmetric(Triplets e)
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
  std::vector<PetscInt> place; /* of every unknown in the numbers of the distributed matrix */
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

  /* Other values in the same pattern */
  void values(const Triplets &e)
  {
    must(MatSetValuesCOO(A, own(e).val.data(), INSERT_VALUES));
    must(KSPSetOperators(ksp, A, A));
  }

  /* For the right-hand side of entries between -1 and 1; in the numbers of the entries, on every rank */
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

  /* What the factor prints, on the first rank */
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

/* Largest residual of a row relative to the terms that it sums up */
double residual(const Triplets &e, const Array &x)
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

/* The same system on every rank alone */
Array alone(const Triplets &e)
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

/* Against one rank alone; against MUMPS, too, where asked for: it talks much where cores are few */
void compare(const char *what, const Triplets &e, const Owners &owner, bool mumps = false)
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

MatFactorError factorError(System &s)
{
  MatFactorError error;
  must(KSPSetUp(s.ksp));
  must(MatFactorGetError(s.factor(), &error));
  return error;
}

/* The same on all ranks */
bool agreed(int value)
{
  int both[2] = {value, -value};
  MPI_Allreduce(MPI_IN_PLACE, both, 2, MPI_INT, MPI_MAX, PETSC_COMM_WORLD);
  return both[0] == -both[1];
}

} // namespace

/* ---- solutions ---- */

TEST(KluParts, Chains)
{
  for (const Triplets &e : {spatial_chain(60), spatial_chain(400, 8), chain(200, 0), chain(30, 12)}) {
    compare("chain", e, pieces(e, ranks()));
    compare("chain, unsymmetric", unsymmetric(e), pieces(e, ranks()), e.n < 1000);
  }
}

TEST(KluParts, Nets)
{
  for (const Triplets &e : {net(3, 3), net(12, 12), net(30, 4)}) compare("net", e, pieces(e, ranks()), e.n < 1000);
}

TEST(KluParts, Bricks)
{
  const Triplets e = block(6, 3, 3, true);
  compare("bricks", e, pieces(e, ranks()));
}

TEST(KluParts, RandomSaddlePoints)
{
  for (unsigned seed = 1; seed <= 12; ++seed) {
    const Triplets e = saddle(40 + 15 * (PetscInt)seed, 10 + 5 * (PetscInt)seed, seed);
    compare("saddle", e, pieces(e, ranks()));
    compare("saddle, scattered", e, scattered(e, ranks()));
    compare("saddle, unsymmetric", unsymmetric(e), scattered(e, ranks()), seed == 2);
  }
}

/* The interface of a chain is the multipliers of one joint per cut */
TEST(KluParts, SmallInterface)
{
  const Triplets e = spatial_chain(300);
  Owners         o(e.n);
  for (PetscInt i = 0; i < e.n; ++i) {
    const PetscInt body = i < 1800 ? i / 6 : (i - 1800) / 5;
    o[i]                = (int)(body * ranks() / 300);
  }
  System          s(e, o);
  LinearPartsWork work;
  must(LinearPartsCount(s.A, 1e6, 1000, &work));
  EXPECT_EQ(work.possible, ranks() > 1 ? PETSC_TRUE : PETSC_FALSE);
  EXPECT_EQ(work.interface, 5 * (ranks() - 1));
}

TEST(KluParts, NothingBetweenRanks)
{
  Triplets e;
  Owners   o;
  for (int r = 0; r < 3; ++r) {
    const Triplets part = spatial_chain(5);
    for (size_t k = 0; k < part.row.size(); ++k) e.add(e.n + part.row[k], e.n + part.col[k], part.val[k]);
    e.n += part.n;
    o.resize(e.n, r % ranks());
  }
  compare("three chains", e, o);
}

TEST(KluParts, RankWithoutUnknowns)
{
  const Triplets e = spatial_chain(20);
  Owners         o = pieces(e, std::max(1, ranks() - 1));
  compare("last rank empty", e, o);
  for (int &r : o) r = ranks() - 1 - r;
  compare("first rank empty", e, o);
}

/* Two unknowns that are coupled with everything but each other, on ranks of their own: no interior is left there */
TEST(KluParts, RankWithoutInterior)
{
  Triplets e;
  e.n = 32;
  for (PetscInt i = 0; i < e.n; ++i) e.add(i, i, 3.0 + 0.1 * (double)i);
  for (PetscInt i = 2; i < e.n; ++i)
    for (PetscInt hub = 0; hub < 2; ++hub) e.add_symmetric(hub, i, 0.2 + 0.01 * (double)(i * (hub + 1) % 7));
  Owners o(e.n, 0);
  o[0] = std::min(1, ranks() - 1);
  o[1] = std::min(2, ranks() - 1);
  compare("hubs", e, o);
}

/* Few unknowns each, down to one: coupled, or not, with the neighbours */
TEST(KluParts, FewUnknowns)
{
  for (PetscInt n = 1; n <= 9; ++n)
    for (const bool coupled : {true, false}) {
      Triplets e;
      Owners   o;
      for (e.n = 0; e.n < n; ++e.n) {
        e.add(e.n, e.n, 2.0 + 0.3 * (double)e.n);
        if (coupled && e.n > 0) e.add_symmetric(e.n, e.n - 1, 0.7);
        o.push_back((int)(e.n % ranks()));
      }
      compare("few", e, o);
      std::sort(o.begin(), o.end());
      compare("few, in pieces", e, o);
    }
}

/* ---- the same factor for other values, other patterns ---- */

TEST(KluParts, OldPivotsForNewValues)
{
  Triplets     e = spatial_chain(200);
  const Owners o = pieces(e, ranks());
  System       s(e, o);
  EXPECT_LT(residual(e, s.solve()), 1e-10);
  for (int k = 1; k < 4; ++k) {
    for (size_t j = 0; j < e.val.size(); ++j) e.val[j] *= 1 + 0.01 * std::sin((double)j * k);
    s.values(e);
    EXPECT_LT(residual(e, s.solve()), 1e-10);
  }
  const std::string text = s.view();
  if (rank() > 0) return;
  EXPECT_NE(text.find("factorizations with pivoting: 1, with old pivots: 3"), std::string::npos) << text;
}

TEST(KluParts, OtherPattern)
{
  Triplets     e = spatial_chain(64);
  const Owners o = pieces(e, ranks());
  System       s(e, o);
  s.solve();
  e.add_symmetric(3, 200, 0.7);
  e.add_symmetric(100, 380, -0.4);
  s.exchange(e);
  EXPECT_LT(residual(e, s.solve()), 1e-10);
}

/* The factor itself is given a matrix with another pattern */
TEST(KluParts, OtherPatternWithoutAnalysis)
{
  Triplets      e = spatial_chain(64);
  const Owners  o = pieces(e, ranks());
  System        s(e, o);
  MatFactorInfo info;
  Vec           b, x;
  s.solve();
  e.add_symmetric(3, 200, 0.7);
  System other(e, o);
  must(MatFactorInfoInitialize(&info));
  must(MatLUFactorNumeric(s.factor(), other.A, &info));
  must(MatCreateVecs(other.A, &x, &b));
  must(VecSet(x, 1));
  must(MatMult(other.A, x, b));
  must(MatSolve(s.factor(), b, x));
  for (double v : whole(x)) EXPECT_NEAR(v, 1, 1e-9);
  must(VecDestroy(&x));
  must(VecDestroy(&b));
}

/* ---- interiors that are singular though the matrix is not ---- */

/* Unknown 0 is coupled with many on another rank and becomes the interface; unknown 1 has its own diagonal, and unknown
   0. When that diagonal goes, nothing is left in the interior. */
Triplets withFollower(double diagonal)
{
  Triplets e;
  e.n = 40;
  for (PetscInt i = 0; i < e.n; ++i) e.add(i, i, i == 1 ? diagonal : 3.0 + 0.1 * (double)i);
  for (PetscInt i = 2; i < 20; ++i) e.add_symmetric(0, i, 0.3 + 0.01 * (double)i);
  for (PetscInt i = 20; i < e.n; ++i) e.add_symmetric(i, i - 1, i == 20 ? 0. : 0.5);
  e.add_symmetric(0, 1, 1);
  e.add_symmetric(30, 1, 0);
  return e;
}

Owners followerOwners(const Triplets &e)
{
  Owners o(e.n, std::min(1, ranks() - 1));
  o[0] = o[1] = 0;
  for (PetscInt i = 20; i < e.n; ++i) o[i] = 0;
  return o;
}

void expectMoved(System &s, const char *count)
{
  const std::string text = s.view();
  if (rank() > 0 || ranks() == 1) return;
  EXPECT_NE(text.find(std::string(count) + " of them moved there"), std::string::npos) << text;
}

TEST(KluParts, SingularInteriorMovesToTheInterface)
{
  Triplets e = withFollower(2);
  System   s(e, followerOwners(e));
  EXPECT_LT(residual(e, s.solve()), 1e-10);
  expectMoved(s, " 0");
  e = withFollower(0);
  s.values(e);
  EXPECT_LT(residual(e, s.solve()), 1e-10);
  expectMoved(s, " 1");
  /* and stays there */
  e = withFollower(1);
  s.values(e);
  EXPECT_LT(residual(e, s.solve()), 1e-10);
  expectMoved(s, " 1");
}

TEST(KluParts, NearlySingularInteriorIsSeen)
{
  Triplets e = withFollower(2);
  System   s(e, followerOwners(e));
  s.solve();
  e = withFollower(1e-15);
  s.values(e);
  EXPECT_LT(residual(e, s.solve()), 1e-10);
  expectMoved(s, " 1");
}

/* Three bodies of one coordinate on a line, constraints between them and to the ground: what is left without the first
   body has more constraints than coordinates only by its values */
TEST(KluParts, DependentRowsInAnInterior)
{
  for (const double change : {0., 1e-14}) {
    Triplets e;
    e.n = 36;
    for (PetscInt i = 0; i < 34; ++i) e.add(i, i, 3.0 + 0.1 * (double)i);
    for (PetscInt i = 10; i < 34; ++i) e.add_symmetric(0, i, 0.2 + 0.01 * (double)(i % 5));
    /* unknowns 1 and 2 are held alike by 34 and 35, which differ in unknown 0 only */
    for (PetscInt l = 34; l < 36; ++l) {
      e.add(l, l, 1e-3); /* so that these do not count as multipliers */
      e.add_symmetric(l, 1, 1);
      e.add_symmetric(l, 2, l == 34 ? 1 : 1 + change);
      e.add_symmetric(l, 0, l == 34 ? 0.5 : -0.5);
    }
    Owners o(e.n, std::min(1, ranks() - 1));
    for (PetscInt i : {0, 1, 2, 34, 35}) o[i] = 0;
    System s(e, o);
    EXPECT_LT(residual(e, s.solve()), 1e-10);
    for (size_t k = 0; k < e.row.size(); ++k)
      if (e.row[k] == e.col[k] && e.row[k] >= 34) e.val[k] = 0;
    s.values(e);
    EXPECT_LT(residual(e, s.solve()), 1e-10);
    const std::string text = s.view();
    if (rank() == 0 && ranks() > 1) {
      EXPECT_EQ(text.find(" 0 of them moved there"), std::string::npos) << text;
    }
  }
}

/* ---- matrices that are singular ---- */

/* A constraint twice, by another factor: between two bodies of one rank, and across a cut */
void expectSingular(PetscInt joint)
{
  Triplets       e      = spatial_chain(60);
  const PetscInt lambda = 360 + 5 * joint, twice = e.n++;
  const size_t   before = e.row.size();
  Owners         o      = pieces(e, ranks());
  for (size_t k = 0; k < before; ++k)
    if (e.row[k] == lambda) e.add_symmetric(twice, e.col[k], 2 * e.val[k]);
  o[twice] = o[lambda];
  System s(e, o);
  EXPECT_EQ(factorError(s), MAT_FACTOR_NUMERIC_ZEROPIVOT) << joint;
  s.solve();
  KSPConvergedReason reason;
  must(KSPGetConvergedReason(s.ksp, &reason));
  EXPECT_EQ(reason, KSP_DIVERGED_PC_FAILED);
  EXPECT_TRUE(agreed(reason));
}

TEST(KluParts, ConstraintTwice)
{
  for (PetscInt joint = 0; joint < 60; joint += 7) expectSingular(joint);
}

TEST(KluParts, SingularByItsPattern)
{
  Triplets     e = spatial_chain(20);
  const Owners o = pieces(e, ranks());
  System       s(e, o);
  s.solve();
  for (size_t k = 0; k < e.row.size(); ++k)
    if (e.row[k] == 17 || e.col[k] == 17) e.val[k] = 0;
  s.values(e);
  EXPECT_EQ(factorError(s), MAT_FACTOR_NUMERIC_ZEROPIVOT);
  /* and regular again */
  e = spatial_chain(20);
  s.values(e);
  EXPECT_EQ(factorError(s), MAT_FACTOR_NOERROR);
  EXPECT_LT(residual(e, s.solve()), 1e-10);
}

TEST(KluParts, ErrorOnAllRanks)
{
  Triplets e = spatial_chain(20);
  for (size_t k = 0; k < e.row.size(); ++k)
    if (e.row[k] == 17 || e.col[k] == 17) e.val[k] = 0;
  System s(e, pieces(e, ranks()));
  must(KSPSetErrorIfNotConverged(s.ksp, PETSC_TRUE));
  ErrorTrap trap;
  EXPECT_EQ(KSPSetUp(s.ksp), PETSC_ERR_MAT_LU_ZRPVT);
  EXPECT_TRUE(trap.says("singular")) << trap.message;
}

TEST(KluParts, NotFinite)
{
  Triplets e = spatial_chain(20);
  e.val[50]  = NAN;
  System s(e, pieces(e, ranks()));
  EXPECT_NE(factorError(s), MAT_FACTOR_NOERROR);
  EXPECT_TRUE(agreed((int)factorError(s)));
}

TEST(KluParts, NoTransposedSolve)
{
  if (ranks() == 1) GTEST_SKIP() << "klupair solves it";
  const Triplets e = spatial_chain(20);
  System         s(e, pieces(e, ranks()));
  Vec            b, x;
  must(KSPSetUp(s.ksp));
  must(MatCreateVecs(s.A, &x, &b));
  {
    ErrorTrap trap;
    EXPECT_EQ(MatSolveTranspose(s.factor(), b, x), PETSC_ERR_SUP);
  }
  must(VecDestroy(&x));
  must(VecDestroy(&b));
}

/* ---- the choice ---- */

std::string chosen(const Triplets &e, const std::string &options, PetscBool symmetric = PETSC_FALSE)
{
  System       s(e, pieces(e, ranks()));
  Options      given(options);
  LinearChoice choice;
  KSP          ksp;
  PC           pc;
  must(KSPCreate(PETSC_COMM_WORLD, &ksp));
  must(KSPSetOperators(ksp, s.A, s.A));
  must(LinearDefaults(ksp, &choice));
  must(KSPSetFromOptions(ksp));
  must(LinearChoose(ksp, s.A, symmetric, &choice));
  MatSolverType package;
  Mat           F;
  must(KSPGetPC(ksp, &pc));
  must(KSPSetUp(ksp));
  must(PCFactorGetMatrix(pc, &F));
  must(MatFactorGetSolverType(F, &package)); /* what the factor is, not what was asked for */
  const std::string result = package;
  must(KSPDestroy(&ksp));
  return result;
}

TEST(KluParts, ChosenWhereItIsQuicker)
{
  if (ranks() == 1) GTEST_SKIP() << "for distributed matrices";
  EXPECT_EQ(chosen(spatial_chain(500), ""), LINEAR_KLUPARTS);
  EXPECT_EQ(chosen(spatial_chain(500), "", PETSC_TRUE), LINEAR_KLUPARTS);
  EXPECT_EQ(chosen(net(12, 12), ""), LINEAR_KLUPARTS);
  EXPECT_EQ(chosen(block(8, 8, 8, true), ""), LINEAR_MUMPSND);
}

TEST(KluParts, UsersPackageWins)
{
  const Triplets e = spatial_chain(50);
  EXPECT_EQ(chosen(e, "-pc_factor_mat_solver_type mumps"), MATSOLVERMUMPS);
  const std::string kluparts = ranks() > 1 ? LINEAR_KLUPARTS : "klupair"; /* which it is on one rank */
  EXPECT_EQ(chosen(e, "-pc_factor_mat_solver_type kluparts"), kluparts);
  const Triplets bricks = block(4, 4, 4, true);
  EXPECT_EQ(chosen(bricks, "-pc_factor_mat_solver_type kluparts"), kluparts);
}
