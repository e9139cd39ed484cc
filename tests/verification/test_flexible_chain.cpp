/* A mechanism with a flexible arm, in modal coordinates and as the whole geometrically nonlinear finite-element model:
   deflections and reactions are compared */
#include "box_model.h"
#include "hhtdae/flexible.h"
#include "scene_output.h"

using namespace hhtest;

namespace
{

const Material soft{2e9, 0.3, 1200};

/* An arm of bricks along x, thin in the direction across its plane of rotation */
struct ArmModel {
  FeModel model{PETSC_COMM_SELF};
  ArmModel() { BoxBuilder({{12, 1, 2}, {0.6, 0.01, 0.04}, soft}, &model); }
};

struct Motion {
  double angle, duration; /* of a smooth rotation, followed by rest for half of the time */
};

/* Columns of a history: deflection of the tip in the hub's axes, forces in the pin, moments of the weld and the drive */
enum { Time, Deflection, PinAlong, PinAcross, Weld, Drive };
using Rows = std::vector<Array>;

std::vector<Attachment> ends()
{
  std::vector<Attachment> a(2);
  a[0].name = "left";
  a[1].name = "right";
  return a;
}

/* A drive at the hub rotates the arm; a block is welded to the tip; no gravity */
void mechanism(Scene &scene, Body hub, Body tip, const Motion &motion)
{
  const Vector3 p(0, 0.005, 0.02), q(0.6, 0.005, 0.02);
  RigidBody     block;
  block.mass         = 0.05;
  block.inertia      = 2e-5 * Matrix3::Identity();
  block.position     = q;
  const Body    load = scene.add("block", block);
  const Marker  axle = scene.markerAt(hub, p), end = scene.markerAt(tip, q), fixed = scene.markerAt(scene.ground(), p);
  const Element pin  = scene.add("pin", Revolute{axle, fixed});
  const Element weld = scene.add("weld", Fixed{end, scene.markerAt(load, q)});
  const Element drive =
      scene.add("drive", RotationalMotion{axle, fixed, TimeFunction::step5(0, 0, motion.duration, motion.angle)});
  scene.channel("deflection", Measure::displacement(end, 1, axle, axle));
  for (int c : {0, 1}) scene.channel(text("pin %d", c), Measure::jointForce(pin, c, axle));
  scene.channel("weld", Measure::jointMoment(weld, 2));
  scene.channel("drive", Measure::jointMoment(drive, 2));
}

Rows histories(Scene &scene, const Motion &motion, int steps)
{
  const double  end = 1.5 * motion.duration;
  SceneRun      run(scene, end,
                    text(" -ts_dt %.17g -ts_adapt_type none -ts_max_steps 10000000 -ts_hhtdae_alpha -0.1 "
                              "-ts_hhtdae_corrector_tolerance 1e-4 "
                              "-ts_rtol 1e-7 -ts_atol 1e-7 ",
                         end / steps));
  TemporaryFile file("flexible_chain.csv");
  scene.output().csv = file.name;
  must(run.solve());
  const CSV table(file.text());
  return table.row;
}

Rows fullRun(const FeModel &model, const Motion &motion, int steps)
{
  Scene      scene(PETSC_COMM_SELF);
  FullFeBody fe;
  FullBody   b;
  b.attachments = ends();
  must(fe.add(scene, "arm", model, b));
  mechanism(scene, fe.attachment("left"), fe.attachment("right"), motion);
  return histories(scene, motion, steps);
}

Rows modalRun(const FeModel &model, PetscInt modes, const Motion &motion, int steps)
{
  Reduction    reduction;
  ReducedBody  body;
  Scene        scene(PETSC_COMM_SELF);
  FlexibleBody b;
  reduction.attachments = ends();
  reduction.modes       = modes;
  must(Reduce(model, reduction, &body));
  b.model        = std::make_shared<ModalBody>(body.modal);
  const Body arm = scene.add("arm", b);
  mechanism(scene, scene.attachment(arm, "left"), scene.attachment(arm, "right"), motion);
  return histories(scene, motion, steps);
}

/* Root mean square of the difference of a column, relative to that of the column */
double difference(const Rows &a, const Rows &b, int column)
{
  double sum = 0, all = 0;
  if (a.size() != b.size()) throw std::runtime_error("not the same number of steps");
  for (std::size_t k = 0; k < a.size(); k++) {
    sum += std::pow(a[k].at(column) - b[k].at(column), 2);
    all += std::pow(b[k].at(column), 2);
  }
  return std::sqrt(sum / all);
}

} // namespace

/* Small rotations, so that terms quadratic in the deformation, which the modal body neglects, are smaller than the
   error of the truncated modes */
TEST(FlexibleChain, DifferenceFallsWithModes)
{
  const ArmModel arm;
  const Motion   motion{0.005, 0.05};
  const Rows     full   = fullRun(arm.model, motion, 400);
  Array          before = {1e9, 1e9, 1e9, 1e9}, last;
  for (PetscInt modes : {0, 1, 4, 8, 16}) {
    const Rows modal = modalRun(arm.model, modes, motion, 400);
    last = {difference(modal, full, Deflection), difference(modal, full, PinAcross), difference(modal, full, Weld),
            difference(modal, full, Drive)};
    MEASURED(
        "%2d normal modes: deflection %.1e, force across the arm in the pin %.1e, moments of weld %.1e and drive %.1e",
        (int)modes, last[0], last[1], last[2], last[3]);
    for (int k = 0; k < 4; k++) EXPECT_LT(last[k], 0.5 * before[k]) << modes << " modes, result " << k;
    before = last;
  }
  EXPECT_LT(last[0], 1e-5);
  EXPECT_LT(last[1], 3e-5);
  EXPECT_LT(last[2], 1e-3);
  EXPECT_LT(last[3], 1e-5);
}

/* Two effects that the modes without stiffening cannot represent: the axial load of the rotation stiffens the arm, and
   bending shortens it. The first effect is a difference proportional to the square of the speed, here one percent of
   the deflection where the arm reaches 15 rad/s. The second effect appears in the force along the arm. It is of second
   order in the motion, as this force itself is, so that its relative size depends on how fast the motion is compared
   with the arm's frequencies, not on its amplitude */
TEST(FlexibleChain, StiffeningGoesWithTheSquareOfTheSpeed)
{
  const ArmModel arm;
  double         deflection[2], along[2];
  for (int k = 0; k < 2; k++) {
    const Motion turn{k ? 0.4 : 0.1, 0.05}, slow{0.4, k ? 0.2 : 0.1};
    deflection[k] = difference(modalRun(arm.model, 16, turn, 400), fullRun(arm.model, turn, 400), Deflection);
    along[k]      = difference(modalRun(arm.model, 16, slow, 400), fullRun(arm.model, slow, 400), PinAlong);
  }
  MEASURED("deflection: %.2e, at four times the speed %.2e; force along the arm: %.2e, in twice the time %.2e",
           deflection[0], deflection[1], along[0], along[1]);
  EXPECT_NEAR(deflection[1] / deflection[0], 16, 3);
  EXPECT_LT(deflection[1], 0.02);
  EXPECT_LT(along[1], 0.4 * along[0]);
}
