#ifndef HHTDAE_SOAK_MODEL_CHOICE_H
#define HHTDAE_SOAK_MODEL_CHOICE_H

#include <string>

namespace soak
{

/* Which models are generated */
struct Choice {
  bool small    = false; /* few bodies only */
  bool switches = true;  /* stiff elements that are released or engaged, in two of five models */
  bool extras   = false; /* elements of model_extras.h in each model */

  std::string options() const { return std::string(small ? " -small" : "") + (switches ? "" : " -switches 0") + (extras ? " -extras" : ""); }
};

} // namespace soak

#endif
