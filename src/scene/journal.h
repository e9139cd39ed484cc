/* The recorded calls that describe a scene, so that they can be repeated with other parameters, or for a set-up with another start. */
#ifndef HHTDAE_SCENE_JOURNAL_H
#define HHTDAE_SCENE_JOURNAL_H

#include "model.h"
#include <functional>
#include <map>

namespace hhtdae
{

struct Scene::Journal {
  std::vector<std::function<void(Scene &)>> calls;
  std::vector<std::size_t>                  before; /* markers and bodies, attachments among them, at first before each call */
  std::map<std::string, Parameter>          parameters;
  std::vector<std::string>                  errors; /* of parameters themselves */
  bool                                      stale = false; /* a parameter, start() or an option of the set-up has changed since the present model was described */
  std::string                               solvers;       /* options of the set-up's linear solvers, with which the present model was set up */
};

bool SameStart(const StartPolicy &a, const StartPolicy &b); /* check.cpp */

} // namespace hhtdae

#endif
