/* Physical plausibility of a modal body; implausible bodies are neither written to a file nor read from one. */
#ifndef HHTDAE_FLEXIBLE_MODAL_CHECK_H
#define HHTDAE_FLEXIBLE_MODAL_CHECK_H

#include "hhtdae/modal.h"

namespace hhtdae
{

/* Describes a property, of finite numbers, that no body can have, or returns "" */
std::string Impossible(const ModalBody &body);

} // namespace hhtdae

#endif
