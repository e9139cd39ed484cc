/* Bricard's mechanism: five rods of a square section, six hinges. */
#ifndef HHTEX_BRICARD_MODEL_H
#define HHTEX_BRICARD_MODEL_H

#include "scene_references.h"

#include <hhtdae/scene.h>

namespace hhtex
{

struct Bricard {
  hhtdae::Scene scene;

  explicit Bricard(double section, MPI_Comm comm = PETSC_COMM_WORLD) : scene(comm)
  {
    using namespace hhtdae;
    using Reference = BricardReference;
    scene.gravity({0, -9.81, 0});
    Body    before = scene.ground();
    Matrix3 axes[3]; /* markers with z along an axis of space */
    axes[0] << 0, 0, 1, 1, 0, 0, 0, 1, 0;
    axes[1] << 0, 1, 0, 0, 0, 1, 1, 0, 0;
    axes[2].setIdentity();
    std::vector<Marker> joints;
    for (int k = 0; k < 6; k++) {
      const Vector3 P    = Reference::point(k);
      Body          next = scene.ground();
      if (k < 5) { /* the rod from P_k to P_k+1 */
        const Vector3 d = Reference::point(k + 1) - P, along = d.cwiseAbs();
        RigidBody     rod;
        rod.mass = 1;
        rod.inertia =
            ((1 + section * section) / 12 * (Vector3::Ones() - along) + section * section / 6 * along).asDiagonal();
        rod.position = P + d / 2;
        next         = scene.add("rod " + std::to_string(k), rod);
        scene.shape(next, Shape::box(along / 2 + Vector3::Ones() * 0.5 * section));
      }
      const Matrix3 &R = axes[Reference::axis(k)];
      const Marker   j = scene.markerAt(before, P, R);
      scene.add("hinge " + std::to_string(k), Revolute{scene.markerAt(next, P, R), j});
      joints.push_back(j);
      before = next;
    }
    for (int k = 2; k < 6; k++)
      for (int c = 0; c < 3; c++)
        scene.channel("P" + std::to_string(k) + "." + "xyz"[c], Measure::displacement(joints[k], c), "m");
    scene.channel("kinetic", Measure::kineticEnergy(), "J");
    scene.channel("potential", Measure::potentialEnergy(), "J");
  }
};

} // namespace hhtex

#endif
