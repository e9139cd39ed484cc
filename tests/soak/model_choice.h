#ifndef HHTDAE_SOAK_MODEL_CHOICE_H
#define HHTDAE_SOAK_MODEL_CHOICE_H

#include <string>

namespace soak
{

/* Which models are made */
struct Choice {
  bool small    = false; /* of few bodies alone */
  bool switches = true;  /* stiff elements that let go or take hold, in two of five */
  bool extras   = false; /* elements of model_extras.h, in each */

  std::string options() const { return std::string(small ? " -small" : "") + (switches ? "" : " -switches 0") + (extras ? " -extras" : ""); }
};

} // namespace soak

#endif
