/* The recorded calls that describe a scene. They are repeated with other parameters, or for a set-up with another StartPolicy. */
#ifndef HHTDAE_SCENE_JOURNAL_H
#define HHTDAE_SCENE_JOURNAL_H

#include "model.h"
#include <functional>
#include <map>

namespace hhtdae
{

struct Scene::Journal {
  std::vector<std::function<void(Scene &)>> calls;
  std::vector<std::size_t>                  before; /* number of markers and bodies, including attachments, before each call when it was recorded */
  std::size_t                               entries = 0; /* number of entries of all kinds in the scene before the last call */
  std::map<std::string, Parameter>          parameters;
  std::vector<std::string>                  errors; /* errors in calls of parameter() */
  /* whether a parameter, start() or an option of the set-up has changed since the present model was described */
  bool                                      stale = false;
  std::string                               solvers;       /* options of the set-up's linear solvers, with which the present model was set up */
};

bool SameStart(const StartPolicy &a, const StartPolicy &b); /* check.cpp */

} // namespace hhtdae

#endif
