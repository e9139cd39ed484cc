/* What readers of finite-element models refuse, and how they handle small files that request much memory or time;
   tests/fuzz has further cases */
#include "fe_import_cases.h"
#include "hhtdae/flexible.h"
#include "reduced_body.h"
#include <cstring>
#include <ctime>

using namespace hhtest;

namespace
{

const char *const six_by_six = "1 1 4\n2 2 4\n3 3 4\n4 4 4\n5 5 4\n6 6 4\n4 1 -1\n";

/* The first coordinate of a list of nodes, or "refused" */
std::string Coordinate(const Folder &folder, const std::string &word)
{
  FeModel   model(PETSC_COMM_SELF);
  ErrorTrap trap;
  const std::string k = folder.write("k", six_by_six), nodes = folder.write("nodes", "1 " + word + " 0 0\n2 1 1 1\n");
  if (model.readMatrices(k, k, nodes, "")) {
    EXPECT_SAYS(trap.message, nodes + ", line 1");
    return "refused";
  }
  return text("%.17g", model.coordinates[0]);
}

std::string RefusedMesh(const std::string &text)
{
  FeModel   model(PETSC_COMM_SELF);
  ErrorTrap trap;
  EXPECT_NE(readText(model, text), 0);
  return trap.message;
}

std::string Replaced(std::string text, const std::string &what, const std::string &by)
{
  const std::size_t at = text.find(what);
  EXPECT_NE(at, std::string::npos) << what;
  return at == std::string::npos ? text : text.replace(at, what.size(), by);
}

std::string BoxMesh(bool four)
{
  MeshBox box;
  box.nx = box.ny = box.nz = 1;
  return MeshWriter(box).text(four);
}

/* Files of two tetrahedra with some matrix entries, and additions to the deck */
struct Job {
  Folder folder;

  std::string deck(const std::string &more) const
  {
    return "*NODE, NSET=all\n11,0,0,0\n12,1,0,0\n13,0,1,0\n14,0,0,1\n15,1,1,1\n*ELEMENT, TYPE=C3D4, "
           "ELSET=e\n1,11,12,13,14\n2,12,13,14,15\n*MATERIAL,NAME=S\n*ELASTIC\n1000.,0.3\n*SOLID "
           "SECTION,ELSET=e,MATERIAL=S\n" +
           more;
  }
  PetscErrorCode read(FeModel *model, const std::string &whole_deck) const
  {
    std::string dof, matrix;
    for (int row = 1; row <= 15; row++) {
      dof += text("%d.%d\n", 11 + (row - 1) / 3, 1 + (row - 1) % 3);
      matrix += text("%d %d 4.0\n", row, row);
    }
    folder.write("job.inp", whole_deck);
    folder.write("job.dof", dof);
    folder.write("job.sti", matrix);
    folder.write("job.mas", matrix);
    return model->readCalculix(folder.name + "/job");
  }
  std::string refused(const std::string &whole_deck) const
  {
    FeModel       model(PETSC_COMM_SELF);
    ErrorTrap     trap;
    const clock_t begin = clock();
    EXPECT_NE(read(&model, whole_deck), 0);
    EXPECT_LT((double)(clock() - begin) / CLOCKS_PER_SEC, 2);
    EXPECT_SAYS(trap.message, folder.name);
    return trap.message;
  }
};

/* A PETSc binary file of three rows with two entries each */
struct Binary {
  int    head[4]   = {1211216, 6, 6, 12};
  int    length[6] = {2, 2, 2, 2, 2, 2};
  int    column[12] = {0, 1, 0, 1, 2, 3, 2, 3, 4, 5, 4, 5};
  double value[12] = {4, 1, 1, 4, 4, 1, 1, 4, 4, 1, 1, 4};

  std::string bytes() const
  {
    std::string all;
    const auto  add = [&](const void *from, std::size_t size, std::size_t count) {
      for (std::size_t k = 0; k < count; k++)
        for (std::size_t b = size; b-- > 0;) all += static_cast<const char *>(from)[k * size + b];
    };
    add(head, 4, 4);
    add(length, 4, 6);
    add(column, 4, 12);
    add(value, 8, 12);
    return all;
  }
};

std::string ReadBinary(const Folder &folder, const Binary &b)
{
  FeModel           model(PETSC_COMM_SELF);
  ErrorTrap         trap;
  const std::string file = folder.write("k.bin", b.bytes());
  if (!model.readMatrices(file, file, "", "")) return "taken";
  EXPECT_SAYS(trap.message, file);
  return trap.message;
}

} // namespace

TEST(Damage, Numbers)
{
  Folder folder;
  EXPECT_EQ(Coordinate(folder, "0.05"), text("%.17g", 0.05));
  EXPECT_EQ(Coordinate(folder, "5.0D-2"), text("%.17g", 5.0e-2));
  EXPECT_EQ(Coordinate(folder, "5d1"), "50");
  EXPECT_EQ(Coordinate(folder, "+.5E+1"), "5");
  EXPECT_EQ(Coordinate(folder, "-3."), "-3");
  EXPECT_EQ(Coordinate(folder, "1e-400"), "0");
  EXPECT_EQ(Coordinate(folder, "4.9e-324"), text("%.17g", 4.9406564584124654e-324));
  for (const char *word : {"1e400", "-1e400", "1D400", "0.05abc", "5.0D-2x", "nan", "inf", "0x10", "0x1p3", "1e", "1..2", "--1",
                           "+-1", "1e5e5", "1D2D3", ".", "-", "e5", "1_0", "infD2"})
    EXPECT_EQ(Coordinate(folder, word), "refused") << word;
}

TEST(Damage, NumbersOfMeshes)
{
  for (bool four : {true, false}) {
    FeModel           model(PETSC_COMM_SELF);
    const std::string good = BoxMesh(four);
    for (const char *word : {"1e400", "0.05abc", "nan", "0x1"})
      EXPECT_SAYS(RefusedMesh(Replaced(good, "9 9 9", std::string("9 9 ") + word)), "a finite number is expected");
    EXPECT_SAYS(RefusedMesh(Replaced(good, "9 9 9", "9 9")), "a finite number is expected");
    EXPECT_SAYS(RefusedMesh(Replaced(good, "9 9 9", "9 9 9 9")), "more numbers");
    must(readText(model, Replaced(good, "9 9 9", "9 9 9.0D-2")));
  }
}

/* Group numbers in Gmsh have 32 bits */
TEST(Damage, LargePhysicalTags)
{
  const std::string tag = "1073741825", other = "2147483647"; /* 2^30 + 1, 2^31 - 1 */
  std::string       mesh = Replaced(BoxMesh(false), "2 1 \"left\"", "2 " + tag + " \"left\"");
  mesh                   = Replaced(mesh, "2 2 \"right\"", "2 " + other + " \"right\"");
  FeModel straight(PETSC_COMM_SELF), large(PETSC_COMM_SELF);
  must(readText(straight, BoxMesh(false)));
  mesh = Replaced(mesh, " 3 2 1 7 ", " 3 2 " + tag + " 7 ");
  mesh = Replaced(mesh, " 3 2 2 8 ", " 3 2 " + other + " 8 ");
  must(readText(large, mesh));
  EXPECT_EQ(large.sets, straight.sets);
  EXPECT_EQ(large.sets["left"].size(), 4u);
  EXPECT_SAYS(RefusedMesh(Replaced(mesh, " 3 2 " + other, " 3 2 -2147483648")), "32 bits");
  FeModel tags(PETSC_COMM_SELF); /* tags of nodes */
  must(readText(tags, Replaced(BoxMesh(false), "1000000 9", "2147483647 9")));
}

/* Several elements on one face are detected before all pairs of them are listed */
TEST(Damage, ManyElementsOnOneFace)
{
  std::string       mesh = BoxMesh(true), copies;
  const std::size_t from = mesh.rfind('\n', mesh.find("$EndElements") - 2) + 1;
  const std::string one  = mesh.substr(from, mesh.find('\n', from) + 1 - from);
  for (int k = 0; k < 20000; k++) copies += std::to_string(100 + k) + one.substr(one.find(' '));
  mesh.insert(from, copies);
  mesh = Replaced(mesh, "3 5 5 1\n", "3 5 5 20001\n");
  EXPECT_SAYS(RefusedMesh(mesh), "share one face");
}

TEST(Damage, GeneratedSets)
{
  Job     job;
  FeModel model(PETSC_COMM_SELF);
  must(job.read(&model, job.deck("*NSET, NSET=huge, GENERATE\n0, 2147483647\n12, 2000000000, 2\n*ELSET, ELSET=many, GENERATE\n2, 2000000000\n"
                                 "*NSET, NSET=odd, GENERATE\n11, 15, 2\n*NSET, NSET=both\nodd, 14\n")));
  EXPECT_EQ(model.sets["huge"], (std::vector<PetscInt>{0, 1, 2, 3, 4}));
  EXPECT_EQ(model.sets["many"], (std::vector<PetscInt>{1, 2, 3, 4}));
  EXPECT_EQ(model.sets["odd"], (std::vector<PetscInt>{0, 2, 4}));
  EXPECT_EQ(model.sets["both"], (std::vector<PetscInt>{0, 2, 3, 4}));
  EXPECT_EQ(model.sets["all"], (std::vector<PetscInt>{0, 1, 2, 3, 4}));
}

TEST(Damage, SetsOfSetsThatDouble)
{
  std::string more = "*NSET, NSET=s0\n11, 13\n";
  for (int k = 1; k < 60; k++) more += text("*NSET, NSET=s%d\ns%d, s%d\n", k, k - 1, k - 1);
  Job job;
  EXPECT_SAYS(job.refused(job.deck(more)), "more members than a deck of this length can mean");
}

TEST(Damage, FansOfFiles)
{
  Job job;
  for (int f = 0; f < 15; f++) {
    std::string lines;
    for (int k = 0; k < 12; k++) lines += text("*INCLUDE, INPUT=f%d.inc\n", f + 1);
    job.folder.write(text("f%d.inc", f), lines);
  }
  job.folder.write("f15.inc", "*NSET, NSET=a\n11\n");
  EXPECT_SAYS(job.refused(job.deck("*INCLUDE, INPUT=f0.inc\n")), "included more than 16 times");
  EXPECT_SAYS(job.refused("*INCLUDE, INPUT=job.inp\n"), "included more than 16 times");
  EXPECT_SAYS(job.refused(job.deck("*INCLUDE, INPUT=/dev/zero\n")), "it is not a file");
  EXPECT_SAYS(job.refused(job.deck("*INCLUDE, INPUT=.\n")), "it is not a file");
}

TEST(Damage, DeckWithoutMeaning)
{
  Job               job;
  const std::string deck = job.deck("");
  EXPECT_SAYS(job.refused(Replaced(deck, "12,1,0,0", "12,1e400,0,0")), "line 3");
  EXPECT_SAYS(job.refused(Replaced(deck, "12,1,0,0", "12,0x1,0,0")), "line 3");
  EXPECT_SAYS(job.refused(Replaced(deck, "1000.,0.3", "-1000.,0.3")), "modulus of elasticity that is not positive");
  EXPECT_SAYS(job.refused(Replaced(deck, "1000.,0.3", "1000.,0.5")), "Poisson's ratio");
  EXPECT_SAYS(job.refused(job.deck("*DENSITY\n-1\n")), "negative density");
  EXPECT_SAYS(job.refused(Replaced(deck, "2,12,13", "1,12,13")), "element 1 is there twice");
  std::string endless = "*NSET, NSET=a,\n";
  for (int k = 0; k < 200000; k++) endless += ",\n";
  FeModel model(PETSC_COMM_SELF);
  must(job.read(&model, job.deck(endless)));
}

TEST(Damage, PetscBinary)
{
  Folder folder;
  Binary good;
  EXPECT_EQ(ReadBinary(folder, good), "taken");
  for (int column : {6, 128, -1, 2147483647, -2147483647 - 1}) {
    Binary b     = good;
    b.column[11] = column;
    EXPECT_SAYS(ReadBinary(folder, b), "row 6 has an entry in column");
  }
  Binary b    = good;
  b.column[0] = 1, b.column[1] = 0;
  EXPECT_SAYS(ReadBinary(folder, b), "row 1 has columns that are not ascending");
  b           = good;
  b.length[2] = -2;
  EXPECT_SAYS(ReadBinary(folder, b), "row 3 has an impossible number of entries");
  b           = good;
  b.length[2] = 3;
  EXPECT_SAYS(ReadBinary(folder, b), "its rows have 13 entries, its head promises 12");
  b          = good;
  b.value[3] = 0. / 0.;
  EXPECT_SAYS(ReadBinary(folder, b), "row 2 has an entry that is not a finite number");
  b         = good;
  b.head[3] = 2147483647;
  EXPECT_SAYS(ReadBinary(folder, b), "truncated");
}

/* Duplicate entries are refused, because PETSc would add them */
TEST(Damage, EntriesGivenTwice)
{
  Folder folder;
  for (const char *line : {"1 1 4\n", "4 1 -1\n"}) {
    FeModel           model(PETSC_COMM_SELF);
    ErrorTrap         trap;
    const std::string k = folder.write("k", std::string(six_by_six) + line);
    EXPECT_NE(model.readMatrices(k, folder.write("m", six_by_six), "", ""), 0);
    EXPECT_SAYS(trap.message, "an entry stands in it twice");
  }
}

TEST(Damage, ImpossibleBodies)
{
  const auto refused = [](const std::function<void(ReducedBody &)> &change) {
    HandMade  made(PETSC_COMM_SELF);
    Scratch   file("impossible.h5");
    ErrorTrap trap;
    change(made.body);
    EXPECT_NE(made.body.save(file.name), 0);
    return trap.message;
  };
  EXPECT_SAYS(refused([](ReducedBody &b) { b.modal.mass = -1; }), "a mass of -1");
  EXPECT_SAYS(refused([](ReducedBody &b) { b.modal.mass = 0; }), "not positive");
  EXPECT_SAYS(refused([](ReducedBody &b) { b.modal.omega[2] = -100; }), "a frequency that is not positive, of mode 2");
  EXPECT_SAYS(refused([](ReducedBody &b) { b.modal.moments(0, 1) += 1e-3; }), "moments of inertia");
  EXPECT_SAYS(refused([](ReducedBody &b) { b.modal.moments *= -1; }), "moments of inertia");
  EXPECT_SAYS(refused([](ReducedBody &b) { b.modal.quadratic[1](0, 0) += 1; }), "not orthonormal");
  EXPECT_SAYS(refused([](ReducedBody &b) { b.modal.attachments[1].name = "hub"; }), "two attachments of the name hub");
  EXPECT_SAYS(refused([](ReducedBody &b) { b.mode[0].frequency = -1; }), "the frequency negative");
}
