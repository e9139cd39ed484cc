/* The page of a run contains the values that the run had */
#include "hhtdae/query.h"
#include "modal_cloud.h"
#include "scene/output/page_frames.h"
#include "scene_output.h"

#if defined(HHTDAE_PAGE)
  #include "page_reader.h"

using namespace hhtest;

namespace
{

const std::string accurate = " -ts_rtol 1e-7 -ts_atol 1e-7 ";

/* Poses of the bodies from queries at the times of the frames */
struct Asked {
  std::vector<Body>                      body;
  Body                                   flexible; /* none by default */
  double                                 dt;
  std::vector<double>                    time    = {};
  std::vector<std::vector<Motion>>       motion  = {};
  std::vector<std::vector<double>>       modes   = {};
  Scene                                 *scene   = nullptr;
  std::vector<std::vector<double>>       channel = {};

  static PetscErrorCode ask(TS ts, PetscInt step, PetscReal t, Vec, void *ctx)
  {
    Asked   &a = *static_cast<Asked *>(ctx);
    Snapshot now;
    PetscFunctionBegin;
    if (step <= 0) PetscFunctionReturn(0);
    for (; (double)a.time.size() * a.dt <= t * (1 + 1e-12); a.time.push_back((double)a.time.size() * a.dt)) {
      const double at = std::min((double)a.time.size() * a.dt, t);
      PetscCall(now.take(ts, at));
      a.motion.emplace_back(a.body.size());
      for (std::size_t b = 0; b < a.body.size(); b++) PetscCall(now.motion(a.body[b], &a.motion.back()[b]));
      a.modes.emplace_back();
      if (a.flexible.id >= 0) PetscCall(now.modes(a.flexible, &a.modes.back()));
      a.channel.emplace_back();
      PetscCall(a.scene->sample(ts, at, a.channel.back()));
    }
    PetscFunctionReturn(0);
  }
};

/* Attitude from the quaternion of a track; quantization may change its length from 1 by half a level */
Matrix3 axesOf(const std::vector<double> &track, std::size_t body)
{
  const double *q = &track[7 * body + 3];
  return Eigen::Quaterniond(q[3], q[0], q[1], q[2]).toRotationMatrix();
}

/* Largest difference from the queried values, in half levels of quantization */
void comparePoses(const PageFile &page, const Asked &asked)
{
  ASSERT_EQ(page.time.size(), asked.time.size());
  for (std::size_t i = 0; i < page.time.size(); i++) {
    EXPECT_NEAR(page.time[i], asked.time[i], 1e-12);
    for (std::size_t b = 0; b < asked.body.size(); b++) {
      const Motion &m = asked.motion[i][b];
      for (int c = 0; c < 3; c++) EXPECT_NEAR(page.track[i][7 * b + c], m.position(c), 0.51 * page.step[i][7 * b + c] + 1e-9) << "frame " << i << ", body " << b;
      EXPECT_LT((axesOf(page.track[i], b) - m.axes).norm(), 2e-4);
    }
    for (std::size_t c = 0; c < asked.channel[i].size(); c++) EXPECT_NEAR(page.channel[i][c], asked.channel[i][c], 1e-6 * (1 + std::abs(asked.channel[i][c])));
  }
}

std::string refusal(const std::function<PetscErrorCode()> &run)
{
  ErrorTrap trap;
  try {
    return run() ? trap.message : "";
  } catch (const std::exception &e) {
    return trap.message.empty() ? e.what() : trap.message;
  }
}

std::size_t count(const std::string &text, const std::string &part)
{
  std::size_t n = 0;
  for (std::size_t at = 0; (at = text.find(part, at)) != std::string::npos; at += part.size()) n++;
  return n;
}

} // namespace

TEST(Page, PosesAndChannelsAreThoseOfTheRun)
{
  TemporaryFile file("poses.html");
  Rods          rods(3);
  Asked         asked{rods.body, {}, 0.01};
  asked.scene = &rods.scene;
  rods.scene.channel("y", Measure::displacement(rods.tip[2], 1), "m");
  rods.scene.channel("pin", Measure::jointForce(rods.pin[1], 1), "N"); /* the reaction follows from the equations of motion */
  SceneRun run(rods.scene, 2, accurate + "-scene_page_dt 0.01 -scene_page " + file.name);
  must(TSMonitorSet(run.ts, Asked::ask, &asked, nullptr));
  must(run.solve());
  const PageFile page(file.text(), 21, 2);
  EXPECT_EQ(page.time.size(), 201u);
  EXPECT_EQ(page.blocks, 2);
  comparePoses(page, asked);
  EXPECT_FALSE(TemporaryFile("poses.html.part").exists());
}

TEST(Page, FiveHundredFramesUnlessAskedOtherwise)
{
  TemporaryFile file("frames.html");
  for (const auto &[option, frames] : {std::make_pair("", 501u), std::make_pair("-scene_page_frames 10 ", 11u), std::make_pair("-scene_page_frames 10 -scene_page_dt 0.125 ", 9u)}) {
    Rods     rods(2);
    SceneRun run(rods.scene, 1, accurate + option + "-scene_page " + file.name);
    must(run.solve());
    const PageFile page(file.text(), 14, 0);
    EXPECT_EQ(page.time.size(), frames) << option;
    EXPECT_LT(file.text().size(), 1200000u); /* most of the page is three.js */
  }
}

TEST(Page, FlexibleBodies)
{
  TemporaryFile    file("flexible.html");
  const ModalCloud cloud(9, 5, 3);
  auto             surface = std::make_shared<Surface>();
  Eigen::MatrixXd  stress  = Eigen::MatrixXd::Random(6 * 9, 5);
  for (const Vector3 &x : cloud.X)
    for (int c = 0; c < 3; c++) surface->point.push_back(x(c));
  surface->triangle = {0, 1, 2, 3, 4, 5, 6, 7, 8};
  surface->shape    = cloud.shape.cast<float>();
  surface->stress   = stress.cast<float>();
  Scene        scene(PETSC_COMM_SELF);
  FlexibleBody b;
  b.model            = std::make_shared<ModalBody>(cloud.body);
  b.angular_velocity = {0.3, -0.2, 0.5};
  b.deformation      = Eigen::VectorXd::LinSpaced(5, 0.02, 0.05);
  RigidBody other;
  other.position = {3, 0, 0};
  const Body rigid = scene.add("other", other), body = scene.add("cloud", b);
  scene.gravity({0, 0, -1});
  scene.surface(body, surface);
  Asked asked{{rigid, body}, body, 0.01};
  asked.scene = &scene;
  SceneRun run(scene, 1, accurate + "-scene_page_dt 0.01 -scene_page " + file.name);
  must(TSMonitorSet(run.ts, Asked::ask, &asked, nullptr));
  must(run.solve());
  const PageFile page(file.text(), 14 + 5, 0, {9});
  comparePoses(page, asked);
  ASSERT_EQ(page.surface.size(), 1u);
  const PageSurface &s = page.surface[0];
  EXPECT_EQ(s.triangle, (std::vector<std::uint32_t>{0, 1, 2, 3, 4, 5, 6, 7, 8}));
  for (int i = 0; i < 27; i++) {
    EXPECT_NEAR(s.point[i], cloud.X[i / 3](i % 3), 1e-6);
    for (int k = 0; k < 5; k++) EXPECT_NEAR(s.mode[k][i], cloud.shape(i, k), 0.51 * s.step[k]);
  }
  for (int k = 0; k < 5; k++) { /* resolution is coarser by the square of the frequency */
    const double ratio = cloud.body.omega(0) / cloud.body.omega(k);
    EXPECT_NEAR(s.step[k], cloud.shape.col(k).cwiseAbs().maxCoeff() / (8191 * ratio * ratio), 1e-2 * s.step[k]);
  }
  double largest = 0;
  for (const auto &eta : asked.modes) largest = std::max(largest, std::abs(eta[0]));
  EXPECT_GT(largest, 0.01);
  for (std::size_t i = 0; i < page.time.size(); i++) {
    const Eigen::Map<const Eigen::VectorXd> eta(asked.modes[i].data(), 5);
    for (int k = 0; k < 5; k++) EXPECT_NEAR(page.track[i][14 + k], eta(k), 0.51 * page.step[i][14 + k] + 1e-9);
    for (int node = 0; node < 9; node++) {
      double most = 0;
      for (const auto &x : page.stress) most = std::max(most, x[node]);
      const Eigen::Matrix<double, 6, 1> t    = stress.middleRows<6>(6 * node) * eta;
      const double                      mean = (t(0) + t(1) + t(2)) / 3, mises = std::sqrt(1.5 * ((t.head<3>().array() - mean).square().sum() + 2 * t.tail<3>().squaredNorm()));
      EXPECT_NEAR(page.stress[i][node], mises, 0.51 * most / 255 + 1e-6);
    }
  }
}

/* Undeformed frames of attachments, for a body that is deformed at the start and whose origin is not its centre of mass */
TEST(Page, AttachmentsWithoutDeformation)
{
  TemporaryFile file("attachments.html");
  ModalCloud    cloud(9, 5, 11);
  FlexibleBody  b;
  const Vector3 shift(0.3, -0.2, 0.7);
  cloud.body.center += shift;
  for (ModalAttachment &a : cloud.body.attachments) a.position += shift;
  b.model       = std::make_shared<ModalBody>(cloud.body);
  b.position    = {1, 2, 3};
  b.deformation = Eigen::VectorXd::LinSpaced(5, -0.2, 0.3);
  Scene scene(PETSC_COMM_SELF);
  scene.attachment(scene.add("cloud", b), "tip");
  SceneRun run(scene, 0.01, "-scene_page " + file.name);
  must(run.solve());
  const std::string s = PageFile(file.text(), 14 + 5, 0).scene, mark = "\"carrier\":0,\"rest\":[";
  const std::size_t at = s.find(mark);
  ASSERT_NE(at, std::string::npos) << s;
  Vector3 rest;
  ASSERT_EQ(std::sscanf(s.c_str() + at + mark.size(), "%lf,%lf,%lf", &rest(0), &rest(1), &rest(2)), 3);
  EXPECT_LT((rest - cloud.X[1]).norm(), 1e-10);
}

TEST(Page, SurfacesThatDoNotFit)
{
  const ModalCloud cloud(9, 5, 3);
  const auto       attempt = [&](const std::function<void(Surface &)> &change) {
    TemporaryFile file("fault.html");
    auto          surface = std::make_shared<Surface>();
    surface->point.assign(27, 0.5);
    surface->shape = cloud.shape.cast<float>();
    change(*surface);
    Scene        scene(PETSC_COMM_SELF);
    FlexibleBody b;
    b.model = std::make_shared<ModalBody>(cloud.body);
    scene.surface(scene.add("cloud", b), surface);
    return refusal([&] {
      SceneRun run(scene, 0.01, "-scene_page " + file.name);
      return run.solve();
    });
  };
  EXPECT_EQ(attempt([](Surface &) {}), "");
  EXPECT_NE(attempt([](Surface &s) { s.point.pop_back(); }).find("surface of cloud: it has 26 coordinates"), std::string::npos);
  EXPECT_NE(attempt([](Surface &s) { s.triangle = {0, 1, 9}; }).find("a triangle has the node 9, of 9"), std::string::npos);
  EXPECT_NE(attempt([](Surface &s) { s.triangle = {0, 1}; }).find("not three for each"), std::string::npos);
  EXPECT_NE(attempt([](Surface &s) { s.shape.conservativeResize(27, 4); }).find("27 by 4, not of 27 by 5"), std::string::npos);
  EXPECT_NE(attempt([](Surface &s) { s.stress.setZero(53, 5); }).find("53 by 5, not of 54 by 5"), std::string::npos);
  EXPECT_NE(attempt([](Surface &s) { s.shape(3, 2) = NAN; }).find("not finite"), std::string::npos);
  Scene scene(PETSC_COMM_SELF);
  scene.surface(scene.add("rigid", RigidBody{}), std::make_shared<Surface>());
  EXPECT_NE(refusal([&] { return scene.setUp(); }).find("not a flexible one"), std::string::npos);
}

TEST(Page, NamesCannotBreakThePage)
{
  TemporaryFile     file("names.html");
  const std::string hostile = "</script><script>alert(\"1\")</script><!-- \\ ' \n\t\x01 Träger 梁";
  Scene             scene(PETSC_COMM_SELF);
  const Body        body = scene.add(hostile, RigidBody{});
  scene.channel(hostile, Measure::displacement(scene.marker(body), 0), "</script>");
  scene.output().page       = file.name;
  scene.output().page_title = hostile;
  SceneRun run(scene, 0.1, "");
  must(run.solve());
  const PageFile page(file.text(), 7, 1);
  EXPECT_EQ(page.scene.find('<'), std::string::npos);
  EXPECT_EQ(page.scene.find('\x01'), std::string::npos);
  EXPECT_EQ(count(page.scene, "\\u003c/script\\u003e\\u003cscript\\u003ealert(\\\"1\\\")\\u003c/script\\u003e\\u003c!-- \\\\ ' \\u000a\\u0009\\u0001 Träger 梁"), 3u);
  EXPECT_EQ(count(page.text, "<script"), count(page.text, "</script>"));
  EXPECT_GT(page.time.size(), 1u);
}

/* Values that are not finite keep their places and do not affect their neighbours */
TEST(Page, ValuesOfAllKinds)
{
  const double nan = std::numeric_limits<double>::quiet_NaN(), huge = 0.9e300, infinite = std::numeric_limits<double>::infinity();
  const std::vector<std::vector<double>> track{{1, nan, 0, -huge, 5, 1e6}, {2, nan, 0, huge, nan, 1e6 + 1e-3}, {4, nan, 0, 0, infinite, 1e6}, {8, nan, 0, 1, 1.7e308, 1e6}};
  const std::vector<double>              channel{1, nan, -infinite, 1e300};
  PageFrames                             frames(6, 1, {});
  std::string                            element;
  for (int i = 0; i < 4; i++) frames.add(i, track[i].data(), &channel[i]);
  must(PageElement(frames.encode(), "frames", &element));
  const PageFile page("<script id=\"scene\" type=\"application/json\">{}</script>\n" + element, 6, 1);
  ASSERT_EQ(page.time.size(), 4u);
  for (int i = 0; i < 4; i++) {
    for (int k = 0; k < 6; k++) {
      if (std::abs(track[i][k]) < 1e300) EXPECT_NEAR(page.track[i][k], track[i][k], 0.51 * page.step[i][k]) << i << " " << k;
      else EXPECT_TRUE(std::isnan(page.track[i][k])) << i << " " << k;
    }
  }
  EXPECT_EQ(page.channel[0][0], 1.f);
  EXPECT_TRUE(std::isnan(page.channel[1][0]));
  EXPECT_LT(page.channel[2][0], -1e38f);
  EXPECT_LT(page.step[0][5], 2e-8);
}

TEST(Page, MemoryIsBounded)
{
  PageFrames          frames(100, 1, {});
  std::vector<double> x(100, 1.5);
  int                 n = 0;
  while (!frames.full()) {
    frames.add(n, x.data(), x.data());
    ASSERT_LT(n++, 1000);
  }
  frames.clear();
  EXPECT_EQ(frames.frames(), 0u);
  PageFrames wide(1000000, 0, {});
  x.resize(1000000);
  wide.add(0, x.data(), x.data());
  wide.add(1, x.data(), x.data());
  EXPECT_TRUE(wide.full());
}

TEST(Page, FilesThatCannotBeWritten)
{
  const auto attempt = [](const std::string &options) {
    Rods rods(1);
    return refusal([&] {
      SceneRun run(rods.scene, 0.1, accurate + options);
      return run.solve();
    });
  };
  EXPECT_NE(attempt("-scene_page /dev/full").find("/dev/full"), std::string::npos);
  EXPECT_NE(attempt("-scene_page /nowhere/page.html").find("/nowhere/page.html"), std::string::npos);
  EXPECT_NE(attempt("-scene_page x.html -scene_page_frames 0").find("must be positive"), std::string::npos);
  EXPECT_NE(attempt("-scene_page x.html -scene_page_dt -1").find("must not be negative"), std::string::npos);
  EXPECT_NE(attempt("-scene_page x.html -scene_page_dt 1e-300").find("cannot be 1e-300 apart"), std::string::npos);
  EXPECT_EQ(attempt("-scene_page /dev/null"), "");
}

/* A run that fails before its first frame leaves the page of an earlier run in place */
TEST(Page, IsReplacedWhenItIsWhole)
{
  TemporaryFile file("old.html");
  std::ofstream(file.name) << "old";
  {
    Rods rods(1);
    rods.scene.variable("user", Expression{{Measure::time()}, [](const Real *) -> Real { throw std::range_error("off the table"); }});
    EXPECT_NE(refusal([&] {
                SceneRun run(rods.scene, 0.1, accurate + "-scene_page " + file.name);
                return run.solve();
              }),
              "");
  }
  EXPECT_EQ(file.text(), "old");
  Rods     rods(1);
  SceneRun run(rods.scene, 0.1, accurate + "-scene_page " + file.name);
  must(run.solve());
  EXPECT_NE(file.text().substr(0, 3), "old");
  EXPECT_EQ(PageFile(file.text(), 7, 0).time.size(), 501u);
}

/* The smallest scene: one without bodies is refused by setUp() */
TEST(Page, TheLeastScene)
{
  TemporaryFile file("least.html");
  Scene         scene(PETSC_COMM_SELF);
  scene.add("", PointMass{});
  SceneRun run(scene, 1, "-scene_page_frames 4 -scene_page " + file.name);
  must(run.solve());
  EXPECT_EQ(PageFile(file.text(), 7, 0).time.size(), 5u);
}

/* Frames and blocks of a run that was interrupted and resumed are those of the uninterrupted run, except for the
   limits of blocks */
TEST(Page, ResumedRunsGoOn)
{
  TemporaryFile     whole("whole.html"), broken("broken.html"), checkpoint("page.checkpoint");
  const std::string write = " -ts_hhtdae_checkpoint " + checkpoint.name + " -ts_hhtdae_checkpoint_every 10 ";
  const auto        go    = [](const std::string &file, const std::string &options) {
    Rods rods(2);
    rods.scene.channel("y", Measure::displacement(rods.tip[1], 1), "m");
    SceneRun run(rods.scene, 0.6, accurate + options + " -scene_page_frames 300 -scene_page " + file);
    must(run.solve());
  };
  go(whole.name, "");
  go(broken.name, write + "-ts_max_steps 27");
  const std::size_t before = PageFile(broken.text(), 14, 1).time.size();
  go(broken.name, write + "-ts_hhtdae_resume " + checkpoint.name);
  const PageFile a(whole.text(), 14, 1), b(broken.text(), 14, 1);
  EXPECT_LT(before, b.time.size());
  ASSERT_EQ(a.time, b.time);
  ASSERT_EQ(a.time.size(), 301u);
  for (std::size_t i = 0; i < a.time.size(); i++) {
    EXPECT_EQ(a.channel[i], b.channel[i]);
    for (std::size_t k = 0; k < 14; k++) EXPECT_NEAR(a.track[i][k], b.track[i][k], 0.51 * (a.step[i][k] + b.step[i][k]));
  }
  /* after its file has been deleted the page begins where the run resumes */
  std::remove(broken.name.c_str());
  go(broken.name, write + "-ts_max_steps 27");
  std::remove(broken.name.c_str());
  go(broken.name, write + "-ts_hhtdae_resume " + checkpoint.name);
  const PageFile rest(broken.text(), 14, 1);
  EXPECT_GT(rest.time[0], 0.);
  EXPECT_EQ(rest.time.back(), a.time.back());
}

TEST(Page, DescribesTheScene)
{
  TemporaryFile file("scene.html");
  Rods          rods(2);
  rods.scene.shape(rods.body[0], Shape::box({0.5, 0.1, 0.1}).coloured(0x336699));
  rods.scene.add("pull", SpringDamper{rods.tip[1], rods.scene.marker(rods.scene.ground(), {3, 0, 0}), 1});
  rods.scene.line({rods.centre[0], rods.tip[1]});
  SceneRun run(rods.scene, 0.1, "-scene_page " + file.name);
  must(run.solve());
  const std::string s = PageFile(file.text(), 14, 0).scene;
  EXPECT_NE(s.find("\"planar\":false,\"up\":[0,1,0]"), std::string::npos) << s;
  EXPECT_NE(s.find("{\"kind\":\"box\",\"size\":[0.5,0.1,0.1],\"at\":[0,0,0,0,0,0,0,1],\"colour\":3368601}"), std::string::npos) << s;
  /* the second rod's shape is guessed: the box with its mass and inertia; 1.5 (1/6 + 0.01 - 2/12) is the square of its
     short half edges */
  EXPECT_NE(s.find("\"guess\":true"), std::string::npos) << s;
  EXPECT_NE(s.find("0.122474487139"), std::string::npos) << s;
  EXPECT_NE(s.find("{\"name\":\"pin0\",\"type\":\"revolute\",\"kind\":\"joint\",\"i\":[0,-0.5,0,0,0,0,0,1],\"j\":[-1,0,0,0,0,0,0,1]}"), std::string::npos) << s;
  EXPECT_NE(s.find("\"type\":\"spring-damper\",\"kind\":\"force\""), std::string::npos) << s;
}

#else

TEST(Page, IsRefusedWhereItIsLeftOut)
{
  using namespace hhtest;
  Rods      rods(1);
  ErrorTrap trap;
  SceneRun  run(rods.scene, 0.1, "-scene_page x.html");
  EXPECT_NE(run.solve(), 0);
  EXPECT_NE(trap.message.find("the library was built without"), std::string::npos);
}

#endif
