/* Matrices stored by CalculiX, which is run by the test: compared with CalculiX's own frequencies and with the
   matrices of the mesh; refused input */
#include "fe_import_cases.h"
#include "flexible/node_order.h"
#include "hhtdae/flexible.h"
#include "reduced_body.h"
#include <iomanip>
#include <set>

using namespace hhtest;

namespace
{

/* Matrix of a model with rows and columns in the order of node labels */
Eigen::MatrixXd ByLabel(const FeModel &model, Mat A)
{
  std::map<PetscInt, PetscInt> place;
  std::vector<Eigen::Index>    rows;
  for (PetscInt i = 0; i < model.own; i++) place[model.label[(std::size_t)i]] = i;
  for (const auto &p : place)
    for (int c = 0; c < 3; c++) rows.push_back(3 * p.second + c);
  return Dense(A)(rows, rows);
}

/* Mass matrix of straight tetrahedra with the integration points of CalculiX's stiffness (one or four), too few for
   products of their shape functions */
Eigen::MatrixXd FewPointsMass(const FeModel &model, double density)
{
  const double    a = (5 + 3 * std::sqrt(5.)) / 20, b = (5 - std::sqrt(5.)) / 20;
  const int       edge[6][2] = {{0, 1}, {1, 2}, {2, 0}, {3, 0}, {2, 3}, {1, 3}};
  Eigen::MatrixXd M          = Eigen::MatrixXd::Zero(3 * model.nodes, 3 * model.nodes);
  for (const FeElement &e : model.elements) {
    const int n = FeNodes(e.type), points = n == 4 ? 1 : 4;
    Matrix3   sides;
    for (int k = 0; k < 3; k++)
      for (int c = 0; c < 3; c++)
        sides(c, k) = model.coordinates[3 * (std::size_t)e.node[k + 1] + (std::size_t)c] -
                      model.coordinates[3 * (std::size_t)e.node[0] + (std::size_t)c];
    for (int p = 0; p < points; p++) {
      Eigen::Vector4d L = Eigen::Vector4d::Constant(n == 4 ? 0.25 : b);
      Eigen::VectorXd N(n);
      if (n == 10) L[p] = a;
      for (int i = 0; i < 4; i++) N[i] = n == 4 ? L[i] : L[i] * (2 * L[i] - 1);
      for (int i = 4; i < n; i++) N[i] = 4 * L[edge[i - 4][0]] * L[edge[i - 4][1]];
      for (int i = 0; i < n; i++)
        for (int j = 0; j < n; j++)
          for (int c = 0; c < 3; c++)
            M(3 * e.node[i] + c, 3 * e.node[j] + c) +=
                density * std::abs(sides.determinant()) / 6 / points * N[i] * N[j];
    }
  }
  return M;
}


bool HaveCcx() { return std::system("command -v ccx > /dev/null 2>&1") == 0; }

/* A CalculiX deck without a step, with the nodes, elements and the nodes of the surface "left" of a mesh in Gmsh's
   format 2.2 */
std::string DeckOf(const std::string &mesh, ElementType type, const std::string &name)
{
  static const int   volume[] = {4, 11, 5, 17};
  std::istringstream in(mesh);
  std::ostringstream deck;
  std::string        line;
  std::set<long>     left;
  while (std::getline(in, line) && line != "$Nodes") {
  }
  long count, label, kind, tags, physical, geometric, node;
  in >> count;
  deck << "*HEADING\nbox\n** a comment\n*NODE, NSET=Nall\n" << std::setprecision(17);
  for (long k = 0; k < count; k++) {
    double x, y, z;
    in >> label >> x >> y >> z;
    deck << label << ", " << x << ", " << y << ", " << z << "\n";
  }
  while (std::getline(in, line) && line != "$Elements") {
  }
  in >> count;
  deck << "*ELEMENT, TYPE=" << name << ", ELSET=Eall\n";
  std::getline(in, line);
  for (long k = 0; k < count && std::getline(in, line); k++) {
    std::istringstream words(line);
    words >> label >> kind >> tags >> physical >> geometric;
    std::vector<long> nodes;
    while (words >> node) nodes.push_back(node);
    if (kind == volume[(int)type]) {
      deck << label;
      for (int i = 0; i < FeNodes(type); i++)
        deck << (i == 15 ? ",\n" : ", ") << nodes[(std::size_t)GmshPlace(type, i)];
      deck << "\n";
    } else if (nodes.size() > 1 && physical == 1)
      left.insert(nodes.begin(), nodes.end());
  }
  deck << "*NSET, NSET=Left\n";
  for (long n : left) deck << n << ",\n";
  deck << "*NSET, NSET=first, GENERATE\n1, 5, 2\n*NSET,NSET=both\nleft, first\n";
  deck
      << "*MATERIAL, NAME=Steel\n*ELASTIC\n2.1D+11, 0.3\n*DENSITY\n7850.\n*SOLID SECTION, ELSET=Eall, MATERIAL=Steel\n";
  return deck.str();
}

const char *const store = "*STEP\n*FREQUENCY, SOLVER=MATRIXSTORAGE\n*END STEP\n";

/* The eigenvalues that ccx prints */
std::vector<double> PrintedByCcx(const std::string &dat)
{
  std::istringstream  in(dat);
  std::string         line;
  std::vector<double> f;
  while (std::getline(in, line)) {
    std::istringstream words(line);
    int                mode;
    double             eigenvalue, omega, frequency, imaginary;
    if (line.find("P A R T I C I P A T I O N") != std::string::npos) break;
    if (words >> mode >> eigenvalue >> omega >> frequency >> imaginary && mode == (int)f.size() + 1)
      f.push_back(std::sqrt(std::max(0., eigenvalue)) / (2 * PETSC_PI));
  }
  return f;
}

struct Sort {
  ElementType type;
  const char *name;
};

/* Without it GoogleTest would print all bytes, including padding */
void PrintTo(const Sort &sort, std::ostream *out) { *out << sort.name; }

class Calculix : public testing::TestWithParam<Sort>
{
};

/* Two tetrahedra, written by hand */
const char *const two_tetrahedra =
    "*NODE, NSET=all\n11,0,0,0\n12,1,0,0\n13,0,1,0\n14,0,0,1\n15,1,1,1\n99,5,5,5\n*ELEMENT, TYPE=C3D4, "
    "ELSET=e\n1,11,12,13,14\n2,12,13,14,15\n"
    "*MATERIAL,NAME=S\n*ELASTIC\n1000.,0.3\n*DENSITY\n2.\n*SOLID SECTION,ELSET=e,MATERIAL=S\n";

std::string Refused(const std::string &stem)
{
  FeModel   model(PETSC_COMM_SELF);
  ErrorTrap trap;
  EXPECT_NE(model.readCalculix(stem), 0);
  return trap.message;
}

} // namespace

TEST_P(Calculix, FrequenciesAsPrintedAndAsFromTheMesh)
{
  if (!HaveCcx()) GTEST_SKIP() << "ccx is not installed";
  const Sort sort = GetParam();
  Folder     folder;
  MeshBox        box;
  box.type = sort.type;
  box.nx = 3, box.ny = 2, box.nz = 1;
  box.lx = 1.1, box.ly = 0.5, box.lz = 0.2;
  const std::string mesh = MeshWriter(box).text(false), deck = DeckOf(mesh, sort.type, sort.name),
                    file = folder.write("box.msh", mesh);
  folder.write("box.inp", deck + store);
  folder.write("print.inp", deck + "*BOUNDARY\nLeft, 1, 3\n*STEP\n*FREQUENCY\n10\n*END STEP\n");
  ASSERT_TRUE(folder.ccx("box"));
  ASSERT_TRUE(folder.ccx("print"));
  FeModel model(PETSC_COMM_SELF), door(PETSC_COMM_SELF);
  must(model.readCalculix(folder.name + "/box"));
  const std::vector<double> printed = PrintedByCcx(folder.read("print.dat")), ours = Frequencies(model),
                            held = Frequencies(model, model.sets["Left"]);
  ASSERT_EQ(printed.size(), 10u);
  EXPECT_LT(Difference(held, printed, 10), 1e-6);
  must(door.readMesh(file, {{"", Material{2.1e11, 0.3, 7850}}}));
  /* CalculiX integrates the mass of tetrahedra with the points of the stiffness; the reader of meshes does not */
  const bool   bricks    = sort.type == ElementType::Brick8 || sort.type == ElementType::Brick20;
  const double stiffness = Difference(ByLabel(model, model.K), ByLabel(door, door.K)),
               mass      = Difference(ByLabel(model, model.M), ByLabel(door, door.M)),
               frequency = Difference(ours, Frequencies(door), 10);
  MEASURED(
      "%s: lowest %.6f; imported against printed %.1e; against the mesh's: frequencies %.1e, stiffness %.1e, mass %.1e",
      sort.name, ours[0], Difference(held, printed, 10), frequency, stiffness, mass);
  ASSERT_EQ(model.nodes, door.nodes);
  EXPECT_LT(stiffness, 1e-12);
  EXPECT_NEAR(Dense(model.M).sum() / 3, 7850 * 1.1 * 0.5 * 0.2, 1e-9);
  if (bricks) {
    EXPECT_LT(frequency, 1e-6);
    EXPECT_LT(mass, 1e-12);
  } else
    EXPECT_LT(Difference(Dense(model.M), FewPointsMass(model, 7850)), 1e-12);
  /* nodes, sets, elements */
  EXPECT_EQ(model.elements.size(), door.elements.size());
  ASSERT_EQ(model.sets.count("Left"), 1u);
  ASSERT_EQ(door.sets.count("left"), 1u);
  EXPECT_EQ(model.sets["Left"].size(), door.sets["left"].size());
  EXPECT_EQ(model.sets["Nall"].size(), (std::size_t)model.nodes); /* the node without elements is left out */
  EXPECT_GE(model.sets["both"].size(), model.sets["Left"].size());
  for (PetscInt n : model.sets["Left"]) EXPECT_EQ(model.coordinates[3 * (std::size_t)n], 0);
  ASSERT_EQ(model.materials.size(), 1u);
  EXPECT_EQ(model.materials[0].young, 2.1e11);
  EXPECT_EQ(model.materials[0].density, 7850);
  std::map<PetscInt, PetscInt> by_label;
  for (PetscInt i = 0; i < door.own; i++) by_label[door.label[(std::size_t)i]] = i;
  for (PetscInt i = 0; i < model.own; i++)
    for (int c = 0; c < 3; c++)
      EXPECT_NEAR(model.coordinates[3 * (std::size_t)i + (std::size_t)c],
                  door.coordinates[3 * (std::size_t)by_label.at(model.label[(std::size_t)i]) + (std::size_t)c], 1e-15);
  /* middle nodes are in Gmsh's order: each lies between its two corners */
  for (const FeElement &e : model.elements) {
    std::set<std::vector<PetscInt>> known;
    for (const FeElement &d : door.elements) {
      std::vector<PetscInt> labels;
      for (int k = 0; k < FeNodes(d.type); k++) labels.push_back(door.label[(std::size_t)d.node[k]]);
      known.insert(labels);
    }
    std::vector<PetscInt> mine;
    for (int k = 0; k < FeNodes(e.type); k++) mine.push_back(model.label[(std::size_t)e.node[k]]);
    EXPECT_TRUE(known.count(mine));
  }
}

INSTANTIATE_TEST_SUITE_P(Elements, Calculix,
                         testing::Values(Sort{ElementType::Tetrahedron4, "C3D4"},
                                         Sort{ElementType::Tetrahedron10, "C3D10"}, Sort{ElementType::Brick8, "C3D8"},
                                         Sort{ElementType::Brick20, "C3D20"}),
                         [](const testing::TestParamInfo<Sort> &info) { return std::string(info.param.name); });

TEST(Calculix, RefusesSupports)
{
  if (!HaveCcx()) GTEST_SKIP() << "ccx is not installed";
  Folder folder;
  folder.write("one.inp", std::string(two_tetrahedra) + "*BOUNDARY\n11,2,2\n" + store);
  folder.write("whole.inp", std::string(two_tetrahedra) + "*BOUNDARY\n11,1,3\n" + store);
  ASSERT_TRUE(folder.ccx("one"));
  ASSERT_TRUE(folder.ccx("whole"));
  EXPECT_SAYS(Refused(folder.name + "/one"), "node 11 has no unknown in direction 2");
  EXPECT_SAYS(Refused(folder.name + "/whole"), "node 11 of an element has no unknowns");
  EXPECT_SAYS(Refused(folder.name + "/whole"), "*BOUNDARY");
}

TEST(Calculix, IncompatibleModesHaveNodesOfTheirOwn)
{
  if (!HaveCcx()) GTEST_SKIP() << "ccx is not installed";
  Folder folder;
  folder.write("brick.inp", std::string("*NODE, NSET=all\n1,0,0,0\n2,1,0,0\n3,1,1,0\n4,0,1,0\n5,0,0,1\n6,1,0,1\n7,1,1,1\n8,0,1,1\n*ELEMENT, TYPE=C3D8I, ELSET=e\n1,1,2,3,4,5,6,7,8\n"
                                        "*MATERIAL,NAME=S\n*ELASTIC\n1000.,0.3\n*DENSITY\n2.\n*SOLID SECTION,ELSET=e,MATERIAL=S\n") + store);
  ASSERT_TRUE(folder.ccx("brick"));
  EXPECT_SAYS(Refused(folder.name + "/brick"), "and C3D8I, which are not read; take C3D20");
}

/* A mesh whose mass matrix is singular, because y^2 is the same at all integration points. Free modes, and modes with
   a rigid end, are compared with those that ccx prints */
TEST(Calculix, OneReducedElementAcross)
{
  if (!HaveCcx()) GTEST_SKIP() << "ccx is not installed";
  Folder  folder;
  MeshBox box;
  box.type = ElementType::Brick20;
  box.nx = 6, box.ny = 1, box.nz = 1;
  box.lx = 0.6, box.ly = 0.03, box.lz = 0.02;
  const std::string deck = DeckOf(MeshWriter(box).text(false), box.type, "C3D20R");
  folder.write("bar.inp", deck + store);
  folder.write("print.inp", deck + "*STEP\n*FREQUENCY\n10\n*END STEP\n");
  ASSERT_TRUE(folder.ccx("bar"));
  ASSERT_TRUE(folder.ccx("print"));
  const std::vector<double> printed = PrintedByCcx(folder.read("print.dat"));
  ASSERT_EQ(printed.size(), 10u);
  FeModel model(PETSC_COMM_SELF);
  must(model.readCalculix(folder.name + "/bar"));
  for (const bool held : {false, true}) {
    Reduction   r;
    ReducedBody b;
    if (held) r.attachments = {{"Left"}};
    else
      r.method = Method::FreeFree;
    r.modes = 6;
    must(Reduce(model, r, &b));
    for (std::size_t k = 0; k < 3; k++) EXPECT_NEAR(b.mode[k].frequency, printed[6 + k], (held ? 1e-2 : 1e-5) * printed[6 + k]);
  }
}

/* Point masses, springs and wedges are only in the matrices. Functions that need the elements refuse such models;
   those with reduced-integration elements are accepted */
TEST(Calculix, ElementsThatAreNotAllOfTheModel)
{
  if (!HaveCcx()) GTEST_SKIP() << "ccx is not installed";
  Folder            folder;
  const std::string nodes = "*NODE, NSET=all\n1,0,0,0\n2,1,0,0\n3,1,1,0\n4,0,1,0\n5,0,0,1\n6,1,0,1\n7,1,1,1\n8,0,1,1\n9,2,0.1,0\n10,2,1,0.1\n11,2,0,1.2\n12,2,1,1\n",
                    material = "*MATERIAL,NAME=S\n*ELASTIC\n1000.,0.3\n*DENSITY\n2.\n*SOLID SECTION,ELSET=e,MATERIAL=S\n",
                    brick = "1,1,2,3,4,5,6,7,8\n", two = brick + "2,2,9,10,3,6,11,12,7\n", full = "*ELEMENT, TYPE=C3D8, ELSET=e\n";
  const std::string sets = "*NSET,NSET=left\n1,4,5,8\n*NSET,NSET=right\n9,10,11,12\n";
  const auto        says = [&](const char *stem, const std::string &elements) {
    folder.write(std::string(stem) + ".inp", nodes + elements + sets + material + store);
    EXPECT_TRUE(folder.ccx(stem));
    FeModel    model(PETSC_COMM_SELF);
    Scene      scene(PETSC_COMM_SELF);
    FullFeBody fe;
    ErrorTrap  trap;
    EXPECT_EQ(model.readCalculix(folder.name + "/" + stem), 0) << trap.message;
    const bool refused = fe.add(scene, "body", model, FullBody()) != 0;
    Reduction  r;
    r.attachments = {{"left"}, {"right"}};
    r.modes       = 2;
    r.stiffening  = true;
    ReducedBody b;
    EXPECT_EQ(Reduce(model, r, &b) != 0, refused);
    return refused ? trap.message : std::string();
  };
  EXPECT_EQ(says("full", full + two), "");
  EXPECT_SAYS(says("mass", full + two + "*ELEMENT, TYPE=MASS, ELSET=m\n3,10\n*MASS, ELSET=m\n1.\n"), "than the elements: 10. Springs, point masses");
  EXPECT_SAYS(says("spring", full + two + "*ELEMENT, TYPE=SPRINGA, ELSET=s\n3,4,10\n*SPRING, ELSET=s\n\n800.\n"), "at 2 node(s)");
  EXPECT_SAYS(says("wedge", full + brick + "*ELEMENT, TYPE=C3D6, ELSET=e\n2,2,9,3,6,11,7\n3,9,10,3,11,12,7\n"), "wedges");
}

TEST(Calculix, RefusesDamage)
{
  if (!HaveCcx()) GTEST_SKIP() << "ccx is not installed";
  Folder folder;
  folder.write("two.inp", std::string(two_tetrahedra) + store);
  ASSERT_TRUE(folder.ccx("two"));
  {
    FeModel model(PETSC_COMM_SELF); /* the name of the deck is accepted as well */
    must(model.readCalculix(folder.name + "/two.inp"));
    EXPECT_EQ(model.nodes, 5);
    EXPECT_EQ(model.label, (std::vector<PetscInt>{11, 12, 13, 14, 15}));
    EXPECT_EQ(model.sets["e"].size(), 5u);
    EXPECT_NEAR(Dense(model.M).sum(), 3 * 2. * (1. / 6 + 1. / 3), 1e-11);
    EXPECT_LT((Dense(model.K) * Eigen::VectorXd::Ones(15)).norm(), 1e-10);
    ErrorTrap trap;
    EXPECT_NE(model.readCalculix(folder.name + "/two"), 0);
    EXPECT_TRUE(trap.says("filled already"));
  }
  const std::string dof = folder.read("two.dof"), sti = folder.read("two.sti"), deck = folder.read("two.inp"),
                    stem = folder.name + "/two";
  /* rows in another order are sorted */
  folder.write("two.dof", dof);
  EXPECT_SAYS(Refused(folder.name + "/three"), "three.inp: there is no such file");
  folder.write("two.sti", sti.substr(0, sti.size() / 2));
  EXPECT_SAYS(Refused(stem), "two.sti");
  folder.write("two.sti", sti.substr(0, sti.rfind("15 15")));
  folder.write("two.sti", sti.substr(0, sti.find("4 15 ")));
  EXPECT_SAYS(Refused(stem), "ends with row 14 of 15");
  folder.write("two.sti", sti + "1 2 nan\n");
  EXPECT_SAYS(Refused(stem), "not a finite number");
  folder.write("two.sti", sti + "16 16 1\n");
  EXPECT_SAYS(Refused(stem), "not among 1 .. 15");
  folder.write("two.sti", sti);
  folder.write("two.dof", dof + "77.1\n77.2\n77.3\n");
  EXPECT_SAYS(Refused(stem), "node 77 is not in the deck");
  folder.write("two.dof", dof + "11.1\n");
  EXPECT_SAYS(Refused(stem), "twice");
  folder.write("two.dof", "hello\n");
  EXPECT_SAYS(Refused(stem), "is not \"node.direction\"");
  folder.write("two.dof", dof);
  folder.write("two.inp", "*INCLUDE, INPUT=nodes.inp\n" + deck);
  EXPECT_SAYS(Refused(stem), "nodes.inp: there is no such file");
  folder.write("two.inp", "*NODE\n1, 2, abc\n" + deck);
  EXPECT_SAYS(Refused(stem), "two.inp, line 2");
  folder.write("two.inp", deck + "*NSET,NSET=a\nnowhere\n");
  EXPECT_SAYS(Refused(stem), "names the set nowhere");
  folder.write("two.inp", deck);
  std::remove((stem + ".mas").c_str());
  EXPECT_SAYS(Refused(stem), "two.mas");
}

/* The rows of the stored matrices may be in any order */
TEST(Calculix, OrderOfRows)
{
  if (!HaveCcx()) GTEST_SKIP() << "ccx is not installed";
  Folder folder;
  folder.write("two.inp", std::string(two_tetrahedra) + store);
  ASSERT_TRUE(folder.ccx("two"));
  FeModel straight(PETSC_COMM_SELF), turned(PETSC_COMM_SELF);
  must(straight.readCalculix(folder.name + "/two"));
  folder.write("include.inp", two_tetrahedra);
  folder.write("turned.inp", std::string("*INCLUDE, INPUT=include.inp\n") + store);
  std::istringstream       lines(folder.read("two.dof"));
  std::vector<std::string> line;
  std::string              one, all;
  while (lines >> one) line.push_back(one);
  for (std::size_t i = line.size(); i-- > 0;) all += line[i] + "\n";
  folder.write("turned.dof", all);
  for (const char *end : {"sti", "mas"}) {
    std::istringstream in(folder.read(std::string("two.") + end));
    std::ostringstream out;
    int                i, j;
    std::string        value;
    while (in >> i >> j >> value) out << 16 - i << " " << 16 - j << " " << value << "\n";
    folder.write(std::string("turned.") + end, out.str());
  }
  must(turned.readCalculix(folder.name + "/turned"));
  EXPECT_EQ((Dense(straight.K) - Dense(turned.K)).norm(), 0);
  EXPECT_EQ((Dense(straight.M) - Dense(turned.M)).norm(), 0);
  EXPECT_GT(Dense(turned.K).norm(), 100);
  EXPECT_EQ(straight.coordinates, turned.coordinates);
}
