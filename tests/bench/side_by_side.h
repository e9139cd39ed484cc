/* Independent runs, several at a time, each in a process of its own, which returns its results through an unnamed
   file. Each process has its own CPU time, so that runs are measured as if they were made one after the other, except
   for the memory and the memory bandwidth that they share */
#ifndef HHTDAE_BENCH_SIDE_BY_SIDE_H
#define HHTDAE_BENCH_SIDE_BY_SIDE_H

#include <cerrno>
#include <cstdio>
#include <functional>
#include <map>
#include <petscsys.h>
#include <sys/wait.h>
#include <unistd.h>

namespace hhtbench
{

/* Calls run(k, file) for k = 0 ... count - 1 in separate processes, `jobs` at a time, and read(k, file) in this
   process when run k has ended, with the file at its beginning. Either returns false if it has failed */
inline PetscErrorCode SideBySide(int jobs, int count, const std::function<bool(int, FILE *)> &run, const std::function<bool(int, FILE *)> &read)
{
  struct Process {
    int   k;
    FILE *file;
  };
  std::map<pid_t, Process> running;

  PetscFunctionBegin;
  for (int next = 0; next < count || !running.empty();) {
    while (next < count && (int)running.size() < jobs) {
      FILE *file = std::tmpfile();
      PetscCheck(file, PETSC_COMM_SELF, PETSC_ERR_FILE_OPEN, "No temporary file for run %d", next);
      std::fflush(nullptr); /* otherwise the child process would write it again */
      const pid_t child = fork();
      PetscCheck(child >= 0, PETSC_COMM_SELF, PETSC_ERR_SYS, "No process for run %d", next);
      if (!child) {
        const bool good = run(next, file) && !std::fflush(file);
        std::fflush(stdout);
        _exit(good ? 0 : 1);
      }
      running[child] = {next++, file};
    }
    int         status = 0;
    const pid_t child  = waitpid(-1, &status, 0);
    PetscCheck(child > 0 || errno == EINTR, PETSC_COMM_SELF, PETSC_ERR_SYS, "A process has got lost");
    const auto who = running.find(child);
    if (who == running.end()) continue;
    const Process p = who->second;
    running.erase(who);
    std::rewind(p.file);
    PetscCheck(WIFEXITED(status) && !WEXITSTATUS(status) && read(p.k, p.file), PETSC_COMM_SELF, PETSC_ERR_LIB, "Run %d has failed", p.k);
    std::fclose(p.file);
  }
  PetscFunctionReturn(0);
}

} // namespace hhtbench

#endif
