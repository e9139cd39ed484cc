/* A store has the instances of one kernel in the description; localize() makes batches of the instances that a rank
   needs. Included by scene_data.h. */
#ifndef HHTDAE_SCENE_STORE_H
#define HHTDAE_SCENE_STORE_H

#include "constraint_batch.h"
#include "described_rows.h"
#include "force_batch.h"
#include "probe.h"
#include <type_traits>

namespace hhtdae
{

struct Runtime;

/* Translates global numbers of markers and unknowns to this rank's local numbers; layout.cpp */
class Localizer
{
public:
  virtual ~Localizer() = default;
  virtual bool     needed(const StoreBase &s, PetscInt e) const = 0; /* whether the instance belongs to this rank or acts on one of its bodies */
  virtual PetscInt marker(PetscInt id)                          = 0;
  virtual PetscInt group(PetscInt global, PetscInt size)        = 0;
  virtual PetscInt local(PetscInt global) const                 = 0;
  virtual Input    input(const ScalarRef &r)                    = 0;
  Bodies          *bodies = nullptr;
  Runtime         *run    = nullptr;
};

class StoreBase
{
public:
  virtual ~StoreBase() = default;
  virtual PetscInt      size() const                      = 0;
  virtual int           markers() const                   = 0;
  virtual PetscInt      marker(PetscInt e, int k) const   = 0;
  virtual PetscInt      element(PetscInt e) const         = 0;
  virtual bool          isConstraint() const { return false; }
  virtual bool          isHolonomic() const { return false; } /* only for constraints */
  /* whether an instance puts a load on the body of its k-th marker, not only reads its motion */
  virtual bool          loads(int) const { return true; }
  virtual int           rows() const = 0;                     /* number of rows of a constraint, or of components of a force */
  virtual unsigned char active(PetscInt) const { return 0; }  /* bits of the rows of a constraint that were not dropped as redundant */
  virtual void          setActive(PetscInt, unsigned char) {}
  virtual bool          asForceStates(PetscInt) const { return false; } /* whether the components of a force are unknowns F */
  virtual bool          usesVelocities() const { return true; }
  /* whether a run satisfies the constraint by construction, without multipliers: attachments, attach.h */
  virtual bool          isExplicit() const { return false; }
  /* whether rows of another element are dropped when rows of this one depend on them */
  virtual bool          neverRedundant() const { return false; }
  virtual bool          hasGeometricStiffness() const { return true; }                  /* whether d(Phi_q^T lambda)/dq can be nonzero */
  /* the angle, with full turns, that a motion prescribes at a time; false if it prescribes none */
  virtual bool          drivenAngle(PetscInt, double, double *) const { return false; }
  /* number of values of accepted steps that an instance stores */
  virtual int           memory() const { return 0; }
  /* sets the initial memory of an instance; without this call it is that of the description */
  virtual void          remember(PetscInt, double *) {}
  /* In a run that goes on from another one: sets the values that an instance takes from the start, such as lengths, by
     the described poses, which are the present ones, unless it keeps those of instance `of` of `before`; before: null if
     the other run has no such instance */
  virtual void          continueFrom(const SceneData &, PetscInt, const StoreBase *, PetscInt) {}
  /* what is so where the rows of a constraint are no numbers, for messages; null: nothing is known */
  virtual const char   *undefined() const { return nullptr; }
  virtual int           inputs() const { return 0; }
  virtual ScalarRef     input(PetscInt, int) const { return {}; }
  virtual void          localize(Localizer &l, std::vector<std::unique_ptr<Batch>> &batches) const = 0;
  /* computes the rows of a constraint at the described poses */
  virtual void          describe(const SceneData &, PetscInt, double, DescribedRows &) const {}
  /* A copy of one instance, with which measures evaluate the loads of a constraint or the components of a force (probe.h) */
  virtual std::unique_ptr<Probe>         probe(Localizer &l, PetscInt e) const = 0;
  virtual const std::vector<Expression> *expressions(PetscInt) const { return nullptr; } /* expressions of a user's force; null for other elements */

  /* number of multipliers or force states of an instance */
  int unknowns(PetscInt e) const
  {
    if (isExplicit()) return 0;
    if (!isConstraint()) return asForceStates(e) ? rows() : 0;
    int n = 0;
    for (unsigned char m = active(e); m; m &= (unsigned char)(m - 1)) n++;
    return n;
  }

  std::vector<PetscInt> start; /* global number of the first unknown of each instance, numbering.cpp */
};

template <class K> struct Described {
  PetscInt         element;
  PetscInt         marker[K::markers];
  unsigned char    active = 0xff;
  bool             as_force_states = false;
  ScalarRef        input[K::inputs > 0 ? K::inputs : 1];
  typename K::Data data;
};

template <class K, class = void> struct TakesFromStart : std::false_type {};
template <class K> struct TakesFromStart<K, std::void_t<decltype(&K::continueFrom)>> : std::true_type {};

template <class K, class = void> struct WhereUndefined {
  static constexpr const char *text = nullptr;
};
template <class K> struct WhereUndefined<K, std::void_t<decltype(K::undefined)>> {
  static constexpr const char *text = K::undefined;
};

/* Common part of the stores of constraints and forces */
template <class K> class StoreOf : public StoreBase
{
public:
  std::vector<Described<K>> all;

  PetscInt  size() const override { return (PetscInt)all.size(); }
  int       markers() const override { return K::markers; }
  PetscInt  marker(PetscInt e, int k) const override { return all[e].marker[k]; }
  PetscInt  element(PetscInt e) const override { return all[e].element; }
  bool      asForceStates(PetscInt e) const override { return all[e].as_force_states; }
  int       memory() const override { return K::memory; }
  void      remember(PetscInt e, double *x) override { CopyMemory<K>(all[e], x, true); }
  void      continueFrom(const SceneData &s, PetscInt e, const StoreBase *before, PetscInt of) override
  {
    if constexpr (TakesFromStart<K>::value) {
      const auto   *same = dynamic_cast<const StoreOf *>(before);
      Frame<double> f[K::markers];
      for (int k = 0; k < K::markers; k++) f[k] = s.frame(Marker{all[e].marker[k]});
      K::continueFrom(all[e].data, same ? &same->all[of].data : nullptr, f);
    }
    (void)s, (void)e, (void)before, (void)of;
  }
  const char *undefined() const override { return WhereUndefined<K>::text; }
  int       inputs() const override { return K::inputs; }
  ScalarRef input(PetscInt e, int i) const override { return all[e].input[i]; }

protected:
  template <class I> void place(Localizer &l, const Described<K> &d, I &i) const
  {
    for (int k = 0; k < K::markers; k++) i.marker[k] = l.marker(d.marker[k]);
    for (int z = 0; z < K::inputs; z++) i.input[z] = l.input(d.input[z]);
    i.data = d.data;
  }
};

template <class K> class ConstraintStore : public StoreOf<K>
{
public:
  bool          isConstraint() const override { return true; }
  bool          isHolonomic() const override { return K::holonomic; }
  bool          loads(int k) const override { return Depends(K::depends, 2 * k) || Depends(K::depends, 2 * k + 1); }
  bool          usesVelocities() const override { return !K::holonomic; }
  bool          hasGeometricStiffness() const override { return ConstraintBatch<K>::curvedAtAll(); }
  int           rows() const override { return K::rows; }
  unsigned char active(PetscInt e) const override { return this->all[e].active & ((1u << K::rows) - 1); }
  void          setActive(PetscInt e, unsigned char a) override { this->all[e].active = a; }
  bool          drivenAngle(PetscInt e, double t, double *x) const override
  {
    if constexpr (K::prescribes_angle) *x = K::angleAt(this->all[e].data, t);
    (void)e, (void)t, (void)x;
    return K::prescribes_angle;
  }
  void          describe(const SceneData &s, PetscInt e, double t, DescribedRows &rows) const override { DescribeRows<K>(s, this->all[e], t, rows); }

  void localize(Localizer &l, std::vector<std::unique_ptr<Batch>> &batches) const override
  {
    auto                  *batch = new ConstraintBatch<K>;
    std::unique_ptr<Batch> owner(batch);
    batch->bodies   = l.bodies;
    batch->of.store = this;
    for (PetscInt e = 0; e < this->size(); e++) {
      if (!this->unknowns(e) || !l.needed(*this, e)) continue;
      typename ConstraintBatch<K>::Instance i;
      this->place(l, this->all[e], i);
      i.active = active(e);
      i.lambda = l.local(this->start[e]);
      i.group  = l.group(this->start[e], this->unknowns(e));
      batch->all.push_back(i);
      if constexpr (K::memory > 0) batch->of.add(e);
    }
    batch->all.shrink_to_fit();
    if (!batch->all.empty()) batches.push_back(std::move(owner));
  }

  std::unique_ptr<Probe> probe(Localizer &l, PetscInt e) const override
  {
    typename ConstraintBatch<K>::Instance i;
    this->place(l, this->all[e], i);
    i.active = active(e);
    i.lambda = this->unknowns(e) ? l.local(this->start[e]) : -1;
    i.group  = this->unknowns(e) ? l.group(this->start[e], this->unknowns(e)) : -1;
    return std::unique_ptr<Probe>(new ConstraintProbe<K>(i));
  }
};

template <class K> class ForceStore : public StoreOf<K>
{
public:
  bool usesVelocities() const override { return K::damped; }
  bool loads(int k) const override { return Depends(K::acts, 2 * k) || Depends(K::acts, 2 * k + 1); }
  int  rows() const override { return K::count; }

  void localize(Localizer &l, std::vector<std::unique_ptr<Batch>> &batches) const override
  {
    placeAll<ForceBatch<K>>(l, batches, false);
    if constexpr (K::may_be_force_states) placeAll<ForceStateBatch<K>>(l, batches, true);
  }

private:
  template <class B> void placeAll(Localizer &l, std::vector<std::unique_ptr<Batch>> &batches, bool as_force_states) const
  {
    auto                  *batch = new B;
    std::unique_ptr<Batch> owner(batch);
    batch->bodies   = l.bodies;
    batch->of.store = this;
    for (PetscInt e = 0; e < this->size(); e++) {
      if (this->all[e].as_force_states != as_force_states || !l.needed(*this, e)) continue;
      ForceInstance<K> i;
      StoreOf<K>::place(l, this->all[e], i);
      if (as_force_states) {
        i.state       = l.local(this->start[e]);
        i.state_group = l.group(this->start[e], K::count);
      }
      batch->all.push_back(i);
      if constexpr (K::memory > 0) batch->of.add(e);
    }
    if (!batch->all.empty()) batches.push_back(std::move(owner));
  }

  std::unique_ptr<Probe> probe(Localizer &l, PetscInt e) const override
  {
    ForceInstance<K> i;
    this->place(l, this->all[e], i);
    if (this->all[e].as_force_states) i.state = l.local(this->start[e]);
    return std::unique_ptr<Probe>(new ForceProbe<K>(i));
  }
};

template <class S> S &ElementBuilder::store()
{
  std::unique_ptr<StoreBase> &s = data_.stores[std::type_index(typeid(S))];
  if (!s) {
    s.reset(new S);
    data_.order.push_back(s.get());
  }
  return static_cast<S &>(*s);
}

template <class S> void ElementBuilder::put(typename S::Item item)
{
  if (!good_) return;
  S &s         = store<S>();
  item.element = (PetscInt)data_.elements.size();
  s.all.push_back(std::move(item));
  element_.parts.push_back({&s, s.size() - 1});
}

template <class K> PetscInt ElementBuilder::constrain(std::initializer_list<Marker> markers, const typename K::Data &data)
{
  return constrain<K>(std::vector<Marker>(markers), data, {});
}

template <class K>
PetscInt ElementBuilder::constrain(const std::vector<Marker> &markers, const typename K::Data &data, const std::vector<ScalarRef> &inputs)
{
  const PetscInt row = rows_;
  if (!good_) return row;
  auto        &s = store<ConstraintStore<K>>();
  Described<K> d;
  d.element = (PetscInt)data_.elements.size();
  std::size_t k = 0;
  for (Marker m : markers) d.marker[k++] = m.id;
  for (std::size_t i = 0; i < inputs.size() && i < (std::size_t)K::inputs; i++) d.input[i] = inputs[i];
  d.data = data;
  s.all.push_back(d);
  element_.parts.push_back({&s, s.size() - 1});
  rows_ += K::rows;
  return row;
}

template <class K>
void ElementBuilder::load(std::initializer_list<Marker> markers, const typename K::Data &data, const std::vector<ScalarRef> &inputs, bool state)
{
  if (!good_) return;
  auto        &s = store<ForceStore<K>>();
  Described<K> d;
  d.element = (PetscInt)data_.elements.size();
  d.as_force_states = state;
  std::size_t k = 0;
  for (Marker m : markers) d.marker[k++] = m.id;
  for (std::size_t i = 0; i < inputs.size() && i < (std::size_t)K::inputs; i++) d.input[i] = inputs[i];
  d.data = data;
  s.all.push_back(d);
  element_.parts.push_back({&s, s.size() - 1});
}

} // namespace hhtdae

#endif
