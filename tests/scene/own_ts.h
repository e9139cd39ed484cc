/* A run of a scene whose TS the test owns */
#ifndef HHTDAE_TESTS_OWN_TS_H
#define HHTDAE_TESTS_OWN_TS_H

#include "hhtdae/scene.h"
#include "support.h"

namespace hhtest
{

/* A TS that is destroyed at the end of the test */
struct OwnTS {
  TS ts = nullptr;
  OwnTS() = default;
  explicit OwnTS(hhtdae::Scene &s) { must(s.createTS(&ts)); }
  ~OwnTS() { TSDestroy(&ts); }
  OwnTS(const OwnTS &) = delete;
  double time() const
  {
    PetscReal t;
    must(TSGetTime(ts, &t));
    return t;
  }
};

} // namespace hhtest

#endif
