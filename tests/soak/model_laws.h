/*
  Judgements that need no reference: the laws of Newton and Euler for every body, from channels
  (balance/newton_euler.h); the model described and run a second time in the same process; a checkpoint written half way
  and resumed with another scene and another TS.

  The imbalance of a body according to its channels is compared with the residual of the scene at the same state: both must
  agree, however far the corrector has iterated, relative to the sum of the absolute values of all loads. The residual
  itself must be zero except for what a corrector with c = 1e-9 may leave and for what does not move positions, see
  model_residual.h.
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
  /* slack: the measured rate is that of the largest corrections; in stiff directions, where corrections are small, the
     iteration may converge far more slowly */
  Settings s;
  s.corrector = 1e-9;
  s.tolerance = 1e-4;
  s.slack     = 1e3 * s.corrector * s.tolerance;
  s.laws      = true;
  s.work      = work;
  return s;
}

struct Repeated {
  bool again = false, resumed = false; /* equal to the last digit */
};

/* The first difference between two runs from sample `from` on; empty: none */
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
  const Model first = build(), second = build(); /* both are described before either is run */
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
