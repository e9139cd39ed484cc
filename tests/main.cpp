/*
  The main program of all GoogleTest executables. With mpiexec every rank runs every test; the first rank prints, the
  others only what failed on them, and all ranks return failure if one of them failed.
*/
#include <gtest/gtest.h>
#include <hhtdae/hhtdae.h>

namespace
{

class PrintFailures : public testing::EmptyTestEventListener
{
  int rank;

public:
  explicit PrintFailures(int r) : rank(r) {}

private:
  void OnTestPartResult(const testing::TestPartResult &result) override
  {
    if (!result.failed()) return;
    fprintf(stderr, "[rank %d] %s:%d: %s\n", rank, result.file_name() ? result.file_name() : "?", result.line_number(),
            result.summary());
  }
};

int RunAllRanks()
{
  int rank, mine, all;

  MPI_Comm_rank(PETSC_COMM_WORLD, &rank);
  if (rank > 0) {
    testing::TestEventListeners &listeners = testing::UnitTest::GetInstance()->listeners();
    delete listeners.Release(listeners.default_result_printer());
    listeners.Append(new PrintFailures(rank));
  }
  mine = RUN_ALL_TESTS();
  /* A program without tests has not shown anything. */
  if (!testing::UnitTest::GetInstance()->test_to_run_count()) mine = 1;
  MPI_Allreduce(&mine, &all, 1, MPI_INT, MPI_MAX, PETSC_COMM_WORLD);
  return all;
}

} // namespace

#if defined(__SANITIZE_ADDRESS__)
/* Open MPI and what it loads leak at start-up, at the end and where a file is opened, and HDF5 forgets object headers of files
   that are damaged on purpose, from its free lists alone; PETSc keeps the names of a block of options in which an error was
   raised. By functions, not libraries: a communicator that the project forgets has to be seen. */
extern "C" const char *__lsan_default_suppressions()
{
  return "leak:ompi_mpi_init\nleak:ompi_mpi_finalize\nleak:hwloc_topology_load\nleak:event_base_loop\n"
         "leak:mca_io_base_file_select\nleak:H5FL_reg_malloc\nleak:H5FL_blk_malloc\nleak:PetscOptionsBegin_Private\n";
}
#endif

int main(int argc, char **argv)
{
  int failed;

  testing::InitGoogleTest(&argc, argv);
  /* Listing the tests is part of the build and needs no MPI. */
  if (testing::GTEST_FLAG(list_tests)) return RUN_ALL_TESTS();
  if (PetscInitialize(&argc, &argv, nullptr, "GoogleTest options come first, then PETSc's\n")) return 2;
  if (TSHHT3Initialize()) return 2;
  failed = RunAllRanks();
  if (PetscFinalize()) return 2;
  return failed;
}
