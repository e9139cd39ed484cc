/* Quarter car: body and wheel on vertical guides, suspension, tire in contact with a moving road. */
#ifndef HHTEX_QUARTERCAR_MODEL_H
#define HHTEX_QUARTERCAR_MODEL_H

#include "scene_references.h"

#include <hhtdae/scene.h>

namespace hhtex
{

struct QuarterCar {
  hhtdae::Scene           scene;
  static constexpr double radius = 0.3; /* of the wheel */
  double                  hub, deck;    /* heights at the start, static equilibrium */

  explicit QuarterCar(const QuarterCarReference::Parameters &p, bool torus, MPI_Comm comm = PETSC_COMM_WORLD)
      : scene(comm), hub(radius - p.sink()), deck(hub + 0.4)
  {
    using namespace hhtdae;
    const double weight = p.body * 9.81;
    scene.gravity({0, 0, -9.81});
    RigidBody strip, wheel, body;
    strip.mass     = 1;
    wheel.mass     = p.wheel;
    wheel.inertia  = Vector3(1, 2, 1).asDiagonal();
    wheel.position = {0, 0, hub};
    body.mass      = p.body;
    body.inertia   = Vector3(50, 50, 50).asDiagonal();
    body.position  = {0, 0, deck};
    const Body R = scene.add("road", strip), W = scene.add("wheel", wheel), B = scene.add("body", body),
               ground  = scene.ground();
    const Marker datum = scene.marker(ground), surface = scene.marker(R), axle = scene.marker(W),
                 mount = scene.marker(B);
    scene.shape(R, Shape::box({1, 0.3, 0.01}, {0, 0, -0.01}));
    scene.shape(B, Shape::box({0.6, 0.3, 0.15}));
    scene.add("road's guide", Translational{surface, datum});
    scene.add("wheel's guide", Translational{axle, datum});
    scene.add("body's guide", Translational{mount, datum});
    scene.add("road's motion", TranslationalMotion{surface, datum, p.road});
    scene.add("suspension", SpringDamper{mount, axle, p.stiffness, p.damping, deck - hub, -weight});
    ContactLaw law;
    law.stiffness = p.tire;
    law.damping   = p.tire_damping;
    Matrix3 z_along_y; /* the wheel's axis */
    z_along_y << 0, 1, 0, 0, 0, 1, 1, 0, 0;
    const Marker  rim     = scene.marker(W, {0, 0, 0}, z_along_y);
    const Element contact = torus ? scene.add("tire", TorusPlane{rim, surface, radius - 0.1, 0.1, law})
                                  : scene.add("tire", SpherePlane{rim, surface, radius, law});
    scene.channel("body.z", Measure::displacement(mount, 2), "m");
    scene.channel("wheel.z", Measure::displacement(axle, 2), "m");
    scene.channel("tire", Measure::force(contact, 2), "N");
  }
};

} // namespace hhtex

#endif
