/* Reads an input in a process of its own, forked from one in which PETSc is already initialized, which takes a millisecond */
#include "fuzz.h"
#include <csignal>
#include <cstdio>
#include <cstring>
#include <fcntl.h>
#include <fstream>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

namespace hhtfuzz
{

namespace
{

/* Limits. Readers have buffers of a few megabytes for any file size; PETSc and HDF5 load and set up data at their
   first use. The limit of wall-clock time is needed because a waiting process uses no processor time */
constexpr rlim_t cpu_seconds   = 5;
constexpr int    clock_seconds = 120;
constexpr rlim_t fixed_bytes = (rlim_t)96 << 20, bytes_for_one = 1000;

#if defined(__SANITIZE_ADDRESS__)
constexpr bool sanitized = true; /* the sanitizer reserves terabytes of addresses and reports crashes itself */
#else
constexpr bool sanitized = false;
#endif

/* Size of the address space and of the memory in use */
void InUse(rlim_t *addresses, double *megabytes)
{
  long          pages = 0, resident = 0;
  std::ifstream in("/proc/self/statm");
  in >> pages >> resident;
  *addresses = (rlim_t)pages * (rlim_t)sysconf(_SC_PAGESIZE);
  *megabytes = 1e-6 * (double)resident * (double)sysconf(_SC_PAGESIZE);
}

void Bound(std::size_t bytes)
{
  rlim_t now;
  double unused;
  InUse(&now, &unused);
  const rlimit cpu = {cpu_seconds, cpu_seconds + 1}, core = {0, 0};
  const rlim_t most   = now + fixed_bytes + bytes_for_one * bytes;
  const rlimit memory = {most, most};
  setrlimit(RLIMIT_CPU, &cpu);
  setrlimit(RLIMIT_CORE, &core);
  if (!sanitized) setrlimit(RLIMIT_AS, &memory);
  alarm(clock_seconds);
}

/* Redirects the reader's output to a file beside the input */
void Redirect(const std::string &file)
{
  const int out = open(file.c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0644);
  dup2(out, 1);
  dup2(out, 2);
  close(out);
}

char Judge(const Input &input, const std::string &folder, const Answer &a, std::string *text)
{
  *text = a.code ? a.message : a.nonsense;
  if (a.code == PETSC_ERR_MEM || a.message.find("bad_alloc") != std::string::npos) return 'm';
  if (a.code && a.message.empty()) *text = "error " + std::to_string((int)a.code) + " without a message";
  if (a.code && a.named && a.message.find(folder) == std::string::npos) {
    *text = "the message names no file of the input: " + *text;
    return 'n';
  }
  if (a.code) return 'r';
  if (a.nonsense.empty() && input.refuse) *text = "what is no number was taken for one, or damage was not seen";
  return text->empty() ? 't' : 'n';
}

[[noreturn]] void Child(const Reader &reader, const Input &input, const std::string &folder, std::size_t bytes, int to)
{
  Answer      answer;
  std::string text;
  PetscPopSignalHandler();
  if (!sanitized)
    for (int s : {SIGSEGV, SIGFPE, SIGABRT, SIGBUS, SIGILL}) std::signal(s, SIG_DFL);
  Redirect(folder + "/output");
  Bound(bytes);
  {
    Errors errors(&answer);
    reader.read(folder, &answer);
  }
  const char verdict = Judge(input, folder, answer, &text);
  text               = verdict + text.substr(0, 2000);
  const ssize_t sent = write(to, text.data(), text.size());
  _exit(sent == (ssize_t)text.size() ? 0 : 9);
}

Outcome Conclude(int status, const std::string &said)
{
  Outcome   out;
  const int signal = WIFSIGNALED(status) ? WTERMSIG(status) : 0;
  if (signal == SIGXCPU || signal == SIGALRM || signal == SIGKILL) {
    out.kind = Outcome::Hung;
    out.text = signal == SIGALRM ? "waited too long" : "used too much processor time";
  } else if (signal || WEXITSTATUS(status) || said.empty()) {
    out.kind = Outcome::Crashed;
    out.text = signal ? std::string("signal ") + strsignal(signal) : "exit " + std::to_string(WEXITSTATUS(status));
  } else {
    const char *const kinds = "trmn";
    const Outcome::Kind of[] = {Outcome::Taken, Outcome::Refused, Outcome::Memory, Outcome::Nonsense};
    out.kind                 = of[std::strchr(kinds, said[0]) - kinds];
    out.text                 = said.substr(1);
  }
  return out;
}

} // namespace

const char *NameOf(Outcome::Kind kind)
{
  const char *const names[] = {"taken", "refused", "crashed", "hung", "memory", "nonsense"};
  return names[kind];
}

Outcome Try(const Reader &reader, const Input &input, const std::string &folder)
{
  std::size_t bytes = 0;
  int         fd[2], status = 0;
  rusage      usage;
  rlim_t      unused;
  double      before;
  char        said[2048];
  Outcome     failed;
  failed.kind = Outcome::Crashed;
  failed.text = "no process for it";
  for (const File &f : input.files) {
    const std::string text = f.bytes();
    std::ofstream(folder + "/" + f.name, std::ios::binary) << text;
    bytes += text.size();
  }
  if (pipe(fd)) return failed;
  std::fflush(nullptr);
  const pid_t child = fork();
  if (child < 0) return failed;
  if (!child) Child(reader, input, folder, bytes, fd[1]);
  close(fd[1]);
  while (wait4(child, &status, 0, &usage) < 0) continue;
  const ssize_t got = read(fd[0], said, sizeof said);
  close(fd[0]);
  InUse(&unused, &before);
  Outcome out   = Conclude(status, std::string(said, got > 0 ? (std::size_t)got : 0));
  out.cpu       = (double)usage.ru_utime.tv_sec + 1e-6 * (double)usage.ru_utime.tv_usec;
  out.megabytes = 1e-3 * (double)usage.ru_maxrss * 1.024 - before;
  for (const File &f : input.files) std::remove((folder + "/" + f.name).c_str());
  return out;
}

PetscErrorCode Errors::keep(MPI_Comm, int, const char *, const char *, PetscErrorCode code, PetscErrorType type,
                            const char *message, void *ctx)
{
  Answer *answer = static_cast<Answer *>(ctx);
  if (type == PETSC_ERROR_INITIAL && answer->message.empty() && message) answer->message = message;
  return code;
}

} // namespace hhtfuzz
