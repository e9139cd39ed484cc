/* Which version of a sweep the processor can run. */
#include "sweeps.h"

namespace hht3
{

#if defined(__x86_64__) && defined(__GNUC__)
bool NewerProcessor()
{
  static const bool newer = __builtin_cpu_supports("avx2");
  return newer;
}
#endif

} // namespace hht3
