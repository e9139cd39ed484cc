/*
  Frames of a page, collected in memory and written in blocks. Each block can be read without the blocks before it.

    u32 frames;  f64 time of each
    for every track: f64 low, f64 step     value = low + step * code, code 65535: not finite, or beyond 1e300
    codes of the tracks, track by track: u16 differences from one frame to the next (the first from 0), in zigzag order, in planes
    channels, one after the other: f32, in planes
    for every surface, in their order, if it has them:
      nodes that move individually: f32 step; u16 codes of their displacements in the axes of their body, node by node x, y,
      z: differences from one frame
        to the next (the first from 0), in zigzag order, in planes
      stress: largest value at every node, f32 in planes; u8 differences of round(255 value / largest), node by node
*/
#ifndef HHTDAE_SCENE_OUTPUT_PAGE_FRAMES_H
#define HHTDAE_SCENE_OUTPUT_PAGE_FRAMES_H

#include "hhtdae/output.h"
#include "scene/output/page_bytes.h"

namespace hhtdae
{

/* A surface with modes; the stress at its nodes is computed for a whole block at once */
struct PageField {
  const Surface *surface;
  std::size_t    first; /* number of its first modal coordinate among the tracks */
};

/* A surface whose nodes move individually: per frame three displacements of each node, then the stress at each node */
struct PageNodes {
  std::size_t nodes;
  bool        stress;
  std::size_t numbers() const { return (stress ? 4 : 3) * nodes; }
};

class PageFrames
{
public:
  PageFrames() = default;
  PageFrames(std::size_t tracks, std::size_t channels, const std::vector<PageField> &fields, const std::vector<PageNodes> &moving = {})
      : tracks_(tracks), channels_(channels), fields_(fields), moving_(moving)
  {
    for (const PageNodes &m : moving_) numbers_ += m.numbers();
  }

  std::size_t frames() const { return time_.size(); }
  /* Adds a frame. tracks: coordinates of bodies and modes; moving: the values of all PageNodes */
  void add(double time, const double *tracks, const double *channels, const double *moving = nullptr);
  /* Whether the block has reached its largest memory or number of frames */
  bool      full() const;
  PageBytes encode() const;
  void      clear();

private:
  std::size_t            tracks_ = 0, channels_ = 0, numbers_ = 0;
  std::vector<PageField> fields_;
  std::vector<PageNodes> moving_;
  std::vector<double>    time_, track_; /* frame by frame */
  std::vector<float>     channel_, number_;

  void encodeTracks(PageBytes &out) const;
  void encodeChannels(PageBytes &out) const;
  void encodeField(const PageField &field, PageBytes &out) const;
  void encodeNodes(const PageNodes &nodes, std::size_t first, PageBytes &out) const;
};

} // namespace hhtdae

#endif
