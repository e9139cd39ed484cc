/* Resources that this process has used so far */
#ifndef HHTDAE_BENCH_PROCESS_USE_H
#define HHTDAE_BENCH_PROCESS_USE_H

#include <ctime>
#include <sys/resource.h>

namespace hhtbench
{

/* Processor time of all threads, s */
inline double ProcessorSeconds()
{
  timespec t = {};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
  return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

/* Largest resident memory, 1e6 bytes (Linux counts in 1024 bytes) */
inline double PeakMegabytes()
{
  rusage use = {};
  getrusage(RUSAGE_SELF, &use);
  return 1024. * (double)use.ru_maxrss / 1e6;
}

} // namespace hhtbench

#endif
