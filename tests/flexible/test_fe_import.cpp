/* Matrices of other programs: Matrix Market, Abaqus, PETSc's binary format, memory; refused input */
#include "fe_import_cases.h"
#include "hhtdae/flexible.h"
#include "reduced_body.h"
#include <limits>

using namespace hhtest;

namespace
{

std::string RefusedMatrices(const std::string &k, const std::string &m, const std::string &nodes = "",
                            const std::string &sets = "")
{
  FeModel   model(PETSC_COMM_SELF);
  ErrorTrap trap;
  EXPECT_NE(model.readMatrices(k, m, nodes, sets), 0);
  return trap.message;
}

std::string Reference(const std::string &file)
{
  for (const char *root : {"../shared/reference/", "../../shared/reference/"})
    if (std::ifstream(root + file)) return root + file;
#if defined(HHTDAE_REFERENCE_DIR)
  return std::string(HHTDAE_REFERENCE_DIR) + "/" + file;
#else
  const std::string source = __FILE__;
  return source.substr(0, source.rfind("/tests/flexible/")) + "/../shared/reference/" + file;
#endif
}

const char *const small_k = "%%MatrixMarket matrix coordinate real symmetric\n% a spring\n6 6 12\n1 1 4\n2 2 4\n3 3 "
                            "4\n4 4 4\n5 5 4\n6 6 4\n4 1 -1\n5 2 -1\n6 3 -1\n2 1 0.5\n5 4 0.5\n6 5 0.25\n";
const char *const small_m = "1 1 1\n2 2 1\n3 3 1\n4 4 2\n5 5 2.0D+0\n6 6 +2\n";

} // namespace

TEST(Matrices, MarketTextAndLists)
{
  Folder            folder;
  const std::string k = folder.write("k.mtx", small_k), m = folder.write("m.txt", small_m),
                    nodes = folder.write("nodes.txt", "# nodes\n7 0 0 0\n\n5, 1, 2.5, -3\n"),
                    sets  = folder.write("sets.txt", "left 7\nboth 5 7\nleft 7\n");
  FeModel model(PETSC_COMM_SELF), bare(PETSC_COMM_SELF);
  must(model.readMatrices(k, m, nodes, sets));
  const Eigen::MatrixXd K = Dense(model.K), M = Dense(model.M);
  EXPECT_EQ((K - K.transpose()).norm(), 0);
  EXPECT_EQ(K(0, 3), -1);
  EXPECT_EQ(K(4, 5), 0.25);
  EXPECT_EQ(K.sum(), 24 - 6 + 2.5);
  EXPECT_EQ(M.diagonal().sum(), 9);
  EXPECT_EQ(M.sum(), 9);
  EXPECT_EQ(model.label, (std::vector<PetscInt>{7, 5}));
  EXPECT_EQ(model.coordinates, (std::vector<double>{0, 0, 0, 1, 2.5, -3}));
  EXPECT_EQ(model.sets["left"], (std::vector<PetscInt>{0}));
  EXPECT_EQ(model.sets["both"], (std::vector<PetscInt>{0, 1}));
  Printed printed;
  must(model.view(nullptr));
  EXPECT_TRUE(printed.says("2 nodes, 6 unknowns") && printed.says("set both: 2 nodes")) << printed.text();
  must(bare.readMatrices(k, m, "", ""));
  EXPECT_TRUE(bare.coordinates.empty());
  EXPECT_EQ(bare.label, (std::vector<PetscInt>{1, 2}));
}

TEST(Matrices, PetscBinary)
{
  Folder            folder;
  const std::string k = folder.write("k.mtx", small_k), m = folder.write("m.txt", small_m);
  FeModel           text(PETSC_COMM_SELF), binary(PETSC_COMM_SELF);
  PetscViewer       viewer;
  must(text.readMatrices(k, m, "", ""));
  for (Mat A : {text.K, text.M}) {
    must(PetscViewerBinaryOpen(PETSC_COMM_SELF, (folder.name + (A == text.K ? "/k.bin" : "/m.bin")).c_str(),
                               FILE_MODE_WRITE, &viewer));
    must(MatView(A, viewer));
    must(PetscViewerDestroy(&viewer));
  }
  must(binary.readMatrices(folder.name + "/k.bin", folder.name + "/m.bin", "", ""));
  EXPECT_EQ((Dense(text.K) - Dense(binary.K)).norm(), 0);
  EXPECT_EQ((Dense(text.M) - Dense(binary.M)).norm(), 0);
  const std::string whole = folder.read("k.bin");
  folder.write("cut.bin", whole.substr(0, whole.size() - 5));
  EXPECT_SAYS(RefusedMatrices(folder.name + "/cut.bin", folder.name + "/m.bin"), "truncated");
}

TEST(Matrices, Refuses)
{
  Folder            folder;
  const std::string k = folder.write("k.mtx", small_k), m = folder.write("m.txt", small_m),
                    head = "%%MatrixMarket matrix coordinate real ";
  EXPECT_SAYS(RefusedMatrices("/nowhere/k.mtx", m), "/nowhere/k.mtx: there is no such file");
  EXPECT_SAYS(RefusedMatrices(folder.write("a", ""), m), "it is empty");
  EXPECT_SAYS(RefusedMatrices(folder.write("a", "%%MatrixMarket matrix array real general\n1 1\n1\n"), m),
              "not a matrix in coordinates");
  EXPECT_SAYS(RefusedMatrices(folder.write("a", "%%MatrixMarket matrix coordinate complex general\n3 3 0\n"), m),
              "not real");
  EXPECT_SAYS(RefusedMatrices(folder.write("a", head + "general\n3 4 1\n1 1 1\n"), m), "3 rows and 4 columns");
  EXPECT_SAYS(RefusedMatrices(folder.write("a", head + "general\n6 6 9\n1 1 1\n"), m), "its head promises 9");
  EXPECT_SAYS(RefusedMatrices(folder.write("a", head + "symmetric\n3 3 4\n1 1 1\n2 2 1\n1 2 1\n3 1 2\n"), m),
              "both triangles");
  EXPECT_SAYS(RefusedMatrices(folder.write("a", head + "general\n3 3 4\n1 1 1\n2 2 1\n1 2 1\n3 3 2\n"),
                              folder.write("b", "1 1 1\n2 2 1\n3 3 1\n")),
              "not symmetric");
  EXPECT_SAYS(RefusedMatrices(folder.write("a", head + "general\n3 3 1\n1 1\n"), m), "is not \"row column value\"");
  EXPECT_SAYS(RefusedMatrices(folder.write("a", "1 1 1\n2 2 1\n"), folder.write("b", "1 1 1\n2 2 1\n")),
              "not three for each node");
  EXPECT_SAYS(RefusedMatrices(folder.write("a", "2000000001 2000000001 1\n"), m), "rows");
  EXPECT_SAYS(RefusedMatrices(k, folder.write("a", "1 1 1\n9 9 1\n")), "6 rows");
  EXPECT_SAYS(RefusedMatrices(k, m, folder.write("n", "1 0 0 0\n")), "1 nodes");
  EXPECT_SAYS(RefusedMatrices(k, m, folder.write("n", "1 0 0\n2 1 1 1\n")), "line 1");
  EXPECT_SAYS(RefusedMatrices(k, m, folder.write("n", "1 0 0 0\n2 1 1 1\n"), folder.write("s", "a 1 3\n")),
              "names node 3");
  EXPECT_SAYS(RefusedMatrices(k, m, folder.write("n", "1 0 0 0\n1 1 1 1\n"), folder.write("s", "a 1\n")),
              "two nodes have the label 1");
  EXPECT_SAYS(RefusedMatrices(k, m, "/nowhere/nodes"), "cannot read the nodes");
}

/* Matrices of Abaqus, exported with both triangles as rows "i j v", against frequencies computed elsewhere */
TEST(Matrices, AbaqusBlock)
{
  const std::string k = Reference("exudyn_abaqus_block/blockC3D8_STIF1.mtx"),
                    m = Reference("exudyn_abaqus_block/blockC3D8_MASS1.mtx");
  if (!std::ifstream(k) || !std::ifstream(m)) GTEST_SKIP() << "no reference data";
  FeModel model(PETSC_COMM_SELF);
  must(model.readMatrices(k, m, "", ""));
  EXPECT_EQ(model.nodes, 176);
  const std::vector<double> f = Frequencies(model), expected{438.775, 438.775, 555.888, 967.040, 967.040, 1028.046};
  MEASURED("free-free %.4f %.4f %.4f %.4f %.4f %.4f", f[0], f[1], f[2], f[3], f[4], f[5]);
  EXPECT_LT(Difference(f, expected, 6), 2e-6);
}

TEST(Matrices, AbaqusRotor)
{
  const std::string k = Reference("exudyn_rotor/rotorDiscTestSTIF1.mtx"),
                    m = Reference("exudyn_rotor/rotorDiscTestMASS1.mtx");
  if (!std::ifstream(k) || !std::ifstream(m)) GTEST_SKIP() << "no reference data";
  FeModel model(PETSC_COMM_SELF);
  must(model.readMatrices(k, m, "", ""));
  const std::vector<double> f = Frequencies(model), expected{1046.3701, 1046.3701, 1878.2409, 2123.2970, 2245.5211,
                                                             2386.8793, 2842.0473, 2842.0473, 3945.7171, 3945.7171};
  EXPECT_EQ(model.nodes, 115);
  EXPECT_LT(Difference(f, expected, 10), 1e-7);
  EXPECT_NEAR(Dense(model.M).sum() / 3, 77.96605109486, 1e-9);
}

TEST(Matrices, InMemory)
{
  Folder  folder;
  FeModel text(PETSC_COMM_SELF), model(PETSC_COMM_SELF), bad(PETSC_COMM_SELF);
  must(text.readMatrices(folder.write("k.mtx", small_k), folder.write("m.txt", small_m), "", ""));
  const std::vector<double> x{0, 0, 0, 1, 0, 0};
  must(model.setMatrices(text.K, text.M, x));
  EXPECT_EQ(model.K, text.K);
  EXPECT_EQ(model.nodes, 2);
  must(model.addSet("ends", {1, 0, 1}));
  EXPECT_EQ(model.sets["ends"], (std::vector<PetscInt>{0, 1}));
  ErrorTrap trap;
  EXPECT_NE(model.addSet("ends", {1}), 0);
  EXPECT_TRUE(trap.says("there is a set of nodes ends already")) << trap.message;
  EXPECT_NE(model.addSet("more", {2}), 0);
  EXPECT_TRUE(trap.says("node 2 is not among")) << trap.message;
  EXPECT_NE(bad.setMatrices(text.K, text.M, {0, 0, 0}), 0);
  EXPECT_TRUE(trap.says("coordinates are three")) << trap.message;
  EXPECT_NE(bad.setMatrices(text.K, text.M, {0, 0, 0, 1, 0, 0. / 0.}), 0);
  EXPECT_NE(bad.setMatrices(text.K, nullptr, x), 0);
  Mat odd;
  must(MatDuplicate(text.K, MAT_COPY_VALUES, &odd));
  must(MatSetValue(odd, 0, 3, 7, INSERT_VALUES));
  must(MatAssemblyBegin(odd, MAT_FINAL_ASSEMBLY));
  must(MatAssemblyEnd(odd, MAT_FINAL_ASSEMBLY));
  EXPECT_NE(bad.setMatrices(odd, text.M, x), 0);
  EXPECT_TRUE(trap.says("not symmetric")) << trap.message;
  must(MatDestroy(&odd));
  EXPECT_EQ(bad.nodes, 0);
}
