/* The names of all options of scenes, from which misspelt ones are recognized in PetscFinalize(). */
#include "start.h"
#include <hhtdae/options.h>

namespace hhtdae
{

PetscErrorCode DeclareSceneOptions()
{
  static const char *const names[] = {"scene_",
                                      "scene_assemble",
                                      "scene_assemble_tol",
                                      "scene_redundant",
                                      "scene_equilibrium",
                                      "scene_view",
                                      "scene_start_time", "scene_rotations",
                                      "scene_angle_tol",
                                      "scene_output",
                                      "scene_csv",
                                      "scene_dt",
                                      "scene_rate",
                                      "scene_animation",
                                      "scene_animation_dt",
                                      "scene_page",
                                      "scene_page_dt",
                                      "scene_page_frames",
                                      "scene_page_nodes",
                                      "scene_balance",
                                      nullptr};
  PetscFunctionBegin;
  PetscCall(TSHHT3DeclareOptions(names));
  PetscFunctionReturn(0);
}

} // namespace hhtdae
