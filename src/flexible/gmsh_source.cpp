/* Maps a file into memory; errors. */
#include "flexible/gmsh_source.h"
#include <cerrno>
#include <cstdarg>
#include <cstdio>
#include <fcntl.h>
#include <stdexcept>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

namespace hhtdae
{

namespace gmsh
{

void Fail(const char *format, ...)
{
  char    text[1024];
  va_list arguments;
  va_start(arguments, format);
  std::vsnprintf(text, sizeof text, format, arguments);
  va_end(arguments);
  throw std::runtime_error(text);
}

Mapping::~Mapping()
{
  if (begin) munmap(const_cast<char *>(begin), size);
}

void Mapping::open(const std::string &file)
{
  const int   handle = ::open(file.c_str(), O_RDONLY);
  struct stat about;
  if (handle < 0) Fail("there is no such file, or it cannot be read (%s)", std::strerror(errno));
  if (fstat(handle, &about) || !S_ISREG(about.st_mode) || about.st_size == 0) {
    close(handle);
    Fail("it is empty or no plain file");
  }
  size            = (Size)about.st_size;
  void *const map = mmap(nullptr, size, PROT_READ, MAP_PRIVATE, handle, 0);
  close(handle);
  if (map == MAP_FAILED) Fail("it cannot be mapped into memory (%s)", std::strerror(errno));
  begin = static_cast<const char *>(map);
}

} // namespace gmsh

} // namespace hhtdae
