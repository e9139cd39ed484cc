#include "scene/output/page_frames.h"
#include "scene/output/page_surface.h"
#include <algorithm>
#include <cmath>
#include <limits>

namespace hhtdae
{

namespace
{

constexpr std::size_t   max_block_frames = 128;     /* largest number of frames in a block; a run that is killed loses at most these */
constexpr std::size_t   max_block_bytes  = 8 << 20; /* largest memory of a block */
constexpr double        track_levels     = 65534;   /* values of a track are coded as 0 to 65534 */
constexpr std::uint16_t missing_code     = 65535;   /* code of a value that is not finite, or beyond 1e300 */
constexpr float         max_node_level   = 4095;    /* displacements of nodes are coded as -4095 to 4095 in a block */

/* Whether x is finite and small enough that differences of two such numbers do not overflow */
bool Usable(double x) { return std::abs(x) < 1e300; }

struct Range {
  double low = 0, step = 0;
};

/* The range of the usable values */
Range RangeOf(const std::vector<double> &x)
{
  double low = std::numeric_limits<double>::infinity(), high = -low;
  for (double v : x)
    if (Usable(v)) {
      low  = std::min(low, v);
      high = std::max(high, v);
    }
  if (!(high >= low)) return {};
  return {low, (high - low) / track_levels};
}

std::uint16_t Code(double x, const Range &r)
{
  if (!Usable(x)) return missing_code;
  return r.step > 0 ? (std::uint16_t)std::min(track_levels, std::round((x - r.low) / r.step)) : 0;
}

} // namespace

void PageFrames::add(double time, const double *tracks, const double *channels, const double *moving)
{
  time_.push_back(time);
  track_.insert(track_.end(), tracks, tracks + tracks_);
  for (std::size_t c = 0; c < channels_; c++) channel_.push_back((float)channels[c]);
  for (std::size_t k = 0; k < numbers_; k++) number_.push_back((float)moving[k]);
}

bool PageFrames::full() const
{
  return time_.size() >= max_block_frames || sizeof(double) * track_.size() + sizeof(float) * (channel_.size() + number_.size()) >= max_block_bytes;
}

void PageFrames::clear()
{
  time_.clear();
  track_.clear();
  channel_.clear();
  number_.clear();
}

PageBytes PageFrames::encode() const
{
  PageBytes out;
  out.u32((std::uint32_t)time_.size());
  for (double t : time_) out.f64(t);
  encodeTracks(out);
  encodeChannels(out);
  for (const PageField &f : fields_) encodeField(f, out);
  std::size_t first = 0;
  for (const PageNodes &m : moving_) {
    encodeNodes(m, first, out);
    first += m.numbers();
  }
  return out;
}

void PageFrames::encodeTracks(PageBytes &out) const
{
  const std::size_t          n = time_.size();
  std::vector<double>        track(n);
  std::vector<std::uint16_t> code;
  code.reserve(n * tracks_);
  for (std::size_t k = 0; k < tracks_; k++) {
    for (std::size_t i = 0; i < n; i++) track[i] = track_[i * tracks_ + k];
    const Range r = RangeOf(track);
    out.f64(r.low);
    out.f64(r.step);
    std::uint16_t before = 0;
    for (double x : track) {
      const std::uint16_t now = Code(x, r);
      code.push_back(ZigZag((std::uint16_t)(now - before)));
      before = now;
    }
  }
  out.planes(code);
}

void PageFrames::encodeChannels(PageBytes &out) const
{
  std::vector<std::uint32_t> bits;
  bits.reserve(channel_.size());
  for (std::size_t c = 0; c < channels_; c++)
    for (std::size_t i = 0; i < time_.size(); i++) {
      std::uint32_t x;
      std::memcpy(&x, &channel_[i * channels_ + c], sizeof x);
      bits.push_back(x);
    }
  out.planes(bits);
}

/* stress: nodes x frames */
static void EncodeStress(const Eigen::MatrixXf &stress, PageBytes &out)
{
  const Eigen::Index         n = stress.cols();
  std::vector<std::uint32_t> bits((std::size_t)stress.rows());
  std::vector<unsigned char> code;
  code.reserve((std::size_t)stress.size());
  for (Eigen::Index node = 0; node < stress.rows(); node++) {
    float largest = 0;
    for (Eigen::Index i = 0; i < n; i++)
      if (std::isfinite(stress(node, i))) largest = std::max(largest, stress(node, i));
    std::memcpy(&bits[(std::size_t)node], &largest, sizeof largest);
    unsigned char before = 0;
    for (Eigen::Index i = 0; i < n; i++) {
      const float         v   = stress(node, i);
      const unsigned char now = largest > 0 && v > 0 ? (unsigned char)std::lround(255 * std::min(1.f, v / largest)) : 0;
      code.push_back((unsigned char)(now - before));
      before = now;
    }
  }
  out.planes(bits);
  out.all.insert(out.all.end(), code.begin(), code.end());
}

void PageFrames::encodeField(const PageField &field, PageBytes &out) const
{
  const Eigen::Index n = (Eigen::Index)time_.size(), modes = field.surface->stress.cols();
  Eigen::MatrixXf    eta(modes, n), stress;
  for (Eigen::Index i = 0; i < n; i++) eta.col(i) = Eigen::Map<const Eigen::VectorXd>(&track_[i * tracks_ + field.first], modes).cast<float>();
  SurfaceStress(*field.surface, eta, &stress);
  EncodeStress(stress, out);
}

void PageFrames::encodeNodes(const PageNodes &m, std::size_t first, PageBytes &out) const
{
  const std::size_t          n = time_.size(), tracks = 3 * m.nodes;
  std::vector<std::uint16_t> code;
  float                      largest = 0;
  const auto                 at      = [&](std::size_t frame, std::size_t k) {
    const float x = number_[frame * numbers_ + first + k];
    return std::isfinite(x) ? x : 0.f; /* if it is not finite, neither is the pose of the body, which is then not shown */
  };
  for (std::size_t i = 0; i < n; i++)
    for (std::size_t k = 0; k < tracks; k++) largest = std::max(largest, std::abs(at(i, k)));
  const float step = largest / max_node_level;
  out.f32(step);
  code.reserve(n * tracks);
  for (std::size_t k = 0; k < tracks; k++) {
    std::uint16_t before = 0;
    for (std::size_t i = 0; i < n; i++) {
      const std::uint16_t now = (std::uint16_t)(std::int16_t)(step > 0 ? std::lround(at(i, k) / step) : 0);
      code.push_back(ZigZag((std::uint16_t)(now - before)));
      before = now;
    }
  }
  out.planes(code);
  if (!m.stress) return;
  Eigen::MatrixXf stress((Eigen::Index)m.nodes, (Eigen::Index)n);
  for (std::size_t i = 0; i < n; i++) stress.col((Eigen::Index)i) = Eigen::Map<const Eigen::VectorXf>(&number_[i * numbers_ + first + tracks], (Eigen::Index)m.nodes);
  EncodeStress(stress, out);
}

} // namespace hhtdae
