/* The surface of a body distributed over several ranks equals that of one rank, and is collected on the first rank */
#include "hhtdae/flexible.h"
#include "reduced_body.h"

using namespace hhtest;

TEST(Surface, AsOnOneRank)
{
  PetscMPIInt rank;
  MPI_Comm_rank(PETSC_COMM_WORLD, &rank);
  for (PetscInt bricks : {1, 5, 40}) {
    const HandMade all(PETSC_COMM_WORLD, bricks), alone(PETSC_COMM_SELF, bricks);
    Surface        a, b;
    must(MakeSurface(all.body, &a));
    must(MakeSurface(alone.body, &b));
    EXPECT_EQ(a.point.empty(), rank != 0);
    if (rank) continue;
    EXPECT_EQ(a.point, b.point);
    EXPECT_EQ(a.triangle, b.triangle);
    EXPECT_EQ(a.shape, b.shape);
    EXPECT_EQ(b.triangle.size(), 3u * (4 * (bricks > 1) + 8 * (bricks - 1) + 4));
  }
}
