/* The page of a run on several ranks is that of one rank: the first rank writes it, with bodies, modes and channels of
   all ranks */
#include "hhtdae/output.h"
#include "modal_cloud.h"
#include "scene_output.h"

#if defined(HHTDAE_PAGE)
  #include "page_reader.h"

using namespace hhtest;

namespace
{

void run(MPI_Comm comm, const std::string &file)
{
  Rods             rods(6, comm);
  const ModalCloud cloud(9, 4, 3);
  PetscMPIInt      rank;
  FlexibleBody     b;
  MPI_Comm_rank(comm, &rank);
  b.model             = std::make_shared<ModalBody>(cloud.body);
  b.position          = {0, 3, 0};
  b.angular_velocity  = {0.3, -0.2, 0.5};
  b.deformation       = Eigen::VectorXd::LinSpaced(4, 0.02, 0.05);
  const Body flexible = rods.scene.add("cloud", b);
  auto       surface  = std::make_shared<Surface>();
  if (rank == 0) {
    surface->point.assign(27, 0.25);
    surface->shape  = cloud.shape.cast<float>();
    surface->stress = Eigen::MatrixXf::NullaryExpr(54, 4, [](Eigen::Index i, Eigen::Index k) { return (float)std::sin(i + 7. * k); });
  } else surface = nullptr;
  rods.scene.surface(flexible, surface);
  for (int k : {0, 3, 5}) {
    rods.scene.channel("y" + std::to_string(k), Measure::displacement(rods.tip[k], 1), "m");
    rods.scene.channel("f" + std::to_string(k), Measure::jointForce(rods.pin[k], 1), "N");
  }
  SceneRun solve(rods.scene, 0.2, fixedSteps(0.004) + "-ts_hhtdae_corrector_tolerance 1e-6 -scene_page_frames 20 -scene_page " + file);
  must(solve.solve());
}

} // namespace

TEST(Page, AsOnOneRank)
{
  PetscMPIInt rank;
  MPI_Comm_rank(PETSC_COMM_WORLD, &rank);
  TemporaryFile all("all.html"), one("one.html");
  run(PETSC_COMM_WORLD, all.name);
  EXPECT_EQ(all.exists(), rank == 0);
  if (rank) return;
  run(PETSC_COMM_SELF, one.name);
  const std::size_t tracks = 7 * 7 + 4;
  const PageFile    a(all.text(), tracks, 6, {9}), b(one.text(), tracks, 6, {9});
  ASSERT_EQ(a.time.size(), 21u);
  ASSERT_EQ(b.time.size(), 21u);
  ASSERT_EQ(a.surface.size(), 1u);
  EXPECT_EQ(a.surface[0].mode, b.surface[0].mode);
  for (std::size_t i = 0; i < a.time.size(); i++) {
    EXPECT_NEAR(a.time[i], b.time[i], 1e-12);
    for (std::size_t k = 0; k < tracks; k++) EXPECT_NEAR(a.track[i][k], b.track[i][k], 1.01 * (a.step[i][k] + b.step[i][k]) + 1e-6) << "frame " << i << ", track " << k;
    for (std::size_t n = 0; n < 9; n++) EXPECT_NEAR(a.stress[i][n], b.stress[i][n], 0.01);
    for (std::size_t c = 0; c < 6; c++) EXPECT_NEAR(a.channel[i][c], b.channel[i][c], 1e-5 * (1 + std::abs(b.channel[i][c])));
  }
  double moved = 0;
  for (std::size_t k = 0; k < tracks; k++) moved = std::max(moved, std::abs(a.track.back()[k] - a.track[0][k]));
  EXPECT_GT(moved, 0.1);
}

/* If the first rank cannot write, no rank waits for it */
TEST(Page, AllRanksFail)
{
  for (const char *file : {"/dev/full", "/nowhere/page.html"}) {
    Rods      rods(6, PETSC_COMM_WORLD);
    SceneRun  solve(rods.scene, 0.2, fixedSteps(0.004) + "-scene_page " + file);
    ErrorTrap trap;
    EXPECT_NE(solve.solve(), 0);
    EXPECT_NE(trap.message.find(file), std::string::npos) << trap.message;
  }
}

#endif
