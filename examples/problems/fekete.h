/*
  Fekete points (IVP test set, index 2 there): N points on the unit sphere that repel one another, with friction, until they rest
  where the product of their distances is largest (elliptic Fekete points; W.J.H. Stortelder, J.J.B. de Swart, J.D. Pintér, "Finding
  elliptic Fekete points sets: two numerical solution approaches", J. Comput. Appl. Math. 130, 2001).

    p_i'' + alpha p_i' - sum_j (p_i - p_j)/|p_i - p_j|^2 + 2 p_i lambda_i = 0
    |p_i|^2 - 1 = 0                                lambda is minus that of the test set

  Reference at t = 1000: the test set's (RADAU5 at 1e-12), when all is at rest.
*/
#ifndef HHTEX_FEKETE_H
#define HHTEX_FEKETE_H

#include "../problem.h"

#include <algorithm>
#include <cmath>

namespace hhtex
{

struct Fekete : Problem {
  static constexpr int points = 20;
  const double         alpha  = 0.5;

  Fekete()
  {
    name = "fekete";
    n    = 4 * points;
    t1   = 1000.;
    role.assign((size_t)n, TSHHT3_COORDINATE);
    std::fill(role.begin() + 3 * points, role.end(), TSHHT3_HOLONOMIC);
  }

  /* Four circles of latitude */
  void initial(double *u, double *v) const override
  {
    const double pi       = std::acos(-1.);
    const int    count[4] = {3, 7, 6, 4};
    const double first[4] = {pi / 13, pi / 29, pi / 7, pi / 17}, latitude[4] = {3 * pi / 8, pi / 8, -2 * pi / 15, -3 * pi / 10};
    std::fill_n(u, n, 0.);
    std::fill_n(v, n, 0.);
    for (int circle = 0, point = 0; circle < 4; circle++)
      for (int k = 0; k < count[circle]; k++, point++) {
        /* the last circle begins with its first multiple of the angle at 0, the others at 1 */
        const double a = 2 * pi * (circle == 3 ? k : k + 1) / count[circle] + first[circle], b = latitude[circle];
        u[3 * point]     = std::cos(a) * std::cos(b);
        u[3 * point + 1] = std::sin(a) * std::cos(b);
        u[3 * point + 2] = std::sin(b);
      }
  }

  void residual(double, const double *u, const double *v, const double *a, double *f) const override
  {
    const double *lambda = u + 3 * points;
    for (int i = 0; i < 3 * points; i++) f[i] = a[i] + alpha * v[i] + 2 * u[i] * lambda[i / 3];
    for (int i = 0; i < points; i++) {
      const double *p   = u + 3 * i;
      f[3 * points + i] = p[0] * p[0] + p[1] * p[1] + p[2] * p[2] - 1;
      for (int j = 0; j < i; j++) {
        double d[3], r2 = 0;
        for (int k = 0; k < 3; k++) d[k] = p[k] - u[3 * j + k], r2 += d[k] * d[k];
        for (int k = 0; k < 3; k++) f[3 * i + k] -= d[k] / r2, f[3 * j + k] += d[k] / r2;
      }
    }
  }

  void jacobian(double, const double *u, const double *, const double *, double sv, double sa, Entries &J) const override
  {
    const double *lambda = u + 3 * points;
    for (int i = 0; i < points; i++)
      for (int k = 0; k < 3; k++) {
        J.add(3 * i + k, 3 * i + k, sa + alpha * sv + 2 * lambda[i]);
        J.add(3 * i + k, 3 * points + i, 2 * u[3 * i + k]);
        J.add(3 * points + i, 3 * i + k, 2 * u[3 * i + k]);
      }
    for (int i = 0; i < points; i++)
      for (int j = 0; j < i; j++) addPair(i, j, u, J);
  }

  bool reference(double t, double *u, double *v, double *a) const override
  {
    static const double end[3 * points] = {
        -0.4070263380333202, 0.3463758772791802, 0.8451942450030429, 0.07752934752521549, -0.2628662719972299, 0.9617122871829146,
        0.7100577833343567, 0.1212948055586120, 0.6936177005172217, 0.2348267744557627, 0.7449277976923311, 0.6244509285956391,
        -0.4341114738782885, 0.8785430442262876, 0.1992720444237660, -0.9515059600312596, 0.2203508762787005, 0.2146669498274008,
        -0.6385191643609878, -0.4310833259390688, 0.6375425027722121, -0.1464175087914336, -0.9380871635228862, 0.3139337298744690,
        0.5666974065069942, -0.6739221885076542, 0.4740073135462156, 0.9843259538440293, -0.1696995357819996, -0.04800504290609090,
        0.1464175087914331, 0.9380871635228875, -0.3139337298744656, -0.7092757549979014, 0.5264062637139616, -0.4688542938854929,
        -0.8665731819284478, -0.4813878059756024, -0.1315929352982178, -0.2347897778700538, -0.8594340408013130, -0.4541441287957579,
        0.5530976940074118, -0.7674370265615124, -0.3242273140037833, 0.7711050969896927, 0.6357041816577034, 0.03573685519777001,
        0.7103951209379591, 0.2403570431280519, -0.6614886725910596, -0.03038208738735660, 0.4501923293640461, -0.8924145871442046,
        -0.5772996158107093, -0.1766763414971813, -0.7971892020969544, 0.2414481766969039, -0.3416456818373135, -0.9082846503446250};
    setUnknown(u, v, a);
    if (t == t0) {
      initial(u, v);
      std::fill(u + 3 * points, u + n, std::nan(""));
      return true;
    }
    if (t != t1) return false;
    std::copy_n(end, 3 * points, u);
    std::fill_n(v, 3 * points, 0.);
    std::fill_n(a, 3 * points, 0.);
    return true;
  }

  std::vector<double> referenceTimes() const override { return {t0, t1}; }

private:
  /* of -d/r^2 on the row of i and d/r^2 on that of j, d = p_i - p_j */
  static void addPair(int i, int j, const double *u, Entries &J)
  {
    double d[3], r2 = 0;
    for (int k = 0; k < 3; k++) d[k] = u[3 * i + k] - u[3 * j + k], r2 += d[k] * d[k];
    for (int k = 0; k < 3; k++)
      for (int l = 0; l < 3; l++) {
        const double s = ((k == l) - 2 * d[k] * d[l] / r2) / r2;
        J.add(3 * i + k, 3 * i + l, -s);
        J.add(3 * j + k, 3 * j + l, -s);
        J.add(3 * i + k, 3 * j + l, s);
        J.add(3 * j + k, 3 * i + l, s);
      }
  }
};

} // namespace hhtex

#endif
