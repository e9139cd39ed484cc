/* All instances of one constraint kernel on this rank: rows Phi, terms Phi_q^T lambda of the equations of motion, and the derivatives of both. */
#ifndef HHTDAE_SCENE_CONSTRAINT_BATCH_H
#define HHTDAE_SCENE_CONSTRAINT_BATCH_H

#include "blocks.h"
#include "kernel.h"

namespace hhtdae
{

template <class K> class ConstraintBatch : public Batch
{
  static constexpr int M = K::markers, R = K::rows, Z = K::inputs, all_rows = (1 << R) - 1;

public:
  struct Instance {
    PetscInt         marker[M];
    PetscInt         lambda; /* local number of the first multiplier, and of the first row of the constraint */
    PetscInt         group;  /* of the multipliers */
    unsigned char    active; /* bits of the rows that are not dropped */
    Input            input[Z > 0 ? Z : 1];
    typename K::Data data;
  };
  std::vector<Instance> all;

  void pattern(Pattern &p) override
  {
    const Bodies &B = *bodies;
    for (const Instance &e : all) {
      for (int k = 0; k < M; k++) {
        const LocalBody &b = bodyOf(B, e, k);
        for (int g = 0; g < Groups(b.kind); g++) {
          if (!uses(b.kind, g, k)) continue;
          /* rows that are all components of x_j - x_i have diagonal blocks with the positions */
          const bool diagonal = K::purely_translational && g == 0 && GroupSize(b.kind, g) == R && (e.active & all_rows) == all_rows;
          request_.push_back(p.need(e.group, b.group + g, diagonal));
          request_.push_back(p.need(b.group + g, e.group, diagonal));
        }
        for (int g = 0; g < 2 && byRates(b.kind); g++)
          if (uses(b.kind, g, k)) request_.push_back(p.need(e.group, b.group + first_rate_group + g));
      }
      for (int i = 0; i < Z; i++) request_.push_back(p.need(e.group, e.input[i].group));
      for (int k = 0; k < M; k++)
        for (int l = 0; l < M; l++) {
          const LocalBody &b = bodyOf(B, e, k), &c = bodyOf(B, e, l);
          for (int g = 0; g < Groups(b.kind); g++)
            for (int h = 0; h < Groups(c.kind); h++)
              if (curves(b.kind, g, k, c.kind, h, l)) request_.push_back(p.need(b.group + g, c.group + h));
        }
    }
  }

  void residual(Evaluation &ev) override
  {
    for (const Instance &e : all) {
      Frame<double>        f[M];
      Twist<double>        w[M];
      double               phi[R], lambda[R], z[Z > 0 ? Z : 1];
      typename K::Gradient J, P;
      gather(ev, e, f, w, lambda, z);
      if constexpr (K::holonomic) {
        K::value(e.data, f, ev.t, phi);
        if constexpr (!K::purely_translational) K::gradient(e.data, f, ev.t, J);
      } else {
        value(e, f, w, ev.t, z, phi);
        gradient(e, f, w, ev.t, z, J, P, nullptr);
      }
      PetscInt row = e.lambda;
      for (int r = 0; r < R; r++)
        if (e.active >> r & 1) ev.row(row++, phi[r]);
      react(ev.bodies, e, f, lambda, J);
    }
  }

  void jacobian(Evaluation &ev) override
  {
    const Slot *slot = slot_.data();
    for (const Instance &e : all) {
      Frame<double>        f[M];
      Twist<double>        w[M];
      double               lambda[R], z[Z > 0 ? Z : 1], zj[R * (Z > 0 ? Z : 1)];
      typename K::Gradient J, P;
      gather(ev, e, f, w, lambda, z);
      if constexpr (K::holonomic) K::gradient(e.data, f, ev.t, J);
      else gradient(e, f, w, ev.t, z, J, P, zj);
      react(ev.bodies, e, f, lambda, J);
      gradientBlocks(ev, e, f, J, P, zj, slot);
      curvatureBlocks(ev, e, f, w, z, lambda, J, slot);
    }
  }

  void accept(Bodies &B) override
  {
    for (Instance &e : all) Remember<K>(e, B);
  }

  bool     limitsSteps() const override { return HasLongestStep<K>::value && !all.empty(); }
  double   longestStep(const Evaluation &ev, const Horizon &horizon) const override { return LongestSteps<K>(all, ev, horizon); }
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

  static constexpr bool curvedAtAll()
  {
    for (int a = 0; a < 2 * M; a++)
      for (int b = 0; b < 2 * M; b++)
        if (K::curved(a, b)) return true;
    return false;
  }
  Bodies     *bodies = nullptr;
  InstancesOf of; /* only filled if K::memory > 0 */

  /* Reads the arguments of an instance: frames, twists if they are used, multipliers (zero for dropped rows), inputs */
  static void gather(const Evaluation &ev, const Instance &e, Frame<double> *f, Twist<double> *w, double *lambda, double *z)
  {
    for (int k = 0; k < M; k++) {
      f[k] = ev.bodies.template frame<K::needs_rotation>(e.marker[k]);
      if constexpr (!K::holonomic) w[k] = ev.bodies.twist(e.marker[k], f[k]);
    }
    PetscInt i = e.lambda;
    for (int r = 0; r < R; r++) lambda[r] = e.active >> r & 1 ? ev.u[i++] : 0;
    for (int c = 0; c < Z; c++) z[c] = ev.input(e.input[c]);
    (void)w;
    (void)z;
  }

private:
  static const LocalBody &bodyOf(const Bodies &B, const Instance &e, int k) { return B.body[B.marker[e.marker[k]].body]; }

  static bool uses(BodyKind b, int g, int k) { return Reach(OfMarker(K::depends, k), b, g); }
  static bool curves(BodyKind b, int g, int k, BodyKind c, int h, int l)
  {
    if (k == l && Turns(b, g) && Turns(c, h) && Depends(K::depends, 2 * k)) return true; /* AddLever() */
    return InPairs(pairs(k, l), b, g, c, h);
  }
  static constexpr unsigned pairs(int k, int l) /* `pairs` of AddCurvature() for markers k and l */
  {
    unsigned bits = 0;
    for (int x = 0; x < 2; x++)
      for (int y = 0; y < 2; y++) bits |= (unsigned)K::curved(2 * k + x, 2 * l + y) << (2 * x + y);
    return bits;
  }

  /* whether the block has separate columns for v and w: those of attachments' frames, on which constraints at velocity level depend */
  static bool byRates(BodyKind b) { return !K::holonomic && b == BodyKind::Attached; }

  static void value(const Instance &e, const Frame<double> *f, const Twist<double> *w, double t, const double *z, double *psi)
  {
    if constexpr (Z > 0) K::template value<double>(e.data, f, w, t, z, psi);
    else K::template value<double>(e.data, f, w, t, psi);
    (void)z;
  }
  static void gradient(const Instance &e, const Frame<double> *f, const Twist<double> *w, double t, const double *z,
                       typename K::Gradient &J, typename K::Gradient &P, double *zj)
  {
    if constexpr (!K::holonomic) K::gradient(e.data, f, w, t, z, J, P, zj);
  }

  /* Adds - Phi_q^T lambda as a load on the bodies */
  static void react(Bodies &B, const Instance &e, const Frame<double> *f, const double *lambda, const typename K::Gradient &J)
  {
    if constexpr (K::purely_translational) { /* no need to multiply by ones and zeros */
      Vector3 force = Vector3::Zero();
      std::copy(lambda, lambda + R, force.data());
      B.load(e.marker[0], f[0], force, Vector3::Zero());
      B.load(e.marker[1], f[1], -force, Vector3::Zero());
      return;
    }
    for (int k = 0; k < M; k++) {
      const Wrench<double> on = Reaction<R>(J.data() + 6 * R * k, lambda);
      B.load(e.marker[k], f[k], on.f, on.m);
    }
  }

  /* Adds the rows of Phi and the columns of lambda */
  static void gradientBlocks(Evaluation &ev, const Instance &e, const Frame<double> *f, typename K::Gradient &J,
                             const typename K::Gradient &P, const double *zj, const Slot *&slot)
  {
    for (int k = 0; k < M; k++)
      AddGradient<R>(ev, e.marker[k], f[k], J.data() + 6 * R * k, K::holonomic ? nullptr : P.data() + 6 * R * k, e.active, OfMarker(K::depends, k), slot);
    for (int i = 0; i < Z; i++) {
      Matrix<R, 1> column;
      int          rows = 0;
      for (int r = 0; r < R; r++)
        if (e.active >> r & 1) column(rows++) = zj[r * Z + i];
      ev.sink.add((slot++)->column(e.input[i].offset), column, rows, 1);
    }
    (void)P;
    (void)zj;
  }

  /* Adds d(Phi_q^T lambda)/dq; Bodies::jacobian() adds d(G^T m)/dq for fixed moments m */
  static void curvatureBlocks(Evaluation &ev, const Instance &e, const Frame<double> *f, const Twist<double> *w, const double *z,
                              const double *lambda, const typename K::Gradient &J, const Slot *&slot)
  {
    constexpr bool      curved = curvedAtAll();
    typename K::Hessian H;
    if constexpr (curved) {
      if constexpr (K::holonomic) K::curvature(e.data, f, ev.t, lambda, H);
      else K::curvature(e.data, f, w, ev.t, z, lambda, H);
    }
    for (int k = 0; k < M; k++) {
      const Vector3 force = -Reaction<R>(J.data() + 6 * R * k, lambda).f;
      for (int m = 0; m < M; m++) {
        const bool lever = k == m && Depends(K::depends, 2 * k);
        if (!pairs(k, m) && !lever) continue;
        AddCurvature(ev, {e.marker[k], e.marker[m], f[k], f[m]}, curved ? H.data() + 6 * M * 6 * m + 6 * k : nullptr, 6 * M, pairs(k, m),
                     lever ? &force : nullptr, slot);
      }
    }
    (void)w;
    (void)z;
  }
};

} // namespace hhtdae

#endif
