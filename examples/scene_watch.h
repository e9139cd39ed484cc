/* Calls f(t, values) with the values of a scene's channels at the multiples of dt during a run, on every rank; in a run that is resumed from a
   checkpoint, from the time of the checkpoint on. */
#ifndef HHTEX_SCENE_WATCH_H
#define HHTEX_SCENE_WATCH_H

#include <hhtdae/scene.h>

#include <cmath>
#include <functional>
#include <vector>

namespace hhtex
{

class Watch
{
public:
  using Look = std::function<void(double t, const std::vector<double> &channels)>;

  Watch(hhtdae::Scene &scene, double dt, Look look) : scene_(scene), dt_(dt), look_(std::move(look)) {}
  Watch(const Watch &) = delete;
  PetscErrorCode attach(TS ts) { return TSMonitorSet(ts, monitor, this, nullptr); }

private:
  hhtdae::Scene &scene_;
  double         dt_;
  Look           look_;
  PetscInt       done_  = 0;
  bool           begun_ = false;

  /* The values at the start are taken from the beginning of the first step, where accelerations and multipliers are consistent. */
  static PetscErrorCode monitor(TS ts, PetscInt step, PetscReal t, Vec, void *ctx)
  {
    Watch              *w = static_cast<Watch *>(ctx);
    std::vector<double> values;
    PetscFunctionBegin;
    if (step <= 0) PetscFunctionReturn(0);
    if (!w->begun_) {
      PetscReal begin;
      PetscCall(TSGetPrevTime(ts, &begin));
      w->done_  = (PetscInt)std::ceil(begin / w->dt_ * (1 - 1e-12));
      w->begun_ = true;
    }
    for (; w->done_ * w->dt_ <= t * (1 + 1e-12); w->done_++) {
      const double at = std::fmin(w->done_ * w->dt_, t);
      PetscCall(w->scene_.sample(ts, at, values));
      w->look_(at, values);
    }
    PetscFunctionReturn(0);
  }
};

/* Updates the largest |a - b|; once it is NaN, it stays NaN */
inline void Widen(double &worst, double a, double b = 0)
{
  const double d = std::fabs(a - b);
  if (!(d <= worst)) worst = d;
}

} // namespace hhtex

#endif
