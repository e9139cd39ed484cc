/*
  Stiffness and mass of one 8-node brick with edges hx, hy, hz along the axes, linear isotropic elasticity, 2x2x2 Gauss
  points. On a structured grid all bricks are congruent: both matrices are computed once and added everywhere.
*/
#ifndef HHTDAE_EXAMPLES_ELASTICBLOCK_BRICK_H
#define HHTDAE_EXAMPLES_ELASTICBLOCK_BRICK_H

#include <array>
#include <cmath>

namespace elasticblock
{

constexpr int NODES = 8, DOFS = 24;

using BrickMatrix = std::array<double, DOFS * DOFS>; /* row-major; degree of freedom 3*node + direction */

struct Material {
  double E, nu, rho; /* Young's modulus [Pa], Poisson's ratio, density [kg/m^3] */
};

/* Corner `node` has natural coordinate +1 or -1 along `axis`; node = i + 2 j + 4 k on the grid */
inline double corner(int node, int axis) { return (node >> axis) & 1 ? 1.0 : -1.0; }

/* Shape functions and their derivatives with respect to x, y, z at natural coordinates s */
inline void brick_shapes(const double h[3], const double s[3], double N[NODES], double dN[NODES][3])
{
  for (int a = 0; a < NODES; ++a) {
    double f[3];
    for (int d = 0; d < 3; ++d) f[d] = 0.5 * (1.0 + corner(a, d) * s[d]);
    N[a] = f[0] * f[1] * f[2];
    for (int d = 0; d < 3; ++d) dN[a][d] = corner(a, d) / h[d] * f[(d + 1) % 3] * f[(d + 2) % 3];
  }
}

/* Adds w * (grad v : C : grad u) for isotropic C; (K_ab)_ij = lambda a_i b_j + mu a_j b_i + mu delta_ij a.b */
inline void brick_add_stiffness(const Material &m, const double dN[NODES][3], double w, BrickMatrix &K)
{
  const double lambda = m.E * m.nu / ((1 + m.nu) * (1 - 2 * m.nu)), mu = 0.5 * m.E / (1 + m.nu);
  for (int a = 0; a < NODES; ++a)
    for (int b = 0; b < NODES; ++b) {
      const double dot = dN[a][0] * dN[b][0] + dN[a][1] * dN[b][1] + dN[a][2] * dN[b][2];
      for (int i = 0; i < 3; ++i)
        for (int j = 0; j < 3; ++j)
          K[(3 * a + i) * DOFS + 3 * b + j] +=
              w * (lambda * dN[a][i] * dN[b][j] + mu * dN[a][j] * dN[b][i] + (i == j ? mu * dot : 0.0));
    }
}

/* Consistent mass, or the same mass lumped on the diagonal by row sums */
inline void brick_add_mass(const Material &m, const double N[NODES], double w, bool lumped, BrickMatrix &M)
{
  for (int a = 0; a < NODES; ++a)
    for (int b = 0; b < NODES; ++b)
      for (int i = 0; i < 3; ++i) M[(3 * a + i) * DOFS + 3 * (lumped ? a : b) + i] += w * m.rho * N[a] * N[b];
}

inline void brick_matrices(const Material &m, const double h[3], bool lumped, BrickMatrix &K, BrickMatrix &M)
{
  const double g = 1.0 / std::sqrt(3.0), w = h[0] * h[1] * h[2] / 8;
  double       N[NODES], dN[NODES][3];
  K.fill(0.0);
  M.fill(0.0);
  for (int q = 0; q < NODES; ++q) {
    const double s[3] = {g * corner(q, 0), g * corner(q, 1), g * corner(q, 2)};
    brick_shapes(h, s, N, dN);
    brick_add_stiffness(m, dN, w, K);
    brick_add_mass(m, N, w, lumped, M);
  }
}

} // namespace elasticblock
#endif
