/* "kluparts" with singular interiors or matrices: what moves to its interface, and how it reports singular matrices */
#include "kluparts_test.h"

using namespace kluparts_test;

/* ---- interiors that are singular though the matrix is not ---- */

/* Unknown 0 is coupled with many unknowns of another rank and becomes part of the interface; unknown 1 has its own
   diagonal and a coupling to unknown 0. If this diagonal vanishes, nothing is left in the interior */
static Triplets withFollower(double diagonal)
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

static Owners followerOwners(const Triplets &e)
{
  Owners o(e.n, std::min(1, ranks() - 1));
  o[0] = o[1] = 0;
  for (PetscInt i = 20; i < e.n; ++i) o[i] = 0;
  return o;
}

static void expectMoved(System &s, const char *count)
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
  /* and it stays there */
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

/* Three bodies of one coordinate on a line, with constraints between them and to the ground: without the first body,
   the values (not the pattern) show that there are more constraints than coordinates */
TEST(KluParts, DependentRowsInAnInterior)
{
  for (const double change : {0., 1e-14}) {
    Triplets e;
    e.n = 36;
    for (PetscInt i = 0; i < 34; ++i) e.add(i, i, 3.0 + 0.1 * (double)i);
    for (PetscInt i = 10; i < 34; ++i) e.add_symmetric(0, i, 0.2 + 0.01 * (double)(i % 5));
    /* 34 and 35 constrain unknowns 1 and 2 in the same way and differ in unknown 0 only */
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

/* A constraint that is repeated with another factor: between two bodies of one rank, and across a cut */
static void expectSingular(PetscInt joint)
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
  /* regular again */
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
