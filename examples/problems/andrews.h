/*
  Andrews' squeezing mechanism (Schiehlen 1990; IVP test set; IFToMM benchmark A03): seven bodies in a plane, driven by
  a constant torque, coordinates (beta, theta, gamma, phi, delta, omega, epsilon), three closed loops. SI units, no
  gravity.

    M(q) q'' + Phi_q^T lambda = Q(q,q'),   Phi(q) = 0       with the test set's lambda

  Reference: long-double extrapolation of order 20 (200 and 400 steps agree to the digits given); the values published
  for t = 0.03 are good to fewer digits (9.6 in q, 7.3 in q', 5.9 in q'' and lambda).
*/
#ifndef HHTEX_ANDREWS_H
#define HHTEX_ANDREWS_H

#include "../problem.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace hhtex
{

struct Andrews : Problem {
  static constexpr double m1 = .04325, m2 = .00365, m3 = .02373, m4 = .00706, m5 = .07050, m6 = .00706, m7 = .05498;
  static constexpr double i1 = 2.194e-6, i2 = 4.410e-7, i3 = 5.255e-6, i4 = 5.667e-7, i5 = 1.169e-5, i6 = 5.667e-7,
                          i7 = 1.912e-5;
  static constexpr double xa = -.06934, ya = -.00227, xb = -.03635, yb = .03273, xc = .014, yc = .072;
  static constexpr double c0 = 4530., l0 = .07785, mom = .033; /* spring, its free length, driving torque */
  static constexpr double d = .028, da = .0115, e = .02, ea = .01421, rr = .007, ra = .00092, ss = .035, sa_ = .01874,
                          sb = .01043, sc = .018, sd = .02, ta = .02308, tb = .00916, u_ = .04, ua = .01228,
                          ub = .00449, zf = .02, zt = .04, fa = .01421;
  static constexpr double ee = e - ea, zz = zf - fa;
  enum { BE, TH, GA, PH, DE, OM, EP };

  explicit Andrews(double end = 0.03)
  {
    name = "andrews";
    n    = 13;
    t1   = end;
    role.assign(13, TSHHT3_COORDINATE);
    std::fill(role.begin() + 7, role.end(), TSHHT3_HOLONOMIC);
  }

  void initial(double *u, double *v) const override
  {
    const Row &r = table()[0];
    std::copy_n(r.q, 7, u);
    std::fill_n(u + 7, 6, 0.);
    std::fill_n(v, 13, 0.);
  }

  void residual(double, const double *q, const double *v, const double *a, double *f) const override
  {
    double M[7][7], Q[7];
    mass(q, M);
    forces(q, v, Q);
    for (int i = 0; i < 7; i++) {
      f[i] = -Q[i];
      for (int j = 0; j < 7; j++) f[i] += M[i][j] * a[j];
    }
    closures(q, f + 7);
    for (const Term &t : terms()) {
      const double g = t.slope(q) * q[7 + t.row];
      f[t.i] += g;
      if (t.j >= 0) f[t.j] += g;
    }
  }

  void jacobian(double, const double *q, const double *v, const double *a, double sv, double sa,
                Entries &J) const override
  {
    double M[7][7], K[7][7] = {}, G[6][7] = {};
    mass(q, M);
    for (int i = 0; i < 7; i++)
      for (int j = 0; j < 7; j++) K[i][j] = sa * M[i][j];
    addMassGradient(q, a, K);
    addForceGradient(q, v, sv, K);
    for (const Term &t : terms()) {
      const double g = t.slope(q), h = t.curvature(q) * q[7 + t.row];
      G[t.row][t.i] += g;
      K[t.i][t.i] += h;
      if (t.j < 0) continue;
      G[t.row][t.j] += g;
      K[t.j][t.j] += h;
      K[t.i][t.j] += h;
      K[t.j][t.i] += h;
    }
    static const int block[13][2] = {{BE, BE}, {BE, TH}, {TH, BE}, {TH, TH}, {GA, GA}, {PH, PH}, {PH, DE},
                                     {DE, PH}, {DE, DE}, {OM, OM}, {OM, EP}, {EP, OM}, {EP, EP}};
    static const int loop[22][2]  = {{0, BE}, {0, TH}, {0, GA}, {1, BE}, {1, TH}, {1, GA}, {2, BE}, {2, TH},
                                     {2, PH}, {2, DE}, {3, BE}, {3, TH}, {3, PH}, {3, DE}, {4, BE}, {4, TH},
                                     {4, OM}, {4, EP}, {5, BE}, {5, TH}, {5, OM}, {5, EP}};
    for (const auto &b : block) J.add(b[0], b[1], K[b[0]][b[1]]);
    for (const auto &l : loop) {
      J.add(7 + l[0], l[1], G[l[0]][l[1]]);
      J.add(l[1], 7 + l[0], G[l[0]][l[1]]);
    }
  }

  bool reference(double t, double *u, double *v, double *a) const override
  {
    for (const Row &r : table()) {
      if (std::abs(t - r.t) > 1e-13) continue;
      setUnknown(u, v, a);
      std::copy_n(r.q, 7, u);
      std::copy_n(r.lambda, 6, u + 7);
      std::copy_n(r.v, 7, v);
      std::copy_n(r.a, 7, a);
      return true;
    }
    return false;
  }

  std::vector<double> referenceTimes() const override
  {
    std::vector<double> times;
    for (const Row &r : table())
      if (r.t <= t1) times.push_back(r.t);
    return times;
  }

private:
  /* One term of the loop closures: amplitude times cos or sin of q_i + q_j (of q_i alone if j < 0) */
  struct Term {
    int    row;
    double amplitude;
    bool   cosine;
    int    i, j;

    double angle(const double *q) const { return q[i] + (j < 0 ? 0. : q[j]); }
    double value(const double *q) const { return amplitude * (cosine ? std::cos(angle(q)) : std::sin(angle(q))); }
    double slope(const double *q) const { return amplitude * (cosine ? -std::sin(angle(q)) : std::cos(angle(q))); }
    double curvature(const double *q) const { return -value(q); }
  };
  using Terms = Term[22];

  static const Terms &terms()
  {
    static const Terms t = {
        {0, rr, true, BE, -1},   {0, -d, true, BE, TH},   {0, -ss, false, GA, -1}, {1, rr, false, BE, -1},
        {1, -d, false, BE, TH},  {1, ss, true, GA, -1},   {2, rr, true, BE, -1},   {2, -d, true, BE, TH},
        {2, -e, false, PH, DE},  {2, -zt, true, DE, -1},  {3, rr, false, BE, -1},  {3, -d, false, BE, TH},
        {3, e, true, PH, DE},    {3, -zt, false, DE, -1}, {4, rr, true, BE, -1},   {4, -d, true, BE, TH},
        {4, -zf, true, OM, EP},  {4, -u_, false, EP, -1}, {5, rr, false, BE, -1},  {5, -d, false, BE, TH},
        {5, -zf, false, OM, EP}, {5, u_, true, EP, -1},
    };
    return t;
  }

  static void closures(const double *q, double *phi)
  {
    const double fixedPoint[6] = {xb, yb, xa, ya, xa, ya};
    for (int k = 0; k < 6; k++) phi[k] = -fixedPoint[k];
    for (const Term &t : terms()) phi[t.row] += t.value(q);
  }

  static void mass(const double *q, double M[7][7])
  {
    const double cth = std::cos(q[TH]), sph = std::sin(q[PH]), som = std::sin(q[OM]);
    for (int i = 0; i < 7; i++) std::fill_n(M[i], 7, 0.);
    M[BE][BE] = m1 * ra * ra + m2 * (rr * rr - 2. * da * rr * cth + da * da) + i1 + i2;
    M[TH][BE] = M[BE][TH] = m2 * (da * da - da * rr * cth) + i2;
    M[TH][TH]             = m2 * da * da + i2;
    M[GA][GA]             = m3 * (sa_ * sa_ + sb * sb) + i3;
    M[PH][PH]             = m4 * ee * ee + i4;
    M[DE][PH] = M[PH][DE] = m4 * (ee * ee + zt * ee * sph) + i4;
    M[DE][DE]             = m4 * (zt * zt + 2. * zt * ee * sph + ee * ee) + m5 * (ta * ta + tb * tb) + i4 + i5;
    M[OM][OM]             = m6 * zz * zz + i6;
    M[EP][OM] = M[OM][EP] = m6 * (zz * zz - u_ * zz * som) + i6;
    M[EP][EP]             = m6 * (zz * zz - 2. * u_ * zz * som + u_ * u_) + m7 * (ua * ua + ub * ub) + i6 + i7;
  }

  /* K += d(M(q) a)/dq: M depends on theta, phi and omega */
  static void addMassGradient(const double *q, const double *a, double K[7][7])
  {
    const double dth = m2 * da * rr * std::sin(q[TH]), dph = m4 * zt * ee * std::cos(q[PH]),
                 dom = -m6 * u_ * zz * std::cos(q[OM]);
    K[BE][TH] += dth * (2. * a[BE] + a[TH]);
    K[TH][TH] += dth * a[BE];
    K[PH][PH] += dph * a[DE];
    K[DE][PH] += dph * (a[PH] + 2. * a[DE]);
    K[OM][OM] += dom * a[EP];
    K[EP][OM] += dom * (a[OM] + 2. * a[EP]);
  }

  /* The spring acts on gamma alone: its generalized force and the derivative */
  static double spring(double ga, double &slope)
  {
    const double x = sd * std::cos(ga) + sc * std::sin(ga), y = sd * std::sin(ga) - sc * std::cos(ga); /* from B to D */
    const double dx = x + xb - xc, dy = y + yb - yc, L = std::hypot(dx, dy);
    const double p = -dx * y + dy * x, dp = x * x + y * y - dx * x - dy * y; /* L dL/dgamma and its derivative */
    const double F = -c0 * (L - l0) / L, dF = -c0 * l0 / (L * L * L) * p;
    slope = dF * p + F * dp;
    return F * p;
  }

  static void forces(const double *q, const double *v, double *Q)
  {
    const double kth = m2 * da * rr * std::sin(q[TH]), kph = m4 * zt * ee * std::cos(q[PH]),
                 kom = m6 * u_ * zz * std::cos(q[OM]);
    double unused;
    Q[BE] = mom - kth * v[TH] * (v[TH] + 2. * v[BE]);
    Q[TH] = kth * v[BE] * v[BE];
    Q[GA] = spring(q[GA], unused);
    Q[PH] = kph * v[DE] * v[DE];
    Q[DE] = -kph * v[PH] * (v[PH] + 2. * v[DE]);
    Q[OM] = -kom * v[EP] * v[EP];
    Q[EP] = kom * v[OM] * (v[OM] + 2. * v[EP]);
  }

  /* K -= dQ/dq + sv dQ/dq' */
  static void addForceGradient(const double *q, const double *v, double sv, double K[7][7])
  {
    const double kth = m2 * da * rr * std::sin(q[TH]), dth = m2 * da * rr * std::cos(q[TH]);
    const double kph = m4 * zt * ee * std::cos(q[PH]), dph = -m4 * zt * ee * std::sin(q[PH]);
    const double kom = m6 * u_ * zz * std::cos(q[OM]), dom = -m6 * u_ * zz * std::sin(q[OM]);
    double       slope;
    spring(q[GA], slope);
    K[GA][GA] -= slope;
    K[BE][TH] += dth * v[TH] * (v[TH] + 2. * v[BE]) + sv * kth * 2. * (v[TH] + v[BE]);
    K[BE][BE] += sv * kth * 2. * v[TH];
    K[TH][TH] -= dth * v[BE] * v[BE];
    K[TH][BE] -= sv * kth * 2. * v[BE];
    K[PH][PH] -= dph * v[DE] * v[DE];
    K[PH][DE] -= sv * kph * 2. * v[DE];
    K[DE][PH] += dph * v[PH] * (v[PH] + 2. * v[DE]) + sv * kph * 2. * (v[PH] + v[DE]);
    K[DE][DE] += sv * kph * 2. * v[PH];
    K[OM][OM] += dom * v[EP] * v[EP];
    K[OM][EP] += sv * kom * 2. * v[EP];
    K[EP][OM] -= dom * v[OM] * (v[OM] + 2. * v[EP]) + sv * kom * 2. * (v[OM] + v[EP]);
    K[EP][EP] -= sv * kom * 2. * v[OM];
  }

  struct Row {
    double t, q[7], v[7], a[7], lambda[6];
  };

  static const std::vector<Row> &table();
};

inline const std::vector<Andrews::Row> &Andrews::table()
{
  constexpr double              x    = std::numeric_limits<double>::quiet_NaN(); /* not known */
  static const std::vector<Row> rows = {
      {0.,
       {-0.0617138900142764496358948458001, 0., 0.455279819163070380255912382449, 0.222668390165885884674473185609,
        0.487364979543842550225598953530, -0.222668390165885884674473185609, 1.23054744454982119249735015568},
       {0., 0., 0., 0., 0., 0., 0.},
       {14222.4439199541138705911625887, -10666.8329399655854029433719415, 0., 0., 0., 0., 0.},
       {98.5668703962410896057654982170, -6.12268834425566265503114393122, 0., 0., 0., 0.}},
      {.005,
       {0.2110763859033, -0.2015871709341, 0.4491151900115, 0.2102507979300, 0.4887437654619, -0.2102507979300,
        1.2258667940349},
       {x, x, x, x, x, x, x},
       {x, x, x, x, x, x, x},
       {89.97110073791, 3.24243162966, -1.83316569503, 1.50842309357, -2.74337516039, -3.96463898561}},
      {.01,
       {2.1601131315315, -1.8833642311070, 0.1585167580012, -0.3286410751747, 0.5251547747977, 0.3286410751747,
        1.0684272046324},
       {x, x, x, x, x, x, x},
       {x, x, x, x, x, x, x},
       {57.02529043750, 2.96790424625, 3.21886038501, -18.17926986794, 5.15950271803, 34.24011729161}},
      {.02,
       {8.1849058896618, -7.8905053637305, 0.2095369133847, -0.2383255965959, 0.5225369171560, 0.2383255965959,
        1.0862751085999},
       {x, x, x, x, x, x, x},
       {x, x, x, x, x, x, x},
       {48.49325698175, 9.30037734573, 2.30323313129, -15.77388980797, 2.94225325452, 22.98803241924}},
      {.03,
       {15.81077119515372, -15.75637105841185, 0.04082224011964, -0.53473011634208, 0.52440996587995, 0.53473011634208,
        1.04808074104194},
       {1139.920302259106, -1424.379295177539, 11.032911910621, 19.293374105036, 0.5735699148296, -19.293374105036,
        0.3231791492492},
       {-24631.76312288, 51850.31963648, 324102.60070758, 566749.42200099, 16743.63541835, -566749.42200099,
        9826.50780154},
       {199.175348104538, -29.755309974970, 23.066543611622, 31.452725275772, 22.642494786394, 11.617392352611}},
      {.05,
       {33.825867766956, -33.583431517465, 0.113395073812, -0.407852865602, 0.526060444917, 0.407852865602,
        1.056902429435},
       {x, x, x, x, x, x, x},
       {x, x, x, x, x, x, x},
       {x, x, x, x, x, x}},
  };
  return rows;
}

} // namespace hhtex

#endif
