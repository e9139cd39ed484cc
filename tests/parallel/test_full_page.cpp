/* Whole finite-element bodies in a page: nodes are where the run has them, and the page is the same on any number of ranks */
#include "box_model.h"
#include "hhtdae/flexible.h"
#include "scene_output.h"

#if defined(HHTDAE_PAGE)
  #include "page_reader.h"

using namespace hhtest;

namespace
{

const int     bricks[] = {6, 2, 2};
constexpr int outer    = 7 * 3 * 3 - 5; /* all nodes except inner ones */
constexpr int frames = 8;

/* Positions of all nodes at the frames, on the first rank, from FullFeBody */
struct Asked {
  FullFeBody                       fe;
  MPI_Comm                         comm;
  double                           dt;
  std::vector<std::vector<double>> x = {};

  static PetscErrorCode ask(TS ts, PetscInt step, PetscReal t, Vec, void *ctx)
  {
    Asked              &a = *static_cast<Asked *>(ctx);
    std::vector<double> mine;
    PetscMPIInt         size;
    PetscFunctionBegin;
    if (step <= 0) PetscFunctionReturn(0);
    PetscCallMPI(MPI_Comm_size(a.comm, &size));
    for (; (double)a.x.size() * a.dt <= t * (1 + 1e-12);) {
      PetscCall(a.fe.positions(ts, std::min((double)a.x.size() * a.dt, (double)t), &mine));
      std::vector<int> count(size), place(size, 0);
      const int        own = (int)mine.size();
      PetscCallMPI(MPI_Allgather(&own, 1, MPI_INT, count.data(), 1, MPI_INT, a.comm));
      for (int r = 1; r < size; r++) place[r] = place[r - 1] + count[r - 1];
      a.x.emplace_back(place[size - 1] + count[size - 1]);
      PetscCallMPI(MPI_Allgatherv(mine.data(), own, MPI_DOUBLE, a.x.back().data(), count.data(), place.data(), MPI_DOUBLE, a.comm));
    }
    PetscFunctionReturn(0);
  }
};

/* A soft bar that tumbles and vibrates, beside a rigid body */
Asked run(MPI_Comm comm, FeLaw law, const std::string &file)
{
  constexpr double end = 0.02;
  FeModel          model(comm);
  BoxBuilder({{bricks[0], bricks[1], bricks[2]}, {2, 0.3, 0.2}, {2e5, 0.3, 1000}}, &model);
  Scene     scene(comm);
  Asked     asked{{}, comm, end / frames};
  FullBody  b;
  RigidBody other;
  b.law              = law;
  b.position         = {0.3, -0.2, 5};
  b.rotation         = Eigen::AngleAxisd(0.8, Vector3(1, -2, 0.5).normalized()).toRotationMatrix();
  b.attachments      = {{"left"}};
  if (law == FeLaw::Large) b.angular_velocity = {1, 20, -15};
  other.velocity = {1, 0, 0};
  scene.gravity({0, 0, -9.81});
  scene.add("other", other);
  must(asked.fe.add(scene, "bar", model, b));
  const Marker left = scene.marker(asked.fe.attachment("left"));
  scene.add("spring", SpringDamper{left, scene.marker(scene.ground(), {0, 0, 8}), 5e3, 0, 1});
  SceneRun solve(scene, end, fixedSteps(end / 40) + "-ts_hhtdae_corrector_tolerance 1e-8 -scene_page_frames " + std::to_string(frames) + " -scene_page " + file);
  must(TSMonitorSet(solve.ts, Asked::ask, &asked, nullptr));
  must(solve.solve());
  return asked;
}

/* the other body, the frame of the attachment, the bar */
PageFile read(const TemporaryFile &file) { return PageFile(file.text(), 21, 0, {}, {{outer, true}}); }

/* Positions of the surface nodes in the page */
Eigen::Matrix3Xd shown(const PageFile &page, std::size_t frame)
{
  const std::vector<double> &track = page.track[frame];
  const double              *p     = &track[14];
  const Matrix3              R     = Eigen::Quaterniond(p[6], p[3], p[4], p[5]).normalized().toRotationMatrix();
  Eigen::Matrix3Xd           x     = Eigen::Map<const Eigen::Matrix3Xf>(page.surface[0].point.data(), 3, outer).cast<double>();
  x += Eigen::Map<const Eigen::Matrix3Xd>(page.moved[frame].data(), 3, outer);
  return (R * x).colwise() + Eigen::Vector3d(p[0], p[1], p[2]);
}

} // namespace

TEST(FullPage, NodesAreWhereTheRunHasThem)
{
  PetscMPIInt rank;
  MPI_Comm_rank(PETSC_COMM_WORLD, &rank);
  for (FeLaw law : {FeLaw::Small, FeLaw::Large}) {
    TemporaryFile file("full.html");
    const Asked   asked = run(PETSC_COMM_WORLD, law, file.name);
    EXPECT_EQ(file.exists(), rank == 0);
    if (rank) continue;
    const PageFile page = read(file);
    ASSERT_EQ(page.time.size(), (std::size_t)frames + 1);
    ASSERT_EQ(asked.x.size(), (std::size_t)frames + 1);
    ASSERT_EQ(page.surface.size(), 1u);
    EXPECT_EQ(page.surface[0].triangle.size(), 3u * 2 * 2 * (6 * 2 + 2 * 2 + 2 * 6));
    EXPECT_NE(page.scene.find("\"name\":\"bar\",\"modes\":0,\"carrier\":-1,\"rest\":[],\"mesh\":true"), std::string::npos);
    EXPECT_NE(page.scene.find("\"name\":\"bar.left\",\"modes\":0,\"carrier\":2"), std::string::npos) << page.scene;
    double largest = 0;
    for (std::size_t i = 0; i < page.time.size(); i++) {
      const Eigen::Matrix3Xd x = shown(page, i), all = Eigen::Map<const Eigen::Matrix3Xd>(asked.x[i].data(), 3, (Eigen::Index)asked.x[i].size() / 3);
      for (int n = 0; n < outer; n++) {
        const double off = (all.colwise() - Eigen::Vector3d(x.col(n))).colwise().norm().minCoeff();
        EXPECT_LT(off, page.moved_step[i] + 2e-4) << "frame " << i << ", node " << n;
      }
      for (double d : page.moved[i]) largest = std::max(largest, std::abs(d));
    }
    EXPECT_GT(largest, 1e-3); /* the bar deforms, */
    EXPECT_LT(largest, 0.5);  /* and its rigid motion is not part of the deformation */
  }
}

TEST(FullPage, AsOnOneRank)
{
  PetscMPIInt rank;
  MPI_Comm_rank(PETSC_COMM_WORLD, &rank);
  TemporaryFile all("all.html"), one("one.html");
  run(PETSC_COMM_WORLD, FeLaw::Large, all.name);
  if (rank) return;
  run(PETSC_COMM_SELF, FeLaw::Large, one.name);
  const PageFile a = read(all), b = read(one);
  ASSERT_EQ(a.time.size(), b.time.size());
  double most = 0;
  for (std::size_t i = 0; i < a.time.size(); i++) {
    const Eigen::Matrix3Xd x = shown(a, i), y = shown(b, i);
    for (int n = 0; n < outer; n++) { /* nodes are numbered differently there */
      Eigen::Index same;
      EXPECT_LT((y.colwise() - Eigen::Vector3d(x.col(n))).colwise().norm().minCoeff(&same), 4e-4 + a.moved_step[i] + b.moved_step[i]);
      EXPECT_NEAR(a.stress[i][(std::size_t)n], b.stress[i][(std::size_t)same], 0.01 * (b.stress[i][(std::size_t)same] + 100));
      most = std::max(most, b.stress[i][(std::size_t)same]);
    }
  }
  EXPECT_GT(most, 1000);
}

#endif
