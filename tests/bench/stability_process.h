/* Runs a case in a process of its own, so that a crash, a hang or a leak affects only this case. The outcome comes
   back through a pipe; an incomplete outcome counts as a crash, and a process that exceeds the deadline is ended */
#ifndef HHTDAE_BENCH_STABILITY_PROCESS_H
#define HHTDAE_BENCH_STABILITY_PROCESS_H

#include "stability_case.h"

#include <cerrno>
#include <chrono>
#include <csignal>
#include <poll.h>
#include <sys/wait.h>
#include <unistd.h>

namespace hhtstab
{

/* Lines for the report that a case writes in addition to its outcome */
class ChildReport
{
public:
  void               add(const std::string &line) { text_ += line + "\n"; }
  const std::string &text() const { return text_; }

private:
  std::string text_;
};

/* Reads from the pipe until its end or the deadline; false: deadline */
inline bool ReadAll(int fd, double seconds, std::string *data)
{
  using Clock    = std::chrono::steady_clock;
  const auto end = Clock::now() + std::chrono::duration<double>(seconds);
  for (;;) {
    const auto left = std::chrono::duration_cast<std::chrono::milliseconds>(end - Clock::now()).count();
    pollfd     p    = {fd, POLLIN, 0};
    if (left <= 0 || poll(&p, 1, (int)left) == 0) return false;
    char          buffer[4096];
    const ssize_t n = read(fd, buffer, sizeof buffer);
    if (n < 0 && errno == EINTR) continue;
    if (n <= 0) return true;
    data->append(buffer, (std::size_t)n);
  }
}

inline void WriteAll(int fd, const void *data, std::size_t size)
{
  const char *at = static_cast<const char *>(data);
  while (size > 0) {
    const ssize_t n = write(fd, at, size);
    if (n < 0 && errno == EINTR) continue;
    if (n <= 0) return;
    at += n;
    size -= (std::size_t)n;
  }
}

inline PetscErrorCode RunApart(const Case &c, TSHHT3Form form, Outcome *out, ChildReport *report)
{
  int fd[2];
  PetscFunctionBegin;
  std::fflush(nullptr);
  PetscCheck(!pipe(fd), PETSC_COMM_SELF, PETSC_ERR_SYS, "No pipe for the case %s", c.name.c_str());
  const pid_t child = fork();
  PetscCheck(child >= 0, PETSC_COMM_SELF, PETSC_ERR_SYS, "No process for the case %s", c.name.c_str());
  if (!child) {
    const std::size_t before = report->text().size();
    close(fd[0]);
    PetscPopSignalHandler();
    for (int s : {SIGSEGV, SIGFPE, SIGABRT, SIGBUS, SIGILL}) std::signal(s, SIG_DFL); /* crashes must not be caught by PETSc */
    RunCase(c, form, *out);
    WriteAll(fd[1], out, sizeof *out);
    WriteAll(fd[1], report->text().data() + before, report->text().size() - before);
    _exit(0);
  }
  close(fd[1]);
  std::string data;
  const bool  in_time = ReadAll(fd[0], c.deadline, &data);
  close(fd[0]);
  if (!in_time) kill(child, SIGKILL);
  int status = 0;
  while (waitpid(child, &status, 0) < 0 && errno == EINTR) continue;
  if (in_time && data.size() >= sizeof *out) {
    std::memcpy(out, data.data(), sizeof *out);
    if (data.size() > sizeof *out) report->add(data.substr(sizeof *out, data.size() - sizeof *out - 1));
  } else if (in_time) {
    out->code = -1;
    std::snprintf(out->message, sizeof out->message, "crashed: signal %d", WIFSIGNALED(status) ? WTERMSIG(status) : 0);
  } else {
    out->code    = -2;
    out->seconds = c.deadline;
    std::snprintf(out->message, sizeof out->message, "not finished after %g s", c.deadline);
  }
  PetscFunctionReturn(0);
}

} // namespace hhtstab

#endif
