/* A problem with a symmetric Newton matrix, and runs whose matrix stores one triangle */
#ifndef HHTDAE_TESTS_TRIANGLE_H
#define HHTDAE_TESTS_TRIANGLE_H

#include "support.h"

namespace hhtest
{

/* Ten point masses in space connected by springs; six rods of fixed length connect pairs of masses, or a mass and the
   ground: 36 unknowns. The last rod may be present twice, or all rods may be left out */
enum class NetRods { Independent, Redundant, None };

struct Net : Problem {
  struct Link {
    int    i, j; /* -1: an anchor */
    double x[3], length;
  };
  std::vector<Link> spring, rod;
  double            k = 300, c = 0.4, start[30];

  explicit Net(NetRods rods = NetRods::Independent)
  {
    name = "net";
    t1   = 0.5;
    n    = rods == NetRods::None ? 30 : 36;
    for (int i = 0; i < 10; i++)
      for (int d = 0; d < 3; d++) start[3 * i + d] = d == 0 ? i : 0.4 * std::sin(1. + 2.3 * i + 1.7 * d);
    for (int i = 0; i < 10; i++) {
      link(spring, i, -1, 1.1);
      if (i + 2 < 10) link(spring, i, i + 2, 0.9);
    }
    for (int i = 0; i < 10 && rods != NetRods::None; i += 2) link(rod, i, i + 1, 1);
    if (rods == NetRods::Redundant) link(rod, 8, 9, 1);
    if (rods == NetRods::Independent) link(rod, 0, -1, 1);
    role.assign(30, TSHHT3_COORDINATE);
    role.resize(n, TSHHT3_HOLONOMIC);
  }

  void initial(double *u, double *v) const override
  {
    std::fill(u, u + n, 0.);
    std::fill(v, v + n, 0.);
    std::copy(start, start + 30, u);
  }

  void residual(double, const double *u, const double *v, const double *a, double *f) const override
  {
    for (int i = 0; i < 30; i++) f[i] = (1 + 0.1 * (i / 3)) * (a[i] + (i % 3 == 2 ? 9.81 : 0)) + c * v[i];
    for (const Link &s : spring) {
      double       d[3];
      const double l = between(s, u, d), p = k * (1 - s.length / l);
      pull(s, p, d, f);
    }
    for (size_t r = 0; r < rod.size(); r++) {
      double       d[3];
      const double l = between(rod[r], u, d);
      f[30 + r]      = 0.5 * (l * l - rod[r].length * rod[r].length);
      pull(rod[r], u[30 + r], d, f);
    }
  }

  void jacobian(double, const double *u, const double *, const double *, double sv, double sa, Entries &J) const override
  {
    for (int i = 0; i < 30; i++) J.add(i, i, sa * (1 + 0.1 * (i / 3)) + sv * c);
    for (const Link &s : spring) {
      double       d[3];
      const double l = between(s, u, d), p = k * (1 - s.length / l), q = k * s.length / (l * l * l);
      stiffness(s, p, q, d, J);
    }
    for (size_t r = 0; r < rod.size(); r++) {
      double         d[3];
      const PetscInt row = 30 + (PetscInt)r;
      between(rod[r], u, d);
      stiffness(rod[r], u[row], 0, d, J);
      for (int e = 0; e < 2; e++)
        for (int b = 0, end = e ? rod[r].j : rod[r].i; b < 3 && end >= 0; b++) {
          J.add(row, 3 * end + b, e ? -d[b] : d[b]);
          J.add(3 * end + b, row, e ? -d[b] : d[b]);
        }
    }
  }

private:
  /* adds a link whose rest length is its initial length times `factor`; an anchor is at (0.3, 1, 0.5) from the point */
  void link(std::vector<Link> &to, int i, int j, double factor)
  {
    Link   s{i, j, {start[3 * i] + 0.3, start[3 * i + 1] + 1, start[3 * i + 2] + 0.5}, 0};
    double d[3];
    s.length = factor * between(s, start, d);
    to.push_back(s);
  }
  static double between(const Link &s, const double *u, double *d)
  {
    double l = 0;
    for (int b = 0; b < 3; b++) {
      d[b] = u[3 * s.i + b] - (s.j < 0 ? s.x[b] : u[3 * s.j + b]);
      l += d[b] * d[b];
    }
    return std::sqrt(l);
  }
  static void pull(const Link &s, double p, const double *d, double *f)
  {
    for (int b = 0; b < 3; b++) {
      f[3 * s.i + b] += p * d[b];
      if (s.j >= 0) f[3 * s.j + b] -= p * d[b];
    }
  }
  static void stiffness(const Link &s, double p, double q, const double *d, Entries &J)
  {
    for (int a = 0; a < 3; a++)
      for (int b = 0; b < 3; b++) {
        const double x = (a == b ? p : 0) + q * d[a] * d[b];
        J.add(3 * s.i + a, 3 * s.i + b, x);
        if (s.j < 0) continue;
        J.add(3 * s.j + a, 3 * s.j + b, x);
        J.add(3 * s.i + a, 3 * s.j + b, -x);
        J.add(3 * s.j + a, 3 * s.i + b, -x);
      }
  }
};

/* A run with the full matrix (block 0) or with one triangle in blocks of this size, which exists before TSSetFromOptions() */
struct TriangleRun {
  Array            q, lambda;
  TSHHT3Statistics s;
  std::string      solver;
  PetscErrorCode   error;

  TriangleRun(MPI_Comm comm, const Problem &p, PetscInt block, const std::string &options, bool setRoles)
  {
    Options in(options);
    TS      ts;
    Vec     U, V;
    SNES    snes;
    KSP     ksp;
    PC      pc;
    PCType  type;
    must(ProblemCreateTS(comm, p, &ts, &U, &V, setRoles));
    if (!setRoles) must(TSSetType(ts, TSHHT3));
    if (block) give(ts, block);
    must(TSSetFromOptions(ts));
    error         = TSSolve(ts, nullptr);
    const Array u = whole(U);
    for (PetscInt i = 0; i < p.n; i++) (p.role[i] == TSHHT3_COORDINATE ? q : lambda).push_back(u[i]);
    must(TSHHT3GetStatistics(ts, &s));
    must(TSGetSNES(ts, &snes));
    must(SNESGetKSP(snes, &ksp));
    must(KSPGetPC(ksp, &pc));
    must(PCGetType(pc, &type));
    solver = type;
    must(TSDestroy(&ts));
    must(VecDestroy(&U));
    must(VecDestroy(&V));
  }

private:
  static void give(TS ts, PetscInt block)
  {
    TSI2Jacobian f;
    void        *ctx;
    Mat          A, S;
    PetscInt     n, N;
    must(TSGetI2Jacobian(ts, &A, nullptr, &f, &ctx));
    must(MatGetLocalSize(A, &n, nullptr));
    must(MatGetSize(A, &N, nullptr));
    must(MatCreateSBAIJ(PetscObjectComm((PetscObject)ts), block, n, n, N, N, n / block, nullptr, (N - n) / block, nullptr, &S));
    must(MatSetOption(S, MAT_IGNORE_LOWER_TRIANGULAR, PETSC_TRUE));
    must(TSSetI2Jacobian(ts, S, S, f, ctx));
    must(MatDestroy(&S));
  }
};

/* Equal counters; coordinates equal to rounding; multipliers to the error that the rounding of q causes */
inline void expectSame(const TriangleRun &a, const TriangleRun &b)
{
  ASSERT_EQ(a.error, 0);
  ASSERT_EQ(b.error, 0);
  EXPECT_EQ(a.s.steps, b.s.steps);
  EXPECT_EQ(a.s.rejected, b.s.rejected);
  EXPECT_EQ(a.s.newton, b.s.newton);
  EXPECT_EQ(a.s.jacobians, b.s.jacobians);
  EXPECT_EQ(a.s.factorizations, b.s.factorizations);
  EXPECT_LT(relativeDifference(a.q, b.q), 1e-12);
  if (a.lambda.empty()) return;
  EXPECT_LT(relativeDifference(a.lambda, b.lambda), 1e-7);
}

} // namespace hhtest

#endif
