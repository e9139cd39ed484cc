/* Spatial slider-crank: crank about x, rod on a ball and a universal joint; the crank's speed at the start. */
#ifndef HHTEX_SLIDERCRANK3D_MODEL_H
#define HHTEX_SLIDERCRANK3D_MODEL_H

#include <hhtdae/scene.h>

namespace hhtex
{

struct SpatialSliderCrank {
  hhtdae::Scene scene;

  explicit SpatialSliderCrank(double speed, MPI_Comm comm = PETSC_COMM_WORLD) : scene(comm)
  {
    using namespace hhtdae;
    /* ---- bodies, at the start: crank up, rod from B to S ---- */
    const Vector3 A(0, 0.1, 0.12), B(0, 0.1, 0.2), S(0.2, 0, 0), ex = Vector3::UnitX(), ez = Vector3::UnitZ();
    const Vector3 along = (S - B) / 0.3, normal = along.cross(ex).normalized();
    const Vector3 w(speed, 0, 0), wrod = Vector3(0.32, -0.16, 0.08) * speed, vB = w.cross(B - A),
                                  vS(0.04 * speed, 0, 0);
    scene.gravity({0, 0, -9.81});

    RigidBody crank, rod, slider;
    crank.mass             = 0.12;
    crank.inertia          = Vector3(1e-4, 1e-4, 1e-5).asDiagonal();
    crank.position         = (A + B) / 2;
    crank.velocity         = vB / 2;
    crank.angular_velocity = w;
    rod.mass               = 0.5;
    rod.inertia            = Vector3(4e-4, 4e-3, 4e-3).asDiagonal(); /* x along the rod */
    rod.position           = (B + S) / 2;
    rod.rotation << along, normal, along.cross(normal);
    rod.velocity         = (vB + vS) / 2;
    rod.angular_velocity = wrod;
    slider.mass          = 2;
    slider.inertia       = Matrix3::Identity() * 1e-3;
    slider.position      = S;
    slider.velocity      = vS;
    const Body c = scene.add("crank", crank), r = scene.add("rod", rod), s = scene.add("slider", slider),
               ground = scene.ground();
    scene.shape(c, Shape::box({0.01, 0.01, 0.04}));
    scene.shape(r, Shape::box({0.15, 0.008, 0.008}));
    scene.shape(s, Shape::box({0.03, 0.02, 0.02}));

    /* ---- joints; markers where they are at the start ---- */
    const Matrix3 z_along_x = Axes(ex, ez);
    scene.add("crank pin", Revolute{scene.markerAt(c, A, z_along_x), scene.markerAt(ground, A, z_along_x)});
    scene.add("ball", Spherical{scene.markerAt(r, B), scene.markerAt(c, B)});
    scene.add("cross", Universal{scene.markerAt(r, S, Axes(normal, ex)), scene.markerAt(s, S, z_along_x)});
    scene.add("guide", Translational{scene.markerAt(s, S, z_along_x), scene.marker(ground, {0, 0, 0}, z_along_x)});

    scene.channel("slider.x", Measure::displacement(scene.marker(s), 0), "m");
    scene.channel("kinetic", Measure::kineticEnergy(), "J");
    scene.channel("potential", Measure::potentialEnergy(), "J");
  }

private:
  /* axes with z along the first and x along the second of two perpendicular directions */
  static hhtdae::Matrix3 Axes(const hhtdae::Vector3 &z, const hhtdae::Vector3 &x)
  {
    hhtdae::Matrix3 R;
    R << x, z.cross(x), z;
    return R;
  }
};

} // namespace hhtex

#endif
