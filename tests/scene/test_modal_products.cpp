/* Products and sums of a flexible body's quadratic invariants computed from their packed halves, against dense matrices */
#include "scene/modal_products.h"
#include <gtest/gtest.h>

using namespace hhtdae;

namespace
{

using Quadratic = std::array<Eigen::MatrixXd, 6>;

/* The first three are symmetric; their sum is the identity if `orthonormal` */
Quadratic invariants(int m, bool orthonormal)
{
  Quadratic N;
  for (Eigen::MatrixXd &M : N) M = Eigen::MatrixXd::Random(m, m);
  for (int c = 0; c < 3; c++) N[c] = (N[c] + N[c].transpose()).eval();
  if (orthonormal) N[2] = Eigen::MatrixXd::Identity(m, m) - N[0] - N[1];
  return N;
}

/* N_cd */
Eigen::MatrixXd entry(const Quadratic &N, int c, int d)
{
  if (c == d) return N[c];
  return d == (c + 1) % 3 ? N[3 + c] : Eigen::MatrixXd(N[3 + d].transpose());
}

} // namespace

TEST(ModalProducts, WithVectors)
{
  for (bool orthonormal : {true, false})
    for (int m : {1, 3, 4, 5, 8, 18, 33}) {
      const Quadratic     N = invariants(m, orthonormal);
      const ModalProducts P(m, &N);
      const int           n = ModalProducts::padded(m);
      Eigen::MatrixXd     x = Eigen::MatrixXd::Zero(n, 2), y = Eigen::MatrixXd::Zero(n, 18);
      x.topRows(m)          = Eigen::MatrixXd::Random(m, 2);
      const ModalProducts::Task task[2] = {{x.data(), y.data(), y.data() + 6 * n}, {x.data() + n, nullptr, y.data() + 15 * n}};
      P.apply(task, 2);
      for (int c = 0; c < 3; c++) {
        const int             d    = (c + 1) % 3;
        const Eigen::MatrixXd sum  = 0.5 * (entry(N, c, d) + entry(N, d, c)), skew = 0.5 * (entry(N, c, d) - entry(N, d, c));
        EXPECT_LT((y.col(c).head(m) - N[c] * x.col(0).head(m)).norm(), 1e-13 * m) << m;
        EXPECT_LT((y.col(3 + c).head(m) - sum * x.col(0).head(m)).norm(), 1e-13 * m) << m;
        EXPECT_LT((y.col(6 + c).head(m) - skew * x.col(0).head(m)).norm(), 1e-13 * m) << m;
        EXPECT_LT((y.col(15 + c).head(m) - skew * x.col(1).head(m)).norm(), 1e-13 * m) << m;
      }
      EXPECT_EQ(y.middleCols(9, 6).norm(), 0) << "not asked for";
    }
}

TEST(ModalProducts, WithShapes)
{
  for (int columns : {0, 1, 6, 13})
    for (int m : {1, 4, 18, 33}) {
      const int       n = ModalProducts::padded(m);
      Eigen::MatrixXd A = Eigen::MatrixXd::Random(n, columns), x = Eigen::MatrixXd::Random(n, 2), y(columns, 2), z(columns, 1), back(n, 1);
      const double   *in[2]  = {x.data(), x.data() + n};
      double         *out[2] = {y.data(), y.data() + columns};
      ModalProducts::transposedTimes(n, columns, A.data(), in, out);
      ModalProducts::transposedTimes(n, columns, A.data(), x.data(), z.data());
      EXPECT_LT((y - A.transpose() * x).norm(), 1e-13 * n);
      EXPECT_LT((z - A.transpose() * x.col(0)).norm(), 1e-13 * n);
      ModalProducts::times(n, columns, A.data(), z.data(), back.data());
      EXPECT_LT((back - A * z).norm(), 1e-12 * n);
    }
}

TEST(ModalProducts, SumsWithOuterProducts)
{
  const Eigen::Matrix3d L = Eigen::Matrix3d::Random();
  for (int rank : {0, 2, 9})
    for (int m : {1, 3, 4, 5, 8, 18, 33}) {
      const Quadratic N    = invariants(m, rank > 0);
      const int       n    = ModalProducts::padded(m), ld = n + 6;
      Eigen::MatrixXd left = Eigen::MatrixXd::Random(n, rank), Q = Eigen::MatrixXd::Random(rank, rank);
      Q                    = (Q + Q.transpose()).eval();
      const Eigen::MatrixXd right = left * Q;
      for (bool quadratic : {true, false}) {
        const ModalProducts P(m, quadratic ? &N : nullptr);
        Eigen::MatrixXd     out = Eigen::MatrixXd::Zero(ld, n), sum = (left * right.transpose()).topLeftCorner(m, m);
        P.combine(L, left.data(), right.data(), rank, out.data(), ld);
        for (int c = 0; c < 3 && quadratic; c++)
          for (int d = 0; d < 3; d++) sum += L(c, d) * entry(N, c, d);
        EXPECT_LT((out.topLeftCorner(m, m).transpose() - sum).norm(), 1e-13 * m * (1 + rank)) << m << " modes, rank " << rank;
      }
    }
}
