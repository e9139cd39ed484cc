/*
  Vectorized sweeps over the entries of vectors, where they save more than 2 % of a step of a chain of 1,000 rods against plain loops
  (entries.h): the stage of every iteration (stage.cpp), 10 % of the instructions, and scaled differences (predictor.cpp), 3 % of the
  time for the predictor and about 20 % of the instructions for orders above two.

  The body of a sweep is an object with pointers and factors that is called for four entries at a time. A library that is built for many
  processors uses the instructions of the oldest one. So bodies are compiled twice, with and without AVX2, and the processor on which the program
  runs decides. Neither version has fused multiplications, so that both give the same digits.
*/
#ifndef HHTDAE_SWEEPS_H
#define HHTDAE_SWEEPS_H

#include <petscsys.h>

#define HHT3_INLINE inline __attribute__((always_inline))

namespace hht3
{

#if defined(__GNUC__) && !defined(__clang__)
  #pragma GCC diagnostic ignored "-Wpsabi" /* warns of functions that return Four; all of them are inlined */
#endif

typedef PetscScalar Four __attribute__((vector_size(4 * sizeof(PetscScalar)), aligned(sizeof(PetscScalar)), may_alias));

typedef float Four32 __attribute__((vector_size(4 * sizeof(float)), aligned(sizeof(float)), may_alias));

/* Entries i..i+3 of arrays */
struct FourAt {
  PetscInt                i;
  HHT3_INLINE const Four &get(const PetscScalar *p) const { return *reinterpret_cast<const Four *>(p + i); }
  HHT3_INLINE Four        get(const float *p) const { return __builtin_convertvector(*reinterpret_cast<const Four32 *>(p + i), Four); }
  HHT3_INLINE void        put(PetscScalar *p, const Four &v) const { *reinterpret_cast<Four *>(p + i) = v; }
};

/* The last entries, fewer than four: zeros stand for those that are missing */
struct FewAt {
  PetscInt         i, count;
  template <class Number>
  HHT3_INLINE Four get(const Number *p) const
  {
    Four v = {0, 0, 0, 0};
    for (int k = 0; k < count; k++) v[k] = p[i + k];
    return v;
  }
  HHT3_INLINE void put(PetscScalar *p, const Four &v) const
  {
    for (int k = 0; k < count; k++) p[i + k] = v[k];
  }
};

template <class Body>
HHT3_INLINE void SweepAll(PetscInt n, Body &body)
{
  PetscInt i = 0;
  for (; i + 4 <= n; i += 4) body(FourAt{i});
  if (i < n) body(FewAt{i, n - i});
}

#if defined(__x86_64__) && defined(__GNUC__)
template <class Body>
__attribute__((target("avx2"))) Body SweepNewer(PetscInt n, Body body)
{
  SweepAll(n, body);
  return body;
}

inline bool NewerProcessor()
{
  static const bool newer = __builtin_cpu_supports("avx2");
  return newer;
}
#endif

template <class Body>
Body SweepPlain(PetscInt n, Body body)
{
  SweepAll(n, body);
  return body;
}

/* Calls a copy of `body` for all entries of arrays of length n, and returns it with the sums that it has gathered */
template <class Body>
Body Sweep(PetscInt n, const Body &body)
{
#if defined(__x86_64__) && defined(__GNUC__)
  if (NewerProcessor()) return SweepNewer(n, body);
#endif
  return SweepPlain(n, body);
}

HHT3_INLINE PetscReal Total(const Four &sum) { return (sum[0] + sum[1]) + (sum[2] + sum[3]); }
HHT3_INLINE Four      Absolute(const Four &x) { return x < 0 ? -x : x; }
HHT3_INLINE Four      Larger(const Four &x, const Four &y) { return x > y ? x : y; }

} // namespace hht3

#endif
