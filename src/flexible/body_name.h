/* The name of a reduced body in messages; a body in memory may have none. */
#ifndef HHTDAE_FLEXIBLE_BODY_NAME_H
#define HHTDAE_FLEXIBLE_BODY_NAME_H

#include "hhtdae/flexible.h"

namespace hhtdae
{

inline std::string BodyName(const ReducedBody &b) { return b.modal.name.empty() ? "the body" : "body " + b.modal.name; }

} // namespace hhtdae

#endif
