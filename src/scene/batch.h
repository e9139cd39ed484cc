/* A batch is the list of this rank's instances of one kind of joint, force, variable or state; it adds their terms to the
   residual and the Jacobian. */
#ifndef HHTDAE_SCENE_BATCH_H
#define HHTDAE_SCENE_BATCH_H

#include "bodies.h"
#include "look_ahead.h"
#include "pattern.h"
#include <algorithm>
#include <array>
#include <limits>
#include <vector>

namespace hhtdae
{

/* A scalar unknown that an element reads: its local number, its group of columns in the matrix and its offset in that
   group. local = -1: a dropped multiplier, which is zero. */
struct Input {
  PetscInt local = -1, group = -1, offset = 0;
};

/* Arguments and results of one evaluation: the state of the local unknowns (own, then other ranks'), and own rows of the
   residual or the arrays of the matrix */
struct Evaluation {
  double        t;
  const double *u, *v, *a;
  Bodies       &bodies;
  PetscInt      n;                      /* number of own unknowns */
  double       *F  = nullptr;           /* residual, which the caller sets to zero; null when the Jacobian is evaluated */
  double        sv = 0, sa = 0;         /* shifts of the Jacobian F_u + sv F_v + sa F_a */
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
  virtual void resolve(const Pattern &p);     /* looks up the slots of these blocks */
  virtual void residual(Evaluation &e) = 0;   /* adds to own rows, and adds the loads on bodies */
  virtual void jacobian(Evaluation &e) = 0;   /* adds to the matrix, and adds the loads on bodies */
  /* updates the memory after an accepted step; the bodies have been moved to its state */
  virtual void accept(Bodies &) {}
  /* potential energy of the instances that belong to this rank, at the present state of the bodies */
  virtual double energy(const Evaluation &) const { return 0; }
  /* longestStep(): upper bound on the next step, s, which would otherwise go to the horizon, at the present velocities and accelerations,
     so that no contact is passed over and no counted angle turns by more than half a turn. limitsSteps(): whether instances
     have such a bound */
  virtual bool   limitsSteps() const { return false; }
  virtual double longestStep(const Evaluation &, const Horizon &) const { return std::numeric_limits<double>::infinity(); }
  /* adds the energy and momentum of own coordinates of extensions (extension.h), which belong to no body of the scene */
  virtual void addTo(Balance &, const Evaluation &) const {}
  /* memory of accepted steps, for checkpoints. memory(): number of values; copyMemory(): copies them from the array (in) or to it */
  virtual PetscInt memory() const { return 0; }
  virtual void     copyMemory(double *, bool in) { (void)in; }
  /* whether the memory belongs to instances of a store, whose initial values StoreBase::remember() sets */
  virtual bool isDescribed() const { return false; }
  /* copies the memory of one instance, by its number in its store; false if the instance is not in this batch */
  virtual bool memoryOf(const StoreBase *, PetscInt, double *) const { return false; }
  /* The angle of a marker about the z axis of another, both by their numbers in the scene; false if no instance counts its full turns */
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

/* ---- groups of coordinates of a marker's body; Turns(): whether a group is the rotation ---- */

inline bool Turns(BodyKind k, int group) { return (k == BodyKind::Planar || k == BodyKind::Attached || TurnsInSpace(k)) && group == 1; }
inline bool PlanarScene(BodyKind k) { return k == BodyKind::Planar || k == BodyKind::PlanarPoint; }

/* Whether a block between two markers contributes to the block of groups (g, h) of their bodies. pair(a, b): whether the
   block's part with rows a and columns b, 0 for x and 1 for theta of a marker, can be nonzero. A rotation of a body also
   moves the origins of its markers. */
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

/* The bound of one instance. The centripetal term w^2 |s| is added to the acceleration of the body's origin. */
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

/* A kernel with contacts, whose gaps are foreseen (look_ahead.h), has
     static double    gap(const Data &, const Frame<double> *f);
     static GapBounds gapBounds(const Data &, const MarkerForecast *m, double horizon);
     static double    deepest(const Data &);   largest penetration at the end of a step that begins without contact */
template <class K, class = void> struct HasGap : std::false_type {
};
template <class K>
struct HasGap<K, std::void_t<decltype(K::gap(std::declval<const typename K::Data &>(), (const Frame<double> *)nullptr))>> : std::true_type {
};

template <class K, class Instance> double BeforeContact(const Instance &e, const Evaluation &ev, const Horizon &horizon)
{
  const Bodies  &B = ev.bodies;
  MarkerForecast m[2];
  for (int k = 0; k < 2; k++) {
    const PetscInt      b = B.marker[e.marker[k]].body;
    const BodyMotion   &x = B.now[b];
    const Frame<double> f = B.frame<true>(e.marker[k]);
    m[k]                  = {f, f.x - x.r, x.r, x.v, B.acceleration(b, ev.v, ev.a), x.w, B.angularAcceleration(b, ev.v, ev.a)};
  }
  const auto gap = [&](double t) {
    const Frame<double> f[2] = {m[0].at(t), m[1].at(t)};
    return K::gap(e.data, f);
  };
  return LongestBeforeContact(gap, K::gapBounds(e.data, m, horizon.time), K::deepest(e.data), horizon);
}

template <class K, class Instances> double LongestSteps(const Instances &all, const Evaluation &ev, const Horizon &horizon)
{
  double least = std::numeric_limits<double>::infinity();
  for (const auto &e : all) {
    if constexpr (HasLongestStep<K>::value) least = std::min(least, LongestStep<K>(e, ev));
    if constexpr (HasGap<K>::value) {
      const double most = std::min(least, horizon.time), before = BeforeContact<K>(e, ev, {most, horizon.negligible});
      if (before < most) least = before;
    }
  }
  (void)all;
  (void)ev;
  (void)horizon;
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

/* Numbers, in their store, of the instances in a batch; only for kernels with memory */
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

/* Copies the memory of an instance from x (in) or to x; returns x + K::memory */
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
