/* Problems and scenes on which nothing was tuned: the constants of the choice of order were fixed before these were
   first run, and are not changed because of them. They are judged separately (-problems heldout) */
#ifndef WORKPRECISION_HELDOUT_H
#define WORKPRECISION_HELDOUT_H

#include "problems/fekete.h"
#include "problems/wheelset.h"
#include "workprecision_cases.h"
#include "workprecision_scenes.h"

namespace wp
{

/* A bridge and a trolley that start and stop smoothly, with a load that swings on a rope, modelled as a light rod on a
   universal joint */
inline void AddCrane(Scene &s)
{
  using namespace hhtdae;
  RigidBody bridge, trolley, rope, load;
  Matrix3   along_x, along_y; /* z axes of markers */
  along_x << 0, 0, 1, 1, 0, 0, 0, 1, 0;
  along_y << 0, 1, 0, 0, 0, 1, 1, 0, 0;
  s.gravity({0, 0, -9.81});
  bridge.mass      = 400;
  bridge.inertia   = Vector3(300, 20, 300).asDiagonal();
  trolley.mass     = 80;
  trolley.inertia  = Vector3(5, 5, 8).asDiagonal();
  rope.mass        = 2;
  rope.inertia     = Vector3(1.5, 1.5, 1e-3).asDiagonal();
  rope.position    = {0, 0, -1.5};
  load.mass        = 150;
  load.inertia     = Vector3(12, 30, 25).asDiagonal();
  load.position    = {0, 0, -3.5};
  const Body B = s.add("bridge", bridge), T = s.add("trolley", trolley), R = s.add("rope", rope);
  load.angular_velocity = {0, 0, 0.8};
  const Body L          = s.add("load", load);
  const Marker rail = s.marker(s.ground(), Vector3::Zero(), along_x), on_rail = s.marker(B, Vector3::Zero(), along_x), beam = s.marker(B, Vector3::Zero(), along_y),
               on_beam = s.marker(T, Vector3::Zero(), along_y);
  s.add("rail", Translational{on_rail, rail});
  s.add("beam", Translational{on_beam, beam});
  s.add("travel", TranslationalMotion{on_rail, rail, TimeFunction::step5(0, 0, 2, 2.5)});
  s.add("traverse", TranslationalMotion{on_beam, beam, TimeFunction::step5(0.5, 0, 2, -1.5)});
  s.add("drum", Universal{s.marker(R, {0, 0, 1.5}, along_x), s.marker(T, Vector3::Zero(), along_y)});
  s.add("hook", Spherical{s.marker(L, {0, 0, 0.5}), s.marker(R, {0, 0, -1.5})});
  for (int c = 0; c < 3; c++) s.channel("", Measure::displacement(s.marker(L, {1, 0, 0}), c), "m");
}

/* A free tumbling rigid body with two panels on hinges with springs and two booms, elastic beams with end masses; only
   the booms have damping, and only little */
inline void AddSatellite(Scene &s)
{
  using namespace hhtdae;
  const Vector3 w(0.1, 0.6, 0.25);
  Matrix3       along_y;
  RigidBody     hub, panel, tip;
  along_y << 0, 1, 0, 0, 0, 1, 1, 0, 0;
  s.gravity(Vector3::Zero());
  hub.mass             = 500;
  hub.inertia          = Vector3(180, 250, 300).asDiagonal();
  hub.angular_velocity = w;
  const Body H         = s.add("hub", hub);
  const auto turning   = [&](RigidBody &b, const Vector3 &x) {
    b.position         = x;
    b.angular_velocity = w;
    b.velocity         = w.cross(x);
  };
  for (double side : {1., -1.}) {
    const std::string which = side > 0 ? " right" : " left";
    const Vector3     hinge(side, 0, 0);
    panel.mass    = 20;
    panel.inertia = Vector3(7, 2, 9).asDiagonal();
    turning(panel, {2 * side, 0, 0});
    const Body   P = s.add("panel" + which, panel);
    const Marker i = s.markerAt(P, hinge, along_y), j = s.markerAt(H, hinge, along_y);
    TorsionalSpringDamper spring;
    spring.i         = i;
    spring.j         = j;
    spring.stiffness = 300;
    s.add("hinge" + which, Revolute{i, j});
    s.add("spring" + which, spring);
    tip.mass    = 4;
    tip.inertia = Vector3(0.02, 0.03, 0.03).asDiagonal();
    turning(tip, {0, 0, 3 * side});
    const Body M = s.add("tip" + which, tip);
    Matrix3    outwards;
    outwards << 0, 1, 0, 0, 0, side, side, 0, 0; /* x of the beam points away from the hub */
    Beam boom;
    boom.i    = s.markerAt(M, {0, 0, 3 * side}, outwards);
    boom.j    = s.markerAt(H, {0, 0, side}, outwards);
    boom.E    = 7e10;
    boom.G    = 2.7e10;
    boom.area = 4e-4;
    boom.Iyy = boom.Izz = 2e-8;
    boom.J              = 4e-8;
    boom.damping        = 2e-3;
    s.add("boom" + which, boom);
    for (int c = 0; c < 3; c++) s.channel("", Measure::displacement(s.marker(M), c), "m");
    for (int c = 0; c < 3; c++) s.channel("", Measure::displacement(s.marker(P, {side, 0, 0}), c), "m");
  }
}

/* A rotor in two frames; a motion rotates the outer frame, and a weight acts on the inner one */
inline void AddGyroscope(Scene &s)
{
  using namespace hhtdae;
  Matrix3   along_x, along_y;
  RigidBody outer, inner, rotor;
  along_x << 0, 0, 1, 1, 0, 0, 0, 1, 0;
  along_y << 0, 1, 0, 0, 0, 1, 1, 0, 0;
  s.gravity({0, 0, -9.81});
  outer.mass             = 1;
  outer.inertia          = Vector3(0.02, 0.02, 0.03).asDiagonal();
  inner.mass             = 0.5;
  inner.inertia          = Vector3(0.006, 0.008, 0.007).asDiagonal();
  inner.center           = {0, 0.02, 0};
  rotor.mass             = 2;
  rotor.inertia          = Vector3(0.004, 0.0075, 0.004).asDiagonal();
  rotor.angular_velocity = {0, 40, 0};
  const Body   O = s.add("outer", outer), I = s.add("inner", inner), R = s.add("rotor", rotor);
  const Marker frame = s.marker(O), ground = s.marker(s.ground());
  s.add("stand", Revolute{frame, ground});
  s.add("turn", RotationalMotion{frame, ground, TimeFunction::step5(0.1, 0, 0.9, 1)});
  s.add("gimbal", Revolute{s.markerAt(I, Vector3::Zero(), along_x), s.markerAt(O, Vector3::Zero(), along_x)});
  s.add("bearing", Revolute{s.markerAt(R, Vector3::Zero(), along_y), s.markerAt(I, Vector3::Zero(), along_y)});
  for (int c = 0; c < 3; c++) s.channel("", Measure::displacement(s.marker(I, {0, 0.1, 0}), c), "m");
}

inline std::vector<Case> heldOut()
{
#if defined(HHTDAE_HAVE_IDA)
  return {
      makeCase<hhtex::Fekete>("held:fekete"),
      makeCase<hhtex::Wheelset>("held:wheelset"),
      makeScene("held:crane3d", 4., Filled(AddCrane)),
      makeScene("held:satellite", 10., Filled(AddSatellite)),
      makeScene("held:gyroscope", 1., Filled(AddGyroscope)),
  };
#else
  return {};
#endif
}

} // namespace wp

#endif
