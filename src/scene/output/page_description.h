/* What of a scene does not move, for its page: JSON. */
#ifndef HHTDAE_SCENE_OUTPUT_PAGE_DESCRIPTION_H
#define HHTDAE_SCENE_OUTPUT_PAGE_DESCRIPTION_H

#include "scene/scene_data.h"

namespace hhtdae
{

/*
  A place is [body, x, y, z, qx, qy, qz, qw]: of a marker, from the body's centre of mass in its axes; body -1 is the ground.

    {"format": 1, "title": text, "planar": bool, "up": [x, y, z],
     "bodies":   [{"name", "modes", "carrier": flexible body of an attachment's frame or -1,
                   "shapes": [{"kind": "box" | "cylinder" | "sphere", "size": [x, y, z], "at": place, "colour": 0xRRGGBB or -1}],
                   "guess": the shape is that of the inertia}],
     "ground":   [shapes],
     "lines":    [[place, place, ...]],
     "elements": [{"name", "type", "kind": "joint" | "motion" | "force", "i": place, "j": place or null}],
     "channels": [{"name", "unit"}],
     "surfaces": [{"body", "stress": bool, "unit"}]}
*/
std::string DescribePage(const SceneData &s, const std::string &title);

} // namespace hhtdae

#endif
