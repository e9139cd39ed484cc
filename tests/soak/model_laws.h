/*
  Judgements that need no reference: the laws of Newton and Euler for every body, from channels
  (balance/newton_euler.h); the model described and run a second time in the same process; a checkpoint half way,
  written and gone on from with a scene and a TS of their own.

  The balance by channels is held against the residual of the scene at the same state: what is left of the forces and
  moments on a body by the one has to be left by the other, however far the corrector went, relative to all of them in
  absolute values. And the residual itself has to be solved, beyond what a corrector of c = 1e-9 may leave and what
  does not move positions, see model_residual.h.
*/
#ifndef HHTDAE_SOAK_MODEL_LAWS_H
#define HHTDAE_SOAK_MODEL_LAWS_H

#include "model_run.h"
#include <cstdio>
#include <unistd.h>

namespace soak
{

constexpr double allowed_imbalance = 1e-9, allowed_residual = 1e-9;

inline Settings LawSettings(double work)
{
  Settings s;
  s.corrector = 1e-9;
  s.tolerance = 1e-4;
  s.slack     = 1e3 * s.corrector * s.tolerance; /* the measured rate is that of the largest corrections; in stiff directions, where
                                                    they are small, the iteration may be far slower */
  s.laws      = true;
  s.work      = work;
  return s;
}

struct Repeated {
  bool again = false, resumed = false; /* digit for digit */
};

/* The first difference of two runs from sample `from` on, empty: none */
inline std::string Difference(const Trajectory &a, const Trajectory &b)
{
  if (!b.arrived()) return b.failure;
  for (std::size_t k = 0; k < a.x.size(); k++) {
    if (a.steps_at[k] != b.steps_at[k])
      return hhtbench::Text("%ld steps until sample %d, not %ld", b.steps_at[k], (int)k + 1, a.steps_at[k]);
    for (std::size_t c = 0; c < a.x[k].size(); c++)
      if (a.x[k][c] != b.x[k][c])
        return hhtbench::Text("channel %d at sample %d is %.17g, not %.17g", (int)c, (int)k + 1, b.x[k][c], a.x[k][c]);
  }
  return a.steps == b.steps ? "" : hhtbench::Text("%ld steps, not %ld", b.steps, a.steps);
}

template <class Build> Repeated Repeat(const Build &build, const Trajectory &a, bool options, std::string *why)
{
  Repeated          r;
  char              scratch[PETSC_MAX_PATH_LEN];
  PetscCallAbort(PETSC_COMM_SELF, PetscGetTmp(PETSC_COMM_SELF, scratch, sizeof scratch));
  const std::string file = hhtbench::Text("%s/soak-%ld.checkpoint", scratch, (long)getpid());
  Settings          s;
  s.options         = options;
  const Model first = build(), second = build(); /* both described before either runs */
  std::string different = Difference(a, RunHHT(first, s));
  r.again               = different.empty();
  if (!r.again) *why = "run again: " + different;
  s.save    = file;
  s.save_at = std::max(1L, a.steps / 2);
  different = Difference(a, RunHHT(second, s));
  if (!different.empty()) {
    if (why->empty()) *why = "writing a checkpoint changes the run: " + different;
  } else {
    Trajectory  until = a;
    std::size_t k     = 0;
    while (k < a.x.size() && a.steps_at[k] <= s.save_at) k++;
    until.x.resize(k);
    until.steps_at.resize(k);
    s.save.clear();
    s.resume  = file;
    s.until   = &until;
    different = Difference(a, RunHHT(build(), s));
    r.resumed = different.empty();
    if (!r.resumed && why->empty())
      *why = hhtbench::Text("gone on from step %ld of %ld: ", s.save_at, a.steps) + different;
  }
  std::remove(file.c_str());
  std::remove((file + ".info").c_str());
  return r;
}

} // namespace soak

#endif
