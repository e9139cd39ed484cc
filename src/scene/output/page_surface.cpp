#include "scene/output/page_surface.h"
#include "scene/products.h"
#include <algorithm>
#include <cmath>

namespace hhtdae
{

std::string SurfaceFault(const Surface &s, const ModalBody &m)
{
  const std::size_t  nodes = s.point.size() / 3;
  const Eigen::Index modes = m.modes();
  if (s.point.size() % 3) return "it has " + std::to_string(s.point.size()) + " coordinates, not three for each node";
  if (s.triangle.size() % 3) return "it has " + std::to_string(s.triangle.size()) + " nodes of triangles, not three for each";
  for (int node : s.triangle)
    if (node < 0 || node >= (int)nodes) return "a triangle has the node " + std::to_string(node) + ", of " + std::to_string(nodes);
  if (s.shape.rows() != (Eigen::Index)(3 * nodes) || s.shape.cols() != modes)
    return "its modes are a matrix of " + std::to_string(s.shape.rows()) + " by " + std::to_string(s.shape.cols()) + ", not of " + std::to_string(3 * nodes) + " by " +
           std::to_string(modes);
  if (HasStress(s) && (s.stress.rows() != (Eigen::Index)(6 * nodes) || s.stress.cols() != modes))
    return "its stress modes are a matrix of " + std::to_string(s.stress.rows()) + " by " + std::to_string(s.stress.cols()) + ", not of " + std::to_string(6 * nodes) +
           " by " + std::to_string(modes);
  if (!std::all_of(s.point.begin(), s.point.end(), [](double x) { return std::isfinite(x); }) || !s.shape.allFinite() || !s.stress.allFinite())
    return "it has values that are not finite";
  return "";
}

PageBytes EncodeSurface(const Surface &s, const ModalBody &m)
{
  /* shapes of a mode are coded as integers of at most this magnitude: for the slowest mode, and for the fastest ones */
  constexpr double           max_levels = 8191, min_levels = 31;
  const Eigen::Index         modes = m.modes();
  PageBytes                  out;
  std::vector<std::uint32_t> words;
  std::vector<std::uint16_t> code;
  out.u32((std::uint32_t)(s.point.size() / 3));
  out.u32((std::uint32_t)(s.triangle.size() / 3));
  out.u32((std::uint32_t)modes);
  for (std::size_t k = 0; k < s.point.size(); k++) {
    const float   x = (float)(s.point[k] - m.center((int)(k % 3)));
    std::uint32_t bits;
    std::memcpy(&bits, &x, sizeof bits);
    words.push_back(bits);
  }
  out.planes(words);
  words.assign(s.triangle.begin(), s.triangle.end());
  out.planes(words);
  code.reserve((std::size_t)s.shape.size());
  const double slowest = modes ? m.omega.minCoeff() : 1;
  for (Eigen::Index k = 0; k < modes; k++) {
    const double ratio = slowest / m.omega(k), largest = s.shape.rows() ? s.shape.col(k).cwiseAbs().maxCoeff() : 0;
    const double levels = std::max(min_levels, std::floor(max_levels * ratio * ratio));
    const float  step   = (float)(largest / levels);
    out.f32(step);
    for (int c = 0; c < 3; c++)
      for (Eigen::Index i = c; i < s.shape.rows(); i += 3) code.push_back(ZigZag((std::uint16_t)(std::int16_t)(step > 0 ? std::lround(s.shape(i, k) / step) : 0)));
  }
  out.planes(code);
  return out;
}

void SurfaceStress(const Surface &s, const Eigen::MatrixXf &eta, Eigen::MatrixXf *von_mises)
{
  constexpr Eigen::Index nodes_at_a_time = 256; /* small enough that their data stay in the cache */
  const Eigen::Index     nodes = s.stress.rows() / 6;
  Eigen::MatrixXf        x;
  von_mises->resize(nodes, eta.cols());
  for (Eigen::Index first = 0; first < nodes; first += nodes_at_a_time) {
    const Eigen::Index count = std::min(nodes_at_a_time, nodes - first);
    x.noalias()              = s.stress.middleRows(6 * first, 6 * count) * eta;
    for (Eigen::Index f = 0; f < eta.cols(); f++)
      for (Eigen::Index i = 0; i < count; i++) {
        const float *t = &x(6 * i, f), a = t[0] - t[1], b = t[1] - t[2], c = t[2] - t[0];
        (*von_mises)(first + i, f) = std::sqrt(0.5f * (a * a + b * b + c * c) + 3 * (t[3] * t[3] + t[4] * t[4] + t[5] * t[5]));
      }
  }
}

} // namespace hhtdae
