/* Text files of other programs: strict numbers, words of a line, and whether there is a file to read at all. */
#ifndef HHTDAE_FLEXIBLE_READ_TEXT_H
#define HHTDAE_FLEXIBLE_READ_TEXT_H

#include <petscsys.h>
#include <string>
#include <vector>

namespace hhtdae
{

/* All of [begin, end) has to be the number: decimal digits with a point and an exponent e, E, d or D (Fortran's). What does
   not fit a double, infinities, NaN and hexadecimal digits are refused; what is too small for one becomes 0. */
bool ParseReal(const char *begin, const char *end, double *value);

/* Decimal digits with a sign or without */
bool ParseInteger(const char *begin, const char *end, PetscInt64 *value);

inline bool ParseReal(const std::string &word, double *value)
{
  return ParseReal(word.data(), word.data() + word.size(), value);
}
inline bool ParseInteger(const std::string &word, PetscInt64 *value)
{
  return ParseInteger(word.data(), word.data() + word.size(), value);
}

/* Words between blanks, or between blanks and commas */
std::vector<std::string> SplitWords(const std::string &line, bool commas);

/* Why the file cannot be read from its beginning to its end, which a folder, a device or a pipe need not have; "" if it can */
std::string WhyUnreadable(const std::string &file);

/* The line as part of a message */
std::string Quoted(const std::string &line);

} // namespace hhtdae

#endif
