/* Batches: lists of instances of joints, forces, variables or states that add to the residual and the matrix. */
#ifndef HHTDAE_SCENE_BATCH_H
#define HHTDAE_SCENE_BATCH_H

#include "bodies.h"
#include "pattern.h"
#include <algorithm>
#include <array>
#include <limits>
#include <vector>

namespace hhtdae
{

/* A scalar unknown that an element reads: local number, and group and offset of its column in the matrix. local = -1: a dropped multiplier, which is zero. */
struct Input {
  PetscInt local = -1, group = -1, offset = 0;
};

/* One evaluation: state of the local unknowns (own, then other ranks'), own rows of the residual or arrays of the matrix */
struct Evaluation {
  double        t;
  const double *u, *v, *a;
  Bodies       &bodies;
  PetscInt      n;                      /* own unknowns */
  double       *F  = nullptr;           /* residual, set to zero before; null in a Jacobian */
  double        sv = 0, sa = 0;         /* the Jacobian is F_u + sv F_v + sa F_a */
  Sink          sink{nullptr, nullptr};

  double input(const Input &i) const { return i.local < 0 ? 0 : u[i.local]; }
  void   row(PetscInt local, double value)
  {
    if (local < n) F[local] += value;
  }
};

struct Balance; /* output/energy.h */
class StoreBase; /* store.h */

class Batch
{
public:
  virtual ~Batch() = default;
  virtual void pattern(Pattern &p) = 0;       /* requests blocks of the matrix */
  virtual void resolve(const Pattern &p);     /* gets their slots */
  virtual void residual(Evaluation &e) = 0;   /* own rows, and loads on bodies */
  virtual void jacobian(Evaluation &e) = 0;   /* the matrix, and loads on bodies */
  /* updates the memory after an accepted step, to which the bodies have been moved */
  virtual void accept(Bodies &) {}
  /* potential energy of the instances that belong to this rank, at the present state of the bodies */
  virtual double energy(const Evaluation &) const { return 0; }
  /* Upper bound on the next step, s, at the present velocities and accelerations, so that no contact is tunnelled through and no counted angle turns by more than half
     a turn; limitsSteps(): whether there are such instances */
  virtual bool   limitsSteps() const { return false; }
  virtual double longestStep(const Evaluation &) const { return std::numeric_limits<double>::infinity(); }
  /* adds energy and momentum of own coordinates that do not belong to bodies of the scene */
  virtual void addTo(Balance &, const Evaluation &) const {}
  /* memory of accepted steps, for checkpoints: number of values; copies them from x (in) or to x */
  virtual PetscInt memory() const { return 0; }
  virtual void     copyMemory(double *, bool in) { (void)in; }
  /* whether the memory begins with that of the stores, StoreBase::remember() */
  virtual bool isDescribed() const { return false; }
  /* copies the memory of one instance, by its number in its store; false if the instance is not in this batch */
  virtual bool memoryOf(const StoreBase *, PetscInt, double *) const { return false; }
  /* The angle of a marker about the z axis of another, by their numbers in the scene; false if no instance counts its turns */
  virtual bool countedAngle(PetscInt, PetscInt, double *) const { return false; }

protected:
  std::vector<PetscInt> request_; /* numbers of the blocks, in the order of assembly */
  std::vector<Slot>     slot_;
};

inline void Batch::resolve(const Pattern &p)
{
  slot_.resize(request_.size());
  for (std::size_t i = 0; i < request_.size(); i++) slot_[i] = p.slot(request_[i]);
  std::vector<PetscInt>().swap(request_);
}

/* ---- groups of coordinates of a marker's body ---- */

inline bool Turns(BodyKind k, int group) { return (k == BodyKind::Planar || k == BodyKind::Attached || TurnsInSpace(k)) && group == 1; }
inline bool PlanarScene(BodyKind k) { return k == BodyKind::Planar || k == BodyKind::PlanarPoint; }

/* Whether derivatives between x or theta of a row marker and of a column marker, as `pair` states, contribute to groups (g, h) of
   their bodies: rotations of a body move the origins of its markers, too. */
template <class Pair> bool Reaches(const Pair &pair, BodyKind row, int g, BodyKind column, int h)
{
  const bool tr = Turns(row, g), tc = Turns(column, h);
  return pair(0, 0) || (tr && pair(1, 0)) || (tc && pair(0, 1)) || (tr && tc && pair(1, 1));
}

/* ---- limits of instances on the step size ---- */

/* A kernel that limits steps has
     static double longestStep(const Data &, const Frame<double> *f, const Twist<double> *w, double acceleration, double angular);
   acceleration, angular: estimates of the magnitudes of the markers' relative acceleration and angular acceleration */
template <class K, class = void> struct HasLongestStep : std::false_type {
};
template <class K>
struct HasLongestStep<K, std::void_t<decltype(K::longestStep(std::declval<const typename K::Data &>(), (const Frame<double> *)nullptr,
                                                               (const Twist<double> *)nullptr, 0., 0.))>> : std::true_type {
};

/* of one instance */
template <class K, class Instance> double LongestStep(const Instance &e, const Evaluation &ev)
{
  const Bodies &B = ev.bodies;
  Frame<double> f[K::markers];
  Twist<double> w[K::markers];
  double        acceleration = 0, angular = 0;
  for (int k = 0; k < K::markers; k++) {
    const PetscInt   b = B.marker[e.marker[k]].body;
    f[k]               = B.frame<true>(e.marker[k]);
    w[k]               = B.twist(e.marker[k], f[k]);
    acceleration += B.acceleration(b, ev.v, ev.a).norm() + w[k].w.squaredNorm() * (f[k].x - B.now[b].r).norm();
    angular += B.angularAcceleration(b, ev.v, ev.a).norm();
  }
  return K::longestStep(e.data, f, w, acceleration, angular);
}

template <class K, class Instances> double LongestSteps(const Instances &all, const Evaluation &ev)
{
  double least = std::numeric_limits<double>::infinity();
  if constexpr (HasLongestStep<K>::value)
    for (const auto &e : all) least = std::min(least, LongestStep<K>(e, ev));
  (void)all;
  (void)ev;
  return least;
}

/* ---- memory of accepted steps ---- */

template <class K, class Instance> void Remember(Instance &e, const Bodies &B)
{
  if constexpr (K::memory > 0) {
    Frame<double> f[K::markers];
    for (int k = 0; k < K::markers; k++) f[k] = B.frame<true>(e.marker[k]);
    K::accept(e.data, f);
  }
  (void)e;
  (void)B;
}

/* The instances of a store that are in a batch, for kernels with memory */
struct InstancesOf {
  const StoreBase      *store = nullptr;
  std::vector<PetscInt> number; /* increasing */

  void     add(PetscInt e) { number.push_back(e); }
  PetscInt find(const StoreBase *s, PetscInt e) const /* -1: not here */
  {
    const auto at = std::lower_bound(number.begin(), number.end(), e);
    return s == store && at != number.end() && *at == e ? (PetscInt)(at - number.begin()) : -1;
  }
  bool joins(std::size_t n, std::array<int, 2> pair, PetscInt i, PetscInt j) const; /* whether i and j are the markers `pair` of instance n; counted_angles.cpp */
};

/* Batch::countedAngle() of a kernel's instances */
template <class K, class Instances> bool AngleOf(const Instances &all, const InstancesOf &of, PetscInt i, PetscInt j, double *x)
{
  for (std::size_t n = 0; n < of.number.size(); n++)
    for (int k = 0; k < K::angles; k++) {
      if (!of.joins(n, K::markersOfAngle(all[n].data, k), i, j)) continue;
      if constexpr (K::angles > 0) *x = all[n].data.memory[k];
      return true;
    }
  (void)all, (void)i, (void)j, (void)x;
  return false;
}

/* copies from x (in) or to x; returns x + K::memory */
template <class K, class Instance> double *CopyMemory(Instance &e, double *x, bool in)
{
  if constexpr (K::memory > 0) {
    if (in) std::copy(x, x + K::memory, e.data.memory);
    else std::copy(e.data.memory, e.data.memory + K::memory, x);
  }
  (void)e;
  (void)in;
  return x + K::memory;
}

} // namespace hhtdae

#endif
