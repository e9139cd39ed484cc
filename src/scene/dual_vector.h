/*
  Vectors and 3 x 3 matrices of dual numbers, with those of Eigen's member functions that kernels use, under the same names. Eigen's templates for
  dual numbers took most of the compile time of a kernel. Here products are also summed in one pass over the derivatives.
*/
#ifndef HHTDAE_SCENE_DUAL_VECTOR_H
#define HHTDAE_SCENE_DUAL_VECTOR_H

#include "hhtdae/dual.h"

namespace hhtdae
{

/* a b + c d + e f, a b - c d */
template <int N, class T>
Dual<N, T> ProductSum(const Dual<N, T> &a, const Dual<N, T> &b, const Dual<N, T> &c, const Dual<N, T> &d, const Dual<N, T> &e, const Dual<N, T> &f)
{
  Dual<N, T> r;
  const T    av = a.value(), bv = b.value(), cv = c.value(), dv = d.value(), ev = e.value(), fv = f.value();
  r.value() = av * bv + cv * dv + ev * fv;
  for (int k = 0; k < N; k++)
    r.derivatives()(k) = av * b.derivatives()(k) + bv * a.derivatives()(k) + cv * d.derivatives()(k) + dv * c.derivatives()(k) +
                         ev * f.derivatives()(k) + fv * e.derivatives()(k);
  return r;
}
template <int N, class T> Dual<N, T> ProductDifference(const Dual<N, T> &a, const Dual<N, T> &b, const Dual<N, T> &c, const Dual<N, T> &d)
{
  Dual<N, T> r;
  const T    av = a.value(), bv = b.value(), cv = c.value(), dv = d.value();
  r.value() = av * bv - cv * dv;
  for (int k = 0; k < N; k++)
    r.derivatives()(k) = av * b.derivatives()(k) + bv * a.derivatives()(k) - cv * d.derivatives()(k) - dv * c.derivatives()(k);
  return r;
}

template <class D> class DualVector
{
public:
  DualVector() = default; /* leaves the entries unset, as Eigen does */
  DualVector(const D &x, const D &y, const D &z) : x_{x, y, z} {}

  D       &operator()(int i) { return x_[i]; }
  const D &operator()(int i) const { return x_[i]; }

  void fill(const D &x) { x_[0] = x_[1] = x_[2] = x; }
  D    dot(const DualVector &y) const { return ProductSum(x_[0], y(0), x_[1], y(1), x_[2], y(2)); }
  D    squaredNorm() const { return dot(*this); }

  DualVector cross(const DualVector &y) const
  {
    return {ProductDifference(x_[1], y(2), x_[2], y(1)), ProductDifference(x_[2], y(0), x_[0], y(2)), ProductDifference(x_[0], y(1), x_[1], y(0))};
  }
  DualVector &operator+=(const DualVector &y)
  {
    for (int i = 0; i < 3; i++) x_[i] += y(i);
    return *this;
  }
  friend DualVector operator-(const DualVector &x) { return {-x(0), -x(1), -x(2)}; }
  friend DualVector operator+(const DualVector &x, const DualVector &y) { return {x(0) + y(0), x(1) + y(1), x(2) + y(2)}; }
  friend DualVector operator-(const DualVector &x, const DualVector &y) { return {x(0) - y(0), x(1) - y(1), x(2) - y(2)}; }
  friend DualVector operator*(const DualVector &x, const D &a) { return {x(0) * a, x(1) * a, x(2) * a}; }

private:
  D x_[3];
};

template <class D> class DualMatrix
{
public:
  class Transposed /* a reference to the matrix, valid within the expression that contains transpose() */
  {
  public:
    explicit Transposed(const DualMatrix &A) : A_(A) {}
    DualVector<D> operator*(const DualVector<D> &x) const { return {A_.col(0).dot(x), A_.col(1).dot(x), A_.col(2).dot(x)}; }
    DualMatrix    operator*(const DualMatrix &B) const
    {
      DualMatrix r;
      for (int j = 0; j < 3; j++) r.col(j) = *this * B.col(j);
      return r;
    }

  private:
    const DualMatrix &A_;
  };

  DualMatrix() = default;

  D                   &operator()(int i, int j) { return column_[j](i); }
  const D             &operator()(int i, int j) const { return column_[j](i); }
  DualVector<D>       &col(int j) { return column_[j]; }
  const DualVector<D> &col(int j) const { return column_[j]; }
  Transposed           transpose() const { return Transposed(*this); }

  friend DualVector<D> operator*(const DualMatrix &A, const DualVector<D> &x)
  {
    DualVector<D> r;
    for (int i = 0; i < 3; i++) r(i) = ProductSum(A(i, 0), x(0), A(i, 1), x(1), A(i, 2), x(2));
    return r;
  }
  friend DualMatrix operator*(const DualMatrix &A, const DualMatrix &B)
  {
    DualMatrix r;
    for (int j = 0; j < 3; j++) r.col(j) = A * B.col(j);
    return r;
  }

private:
  DualVector<D> column_[3];
};

} // namespace hhtdae

#endif
