/* Sources of the Gmsh reader: a file mapped into memory, words of a text, bytes of binary data; errors are exceptions. */
#ifndef HHTDAE_FLEXIBLE_GMSH_SOURCE_H
#define HHTDAE_FLEXIBLE_GMSH_SOURCE_H

#include "flexible/read_text.h"
#include <algorithm>
#include <cctype>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <limits>
#include <petscsys.h>
#include <string>

namespace hhtdae
{

namespace gmsh
{

using Size = std::size_t;

/* Throws std::runtime_error */
[[noreturn]] void Fail(const char *format, ...) __attribute__((format(printf, 1, 2)));

class Mapping
{
public:
  const char *begin = nullptr;
  Size        size  = 0;

  Mapping()                = default;
  Mapping(const Mapping &) = delete;
  ~Mapping();
  void open(const std::string &file);
};

class Words
{
public:
  Words(const char *at, const char *end) : at_(at), end_(end) {}
  const char *at() const { return at_; }

  PetscInt integer()
  {
    const char *const word = next();
    PetscInt64        value;
    if (!ParseInteger(word, at_, &value)) Fail("an integer is expected at '%s'", shown(word).c_str());
    if (value > std::numeric_limits<PetscInt>::max() || value < std::numeric_limits<PetscInt>::min())
      Fail("the number %lld does not fit PetscInt; configure PETSc with 64-bit indices", (long long)value);
    return (PetscInt)value;
  }
  /* Dimensions, types and numbers of physical groups, which Gmsh stores as int. INT_MIN is refused, because it has no absolute value. */
  int small()
  {
    const char *const word = next();
    PetscInt64        value;
    if (!ParseInteger(word, at_, &value) || std::abs(value) > std::numeric_limits<int>::max())
      Fail("an integer of 32 bits is expected at '%s'", shown(word).c_str());
    return (int)value;
  }
  double real()
  {
    const char *const word = next();
    double            value;
    if (!ParseReal(word, at_, &value)) Fail("a finite number is expected at '%s'", shown(word).c_str());
    return value;
  }
  /* Fails if more words follow */
  void finish()
  {
    const char *const word = next();
    if (word < at_) Fail("more numbers than there can be in a line, at '%s'", shown(word).c_str());
  }
  bool        ended() { return skip() == end_; }
  std::string word()
  {
    const char *const w = next();
    return std::string(w, at_);
  }
  /* The next name in quotes on this line */
  std::string quoted()
  {
    const char *line = static_cast<const char *>(std::memchr(at_, '\n', end_ - at_));
    if (!line) line = end_;
    const char *a = static_cast<const char *>(std::memchr(at_, '"', line - at_));
    const char *b = a ? static_cast<const char *>(std::memchr(a + 1, '"', line - a - 1)) : nullptr;
    if (!b) Fail("a name in quotes is expected at '%s'", shown(at_).c_str());
    at_ = b + 1;
    return std::string(a + 1, b);
  }

private:
  const char *at_, *end_;
  const char *skip()
  {
    while (at_ < end_ && std::isspace((unsigned char)*at_)) at_++;
    return at_;
  }
  /* Beginning of the next word; at_ moves to its end */
  const char *next()
  {
    const char *const word = skip();
    while (at_ < end_ && !std::isspace((unsigned char)*at_)) at_++;
    return word;
  }
  std::string shown(const char *from) const
  {
    std::string s(from, std::min(end_, from + 40));
    return s.substr(0, s.find('\n'));
  }
};

class Bytes
{
public:
  Bytes(const char *at, const char *end) : at_(at), end_(end) {}
  const char *at() const { return at_; }
  void        skip(Size count, Size each)
  {
    if (each && count > (Size)(end_ - at_) / each) Fail("it ends too early");
    at_ += count * each;
  }
  template <class T> T get()
  {
    const char *from = at_;
    T           value;
    skip(1, sizeof(T));
    std::memcpy(&value, from, sizeof(T));
    return value;
  }
  int small()
  {
    const int value = get<int>();
    if (value == std::numeric_limits<int>::min()) Fail("the number %d is impossible", value);
    return value;
  }
  PetscInt integer8()
  {
    const unsigned long long v = get<unsigned long long>();
    if (v > (unsigned long long)std::numeric_limits<PetscInt>::max())
      Fail("the number %llu does not fit PetscInt; configure PETSc with 64-bit indices", v);
    return (PetscInt)v;
  }

private:
  const char *at_, *end_;
};

} // namespace gmsh

} // namespace hhtdae

#endif
