/* One rank's part of a checkpoint: a sequence of bytes that the same calls write and read. */
#ifndef HHTDAE_LINEAR_ARCHIVE_H
#define HHTDAE_LINEAR_ARCHIVE_H

#include <cstdint>
#include <cstring>
#include <type_traits>
#include <vector>

class Archive
{
public:
  std::vector<char> data;
  bool              reading = false;
  bool              good    = true; /* false once a read item is missing or has another size than expected */

  /* A whole struct, so that a new field of it is saved without further code */
  template <class T> void plain(T &x)
  {
    static_assert(std::is_trivially_copyable<T>::value, "only plain structs are saved as they are");
    std::uint64_t size = sizeof(T);
    bytes(&size, sizeof size);
    if (size != sizeof(T)) good = false;
#if defined(__has_builtin)
#if __has_builtin(__builtin_clear_padding)
    if (!reading) __builtin_clear_padding(&x); /* so that equal states give equal files */
#endif
#endif
    bytes(&x, sizeof(T));
  }

  template <class T> void list(std::vector<T> &x)
  {
    static_assert(std::is_trivially_copyable<T>::value, "only plain structs are saved as they are");
    std::uint64_t size = sizeof(T), count = x.size();
    bytes(&size, sizeof size);
    bytes(&count, sizeof count);
    if (size != sizeof(T) || (reading && count > (data.size() - at_) / sizeof(T))) good = false;
    if (!good) return;
    x.resize(count);
    bytes(x.data(), count * sizeof(T));
  }

  /* An array of which the reader expects this length */
  template <class T> void array(T *x, std::size_t count)
  {
    std::uint64_t n = count;
    bytes(&n, sizeof n);
    if (n != count) good = false;
    bytes(x, count * sizeof(T));
  }

private:
  std::size_t at_ = 0;

  void bytes(void *x, std::size_t n)
  {
    if (!good || !n) return;
    if (!reading) {
      data.resize(data.size() + n);
      std::memcpy(data.data() + data.size() - n, x, n);
      return;
    }
    if (n > data.size() - at_) {
      good = false;
      return;
    }
    std::memcpy(x, data.data() + at_, n);
    at_ += n;
  }
};

#endif
