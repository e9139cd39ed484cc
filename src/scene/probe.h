/*
  A probe evaluates a joint or force for measures: the loads of a constraint on the bodies of its markers, or the components
  of a force that are not force states. It is a copy of the instance, so that any rank with local copies of the element's
  bodies and multipliers can evaluate it.
*/
#ifndef HHTDAE_SCENE_PROBE_H
#define HHTDAE_SCENE_PROBE_H

#include "constraint_batch.h"
#include "described_rows.h"
#include "force_batch.h"

namespace hhtdae
{

class Probe
{
public:
  virtual ~Probe()                     = default;
  virtual int      markers() const     = 0;
  virtual PetscInt marker(int k) const = 0; /* local number */

  /* Of a constraint: the load - J^T lambda on the bodies of its markers; the number of its multipliers, dropped ones not
     counted; the i-th multiplier */
  virtual void  reaction(const Evaluation &, Wrench<double> *) const {}
  virtual int   multipliers() const { return 0; }
  virtual Input multiplier(int) const { return {}; }
  /* Derivatives of y . reaction for constant y, with the wrenches of all markers stacked as one vector: by perturbations
     of the frames (6 per marker) and by the multipliers. Reactions of kernels with inputs do not depend on the inputs. */
  virtual void reactionGradient(const Evaluation &, const double *, double *, double *) const {}

  /* Computes all rows, including dropped ones, in the state of the evaluation. At velocity level DescribedRows::value is
     Psi, and speed is the sum of the magnitudes of its terms. */
  virtual void rows(const Evaluation &, DescribedRows &, double *speed) const { (void)speed; }

  /* Of a force: its components, computed even if they are force states */
  virtual void components(const Evaluation &, double *) const {}

  /* Of both: loads on the bodies of the markers */
  virtual void loads(const Evaluation &, Wrench<double> *on) const
  {
    for (int k = 0; k < markers(); k++) on[k] = {Vector3::Zero(), Vector3::Zero()};
  }

  virtual void     accept(const Bodies &) {}
  virtual PetscInt memory() const { return 0; }
  virtual void     copyMemory(double *, bool in) { (void)in; }
};

template <class K, class Instance> class ProbeOf : public Probe
{
public:
  explicit ProbeOf(const Instance &i) : e(i) {}
  int      markers() const override { return K::markers; }
  PetscInt marker(int k) const override { return e.marker[k]; }

  void     accept(const Bodies &B) override { Remember<K>(e, B); }
  PetscInt memory() const override { return K::memory; }
  void     copyMemory(double *x, bool in) override { CopyMemory<K>(e, x, in); }

protected:
  Instance e;
};

template <class K> class ConstraintProbe : public ProbeOf<K, typename ConstraintBatch<K>::Instance>
{
  using Instance         = typename ConstraintBatch<K>::Instance;
  static constexpr int M = K::markers, R = K::rows, Z = K::inputs;
  struct State {
    Frame<double>        f[M];
    Twist<double>        w[M];
    double               lambda[R], z[Z > 0 ? Z : 1];
    typename K::Gradient J, P;
  };

public:
  explicit ConstraintProbe(const Instance &i) : ProbeOf<K, Instance>(i)
  {
    for (int r = 0; r < R; r++)
      if (i.active >> r & 1) row_[rows_++] = r;
  }

  void reaction(const Evaluation &ev, Wrench<double> *on) const override
  {
    State s;
    gather(ev, s);
    for (int k = 0; k < M; k++) on[k] = Reaction<R>(s.J.data() + 6 * R * k, s.lambda);
  }
  void  loads(const Evaluation &ev, Wrench<double> *on) const override { reaction(ev, on); }
  int   multipliers() const override { return rows_; }
  Input multiplier(int i) const override { return {this->e.lambda + i, this->e.group, i}; }
  void  reactionGradient(const Evaluation &ev, const double *y, double *frames, double *lambda) const override
  {
    State               s;
    typename K::Hessian H;
    gather(ev, s);
    if constexpr (K::holonomic)
      K::curvature(this->e.data, s.f, ev.t, s.lambda, H);
    else
      K::curvature(this->e.data, s.f, s.w, ev.t, s.z, s.lambda, H);
    const Matrix<R, 1> rows = -s.J * Eigen::Map<const Matrix<6 * M, 1>>(y);
    MinusTransposed(H.data(), 6 * M, y, frames);
    for (int i = 0; i < rows_; i++) lambda[i] = rows(row_[i]);
  }

  void rows(const Evaluation &ev, DescribedRows &d, double *speed) const override
  {
    State s;
    gather(ev, s);
    d.name   = K::name;
    d.length = false;
    for (int k = 0; k < M; k++) d.length |= Depends(K::depends, 2 * k);
    std::fill(d.rate, d.rate + R, 0.0);
    if constexpr (K::holonomic)
      K::value(this->e.data, s.f, ev.t, d.value);
    else {
      Twist<double> still[M];
      for (Twist<double> &w : still) w = {Vec3<double>::Zero(), Vec3<double>::Zero()};
      value(s.f, s.w, ev.t, s.z, d.value);
      value(s.f, still, ev.t, s.z, d.rate);
    }
    d.J.template topLeftCorner<R, 6 * M>() = s.J;
    if constexpr (K::own_units) MakeLengths<R, M>(d);
    for (int r = 0; r < R && !K::holonomic; r++) {
      speed[r] = std::abs(d.rate[r]);
      for (int k = 0; k < M; k++) speed[r] += std::abs(d.J.template block<1, 3>(r, 6 * k).dot(s.w[k].v)) + std::abs(d.J.template block<1, 3>(r, 6 * k + 3).dot(s.w[k].w));
    }
  }

private:
  int row_[R], rows_ = 0; /* the rows that were not dropped, and their number */

  void value(const Frame<double> *f, const Twist<double> *w, double t, const double *z, double *psi) const
  {
    if constexpr (K::holonomic) return;
    else if constexpr (Z > 0) K::template value<double>(this->e.data, f, w, t, z, psi);
    else K::template value<double>(this->e.data, f, w, t, psi);
    (void)f, (void)w, (void)t, (void)z, (void)psi;
  }

  void gather(const Evaluation &ev, State &s) const
  {
    ConstraintBatch<K>::gather(ev, this->e, s.f, s.w, s.lambda, s.z);
    if constexpr (K::holonomic)
      K::gradient(this->e.data, s.f, ev.t, s.J);
    else
      K::gradient(this->e.data, s.f, s.w, ev.t, s.z, s.J, s.P, nullptr);
  }
};

template <class K> class ForceProbe : public ProbeOf<K, ForceInstance<K>>
{
  static constexpr int M = K::markers, Z = K::inputs;

public:
  using ProbeOf<K, ForceInstance<K>>::ProbeOf;

  void components(const Evaluation &ev, double *c) const override
  {
    Frame<double> f[M];
    components(ev, f, c);
  }
  void loads(const Evaluation &ev, Wrench<double> *on) const override
  {
    Frame<double> f[M];
    double        c[K::count];
    components(ev, f, c);
    if (this->e.state >= 0) std::copy(ev.u + this->e.state, ev.u + this->e.state + K::count, c);
    K::template apply<double>(this->e.data, f, c, on);
  }

private:
  void components(const Evaluation &ev, Frame<double> *f, double *c) const
  {
    Twist<double> w[M];
    double        z[Z > 0 ? Z : 1];
    for (int k = 0; k < M; k++) {
      f[k] = ev.bodies.template frame<true>(this->e.marker[k]);
      w[k] = ev.bodies.twist(this->e.marker[k], f[k]);
    }
    for (int i = 0; i < Z; i++) z[i] = ev.input(this->e.input[i]);
    K::template components<double>(this->e.data, f, w, ev.t, z, c);
  }
};

} // namespace hhtdae

#endif
