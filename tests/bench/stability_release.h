/* Stiff elements that are released, and wrong Jacobians: cases in which corrections are small although the equations
   of motion are far from being satisfied. The element that holds a body makes the Newton matrix stiff; once it is
   gone, or if it was never there, the matrix turns any imbalance of forces into a tiny correction */
#ifndef HHTDAE_BENCH_STABILITY_RELEASE_H
#define HHTDAE_BENCH_STABILITY_RELEASE_H

#include "../../examples/problems/doublependulum.h"
#include "../../examples/problems/pendulum.h"
#include "../../examples/problems/springpendulum.h"
#include "stability_models.h"

namespace hhtstab
{

enum class Hold {
  Spring,   /* s y */
  Damper,   /* s y' */
  Bushing,  /* s y + s y'/1000 */
  Brake,    /* s/1000 tanh(1000 y'), with the slope s at y' = 0 */
  Contact,  /* s y + s y'/1000 while it pushes: released by state, under a load that reaches the weight at t = 0.5 */
  Friction, /* sticks with the slope s up to 10 N: slips by state under a load of 20 t */
};

/* A block of 1 kg on a vertical guide (coordinates x, y, a multiplier for x = 0) held by a stiff element until t =
   0.5. With company: also a swinging pendulum, and a mass on a spring of 1e8 N/m that remains, so that the imbalance
   is not the only large entry */
struct Release : hhtex::Problem {
  const Hold   hold;
  const double s;
  const bool   company;
  const bool   as_force; /* the holding force is a force state: its stiffness is not in the block's own row */
  const double g = 9.81, until = 0.5 + 1e-9, kept = 1e8; /* the last step with the element may end at 0.5 except for rounding */

  Release(Hold hold_, double strength, bool company_, bool as_force_ = false) : hold(hold_), s(strength), company(company_), as_force(as_force_)
  {
    name = "release";
    n    = (company ? 7 : 3) + as_force;
    t1   = 1;
    role = {TSHHT3_COORDINATE, TSHHT3_COORDINATE, TSHHT3_HOLONOMIC};
    if (company) role.insert(role.end(), {TSHHT3_COORDINATE, TSHHT3_COORDINATE, TSHHT3_HOLONOMIC, TSHHT3_COORDINATE});
    if (as_force) role.push_back(TSHHT3_FORCE);
  }
  bool byState() const { return hold == Hold::Contact || hold == Hold::Friction; }
  void initial(double *u, double *v) const override
  {
    std::fill_n(u, n, 0.);
    std::fill_n(v, n, 0.);
    if (hold == Hold::Spring || hold == Hold::Bushing || hold == Hold::Contact) u[1] = -g / s;
    if (hold == Hold::Damper) v[1] = -g / s;
    if (hold == Hold::Brake) v[1] = -std::atanh(std::min(g / (1e-3 * s), 0.999)) * 1e-3;
    if (company) {
      u[3] = 1;
      u[6] = g / kept;
    }
  }
  /* Force on the block in addition to its weight, upwards, and its derivatives with respect to y and y' */
  void force(double t, double y, double v, double &f, double &k, double &c) const
  {
    f = k = c = 0;
    if (!byState() && t > until) return;
    switch (hold) {
    case Hold::Spring: f = -s * y, k = -s; break;
    case Hold::Damper: f = -s * v, c = -s; break;
    case Hold::Bushing: f = -s * (y + v / 1000), k = -s, c = -s / 1000; break;
    case Hold::Brake: {
      const double T = std::tanh(1000 * v);
      f = -s / 1000 * T, c = -s * (1 - T * T);
      break;
    }
    case Hold::Contact: {
      const bool touches = y < 0 && y + v / 1000 < 0;
      f = (touches ? -s * (y + v / 1000) : 0) + g * t / until;
      k = touches ? -s : 0, c = k / 1000;
      break;
    }
    case Hold::Friction: {
      const double T = std::tanh(s * v / 10);
      f = g + 20 * t - 10 * T, c = -s * (1 - T * T);
      break;
    }
    }
  }
  void residual(double t, const double *u, const double *v, const double *a, double *r) const override
  {
    double f, k, c;
    force(t, u[1], v[1], f, k, c);
    r[0] = a[0] + u[2];
    r[1] = a[1] + g - (as_force ? u[n - 1] : f);
    r[2] = u[0];
    if (as_force) r[n - 1] = u[n - 1] - f;
    if (!company) return;
    r[3] = a[3] + u[3] * u[5];
    r[4] = a[4] + g + u[4] * u[5];
    r[5] = (u[3] * u[3] + u[4] * u[4] - 1) / 2;
    r[6] = a[6] + kept * u[6] - g * std::cos(5 * t);
  }
  void jacobian(double t, const double *u, const double *v, const double *, double sv, double sa, hhtex::Entries &J) const override
  {
    double f, k, c;
    force(t, u[1], v[1], f, k, c);
    J.add(0, 0, sa);
    J.add(0, 2, 1);
    const PetscInt row = as_force ? n - 1 : 1; /* row of the force's derivatives */
    if (as_force) {
      J.add(1, 1, sa);
      J.add(1, row, -1);
      J.add(row, row, 1);
    }
    J.add(row, 1, (as_force ? 0 : sa) - k - sv * c);
    J.add(2, 0, 1);
    if (!company) return;
    for (int i = 0; i < 2; i++) {
      J.add(3 + i, 3 + i, sa + u[5]);
      J.add(3 + i, 5, u[3 + i]);
      J.add(5, 3 + i, u[3 + i]);
    }
    J.add(6, 6, sa + kept);
  }
  /* Height of the block; what it falls while held is below the accepted errors */
  double height(double t) const
  {
    const double d = std::max(0., t - until);
    switch (hold) {
    case Hold::Contact: return -std::max(0., 1 - t / until) * g / s + g / until * d * d * d / 6;
    case Hold::Friction: return 20 * d * d * d / 6;
    case Hold::Damper:
    case Hold::Brake: {
      std::vector<double> u(n), v(n);
      initial(u.data(), v.data());
      return v[1] * t - g * d * d / 2;
    }
    case Hold::Spring:
    case Hold::Bushing: return -g / s - g * d * d / 2;
    }
    return 0;
  }
};

/* h: 0 under error control; positive, fixed steps; negative, largest step under error control */
inline PetscErrorCode ReleaseCase(Run &run, const Release &p, double eps, double h)
{
  ProblemRun    r(p);
  PetscFunctionBegin;
  PetscCall(r.create(run, eps, h > 0 ? h : 0));
  if (h < 0) {
    TSAdapt adapt;
    PetscCall(TSGetAdapt(r.ts, &adapt));
    PetscCall(TSAdaptSetStepLimits(adapt, 0, -h));
  }
  r.look = [&](double t, const double *u, const double *) {
    run.judge(u[1] - p.height(t));
    run.judge(u[0]);
  };
  PetscCall(run.solve(r.ts));
  PetscFunctionReturn(0);
}

inline void AddReleases(Cases &cases)
{
  const struct {
    Hold        hold;
    const char *name;
  } holds[] = {{Hold::Spring, "spring"}, {Hold::Damper, "damper"},   {Hold::Bushing, "bushing"},
               {Hold::Brake, "brake"},   {Hold::Contact, "contact"}, {Hold::Friction, "friction"}};
  /* accept: a step over the jump of the acceleration misses a velocity of up to g h; error control permits
     h = sqrt(eps/(k g)) */
  const struct {
    const char *name;
    double      eps, h, accept;
  } steps[] = {{"1e-3", 1e-3, 0, 0.12}, {"1e-6", 1e-6, 0, 4e-3}, {"1e-3, h<1e-3", 1e-3, -1e-3, 5e-3},
               {"1e-5, h=1e-3", 1e-5, 1e-3, 5e-3}, {"1e-5, h=1e-4", 1e-5, 1e-4, 5e-4}};
  for (const auto &hold : holds)
    for (double d : {2, 4, 6, 8, 10, 12})
      for (const auto &step : steps)
        for (int with : {0, 1, 2}) {
          const bool company = with == 1, as_force = with == 2;
          const double s = std::pow(10, d);
          /* Larger s are left out: friction would slip at 1e-7 m/s, and Newton's method passes so sharp a bend only
             with tiny steps; a contact of 1e10 N/m rebounds by an amount that depends on the permitted penetration */
          if (s > (hold.hold == Hold::Contact ? 1e8 : 1e12)) continue;
          /* displacement of a soft element before its release: it slips, oscillates, or slides steadily */
          const double soft = hold.hold == Hold::Brake ? (d < 5 ? -1 : 0) : hold.hold == Hold::Friction ? 20 / s : d < 4 ? 0.15 : d < 6 ? 1e-3 : 0; /* oscillates */
          if (soft < 0) continue;
          Case &c = Add(cases, "releases", std::string(hold.name) + Name(" %.0e, ", s) + step.name + (company ? ", company" : as_force ? ", force state" : ""),
              "height, exact", step.accept + soft,
              [=](Run &r) { return ReleaseCase(r, Release(hold.hold, s, company, as_force), step.eps, step.h); });
          /* 1e9 N held by a sliding velocity of 1e-11 m/s: the run may end because of rounding, with an error */
          if (hold.hold == Hold::Brake && s > 1e11) c.orFail("No ");
          if (d == 8 && step.h <= 0) c.test();
        }
}

/* ---- wrong Jacobians ---- */

enum class Wrong { Stiff, Damped, Soft, Row, Old };

/* A problem with a distorted Jacobian */
struct Distorted : hhtex::Problem {
  const hhtex::Problem &right;
  const Wrong           wrong;
  const double          by;
  std::vector<double>   u0, v0;

  Distorted(const hhtex::Problem &p, Wrong w, double b) : right(p), wrong(w), by(b), u0(p.n), v0(p.n)
  {
    name = p.name;
    n    = p.n;
    t1   = p.t1;
    role = p.role;
    p.initial(u0.data(), v0.data());
  }
  void initial(double *u, double *v) const override { right.initial(u, v); }
  void residual(double t, const double *u, const double *v, const double *a, double *f) const override { right.residual(t, u, v, a, f); }
  void jacobian(double t, const double *u, const double *v, const double *a, double sv, double sa, hhtex::Entries &J) const override
  {
    if (wrong == Wrong::Old) right.jacobian(t0, u0.data(), v0.data(), a, sv, sa, J);
    else right.jacobian(t, u, v, a, sv, sa, J);
    for (PetscInt i = 0; i < n; i++)
      if (role[i] == TSHHT3_COORDINATE && (wrong == Wrong::Stiff || wrong == Wrong::Damped)) J.add(i, i, by * (wrong == Wrong::Stiff ? 1 : sv));
    for (size_t e = 0; e < J.value.size(); e++) {
      const bool own = J.row[e] == J.col[e] && role[J.row[e]] == TSHHT3_COORDINATE;
      if (wrong == Wrong::Soft && own) J.value[e] = sa + by * (J.value[e] - sa);
      if (wrong == Wrong::Row && J.row[e] == 1 && role[J.col[e]] == TSHHT3_COORDINATE) J.value[e] = own ? sa : 0;
    }
  }
  bool reference(double t, double *u, double *v, double *a) const override { return right.reference(t, u, v, a); }
  bool referenceEverywhere() const override { return true; }
};

inline PetscErrorCode WrongCase(Run &run, bool spring, Wrong wrong, double by, double eps, double h)
{
  const hhtex::Pendulum       rod(90, 0, 1);
  const hhtex::SpringPendulum elastic(1e4, 1);
  const hhtex::Problem       &p = spring ? (const hhtex::Problem &)elastic : rod;
  const Distorted             d(p, wrong, by);
  ProblemRun                  r(d);
  AgainstReference            error(d);
  PetscFunctionBegin;
  PetscCall(r.create(run, eps, h));
  r.look                    = [&](double t, const double *u, const double *v) { error(t, u, v); };
  const PetscErrorCode code = run.solve(r.ts);
  run.judge(code ? 0 : error.q); /* nothing is required of the steps before the error */
  PetscFunctionReturn(code);
}

inline void AddWrongJacobians(Cases &cases)
{
  const struct {
    Wrong       wrong;
    const char *name;
    double      by;
  } kinds[] = {{Wrong::Stiff, "stiffness 1e2", 1e2}, {Wrong::Stiff, "stiffness 1e4", 1e4}, {Wrong::Stiff, "stiffness 1e6", 1e6}, {Wrong::Stiff, "stiffness 1e9", 1e9},
               {Wrong::Stiff, "stiffness 1e12", 1e12}, {Wrong::Damped, "damping 1e2", 1e2}, {Wrong::Damped, "damping 1e6", 1e6}, {Wrong::Damped, "damping 1e10", 1e10},
               {Wrong::Soft, "no stiffness", 0}, {Wrong::Soft, "half the stiffness", 0.5}, {Wrong::Soft, "stiffness of the wrong sign", -1},
               {Wrong::Row, "a row of inertia alone", 0}, {Wrong::Old, "of the start", 0}};
  for (bool spring : {false, true})
    for (const auto &k : kinds)
      for (double eps : {1e-3, 1e-6})
        for (double h : {0., 1e-3}) {
          if (h > 0 && k.by >= 1e10) continue; /* would end after 1e7 steps of 1e-7 s, or at the deadline: not suitable for a table */
          Case &c = Add(cases, "wrong Jacobians", std::string(spring ? "spring pendulum, " : "pendulum, ") + k.name + Name(", %.0e", eps) + (h > 0 ? ", h=1e-3" : ""),
                        "position, exact", h > 0 ? 1e-2 : std::max(40 * eps, 4e-4), [=](Run &r) { return WrongCase(r, spring, k.wrong, k.by, eps, h); });
          if (k.by == 1e6 && !(h > 0)) c.test();
          c.orFail("No "); /* the message is "No step from t succeeded" or "No consistent accelerations were found" */
        }
}

} // namespace hhtstab

#endif
