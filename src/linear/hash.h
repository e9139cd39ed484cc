/* The 64-bit hash FNV-1a of Fowler, Noll and Vo, for checksums of files and identification of models; and a mixing step. */
#ifndef HHTDAE_LINEAR_HASH_H
#define HHTDAE_LINEAR_HASH_H

#include <cstddef>
#include <cstdint>

struct Hash {
  std::uint64_t sum = 14695981039346656037ull;

  Hash &add(const void *x, std::size_t n)
  {
    for (std::size_t i = 0; i < n; i++) sum = (sum ^ static_cast<const unsigned char *>(x)[i]) * 1099511628211ull;
    return *this;
  }
};

/* The mixing step of splitmix64 */
inline std::uint64_t HashMix(std::uint64_t x)
{
  x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9u;
  x = (x ^ (x >> 27)) * 0x94d049bb133111ebu;
  return x ^ (x >> 31);
}

#endif
