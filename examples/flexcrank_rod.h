/*
  The elastic rod of Simeon's planar slider-crank (B. Simeon, Modelling a flexible slider crank mechanism by a mixed system of DAEs
  and PDEs, 1996; problem "crank" of the test set for IVP solvers) as a body in modal coordinates. Displacements in the axes of the
  rod, whose x axis goes through its undeformed ends, xi = x/L:

    across: sin(pi xi) q1 + sin(2 pi xi) q2,   along: 4 xi (1 - xi) q3 + xi (2 xi - 1) q4

  Mass and stiffness are the data of the test set: those of q3, q4 in the mass matrix are 15 times what the integrals give.
  The modes diagonalize them, q = V eta.
*/
#ifndef HHTEX_FLEXCRANK_ROD_H
#define HHTEX_FLEXCRANK_ROD_H

#include <hhtdae/modal.h>

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
    const Eigen::GeneralizedSelfAdjointEigenSolver<Eigen::Matrix4d> modes(K, M);
    V = modes.eigenvectors();

    body.name   = "rod";
    body.mass   = mass;
    body.center = {length / 2, 0, 0};
    body.omega  = modes.eigenvalues().cwiseSqrt();
    /* a line but for its thickness in the plane; inertia about its own axis plays no part */
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

} // namespace hhtex

#endif
