/* All instances of one force kernel on this rank. Forces are evaluated in the equations of motion (the default), or are
   unknown force states F with the equations F - f(...) = 0, (7b). */
#ifndef HHTDAE_SCENE_FORCE_BATCH_H
#define HHTDAE_SCENE_FORCE_BATCH_H

#include "blocks.h"
#include "kernel.h"
#include <type_traits>
#include <utility>

namespace hhtdae
{

template <class K> struct ForceInstance {
  static constexpr int Z = K::inputs;
  PetscInt         marker[K::markers];
  PetscInt             state = -1, state_group = -1; /* local number of the first force state, and its group; -1 without force states */
  Input            input[Z > 0 ? Z : 1];
  typename K::Data data;
};

/* A kernel with a potential may define  static double energy(const Data &, const Frame<double> *f);  only the balance of energy uses it */
template <class K, class = void> struct HasEnergy : std::false_type {
};
template <class K>
struct HasEnergy<K, std::void_t<decltype(K::energy(std::declval<const typename K::Data &>(), (const Frame<double> *)nullptr))>> : std::true_type {
};

/* Common part of ForceBatch and ForceStateBatch: blocks between the coordinates of the markers' bodies */
template <class K> class ForceBatchBase : public Batch
{
protected:
  static constexpr int M = K::markers, Z = K::inputs;
  using Instance         = ForceInstance<K>;

public:
  std::vector<Instance> all;
  Bodies               *bodies = nullptr;
  InstancesOf            of; /* only filled if K::memory > 0 */

  void accept(Bodies &B) override
  {
    for (Instance &e : all) Remember<K>(e, B);
  }
  double energy(const Evaluation &ev) const override
  {
    double sum = 0;
    if constexpr (HasEnergy<K>::value)
      for (const Instance &e : all) {
        Frame<double> f[M];
        if (!mine(e)) continue;
        for (int k = 0; k < M; k++) f[k] = ev.bodies.template frame<K::needs_rotation>(e.marker[k]);
        sum += K::energy(e.data, f);
      }
    (void)ev;
    return sum;
  }
  bool   limitsSteps() const override { return (HasLongestStep<K>::value || HasGap<K>::value) && !all.empty(); }
  double longestStep(const Evaluation &ev, const Horizon &horizon) const override { return LongestSteps<K>(all, ev, horizon); }
  bool     isDescribed() const override { return K::memory > 0; }
  PetscInt memory() const override { return K::memory * (PetscInt)all.size(); }
  bool     memoryOf(const StoreBase *s, PetscInt number, double *x) const override
  {
    const PetscInt i = of.find(s, number);
    if constexpr (K::memory > 0)
      if (i >= 0) std::copy(all[i].data.memory, all[i].data.memory + K::memory, x);
    return i >= 0;
  }
  void     copyMemory(double *x, bool in) override
  {
    for (Instance &e : all) x = CopyMemory<K>(e, x, in);
  }
  bool countedAngle(PetscInt i, PetscInt j, double *x) const override { return AngleOf<K>(all, of, i, j, x); }

protected:
  static const LocalBody &bodyOf(const Bodies &B, const Instance &e, int k) { return B.body[B.marker[e.marker[k]].body]; }

  /* Whether this rank owns the instance: the owner of its first movable body does, as in OwnerOf() */
  bool mine(const Instance &e) const
  {
    for (int k = 0; k < M; k++) {
      const LocalBody &b = bodyOf(*bodies, e, k);
      if (b.kind != BodyKind::Ground) return b.owned;
    }
    return false;
  }

  /* loads(): whether the load acts on group g of the body of marker k; uses(): whether it depends on that group */
  static bool loads(BodyKind b, int g, int k)
  {
    return Reach(OfMarker(K::acts, k), b, g);
  }
  static bool uses(BodyKind b, int g, int k)
  {
    return Reach(OfMarker(K::depends, k), b, g);
  }
  static bool couples(BodyKind b, int g, int k, BodyKind c, int h, int l)
  {
    if (k == l && Turns(b, g) && Turns(c, h) && Depends(K::acts, 2 * k)) return true; /* AddLever() */
    return loads(b, g, k) && uses(c, h, l);
  }

  void bodyPattern(const Instance &e, Pattern &p)
  {
    for (int k = 0; k < M; k++)
      for (int l = 0; l < M; l++) {
        const LocalBody &b = bodyOf(*bodies, e, k), &c = bodyOf(*bodies, e, l);
        for (int g = 0; g < Groups(b.kind); g++)
          for (int h = 0; h < Groups(c.kind); h++)
            if (couples(b.kind, g, k, c.kind, h, l)) request_.push_back(p.need(b.group + g, c.group + h));
      }
  }

  static void gather(const Evaluation &ev, const Instance &e, Frame<double> *f, Twist<double> *w, double *z)
  {
    for (int k = 0; k < M; k++) {
      f[k] = ev.bodies.template frame<K::needs_rotation>(e.marker[k]);
      if constexpr (K::damped) w[k] = ev.bodies.twist(e.marker[k], f[k]);
    }
    for (int i = 0; i < Z; i++) z[i] = ev.input(e.input[i]);
    (void)w;
    (void)z;
  }

  static void apply(Evaluation &ev, const Instance &e, const Frame<double> *f, const Wrench<double> *on)
  {
    for (int k = 0; k < M; k++) ev.bodies.load(e.marker[k], f[k], on[k].f, on[k].m);
  }

  /* Adds - d load/dq. frames, twists: derivatives of the wrenches `on`; twists is null if the wrenches do not depend on them */
  static void bodyBlocks(Evaluation &ev, const Instance &e, const Frame<double> *f, const Wrench<double> *on, const Matrix<6 * M, 6 * M> &frames,
                         const Matrix<6 * M, 6 * M> *twists, const Slot *&slot)
  {
    for (int k = 0; k < M; k++)
      for (int l = 0; l < M; l++) {
        const LocalBody &b = bodyOf(ev.bodies, e, k), &c = bodyOf(ev.bodies, e, l);
        Six              D;
        bool             made = false;
        for (int g = 0; g < Groups(b.kind); g++)
          for (int h = 0; h < Groups(c.kind); h++) {
            if (!couples(b.kind, g, k, c.kind, h, l)) continue;
            if (!made) {
              const Six A = MinusBlock(frames.data(), 6 * M, k, l);
              Six       V;
              if (twists) V = MinusBlock(twists->data(), 6 * M, k, l);
              D = PairBlock(ev, e.marker[k], f[k], e.marker[l], f[l], A, twists ? &V : nullptr);
              if (k == l && Depends(K::acts, 2 * k)) AddLever(ev.bodies, e.marker[k], f[k], -on[k].f, D);
              made = true;
            }
            AddBlock(ev.sink, *slot++, D, b.kind, g, c.kind, h);
          }
      }
  }

  /* Derivatives by v and w of attachments' frames, which have separate columns (projection.h) */
  static bool byRates(const Instance &e, const Bodies &B, int l) { return K::damped && bodyOf(B, e, l).kind == BodyKind::Attached; }
  void        ratePattern(const Instance &e, Pattern &p)
  {
    for (int l = 0; l < M; l++)
      for (int k = 0; k < M && byRates(e, *bodies, l); k++) {
        const LocalBody &b = bodyOf(*bodies, e, k), &c = bodyOf(*bodies, e, l);
        for (int g = 0; g < Groups(b.kind); g++)
          for (int h = 0; h < 2; h++)
            if (loads(b.kind, g, k)) request_.push_back(p.need(b.group + g, c.group + first_rate_group + h));
      }
  }
  static void rateBlocks(Evaluation &ev, const Instance &e, const Frame<double> *f, const Matrix<6 * M, 6 * M> &twists, const Slot *&slot)
  {
    for (int l = 0; l < M; l++)
      for (int k = 0; k < M && byRates(e, ev.bodies, l); k++) {
        const BodyKind b           = bodyOf(ev.bodies, e, k).kind;
        const bool     reached[2]  = {loads(b, 0, k), loads(b, 1, k)};
        if (Groups(b)) slot += RateBlocks(ev, e.marker[k], f[k], e.marker[l], f[l], MinusBlock(twists.data(), 6 * M, k, l), slot, reached);
      }
  }

  /* Adds - d load/dz for the n scalars z of one group, from column `offset` of the group on */
  template <int n>
  static void scalarColumns(Evaluation &ev, const Instance &e, const Frame<double> *f, const double *J, PetscInt offset, const Slot *&slot)
  {
    for (int k = 0; k < M; k++) AddScalars<n>(ev, e.marker[k], f[k], J + 6 * k, 6 * M, OfMarker(K::acts, k), offset, slot);
  }
};

/* Forces that are evaluated in the equations of motion */
template <class K> class ForceBatch : public ForceBatchBase<K>
{
  using Base = ForceBatchBase<K>;
  using Base::M, Base::Z, Base::request_, Base::slot_;

public:
  using Base::bodies;

  void pattern(Pattern &p) override
  {
    for (const auto &e : this->all) {
      this->bodyPattern(e, p);
      this->ratePattern(e, p);
      for (int i = 0; i < Z; i++)
        for (int k = 0; k < M; k++) {
          const LocalBody &b = Base::bodyOf(*bodies, e, k);
          for (int g = 0; g < Groups(b.kind); g++)
            if (Base::loads(b.kind, g, k)) request_.push_back(p.need(b.group + g, e.input[i].group));
        }
    }
  }

  void residual(Evaluation &ev) override
  {
    for (const auto &e : this->all) {
      Frame<double>  f[M];
      Twist<double>  w[M];
      Wrench<double> on[M];
      double         z[Z > 0 ? Z : 1];
      Base::gather(ev, e, f, w, z);
      K::wrench(e.data, f, w, ev.t, z, on);
      Base::apply(ev, e, f, on);
    }
  }

  void jacobian(Evaluation &ev) override
  {
    const Slot *slot = slot_.data();
    for (const auto &e : this->all) {
      Frame<double>       f[M];
      Twist<double>       w[M];
      Wrench<double>      on[M];
      double              z[Z > 0 ? Z : 1];
      ForceJacobian<M, Z> J;
      Base::gather(ev, e, f, w, z);
      K::jacobian(e.data, f, w, ev.t, z, on, J);
      Base::apply(ev, e, f, on);
      Base::bodyBlocks(ev, e, f, on, J.frames, K::damped ? &J.twists : nullptr, slot);
      Base::rateBlocks(ev, e, f, J.twists, slot);
      for (int i = 0; i < Z; i++) this->template scalarColumns<1>(ev, e, f, J.inputs.data() + 6 * M * i, e.input[i].offset, slot);
    }
  }
};

/* Forces with force states F: rows F - c(...) = 0; the loads depend on F and the frames only */
template <class K> class ForceStateBatch : public ForceBatchBase<K>
{
  using Base = ForceBatchBase<K>;
  using Base::M, Base::Z, Base::request_, Base::slot_;
  static constexpr int C = K::count;

public:
  using Base::bodies;

  void pattern(Pattern &p) override
  {
    for (const auto &e : this->all) {
      request_.push_back(p.need(e.state_group, e.state_group));
      for (int i = 0; i < Z; i++) request_.push_back(p.need(e.state_group, e.input[i].group));
      for (int k = 0; k < M; k++) {
        const LocalBody &b = Base::bodyOf(*bodies, e, k);
        for (int g = 0; g < Groups(b.kind); g++)
          if (Base::uses(b.kind, g, k)) request_.push_back(p.need(e.state_group, b.group + g));
        for (int g = 0; g < 2 && Base::byRates(e, *bodies, k); g++)
          if (Base::uses(b.kind, g, k)) request_.push_back(p.need(e.state_group, b.group + first_rate_group + g));
      }
      this->bodyPattern(e, p);
      for (int k = 0; k < M; k++) {
        const LocalBody &b = Base::bodyOf(*bodies, e, k);
        for (int g = 0; g < Groups(b.kind); g++)
          if (Base::loads(b.kind, g, k)) request_.push_back(p.need(b.group + g, e.state_group));
      }
    }
  }

  void residual(Evaluation &ev) override
  {
    for (const auto &e : this->all) {
      Frame<double>  f[M];
      Twist<double>  w[M];
      Wrench<double> on[M];
      double         z[Z > 0 ? Z : 1], c[C];
      Base::gather(ev, e, f, w, z);
      K::template components<double>(e.data, f, w, ev.t, z, c);
      for (int i = 0; i < C; i++) ev.row(e.state + i, ev.u[e.state + i] - c[i]);
      K::template apply<double>(e.data, f, ev.u + e.state, on);
      Base::apply(ev, e, f, on);
    }
  }

  void jacobian(Evaluation &ev) override
  {
    const Slot *slot = slot_.data();
    for (const auto &e : this->all) {
      Frame<double>  f[M];
      Twist<double>  w[M];
      double         z[Z > 0 ? Z : 1];
      Base::gather(ev, e, f, w, z);
      definition(ev, e, f, w, z, slot);
      load(ev, e, f, slot);
    }
  }

private:
  /* Adds the derivatives of the rows F - c = 0 */
  static void definition(Evaluation &ev, const typename Base::Instance &e, const Frame<double> *f, const Twist<double> *w, const double *z,
                         const Slot *&slot)
  {
    constexpr int n = 6 * M, moving = K::damped ? n : 0, N = n + moving + Z;
    using T         = Dual<N>;
    Frame<T>                               s[M];
    T                                      c[C];
    Arguments<Twist<T>, K::damped ? M : 0> u;
    Arguments<T, Z>                        zs;
    for (int k = 0; k < M; k++) {
      s[k] = Seed<N>(f[k], 6 * k);
      if constexpr (K::damped) u[k] = Seed<N>(w[k], n + 6 * k);
    }
    if constexpr (Z > 0)
      for (int i = 0; i < Z; i++) zs[i] = T(z[i], n + moving + i);
    K::template components<T>(e.data, s, u.data(), T(ev.t), zs.data(), c);
    ev.sink.add(*slot++, Matrix<C, C>(Matrix<C, C>::Identity()), C, C);
    for (int i = 0; i < Z; i++) {
      Matrix<C, 1> column;
      for (int r = 0; r < C; r++) column(r) = -c[r].derivatives()(n + moving + i);
      ev.sink.add((slot++)->column(e.input[i].offset), column, C, 1);
    }
    for (int k = 0; k < M; k++) {
      const LocalBody &b = Base::bodyOf(ev.bodies, e, k);
      Matrix<C, 6>     J, V = Matrix<C, 6>::Zero(), out = Matrix<C, 6>::Zero();
      for (int r = 0; r < C; r++) {
        J.row(r) = -DerivativeRow<6>(c[r], 6 * k);
        if constexpr (K::damped) V.row(r) = -DerivativeRow<6>(c[r], n + 6 * k);
      }
      ev.bodies.columns(e.marker[k], f[k], J, out);
      ev.bodies.inStep(e.marker[k], out);
      if constexpr (K::damped) ev.bodies.velocityColumns(e.marker[k], f[k], ev.v, ev.sv, V, out);
      for (int g = 0; g < Groups(b.kind); g++)
        if (Base::uses(b.kind, g, k))
          ev.sink.add(*slot++, out.middleCols(GroupOffset(b.kind, g), GroupSize(b.kind, g)), C, GroupSize(b.kind, g));
      if (!Base::byRates(e, ev.bodies, k)) continue;
      ev.bodies.columns(e.marker[k], f[k], V, out);
      for (int g = 0; g < 2; g++)
        if (Base::uses(b.kind, g, k)) ev.sink.add(*slot++, out.template middleCols<3>(3 * g), C, 3);
    }
  }

  /* Adds the loads Pi(q) F and their derivatives */
  static void load(Evaluation &ev, const typename Base::Instance &e, const Frame<double> *f, const Slot *&slot)
  {
    constexpr int n = 6 * M, N = n + C;
    using T         = Dual<N>;
    Frame<T>             s[M];
    T                    c[C];
    Wrench<T>            w[M];
    Wrench<double>       on[M];
    Matrix<n, n>         frames;
    Matrix<n, C>         columns;
    for (int k = 0; k < M; k++) s[k] = Seed<N>(f[k], 6 * k);
    for (int i = 0; i < C; i++) c[i] = T(ev.u[e.state + i], n + i);
    K::template apply<T>(e.data, s, c, w);
    for (int k = 0; k < M; k++)
      for (int i = 0; i < 6; i++) {
        const T &x = i < 3 ? w[k].f(i) : w[k].m(i - 3);
        (i < 3 ? on[k].f(i) : on[k].m(i - 3)) = x.value();
        frames.row(6 * k + i)  = DerivativeRow<n>(x, 0);
        columns.row(6 * k + i) = DerivativeRow<C>(x, n);
      }
    Base::apply(ev, e, f, on);
    Base::bodyBlocks(ev, e, f, on, frames, nullptr, slot);
    Base::template scalarColumns<C>(ev, e, f, columns.data(), 0, slot);
  }
};

} // namespace hhtdae

#endif
