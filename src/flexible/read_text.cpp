/* Strict parsing of numbers; see read_text.h. */
#include "flexible/read_text.h"
#include <algorithm>
#include <cerrno>
#include <charconv>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <sys/stat.h>
#include <unistd.h>

namespace hhtdae
{

namespace
{

/* Skips a plus sign, which from_chars() does not accept; null if a second sign follows */
const char *SkipPlus(const char *begin, const char *end)
{
  if (begin == end || *begin != '+') return begin;
  return begin + 1 < end && begin[1] != '-' && begin[1] != '+' ? begin + 1 : nullptr;
}

/* For a decimal number outside the range of doubles by from_chars(): true if it underflows, with *value near 0 */
bool Underflow(const char *begin, const char *end, double *value)
{
  *value = std::strtod(std::string(begin, end).c_str(), nullptr);
  return std::isfinite(*value);
}

} // namespace

bool ParseReal(const char *begin, const char *end, double *value)
{
  const char *const from = SkipPlus(begin, end);
  if (!from) return false;
  const auto r = std::from_chars(from, end, *value);
  if (r.ec == std::errc::invalid_argument) return false;
  if (r.ptr < end && (*r.ptr == 'd' || *r.ptr == 'D')) {
    std::string plain(from, end);
    plain[(std::size_t)(r.ptr - from)] = 'e';
    return ParseReal(plain, value);
  }
  if (r.ptr != end) return false;
  if (r.ec == std::errc::result_out_of_range) return Underflow(from, end, value);
  return std::isfinite(*value);
}

bool ParseInteger(const char *begin, const char *end, PetscInt64 *value)
{
  const char *const from = SkipPlus(begin, end);
  long long         v    = 0;
  if (!from) return false;
  const auto r = std::from_chars(from, end, v);
  *value       = (PetscInt64)v;
  return r.ec == std::errc() && r.ptr == end;
}

std::vector<std::string> SplitWords(const std::string &line, bool commas)
{
  const char *const        between = commas ? " \t\r\v\f," : " \t\r\v\f";
  std::vector<std::string> words;
  for (std::size_t at = 0; (at = line.find_first_not_of(between, at)) != std::string::npos;) {
    const std::size_t end = std::min(line.find_first_of(between, at), line.size());
    words.push_back(line.substr(at, end - at));
    at = end;
  }
  return words;
}

std::string WhyUnreadable(const std::string &file)
{
  struct stat about;
  if (stat(file.c_str(), &about)) return errno == ENOENT ? "there is no such file" : std::strerror(errno);
  if (!S_ISREG(about.st_mode)) return "it is not a file";
  if (access(file.c_str(), R_OK)) return "there is no right to read it";
  return "";
}

std::string Quoted(const std::string &line)
{
  std::string text = "\"" + line.substr(0, 60) + (line.size() > 60 ? "...\"" : "\"");
  for (char &c : text)
    if ((unsigned char)c < ' ') c = '?';
  return text;
}

} // namespace hhtdae
