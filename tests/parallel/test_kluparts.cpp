/* The solver type "kluparts" on all ranks together: solutions, when it keeps its pivots, when it is chosen */
#include "kluparts_test.h"

using namespace kluparts_test;

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

/* The interface of a chain consists of the multipliers of one joint per cut */
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

/* Two unknowns that are coupled with everything except each other, on ranks of their own: no interior remains there */
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

/* Few unknowns on each rank, down to one: coupled with the neighbours or not */
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

/* The factor itself gets a matrix with another pattern */
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

/* ---- the choice ---- */

static std::string chosen(const Triplets &e, const std::string &options, PetscBool symmetric = PETSC_FALSE)
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
  must(MatFactorGetSolverType(F, &package)); /* the actual type of the factor, not the requested one */
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
  EXPECT_EQ(chosen(e, "-pc_factor_mat_solver_type kluparts"), LINEAR_KLUPARTS);
  const Triplets bricks = block(4, 4, 4, true);
  EXPECT_EQ(chosen(bricks, "-pc_factor_mat_solver_type kluparts"), LINEAR_KLUPARTS);
}
