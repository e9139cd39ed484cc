/* The constant data of a scene for its page, as JSON. */
#ifndef HHTDAE_SCENE_OUTPUT_PAGE_DESCRIPTION_H
#define HHTDAE_SCENE_OUTPUT_PAGE_DESCRIPTION_H

#include "scene/output/page_mesh.h"
#include "scene/scene_data.h"

namespace hhtdae
{

/*
  The bodies of the scene come first, then one body for each mesh, which carries the frames of the mesh's attachments. A
  place, [body, x, y, z, qx, qy, qz, qw], is the position and attitude of a marker relative to the body's centre of mass in
  its axes; body -1 is the ground.

    {"format": 1, "title": text, "planar": bool, "up": [x, y, z],
     "bodies":   [{"name", "modes", "carrier": flexible body of an attachment's frame or -1, "rest": position of that frame
     without deformation, in the
                   carrier's axes relative to the carrier, "mesh": bool,
                   "shapes": [{"kind": "box" | "cylinder" | "sphere", "size": [x, y, z], "at": place, "colour": 0xRRGGBB or -1}],
                   "guess": whether the shape was derived from the inertia}],
     "ground":   [shapes],
     "lines":    [[place, place, ...]],
     "elements": [{"name", "type", "kind": "joint" | "motion" | "force", "i": place, "j": place or null}],
     "channels": [{"name", "unit"}],
     "surfaces": [{"body", "stress": bool, "unit", "moving": bool, whether its nodes move individually}]}
*/
std::string DescribePage(const SceneData &s, const std::string &title, const std::vector<std::unique_ptr<PageMesh>> &meshes);

} // namespace hhtdae

#endif
