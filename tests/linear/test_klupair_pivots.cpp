/* The solver type "klupair": which pivots it plans */
#include "klupair_test.h"
#include <algorithm>
#include <random>

namespace
{

TEST(KluPairPivots, DiagonalStaysWhereItHasValues)
{
  const LinearPivots p = pivots_of(block(3, 3, 3, false));
  EXPECT_EQ(p.zeros, 0);
  for (size_t i = 0; i < p.col.size(); ++i) EXPECT_EQ(p.col[i], (PetscInt)i);
}

TEST(KluPairPivots, EveryMultiplierHasItsCoordinate)
{
  for (const Triplets &e :
       {chain(1, 0), chain(50, 0), chain(5, 12), spatial_chain(60), spatial_chain(64, 8), block(3, 3, 3, true)}) {
    const LinearPivots p = pivots_of(e);
    EXPECT_EQ(p.pairs, p.zeros);
    EXPECT_EQ(p.unmatched, 0);
    for (size_t i = 0; i < p.col.size(); ++i) EXPECT_EQ(p.col[p.col[i]], (PetscInt)i);
  }
}

/* As many constraints as coordinates, where each multiplier except the last prefers the coordinate of the next one:
   only an exchange along the whole row leaves a coordinate for each */
TEST(KluPairPivots, LongExchange)
{
  const PetscInt n = 3000;
  Triplets        e;
  e.n = 2 * n;
  for (PetscInt i = 0; i < n; ++i) {
    e.add(i, i, 1.0);
    e.add_symmetric(n + i, i, 0.6);
    if (i > 0) e.add_symmetric(n + i, i - 1, 1.0);
  }
  const LinearPivots p = pivots_of(e);
  EXPECT_EQ(p.pairs, n);
  EXPECT_LT(p.edges_visited, 100.0 * n);
}

TEST(KluPairPivots, ExplicitZerosAreNoPivots)
{
  Triplets e;
  e.n = 4;
  for (PetscInt i = 0; i < 2; ++i) e.add(i, i, 1.0);
  e.add(2, 2, 0.0);
  e.add_symmetric(2, 0, 0.0);
  e.add_symmetric(2, 1, 1.0);
  e.add_symmetric(3, 0, 1.0);
  e.add_symmetric(3, 1, 1.0);
  const LinearPivots p = pivots_of(e);
  EXPECT_EQ(p.col, (std::vector<PetscInt>{3, 2, 1, 0}));
}

TEST(KluPairPivots, LargeEntryIsPreferred)
{
  Triplets e;
  e.n = 4;
  for (PetscInt i = 0; i < 3; ++i) {
    e.add(i, i, 1.0);
    e.add_symmetric(3, i, i == 1 ? 2.0 : 1e-6);
  }
  EXPECT_EQ(pivots_of(e).col[3], 1);
}

TEST(KluPairPivots, TwoUnknownsWithoutDiagonal)
{
  Triplets e;
  e.n = 3;
  e.add(2, 2, 1.0);
  e.add_symmetric(0, 1, 1.0);
  EXPECT_EQ(pivots_of(e).col, (std::vector<PetscInt>{1, 0, 2}));
}

/* No two rows can exchange their pivots here: a cycle of three is needed */
TEST(KluPairPivots, UnsymmetricCycle)
{
  Triplets e;
  e.n = 3;
  for (PetscInt i = 0; i < 3; ++i) e.add(i, (i + 1) % 3, 1.0);
  EXPECT_EQ(pivots_of(e).col, (std::vector<PetscInt>{1, 2, 0}));
}

/* Two multipliers for one coordinate, and a row without entries */
TEST(KluPairPivots, SingularByItsPattern)
{
  Triplets e;
  e.n = 4;
  e.add(0, 0, 1.0);
  e.add_symmetric(1, 0, 1.0);
  e.add_symmetric(2, 0, 1.0);
  e.add(3, 3, 0.0);
  const LinearPivots p = pivots_of(e, 2);
  EXPECT_EQ(p.unmatched, 1); /* the pattern provides a pivot for the third row */
}

/* For ten times as many bodies ten times as many entries are examined */
TEST(KluPairPivots, WorkGrowsWithTheChain)
{
  for (PetscInt loops : {0, 8}) {
    const double few  = pivots_of(spatial_chain(1000, loops)).edges_visited,
                 many = pivots_of(spatial_chain(10000, loops)).edges_visited;
    EXPECT_LT(many, 13 * few) << loops;
    EXPECT_LT(many, 300.0 * 10000) << loops;
  }
  EXPECT_LT(pivots_of(chain(10000, 0)).edges_visited, 13 * pivots_of(chain(1000, 0)).edges_visited);
}

TEST(KluPairPivots, MatchingIsALargestOne)
{
  std::mt19937 random(3);
  for (int trial = 0; trial < 200; ++trial) {
    const PetscInt  n = 8;
    LinearBipartite G;
    G.right = n;
    G.start.assign(1, 0);
    for (PetscInt l = 0; l < n; ++l) {
      for (PetscInt r = 0; r < n; ++r)
        if (random() % 5 == 0) G.adj.push_back(r);
      G.start.push_back((PetscInt)G.adj.size());
    }
    std::vector<PetscInt> of_left(n, -1), of_right(n, -1);
    double                edges_visited = 0;
    LinearMaximumMatching(G, &of_left, &of_right, &edges_visited);
    PetscInt size = 0;
    for (PetscInt l = 0; l < n; ++l) {
      if (of_left[l] < 0) continue;
      EXPECT_EQ(of_right[of_left[l]], l);
      ++size;
    }
    /* Hall's theorem: by the subset of left vertices with the largest lack of neighbours */
    PetscInt lacking = 0;
    for (unsigned set = 0; set < 1u << n; ++set) {
      unsigned neighbours = 0;
      for (PetscInt l = 0; l < n; ++l)
        for (PetscInt k = G.start[l]; k < G.start[l + 1] && (set >> l & 1); ++k) neighbours |= 1u << G.adj[k];
      lacking = std::max(lacking, (PetscInt)(__builtin_popcount(set) - __builtin_popcount(neighbours)));
    }
    EXPECT_EQ(size, n - lacking);
  }
}

} // namespace
