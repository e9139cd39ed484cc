/*
  Binary data of a page: little-endian bytes, compressed by zlib and written in base64. Each sequence is in a separate script element of
  a type that browsers do not execute.
*/
#ifndef HHTDAE_SCENE_OUTPUT_PAGE_BYTES_H
#define HHTDAE_SCENE_OUTPUT_PAGE_BYTES_H

#include <cstdint>
#include <cstring>
#include <petscsys.h>
#include <string>
#include <vector>

namespace hhtdae
{

class PageBytes
{
public:
  std::vector<unsigned char> all;

  void u8(unsigned char x) { all.push_back(x); }
  void u32(std::uint32_t x) { whole(x); }
  void f32(float x)
  {
    std::uint32_t bits;
    std::memcpy(&bits, &x, sizeof bits);
    whole(bits);
  }
  void f64(double x)
  {
    std::uint64_t bits;
    std::memcpy(&bits, &x, sizeof bits);
    whole(bits);
  }
  /* Appends numbers "in planes": bytes of the same significance are stored together, since slowly varying numbers then compress far better. */
  void planes(const std::vector<std::uint16_t> &x) { inPlanes(x); }
  void planes(const std::vector<std::uint32_t> &x) { inPlanes(x); }

private:
  template <class T> void whole(T x)
  {
    for (std::size_t k = 0; k < sizeof x; k++) all.push_back((unsigned char)(x >> 8 * k));
  }
  template <class T> void inPlanes(const std::vector<T> &x)
  {
    for (std::size_t k = 0; k < sizeof(T); k++)
      for (T v : x) all.push_back((unsigned char)(v >> 8 * k));
  }
};

/* The script element that contains the bytes; kind: its purpose, such as "frames" */
PetscErrorCode PageElement(const PageBytes &bytes, const std::string &kind, std::string *element);

/* Zigzag coding of a difference as an unsigned number: 0, -1, 1, -2, ... become 0, 1, 2, 3, ... */
inline std::uint16_t ZigZag(std::uint16_t difference)
{
  const std::uint16_t negative = difference & 0x8000 ? 0xffff : 0;
  return (std::uint16_t)((unsigned)difference << 1 ^ negative);
}

} // namespace hhtdae

#endif
