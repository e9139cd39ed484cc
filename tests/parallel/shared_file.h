/* A file that all ranks of a test read or write. */
#ifndef HHTDAE_TESTS_SHARED_FILE_H
#define HHTDAE_TESTS_SHARED_FILE_H

#include <cstdio>
#include <fstream>
#include <gtest/gtest.h>
#include <petscsys.h>
#include <sstream>
#include <string>
#include <unistd.h>

namespace hhtest
{

/* A file with the same name on all ranks, removed by rank 0. Collective */
struct SharedFile {
  std::string name;
  explicit SharedFile(const std::string &end)
  {
    int pid = getpid();
    MPI_Bcast(&pid, 1, MPI_INT, 0, PETSC_COMM_WORLD);
    name = testing::TempDir() + "hhtdae-ranks-" + std::to_string(pid) + end;
  }
  ~SharedFile()
  {
    int rank;
    MPI_Barrier(PETSC_COMM_WORLD);
    MPI_Comm_rank(PETSC_COMM_WORLD, &rank);
    if (!rank) std::remove(name.c_str());
  }
  SharedFile(const SharedFile &) = delete;
  std::string text() const
  {
    std::stringstream all;
    MPI_Barrier(PETSC_COMM_WORLD);
    all << std::ifstream(name).rdbuf();
    return all.str();
  }
};

} // namespace hhtest

#endif
