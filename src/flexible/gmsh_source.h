/* What is read from: a file mapped into memory, words of a text, bytes of binary data; and how reading fails. */
#ifndef HHTDAE_FLEXIBLE_GMSH_SOURCE_H
#define HHTDAE_FLEXIBLE_GMSH_SOURCE_H

#include <algorithm>
#include <cctype>
#include <charconv>
#include <cmath>
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
    long long  value = 0;
    const auto r     = std::from_chars(skip(), end_, value);
    if (r.ec != std::errc() || (r.ptr < end_ && !std::isspace((unsigned char)*r.ptr)))
      Fail("an integer is expected at '%s'", here().c_str());
    if (value > std::numeric_limits<PetscInt>::max() || value < std::numeric_limits<PetscInt>::min())
      Fail("the number %lld does not fit PetscInt; configure PETSc with 64-bit indices", value);
    at_ = r.ptr;
    return (PetscInt)value;
  }
  double real()
  {
    double value = 0;
    auto   r     = std::from_chars(skip(), end_, value);
    if (r.ec == std::errc::result_out_of_range)
      value = 0; /* too small for a double, or too large */
    else if (r.ec != std::errc() || !std::isfinite(value))
      Fail("a finite number is expected at '%s'", here().c_str());
    at_ = r.ptr;
    return value;
  }
  std::string quoted()
  {
    const char *a = static_cast<const char *>(std::memchr(at_, '"', end_ - at_));
    const char *b = a ? static_cast<const char *>(std::memchr(a + 1, '"', end_ - a - 1)) : nullptr;
    if (!b) Fail("a name in quotes is expected at '%s'", here().c_str());
    at_ = b + 1;
    return std::string(a + 1, b);
  }
  std::string here() const
  {
    std::string s(at_, std::min(end_, at_ + 40));
    return s.substr(0, s.find('\n'));
  }

private:
  const char *at_, *end_;
  const char *skip()
  {
    while (at_ < end_ && std::isspace((unsigned char)*at_)) at_++;
    if (at_ < end_ && *at_ == '+') at_++;
    return at_;
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
