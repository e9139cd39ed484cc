/* Meshes: reading of Gmsh's files, K and M, stress at nodes, errors */
#include "fe_mesh.h"
#include "flexible/element.h"

using namespace hhtest;
using Eigen::Matrix3d;
using hhtdae::AddStressModes;
using hhtdae::ReducedBody;

namespace
{

const ElementType types[] = {ElementType::Tetrahedron4, ElementType::Tetrahedron10, ElementType::Brick8,
                             ElementType::Brick20};

class FeMesh : public testing::TestWithParam<ElementType>
{
};
INSTANTIATE_TEST_SUITE_P(Types, FeMesh, testing::ValuesIn(types));

/* Moves the inner nodes of the unit box and leaves its faces plane */
Vector3 bent(const Vector3 &x)
{
  const double inside = 40 * x[0] * (1 - x[0]) * x[1] * (1 - x[1]) * x[2] * (1 - x[2]);
  return x + inside * Vector3(.06, -.05, .04);
}

bool onSurface(const double *x)
{
  for (int d = 0; d < 3; d++)
    if (x[d] < 1e-9 || x[d] > 1 - 1e-9) return true;
  return false;
}

/* A body whose modes are these displacement fields */
template <class... F> ReducedBody bodyOf(const FeModel &model, F &&...fields)
{
  ReducedBody body;
  const int   modes = sizeof...(F);
  body.shape.resize(3 * model.own, modes);
  body.modal.omega = Eigen::VectorXd::Ones(modes);
  int  k           = 0;
  auto add         = [&](auto &&f) {
    for (PetscInt n = 0; n < model.own; n++)
      body.shape.block<3, 1>(3 * n, k) = f(Vector3(Eigen::Map<const Vector3>(&model.coordinates[3 * n])));
    k++;
  };
  (add(fields), ...);
  return body;
}

Eigen::Matrix<double, 6, 1> stressOf(const Material &m, const Matrix3d &D)
{
  const hhtdae::fe::Lame      lame(m);
  Eigen::Matrix<double, 6, 1> s;
  s << D(0, 0), D(1, 1), D(2, 2), (D(0, 1) + D(1, 0)) / 2, (D(1, 2) + D(2, 1)) / 2, (D(2, 0) + D(0, 2)) / 2;
  s *= 2 * lame.mu;
  s.head<3>().array() += lame.lambda * D.trace();
  return s;
}

std::string replaced(std::string text, const std::string &from, const std::string &to)
{
  const size_t at = text.find(from);
  if (at == std::string::npos) throw std::runtime_error("the text does not have '" + from + "'");
  return text.replace(at, from.size(), to);
}

/* The message of an error that must occur */
std::string refusal(const std::string &text, const Materials &materials = {{"", softSteel()}})
{
  FeModel   model(PETSC_COMM_SELF);
  ErrorTrap trap;
  EXPECT_NE(readText(model, text, materials), 0);
  return trap.message;
}

#define EXPECT_MESH_SAYS(message, part) EXPECT_NE((message).find(part), std::string::npos) << (message)

bool gmshIsThere() { return std::system("gmsh --version > /dev/null 2>&1") == 0; }

} // namespace

TEST_P(FeMesh, MassMomentsAndRigidMotions)
{
  MeshBox box{GetParam(), 3, 2, 2, 1.5, .8, .6, false, [](const Vector3 &x) { return Vector3(x + Vector3(.1, .2, .3)); }};
  FeModel model(PETSC_COMM_SELF);
  must(readBox(model, box));
  const double mass = softSteel().density * 1.5 * .8 * .6;
  for (int d = 0; d < 3; d++) {
    Vec one = fieldOf(model, [&](Vector3) { return Vector3(Vector3::Unit(d)); }), M1 = product(model.M, one),
        K1 = product(model.K, one);
    EXPECT_NEAR(dot(one, M1), mass, 1e-13 * mass);
    PetscReal norm;
    must(VecNorm(K1, NORM_INFINITY, &norm));
    EXPECT_LT(norm, 1e-13);
    Vec turn = fieldOf(model, [&](Vector3 x) { return Vector3(Vector3::Unit(d).cross(x - Vector3(.85, .6, .6))); });
    Vec Mt = product(model.M, turn), Kt = product(model.K, turn);
    const double a[3]    = {1.5, .8, .6},
                 inertia = mass / 12 * (a[(d + 1) % 3] * a[(d + 1) % 3] + a[(d + 2) % 3] * a[(d + 2) % 3]);
    EXPECT_NEAR(dot(turn, Mt), inertia, 1e-12 * inertia);
    must(VecNorm(Kt, NORM_INFINITY, &norm));
    EXPECT_LT(norm, 1e-12);
    for (Vec *v : {&one, &M1, &K1, &turn, &Mt, &Kt}) must(VecDestroy(v));
  }
}

TEST_P(FeMesh, MatricesAreAsAgreed)
{
  MeshBox     box{GetParam(), 3, 2, 2};
  FeModel model(PETSC_COMM_SELF);
  must(readBox(model, box));
  const PetscInt brick20 = 36 + 3 * 9 + 2 * 4 * 3 + 2 * 4 * 3; /* corners; then middle nodes of edges along x, y, z */
  EXPECT_EQ(model.nodes, box.type == ElementType::Brick20 ? brick20
                         : box.quadratic()                ? 7 * 5 * 5
                                                          : 4 * 3 * 3); /* one node is unused */
  EXPECT_EQ(model.own, model.nodes);
  EXPECT_EQ(model.first, 0);
  EXPECT_EQ((PetscInt)model.label.size(), model.own);
  EXPECT_EQ((PetscInt)model.coordinates.size(), 3 * model.own);
  EXPECT_EQ((int)model.elements.size(), box.bricks() ? 12 : 72);
  for (Mat A : {model.K, model.M}) {
    MatInfo  info;
    PetscInt block;
    must(MatGetInfo(A, MAT_LOCAL, &info));
    EXPECT_EQ(info.mallocs, 0);
    EXPECT_EQ(info.nz_allocated, info.nz_used);
    must(MatSetOption(A, MAT_SYMMETRY_ETERNAL, PETSC_FALSE));
    must(MatSetOption(A, MAT_SYMMETRIC, PETSC_FALSE)); /* makes PETSc compare the entries */
    Mat T;
    must(MatTranspose(A, MAT_INITIAL_MATRIX, &T));
    PetscReal norm;
    must(MatAXPY(T, -1, A, SAME_NONZERO_PATTERN));
    must(MatNorm(T, NORM_FROBENIUS, &norm));
    EXPECT_EQ(norm, 0);
    must(MatDestroy(&T));
    must(MatGetBlockSize(A, &block));
    EXPECT_EQ(block, 3);
  }
  MatNullSpace near;
  PetscBool    constant;
  PetscInt     count;
  must(MatGetNearNullSpace(model.K, &near));
  ASSERT_TRUE(near);
  must(MatNullSpaceGetVecs(near, &constant, &count, nullptr));
  EXPECT_EQ(count, 6);
}

TEST_P(FeMesh, SetsAndLabels)
{
  const MeshBox  box{GetParam(), 3, 2, 2, 1.5};
  MeshWriter writer(box);
  for (bool four : {true, false}) {
    FeModel model(PETSC_COMM_SELF);
    must(readBox(model, box, {{"", softSteel()}}, four));
    ASSERT_EQ(model.sets.size(), 4u);
    EXPECT_EQ((PetscInt)model.sets["solid"].size(), model.nodes);
    for (const auto &end : {std::make_pair("left", 0.), std::make_pair("right", 1.5)}) {
      std::vector<PetscInt> expected;
      for (PetscInt n = 0; n < model.own; n++)
        if (std::abs(model.coordinates[3 * n] - end.second) < 1e-12) expected.push_back(n);
      EXPECT_EQ(model.sets[end.first], expected) << end.first;
    }
    ASSERT_EQ(model.sets["corner"].size(), 1u);
    EXPECT_EQ(model.label[model.sets["corner"][0]], 1);
    for (PetscInt n = 0; n < model.own; n++) {
      const double *x = &model.coordinates[3 * n];
      const Lattice l{(int)std::lround(6 * x[0] / 1.5), (int)std::lround(4 * x[1]), (int)std::lround(4 * x[2])};
      EXPECT_EQ(model.label[n], writer.tag(l));
    }
  }
}

/* Gmsh numbers the groups of each dimension from one: groups of different dimension with the same number or name are
   different sets */
TEST(FeMeshFiles, GroupsOfOneName)
{
  const MeshBox box{ElementType::Brick8, 3, 2, 2, 1.5};
  for (bool four : {true, false})
    for (bool named : {true, false}) {
      std::string       text = MeshWriter(box).text(four);
      const std::size_t from = text.find("$PhysicalNames"), to = text.find("$EndPhysicalNames");
      FeModel           model(PETSC_COMM_SELF);
      if (named) text.replace(text.find("\"left\""), 6, "\"solid\"");
      else text.erase(from, to + 18 - from);
      must(readText(model, text, {{named ? "solid" : "1", softSteel()}}));
      const std::string name = named ? "solid" : "1";
      EXPECT_EQ(model.sets.size(), 4u);
      EXPECT_EQ(model.sets.count(name), 0u) << "which of them?";
      EXPECT_EQ((PetscInt)model.sets["volume " + name].size(), model.nodes);
      EXPECT_EQ(model.sets["surface " + name].size(), 9u);
      EXPECT_EQ(model.sets[named ? "right" : "2"].size(), 9u);
      EXPECT_EQ(model.sets[named ? "corner" : "point 1"].size(), 1u);
    }
}

/* Patch test: with a linear field prescribed on the surface, the inner nodes of an irregular mesh take the same linear field */
TEST_P(FeMesh, PatchTest)
{
  const MeshBox box{GetParam(), 3, 3, 3, 1, 1, 1, false, bent};
  FeModel   model(PETSC_COMM_SELF);
  must(readBox(model, box));
  const auto linear = [](const Vector3 &x) {
    return Vector3(.1 * x[0] + .2 * x[1] - .3 * x[2] + 1, .3 * x[0] - .1 * x[1], .2 * x[2] + .1 * x[0]);
  };
  Vec exact = fieldOf(model, linear), u, b;
  must(VecDuplicate(exact, &u));
  must(VecDuplicate(exact, &b));
  must(VecZeroEntries(b));
  std::vector<PetscInt> held;
  for (PetscInt n = 0; n < model.own; n++)
    if (onSurface(&model.coordinates[3 * n]))
      for (int d = 0; d < 3; d++) held.push_back(3 * n + d);
  ASSERT_LT((PetscInt)held.size(), 3 * model.own);
  must(MatZeroRowsColumns(model.K, (PetscInt)held.size(), held.data(), 1, exact, b));
  KSP ksp;
  PC  pc;
  must(KSPCreate(PETSC_COMM_SELF, &ksp));
  must(KSPSetOperators(ksp, model.K, model.K));
  must(KSPSetType(ksp, KSPPREONLY));
  must(KSPGetPC(ksp, &pc));
  must(PCSetType(pc, PCCHOLESKY));
  must(KSPSolve(ksp, b, u));
  must(VecAXPY(u, -1, exact));
  PetscReal norm;
  must(VecNorm(u, NORM_INFINITY, &norm));
  EXPECT_LT(norm, 1e-12);
  must(KSPDestroy(&ksp));
  for (Vec *v : {&exact, &u, &b}) must(VecDestroy(v));
}

TEST_P(FeMesh, BothVersionsOfTheFormat)
{
  const MeshBox       box{GetParam(), 3, 2, 2, 1, 1, 1, true, bent};
  FeModel         a(PETSC_COMM_SELF), b(PETSC_COMM_SELF);
  const Materials materials = {{"solid", softSteel()}, {"other", {5, .2, 3}}};
  must(readBox(a, box, materials, true));
  must(readBox(b, box, materials, false));
  PetscBool same;
  must(MatEqual(a.K, b.K, &same));
  EXPECT_TRUE(same);
  must(MatEqual(a.M, b.M, &same));
  EXPECT_TRUE(same);
  EXPECT_EQ(a.sets, b.sets);
  EXPECT_EQ(a.label, b.label);
}

TEST(FeMeshFiles, BinaryIsTheSameAsText)
{
  if (!gmshIsThere()) GTEST_SKIP() << "the program gmsh is not installed";
  const std::string geometry =
      "SetFactory(\"OpenCASCADE\");\nCylinder(1) = {0, 0, 0, 0, 0, 2, 0.5};\nPhysical Volume(\"rod\") = {1};\n"
      "Physical Surface(\"end\") = {2};\nMesh.MeshSizeMax = 0.4;\n";
  MeshFile geo(PETSC_COMM_SELF, geometry, ".geo");
  PetscReal     norm[6];
  int           k = 0;
  for (const char *format : {"msh41", "msh22", "msh41 -bin", "msh22 -bin", "msh41 -part 3", "msh41 -bin -part 3"}) { /* each partition has its own entities */
    MeshFile     mesh(PETSC_COMM_SELF, "");
    const std::string command =
        "gmsh -v 0 -3 -order 2 -format " + std::string(format) + " -o " + mesh.name + " " + geo.name;
    ASSERT_EQ(std::system(command.c_str()), 0);
    FeModel model(PETSC_COMM_SELF);
    must(model.readMesh(mesh.name, {{"rod", softSteel()}}));
    must(MatNorm(model.K, NORM_FROBENIUS, &norm[k]));
    EXPECT_NEAR(norm[k], norm[0], 1e-12 * norm[0]) << format;
    EXPECT_EQ((PetscInt)model.sets["rod"].size(), model.nodes);
    /* a curved mesh of degree two approximates the circle to a few parts in ten thousand */
    Vec          one = fieldOf(model, [](Vector3) { return Vector3(1, 0, 0); }), M1 = product(model.M, one);
    const double mass = softSteel().density * PETSC_PI / 2;
    EXPECT_NEAR(dot(one, M1), mass, 5e-3 * mass);
    EXPECT_GT(std::abs(dot(one, M1) - mass), 1e-12 * mass);
    must(VecDestroy(&one));
    must(VecDestroy(&M1));
    EXPECT_GT(model.sets["end"].size(), 10u);
    for (PetscInt n : model.sets["end"]) EXPECT_NEAR(model.coordinates[3 * n + 2], 2, 1e-12);
    k++;
  }
}

/* Linear and quadratic tetrahedra and bricks in one file; since their faces do not match, they are separate bodies */
TEST(FeMeshFiles, MixedElements)
{
  const std::string text = "$MeshFormat\n4.1 0 8\n$EndMeshFormat\n$Nodes\n2 12 1 12\n3 1 0 "
                           "8\n1\n2\n3\n4\n5\n6\n7\n8\n0 0 0\n1 0 0\n1 1 0\n0 1 0\n"
                           "0 0 1\n1 0 1\n1 1 1\n0 1 1\n3 2 0 4\n9\n10\n11\n12\n3 0 0\n4 0 0\n3 1 0\n3 0 1\n$EndNodes\n"
                           "$Elements\n2 2 1 2\n3 1 5 1\n1 1 2 3 4 5 6 7 8\n3 2 4 1\n2 9 10 11 12\n$EndElements\n";
  FeModel           model(PETSC_COMM_SELF);
  must(readText(model, text));
  EXPECT_EQ(model.nodes, 12);
  EXPECT_TRUE(model.sets.empty());
  Vec one = fieldOf(model, [](Vector3) { return Vector3(0, 1, 0); }), M1 = product(model.M, one);
  EXPECT_NEAR(dot(one, M1), 7 * (1 + 1. / 6), 1e-13);
  must(VecDestroy(&one));
  must(VecDestroy(&M1));
}

/* ---- stress ---- */

TEST_P(FeMesh, ConstantStressIsRecovered)
{
  const MeshBox box{GetParam(), 3, 3, 2, 1, 1, 1, false, bent};
  FeModel   model(PETSC_COMM_SELF);
  must(readBox(model, box));
  Matrix3d D, E;
  D << .1, .2, .3, -.4, .5, .6, .7, -.8, .9;
  E << 0, -1, 2, 1, 0, -3, -2, 3, 0; /* a rotation */
  ReducedBody body = bodyOf(
      model, [&](Vector3 x) { return Vector3(D * x); }, [&](Vector3 x) { return Vector3(E * x + Vector3(1, 2, 3)); });
  must(AddStressModes(model, &body));
  const auto s = stressOf(softSteel(), D);
  ASSERT_EQ((PetscInt)body.stress.node.size(), model.own);
  for (PetscInt n = 0; n < model.own; n++) {
    EXPECT_EQ(body.stress.node[n], n);
    EXPECT_LT((body.stress.values.block<6, 1>(6 * n, 0) - s).norm(), 1e-12);
    EXPECT_LT((body.stress.values.block<6, 1>(6 * n, 1)).norm(), 1e-12);
  }
}

/* Pure bending: elements of degree two have the exact stress at every node */
TEST_P(FeMesh, BendingStressIsRecovered)
{
  const MeshBox    box{GetParam(), 4, 4, 4};
  FeModel      model(PETSC_COMM_SELF);
  const double nu = softSteel().poisson;
  must(readBox(model, box));
  ReducedBody body = bodyOf(model, [&](Vector3 x) {
    const double y = x[1] - .5, z = x[2] - .5;
    return Vector3(-x[0] * z, nu * y * z, (x[0] * x[0] + nu * (z * z - y * y)) / 2);
  });
  must(AddStressModes(model, &body));
  double worst = 0, mean = 0;
  for (PetscInt n = 0; n < model.own; n++) {
    Eigen::Matrix<double, 6, 1> s = body.stress.values.block<6, 1>(6 * n, 0);
    s[0] += softSteel().young * (model.coordinates[3 * n + 2] - .5);
    worst = std::max(worst, s.norm());
    mean += s.norm() / model.own;
  }
  if (box.quadratic())
    EXPECT_LT(worst, 1e-12);
  else {
    EXPECT_LT(mean, .35); /* of first order; the largest stress is 1 */
    EXPECT_GT(worst, 1e-3);
  }
}

/* Two materials in a row with equal strain: at the boundary the stress is that of the stiffer one */
TEST(FeMeshStress, StifferSideOfABoundary)
{
  for (bool stiff_first : {true, false}) {
    const Material soft{2, .3, 1}, stiff{50, .1, 1};
    MeshBox            box{ElementType::Tetrahedron10, 4, 2, 2};
    box.two = true;
    FeModel model(PETSC_COMM_SELF);
    must(readBox(model, box, {{"solid", stiff_first ? stiff : soft}, {"other", stiff_first ? soft : stiff}}));
    ASSERT_EQ(model.materials.size(), 2u);
    Matrix3d D;
    D << .1, .2, .3, -.4, .5, .6, .7, -.8, .9;
    ReducedBody body = bodyOf(model, [&](Vector3 x) { return Vector3(D * x); });
    must(AddStressModes(model, &body));
    for (PetscInt n = 0; n < model.own; n++) {
      const double x        = model.coordinates[3 * n] - .5;
      const bool   is_stiff = std::abs(x) < 1e-9 || (x < 0) == stiff_first;
      const auto   s        = stressOf(is_stiff ? stiff : soft, D);
      EXPECT_LT((body.stress.values.block<6, 1>(6 * n, 0) - s).norm(), 1e-12 * s.norm()) << x;
    }
  }
}

TEST(FeMeshStress, Errors)
{
  FeModel model(PETSC_COMM_SELF);
  must(readBox(model, MeshBox()));
  ReducedBody body = bodyOf(model, [](Vector3 x) { return x; });
  {
    ErrorTrap   trap;
    ReducedBody less = body;
    less.shape.resize(0, 0);
    EXPECT_NE(AddStressModes(model, &less), 0);
    EXPECT_TRUE(trap.says("all_nodes")) << trap.message;
  }
  ErrorTrap trap;
  model.elements.clear();
  EXPECT_NE(AddStressModes(model, &body), 0);
  EXPECT_TRUE(trap.says("stress needs elements")) << trap.message;
}

/* ---- errors ---- */

TEST(FeMeshErrors, Files)
{
  FeModel model(PETSC_COMM_SELF);
  {
    ErrorTrap trap;
    EXPECT_NE(model.readMesh("/nowhere/frame.msh", {{"", softSteel()}}), 0);
    EXPECT_TRUE(trap.says("/nowhere/frame.msh") && trap.says("no such file")) << trap.message;
  }
  {
    ErrorTrap trap;
    EXPECT_NE(model.readMesh("/tmp", {{"", softSteel()}}), 0);
    EXPECT_TRUE(trap.says("no plain file")) << trap.message;
  }
  EXPECT_MESH_SAYS(refusal(""), "empty");
  EXPECT_MESH_SAYS(refusal("solid\nfacet normal 0 0 1\n"), "no mesh of Gmsh");
  EXPECT_MESH_SAYS(refusal("$MeshFormat\n4 0 8\n$EndMeshFormat\n"), "4.1 and 2.2");
  EXPECT_MESH_SAYS(refusal("$MeshFormat\n4.1 1 8\n"), "ends too early");
  EXPECT_MESH_SAYS(refusal("$MeshFormat\n4.1 0 8\n$EndMeshFormat\n"), "no section $Nodes");
}

/* A file that is truncated anywhere is refused with an error */
TEST(FeMeshErrors, CutOff)
{
  for (bool four : {true, false}) {
    const std::string text = MeshWriter(MeshBox()).text(four);
    for (size_t length = 0; length + 13 < text.size(); length += 97) {
      FeModel   model(PETSC_COMM_SELF);
      ErrorTrap trap;
      EXPECT_NE(readText(model, text.substr(0, length)), 0) << length;
      EXPECT_FALSE(trap.message.empty());
    }
  }
}

TEST(FeMeshErrors, Elements)
{
  const std::string text = MeshWriter(MeshBox{ElementType::Tetrahedron4, 1, 1, 1}).text(true);
  /* six tetrahedra, of which the first has the nodes 1 3 9 27 and the number 6 */
  EXPECT_MESH_SAYS(refusal(replaced(text, "\n6 1 3 9 27", "\n6 3 1 9 27")),
              "element 6 (tetrahedron with 4 nodes) is turned inside out");
  EXPECT_MESH_SAYS(refusal(replaced(text, "\n6 1 3 9 27", "\n6 1 3 9 4711")), "node 4711");
  EXPECT_MESH_SAYS(refusal(replaced(text, "\n6 1 3 9 27", "\n6 1 3 9")), "integer is expected");
  EXPECT_MESH_SAYS(refusal(replaced(text, "\n6 1 3 9 27", "\n6 1 3 9 x")), "integer is expected");
  EXPECT_MESH_SAYS(refusal(replaced(text, "\n1 1 1\n", "\n1 nan 1\n")), "finite number");
  EXPECT_MESH_SAYS(refusal(replaced(text, "\n1\n3\n", "\n1\n1\n")), "node 1 is there twice");
  EXPECT_MESH_SAYS(refusal(replaced(text, "3 5 4 6\n", "3 5 6 6\n")), "prism with 6 nodes");
  EXPECT_MESH_SAYS(refusal(replaced(text, "3 5 4 6\n", "3 5 7 6\n")), "pyramid with 5 nodes");
  EXPECT_MESH_SAYS(refusal(replaced(text, "3 5 4 6\n", "3 5 77 6\n")), "type 77");
  EXPECT_MESH_SAYS(refusal(replaced(text, "3 5 4 6\n", "2 5 3 6\n")), "none of its 11 elements is a volume element");
  EXPECT_MESH_SAYS(refusal(replaced(text, "3 5 4 6\n", "3 5 4 7\n")), "should be $EndElements");
  /* a flat element */
  EXPECT_MESH_SAYS(refusal(replaced(text, "\n6 1 3 9 27", "\n6 1 3 9 7")), "has no volume");
  /* a duplicate element */
  const size_t      a = text.rfind("\n7 ") + 2, b = text.rfind("\n8 ");
  const std::string second = text.substr(a, b - a);
  EXPECT_MESH_SAYS(refusal(replaced(text, "\n6 1 3 9 27 ", "\n6" + second)), "elements 6, 7 and 10 share one face");
}

TEST(FeMeshErrors, Materials)
{
  const std::string text = MeshWriter(MeshBox{ElementType::Brick8, 2, 1, 1, 1, 1, 1, true}).text(true);
  const Material    m    = softSteel();
  EXPECT_MESH_SAYS(refusal(text, {}), "no material");
  EXPECT_MESH_SAYS(refusal(text, {{"stone", m}, {"", m}}), "no such physical volume; there are: \"solid\", \"other\"");
  EXPECT_MESH_SAYS(refusal(text, {{"left", m}, {"", m}}), "no such physical volume");
  EXPECT_MESH_SAYS(refusal(text, {{"solid", m}}), "none is given for physical volume \"other\"");
  EXPECT_MESH_SAYS(refusal(text, {{"", {-1, .3, 1}}}), "Young's modulus -1");
  EXPECT_MESH_SAYS(refusal(text, {{"", {1, .5, 1}}}), "Poisson's ratio 0.5");
  EXPECT_MESH_SAYS(refusal(text, {{"", {1, .3, 0}}}), "density 0");
  EXPECT_MESH_SAYS(refusal(text, {{"", {std::nan(""), .3, 1}}}), "Young's modulus");
  EXPECT_MESH_SAYS(refusal(text, {{"", {INFINITY, .3, 1}}}), "finite");
}
