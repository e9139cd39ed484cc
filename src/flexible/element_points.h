/*
  The internal force of a St. Venant-Kirchhoff element, four integration points at a time. It dominates the residual of a whole finite-element body.

  With J = X d^T and H = u d^T (d: derivatives of the shape functions by natural coordinates), D = H J^-1 is du/dX, F = 1 + D, P = w F S the first Piola-Kirchhoff stress times weight and
  det J, and (P J^-T) d the point's contribution to the force. Each quantity is a vector over four points; a rule is padded with points of weight zero.
*/
#ifndef HHTDAE_FLEXIBLE_ELEMENT_POINTS_H
#define HHTDAE_FLEXIBLE_ELEMENT_POINTS_H

#include "flexible/element_shapes.h"
#include <algorithm>

namespace hhtdae
{
namespace fe
{

#define HHTDAE_INLINE inline __attribute__((always_inline))

typedef double Four __attribute__((vector_size(32), aligned(8), may_alias));

/* Derivatives of the shape functions and weights at the points of a rule, computed once */
template <class Shape, class Rule> struct PointTable {
  static constexpr int groups = (Rule::count + 3) / 4;
  Four                 d[groups][Shape::nodes][3], weight[groups];

  static const PointTable &get()
  {
    static const PointTable table;
    return table;
  }

private:
  PointTable()
  {
    const Points<Rule::count> points = Rule::points();
    for (int q = 0; q < 4 * groups; q++) {
      const int               p = std::min(q, Rule::count - 1);
      Gradients<Shape::nodes> g;
      Shape::gradient(points.at[p], g);
      weight[q / 4][q % 4] = q < Rule::count ? points.weight[p] : 0;
      for (int i = 0; i < Shape::nodes; i++)
        for (int k = 0; k < 3; k++) d[q / 4][i][k][q % 4] = g(k, i);
    }
  }
};

/* Inverse of J by cofactors; zero where the determinant is zero */
HHTDAE_INLINE void Invert(const Four (&J)[3][3], Four (&inverse)[3][3], Four *det)
{
  Four c[3][3];
  for (int i = 0; i < 3; i++)
    for (int j = 0; j < 3; j++) {
      const int k = (i + 1) % 3, l = (i + 2) % 3, m = (j + 1) % 3, n = (j + 2) % 3;
      c[j][i] = J[k][m] * J[l][n] - J[k][n] * J[l][m];
    }
  *det = J[0][0] * c[0][0] + J[0][1] * c[1][0] + J[0][2] * c[2][0];
  const Four zero = *det * 0, over = *det != 0 ? 1 / *det : zero;
  for (int i = 0; i < 3; i++)
    for (int j = 0; j < 3; j++) inverse[i][j] = c[i][j] * over;
}

/* P = w F S for the displacement gradient D; energy: w times the energy density */
HHTDAE_INLINE void Stress(const Four (&D)[3][3], double lambda, double mu, const Four &w, Four (&P)[3][3], Four *energy)
{
  Four E[3][3], S[3][3], trace, square;
  for (int i = 0; i < 3; i++)
    for (int j = i; j < 3; j++) E[i][j] = E[j][i] = (D[i][j] + D[j][i] + (D[0][i] * D[0][j] + D[1][i] * D[1][j] + D[2][i] * D[2][j])) * 0.5;
  trace  = E[0][0] + E[1][1] + E[2][2];
  square = trace * 0;
  for (int i = 0; i < 3; i++)
    for (int j = 0; j < 3; j++) {
      S[i][j] = w * (2 * mu * E[i][j] + (i == j ? lambda * trace : trace * 0));
      square += E[i][j] * E[i][j];
    }
  *energy = w * (lambda / 2 * trace * trace + mu * square);
  for (int i = 0; i < 3; i++)
    for (int j = 0; j < 3; j++) P[i][j] = S[i][j] + (D[i][0] * S[0][j] + D[i][1] * S[1][j] + D[i][2] * S[2][j]);
}

template <class Shape>
HHTDAE_INLINE double ForceOfPoints(const double *X, const double *u, double lambda, double mu, double *force, double *energy)
{
  using Rule          = typename Shape::StiffnessRule;
  constexpr int n     = Shape::nodes;
  const auto   &table = PointTable<Shape, Rule>::get();
  const Four    zero  = {0, 0, 0, 0};
  Four          f[n][3], all = zero;
  double        least = std::numeric_limits<double>::infinity();
  for (int i = 0; i < n; i++)
    for (int c = 0; c < 3; c++) f[i][c] = zero;
  for (int g = 0; g < table.groups; g++) {
    Four J[3][3], H[3][3], inverse[3][3], D[3][3], P[3][3], det, e;
    for (int c = 0; c < 3; c++)
      for (int k = 0; k < 3; k++) J[c][k] = H[c][k] = zero;
    for (int i = 0; i < n; i++)
      for (int c = 0; c < 3; c++)
        for (int k = 0; k < 3; k++) J[c][k] += table.d[g][i][k] * X[3 * i + c];
    for (int i = 0; i < n; i++)
      for (int c = 0; c < 3; c++)
        for (int k = 0; k < 3; k++) H[c][k] += table.d[g][i][k] * u[3 * i + c];
    Invert(J, inverse, &det);
    for (int q = 0; q < 4; q++)
      if (!(det[q] >= least)) least = det[q]; /* keeps NaN, too */
    for (int c = 0; c < 3; c++)
      for (int k = 0; k < 3; k++) D[c][k] = H[c][0] * inverse[0][k] + H[c][1] * inverse[1][k] + H[c][2] * inverse[2][k];
    Stress(D, lambda, mu, (det > 0 ? det : zero) * table.weight[g], P, &e);
    all += e;
    Four T[3][3];
    for (int c = 0; c < 3; c++)
      for (int k = 0; k < 3; k++) T[c][k] = P[c][0] * inverse[k][0] + P[c][1] * inverse[k][1] + P[c][2] * inverse[k][2];
    for (int i = 0; i < n; i++)
      for (int c = 0; c < 3; c++) f[i][c] += T[c][0] * table.d[g][i][0] + T[c][1] * table.d[g][i][1] + T[c][2] * table.d[g][i][2];
  }
  for (int i = 0; i < n; i++)
    for (int c = 0; c < 3; c++) force[3 * i + c] = (f[i][c][0] + f[i][c][1]) + (f[i][c][2] + f[i][c][3]);
  *energy = (all[0] + all[1]) + (all[2] + all[3]);
  return least;
}

#if defined(__x86_64__) && defined(__GNUC__)
/* Compiled for AVX2; without fused multiplications results are the same to the last digit */
template <class Shape> __attribute__((target("avx2"))) double ForceOfPointsAVX2(const double *X, const double *u, double lambda, double mu, double *force, double *energy)
{
  return ForceOfPoints<Shape>(X, u, lambda, mu, force, energy);
}
#endif

/* X, u, force: three components of each node. Returns the smallest determinant of J. */
template <class Shape> double InternalForce(const double *X, const double *u, double lambda, double mu, double *force, double *energy)
{
#if defined(__x86_64__) && defined(__GNUC__)
  static const bool has_avx2 = __builtin_cpu_supports("avx2");
  if (has_avx2) return ForceOfPointsAVX2<Shape>(X, u, lambda, mu, force, energy);
#endif
  return ForceOfPoints<Shape>(X, u, lambda, mu, force, energy);
}

} // namespace fe
} // namespace hhtdae

#endif
