/*
  Users' constraints, expressions f of measures m of markers: the row is -f(m) = 0, so that the load of the multiplier is lambda df/dq.

  UserRow is the common part of the kernels, for any number of markers. First derivatives of f and of the measures, which have
  up to three markers, are computed by automatic differentiation; second derivatives of f, which only the Newton matrix needs,
  by differences of its gradient (user_function.h).
*/
#ifndef HHTDAE_SCENE_KERNELS_USER_CONSTRAINT_H
#define HHTDAE_SCENE_KERNELS_USER_CONSTRAINT_H

#include "marker_measure.h"
#include "scene/user_function.h"
#include <algorithm>
#include <array>
#include <memory>
#include <type_traits>
#include <vector>

namespace hhtdae
{

class UserRow
{
public:
  static constexpr int angles = 4, inputs = 2; /* largest numbers of angles and inputs of a row */

  struct Argument {
    Measure::Kind kind      = Measure::Time;
    int           component = 0;
    int           marker[3] = {-1, -1, -1}; /* numbers of i, j, frame among the markers of the row */
    int           number    = -1;           /* number of an angle in the memory, or of a variable or state among the inputs */
    double        reach     = 0;            /* scale of the measure; the step of the differences for second derivatives is relative to it */
  };
  struct At {
    const Frame<double> *f;
    const Twist<double> *w; /* null at position level */
    double               t;
    const double        *z, *remembered;
  };

  UserFunction          f;
  std::vector<Argument> arguments;

  double value(const At &at) const;
  /* Adds the derivatives of f by (x, theta) of the markers, by their twists, and by the inputs; `twists` and `inputs` may be null */
  void gradient(const At &at, double *frames, double *twists, double *inputs) const;
  /* Adds factor times the second derivatives of f by the frames; at velocity level by twists (rows) and frames (columns) */
  void curvature(const At &at, double factor, Eigen::Ref<Eigen::MatrixXd> H) const;
  /* The partial derivative of f by time */
  double rate(const At &at) const;
  /* Whether f, at the positions and time of `at`, is linear in velocities, with factors that do not depend on inputs */
  bool linear(const At &at) const;

  std::array<int, 2> markersOfAngle(int k) const; /* {-1, -1} if the row has no k-th angle */
  void   accept(const Frame<double> *f, double *remembered) const;
  double longestStep(const Frame<double> *f, const Twist<double> *w, double angular) const;

  static bool ofVelocities(Measure::Kind k) { return k == Measure::Velocity || k == Measure::Rate || k == Measure::AngularVelocity; }

private:
  void measure(const At &at, double *m) const;
};

struct UserRowData {
  double                         memory[UserRow::angles] = {};
  std::shared_ptr<const UserRow> row;
};

/* Angles: 0 for rows without angles, else UserRow::angles. Rows without angles have no memory, so that a continued run can add and remove them
   (Continue.AUserConstraintTakesHold). */
template <int M, int Angles> struct UserPosition : Constraint<UserPosition<M, Angles>, M, 1> {
  using Base                             = Constraint<UserPosition<M, Angles>, M, 1>;
  using Data                             = UserRowData;
  static constexpr const char *name      = "user constraint";
  static constexpr int         memory = Angles, angles = Angles;
  static constexpr bool        own_units = true, driven = true;

  template <class T> static void value(const Data &d, const Frame<T> *f, const T &t, T *phi)
  {
    static_assert(std::is_same<T, double>::value, "its derivatives are those below");
    phi[0] = -d.row->value(at(d, f, t));
  }
  static void gradient(const Data &d, const Frame<double> *f, double t, typename Base::Gradient &J)
  {
    J.setZero();
    d.row->gradient(at(d, f, t), J.data(), nullptr, nullptr);
    J = -J;
  }
  static void curvature(const Data &d, const Frame<double> *f, double t, const double *lambda, typename Base::Hessian &H)
  {
    H.setZero();
    d.row->curvature(at(d, f, t), -lambda[0], H);
  }
  static void time(const Data &d, const Frame<double> *f, double t, double *rate) { rate[0] = -d.row->rate(at(d, f, t)); }

  static std::array<int, 2> markersOfAngle(const Data &d, int k) { return d.row->markersOfAngle(k); }
  static void   accept(Data &d, const Frame<double> *f) { d.row->accept(f, d.memory); }
  static double longestStep(const Data &d, const Frame<double> *f, const Twist<double> *w, double, double angular)
  {
    return d.row->longestStep(f, w, angular);
  }

private:
  static UserRow::At at(const Data &d, const Frame<double> *f, double t) { return {f, nullptr, t, nullptr, d.memory}; }
};

template <int M, int Angles> struct UserVelocity : VelocityConstraint<UserVelocity<M, Angles>, M, 1> {
  using Base                             = VelocityConstraint<UserVelocity<M, Angles>, M, 1>;
  using Data                             = UserRowData;
  static constexpr const char *name      = "user constraint of velocities";
  static constexpr int         memory = Angles, angles = Angles, inputs = UserRow::inputs;
  static constexpr bool        own_units = true;

  template <class T> static void value(const Data &d, const Frame<T> *f, const Twist<T> *w, const T &t, const T *z, T *psi)
  {
    static_assert(std::is_same<T, double>::value, "its derivatives are those below");
    psi[0] = -d.row->value({f, w, t, z, d.memory});
  }
  static void gradient(const Data &d, const Frame<double> *f, const Twist<double> *w, double t, const double *z, typename Base::Gradient &J,
                       typename Base::Gradient &P, double *zj)
  {
    double unused[UserRow::inputs] = {};
    J.setZero();
    P.setZero();
    if (!zj) zj = unused;
    std::fill(zj, zj + inputs, 0.0);
    d.row->gradient({f, w, t, z, d.memory}, P.data(), J.data(), zj);
    J = -J;
    P = -P;
    for (int i = 0; i < inputs; i++) zj[i] = -zj[i];
  }
  static void curvature(const Data &d, const Frame<double> *f, const Twist<double> *w, double t, const double *z, const double *lambda,
                        typename Base::Hessian &H)
  {
    H.setZero();
    d.row->curvature({f, w, t, z, d.memory}, -lambda[0], H);
  }

  static std::array<int, 2> markersOfAngle(const Data &d, int k) { return d.row->markersOfAngle(k); }
  static void   accept(Data &d, const Frame<double> *f) { d.row->accept(f, d.memory); }
  static double longestStep(const Data &d, const Frame<double> *f, const Twist<double> *w, double, double angular)
  {
    return d.row->longestStep(f, w, angular);
  }
};

} // namespace hhtdae

#endif
