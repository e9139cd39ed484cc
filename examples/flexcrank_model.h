/*
  The planar slider-crank with an elastic rod of B. Simeon ("Modelling a flexible slider crank mechanism by a mixed system of DAEs
  and PDEs", 1996; problem "crank" of the test set for IVP solvers). Displacements of the rod in its own axes, x through its
  undeformed ends, xi = x/L:

    across: sin(pi xi) q1 + sin(2 pi xi) q2,   along: 4 xi (1 - xi) q3 + xi (2 xi - 1) q4

  Mass and stiffness are the data of the test set; its entries of q3 and q4 in the mass matrix are 15 times the values of the integrals.
  The modes of the body diagonalize them, q = V eta.
*/
#ifndef HHTEX_FLEXCRANK_MODEL_H
#define HHTEX_FLEXCRANK_MODEL_H

#include <hhtdae/scene.h>

#include <Eigen/Eigenvalues>

namespace hhtex
{

struct SimeonRod {
  const double length = 0.3, mass = 0.151104, inertia = 0.0045339259; /* about the crank pin */
  hhtdae::ModalBody body;
  Eigen::Matrix4d   V; /* q = V eta */

  SimeonRod()
  {
    const double pi = 3.1415927 /* part of the data */, E = 0.2e12, edge = 0.008, density = 7870;
    const double stretch = E * edge * edge / length, slender = (edge / length) * (edge / length), line = density * edge * edge * length;
    Eigen::Matrix4d M = Eigen::Matrix4d::Zero(), K = M, across = M, along = M, mixed = M;
    across.diagonal().head<2>().setConstant(0.5 * line);
    along.bottomRightCorner<2, 2>() << 8 * line, line, line, 2 * line;
    M = across + along;
    K.diagonal() << stretch * std::pow(pi, 4) / 24 * slender, stretch * std::pow(pi, 4) * 2 / 3 * slender, 0, 0;
    K.bottomRightCorner<2, 2>() << 16. / 3 * stretch, -8. / 3 * stretch, -8. / 3 * stretch, 7. / 3 * stretch;
    /* int along_k across_l */
    mixed(2, 0) = line * 16 / (pi * pi * pi);
    mixed(3, 0) = -line * (8 / (pi * pi * pi) - 1 / pi);
    mixed(3, 1) = -line / (2 * pi);
    /* bending is uncoupled; stretching is two by two, V = L^-T U with M = L L^T and U of L^-1 K L^-T */
    Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d> stretching;
    const Eigen::Matrix2d                          L = M.bottomRightCorner<2, 2>().llt().matrixL(), inverse = L.inverse();
    stretching.computeDirect(inverse * K.bottomRightCorner<2, 2>() * inverse.transpose());
    V << Eigen::Matrix2d(M.topLeftCorner<2, 2>().diagonal().cwiseSqrt().cwiseInverse().asDiagonal()), Eigen::Matrix2d::Zero(), Eigen::Matrix2d::Zero(),
        inverse.transpose() * stretching.eigenvectors();
    Eigen::Vector4d squares;
    squares << K.diagonal().head<2>().cwiseQuotient(M.diagonal().head<2>()), stretching.eigenvalues();

    body.name   = "rod";
    body.mass   = mass;
    body.center = {length / 2, 0, 0};
    body.omega  = squares.cwiseSqrt();
    /* a thin rod, except for the thickness in the plane; the inertia about its own axis has no effect */
    const double xx = mass * length * length / 12, own = inertia - mass * length * length / 4;
    body.moments    = hhtdae::Vector3(xx, own - xx, 1e-7).asDiagonal();

    Eigen::Matrix<double, 3, 4> first = Eigen::Matrix<double, 3, 4>::Zero(), at = first, x_first = first;
    first.row(0) << 0, 0, 2. / 3 * line, 1. / 6 * line;
    first.row(1) << 2 / pi * line, 0, 0, 0;
    x_first.row(0) << 0, 0, length / 3 * line, length / 6 * line; /* from the crank pin */
    x_first.row(1) << length / pi * line, -length / (2 * pi) * line, 0, 0;
    body.first = first * V;
    for (auto &m : body.moment) m.setZero(3, 4);
    body.moment[0] = (x_first - length / 2 * first) * V;
    for (auto &q : body.quadratic) q.setZero(4, 4);
    body.quadratic[0] = V.transpose() * along * V;
    body.quadratic[1] = V.transpose() * across * V;
    body.quadratic[3] = V.transpose() * mixed * V;

    hhtdae::ModalAttachment pin, end;
    pin.name        = "pin";
    pin.translation = at * V;
    at.row(2) << pi / length, 2 * pi / length, 0, 0;
    pin.rotation = at * V;
    end.name     = "end";
    end.position = {length, 0, 0};
    at.row(2) << -pi / length, 2 * pi / length, 0, 0;
    end.rotation = at * V;
    at.setZero();
    at(0, 3)        = 1;
    end.translation = at * V;
    body.attachments = {pin, end};
  }
};

/* The mechanism, stretched out at the start, with initial values close to those of the smooth motion */
struct FlexCrank {
  SimeonRod       rod;
  hhtdae::Scene   scene;
  hhtdae::Body    crank, link, slider;
  hhtdae::Element drive;
  static constexpr double L1 = 0.15, L2 = 0.3, speed = 150;

  explicit FlexCrank(hhtdae::ModalMass mass, MPI_Comm comm = PETSC_COMM_WORLD) : scene(comm)
  {
    bodies(mass);
    joints();
  }

private:
  void bodies(hhtdae::ModalMass mass)
  {
    const Eigen::Vector4d q(0, 0, 0.103339863e-4, 0.169327969e-4);
    const Eigen::Vector4d rate(0.444896105, 0.463434311e-2, -0.178591076e-5, -0.268938672e-5);
    const double          turn = -speed * L1 / (L2 + q(3));
    hhtdae::RigidBody     c;
    c.mass             = 0.36;
    c.inertia          = hhtdae::Vector3(1e-5, 7.02e-4, 7.02e-4).asDiagonal(); /* 0.002727 about the pivot */
    c.position         = {L1 / 2, 0, 0};
    c.velocity         = {0, speed * L1 / 2, 0};
    c.angular_velocity = {0, 0, speed};
    hhtdae::PointMass s;
    s.mass     = 0.075552;
    s.position = {L1 + L2 + q(3), 0, 0};
    s.velocity = {rate(3), 0, 0};
    hhtdae::FlexibleBody r;
    r.model            = std::make_shared<hhtdae::ModalBody>(rod.body);
    r.mass             = mass;
    r.position         = {L1, 0, 0};
    r.velocity         = {0, speed * L1 + turn * L2 / 2, 0};
    r.angular_velocity = {0, 0, turn};
    r.deformation      = rod.V.inverse() * q;
    r.deformation_rate = rod.V.inverse() * rate;
    crank              = scene.add("crank", c);
    link               = scene.add("rod", r);
    slider             = scene.add("slider", s);
    scene.shape(crank, hhtdae::Shape::box({L1 / 2, 0.005, 0.005}));
    scene.shape(link, hhtdae::Shape::box({L2 / 2, 0.004, 0.004}, {L2 / 2, 0, 0}));
    scene.shape(slider, hhtdae::Shape::box({0.02, 0.01, 0.01}));
  }

  void joints()
  {
    using namespace hhtdae;
    const Body    ground = scene.ground();
    const Marker  pivot  = scene.marker(crank, {-L1 / 2, 0, 0}), base = scene.marker(ground), mass = scene.marker(slider);
    const Matrix3 level = Eigen::AngleAxisd(-M_PI / 2, Vector3::UnitX()).toRotationMatrix(); /* z axis along y */
    scene.add("pivot", Revolute{pivot, base});
    scene.add("pin", Revolute{scene.marker(scene.attachment(link, "pin")), scene.marker(crank, {L1 / 2, 0, 0})});
    scene.add("end", Spherical{scene.marker(scene.attachment(link, "end")), mass});
    scene.add("guide", InPlane{mass, scene.marker(ground, {0, 0, 0}, level)});
    drive = scene.add("drive", RotationalMotion{pivot, base, TimeFunction::polynomial({0, speed})});
    for (int k = 0; k < 4; k++) scene.channel("eta" + std::to_string(k), Measure::modal(link, k));
    scene.channel("slider", Measure::displacement(mass, 0), "m");
    scene.channel("torque", Measure::multiplier(drive, 0), "N m");
  }
};

/* At t = 0.1, by extrapolation of order 16 in long double to about 12 digits */
inline Eigen::Vector4d FlexCrankExact() { return {1.893192843026e-4, 2.3757513204864e-5, -5.3238967781898e-6, -8.3633132916616e-6}; }
constexpr double flexcrank_slider = 0.169737332640;

} // namespace hhtex

#endif
