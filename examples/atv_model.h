/*
  An all-terrain vehicle on four shaker posts: 28 moving parts, 43 joints, 5 motions, a flexible frame (atv_frame.h),
  after the example of Negrut, Rampalli, Ottarsson and Sajdak. Metres, kilograms, seconds; x forward, y left, z up.

    parts   frame; per corner: post, wheel, lower arm, upper arm, knuckle (4 x 5); two tie rods; steering column; hands
  (30 lb of the rider), rider (200 lb), engine, rack joints  per corner: post's guide, hub (revolute), each arm on the
  frame by a ball and an in-line primitive, two balls of the knuckle (4 x 8); rear toe links (2 point distances); tie
  rods (2 balls, 2 universal joints); column (revolute); hands, rider, engine, rack (4 fixed) motions four posts,
  steering

  Wheelbase 1.27 m, track 0.92 m, tires 25 inches, 346 kg with the rider: a utility vehicle of the 400 cm^3 class.
*/
#ifndef HHTEX_ATV_MODEL_H
#define HHTEX_ATV_MODEL_H

#include "atv_frame.h"

#include <Eigen/LU>
#include <hhtdae/scene.h>
#include <memory>

namespace hhtex
{

using namespace hhtdae;

struct AtvData {
  double wheel_x = 0.635, wheel_y = 0.46, wheel_z = 0.31;    /* centres; the tires' radius is wheel_z */
  double tube      = 0.10;                                   /* radius of a tire's section */
  double spring[2] = {24e3, 28e3}, damper[2] = {1300, 1500}; /* N/m, N s/m; front, rear */
  double preload[2] = {1330, 1880};                          /* N, compression as drawn: close to static equilibrium */
  double tire = 4.5e5, tire_damping = 0.25, grip = 0.8, slip = 0.05; /* N/m^1.5, s/m, Coulomb coefficient, m/s */
  double post[4] = {0.020, -0.020, 0.015, -0.010}; /* m: amplitudes of the harmonic motions; FL, FR, RL, RR */
  double rate[4] = {2.5, 2.5, 3.5, 3};             /* Hz */
  double steer = 0.10, steer_rate = 1;             /* rad, Hz */
};

/* The scene, with the markers, elements and channels that programs read */
struct Atv {
  Scene                            scene;
  AtvData                          data;
  std::shared_ptr<const ModalBody> model;
  Body                             frame, column;
  Marker                           engine;               /* at the engine's centre of mass */
  Element                          rear_ball;            /* lower ball joint of the rear left suspension */
  Channel                          pitch_rate, reaction; /* of the engine, rad/s; vertical, in that joint, N */
  PetscInt                         joints = 0, motions = 0, parts = 0;
  std::vector<Channel>             modal,
      grips; /* after watchFrame(): modal coordinates; x, y, z of the tops of the shock absorbers */

  Atv(MPI_Comm comm, std::shared_ptr<const ModalBody> frame_model, const AtvData &d = {})
      : scene(comm), data(d), model(frame_model)
  {
    scene.output().dt = 4e-3;
    addFrame();
    addSteering();
    for (const AtvCorner &c : AtvCorners()) addCorner(c);
    addMass("rider", 90.7, {9, 8, 4}, "seat", {-0.15, 0, 0.98});
    engine = addMass("engine", 85, {2.4, 3.4, 2.8}, "engine", {0, 0, 0.46});
    addMass("rack", 42, {2.0, 3.0, 4.0}, "rack", {-0.60, 0, 0.76});
    scene.channel("engine height", Measure::displacement(engine, 2), "m");
    scene.gravity({0, 0, -9.80665});
    scene.start().equilibrium = true;
    pitch_rate                = scene.channel("engine pitch rate", Measure::angularVelocity(engine, 1), "rad/s");
    reaction = scene.channel("rear ball joint", Measure::jointForce(rear_ball, 2, scene.marker(scene.ground())), "N");
  }

  /* Adds the channels from which stress and pictures of the frame are computed */
  void watchFrame()
  {
    for (PetscInt k = 0; k < model->modes(); k++)
      modal.push_back(scene.channel("frame mode " + std::to_string(k + 1), Measure::modal(frame, (int)k)));
    for (Marker top : top_)
      for (int c = 0; c < 3; c++)
        grips.push_back(scene.channel("grip " + std::to_string(grips.size() + 1), Measure::displacement(top, c), "m"));
  }
  Eigen::VectorXd modes(const std::vector<double> &channels) const
  {
    return Eigen::Map<const Eigen::VectorXd>(&channels[(std::size_t)modal[0].id], (Eigen::Index)modal.size());
  }
  /* Origin and axes of the floating frame, from the positions of attachments and the modal coordinates. The result is exact, because
     attachments move relative to the floating frame only by the modes. */
  void pose(const std::vector<double> &channels, Vector3 *origin, Matrix3 *axes) const
  {
    Eigen::Matrix<double, 3, 4> from, to;
    int                         k = 0;
    for (const AtvCorner &c : AtvCorners()) {
      const ModalAttachment &a = model->attachments[(std::size_t)model->attachment(c.name + "s")];
      from.col(k)              = a.position + a.translation * modes(channels);
      to.col(k)                = Eigen::Map<const Vector3>(&channels[(std::size_t)grips[3 * (std::size_t)k].id]);
      k++;
    }
    const Eigen::Matrix4d T = Eigen::umeyama(from, to, false);
    *axes                   = T.topLeftCorner<3, 3>();
    *origin                 = T.topRightCorner<3, 1>();
  }

private:
  std::vector<Marker> top_; /* of the shock absorbers */

  template <class Joint> Element join(const std::string &name, const Joint &joint)
  {
    joints++;
    return scene.add(name, joint);
  }
  template <class Motion> void drive(const std::string &name, const Motion &motion)
  {
    motions++;
    scene.add(name, motion);
  }

  Body add(const std::string &name, double mass, const Vector3 &inertia, const Vector3 &position)
  {
    RigidBody b;
    b.mass     = mass;
    b.inertia  = inertia.asDiagonal();
    b.position = position;
    parts++;
    return scene.add(name, b);
  }
  /* A slender rod between two points */
  Body addRod(const std::string &name, double mass, const Vector3 &from, const Vector3 &to)
  {
    const Vector3 d = to - from;
    RigidBody     b;
    b.mass     = mass;
    b.position = 0.5 * (from + to);
    b.inertia =
        mass / 12 * (d.squaredNorm() * Matrix3::Identity() - d * d.transpose()) + 2e-4 * mass * Matrix3::Identity();
    parts++;
    const Body rod = scene.add(name, b);
    scene.line({scene.markerAt(rod, from), scene.markerAt(rod, to)});
    return rod;
  }
  static Matrix3 along(const Vector3 &z, const Vector3 &x)
  {
    Matrix3 R;
    R.col(2) = z.normalized();
    R.col(0) = (x - x.dot(R.col(2)) * R.col(2)).normalized();
    R.col(1) = R.col(2).cross(R.col(0));
    return R;
  }
  Body grip(const std::string &attachment) { return scene.attachment(frame, attachment); }

  void addFrame()
  {
    FlexibleBody b;
    b.model   = model;
    b.damping = {{100, 0.01},
                 {1000, 0.03},
                 {3000, 0.1},
                 {1e9, 1}}; /* 1 % damping in the audible range; critical damping for modes that matter only numerically */
    frame     = scene.add("frame", b);
    parts++;
  }

  Marker addMass(const std::string &name, double mass, const Vector3 &inertia, const std::string &attachment,
                 const Vector3 &at)
  {
    const Body body = add(name, mass, inertia, at);
    join(name + " mount", Fixed{scene.markerAt(body, at), scene.markerAt(grip(attachment), at)});
    scene.shape(body, Shape::sphere(0.1));
    return scene.markerAt(body, at);
  }

  void addSteering()
  {
    const Vector3 head(0.376, 0, 0.76), axis = Vector3(-0.154, 0, 0.36).normalized(), bars = head + 0.26 * axis;
    const Matrix3 R = along(axis, Vector3::UnitX());
    column          = add("column", 5, {0.25, 0.2, 0.12}, head + 0.05 * axis);
    const Marker c = scene.markerAt(column, head, R), h = scene.markerAt(grip("head"), head, R);
    const double w = 2 * PETSC_PI * data.steer_rate;
    join("steering bearing", Revolute{c, h});
    drive("steering", RotationalMotion{c, h, TimeFunction::harmonic(data.steer, w, -PETSC_PI / 2, data.steer)});
    const Body hands = add("hands", 13.6, {0.5, 0.1, 0.5}, bars);
    join("grips", Fixed{scene.markerAt(hands, bars), scene.markerAt(column, bars)});
    scene.line({scene.markerAt(column, head - 0.39 * axis), scene.markerAt(column, bars)});
  }

  /* An arm on the frame: a ball joint at its first pivot; the second pivot stays on the line through both (in-line primitive) */
  Body addArm(const std::string &name, double mass, const Vector3 &first, const Vector3 &second, const Vector3 &ball,
              Body at_first, Body at_second)
  {
    const Body arm = addRod(name, mass, 0.5 * (first + second), ball);
    join(name + " pivot", Spherical{scene.markerAt(arm, first), scene.markerAt(at_first, first)});
    join(name + " bush", InLine{scene.markerAt(arm, second),
                                scene.markerAt(at_second, second, along(second - first, Vector3::UnitZ()))});
    scene.line({scene.markerAt(arm, first), scene.markerAt(arm, ball), scene.markerAt(arm, second)});
    return arm;
  }

  void addCorner(const AtvCorner &c)
  {
    const bool        front = c.end > 0;
    const std::string n     = c.name;
    const Vector3     hub = c.at(data.wheel_x, data.wheel_y, data.wheel_z), low = c.at(0.635, 0.40, 0.245),
                  high = c.at(0.622, 0.385, 0.405);
    const Vector3 a = c.at(0.73, 0.172, AtvRail(0.73)), b = c.at(0.54, 0.172, AtvRail(0.54));
    const Vector3 u = c.at(0.70, 0.165, 0.49), v = c.at(0.57, 0.165, 0.49);
    const Body    knuckle = add(n + " knuckle", front ? 3. : 3.5, {0.02, 0.02, 0.015}, c.at(0.635, 0.41, 0.31));
    const Body    lower   = addArm(n + " lower arm", front ? 2.2 : 2.6, a, b, low, grip(n + "a"), grip(n + "b"));
    const Body    upper   = addArm(n + " upper arm", front ? 1.4 : 1.6, u, v, high, grip(n + "u"), grip(n + "u"));
    const Element ball = join(n + " lower ball", Spherical{scene.markerAt(knuckle, low), scene.markerAt(lower, low)});
    if (n == "RL") rear_ball = ball;
    join(n + " upper ball", Spherical{scene.markerAt(knuckle, high), scene.markerAt(upper, high)});
    if (front)
      addTieRod(c, knuckle);
    else {
      const Vector3 in = b, out = c.at(0.53, 0.39, 0.31);
      join(n + " toe link", PointDistance{scene.markerAt(knuckle, out), scene.markerAt(grip(n + "b"), in)});
    }
    addShock(c, lower, a, b, low);
    addWheel(c, knuckle, hub);
  }

  void addTieRod(const AtvCorner &c, Body knuckle)
  {
    const Vector3 in(0.53, 0.05 * c.side, 0.40), out = c.at(0.53, 0.39, 0.33), d = out - in;
    const Body    rod = addRod(c.name + " tie rod", 0.6, in, out);
    join(c.name + " tie ball", Spherical{scene.markerAt(rod, out), scene.markerAt(knuckle, out)});
    const Vector3 cross = d.cross(Vector3::UnitX());
    join(c.name + " tie universal",
         Universal{scene.markerAt(rod, in, along(cross, d)), scene.markerAt(column, in, along(d.cross(cross), d))});
  }

  void addShock(const AtvCorner &c, Body lower, const Vector3 &a, const Vector3 &b, const Vector3 &ball)
  {
    const int     k    = c.end > 0 ? 0 : 1;
    const Vector3 foot = 0.35 * 0.5 * (a + b) + 0.65 * ball + Vector3(0, 0, 0.02),
                  top  = c.at(0.635, 0.172, k ? 0.65 : 0.63);
    const Marker i = scene.markerAt(grip(c.name + "s"), top), j = scene.markerAt(lower, foot);
    scene.add(c.name + " shock", SpringDamper{i, j, data.spring[k], data.damper[k], -1, -data.preload[k]});
    scene.line({i, j});
    top_.push_back(i);
  }

  void addWheel(const AtvCorner &c, Body knuckle, const Vector3 &hub)
  {
    const int     k      = (c.end > 0 ? 0 : 2) + (c.side > 0 ? 0 : 1);
    const Matrix3 axle   = along(Vector3::UnitY(), Vector3::UnitX());
    const Body    wheel  = add(c.name + " wheel", c.end > 0 ? 9 : 11, {0.30, 0.55, 0.30}, hub);
    const Marker  center = scene.markerAt(wheel, hub, axle), bearing = scene.markerAt(knuckle, hub, axle);
    join(c.name + " hub", Revolute{center, bearing});
    scene.add(c.name + " drag", TorsionalSpringDamper{center, bearing, 0, 0.5});

    const Body   post = add(c.name + " post", 30, {0.5, 0.5, 0.5}, {hub.x(), hub.y(), -0.05});
    const Marker top  = scene.markerAt(post, {hub.x(), hub.y(), 0}),
                 base = scene.markerAt(scene.ground(), {hub.x(), hub.y(), 0});
    const double w = 2 * PETSC_PI * data.rate[k], z = data.post[k];
    join(c.name + " guide", Translational{top, base});
    drive(c.name + " shaker", TranslationalMotion{top, base, TimeFunction::harmonic(z, w, -PETSC_PI / 2, z)});

    ContactLaw law;
    law.stiffness      = data.tire;
    law.damping        = data.tire_damping;
    law.friction       = data.grip;
    law.slip_velocity  = data.slip;
    const Element tire = scene.add(c.name + " tire", TorusPlane{center, top, data.wheel_z - data.tube, data.tube, law});
    scene.channel(c.name + " tire", Measure::force(tire, 2), "N");
    scene.shape(wheel, Shape::cylinder(data.wheel_z, 2 * data.tube, Vector3::Zero(), axle).coloured(0x49505c));
    scene.shape(post, Shape::box({0.15, 0.12, 0.02}, {0, 0, 0.03}).coloured(0xaab3bf));
  }
};

} // namespace hhtex

#endif
