/* Reduces the number of nodes of surfaces of large meshes, for pictures. */
#include "flexible/surface.h"
#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>

namespace hhtdae
{

namespace
{

/* The coordinate direction nearest to the outward normal at each node, 0 to 5 for x, -x, y, -y, z, -z */
std::vector<int> TriangleSides(const std::vector<double> &point, const std::vector<int> &triangle)
{
  Eigen::Matrix3Xd normal = Eigen::Matrix3Xd::Zero(3, (Eigen::Index)point.size() / 3);
  std::vector<int> side((std::size_t)normal.cols());
  const auto       at = [&](int n) { return Eigen::Map<const Vector3>(&point[3 * (std::size_t)n]); };
  for (std::size_t k = 0; k < triangle.size(); k += 3) {
    const Vector3 a = at(triangle[k]), twice = (at(triangle[k + 1]) - a).cross(at(triangle[k + 2]) - a);
    for (int c = 0; c < 3; c++) normal.col(triangle[k + c]) += twice;
  }
  for (std::size_t n = 0; n < side.size(); n++) {
    int axis;
    normal.col((Eigen::Index)n).cwiseAbs().maxCoeff(&axis);
    side[n] = 2 * axis + (normal(axis, (Eigen::Index)n) < 0);
  }
  return side;
}

/* Assigns each node to a cluster: nodes of one side in one cell of a cubic grid that starts at `corner`; returns the number of clusters */
std::size_t Cluster(const std::vector<double> &point, const Vector3 &corner, const std::vector<int> &side, double edge, std::vector<std::size_t> *cluster)
{
  std::map<std::array<long, 4>, std::size_t> known;
  cluster->clear();
  for (std::size_t n = 0; n < side.size(); n++) {
    std::array<long, 4> key{0, 0, 0, side[n]};
    for (int c = 0; c < 3; c++) key[(std::size_t)c] = std::lround(std::floor((point[3 * n + (std::size_t)c] - corner(c)) / edge));
    cluster->push_back(known.emplace(key, known.size()).first->second);
  }
  return known.size();
}

} // namespace

void ThinSurface(const std::vector<double> &point, std::size_t max_nodes, std::vector<std::size_t> *kept, std::vector<int> *triangle)
{
  const std::size_t nodes = point.size() / 3;
  kept->resize(nodes);
  for (std::size_t n = 0; n < nodes; n++) (*kept)[n] = n;
  if (nodes <= max_nodes) return;
  const Eigen::Map<const Eigen::Matrix3Xd> x(point.data(), 3, (Eigen::Index)nodes);
  const std::vector<int>                   side = TriangleSides(point, *triangle);
  std::vector<std::size_t>                 of;
  const Vector3                            corner = x.rowwise().minCoeff();
  const double                             extent = (x.rowwise().maxCoeff() - corner).norm();
  double                                   edge   = extent / std::sqrt((double)max_nodes) / 8; /* shorter than needed, also for slender bodies */
  /* a single cell still has up to six clusters, one for each side: the edge is bounded */
  while (Cluster(point, corner, side, edge, &of) > max_nodes && edge < 2 * extent) edge *= 1.1;

  /* represent each cluster by the node nearest to its mean */
  const std::size_t        clusters = *std::max_element(of.begin(), of.end()) + 1;
  Eigen::Matrix3Xd         mean     = Eigen::Matrix3Xd::Zero(3, (Eigen::Index)clusters);
  std::vector<double>      count(clusters, 0), least(clusters, std::numeric_limits<double>::infinity());
  std::vector<std::size_t> nearest(clusters), place(clusters);
  for (std::size_t n = 0; n < nodes; n++) {
    mean.col((Eigen::Index)of[n]) += x.col((Eigen::Index)n);
    count[of[n]]++;
  }
  for (std::size_t n = 0; n < nodes; n++) {
    const double d = (x.col((Eigen::Index)n) - mean.col((Eigen::Index)of[n]) / count[of[n]]).squaredNorm();
    if (d < least[of[n]]) {
      least[of[n]]   = d;
      nearest[of[n]] = n;
    }
  }
  *kept = nearest;
  std::sort(kept->begin(), kept->end());
  for (std::size_t k = 0; k < clusters; k++) place[k] = (std::size_t)(std::lower_bound(kept->begin(), kept->end(), nearest[k]) - kept->begin());
  std::vector<int> thin;
  for (std::size_t k = 0; k < triangle->size(); k += 3) {
    const std::size_t a = of[(std::size_t)(*triangle)[k]], b = of[(std::size_t)(*triangle)[k + 1]], c = of[(std::size_t)(*triangle)[k + 2]];
    if (a == b || b == c || c == a) continue;
    for (std::size_t m : {a, b, c}) thin.push_back((int)place[m]);
  }
  *triangle = thin;
}

} // namespace hhtdae
