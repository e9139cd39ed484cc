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
