/* Base64 encoding of bytes, RFC 4648, for VTK's XML files and pages. */
#ifndef HHTDAE_SCENE_OUTPUT_BASE64_H
#define HHTDAE_SCENE_OUTPUT_BASE64_H

#include <cstddef>
#include <string>

namespace hhtdae
{

std::string Base64(const unsigned char *data, std::size_t n);

} // namespace hhtdae

#endif
