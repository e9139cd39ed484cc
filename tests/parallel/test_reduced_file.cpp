/* The file of a reduced body, its field and its hot spots on several ranks equal those of one rank to the last byte */
#include "hhtdae/flexible.h"
#include "reduced_body.h"

using namespace hhtest;

namespace
{

int Rank()
{
  PetscMPIInt rank;
  MPI_Comm_rank(PETSC_COMM_WORLD, &rank);
  return rank;
}

} // namespace

TEST(ReducedFile, WrittenByAll)
{
  HandMade all(PETSC_COMM_WORLD), alone(PETSC_COMM_SELF);
  Scratch  together(PETSC_COMM_WORLD, "all.h5"), single("alone" + std::to_string(Rank()) + ".h5");
  must(all.body.save(together.name));
  must(alone.body.save(single.name));
  EXPECT_GT(single.text().size(), 5000u);
  EXPECT_EQ(together.text(), single.text());
}

TEST(ReducedFile, ReadByAll)
{
  HandMade    all(PETSC_COMM_WORLD), alone(PETSC_COMM_SELF);
  Scratch     file(PETSC_COMM_WORLD, "read.h5"), again(PETSC_COMM_WORLD, "again.h5");
  ReducedBody read, whole;
  ModalBody   modal;
  must(all.body.save(file.name));
  must(whole.load(PETSC_COMM_SELF, file.name));
  EXPECT_TRUE(Same(alone.body, whole));
  EXPECT_TRUE(SameElements(alone.body.elements, whole.elements));
  must(read.load(PETSC_COMM_WORLD, file.name));
  EXPECT_TRUE(Same(alone.body.modal, read.modal));
  EXPECT_LE(std::abs(3 * read.own - (PetscInt)read.coordinates.size()), 0);
  for (PetscInt i = 0; i < read.own; i++)
    EXPECT_EQ(read.label[(std::size_t)i], alone.body.label[(std::size_t)(read.first + i)]);
  EXPECT_TRUE(SameMatrix(read.shape, alone.body.shape.middleRows(3 * read.first, 3 * read.own)));
  must(LoadModalBody(PETSC_COMM_WORLD, file.name, &modal));
  EXPECT_TRUE(Same(alone.body.modal, modal));
  /* distributed differently from the writing run, but the same file */
  must(read.save(again.name));
  EXPECT_EQ(file.text(), again.text());
}

/* More ranks than nodes or elements */
TEST(ReducedFile, RanksWithoutNodes)
{
  HandMade    all(PETSC_COMM_WORLD, 1, 3);
  Scratch     file(PETSC_COMM_WORLD, "few.h5"), again(PETSC_COMM_WORLD, "few_again.h5");
  ReducedBody read;
  must(all.body.save(file.name));
  must(read.load(PETSC_COMM_WORLD, file.name));
  must(read.save(again.name));
  EXPECT_EQ(file.text(), again.text());
}

/* A faulty file is refused on all ranks, with the same reason */
TEST(ReducedFile, RefusedByAll)
{
  HandMade all(PETSC_COMM_WORLD, 2, 2);
  Scratch  file(PETSC_COMM_WORLD, "whole.h5"), broken(PETSC_COMM_WORLD, "broken.h5");
  must(all.body.save(file.name));
  const std::string whole   = file.text();
  int               refused = 0;
  for (std::size_t at = 0; at < whole.size(); at += 61) {
    std::string text = whole;
    text[at]         = (char)(text[at] ^ 4);
    MPI_Barrier(PETSC_COMM_WORLD);
    if (!Rank()) broken.write(text);
    MPI_Barrier(PETSC_COMM_WORLD);
    ReducedBody read;
    ErrorTrap   trap;
    int         code = read.load(PETSC_COMM_WORLD, broken.name) != 0, most, least;
    MPI_Allreduce(&code, &most, 1, MPI_INT, MPI_MAX, PETSC_COMM_WORLD);
    MPI_Allreduce(&code, &least, 1, MPI_INT, MPI_MIN, PETSC_COMM_WORLD);
    EXPECT_EQ(most, least) << "byte " << at;
    refused += code;
  }
  EXPECT_GT(refused, 50);
  ErrorTrap   trap;
  ReducedBody read;
  EXPECT_NE(read.load(PETSC_COMM_WORLD, "/nowhere/body.h5"), 0);
  EXPECT_TRUE(trap.says("there is no such file")) << trap.message;
  /* the numbers of one rank are bad: no rank writes, and none waits */
  if (Rank() == 0) all.body.coordinates[0] = 1. / 0.;
  EXPECT_NE(all.body.save(broken.name), 0);
  EXPECT_NE(all.body.save("/nowhere/body.h5"), 0);
}

/* Matrices, nodes and sets from files: each rank reads a range of lines, and all lines are read */
TEST(Import, AsOnOneRank)
{
  const PetscInt n = 40;
  Scratch        k(PETSC_COMM_WORLD, "k.mtx"), m(PETSC_COMM_WORLD, "m.mtx"), nodes(PETSC_COMM_WORLD, "nodes"),
      sets(PETSC_COMM_WORLD, "sets");
  std::ostringstream K, M, X;
  PetscInt           count = 0;
  for (PetscInt i = 1; i <= 3 * n; i++) {
    for (PetscInt j = i; j <= std::min(3 * n, i + 7); j += 2, count++)
      K << j << " " << i << " " << (i == j ? 9 : Number(i, j)) << "\n";
    M << i << " " << i << " " << 1 + 0.01 * i << "\n";
  }
  for (PetscInt i = 0; i < n; i++) X << 10 + 3 * i << " " << i << " 0.5 " << -i << "\n";
  if (!Rank()) {
    k.write("%%MatrixMarket matrix coordinate real symmetric\n" + std::to_string(3 * n) + " " + std::to_string(3 * n) +
            " " + std::to_string(count) + "\n" + K.str());
    m.write(M.str());
    nodes.write(X.str());
    sets.write("ends 10 127\nall 10 13 16 127 124\nnone\n");
  }
  MPI_Barrier(PETSC_COMM_WORLD);
  FeModel all(PETSC_COMM_WORLD), alone(PETSC_COMM_SELF);
  must(all.readMatrices(k.name, m.name, nodes.name, sets.name));
  must(alone.readMatrices(k.name, m.name, nodes.name, sets.name));
  EXPECT_EQ(all.nodes, n);
  for (PetscInt i = 0; i < all.own; i++) EXPECT_EQ(all.label[(std::size_t)i], 10 + 3 * (all.first + i));
  EXPECT_EQ(all.coordinates, std::vector<double>(alone.coordinates.begin() + 3 * all.first,
                                                 alone.coordinates.begin() + 3 * (all.first + all.own)));
  ASSERT_EQ(all.sets.size(), 3u);
  for (const auto &set : alone.sets) {
    std::vector<PetscInt> mine;
    for (PetscInt i : set.second)
      if (i >= all.first && i < all.first + all.own) mine.push_back(i);
    EXPECT_EQ(all.sets[set.first], mine) << set.first;
  }
  for (bool mass : {false, true})
    for (PetscInt row = 3 * all.first; row < 3 * (all.first + all.own); row++) {
      PetscInt           a, b;
      const PetscInt    *i, *j;
      const PetscScalar *v, *w;
      must(MatGetRow(mass ? all.M : all.K, row, &a, &i, &v));
      must(MatGetRow(mass ? alone.M : alone.K, row, &b, &j, &w));
      ASSERT_EQ(a, b);
      for (PetscInt c = 0; c < a; c++) {
        EXPECT_EQ(i[c], j[c]);
        EXPECT_EQ(v[c], w[c]);
      }
      must(MatRestoreRow(mass ? all.M : all.K, row, &a, &i, &v));
      must(MatRestoreRow(mass ? alone.M : alone.K, row, &b, &j, &w));
    }
  /* a line in the range of one rank is bad: all ranks refuse */
  FeModel   refused(PETSC_COMM_WORLD);
  ErrorTrap trap;
  MPI_Barrier(PETSC_COMM_WORLD);
  if (!Rank()) m.write(M.str() + "5 five 5\n");
  MPI_Barrier(PETSC_COMM_WORLD);
  EXPECT_NE(refused.readMatrices(k.name, m.name, nodes.name, sets.name), 0);
  EXPECT_TRUE(trap.says("5 five 5")) << trap.message;
  MPI_Barrier(PETSC_COMM_WORLD);
}

TEST(Field, AsOnOneRank)
{
  HandMade              all(PETSC_COMM_WORLD), alone(PETSC_COMM_SELF);
  Scratch               together(PETSC_COMM_WORLD, "all.vtu"), single("alone" + std::to_string(Rank()) + ".vtu");
  const Eigen::VectorXd eta  = Numbers(4, 1, 50);
  const Matrix3         axes = Eigen::AngleAxisd(0.7, Vector3(1, 2, 3).normalized()).toRotationMatrix();
  must(WriteField(all.body, eta, together.name, Vector3(1, 2, 3), axes));
  must(WriteField(alone.body, eta, single.name, Vector3(1, 2, 3), axes));
  EXPECT_GT(single.text().size(), 1000u);
  EXPECT_EQ(together.text(), single.text());
}

TEST(HotSpots, AsOnOneRank)
{
  HandMade             all(PETSC_COMM_WORLD, 20), alone(PETSC_COMM_SELF, 20);
  HotSpots             hot(all.body), reference(alone.body);
  std::vector<HotSpot> a, b;
  for (int step = 0; step < 30; step++) {
    const Eigen::VectorXd eta = Numbers(4, 1, 60 + step);
    must(hot.add(0.1 * step, eta));
    must(reference.add(0.1 * step, eta));
  }
  must(hot.highest(7, 1.6, &a));
  must(reference.highest(7, 1.6, &b));
  ASSERT_EQ(a.size(), 7u);
  ASSERT_EQ(b.size(), 7u);
  for (std::size_t i = 0; i < 7; i++) {
    EXPECT_EQ(a[i].label, b[i].label);
    EXPECT_EQ(a[i].stress, b[i].stress);
    EXPECT_EQ(a[i].time, b[i].time);
    EXPECT_EQ(a[i].position, b[i].position);
  }
}
