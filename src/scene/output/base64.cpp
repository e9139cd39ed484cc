#include "scene/output/base64.h"

namespace hhtdae
{

std::string Base64(const unsigned char *data, std::size_t n)
{
  static const char digits[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string       text;
  text.reserve((n + 2) / 3 * 4);
  for (std::size_t i = 0; i < n; i += 3) {
    const int      left  = n - i < 3 ? (int)(n - i) : 3;
    const unsigned group = data[i] << 16 | (left > 1 ? data[i + 1] << 8 : 0) | (left > 2 ? data[i + 2] : 0);
    for (int k = 0; k < 4; k++) text += k <= left ? digits[group >> (18 - 6 * k) & 63] : '=';
  }
  return text;
}

} // namespace hhtdae
