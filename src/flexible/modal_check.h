/* Whether the numbers of a modal body can be those of a body: what is not is neither written to a file nor read from one. */
#ifndef HHTDAE_FLEXIBLE_MODAL_CHECK_H
#define HHTDAE_FLEXIBLE_MODAL_CHECK_H

#include "hhtdae/modal.h"

namespace hhtdae
{

/* What no body has, of finite numbers: "" if nothing is wrong */
std::string Impossible(const ModalBody &body);

} // namespace hhtdae

#endif
