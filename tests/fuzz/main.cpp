/*
  fuzz: damaged input for every reader of files.

    -count N    inputs, 100000 by default          -seed S     1 by default
    -jobs J     processes that work, 1 by default  -reader R   one reader alone
    -only K     input K alone; its folder is kept and what the reader said is printed
    -output D   folder for inputs that show a fault, build/fuzz by default

  Prints a table and ends with 1 if there was a fault.
*/
#include "fuzz.h"
#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <hhtdae/hhtdae.h>
#include <sstream>
#include <sys/mman.h>
#include <sys/wait.h>
#include <unistd.h>

namespace hhtfuzz
{

std::vector<Reader> &Readers()
{
  static std::vector<Reader> readers;
  return readers;
}

namespace
{

constexpr int kinds = Outcome::Nonsense + 1, most_jobs = 256;

/* Counts, and the inputs that needed most time and memory */
struct Tally {
  long     of[kinds];
  double   cpu, megabytes;
  PetscInt slowest, largest;
};

struct Plan {
  PetscInt                        count = 100000, seed = 1, jobs = 1, only = -1;
  std::string                     reader, output = "build/fuzz";
  std::vector<std::vector<Input>> good; /* valid inputs of each reader */
};

bool IsFault(Outcome::Kind kind) { return kind != Outcome::Taken && kind != Outcome::Refused; }

bool Wanted(const Plan &plan, std::size_t r) { return plan.reader.empty() || plan.reader == Readers()[r].name; }

Input Make(const Plan &plan, PetscInt number)
{
  const std::size_t r = (std::size_t)number % Readers().size();
  Random            random((std::uint64_t)plan.seed * 0x9e3779b97f4a7c15ull + (std::uint64_t)number);
  random.bits();
  return Readers()[r].damage(plan.good[r], random);
}

void Folder(const std::string &name)
{
  if (std::system(("mkdir -p '" + name + "'").c_str())) std::fprintf(stderr, "fuzz: cannot make the folder %s\n", name.c_str());
}

void Keep(const std::string &folder, const Input &input, const std::string &why)
{
  Folder(folder);
  for (const File &f : input.files) std::ofstream(folder + "/" + f.name, std::ios::binary) << f.bytes();
  std::ofstream(folder + "/why") << why << "\n";
}

void Most(double *most, PetscInt *input, double value, PetscInt number)
{
  if (!(value > *most)) return;
  *most  = value;
  *input = number;
}

/* Processes the input numbers of this job */
void Work(const Plan &plan, int job, const std::string &folder, Tally *tally)
{
  for (PetscInt k = job; k < plan.count; k += plan.jobs) {
    const std::size_t r = (std::size_t)k % Readers().size();
    if (!Wanted(plan, r)) continue;
    const Input   input = Make(plan, k);
    const Outcome o     = Try(Readers()[r], input, folder);
    tally[r].of[o.kind]++;
    Most(&tally[r].cpu, &tally[r].slowest, o.cpu, k);
    Most(&tally[r].megabytes, &tally[r].largest, o.megabytes, k);
    if (IsFault(o.kind)) {
      const std::string name = Readers()[r].name + "-" + std::to_string(k);
      std::printf("fault: -seed %lld -only %lld: %s %s: %s\n", (long long)plan.seed, (long long)k, Readers()[r].name.c_str(),
                  NameOf(o.kind), o.text.c_str());
      Keep(plan.output + "/" + name, input, o.text);
    }
    if (!job && k / plan.jobs % 5000 == 4999) std::printf("fuzz: %lld of %lld\n", (long long)k, (long long)plan.count);
    std::fflush(stdout);
  }
}

/* Valid inputs must be accepted; otherwise damaged ones show nothing */
int TryGood(const Plan &plan, const std::string &folder)
{
  int faults = 0;
  for (std::size_t r = 0; r < Readers().size(); r++)
    for (std::size_t k = 0; k < plan.good[r].size() && Wanted(plan, r); k++) {
      const Outcome o = Try(Readers()[r], plan.good[r][k], folder);
      if (o.kind == Outcome::Taken) continue;
      std::printf("fault: good input %d of %s is not taken: %s: %s\n", (int)k, Readers()[r].name.c_str(), NameOf(o.kind),
                  o.text.c_str());
      Keep(plan.output + "/" + Readers()[r].name + "-good" + std::to_string(k), plan.good[r][k], o.text);
      faults++;
    }
  return faults;
}

long Report(const Plan &plan, const std::vector<Tally> &tally)
{
  long all = 0, faults = 0;
  std::printf("%-13s %8s %8s %8s %8s %8s %8s %8s   %s\n", "reader", "inputs", "taken", "refused", "crashed", "hung", "memory",
              "nonsense", "most time and memory (input)");
  for (std::size_t r = 0; r < Readers().size(); r++) {
    long n = 0;
    for (long c : tally[r].of) n += c;
    if (!n) continue;
    std::printf("%-13s %8ld", Readers()[r].name.c_str(), n);
    for (int k = 0; k < kinds; k++) {
      std::printf(" %8ld", tally[r].of[k]);
      if (IsFault((Outcome::Kind)k)) faults += tally[r].of[k];
    }
    std::printf("   %.2f s (%lld), %.0f MB (%lld)\n", tally[r].cpu, (long long)tally[r].slowest, tally[r].megabytes,
                (long long)tally[r].largest);
    all += n;
  }
  if (std::none_of(Readers().begin(), Readers().end(), [](const Reader &r) { return r.name == "body"; }))
    std::printf("fuzz: files of reduced bodies are left out, this program was compiled without HDF5\n");
  std::printf("fuzz: %ld inputs of seed %lld, %ld faults\n", all, (long long)plan.seed, faults);
  return faults;
}

long RunJobs(const Plan &plan, const std::string &scratch)
{
  const std::size_t  readers = Readers().size(), size = sizeof(Tally) * readers * (std::size_t)plan.jobs;
  Tally *const       shared =
      static_cast<Tally *>(mmap(nullptr, size, PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0));
  std::vector<Tally> sum(readers, Tally{});
  std::vector<pid_t> job;
  long               lost = 0;
  if (shared == MAP_FAILED) return 1;
  std::fflush(stdout);
  for (int j = 0; j < (int)plan.jobs; j++) {
    const std::string folder = scratch + "/job" + std::to_string(j);
    Folder(folder);
    job.push_back(fork());
    if (job.back()) continue;
    Work(plan, j, folder, shared + readers * (std::size_t)j);
    std::fflush(stdout);
    _exit(0);
  }
  for (pid_t p : job) {
    int status = 1;
    while (p > 0 && waitpid(p, &status, 0) < 0) continue;
    lost += p <= 0 || status != 0;
  }
  for (int j = 0; j < (int)plan.jobs; j++)
    for (std::size_t r = 0; r < readers; r++) {
      const Tally &t = shared[readers * (std::size_t)j + r];
      Tally       &s = sum[r];
      for (int k = 0; k < kinds; k++) s.of[k] += t.of[k];
      Most(&s.cpu, &s.slowest, t.cpu, t.slowest);
      Most(&s.megabytes, &s.largest, t.megabytes, t.largest);
    }
  munmap(shared, size);
  if (lost) std::printf("fault: %ld of the jobs ended early\n", lost);
  return Report(plan, sum) + lost;
}

int TryOnly(const Plan &plan)
{
  const std::size_t r      = (std::size_t)plan.only % Readers().size();
  const std::string folder = plan.output + "/" + Readers()[r].name + "-" + std::to_string(plan.only);
  const Input       input  = Make(plan, plan.only);
  Folder(folder);
  const Outcome o = Try(Readers()[r], input, folder);
  Keep(folder, input, o.text);
  std::ifstream     output(folder + "/output");
  std::stringstream said;
  said << output.rdbuf();
  std::printf("%s\n%s: %s: %s\nin %s\n", said.str().c_str(), Readers()[r].name.c_str(), NameOf(o.kind), o.text.c_str(),
              folder.c_str());
  return IsFault(o.kind);
}

PetscErrorCode ReadOptions(Plan *plan)
{
  char      text[PETSC_MAX_PATH_LEN];
  PetscBool given;
  PetscFunctionBegin;
  PetscCall(PetscOptionsGetInt(nullptr, nullptr, "-count", &plan->count, nullptr));
  PetscCall(PetscOptionsGetInt(nullptr, nullptr, "-seed", &plan->seed, nullptr));
  PetscCall(PetscOptionsGetInt(nullptr, nullptr, "-jobs", &plan->jobs, nullptr));
  PetscCall(PetscOptionsGetInt(nullptr, nullptr, "-only", &plan->only, nullptr));
  PetscCall(PetscOptionsGetString(nullptr, nullptr, "-reader", text, sizeof text, &given));
  if (given) plan->reader = text;
  PetscCall(PetscOptionsGetString(nullptr, nullptr, "-output", text, sizeof text, &given));
  if (given) plan->output = text;
  bool known = plan->reader.empty();
  for (const Reader &r : Readers()) known = known || r.name == plan->reader;
  PetscCheck(known, PETSC_COMM_SELF, PETSC_ERR_USER_INPUT, "-reader %s: there is no such reader", plan->reader.c_str());
  PetscCheck(plan->jobs >= 1 && plan->jobs <= most_jobs && plan->count >= 0, PETSC_COMM_SELF, PETSC_ERR_USER_INPUT,
             "-jobs 1 .. %d, and -count not negative", most_jobs);
  PetscFunctionReturn(0);
}

PetscErrorCode Run(long *faults)
{
  Plan plan;
  char scratch[PETSC_MAX_PATH_LEN];
  PetscFunctionBegin;
  /* sorted, so that numbers stand for the same inputs in whatever order the sources were linked */
  std::sort(Readers().begin(), Readers().end(), [](const Reader &a, const Reader &b) { return a.name < b.name; });
  PetscCall(ReadOptions(&plan));
  PetscCall(PetscGetTmp(PETSC_COMM_SELF, scratch, sizeof scratch));
  const std::string folder = std::string(scratch) + "/hhtfuzz" + std::to_string(getpid());
  Folder(folder);
  for (const Reader &r : Readers()) plan.good.push_back(r.good());
  *faults = plan.only >= 0 ? TryOnly(plan) : TryGood(plan, folder);
  if (plan.only < 0 && !*faults) *faults = RunJobs(plan, folder);
  if (std::system(("rm -rf '" + folder + "'").c_str())) *faults = 1;
  PetscFunctionReturn(0);
}

} // namespace

} // namespace hhtfuzz

int main(int argc, char **argv)
{
  long faults = 1;
  if (PetscInitialize(&argc, &argv, nullptr, nullptr) || TSHHT3Initialize()) return 2;
  if (hhtfuzz::Run(&faults)) return 2;
  if (PetscFinalize()) return 2;
  return faults ? 1 : 0;
}
