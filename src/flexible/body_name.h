/* How messages call a reduced body: one in memory has a name only where it was given one. */
#ifndef HHTDAE_FLEXIBLE_BODY_NAME_H
#define HHTDAE_FLEXIBLE_BODY_NAME_H

#include "hhtdae/flexible.h"

namespace hhtdae
{

inline std::string BodyName(const ReducedBody &b) { return b.modal.name.empty() ? "the body" : "body " + b.modal.name; }

} // namespace hhtdae

#endif
