/* Text and numbers in JSON that can be embedded in a script element of HTML. */
#ifndef HHTDAE_SCENE_OUTPUT_JSON_H
#define HHTDAE_SCENE_OUTPUT_JSON_H

#include <Eigen/Core>
#include <cmath>
#include <cstdio>
#include <string>

namespace hhtdae
{

/* The text as a JSON string in quotes. '<' and '&' are escaped, too, so that "</script>" or "<!--" in a name does not end the script element. */
inline std::string JSONText(const std::string &text)
{
  std::string out = "\"";
  char        number[8];
  for (char c : text) {
    if (c == '"' || c == '\\') out += '\\';
    if ((unsigned char)c < 0x20 || c == '<' || c == '>' || c == '&' || c == 0x7f) {
      std::snprintf(number, sizeof number, "\\u%04x", (unsigned)(unsigned char)c);
      out += number;
    } else out += c;
  }
  return out + '"';
}

/* The number, or null if it is not finite, since JSON has no such numbers. */
inline std::string JSONNumber(double x)
{
  char number[32];
  if (!std::isfinite(x)) return "null";
  std::snprintf(number, sizeof number, "%.12g", x + 0.0); /* + 0.0 converts -0 to 0 */
  return number;
}

template <class V> std::string JSONNumbers(const V &x)
{
  std::string out = "[";
  for (Eigen::Index k = 0; k < (Eigen::Index)x.size(); k++) out += (k ? "," : "") + JSONNumber(x[k]);
  return out + "]";
}

} // namespace hhtdae

#endif
