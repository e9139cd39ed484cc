/* Free memory as Linux tells it: /proc/meminfo, and the limits of version 2 of control groups */
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

/* A limit holds for the groups below the one that has it: SLURM's is that of the job, systemd's that of a slice */
static double FreeInGroups(const std::string &root)
{
  std::ifstream in(root + "/proc/self/cgroup");
  std::string   line, path;
  while (std::getline(in, line))
    if (line.compare(0, 3, "0::") == 0) path = line.substr(3);
  double least = INFINITE;
  for (;; path.resize(path.rfind('/'))) {
    const std::string group = root + "/sys/fs/cgroup" + path + "/memory.";
    const double      most = NumberOf(group + "max"), used = NumberOf(group + "current"), files = NumberIn(group + "stat", "file");
    if (most >= 0 && used >= 0) least = PetscMin(least, (most - used + (files > 0 ? files : 0)) / 1e6); /* what is cached of files gives way */
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
  double   have[2] = {mine, limit < 0 ? LinearFreeMemory() : limit}, less;
  struct {
    double less;
    int    rank;
  } worst;
  PetscMPIInt rank;

  PetscFunctionBegin;
  PetscCallMPI(MPI_Comm_split_type(comm, MPI_COMM_TYPE_SHARED, 0, MPI_INFO_NULL, &machine));
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &have[0], 1, MPI_DOUBLE, MPI_SUM, machine));
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &have[1], 1, MPI_DOUBLE, MPI_MIN, machine));
  PetscCallMPI(MPI_Comm_free(&machine));
  PetscCallMPI(MPI_Comm_rank(comm, &rank));
  less  = have[1] - have[0];
  worst = {less, rank};
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &worst, 1, MPI_DOUBLE_INT, MPI_MINLOC, comm));
  PetscCallMPI(MPI_Bcast(have, 2, MPI_DOUBLE, worst.rank, comm));
  *fullest = {have[0], have[1]};
  PetscFunctionReturn(0);
}
