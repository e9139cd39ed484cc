/* Channels and their files, animation: the files contain what the run had */
#include "hhtdae/linearize.h"
#include "scene/kernels/spring.h"
#include "scene/kernels/spring_torsion.h"
#include "scene/output/vtp.h"
#include "scene/runtime.h"
#include "scene_output.h"
#include <cstring>

using namespace hhtest;

namespace
{

const std::string tight = " -ts_rtol 1e-8 -ts_atol 1e-8 ";

struct Interpolated {
  double dt, next = 0;
  Array  t, x, v;
};

/* The first rod's centre directly from the integrator, at multiples of dt */
PetscErrorCode Interpolate(TS ts, PetscInt step, PetscReal t, Vec U, void *ctx)
{
  Interpolated      &s = *static_cast<Interpolated *>(ctx);
  Vec                u, v;
  const PetscScalar *a;
  PetscFunctionBegin;
  if (step == 0) PetscFunctionReturn(0);
  PetscCall(VecDuplicate(U, &u));
  PetscCall(VecDuplicate(U, &v));
  for (; s.next * s.dt <= t + 1e-12; s.next++) {
    PetscCall(TSHHT3Interpolate(ts, std::min(s.next * s.dt, t), u, v, nullptr));
    s.t.push_back(s.next * s.dt);
    PetscCall(VecGetArrayRead(u, &a));
    s.x.push_back(a[1]);
    PetscCall(VecRestoreArrayRead(u, &a));
    PetscCall(VecGetArrayRead(v, &a));
    s.v.push_back(a[0]);
    PetscCall(VecRestoreArrayRead(v, &a));
  }
  PetscCall(VecDestroy(&u));
  PetscCall(VecDestroy(&v));
  PetscFunctionReturn(0);
}

} // namespace

TEST(SceneOutput, SamplesAreTheDenseOutput)
{
  TemporaryFile file("samples.csv");
  Rods          rods(1);
  Interpolated  expected{0.05, 0, {}, {}, {}};
  rods.scene.channel("y", Measure::displacement(rods.centre[0], 1), "m");
  rods.scene.channel("vx", Measure::velocity(rods.centre[0], 0), "m/s");
  SceneRun run(rods.scene, 1, tight + "-scene_rate 20 -scene_csv " + file.name);
  must(TSMonitorSet(run.ts, Interpolate, &expected, nullptr));
  must(run.solve());
  const CSV table(file.text());
  EXPECT_EQ(table.name, (std::vector<std::string>{"time", "y [m]", "vx [m/s]"}));
  ASSERT_EQ(table.row.size(), 21u);
  ASSERT_EQ(expected.t.size(), 21u);
  for (int k = 0; k < 21; k++) {
    EXPECT_NEAR(table.row[k][0], 0.05 * k, 1e-14);
    EXPECT_NEAR(table.row[k][1], expected.x[k], 1e-14) << k;
    EXPECT_NEAR(table.row[k][2], expected.v[k], 1e-14) << k;
  }
  EXPECT_LT(table.row[10][1], -0.1);
}

/* A rod released from the horizontal: initially alpha = 3g/(2L), and the pin carries m g/4; at any time the reaction
   is m (a - g) */
TEST(SceneOutput, ReactionOfARevoluteJoint)
{
  TemporaryFile file("reaction.csv");
  Rods          rods(1);
  for (int c = 0; c < 3; c++) {
    const std::string axis(1, "xyz"[c]);
    rods.scene.channel("f" + axis, Measure::jointForce(rods.pin[0], c), "N");
    rods.scene.channel("m" + axis, Measure::jointMoment(rods.pin[0], c), "N m");
    rods.scene.channel("a" + axis, Measure::acceleration(rods.centre[0], c), "m/s^2");
    rods.scene.channel("local" + axis, Measure::jointForce(rods.pin[0], c, rods.centre[0]), "N");
  }
  rods.scene.channel("alpha", Measure::angularAcceleration(rods.centre[0], 2));
  rods.scene.output().csv = file.name;
  rods.scene.output().dt  = 0.1;
  SceneRun run(rods.scene, 1, " -ts_rtol 1e-10 -ts_atol 1e-10 ");
  must(run.solve());
  const CSV   table(file.text());
  const Array fx = table.column("fx"), fy = table.column("fy"), lx = table.column("localx"), ly = table.column("localy");
  ASSERT_EQ(table.row.size(), 11u);
  EXPECT_NEAR(fy[0], 9.81 / 4, 1e-9);
  EXPECT_NEAR(table.column("alpha")[0], -1.5 * 9.81, 1e-8);
  for (std::size_t k = 0; k < table.row.size(); k++) {
    EXPECT_NEAR(fx[k], table.column("ax")[k], 1e-4) << k; /* between steps both are interpolated linearly, but not the angle */
    EXPECT_NEAR(fy[k], table.column("ay")[k] + 9.81, 1e-4) << k;
    for (const char *zero : {"fz", "mx", "my", "mz"}) EXPECT_NEAR(table.column(zero)[k], 0, 1e-3) << zero << k;
    EXPECT_NEAR(std::hypot(lx[k], ly[k]), std::hypot(fx[k], fy[k]), 1e-9);
  }
  EXPECT_GT(std::abs(lx[5] - fx[5]), 1);
}

#if defined(PETSC_HAVE_HDF5)
extern "C" PetscErrorCode PetscViewerHDF5ReadAttribute(PetscViewer, const char[], const char[], PetscDataType, const void *, void *);

namespace
{

Array Dataset(PetscViewer viewer, const char *name, PetscInt n)
{
  Vec x;
  must(VecCreateSeq(PETSC_COMM_SELF, n, &x));
  must(PetscObjectSetName((PetscObject)x, name));
  must(VecLoad(x, viewer));
  const Array a = whole(x);
  must(VecDestroy(&x));
  return a;
}

} // namespace

/* More samples than a block, so that datasets are extended; datasets in a group */
TEST(SceneOutput, HDF5HasWhatTheTableHas)
{
  TemporaryFile file("run.h5"), csv("run.csv");
  Rods          rods(1);
  rods.scene.channel("tip", Measure::displacement(rods.tip[0], 1), "m");
  rods.scene.channel("energy/kinetic", energy(Measure::KineticEnergy), "J");
  SceneRun run(rods.scene, 1, tight + "-scene_dt 0.002 -scene_output " + file.name + " -scene_csv " + csv.name);
  must(run.solve());
  const CSV table(csv.text());
  ASSERT_EQ(table.row.size(), 501u);
  PetscViewer viewer;
  char       *unit;
  must(PetscViewerCreate(PETSC_COMM_SELF, &viewer));
  must(PetscViewerSetType(viewer, PETSCVIEWERHDF5));
  must(PetscViewerFileSetMode(viewer, FILE_MODE_READ));
  must(PetscViewerFileSetName(viewer, file.name.c_str()));
  EXPECT_EQ(Dataset(viewer, "time", 501), table.column("time"));
  EXPECT_EQ(Dataset(viewer, "tip", 501), table.column("tip"));
  EXPECT_EQ(Dataset(viewer, "energy/kinetic", 501), table.column("energy/kinetic"));
  must(PetscViewerHDF5ReadAttribute(viewer, "/energy/kinetic", "units", PETSC_STRING, nullptr, &unit));
  EXPECT_STREQ(unit, "J");
  must(PetscFree(unit));
  must(PetscViewerDestroy(&viewer));
}
#endif

/* A further solve continues the same files without repeating a sample */
TEST(SceneOutput, GoesOnAfterAPause)
{
  TemporaryFile file("pause.csv");
  Rods          rods(1);
  rods.scene.channel("t", Measure::time());
  SceneRun run(rods.scene, 0.5, tight + "-scene_dt 0.1 -scene_csv " + file.name);
  must(run.solve());
  ASSERT_EQ(CSV(file.text()).row.size(), 6u);
  must(TSSetMaxTime(run.ts, 1));
  must(run.solve());
  const CSV table(file.text());
  ASSERT_EQ(table.row.size(), 11u);
  for (int k = 0; k < 11; k++) EXPECT_NEAR(table.row[k][1], 0.1 * k, 1e-12);
}

TEST(SceneOutput, EveryStepWithoutADistance)
{
  TemporaryFile file("steps.csv");
  Rods          rods(1);
  PetscInt      steps;
  rods.scene.channel("t", Measure::time());
  SceneRun run(rods.scene, 0.5, tight + "-scene_csv " + file.name);
  must(run.solve());
  must(TSGetStepNumber(run.ts, &steps));
  EXPECT_EQ(CSV(file.text()).row.size(), (std::size_t)steps + 1);
}

TEST(SceneOutput, NothingIsRecordedThatWasNotAskedFor)
{
  Rods rods(1);
  rods.scene.channel("t", Measure::time());
  SceneRun run(rods.scene, 0.1, "");
  must(run.solve());
  EXPECT_EQ(RunOf(run.ts)->recorder, nullptr);
}

TEST(SceneOutput, SaysWhatIsWrong)
{
  Rods rods(1);
  rods.scene.channel("a", Measure::displacement(Marker{99}, 0));
  rods.scene.channel("a", Measure::time());
  rods.scene.channel("/b/", Measure::time());
  rods.scene.channel("time", Measure::time());
  rods.scene.channel("time/step", Measure::time());
  rods.scene.channel("arm", Measure::time());
  rods.scene.channel("arm/x", Measure::time());
  rods.scene.channel("c", Measure::jointForce(Element{7}, 0));
  rods.scene.shape(Body{5}, Shape::sphere(1));
  ErrorTrap trap;
  EXPECT_NE(rods.scene.setUp(), 0);
  for (const char *part : {"channel a: marker i", "there is one of this name", "begins nor ends with /", "taken by the times", "channel time/step: this name is taken", "channel arm/x: there is channel arm", "channel c:", "shape: its body"})
    EXPECT_TRUE(trap.says(part)) << part << "\n" << trap.message;
}

TEST(SceneOutput, FilesWithoutChannelsAndLateChannels)
{
  TemporaryFile file("none.csv");
  Rods          rods(1);
  SceneRun      run(rods.scene, 0.1, "-scene_csv " + file.name);
  {
    ErrorTrap trap;
    EXPECT_NE(run.solve(), 0);
    EXPECT_TRUE(trap.says("no channels")) << trap.message;
  }
  rods.scene.channel("t", Measure::time());
  ErrorTrap trap;
  EXPECT_NE(run.solve(), 0);
  EXPECT_TRUE(trap.says("channel t came too late")) << trap.message; /* when files are requested that would lack this channel */
}

/* A run continues unchanged after its scene has been changed; only the next run reports additions that came too late */
TEST(SceneOutput, ARunOutlivesALateChannel)
{
  Rods rods(1);
  rods.scene.channel("t", Measure::time());
  SceneRun            run(rods.scene, 0.1, "");
  std::vector<double> x;
  must(run.solve());
  rods.scene.channel("late", Measure::time());
  must(rods.scene.sample(run.ts, 0.1, x));
  EXPECT_EQ(x.size(), 1u);
  must(TSSetMaxTime(run.ts, 0.2));
  must(run.solve());
  TS        next;
  ErrorTrap trap;
  EXPECT_NE(rods.scene.createTS(&next), 0);
  EXPECT_TRUE(trap.says("channel late came too late")) << trap.message;
}

/* Scene::solve() writes results; TSSolve() reports that it does not */
TEST(SceneOutput, TSSolveInPlaceOfSolve)
{
  TemporaryFile file("tssolve.csv");
  Rods          rods(1);
  rods.scene.channel("t", Measure::time());
  rods.scene.output().csv = file.name;
  {
    SceneRun run(rods.scene, 0.1, "");
    Printed  printed;
    must(TSSolve(run.ts, nullptr));
    EXPECT_TRUE(printed.says("which Scene::solve() writes")) << printed.text();
    EXPECT_FALSE(file.exists());
  }
  SceneRun run(rods.scene, 0.1, "");
  Printed  printed;
  must(run.solve());
  EXPECT_FALSE(printed.says("which Scene::solve() writes"));
  EXPECT_TRUE(file.exists());
}

/* ---- animation ---- */

namespace
{

/* Number of elements of this name in an XML file; all elements must be closed in the right order */
int Elements(const std::string &text, const std::string &name)
{
  std::vector<std::string> open;
  int                      found = 0;
  for (std::size_t at = text.find('<'); at != std::string::npos; at = text.find('<', at + 1)) {
    const std::size_t end = text.find('>', at);
    if (end == std::string::npos) throw std::runtime_error("a tag without an end");
    const std::string tag = text.substr(at + 1, end - at - 1), word = tag.substr(0, tag.find(' '));
    if (tag[0] == '?') continue;
    if (tag[0] == '/') {
      if (open.empty() || open.back() != tag.substr(1)) throw std::runtime_error("</" + tag + "> closes nothing");
      open.pop_back();
      continue;
    }
    if (word == name) found++;
    if (tag.back() != '/') open.push_back(word);
  }
  if (!open.empty()) throw std::runtime_error(open.back() + " is not closed");
  return found;
}

/* The binary content of a data array */
template <class T> std::vector<T> Data(const std::string &text, const std::string &name)
{
  const std::size_t tag = text.find("Name=\"" + name + "\""), begin = text.find('>', tag) + 1, end = text.find('<', begin);
  const std::string digits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string       raw;
  unsigned          bits = 0;
  int               count = 0;
  for (std::size_t k = begin; k < end && text[k] != '='; k++) {
    bits = bits << 6 | (unsigned)digits.find(text[k]);
    if ((count += 6) >= 8) raw += (char)(bits >> (count -= 8) & 255);
  }
  std::uint64_t bytes;
  std::memcpy(&bytes, raw.data(), 8);
  if (raw.size() != 8 + bytes) throw std::runtime_error(name + " has another size than its header says");
  std::vector<T> values(bytes / sizeof(T));
  if (bytes) std::memcpy(values.data(), raw.data() + 8, bytes);
  return values;
}

} // namespace

TEST(SceneOutput, FramesOfTheAnimation)
{
  TemporaryFile index("film.pvd");
  const std::string prefix = index.name.substr(0, index.name.size() - 4);
  TemporaryFile frame[] = {TemporaryFile("film_000000.vtp"), TemporaryFile("film_000001.vtp"), TemporaryFile("film_000002.vtp")};
  Rods          rods(2);
  rods.scene.shape(rods.body[0], Shape::box({0.5, 0.1, 0.2}));
  rods.scene.shape(rods.scene.ground(), Shape::sphere(0.1));
  rods.scene.line({rods.centre[0], rods.tip[1]});
  SceneRun run(rods.scene, 0.2, tight + "-scene_animation_dt 0.1 -scene_animation " + prefix);
  must(run.solve());
  EXPECT_EQ(Elements(index.text(), "DataSet"), 3);
  for (const TemporaryFile &f : frame) {
    const std::string text = f.text();
    EXPECT_EQ(Elements(text, "Piece"), 1);
    const auto points = Data<float>(text, "points"), speed = Data<float>(text, "speed");
    const auto body = Data<int>(text, "body"), offsets = Data<int>(text, "offsets");
    EXPECT_EQ(body.size(), speed.size());
    EXPECT_EQ(points.size() % 3, 0u);
    EXPECT_NE(text.find("NumberOfPoints=\"" + std::to_string(points.size() / 3) + "\""), std::string::npos);
    EXPECT_NE(text.find("NumberOfLines=\"" + std::to_string(offsets.size()) + "\""), std::string::npos);
    EXPECT_EQ(*std::min_element(body.begin(), body.end()), -1);
    EXPECT_EQ(*std::max_element(body.begin(), body.end()), 1);
  }
  /* the box comes first: initially its corner is at (0, -0.1, -0.2); it moves, and its edges keep their lengths */
  const auto p0 = Data<float>(frame[0].text(), "points"), p2 = Data<float>(frame[2].text(), "points");
  EXPECT_NEAR(p0[0], 0, 1e-6);
  EXPECT_NEAR(p0[1], -0.1, 1e-6);
  EXPECT_NEAR(p0[2], -0.2, 1e-6);
  EXPECT_GT(std::abs(p2[4] - p0[4]), 0.01);
  EXPECT_NEAR(std::hypot(p2[3] - p2[0], p2[4] - p2[1]), 1, 1e-5);
}

/* Frames at opposite phases of a mode are on opposite sides of the state */
TEST(SceneOutput, FramesOfAMode)
{
  Rods              rods(4);
  Linearization     small;
  std::vector<Mode> modes;
  TemporaryFile     index("mode.pvd"), frame[] = {TemporaryFile("mode_000000.vtp"), TemporaryFile("mode_000001.vtp"), TemporaryFile("mode_000002.vtp"), TemporaryFile("mode_000003.vtp")};
  for (int k = 0; k < 4; k++) rods.scene.shape(rods.body[k], Shape::box({0.5, 0.1, 0.1}));
  SceneRun run(rods.scene, 0.1, tight);
  must(small.take(run.ts));
  must(small.modes(&modes));
  must(small.animate(modes.back(), index.name.substr(0, index.name.size() - 4), 0.1, 4));
  EXPECT_EQ(Elements(index.text(), "DataSet"), 4);
  std::vector<float> point[4];
  for (int k = 0; k < 4; k++) point[k] = Data<float>(frame[k].text(), "points");
  double moved = 0, between = 0;
  ASSERT_EQ(point[0].size(), 4u * 8u * 3u);
  for (std::size_t i = 0; i < point[0].size(); i++) {
    widen(moved, std::abs(point[0][i] - point[2][i]));
    widen(between, std::abs(point[0][i] + point[2][i] - point[1][i] - point[3][i]));
  }
  EXPECT_GT(moved, 0.1);
  EXPECT_LT(between, 0.2 * moved); /* of second order in the rotations */
}

TEST(SceneOutput, Base64OfAnyLength)
{
  for (int n = 0; n < 6; n++) {
    TemporaryFile file("base64.vtp");
    PolyData      d;
    for (int k = 0; k < 3 * n; k++) d.points.push_back(0.1f * (float)k);
    for (int k = 0; k < n; k++) d.body.push_back(k - 1);
    must(WriteVTP(file.name, d));
    EXPECT_EQ(Data<float>(file.text(), "points"), d.points);
    EXPECT_EQ(Data<int>(file.text(), "body"), d.body);
  }
}

/* ---- potential energy ---- */

namespace
{

/* -dE/d(x, theta) of both markers against the wrench */
template <class K> void ExpectPotential(const typename K::Data &d, const Frame<double> *f)
{
  const Twist<double> still[2] = {{Vector3::Zero(), Vector3::Zero()}, {Vector3::Zero(), Vector3::Zero()}};
  Wrench<double>      on[2];
  K::wrench(d, f, still, 0, nullptr, on);
  for (int k = 0; k < 12; k++) {
    double E[2];
    for (int side = 0; side < 2; side++) {
      Frame<double> moved[2] = {f[0], f[1]};
      const double  h        = side ? 1e-5 : -1e-5;
      Frame<double> &m       = moved[k / 6];
      if (k % 6 < 3) m.x(k % 6) += h;
      else m.R = Eigen::AngleAxisd(h, Vector3::Unit(k % 6 - 3)) * m.R;
      E[side] = K::energy(d, moved);
    }
    const Wrench<double> &w = on[k / 6];
    EXPECT_NEAR((E[0] - E[1]) / 2e-5, k % 6 < 3 ? w.f(k % 6) : w.m(k % 6 - 3), 1e-6) << k;
  }
}

} // namespace

TEST(SceneOutput, SpringsHaveTheirPotential)
{
  std::srand(3);
  Frame<double> f[2];
  for (Frame<double> &k : f) k = {Vector3::Random(), Eigen::Quaterniond::UnitRandom().toRotationMatrix()};
  ExpectPotential<LinearSpring<false>>({30, 0, 0.7, 2}, f);
  ExpectPotential<LinearSpring<true>>({30, 5, 0.7, 2}, f);
  ExpectPotential<LinearTorsion<false>>({{0}, 30, 0, 0.7, 2}, f);
}
