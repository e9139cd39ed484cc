/* Checks of the two markers of motions and couplers. */
#ifndef HHTDAE_SCENE_MOVING_PAIR_H
#define HHTDAE_SCENE_MOVING_PAIR_H

#include "scene/kernels/angle.h"
#include "scene/scene_data.h"
#include <string>

namespace hhtdae
{

/* Checks markers i and j, which must be valid markers of the scene. where: a prefix of messages, such as "term 2: " */
inline void RequirePair(ElementBuilder &e, Marker i, Marker j, bool rotation, const std::string &where = "")
{
  const SceneData &s       = e.scene();
  const PetscInt   body[2] = {s.markers[i.id].body, s.markers[j.id].body};
  e.require(body[0] != body[1], where + "both markers are on " + s.bodyName(body[0]) + ", must be on two bodies");
  for (int k = rotation ? 0 : 1; k < 2; k++) /* an advance uses only the axes of j */
    if (s.turnless(body[k])) e.require(false, where + "marker " + "ij"[k] + " is on " + s.turnlessName(body[k]) + ", must be on a rigid body or the ground");
  if (rotation && e.good())
    e.require(AngleDefined(e.frame(i), e.frame(j)), where + "the x axis of marker i is along the z axis of j, so that "
                                                            "there is no angle about z; turn the axes of marker i");
}

} // namespace hhtdae

#endif
