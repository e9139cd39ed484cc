/*
  Checkpoints. Nothing is known here of what is in them but the checksum at their end, FNV-1a over all bytes before it: half of
  the damaged files get a right one, so that what stands before it is all that can be found wrong.
*/
#include "fuzz.h"
#include "support.h"
#include <cstring>
#include <fstream>
#include <sstream>

namespace hhtfuzz
{

namespace
{

using namespace hhtest;

const char *const settings = " -ts_rtol 1e-5 -ts_atol 1e-5 -ts_max_steps 60 ";

bool Finite(const Simulation &run)
{
  for (const Array &x : {run.u(), run.v(), run.a()})
    for (double v : x)
      if (!std::isfinite(v)) return false;
  return std::isfinite(run.t());
}

/* A refusal names the file. What is taken has a finite state, which it still has some steps later, or the run ends in an
   error of its own. */
template <class P> void Resume(const std::string &folder, Answer *a)
{
  const P    problem;
  Simulation run(problem, settings);
  a->code = TSHHT3CheckpointLoad(run.ts, (folder + "/checkpoint").c_str());
  if (!a->code) a->code = TSSetUp(run.ts);
  if (a->code) return;
  if (!Finite(run)) {
    a->nonsense = "a state that is not finite";
    return;
  }
  a->named = false;
  a->code  = run.solve();
  if (!a->code && !Finite(run)) a->nonsense = "a state that is not finite after some steps";
}

std::string Text(const std::string &file)
{
  std::ifstream     in(file, std::ios::binary);
  std::stringstream all;
  all << in.rdbuf();
  return all.str();
}

template <class P> std::vector<Input> Good()
{
  const P            problem;
  Simulation         run(problem, settings);
  char               folder[PETSC_MAX_PATH_LEN];
  std::vector<Input> good;
  must(PetscGetTmp(PETSC_COMM_SELF, folder, sizeof folder));
  const std::string file = std::string(folder) + "/hhtfuzz" + std::to_string(getpid()) + ".checkpoint";
  for (int k = 1; k <= 30; k++) {
    must(run.step());
    if (k != 1 && k != 30) continue;
    must(TSHHT3CheckpointSave(run.ts, file.c_str()));
    good.push_back({{{"checkpoint", Text(file), true}}});
  }
  std::remove(file.c_str());
  return good;
}

void Seal(std::string *file)
{
  std::uint64_t sum = 14695981039346656037ull;
  if (file->size() <= sizeof sum) return;
  for (std::size_t i = 0; i + sizeof sum < file->size(); i++) sum = (sum ^ (unsigned char)(*file)[i]) * 1099511628211ull;
  std::memcpy(&(*file)[file->size() - sizeof sum], &sum, sizeof sum);
}

Input Damage(const std::vector<Input> &good, Random &r)
{
  const Input &whole = r.of(good);
  Input        input = whole;
  DamageBytes(&input.files[0].text, r);
  input.refuse = input.files[0].text != whole.files[0].text;
  if (r.chance(0.7)) {
    Seal(&input.files[0].text);
    input.refuse = false; /* it may be a checkpoint of another state */
  }
  return input;
}

struct Swinging : Pendulum {
  Swinging() : Pendulum(-90., 0., 2.) {}
};

const Register pendulum({"checkpoint", Good<Swinging>, Damage, Resume<Swinging>}),
    variables({"checkpointvar", Good<UserVars>, Damage, Resume<UserVars>});

} // namespace

} // namespace hhtfuzz
