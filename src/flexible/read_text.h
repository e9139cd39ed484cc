/* Reading text files of other programs: strict parsing of numbers, words of a line, readability of a file. */
#ifndef HHTDAE_FLEXIBLE_READ_TEXT_H
#define HHTDAE_FLEXIBLE_READ_TEXT_H

#include <petscsys.h>
#include <string>
#include <vector>

namespace hhtdae
{

/* The whole of [begin, end) must be a number: decimal digits with a point and an exponent e, E, d or D (Fortran). Numbers too large for
   a double, infinities, NaN and hexadecimal digits are refused; numbers that underflow become 0. */
bool ParseReal(const char *begin, const char *end, double *value);

/* Decimal digits with an optional sign */
bool ParseInteger(const char *begin, const char *end, PetscInt64 *value);

inline bool ParseReal(const std::string &word, double *value)
{
  return ParseReal(word.data(), word.data() + word.size(), value);
}
inline bool ParseInteger(const std::string &word, PetscInt64 *value)
{
  return ParseInteger(word.data(), word.data() + word.size(), value);
}

/* Words separated by blanks, or by blanks and commas */
std::vector<std::string> SplitWords(const std::string &line, bool commas);

/* Why the file cannot be read, or ""; folders, devices and pipes are refused, because they need not have an end */
std::string WhyUnreadable(const std::string &file);

/* The line in quotes, shortened, for a message */
std::string Quoted(const std::string &line);

} // namespace hhtdae

#endif
