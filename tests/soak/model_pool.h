/* Every model runs in a process of its own, several at a time: a crash or an endless loop is counted, and the others
   continue. The processes write outcomes to shared memory as soon as these are known */
#ifndef HHTDAE_SOAK_MODEL_POOL_H
#define HHTDAE_SOAK_MODEL_POOL_H

#include "model_judge.h"
#include <csignal>
#include <fcntl.h>
#include <functional>
#include <map>
#include <sys/mman.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

namespace soak
{

class Pool
{
public:
  using Work = std::function<void(Outcome *)>;
  using Look = std::function<void(const Outcome &, int done)>;

  explicit Pool(int count) : count_(count)
  {
    void *memory =
        mmap(nullptr, sizeof(Outcome) * (std::size_t)count, PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0);
    outcome_ = memory == MAP_FAILED ? nullptr : static_cast<Outcome *>(memory);
  }
  ~Pool()
  {
    if (outcome_) munmap(outcome_, sizeof(Outcome) * (std::size_t)count_);
  }
  Pool(const Pool &) = delete;

  /* seconds: CPU time allowed for one model; the limit of wall-clock time is ten times as large */
  PetscErrorCode run(long first, int jobs, double seconds, bool quiet, const Work &work, const Look &look)
  {
    std::map<pid_t, int> running;
    int                  next = 0, done = 0;
    PetscFunctionBegin;
    PetscCheck(outcome_, PETSC_COMM_SELF, PETSC_ERR_MEM, "No shared memory for the outcomes of %d models", count_);
    while (done < count_) {
      while (next < count_ && (int)running.size() < jobs) {
        new (&outcome_[next]) Outcome();
        outcome_[next].number = first + next;
        std::fflush(nullptr);
        const pid_t child = fork();
        PetscCheck(child >= 0, PETSC_COMM_SELF, PETSC_ERR_SYS, "No process for model %ld could be started",
                   first + next);
        if (child == 0) child_(next, seconds, quiet, work);
        running[child] = next++;
      }
      int         status;
      const pid_t child = waitpid(-1, &status, 0);
      const auto  who   = running.find(child);
      if (who == running.end()) continue;
      Outcome &o = outcome_[who->second];
      running.erase(who);
      conclude(o, status);
      look(o, ++done);
    }
    PetscFunctionReturn(0);
  }
  const Outcome &operator[](int k) const { return outcome_[k]; }
  int            size() const { return count_; }

private:
  int      count_;
  Outcome *outcome_;

  [[noreturn]] void child_(int k, double seconds, bool quiet, const Work &work)
  {
    const rlimit limit{(rlim_t)seconds, (rlim_t)seconds + 5};
    PetscPopSignalHandler();
    for (int s : {SIGSEGV, SIGBUS, SIGFPE, SIGABRT, SIGILL, SIGTERM}) std::signal(s, SIG_DFL);
    setrlimit(RLIMIT_CPU, &limit);
    alarm((unsigned)(10 * seconds));
    if (quiet) {
      const int nowhere = open("/dev/null", O_WRONLY);
      dup2(nowhere, 1);
      dup2(nowhere, 2);
    }
    int code = 0;
    try {
      work(&outcome_[k]);
    } catch (const std::exception &e) {
      SetText(outcome_[k].message, sizeof outcome_[k].message, e.what());
      code = 1;
    }
    std::fflush(nullptr);
    _exit(code);
  }

  static void conclude(Outcome &o, int status)
  {
    if (WIFEXITED(status) && WEXITSTATUS(status) == 0 && o.stage == Done) return;
    const bool killed = WIFSIGNALED(status),
               late   = killed &&
                      (WTERMSIG(status) == SIGXCPU || WTERMSIG(status) == SIGALRM || WTERMSIG(status) == SIGKILL);
    const std::string before = o.message;
    o.verdict                = !late ? Crashed : o.stage == Referring || o.stage == Judging ? Unknown : Hung;
    SetText(o.message, sizeof o.message,
            std::string(late     ? "not at an end in time"
                        : killed ? std::string("signal ") + strsignal(WTERMSIG(status))
                                 : "ended by itself") +
                ", in " + stage_name[o.stage] + (before.empty() ? "" : ": " + before));
  }
};

} // namespace soak

#endif
