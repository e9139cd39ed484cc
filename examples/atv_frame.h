/* Positions of the attachments of the vehicle's frame. Metres, x forward, y left, z up; the same axes as atv_frame.geo. */
#ifndef HHTEX_ATV_FRAME_H
#define HHTEX_ATV_FRAME_H

#include <hhtdae/types.h>
#include <string>
#include <vector>

namespace hhtex
{

using hhtdae::Vector3;

/* Nodes within `reach` of the centres, tied to `point` rigidly (brackets) or on average (masses on soft mounts) */
struct AtvAttachment {
  std::string          name;
  Vector3              point;
  std::vector<Vector3> centres;
  double               reach;
  bool                 average;
};

/* Corners FL, FR, RL, RR; the wheels' centres */
struct AtvCorner {
  std::string name;
  double      end, side; /* +1 front, -1 rear; +1 left, -1 right */
  Vector3     at(double x, double y, double z) const { return {end * x, side * y, z}; }
};

inline std::vector<AtvCorner> AtvCorners() { return {{"FL", 1, 1}, {"FR", 1, -1}, {"RL", -1, 1}, {"RR", -1, -1}}; }

/* Height of the lower rail at its inclined ends */
inline double AtvRail(double x) { return 0.34 + 0.04 * (x - 0.48) / 0.31; }

/*
  20 attachments: at each corner the pivots of the lower arm (a outward, b inward), the bracket of the upper arm (u),
  the top of the shock absorber (s); then steering head, engine, seat and rack
*/
inline std::vector<AtvAttachment> AtvAttachments()
{
  std::vector<AtvAttachment> list;
  for (const AtvCorner &c : AtvCorners()) {
    list.push_back({c.name + "a", c.at(0.73, 0.172, AtvRail(0.73)), {c.at(0.73, 0.14, AtvRail(0.73))}, 0.030, false});
    list.push_back({c.name + "b", c.at(0.54, 0.172, AtvRail(0.54)), {c.at(0.54, 0.14, AtvRail(0.54))}, 0.030, false});
    list.push_back({c.name + "u", c.at(0.635, 0.165, 0.49), {c.at(0.635, 0.14, 0.49)}, 0.060, false});
    const double z = c.end > 0 ? 0.63 : 0.65;
    list.push_back({c.name + "s", c.at(0.635, 0.172, z), {c.at(0.635, 0.14, z)}, 0.030, false});
  }
  list.push_back({"head", {0.376, 0, 0.76}, {{0.376, 0, 0.76}}, 0.045, false});
  list.push_back({"engine",
                  {0, 0, 0.46},
                  {{0.25, 0.14, 0.34}, {0.25, -0.14, 0.34}, {-0.25, 0.14, 0.34}, {-0.25, -0.14, 0.34}},
                  0.030,
                  true});
  list.push_back({"seat",
                  {-0.15, 0, 0.78},
                  {{0, 0.14, 0.68}, {0, -0.14, 0.68}, {-0.35, 0.14, 0.68}, {-0.35, -0.14, 0.68}},
                  0.030,
                  true});
  list.push_back({"rack",
                  {-0.70, 0, 0.74},
                  {{-0.56, 0.14, 0.665}, {-0.56, -0.14, 0.665}, {-0.74, 0.14, 0.63}, {-0.74, -0.14, 0.63}},
                  0.030,
                  true});
  return list;
}

} // namespace hhtex

#endif
