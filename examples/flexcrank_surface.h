/* Surface of the slider-crank's elastic rod for the page: its four faces with the displacements of the modes, and the axial stress of beam
   theory. */
#ifndef HHTEX_FLEXCRANK_SURFACE_H
#define HHTEX_FLEXCRANK_SURFACE_H

#include "flexcrank_model.h"

#include <memory>

namespace hhtex
{

inline std::shared_ptr<const hhtdae::Surface> RodSurface(const SimeonRod &rod)
{
  constexpr int    sections = 33;
  constexpr double pi = EIGEN_PI, E = 0.2e12, half = 0.004; /* of its edges, m */
  constexpr double y[] = {-half, half, half, -half}, z[] = {-half, -half, half, half};
  auto             surface = std::make_shared<hhtdae::Surface>();
  Eigen::MatrixXd  shape = Eigen::MatrixXd::Zero(12 * sections, 4), stress = Eigen::MatrixXd::Zero(24 * sections, 4);
  for (int i = 0; i < sections; i++) {
    const double          L = rod.length, xi = (double)i / (sections - 1);
    const Eigen::Vector4d across(std::sin(pi * xi), std::sin(2 * pi * xi), 0, 0), along(0, 0, 4 * xi * (1 - xi), xi * (2 * xi - 1));
    const Eigen::Vector4d slope(pi / L * std::cos(pi * xi), 2 * pi / L * std::cos(2 * pi * xi), 0, 0), strain(0, 0, (4 - 8 * xi) / L, (4 * xi - 1) / L);
    const Eigen::Vector4d curvature(-pi * pi / (L * L) * across(0), -4 * pi * pi / (L * L) * across(1), 0, 0);
    for (int k = 0; k < 4; k++) {
      const int node = 4 * i + k, below = node + 4, next = (k + 1) % 4 - k;
      surface->point.insert(surface->point.end(), {L * xi, y[k], z[k]});
      shape.row(3 * node)     = along - y[k] * slope;
      shape.row(3 * node + 1) = across;
      stress.row(6 * node)    = E * (strain - y[k] * curvature);
      if (i + 1 < sections) surface->triangle.insert(surface->triangle.end(), {node, below, below + next, node, below + next, node + next});
    }
  }
  surface->triangle.insert(surface->triangle.end(), {0, 1, 2, 0, 2, 3});
  for (int k : {0, 2, 1, 0, 3, 2}) surface->triangle.push_back(4 * (sections - 1) + k);
  surface->shape       = (shape * rod.V).cast<float>();
  surface->stress      = (stress * rod.V).cast<float>();
  surface->stress_unit = "Pa";
  return surface;
}

} // namespace hhtex

#endif
