/* A mesh gives the same model on any number of ranks: nodes by label, sets, K and M, stress; errors reach all ranks */
#include "fe_mesh.h"
#include "flexible/partitioner.h"

using namespace hhtest;
using hhtdae::AddStressModes;
using hhtdae::ReducedBody;

namespace
{

const ElementType types[] = {ElementType::Tetrahedron4, ElementType::Tetrahedron10, ElementType::Brick8,
                             ElementType::Brick20};
const Materials   two     = {{"solid", {2, .3, 7}}, {"other", {5, .2, 3}}};

Vector3 wave(const Vector3 &x) { return {std::sin(3 * x[0] + x[1]), x[0] * x[2] + x[1], std::cos(2 * x[2]) * x[0]}; }

Vector3 bent(const Vector3 &x) { return x + Vector3(.05 * std::sin(3 * x[1]), .04 * x[0] * x[2], .06 * x[0] * x[0]); }

/* For every node of all ranks, by label, an array of `width` numbers */
using ByLabel = std::map<PetscInt, Array>;

ByLabel byLabel(const FeModel &model, const double *values, int width)
{
  PetscMPIInt size;
  MPI_Comm_size(model.comm, &size);
  std::vector<double> mine, all;
  for (PetscInt n = 0; n < model.own; n++) {
    mine.push_back((double)model.label[n]);
    mine.insert(mine.end(), values + width * n, values + width * (n + 1));
  }
  std::vector<int> count(size), place(size + 1, 0);
  int              own = (int)mine.size();
  MPI_Allgather(&own, 1, MPI_INT, count.data(), 1, MPI_INT, model.comm);
  for (int r = 0; r < size; r++) place[r + 1] = place[r] + count[r];
  all.resize(place[size]);
  MPI_Allgatherv(mine.data(), own, MPI_DOUBLE, all.data(), count.data(), place.data(), MPI_DOUBLE, model.comm);
  ByLabel map;
  for (size_t k = 0; k < all.size(); k += width + 1) {
    const bool fresh = map.emplace((PetscInt)all[k], Array(all.begin() + k + 1, all.begin() + k + 1 + width)).second;
    EXPECT_TRUE(fresh) << "node " << all[k] << " has two owners";
  }
  return map;
}

ByLabel byLabel(const FeModel &model, Vec v)
{
  const PetscScalar *a;
  must(VecGetArrayRead(v, &a));
  ByLabel map = byLabel(model, a, 3);
  must(VecRestoreArrayRead(v, &a));
  return map;
}

void expectSame(const ByLabel &a, const ByLabel &b, double tolerance)
{
  ASSERT_EQ(a.size(), b.size());
  double worst = 0, largest = 0;
  for (const auto &x : a) {
    const auto y = b.find(x.first);
    ASSERT_NE(y, b.end()) << x.first;
    for (size_t d = 0; d < x.second.size(); d++) {
      widen(worst, std::abs(x.second[d] - y->second[d]));
      largest = std::max(largest, std::abs(x.second[d]));
    }
  }
  EXPECT_GT(largest, 0);
  EXPECT_LE(worst, tolerance * largest);
}

/* Membership of a set, by label */
ByLabel members(const FeModel &model, const std::string &name)
{
  Array in(model.own + 1, 0);
  for (PetscInt n : model.sets.at(name)) {
    EXPECT_GE(n, model.first);
    EXPECT_LT(n, model.first + model.own);
    in[n - model.first] = 1;
  }
  EXPECT_TRUE(std::is_sorted(model.sets.at(name).begin(), model.sets.at(name).end()));
  return byLabel(model, in.data(), 1);
}

ByLabel stressOf(const FeModel &model)
{
  ReducedBody body;
  body.modal.omega = Eigen::VectorXd::Ones(18); /* more modes than are processed together */
  body.shape.resize(3 * model.own, 18);
  for (int k = 0; k < 18; k++)
    for (PetscInt n = 0; n < model.own; n++)
      body.shape.block<3, 1>(3 * n, k) =
          wave((1 + .1 * k) * Vector3(Eigen::Map<const Vector3>(&model.coordinates[3 * n])));
  must(AddStressModes(model, &body));
  EXPECT_EQ((PetscInt)body.stress.node.size(), model.own);
  const Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor> rows = body.stress.values;
  return byLabel(model, rows.data(), 6 * 18);
}

void compare(const FeModel &all, const FeModel &alone)
{
  PetscMPIInt size;
  MPI_Comm_size(all.comm, &size);
  EXPECT_EQ(all.nodes, alone.nodes);
  expectSame(byLabel(all, all.coordinates.data(), 3), byLabel(alone, alone.coordinates.data(), 3), 0);
  ASSERT_EQ(all.sets.size(), alone.sets.size());
  for (const auto &s : alone.sets) expectSame(members(all, s.first), members(alone, s.first), 0);
  for (Mat FeModel::*A : {&FeModel::K, &FeModel::M}) {
    Vec x = fieldOf(all, wave), y = product(all.*A, x), x1 = fieldOf(alone, wave), y1 = product(alone.*A, x1);
    expectSame(byLabel(all, y), byLabel(alone, y1), 1e-13);
    PetscReal norm, norm1;
    must(MatNorm(all.*A, NORM_FROBENIUS, &norm));
    must(MatNorm(alone.*A, NORM_FROBENIUS, &norm1));
    EXPECT_NEAR(norm, norm1, 1e-12 * norm1);
    MatInfo info;
    must(MatGetInfo(all.*A, MAT_GLOBAL_MAX, &info));
    EXPECT_EQ(info.mallocs, 0);
    EXPECT_EQ(info.nz_allocated, info.nz_used);
    for (Vec *v : {&x, &y, &x1, &y1}) must(VecDestroy(v));
  }
  long elements = (long)all.elements.size();
  MPI_Allreduce(MPI_IN_PLACE, &elements, 1, MPI_LONG, MPI_SUM, all.comm);
  EXPECT_EQ(elements, (long)alone.elements.size());
  expectSame(stressOf(all), stressOf(alone), 1e-12);
}

class FeMeshParallel : public testing::TestWithParam<ElementType>
{
};
INSTANTIATE_TEST_SUITE_P(Types, FeMeshParallel, testing::ValuesIn(types));

} // namespace

TEST_P(FeMeshParallel, SameAsOnOneRank)
{
  MeshBox box{GetParam(), 6, 3, 3, 2, 1, 1, true, bent};
  for (bool four : {true, false}) {
    FeModel all(PETSC_COMM_WORLD), alone(PETSC_COMM_SELF);
    must(readBox(all, box, two, four));
    must(readBox(alone, box, two, four));
    compare(all, alone);
    /* each rank has its own part */
    PetscMPIInt size;
    MPI_Comm_size(PETSC_COMM_WORLD, &size);
    EXPECT_GT((double)all.elements.size(), .6 * (double)alone.elements.size() / size);
    EXPECT_LT((double)all.elements.size(), 1.6 * (double)alone.elements.size() / size);
  }
}

/* A partitioner chosen by the user is used */
TEST(FeMeshParallelOptions, OtherPartitioner)
{
  MeshBox     box{ElementType::Tetrahedron10, 6, 3, 3, 2, 1, 1, true, bent};
  FeModel all(PETSC_COMM_WORLD), alone(PETSC_COMM_SELF);
  {
    Options options("-petscpartitioner_type simple");
    must(readBox(all, box, two));
  }
  must(readBox(alone, box, two));
  compare(all, alone);
}

TEST(FeMeshParallelOptions, MetisIsAType)
{
  PetscPartitioner     partitioner;
  PetscPartitionerType type;
  must(hhtdae::RegisterMetisPartitioner());
  must(PetscPartitionerCreate(PETSC_COMM_WORLD, &partitioner));
  Options options("-petscpartitioner_type metis_hhtdae");
  must(PetscPartitionerSetFromOptions(partitioner));
  must(PetscPartitionerGetType(partitioner, &type));
  EXPECT_STREQ(type, "metis_hhtdae");
  must(PetscPartitionerDestroy(&partitioner));
}

/* A row of cells is partitioned: METIS gives each rank cells next to each other */
TEST(FeMeshParallelOptions, MetisCutsFewFaces)
{
  PetscMPIInt size, rank;
  MPI_Comm_size(PETSC_COMM_WORLD, &size);
  MPI_Comm_rank(PETSC_COMM_WORLD, &rank);
  const PetscInt        cells = 120, from = cells * rank / size, to = cells * (rank + 1) / size;
  std::vector<PetscInt> start{0}, adjacent, part;
  /* the order of the cells in the row differs from that of their numbers */
  const auto cellAt  = [&](PetscInt p) { return 7 * p % cells; };
  const auto placeOf = [&](PetscInt c) { return 103 * c % cells; }; /* 7 * 103 = 1 modulo 120 */
  for (PetscInt c = from; c < to; c++) {
    const PetscInt p = placeOf(c);
    if (p > 0) adjacent.push_back(cellAt(p - 1));
    if (p < cells - 1) adjacent.push_back(cellAt(p + 1));
    start.push_back((PetscInt)adjacent.size());
  }
  must(hhtdae::PartitionCells(PETSC_COMM_WORLD, start, adjacent, &part));
  std::vector<int> mine(cells, 0), all(cells, 0), count(size, 0);
  for (PetscInt c = from; c < to; c++) mine[placeOf(c)] = (int)part[c - from];
  MPI_Allreduce(mine.data(), all.data(), cells, MPI_INT, MPI_SUM, PETSC_COMM_WORLD);
  int cut = 0;
  for (PetscInt p = 0; p < cells; p++) {
    count[all[p]]++;
    if (p && all[p] != all[p - 1]) cut++;
  }
  EXPECT_LE(cut, size); /* size - 1 is optimal */
  for (int r = 0; r < size; r++) EXPECT_NEAR(count[r], cells / size, .1 * cells / size);
}

/* Fewer elements than ranks */
TEST(FeMeshParallelOptions, OneElement)
{
  for (ElementType type : types) {
    MeshBox box{type, 1, 1, 1};
    if (!box.bricks()) box.nx = 1;
    FeModel all(PETSC_COMM_WORLD), alone(PETSC_COMM_SELF);
    must(readBox(all, box));
    must(readBox(alone, box));
    compare(all, alone);
  }
}

TEST(FeMeshParallelErrors, ComeToAllRanks)
{
  const std::string text = MeshWriter(MeshBox{ElementType::Tetrahedron4, 3, 3, 3}).text(true);
  const auto refused     = [&](std::string t, const std::string &from, const std::string &to, const std::string &says) {
    const size_t at = t.rfind(from);
    ASSERT_NE(at, std::string::npos);
    t.replace(at, from.size(), to);
    FeModel   model(PETSC_COMM_WORLD);
    ErrorTrap trap;
    EXPECT_NE(readText(model, t), 0);
    PetscMPIInt rank;
    MPI_Comm_rank(PETSC_COMM_WORLD, &rank);
    /* PETSc gives the text of a collective error to the first rank only */
    EXPECT_TRUE(rank || trap.says(says)) << trap.message;
    /* all ranks get here */
    int one = 1, sum, size;
    MPI_Comm_size(PETSC_COMM_WORLD, &size);
    MPI_Allreduce(&one, &sum, 1, MPI_INT, MPI_SUM, PETSC_COMM_WORLD);
    EXPECT_EQ(sum, size);
  };
  refused(text, " 329 \n", " 4711 \n", "node 4711"); /* among the last rank's elements */
  refused(text, "\n181 ", "\n181 x ", "integer is expected");
  refused(text, "\n181 ", "\n181 1 ", "more numbers");
  refused(text, "$EndElements", "$EndElement", "$EndElements");
  FeModel   model(PETSC_COMM_WORLD);
  ErrorTrap trap;
  EXPECT_NE(model.readMesh("/nowhere.msh", two), 0);
}
