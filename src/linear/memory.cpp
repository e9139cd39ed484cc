/* Free memory under Linux, from /proc/meminfo and the limits of control groups, version 2 */
#include "memory.h"
#include <fstream>
#include <limits>
#include <sstream>
#include <string>

static const double INFINITE = std::numeric_limits<double>::infinity();

/* The number after the first word `name` of a file; negative if there is none */
static double NumberIn(const std::string &file, const std::string &name)
{
  std::ifstream in(file);
  std::string   line, word;
  double        value;
  while (std::getline(in, line)) {
    std::istringstream words(line);
    if (words >> word && word == name && words >> value) return value;
  }
  return -1;
}

/* The only number of a file; negative if there is none ("max") */
static double NumberOf(const std::string &file)
{
  std::ifstream in(file);
  double        value;
  return in >> value ? value : -1;
}

/* Least free memory of this process' control group and all groups above it, since a limit holds for all groups below (SLURM limits the job, systemd a slice) */
static double FreeInGroups(const std::string &root)
{
  std::ifstream in(root + "/proc/self/cgroup");
  std::string   line, path;
  while (std::getline(in, line))
    if (line.compare(0, 3, "0::") == 0) path = line.substr(3);
  double least = INFINITE;
  for (;; path.resize(path.rfind('/'))) {
    const std::string group       = root + "/sys/fs/cgroup" + path + "/memory.";
    const double      limit_bytes = NumberOf(group + "max"), used_bytes = NumberOf(group + "current"), cache_bytes = NumberIn(group + "stat", "file");
    if (limit_bytes >= 0 && used_bytes >= 0) least = PetscMin(least, (limit_bytes - used_bytes + (cache_bytes > 0 ? cache_bytes : 0)) / 1e6); /* the kernel evicts cached files when memory is needed */
    if (path.find('/') == std::string::npos) return least;
  }
}

double LinearFreeMemory(const std::string &root)
{
  const double available = NumberIn(root + "/proc/meminfo", "MemAvailable:"), swap = NumberIn(root + "/proc/meminfo", "SwapFree:");
  const double machine = available < 0 ? INFINITE : (available + (swap > 0 ? swap : 0)) * 1024 / 1e6;
  return PetscMin(machine, FreeInGroups(root));
}

PetscErrorCode LinearMemoryOf(MPI_Comm comm, double mine, double limit, LinearMemory *fullest)
{
  MPI_Comm machine;
  double   need_and_free[2] = {mine, limit < 0 ? LinearFreeMemory() : limit}, margin;
  struct {
    double margin;
    int    rank;
  } worst;
  PetscMPIInt rank;

  PetscFunctionBegin;
  PetscCallMPI(MPI_Comm_split_type(comm, MPI_COMM_TYPE_SHARED, 0, MPI_INFO_NULL, &machine));
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &need_and_free[0], 1, MPI_DOUBLE, MPI_SUM, machine));
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &need_and_free[1], 1, MPI_DOUBLE, MPI_MIN, machine));
  PetscCallMPI(MPI_Comm_free(&machine));
  PetscCallMPI(MPI_Comm_rank(comm, &rank));
  margin = need_and_free[1] - need_and_free[0];
  worst  = {margin, rank};
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &worst, 1, MPI_DOUBLE_INT, MPI_MINLOC, comm));
  PetscCallMPI(MPI_Bcast(need_and_free, 2, MPI_DOUBLE, worst.rank, comm));
  *fullest = {need_and_free[0], need_and_free[1]};
  PetscFunctionReturn(0);
}
