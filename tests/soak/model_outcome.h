/* Outcome of one model: plain data that the process of the model writes to shared memory */
#ifndef HHTDAE_SOAK_MODEL_OUTCOME_H
#define HHTDAE_SOAK_MODEL_OUTCOME_H

#include <cstring>
#include <string>

namespace soak
{

enum Verdict { Right, Wrong, Failed, Unknown, Crashed, Hung, verdicts };
constexpr const char *verdict_name[] = {"right", "wrong", "failed", "no reference", "crashed", "hung"};
enum Stage { Building, Default, Finer, Referring, Judging, Laws, Again, Done };
constexpr const char *stage_name[] = {"building the scene",
                                      "the run with defaults",
                                      "the run at a smaller tolerance",
                                      "the reference",
                                      "the verdict",
                                      "the balance of bodies",
                                      "the runs again",
                                      "done"};
enum By { ByNobody, ByIDA, ByHHT };
constexpr const char *by_name[] = {"none", "IDA", "hhtdae"};

struct Outcome {
  long number = 0;
  int  stage = Building, verdict = Unknown, by = ByNobody, bodies = 0, planar = 0, window = 0, finest_window = 0,
      legs = 0, disturbed = 0, blow = 0, conservative = 0;
  long steps = 0, rejected = 0, newton = 0, jacobians = 0, factorizations = 0, changes = 0, fails = 0,
       reference_steps = 0, finer_steps = 0;
  double cpu = 0, total = 0, end = 0, length = 0, mass = 0, speed = 0, stiffest = 0, softest = 0;
  double error = -1, finer = -1, finest = -1, velocity = -1, finer_velocity = -1, reaction = -1, finer_reaction = -1,
         doubt = -1, misfit = -1, slip = -1, energy = -1, used = -1; /* used: largest part of the allowed error */
  double balance = -1, between = -1; /* imbalance of any body relative to its loads: at ends of steps, between them */
  double unsolved = -1;              /* residual of any body relative to its loads */
  int  unjudged = 0, switched = 0, repeated = 0, resumed = 0;
  char message[600] = "", types[2000] = "";
};

inline void SetText(char *to, std::size_t room, const std::string &s)
{
  std::strncpy(to, s.c_str(), room - 1);
  to[room - 1] = 0;
}

} // namespace soak

#endif
