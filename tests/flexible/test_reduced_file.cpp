/* The file of a reduced body: what was written is read back, and a faulty file is refused with a reason */
#include "hhtdae/flexible.h"
#include "reduced_body.h"
#include <limits>

using namespace hhtest;

/* declared here, because petscviewerhdf5.h includes HDF5's headers, which may not be installed for tests */
PETSC_EXTERN PetscErrorCode PetscViewerHDF5Open(MPI_Comm, const char[], PetscFileMode, PetscViewer *);
PETSC_EXTERN PetscErrorCode PetscViewerHDF5WriteAttribute(PetscViewer, const char[], const char[], PetscDataType,
                                                          const void *);
PETSC_EXTERN PetscErrorCode PetscViewerHDF5ReadAttribute(PetscViewer, const char[], const char[], PetscDataType,
                                                         const void *, void *);

namespace
{

/* The error message with which a file is refused */
std::string Refused(const std::string &file)
{
  ReducedBody body;
  body.source = "untouched";
  ErrorTrap trap;
  EXPECT_NE(body.load(PETSC_COMM_SELF, file), 0);
  EXPECT_EQ(body.source, "untouched");
  EXPECT_EQ(body.modal.modes(), 0);
  return trap.message;
}

std::string SaveRefused(const ReducedBody &body)
{
  Scratch   file("refused.h5");
  ErrorTrap trap;
  EXPECT_NE(body.save(file.name), 0);
  EXPECT_FALSE(file.exists());
  EXPECT_FALSE(std::ifstream(file.name + ".part").good());
  return trap.message;
}

#define EXPECT_SAYS(message, part) EXPECT_NE((message).find(part), std::string::npos) << message

} // namespace

TEST(ReducedFile, Roundtrip)
{
  HandMade    made(PETSC_COMM_SELF);
  Scratch     file("round.h5");
  ReducedBody read;
  ModalBody   modal;
  must(made.body.save(file.name));
  must(read.load(PETSC_COMM_SELF, file.name));
  EXPECT_TRUE(Same(made.body, read));
  EXPECT_TRUE(SameElements(made.body.elements, read.elements));
  must(LoadModalBody(PETSC_COMM_SELF, file.name, &modal));
  EXPECT_TRUE(Same(made.body.modal, modal));
  EXPECT_EQ(modal.attachment("tip of the row"), 1);
  EXPECT_FALSE(std::ifstream(file.name + ".part").good());
}

/* Stiffening matrices are complete and symmetric, or all absent */
TEST(ReducedFile, Stiffening)
{
  Scratch     file("stiffening.h5");
  ReducedBody read;
  {
    HandMade made(PETSC_COMM_SELF);
    for (auto &B : made.body.modal.stiffening) B.resize(0, 0);
    EXPECT_SAYS(SaveRefused(made.body), "stiffening of attachment hub");
    for (auto &a : made.body.modal.attachments)
      for (auto &B : a.stiffening) B.resize(0, 0);
    must(made.body.save(file.name));
    must(read.load(PETSC_COMM_SELF, file.name));
    EXPECT_TRUE(Same(made.body, read));
  }
  HandMade made(PETSC_COMM_SELF);
  made.body.modal.attachments[1].stiffening[4](0, 1) += 1e-3;
  EXPECT_SAYS(SaveRefused(made.body), "geometric stiffening that is not symmetric");
  made.body.modal.attachments[1].stiffening[4](1, 0) = NAN;
  EXPECT_SAYS(SaveRefused(made.body), "not finite: attachment tip of the row");
}

TEST(ReducedFile, WithoutNodesOrModes)
{
  HandMade bare(PETSC_COMM_SELF, 3, 2), stiff(PETSC_COMM_SELF, 3, 0);
  bare.body.own = 0;
  bare.body.coordinates.clear();
  bare.body.label.clear();
  bare.body.shape.resize(0, 0);
  bare.body.elements.clear();
  bare.body.stress = StressModes();
  for (auto &q : bare.body.modal.quadratic) q.resize(0, 0);
  stiff.body.modal.attachments.clear();
  for (ReducedBody *body : {&bare.body, &stiff.body}) {
    Scratch     file("less.h5");
    ReducedBody read;
    must(body->save(file.name));
    must(read.load(PETSC_COMM_SELF, file.name));
    EXPECT_TRUE(Same(body->modal, read.modal));
    EXPECT_EQ(read.own, body->own);
    EXPECT_EQ(read.elements.size(), body->elements.size());
    EXPECT_EQ(read.stress.node, body->stress.node);
  }
}

/* The same body gives the same bytes: the file contains no time stamps and does not depend on the order of hash tables */
TEST(ReducedFile, SameBytes)
{
  HandMade made(PETSC_COMM_SELF);
  Scratch  one("one.h5"), two("two.h5");
  must(made.body.save(one.name));
  must(made.body.save(two.name));
  EXPECT_GT(one.text().size(), 5000u);
  EXPECT_EQ(one.text(), two.text());
}

/* Any changed byte of the file is detected, unless no number depends on it */
TEST(ReducedFile, EveryByteCounts)
{
  HandMade made(PETSC_COMM_SELF, 2, 2);
  Scratch  file("whole.h5"), broken("broken.h5");
  must(made.body.save(file.name));
  const std::string whole   = file.text();
  int               refused = 0, same = 0;
  for (std::size_t at = 0; at < whole.size(); at += at < 2500 ? 3 : 11) {
    std::string text = whole;
    text[at]         = (char)(text[at] ^ (1 << at % 8));
    broken.write(text);
    ReducedBody read;
    ErrorTrap   trap;
    if (read.load(PETSC_COMM_SELF, broken.name)) {
      refused++;
      ASSERT_NE(trap.message.find(broken.name), std::string::npos) << trap.message;
    } else {
      same++;
      ASSERT_TRUE(Same(made.body, read) && SameElements(made.body.elements, read.elements)) << "byte " << at;
    }
  }
  MEASURED("of %d bytes: %d changes refused, %d without effect", (int)whole.size(), refused, same);
  EXPECT_GT(refused, 800);
}

TEST(ReducedFile, FlippedByteNamesTheDataset)
{
  HandMade made(PETSC_COMM_SELF);
  Scratch  file("flip.h5");
  must(made.body.save(file.name));
  std::string       text = file.text();
  const double      v    = made.body.shape(7, 2);
  const std::size_t at   = text.find(std::string((const char *)&v, sizeof v));
  ASSERT_NE(at, std::string::npos);
  text[at] = (char)(text[at] ^ 1);
  file.write(text);
  EXPECT_SAYS(Refused(file.name), "/nodes/shape is damaged: its checksum does not agree");
  ModalBody modal; /* a scene accepts only complete bodies */
  must(LoadModalBody(PETSC_COMM_SELF, file.name, &modal));
  EXPECT_TRUE(Same(made.body.modal, modal));
}

TEST(ReducedFile, Truncated)
{
  HandMade made(PETSC_COMM_SELF, 2, 2);
  Scratch  file("long.h5"), cut("cut.h5");
  must(made.body.save(file.name));
  const std::string whole = file.text();
  for (std::size_t length = 0; length < whole.size(); length += 97) {
    cut.write(whole.substr(0, length));
    EXPECT_SAYS(Refused(cut.name), cut.name);
  }
  cut.write(whole.substr(0, whole.size() - 1));
  EXPECT_SAYS(Refused(cut.name), "truncated");
}

/* Files of another format, and of a later version, made by HDF5 through PETSc */
TEST(ReducedFile, OtherFormatAndNewerVersion)
{
  HandMade    made(PETSC_COMM_SELF);
  Scratch     other("other.h5"), newer("newer.h5");
  PetscViewer viewer;
  int         version = 5;
  must(PetscViewerHDF5Open(PETSC_COMM_SELF, other.name.c_str(), FILE_MODE_WRITE, &viewer));
  must(PetscViewerHDF5WriteAttribute(viewer, "/", "version", PETSC_INT, &version));
  must(PetscViewerDestroy(&viewer));
  EXPECT_SAYS(Refused(other.name), "it is an HDF5 file, but not one of a reduced body");
  must(made.body.save(newer.name));
  must(PetscViewerHDF5Open(PETSC_COMM_SELF, newer.name.c_str(), FILE_MODE_UPDATE, &viewer));
  must(PetscViewerHDF5WriteAttribute(viewer, "/", "version", PETSC_INT, &version));
  must(PetscViewerDestroy(&viewer));
  EXPECT_SAYS(Refused(newer.name), "it has version 5 of the format, this program knows version 4");
}

/* Contribution of a number to the checksum, as described in src/flexible/file.h */
uint64_t VersionShare(uint64_t version)
{
  const auto mix = [](uint64_t x) {
    x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9ull;
    x = (x ^ (x >> 27)) * 0x94d049bb133111ebull;
    return x ^ (x >> 31);
  };
  uint64_t key = 0xcbf29ce484222325ull;
  for (unsigned char c : std::string("version")) key = (key ^ c) * 0x100000001b3ull;
  return mix(version ^ mix(key));
}

/* Turns a file into one of an older version with the same layout. PETSc has signed integers only: false if the new
   checksum cannot be represented */
bool MakeOlder(const std::string &file, int version)
{
  PetscViewer viewer;
  long        checksum;
  must(PetscViewerHDF5Open(PETSC_COMM_SELF, file.c_str(), FILE_MODE_UPDATE, &viewer));
  must(PetscViewerHDF5ReadAttribute(viewer, "/", "checksum", PETSC_LONG, nullptr, &checksum));
  const long of_one = (long)((uint64_t)checksum + VersionShare((uint64_t)version) - VersionShare(4));
  const bool fits   = checksum != std::numeric_limits<long>::max() && of_one >= 0;
  if (fits) {
    must(PetscViewerHDF5WriteAttribute(viewer, "/", "version", PETSC_INT, &version));
    must(PetscViewerHDF5WriteAttribute(viewer, "/", "checksum", PETSC_LONG, &of_one));
  }
  must(PetscViewerDestroy(&viewer));
  return fits;
}

/* Version 1 had residuals in another norm: they are read as unknown, everything else as before */
TEST(ReducedFile, VersionOne)
{
  HandMade made(PETSC_COMM_SELF);
  Scratch  old("old.h5"), again("again.h5");
  bool     fits = false;
  for (int attempt = 0; attempt < 3000 && !fits; attempt++) {
    made.body.source = std::to_string(attempt) + ", so that the checksum is another";
    must(made.body.save(old.name));
    fits = MakeOlder(old.name, 1);
  }
  ASSERT_TRUE(fits);
  ReducedBody body;
  must(body.load(PETSC_COMM_SELF, old.name));
  ASSERT_EQ(body.mode.size(), made.body.mode.size());
  for (std::size_t k = 0; k < body.mode.size(); k++) {
    EXPECT_EQ(body.mode[k].frequency, made.body.mode[k].frequency);
    EXPECT_EQ(body.mode[k].residual, -1);
  }
  EXPECT_EQ(body.modal.omega, made.body.modal.omega);
  must(body.save(again.name)); /* unknown residuals stay unknown in a new file */
  ReducedBody read;
  must(read.load(PETSC_COMM_SELF, again.name));
  EXPECT_EQ(read.mode[0].residual, -1);
}

/* Version 3 had neither kept nodes nor loads */
TEST(ReducedFile, VersionThree)
{
  HandMade made(PETSC_COMM_SELF);
  Scratch  old("three.h5");
  bool     fits = false;
  made.body.modal.nodes.clear();
  made.body.modal.loads.clear();
  for (int attempt = 0; attempt < 3000 && !fits; attempt++) {
    made.body.source = std::to_string(attempt) + ", so that the checksum is another";
    must(made.body.save(old.name));
    fits = MakeOlder(old.name, 3);
  }
  ASSERT_TRUE(fits);
  ReducedBody body;
  must(body.load(PETSC_COMM_SELF, old.name));
  EXPECT_TRUE(Same(made.body, body));
}

TEST(ReducedFile, KeptNodesAndLoadsThatCannotBe)
{
  const auto refused = [](const std::function<void(ModalBody &)> &damage) {
    HandMade made(PETSC_COMM_SELF);
    damage(made.body.modal);
    return SaveRefused(made.body);
  };
  EXPECT_SAYS(refused([](ModalBody &m) { std::swap(m.nodes[0], m.nodes[1]); }), "kept nodes whose numbers are not ascending");
  EXPECT_SAYS(refused([](ModalBody &m) { m.nodes[1].turns = false; }), "a rotation of kept node 1009, which is said to have none");
  EXPECT_SAYS(refused([](ModalBody &m) { m.nodes[1].translation(2, 1) = NAN; }), "not finite: kept node 1009");
  EXPECT_SAYS(refused([](ModalBody &m) { m.nodes[1].rotation.conservativeResize(3, 2); }), "modes of kept node 1009 are not as many as the body's");
  EXPECT_SAYS(refused([](ModalBody &m) { m.loads[1].name = "wind"; }), "two load cases of the name wind");
  EXPECT_SAYS(refused([](ModalBody &m) { m.loads[0].name.clear(); }), "a load case without a name");
  EXPECT_SAYS(refused([](ModalBody &m) { m.loads[1].modal_gradient(0, 1) = NAN; }), "not finite: load case pressure");
  EXPECT_SAYS(refused([](ModalBody &m) { m.loads[1].force_gradient.resize(3, 0); }), "load case pressure of another size than the modes");
}

TEST(ReducedFile, OtherFiles)
{
  Scratch text("text.h5");
  EXPECT_SAYS(Refused("/nowhere/body.h5"), "/nowhere/body.h5: there is no such file");
  EXPECT_SAYS(Refused(testing::TempDir()), "it is not a file");
  text.write("not a body\n");
  EXPECT_SAYS(Refused(text.name), "it is not an HDF5 file");
  text.write("");
  EXPECT_SAYS(Refused(text.name), "it is not an HDF5 file");
}

TEST(ReducedFile, NothingToWriteThatCannotBeRead)
{
  const double nan = std::numeric_limits<double>::quiet_NaN();
  {
    HandMade m(PETSC_COMM_SELF);
    m.body.shape(2, 1) = nan;
    EXPECT_SAYS(SaveRefused(m.body), "not finite");
  }
  {
    HandMade m(PETSC_COMM_SELF);
    m.body.modal.quadratic[4](1, 0) = std::numeric_limits<double>::infinity();
    EXPECT_SAYS(SaveRefused(m.body), "inertia invariants");
  }
  {
    HandMade m(PETSC_COMM_SELF);
    m.body.modal.moment[1].conservativeResize(3, 2);
    EXPECT_SAYS(SaveRefused(m.body), "second moments of 2 modes among 4");
  }
  {
    HandMade m(PETSC_COMM_SELF);
    m.body.elements[1].node[3] = m.nodes;
    EXPECT_SAYS(SaveRefused(m.body), "an element's node that is not there");
  }
  {
    HandMade m(PETSC_COMM_SELF);
    std::swap(m.body.stress.node[0], m.body.stress.node[1]);
    EXPECT_SAYS(SaveRefused(m.body), "ascending");
  }
  {
    HandMade m(PETSC_COMM_SELF);
    m.body.label.pop_back();
    EXPECT_SAYS(SaveRefused(m.body), "labels");
  }
  HandMade  m(PETSC_COMM_SELF);
  ErrorTrap trap;
  EXPECT_NE(m.body.save("/nowhere/body.h5"), 0);
  EXPECT_SAYS(trap.message, "cannot write the reduced body to /nowhere/body.h5");
}

/* The target name is a folder, which cannot be replaced: the error occurs after writing */
TEST(ReducedFile, NameIsAFolder)
{
  HandMade  m(PETSC_COMM_SELF);
  Scratch   folder("folder.h5");
  ErrorTrap trap;
  ASSERT_EQ(std::system(("mkdir " + folder.name).c_str()), 0);
  EXPECT_NE(m.body.save(folder.name), 0);
  EXPECT_SAYS(trap.message, "cannot write the reduced body to");
  EXPECT_FALSE(std::ifstream(folder.name + ".part").good());
  EXPECT_EQ(std::system(("rmdir " + folder.name).c_str()), 0);
}

TEST(ReducedFile, View)
{
  HandMade made(PETSC_COMM_SELF);
  Printed  printed;
  must(made.body.view(nullptr));
  for (const char *part :
       {"row of bricks", "by hand", "m, kg, s", "mass 7.5", "geometric stiffening: yes", "tip of the row", "modes: 4", "4 bricks with 8 nodes",
        "1 tetrahedra with 4 nodes", "24 nodes with shapes, 16 of them with stress modes"})
    EXPECT_TRUE(printed.says(part)) << part << "\n" << printed.text();
}
