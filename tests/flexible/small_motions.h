/* What tests of linearizations share: the linearization of a start, frequencies, bodies */
#ifndef HHTDAE_TESTS_SMALL_MOTIONS_H
#define HHTDAE_TESTS_SMALL_MOTIONS_H

#include "hhtdae/helpers.h"
#include "hhtdae/linearize.h"
#include "scene_output.h"
#include <algorithm>

namespace hhtest
{

using Complex = std::complex<double>;

/* The linearization of a scene at its start */
struct Started {
  SceneRun      run;
  Linearization small;
  explicit Started(Scene &s) : run(s, 1, tolerance(1e-8)) { must(small.take(run.ts)); }
  std::vector<Mode> modes() const
  {
    std::vector<Mode> all;
    must(small.modes(&all));
    return all;
  }
};

/* Nonzero imaginary parts in ascending order */
inline std::vector<double> frequencies(const std::vector<Mode> &modes, double zero = 1e-6)
{
  std::vector<double> w;
  for (const Mode &m : modes)
    if (std::abs(m.value.imag()) > zero) w.push_back(m.value.imag());
  std::sort(w.begin(), w.end());
  return w;
}

inline RigidBody body(double mass, const Vector3 &inertia, const Vector3 &position = Vector3::Zero())
{
  RigidBody b;
  b.mass     = mass;
  b.inertia  = inertia.asDiagonal();
  b.position = position;
  return b;
}

} // namespace hhtest

#endif
