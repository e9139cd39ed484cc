/*
  A job of CalculiX is the same model on any number of ranks, and reduces to the same body; what is wrong with its files
  is said on all ranks. The job is written here, with labels that have gaps and rows in an order of their own, as ccx
  would write it of a sparse deck; where ccx is installed, its own files are read too.
*/
#include "box_model.h"
#include "hhtdae/flexible.h"
#include "support.h"
#include <cstdlib>
#include <fstream>
#include <iomanip>
#include <sstream>
#include <unistd.h>

using namespace hhtest;
using namespace hhtdae;

namespace
{

int rankOf(MPI_Comm comm)
{
  int rank;
  MPI_Comm_rank(comm, &rank);
  return rank;
}

/* A folder known to all ranks, with files written by rank 0 */
class Job
{
public:
  std::string stem;

  Job()
  {
    char name[512] = "";
    if (!rankOf(PETSC_COMM_WORLD)) {
      std::snprintf(name, sizeof name, "%shhtccx%d", testing::TempDir().c_str(), (int)getpid());
      EXPECT_EQ(std::system((std::string("rm -rf ") + name + " && mkdir " + name).c_str()), 0);
    }
    MPI_Bcast(name, sizeof name, MPI_CHAR, 0, PETSC_COMM_WORLD);
    folder_ = name;
    stem    = folder_ + "/box";
  }
  ~Job()
  {
    MPI_Barrier(PETSC_COMM_WORLD);
    if (!rankOf(PETSC_COMM_WORLD)) {
      EXPECT_EQ(std::system(("rm -rf " + folder_).c_str()), 0);
    }
  }
  Job(const Job &) = delete;

  /* Collective: the other ranks read after rank 0 has written */
  void write(const std::string &end, const std::string &text) const
  {
    MPI_Barrier(PETSC_COMM_WORLD);
    if (!rankOf(PETSC_COMM_WORLD)) std::ofstream(stem + end, std::ios::binary) << text;
    MPI_Barrier(PETSC_COMM_WORLD);
  }
  std::string read(const std::string &end) const
  {
    std::ifstream     in(stem + end, std::ios::binary);
    std::stringstream all;
    all << in.rdbuf();
    return all.str();
  }
  /* Rank 0 runs ccx; false on all ranks if it is not installed */
  bool ccx() const
  {
    int good = 1;
    MPI_Barrier(PETSC_COMM_WORLD);
    if (!rankOf(PETSC_COMM_WORLD)) {
      good = std::system("command -v ccx > /dev/null 2>&1") == 0;
      if (good) {
        EXPECT_EQ(std::system(("cd " + folder_ + " && ccx box > box.out 2>&1").c_str()), 0);
      }
    }
    MPI_Bcast(&good, 1, MPI_INT, 0, PETSC_COMM_WORLD);
    return good != 0;
  }

private:
  std::string folder_;
};

struct Made {
  FeModel    model;
  BoxBuilder builder;
  explicit Made(const Box &box) : model(PETSC_COMM_SELF), builder(box, &model) {}
};

Box bar()
{
  Box box = {{6, 2, 2}, {0.4, 0.08, 0.08}};
  box.map = [](Vector3 x) { return Vector3(x[0], x[1] * (1 - x[0]) + 0.3 * x[0] * x[0], x[2] * (1 + 0.4 * x[0])); };
  return box;
}

PetscInt labelOf(PetscInt node) { return 7 * node + 3; }

std::string deckOf(const FeModel &model)
{
  std::ostringstream deck;
  deck << "*HEADING\nbar\n*NODE, NSET=Nall\n" << std::setprecision(17);
  for (PetscInt n = model.nodes; n-- > 0;) { /* in any order */
    deck << labelOf(n);
    for (std::size_t c = 0; c < 3; c++) deck << ", " << model.coordinates[3 * (std::size_t)n + c];
    deck << "\n";
  }
  deck << "*ELEMENT, TYPE=C3D8, ELSET=Eall\n";
  for (std::size_t e = 0; e < model.elements.size(); e++) {
    deck << e + 1;
    for (int k = 0; k < 8; k++) deck << ", " << labelOf(model.elements[e].node[k]);
    deck << "\n";
  }
  for (const auto &set : model.sets) {
    deck << "*NSET, NSET=" << set.first << "\n";
    for (PetscInt n : set.second) deck << labelOf(n) << ",\n";
  }
  deck << "*MATERIAL, NAME=Steel\n*ELASTIC\n" << model.materials[0].young << ", " << model.materials[0].poisson;
  deck << "\n*DENSITY\n" << model.materials[0].density << "\n*SOLID SECTION, ELSET=Eall, MATERIAL=Steel\n";
  deck << "*STEP\n*FREQUENCY, SOLVER=MATRIXSTORAGE\n*END STEP\n";
  return deck.str();
}

/* Row 3 n + c of the model is row `stored` of the files: nodes in reverse order, so that rows must be renumbered */
PetscInt stored(const FeModel &model, PetscInt row) { return 3 * (model.nodes - 1 - row / 3) + row % 3; }

std::string unknownsOf(const FeModel &model)
{
  std::ostringstream dof;
  for (PetscInt n = model.nodes; n-- > 0;)
    for (int c = 1; c <= 3; c++) dof << labelOf(n) << "." << c << "\n";
  return dof.str();
}

/* The upper triangle by columns */
std::string matrixOf(const FeModel &model, Mat A)
{
  std::ostringstream out;
  out << std::setprecision(17);
  for (PetscInt j = 0; j < 3 * model.nodes; j++) {
    const PetscInt                column = stored(model, j); /* the map is its own inverse */
    PetscInt                      count;
    const PetscInt               *with;
    const PetscScalar            *value;
    std::map<PetscInt, PetscReal> upper;
    must(MatGetRow(A, column, &count, &with, &value));
    for (PetscInt k = 0; k < count; k++)
      if (stored(model, with[k]) <= j) upper[stored(model, with[k])] = value[k];
    must(MatRestoreRow(A, column, &count, &with, &value));
    for (const auto &entry : upper) out << entry.first + 1 << " " << j + 1 << " " << entry.second << "\n";
  }
  return out.str();
}

void writeJob(const Job &job, const FeModel &model)
{
  job.write(".inp", deckOf(model));
  job.write(".dof", unknownsOf(model));
  job.write(".sti", matrixOf(model, model.K));
  job.write(".mas", matrixOf(model, model.M));
}

/* This rank's rows of A equal those of B, which one rank has alone, to the last bit */
void expectRows(const FeModel &all, Mat A, const FeModel &alone, Mat B)
{
  PetscInt begin, end, different = 0;
  must(MatGetOwnershipRange(A, &begin, &end));
  EXPECT_EQ(begin, 3 * all.first);
  EXPECT_EQ(end, 3 * (all.first + all.own));
  ASSERT_EQ(all.nodes, alone.nodes);
  for (PetscInt row = begin; row < end; row++) {
    PetscInt                      count;
    const PetscInt               *with;
    const PetscScalar            *value;
    std::map<PetscInt, PetscReal> a, b;
    must(MatGetRow(A, row, &count, &with, &value));
    for (PetscInt k = 0; k < count; k++) a[with[k]] = value[k];
    must(MatRestoreRow(A, row, &count, &with, &value));
    must(MatGetRow(B, row, &count, &with, &value));
    for (PetscInt k = 0; k < count; k++) b[with[k]] = value[k];
    must(MatRestoreRow(B, row, &count, &with, &value));
    different += a != b;
  }
  EXPECT_EQ(different, 0) << "rows of " << end - begin;
}

void expectSameModel(const FeModel &all, const FeModel &alone)
{
  int size, rank = rankOf(all.comm);
  MPI_Comm_size(all.comm, &size);
  ASSERT_EQ(all.nodes, alone.nodes);
  ASSERT_EQ(alone.own, alone.nodes);
  /* contiguous ranges whose sizes differ by at most one node */
  EXPECT_GE(all.own, all.nodes / size);
  EXPECT_LE(all.own, all.nodes / size + 1);
  PetscInt before = 0;
  MPI_Exscan(&all.own, &before, 1, MPIU_INT, MPI_SUM, all.comm);
  EXPECT_EQ(all.first, rank ? before : 0);
  ASSERT_EQ((PetscInt)all.label.size(), all.own);
  ASSERT_EQ((PetscInt)all.coordinates.size(), 3 * all.own);
  EXPECT_TRUE(std::equal(all.label.begin(), all.label.end(), alone.label.begin() + all.first));
  EXPECT_TRUE(std::equal(all.coordinates.begin(), all.coordinates.end(), alone.coordinates.begin() + 3 * all.first));
  ASSERT_EQ(all.sets.size(), alone.sets.size());
  for (const auto &set : alone.sets) {
    std::vector<PetscInt> own;
    for (PetscInt n : set.second)
      if (n >= all.first && n < all.first + all.own) own.push_back(n);
    ASSERT_EQ(all.sets.count(set.first), 1u) << set.first;
    EXPECT_EQ(all.sets.at(set.first), own) << set.first;
  }
  ASSERT_EQ(all.materials.size(), alone.materials.size());
  EXPECT_EQ(all.materials[0].young, alone.materials[0].young);
  /* each element once, on the rank of its first node */
  long elements = (long)all.elements.size();
  MPI_Allreduce(MPI_IN_PLACE, &elements, 1, MPI_LONG, MPI_SUM, all.comm);
  EXPECT_EQ(elements, (long)alone.elements.size());
  for (const FeElement &e : all.elements) {
    EXPECT_GE(e.node[0], all.first);
    EXPECT_LT(e.node[0], all.first + all.own);
  }
  expectRows(all, all.K, alone, alone.K);
  expectRows(all, all.M, alone, alone.M);
}

Reduction reductionOf()
{
  Reduction r;
  r.attachments.resize(2);
  r.attachments[0].name = "left";
  r.attachments[1].name = "right";
  r.attachments[1].tie  = Tie::Average;
  r.modes               = 6;
  return r;
}

double frequencyOff(const ReducedBody &a, const ReducedBody &b)
{
  EXPECT_EQ(a.modal.modes(), b.modal.modes());
  EXPECT_GT(a.modal.modes(), 6);
  if (a.modal.modes() != b.modal.modes()) return 1;
  return (a.modal.omega - b.modal.omega).cwiseQuotient(b.modal.omega).cwiseAbs().maxCoeff();
}

/* Largest difference of this rank's rows from those of one rank, over all ranks and relative to the largest row */
double rowsOff(MPI_Comm comm, const Eigen::MatrixXd &own, const Eigen::MatrixXd &whole, Eigen::Index first)
{
  double worst = own.size() ? (own - whole.middleRows(first, own.rows())).cwiseAbs().maxCoeff() : 0;
  MPI_Allreduce(MPI_IN_PLACE, &worst, 1, MPI_DOUBLE, MPI_MAX, comm);
  return worst / whole.cwiseAbs().maxCoeff();
}

/* Reads and reduces the model on all ranks together and on each rank alone */
void compare(const std::string &stem, ReducedBody *body)
{
  FeModel all(PETSC_COMM_WORLD), alone(PETSC_COMM_SELF);
  must(all.readCalculix(stem));
  must(alone.readCalculix(stem));
  expectSameModel(all, alone);
  ReducedBody a;
  must(Reduce(all, reductionOf(), &a));
  must(Reduce(alone, reductionOf(), body));
  must(AddStressModes(all, &a));
  must(AddStressModes(alone, body));
  ASSERT_EQ((PetscInt)a.stress.node.size(), all.own);
  ASSERT_EQ((PetscInt)body->stress.node.size(), alone.nodes);
  int size;
  MPI_Comm_size(PETSC_COMM_WORLD, &size);
  const double omega = frequencyOff(a, *body), shape = rowsOff(a.comm, a.shape, body->shape, 3 * a.first),
               stress = rowsOff(a.comm, a.stress.values, body->stress.values, 6 * a.first);
  if (!rankOf(PETSC_COMM_WORLD))
    MEASURED("%d ranks, %d modes: omega %.1e, shape %.1e, stress %.1e", size, (int)a.modal.modes(), omega, shape,
             stress);
  EXPECT_LT(omega, 1e-10);
  EXPECT_LT(shape, 1e-6);
  EXPECT_LT(stress, 1e-6);
}

/* The error message, which must be the same on every rank */
std::string refused(const std::string &stem)
{
  FeModel   model(PETSC_COMM_WORLD);
  ErrorTrap trap;
  const int code     = (int)model.readCalculix(stem);
  int       codes[2] = {code, -code}, size;
  EXPECT_NE(code, 0);
  /* all ranks get here, with the same error */
  MPI_Allreduce(MPI_IN_PLACE, codes, 2, MPI_INT, MPI_MAX, PETSC_COMM_WORLD);
  EXPECT_EQ(codes[0], -codes[1]);
  MPI_Comm_size(PETSC_COMM_WORLD, &size);
  char text[512] = "";
  std::snprintf(text, sizeof text, "%s", trap.message.c_str());
  MPI_Bcast(text, sizeof text, MPI_CHAR, 0, PETSC_COMM_WORLD);
  EXPECT_EQ(trap.message.substr(0, sizeof text - 1), text);
  return text;
}

#define EXPECT_SAYS(message, part) EXPECT_NE((message).find(part), std::string::npos) << (message)

} // namespace

TEST(CalculixRanks, SameAsOnOneRank)
{
  Job         job;
  Made        made(bar());
  ReducedBody read, direct;
  writeJob(job, made.model);
  compare(job.stem, &read);
  /* the files have all digits, so that the model is the one that was written */
  must(Reduce(made.model, reductionOf(), &direct));
  EXPECT_LT(frequencyOff(read, direct), 1e-10);
}

TEST(CalculixRanks, FilesOfCcx)
{
  Job         job;
  Made        made(bar());
  ReducedBody read, direct;
  job.write(".inp", deckOf(made.model));
  if (!job.ccx()) GTEST_SKIP() << "ccx is not installed";
  FeModel all(PETSC_COMM_WORLD), alone(PETSC_COMM_SELF);
  must(all.readCalculix(job.stem));
  must(alone.readCalculix(job.stem));
  expectSameModel(all, alone); /* what reduces to the same, as the job above shows */
  must(Reduce(alone, reductionOf(), &read));
  must(Reduce(made.model, reductionOf(), &direct));
  const double off = frequencyOff(read, direct);
  if (!rankOf(PETSC_COMM_WORLD)) MEASURED("frequencies of ccx' matrices against ours %.1e", off);
  EXPECT_LT(off, 1e-6); /* 14 digits */
}

/* Some ranks have no node */
TEST(CalculixRanks, FewNodes)
{
  Job  job;
  Box  one = {{1, 1, 1}, {1, 1, 1}};
  Made made(one);
  writeJob(job, made.model);
  FeModel all(PETSC_COMM_WORLD), alone(PETSC_COMM_SELF);
  must(all.readCalculix(job.stem));
  must(alone.readCalculix(job.stem));
  expectSameModel(all, alone);
}

TEST(CalculixRanks, ErrorsOnAllRanks)
{
  Job  job;
  Made made(bar());
  writeJob(job, made.model);
  const std::string deck = job.read(".inp"), dof = job.read(".dof"), sti = job.read(".sti"), mas = job.read(".mas");
  const auto        damaged = [&](const std::string &end, const std::string &text, const std::string &good) {
    job.write(end, text);
    const std::string message = refused(job.stem);
    job.write(end, good);
    return message;
  };
  EXPECT_SAYS(damaged(".inp", "*NODE\n1, 2, abc\n" + deck, deck), "box.inp, line 2");
  EXPECT_SAYS(damaged(".inp", "*INCLUDE, INPUT=box.inp\n" + deck, deck), "included more than 16 times");
  EXPECT_SAYS(damaged(".inp", deck + "*NSET, NSET=a\nnowhere\n", deck), "names the set nowhere");
  const std::size_t end_of_node = dof.find(".3\n", dof.size() / 2);
  EXPECT_SAYS(damaged(".dof", dof.substr(0, end_of_node + 3), dof), "of an element has no unknowns");
  EXPECT_SAYS(damaged(".dof", dof.substr(0, dof.rfind('\n', end_of_node) + 1), dof), "has no unknown in direction");
  EXPECT_SAYS(damaged(".dof", dof.substr(0, end_of_node + 1), dof), "is not \"node.direction\"");
  EXPECT_SAYS(damaged(".dof", "", dof), "has no unknowns");
  /* errors that only one rank sees: at the end, at the beginning, in the middle of the file */
  EXPECT_SAYS(damaged(".sti", sti + "1 2 nan\n", sti), "not a finite number");
  EXPECT_SAYS(damaged(".sti", "1 1 hello\n" + sti, sti), "is not \"row column value\"");
  const std::size_t middle = mas.find('\n', mas.size() / 2) + 1;
  EXPECT_SAYS(damaged(".mas", mas.substr(0, middle) + "1000 1000 1\n" + mas.substr(middle), mas), "is not among 1 ..");
  EXPECT_SAYS(damaged(".mas", mas.substr(0, middle), mas), "truncated");
  EXPECT_SAYS(damaged(".mas", mas.substr(0, mas.size() - 3), mas), "box.mas ends within a line");
  EXPECT_SAYS(damaged(".mas", "", mas), "box.mas: it is empty");
  EXPECT_SAYS(refused(job.stem + "none"), "there is no such file");
  /* with the right files everything works again */
  FeModel model(PETSC_COMM_WORLD);
  must(model.readCalculix(job.stem));
  EXPECT_EQ(model.nodes, made.model.nodes);
}
