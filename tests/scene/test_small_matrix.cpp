/* Matrix functions that return values instead of expressions: same numbers as Eigen, also for parts and transposes;
   large matrices are left to Eigen */
#include "scene/small_matrix.h"
#include <gtest/gtest.h>

namespace
{

using Eigen::Matrix3d;
using Eigen::MatrixXd;
using Eigen::Vector3d;

template <int R, int C> Eigen::Matrix<double, R, C> numbers(double from)
{
  Eigen::Matrix<double, R, C> A;
  for (int i = 0; i < A.size(); i++) A.data()[i] = std::sin(from + 1.7 * i);
  return A;
}

/* Copies to matrices of dynamic size, for which Eigen's own functions are used */
template <class A> MatrixXd free(const A &a) { return a; }

template <class A, class B> void same(const A &ours, const B &eigens)
{
  static_assert(std::is_same<A, Eigen::Matrix<double, A::RowsAtCompileTime, A::ColsAtCompileTime>>::value, "a matrix, not an expression");
  EXPECT_LT((free(ours) - MatrixXd(eigens)).norm(), 1e-15);
}

} // namespace

namespace hhtdae
{

TEST(SmallMatrix, NumbersOfEigen)
{
  const auto     A = numbers<3, 3>(0.3), B = numbers<3, 3>(1.1);
  const auto     G = numbers<3, 6>(2.2);
  const Vector3d a = numbers<3, 1>(0.7), b = numbers<3, 1>(4.2);
  const auto     r = numbers<1, 3>(0.1);
  same(A + B, free(A) + free(B));
  same(A - B.transpose(), free(A) - free(B).transpose());
  same(-a, -free(a));
  same(2 * a + b * 0.5 - a / 3, 2 * free(a) + free(b) * 0.5 - free(a) / 3);
  same(A * b, free(A) * free(b));
  same(A.transpose() * B, free(A).transpose() * free(B));
  same(A * G, free(A) * free(G));
  same(a * b.transpose(), free(a) * free(b).transpose());
  same(r * A, free(r) * free(A));
  same(Matrix3d::Identity() - a * a.transpose(), MatrixXd::Identity(3, 3) - free(a) * free(a).transpose());
  same(A.col(1) + G.block<3, 1>(0, 4), free(A).col(1) + free(G).col(4));
  same(A * G.middleCols<2>(1), free(A) * free(G).middleCols(1, 2));
  same(Eigen::Map<const Vector3d>(G.data() + 3) * 4, free(G).col(1) * 4);
  const Eigen::Matrix<double, 6, 1> six = numbers<6, 1>(0.2);
  same(six.head<3>() - six.tail<3>(), free(six).topRows(3) - free(six).bottomRows(3));
}

/* a = A a: the product is computed before a is written */
TEST(SmallMatrix, GoesIntoItsOperands)
{
  const Matrix3d A = numbers<3, 3>(0.3);
  Vector3d       a = numbers<3, 1>(0.7);
  const MatrixXd y = free(A) * free(a);
  a.noalias()      = A * a;
  EXPECT_LT((free(a) - y).norm(), 1e-15);
}

TEST(SmallMatrix, LargeOnesAreEigens)
{
  using Large = Eigen::Matrix<double, 12, 12>;
  static_assert(!std::is_same<decltype(Large() + Large()), Large>::value, "an expression");
  static_assert(!std::is_same<decltype(MatrixXd() * MatrixXd()), MatrixXd>::value, "an expression");
  static_assert(!std::is_same<decltype(Eigen::Matrix3f() + Eigen::Matrix3f()), Eigen::Matrix3f>::value, "an expression");
}

} // namespace hhtdae
