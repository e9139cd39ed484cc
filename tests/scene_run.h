/* A run of a scene without a TS */
#ifndef HHTDAE_TESTS_SCENE_RUN_H
#define HHTDAE_TESTS_SCENE_RUN_H

#include "scene/runtime.h"
#include "support.h"

namespace hhtest
{

/* The scene must have been set up */
inline std::unique_ptr<hhtdae::Runtime> layOut(const hhtdae::Scene &s)
{
  auto R = std::make_unique<hhtdae::Runtime>(hhtdae::SceneAccess::model(s));
  must(hhtdae::Layout(*R));
  return R;
}

} // namespace hhtest

#endif
