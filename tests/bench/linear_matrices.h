/*
  Newton matrices [M Phi_q^T; Phi_q 0] of a few families, symmetric and indefinite, for measurements and tests of the
  linear solvers: planar chains, chains of bodies with dense modal blocks, elastic blocks of bricks.
*/
#ifndef HHTDAE_BENCH_LINEAR_MATRICES_H
#define HHTDAE_BENCH_LINEAR_MATRICES_H

#include "../../examples/elasticblock_brick.h"
#include <cmath>
#include <petscmat.h>
#include <vector>

struct Triplets {
  PetscInt                 n = 0;
  std::vector<PetscInt>    row, col;
  std::vector<PetscScalar> val;

  void add(PetscInt i, PetscInt j, double v)
  {
    row.push_back(i);
    col.push_back(j);
    val.push_back(v);
  }
  void add_symmetric(PetscInt i, PetscInt j, double v)
  {
    add(i, j, v);
    if (i != j) add(j, i, v);
  }
};

/* Entries at the same position are added */
inline PetscErrorCode create_matrix(const Triplets &e, Mat *A)
{
  std::vector<PetscInt> row = e.row, col = e.col; /* copied, because PETSc sorts them in place */

  PetscFunctionBegin;
  PetscCall(MatCreate(PETSC_COMM_SELF, A));
  PetscCall(MatSetSizes(*A, e.n, e.n, e.n, e.n));
  PetscCall(MatSetType(*A, MATSEQAIJ));
  PetscCall(MatSetPreallocationCOO(*A, (PetscCount)e.row.size(), row.data(), col.data()));
  PetscCall(MatSetValuesCOO(*A, e.val.data(), INSERT_VALUES));
  PetscFunctionReturn(0);
}

/*
  Bodies hang one below the other; each has x, y, an angle and `modes` modal coordinates that are coupled densely with
  the other three, and a revolute joint (two multipliers) to the body before. Unknowns: all coordinates, then all
  multipliers.
*/
inline Triplets chain(PetscInt bodies, PetscInt modes)
{
  const PetscInt size = 3 + modes;
  Triplets        e;
  e.n = bodies * (size + 2);
  for (PetscInt b = 0; b < bodies; ++b) {
    const PetscInt q = b * size, before = q - size, lambda = bodies * size + 2 * b;
    for (PetscInt i = 0; i < size; ++i) {
      e.add(q + i, q + i, 2.0 + 0.1 * (i % 7));
      for (PetscInt j = 0; j < i && modes; ++j) e.add_symmetric(q + i, q + j, 0.3 / (1 + i + j));
    }
    for (PetscInt d = 0; d < 2; ++d) {
      e.add_symmetric(q + d, lambda + d, 1.0);
      if (b) e.add_symmetric(before + d, lambda + d, -1.0);
      for (PetscInt i = 2; i < size; ++i) {
        e.add_symmetric(q + i, lambda + d, 0.5 + 0.1 * d + 0.01 * (b % 9) / i);
        if (b) e.add_symmetric(before + i, lambda + d, 0.4 - 0.1 * d + 0.01 * (b % 5) / i);
      }
    }
  }
  return e;
}

/* Bodies in space, each connected to the one before by a revolute joint: position and three angles per body, with 3 x
   3 blocks for mass and inertia; per joint three multipliers for its point and two for its axis. As in a moving chain
   no two bodies have the same orientation. loops > 0: spherical joints close a ring after every so many bodies.
   Unknowns: all coordinates, then all multipliers */
inline Triplets spatial_chain(PetscInt bodies, PetscInt loops = 0)
{
  Triplets    e;
  const auto joint = [&e](PetscInt first, PetscInt second, PetscInt rows) {
    const PetscInt body[2] = {first, second};
    for (PetscInt d = 0; d < rows; ++d) {
      const PetscInt lambda = e.n++;
      for (int s = 0; s < 2; ++s) {
        if (body[s] < 0) continue;
        const PetscInt q    = 6 * body[s];
        const double   sign = s ? 1.0 : -1.0;
        if (d < 3) e.add_symmetric(lambda, q + d, sign);
        for (PetscInt a = 0; a < 3; ++a)
          e.add_symmetric(lambda, q + 3 + a, sign * 0.5 * std::cos((1.0 + 0.6 * d) * (a + 1.0) + 0.7 * (double)body[s] + s));
      }
    }
  };
  e.n = 6 * bodies;
  for (PetscInt b = 0; b < bodies; ++b)
    for (PetscInt i = 0; i < 3; ++i)
      for (PetscInt j = 0; j < 3; ++j) {
        e.add(6 * b + i, 6 * b + j, i == j ? 2.0 : 0.0);
        e.add(6 * b + 3 + i, 6 * b + 3 + j, i == j ? 0.4 + 0.1 * (double)i : 0.05 * std::sin((double)(b + i + j)));
      }
  for (PetscInt b = 0; b < bodies; ++b) joint(b - 1, b, 5);
  for (PetscInt b = 0; loops > 0 && b + loops <= bodies; b += loops) joint(b, b + loops - 1, 3);
  return e;
}

/* nx * ny * nz cubic bricks, M + beta h^2 K; if clamped, the face x = 0 is held by three multipliers per node */
inline Triplets block(PetscInt nx, PetscInt ny, PetscInt nz, bool clamped)
{
  using namespace elasticblock;
  const PetscInt NX = nx + 1, NY = ny + 1, NZ = nz + 1;
  const double   h[3] = {1.0 / nx, 1.0 / nx, 1.0 / nx}, stiffness = 0.075;
  BrickMatrix    K, M;
  Triplets        e;
  brick_matrices({1.0, 0.3, 1.0}, h, false, K, M);
  e.n = 3 * NX * NY * NZ;
  for (PetscInt k = 0; k < nz; ++k)
    for (PetscInt j = 0; j < ny; ++j)
      for (PetscInt i = 0; i < nx; ++i)
        for (int a = 0; a < DOFS; ++a)
          for (int b = 0; b < DOFS; ++b) {
            const auto dof = [&](int c) {
              const int node = c / 3;
              return 3 * (i + (node & 1) + NX * (j + ((node >> 1) & 1) + NY * (k + (node >> 2)))) + c % 3;
            };
            e.add(dof(a), dof(b), (M[a * DOFS + b] + stiffness * K[a * DOFS + b]) / (h[0] * h[1] * h[2]));
          }
  for (PetscInt node = 0; clamped && node < NY * NZ; ++node)
    for (PetscInt d = 0; d < 3; ++d) e.add_symmetric(3 * NX * node + d, e.n++, 1.0);
  return e;
}

#endif
