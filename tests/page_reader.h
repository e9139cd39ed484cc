/* Reads the page of a run according to the layout described in src/scene/output/page_frames.h and page_surface.h;
   shares no code with the writer */
#ifndef HHTDAE_TESTS_PAGE_READER_H
#define HHTDAE_TESTS_PAGE_READER_H

#include <algorithm>
#include <cstdint>
#include <cstring>
#include <limits>
#include <stdexcept>
#include <string>
#include <vector>
#include <zlib.h>

namespace hhtest
{

inline std::string fromBase64(const std::string &text)
{
  std::string out;
  unsigned    bits = 0;
  int         have = 0;
  for (char c : text) {
    const int v = c >= 'A' && c <= 'Z' ? c - 'A' : c >= 'a' && c <= 'z' ? c - 'a' + 26 : c >= '0' && c <= '9' ? c - '0' + 52 : c == '+' ? 62 : c == '/' ? 63 : -1;
    if (v < 0) continue;
    bits = bits << 6 | (unsigned)v;
    have += 6;
    if (have >= 8) out += (char)(bits >> (have -= 8) & 255);
  }
  return out;
}

inline std::string inflated(const std::string &packed)
{
  for (uLongf room = 64 + 4 * packed.size();; room *= 2) {
    std::string out(room, '\0');
    uLongf      size   = room;
    const int   status = uncompress((Bytef *)&out[0], &size, (const Bytef *)packed.data(), packed.size());
    out.resize(size);
    if (status == Z_OK) return out;
    if (status != Z_BUF_ERROR) throw std::runtime_error("a block of the page cannot be unpacked");
  }
}

/* Reads values one after the other */
class PageInput
{
public:
  explicit PageInput(std::string all) : all_(std::move(all)) {}
  template <class T> T number()
  {
    T x;
    std::memcpy(&x, take(sizeof x), sizeof x); /* tests run on little-endian machines */
    return x;
  }
  template <class T> std::vector<T> planes(std::size_t n)
  {
    const char    *from = take(n * sizeof(T));
    std::vector<T> x(n);
    for (std::size_t i = 0; i < n; i++)
      for (std::size_t k = 0; k < sizeof(T); k++) reinterpret_cast<char *>(&x[i])[k] = from[k * n + i];
    return x;
  }
  const unsigned char *bytes(std::size_t n) { return reinterpret_cast<const unsigned char *>(take(n)); }
  bool                 atEnd() const { return at_ == all_.size(); }

private:
  std::string all_;
  std::size_t at_ = 0;
  const char *take(std::size_t n)
  {
    if (at_ + n > all_.size()) throw std::runtime_error("a block of the page is too short");
    at_ += n;
    return all_.data() + at_ - n;
  }
};

/* 0, 1, 2, 3, ... stand for 0, -1, 1, -2, ... */
inline int unfold(unsigned code) { return code % 2 ? -(int)(code / 2) - 1 : (int)(code / 2); }

struct PageSurface {
  std::vector<float>              point;
  std::vector<std::uint32_t>      triangle;
  std::vector<float>              step;
  std::vector<std::vector<float>> mode; /* x, y, z of each node */

  explicit PageSurface(PageInput in)
  {
    const auto nodes = in.number<std::uint32_t>(), triangles = in.number<std::uint32_t>(), modes = in.number<std::uint32_t>();
    point    = in.planes<float>(3 * nodes);
    triangle = in.planes<std::uint32_t>(3 * triangles);
    for (unsigned k = 0; k < modes; k++) step.push_back(in.number<float>());
    const auto code = in.planes<std::uint16_t>((std::size_t)3 * nodes * modes);
    for (unsigned k = 0; k < modes; k++) {
      mode.emplace_back(3 * nodes);
      for (unsigned c = 0; c < 3; c++)
        for (unsigned i = 0; i < nodes; i++) mode[k][3 * i + c] = step[k] * (float)unfold(code[((std::size_t)3 * k + c) * nodes + i]);
    }
    if (!in.atEnd()) throw std::runtime_error("a surface is longer than it says");
  }
};

/* A surface whose nodes have independent motions (whole finite-element body) */
struct PageMotion {
  std::size_t nodes;
  bool        stress;
};

/* A page with the frames of all blocks */
struct PageFile {
  std::string                      text, scene; /* the JSON parts */
  std::vector<PageSurface>         surface;
  std::vector<double>              time;
  std::vector<std::vector<double>> track, step; /* frame by frame; step: the resolution of the codes */
  std::vector<std::vector<float>>  channel;     /* frame by frame */
  std::vector<std::vector<double>> stress;      /* frame by frame, for each surface with stress in turn */
  std::vector<std::vector<double>> moved;       /* frame by frame, x, y, z of the nodes of all PageMotions */
  std::vector<double>              moved_step;  /* frame by frame, the largest resolution */
  int                              blocks = 0;

  /* tracks: 7 per body, plus modes; nodes: numbers of nodes of the surfaces with modes and stress */
  PageFile(const std::string &page, std::size_t tracks, std::size_t channels, const std::vector<std::size_t> &nodes = {}, const std::vector<PageMotion> &motion = {})
      : text(page)
  {
    const std::string begin = "<script id=\"scene\" type=\"application/json\">";
    std::size_t       at    = text.find(begin);
    if (at == std::string::npos) throw std::runtime_error("the page has no scene");
    scene = text.substr(at + begin.size(), text.find("</script>", at) - at - begin.size());
    const std::string mark = "<script type=\"application/octet-stream\" data-kind=\"";
    while ((at = text.find(mark, at)) != std::string::npos) {
      at += mark.size();
      const std::string kind = text.substr(at, text.find('"', at) - at);
      const std::size_t data = text.find('>', at) + 1, end = text.find("</script>\n", data);
      if (end == std::string::npos) throw std::runtime_error("a block of the page does not end");
      PageInput in(inflated(fromBase64(text.substr(data, end - data))));
      if (kind == "surface") surface.emplace_back(in);
      else readFrames(in, tracks, channels, nodes, motion);
    }
  }

private:
  void readMotion(PageInput &in, std::size_t nodes, std::size_t n, std::size_t first)
  {
    const double step = in.number<float>();
    const auto   code = in.planes<std::uint16_t>(3 * nodes * n);
    for (std::size_t k = 0; k < 3 * nodes; k++) {
      int now = 0;
      for (std::size_t i = 0; i < n; i++) {
        now = (std::int16_t)(now + unfold(code[k * n + i]));
        moved[first + i].push_back(step * now);
      }
    }
    for (std::size_t i = first; i < first + n; i++) moved_step[i] = std::max(moved_step[i], step);
  }
  void readStress(PageInput &in, std::size_t count, std::size_t n, std::size_t first)
  {
    const auto           largest = in.planes<float>(count);
    const unsigned char *x       = in.bytes(n * count);
    for (std::size_t k = 0; k < count; k++) {
      unsigned char now = 0;
      for (std::size_t i = 0; i < n; i++) stress[first + i].push_back((double)largest[k] * (now = (unsigned char)(now + x[k * n + i])) / 255);
    }
  }
  void readFrames(PageInput in, std::size_t tracks, std::size_t channels, const std::vector<std::size_t> &nodes, const std::vector<PageMotion> &motion)
  {
    const std::size_t n = in.number<std::uint32_t>(), first = time.size();
    blocks++;
    for (std::size_t i = 0; i < n; i++) time.push_back(in.number<double>());
    std::vector<double> low, width;
    for (std::size_t k = 0; k < tracks; k++) {
      low.push_back(in.number<double>());
      width.push_back(in.number<double>());
    }
    const auto code = in.planes<std::uint16_t>(n * tracks);
    track.resize(first + n, std::vector<double>(tracks));
    step.resize(first + n, width);
    for (std::size_t k = 0; k < tracks; k++) {
      long now = 0;
      for (std::size_t i = 0; i < n; i++) {
        now                 = (now + unfold(code[k * n + i]) + 65536) % 65536;
        track[first + i][k] = now == 65535 ? std::numeric_limits<double>::quiet_NaN() : low[k] + width[k] * (double)now;
      }
    }
    const auto value = in.planes<float>(n * channels);
    for (std::size_t i = 0; i < n; i++) {
      channel.emplace_back();
      for (std::size_t c = 0; c < channels; c++) channel.back().push_back(value[c * n + i]);
    }
    stress.resize(first + n);
    moved.resize(first + n);
    moved_step.resize(first + n);
    for (std::size_t count : nodes) readStress(in, count, n, first);
    for (const PageMotion &m : motion) {
      readMotion(in, m.nodes, n, first);
      if (m.stress) readStress(in, m.nodes, n, first);
    }
    if (!in.atEnd()) throw std::runtime_error("a block of frames is longer than it says");
  }
};

} // namespace hhtest

#endif
