/*
  A problem as a first-order DAE G(t,y,y') = 0, for BDF codes. y holds all unknowns of the problem (q, states, lambda,
  V, F in its own order), then the velocities v of the coordinates, and in the stabilized form then one mu per holonomic
  constraint:

    index 3                                      Gear, Gupta and Leimkuhler, index 2
    F(t, y, v, v') = 0    Phi among its rows     F(t, y, v, v') = 0
    q' - v = 0                                   q' - v + Phi_q^T mu = 0
                                                 Phi_q v + Phi_t = 0

  Phi_q is taken from the problem's Jacobian with both shifts zero. (Phi_q v)_q + Phi_qt, which only the iteration matrix
  needs, is a central difference of Phi_q along (1, v). (Phi_q^T mu)_q is left out of the matrix, because mu tends to zero
  with the step size.
*/
#ifndef WORKPRECISION_FIRSTORDER_H
#define WORKPRECISION_FIRSTORDER_H

#include "workprecision_run.h"

namespace wp
{

class FirstOrder
{
public:
  enum class Form { Index3, Stabilized };
  using PhiT = std::function<void(const Problem &, double, const double *, double *)>;

  FirstOrder(const CountedProblem &problem, Form form, const PhiT &phiT)
      : p_(problem), phiT_(phiT), n_(p_.n), V_(n_, 0.), A_(n_, 0.), shifted_(n_)
  {
    velocity_.assign(n_, -1);
    row_.assign(n_, -1);
    for (PetscInt i = 0; i < n_; i++)
      if (p_.role[i] == TSHHT3_COORDINATE) {
        velocity_[i] = n_ + (PetscInt)coordinate_.size();
        coordinate_.push_back(i);
      }
    size = n_ + (PetscInt)coordinate_.size();
    if (form == Form::Stabilized)
      for (PetscInt i = 0; i < n_; i++)
        if (p_.role[i] == TSHHT3_HOLONOMIC) row_[i] = size++;
    stabilized_ = size > n_ + (PetscInt)coordinate_.size();
    findGradient();
  }

  PetscInt size;
  long     extra = 0; /* evaluations of the Jacobian that a problem written in first-order form would not need; not counted */

  /* Their CPU time, extrapolated from that of one evaluation; to be called after a run, because it uses the problem at
     its start */
  double extraSeconds()
  {
    const int           n = 30;
    std::vector<double> u(n_), v(n_);
    p_.p.initial(u.data(), v.data());
    evaluate(p_.p, p_.t0, u.data(), v.data(), 1., 1., gradient_);
    const double start = ProcessorSeconds();
    for (int k = 0; k < n; k++) evaluate(p_.p, p_.t0, u.data(), v.data(), 1., 1., gradient_);
    return (double)extra * (ProcessorSeconds() - start) / n;
  }

  /* Consistent start: lambda and the accelerations at t0 come from the reference, if there is one */
  void initial(const Problem &p, std::vector<double> &y, std::vector<double> &yp) const
  {
    std::vector<double> u(n_), v(n_), ur(n_), vr(n_), ar(n_);
    y.assign(size, 0.);
    yp.assign(size, 0.);
    p.initial(u.data(), v.data());
    const bool known = p.reference(p.t0, ur.data(), vr.data(), ar.data());
    for (PetscInt i = 0; i < n_; i++) {
      const bool coordinate = p_.role[i] == TSHHT3_COORDINATE, state = p_.role[i] == TSHHT3_STATE;
      y[i] = u[i];
      if (!coordinate && !state && known && !std::isnan(ur[i])) y[i] = ur[i];
      if (state && known && !std::isnan(vr[i])) yp[i] = vr[i];
      if (!coordinate) continue;
      yp[i] = y[velocity_[i]] = v[i];
      if (known && !std::isnan(ar[i])) yp[velocity_[i]] = ar[i];
    }
  }

  void residual(double t, const double *y, const double *yp, double *f)
  {
    unpack(y, yp);
    p_.residual(t, y, V_.data(), A_.data(), f);
    for (PetscInt i : coordinate_) f[velocity_[i]] = yp[i] - y[velocity_[i]];
    if (!stabilized_) return;
    evaluateMore(t, y, 0., 0., gradient_);
    for (PetscInt i = 0; i < n_; i++)
      if (row_[i] >= 0) f[row_[i]] = 0.;
    for (size_t k : phiQ_) {
      const PetscInt i = velocity_[gradient_.col[k]], m = row_[gradient_.row[k]];
      f[i] += gradient_.value[k] * y[m];
      f[m] += gradient_.value[k] * y[i];
    }
    if (!phiT_) return;
    std::fill(shifted_.begin(), shifted_.end(), 0.);
    phiT_(p_.p, t, y, shifted_.data());
    for (PetscInt i = 0; i < n_; i++)
      if (row_[i] >= 0) f[row_[i]] += shifted_[i];
  }

  /* dG/dy + c dG/dy'; the same sequence of positions in every call */
  void jacobian(double t, const double *y, const double *yp, double c, Entries &J)
  {
    J.clear();
    unpack(y, yp);
    evaluate(p_, t, y, V_.data(), 0., 0., gradient_);
    evaluateMore(t, y, 1., c, rates_);
    for (size_t k = 0; k < gradient_.value.size(); k++) {
      const PetscInt i = gradient_.row[k], j = gradient_.col[k];
      const double   rate = rates_.value[k] - gradient_.value[k]; /* by velocity, and c times by acceleration */
      J.add(i, j, gradient_.value[k] + (p_.role[j] == TSHHT3_STATE ? c * rate : 0.));
      if (velocity_[j] >= 0) J.add(i, velocity_[j], rate);
    }
    for (PetscInt i : coordinate_) {
      J.add(velocity_[i], i, c);
      J.add(velocity_[i], velocity_[i], -1.);
    }
    if (stabilized_) addStabilization(t, y, J);
    for (PetscInt i = 0; i < size; i++) J.add(i, i, 0.);
  }

  /* U and U' of the problem; derivatives of states stay zero, since they are not compared */
  void output(const double *y, double *u, double *v) const
  {
    std::copy_n(y, n_, u);
    std::fill_n(v, n_, 0.);
    for (PetscInt i : coordinate_) v[i] = y[velocity_[i]];
  }

  void accelerations(const double *yp, double *a) const
  {
    std::fill_n(a, n_, 0.);
    for (PetscInt i : coordinate_) a[i] = yp[velocity_[i]];
  }

  bool isVelocity(PetscInt i) const { return i >= n_ && i < n_ + (PetscInt)coordinate_.size(); }
  bool isDifferential(PetscInt i) const
  {
    return isVelocity(i) || (i < n_ && (p_.role[i] == TSHHT3_COORDINATE || p_.role[i] == TSHHT3_STATE));
  }

private:
  const CountedProblem &p_;
  PhiT                  phiT_;
  PetscInt              n_;
  bool                  stabilized_;
  std::vector<PetscInt> coordinate_, velocity_, row_; /* of q_i: v_i; of Phi_i: mu_i and its row */
  std::vector<size_t>   phiQ_;                        /* indices of those entries of the problem's Jacobian that are Phi_q */
  std::vector<double>   V_, A_, shifted_;
  Entries               gradient_, rates_;

  void unpack(const double *y, const double *yp)
  {
    for (PetscInt i : coordinate_) {
      V_[i] = y[velocity_[i]];
      A_[i] = yp[velocity_[i]];
    }
    for (PetscInt i = 0; i < n_; i++)
      if (p_.role[i] == TSHHT3_STATE) V_[i] = yp[i];
  }

  void evaluate(const Problem &p, double t, const double *u, const double *v, double sv, double sa, Entries &E)
  {
    E.clear();
    p.jacobian(t, u, v, A_.data(), sv, sa, E);
  }

  void evaluateMore(double t, const double *u, double sv, double sa, Entries &E)
  {
    extra++;
    evaluate(p_.p, t, u, V_.data(), sv, sa, E);
  }

  void findGradient()
  {
    std::vector<double> u(n_), v(n_);
    p_.p.initial(u.data(), v.data());
    evaluate(p_.p, p_.t0, u.data(), v.data(), 0., 0., gradient_);
    for (size_t k = 0; k < gradient_.value.size(); k++)
      if (row_[gradient_.row[k]] >= 0 && velocity_[gradient_.col[k]] >= 0) phiQ_.push_back(k);
  }

  void addStabilization(double t, const double *y, Entries &J)
  {
    double vmax = 1.;
    for (double v : V_) vmax = std::max(vmax, std::abs(v));
    const double d = 1e-5 / vmax;
    for (size_t k : phiQ_) {
      const PetscInt i = velocity_[gradient_.col[k]], m = row_[gradient_.row[k]];
      J.add(i, m, gradient_.value[k]);
      J.add(m, i, gradient_.value[k]);
    }
    for (int side = 1; side >= -1; side -= 2) {
      for (PetscInt i = 0; i < n_; i++) shifted_[i] = y[i] + side * d * V_[i];
      evaluateMore(t + side * d, shifted_.data(), 0., 0., side > 0 ? rates_ : gradient_);
    }
    for (size_t k : phiQ_)
      J.add(row_[gradient_.row[k]], gradient_.col[k], (rates_.value[k] - gradient_.value[k]) / (2. * d));
  }
};

} // namespace wp

#endif
