/*
  operator* for matrices with a size known only at run time: it calls BLAS and returns a matrix instead of an expression.
  Within this namespace it is found in place of Eigen's, whose templates compile separate code for every combination of
  operands in every source file. BLAS uses the instructions of the present processor, whatever our compiler flags are.
*/
#ifndef HHTDAE_SCENE_PRODUCTS_H
#define HHTDAE_SCENE_PRODUCTS_H

#include <Eigen/Core>
#include <algorithm>
#include <petscblaslapack.h>
#include <type_traits>

namespace hhtdae
{

namespace product
{

/* A matrix in memory, stored by columns */
struct Stored {
  const double *entries;
  Eigen::Index  rows, columns, stride;
  bool          transposed; /* `entries` are those of the transpose; rows and columns are those of the matrix itself */
};

/* out = A B, stored by columns without gaps */
inline void Of(const Stored &A, const Stored &B, double *out)
{
  const PetscBLASInt m = (PetscBLASInt)A.rows, n = (PetscBLASInt)B.columns, k = (PetscBLASInt)A.columns;
  const PetscBLASInt a = std::max<PetscBLASInt>(1, (PetscBLASInt)A.stride), b = std::max<PetscBLASInt>(1, (PetscBLASInt)B.stride);
  const double       one = 1, zero = 0;
  if (m && n && k) BLASgemm_(A.transposed ? "T" : "N", B.transposed ? "T" : "N", &m, &n, &k, &one, A.entries, &a, B.entries, &b, &zero, out, &m);
  else std::fill(out, out + m * n, 0.);
}

/* The operator applies to matrices, blocks with contiguous columns, and transposes of these; products with other expressions remain Eigen's. */
template <class A, class = void> struct Operand {
  static constexpr bool fits = false;
};
template <class A> struct Operand<A, std::enable_if_t<std::is_base_of<Eigen::MatrixBase<A>, A>::value>> {
  static constexpr bool fits    = std::is_same<typename A::Scalar, double>::value && (A::Flags & Eigen::DirectAccessBit) && int(A::InnerStrideAtCompileTime) == 1;
  static constexpr bool dynamic = A::SizeAtCompileTime == Eigen::Dynamic;
};

template <class A, class B, bool = Operand<A>::fits && Operand<B>::fits> struct Two {
  static constexpr bool fit = false;
};
template <class A, class B> struct Two<A, B, true> {
  static constexpr int  rows = A::RowsAtCompileTime, columns = B::ColsAtCompileTime;
  static constexpr bool fit = (Operand<A>::dynamic || Operand<B>::dynamic) && !(rows == 1 && columns == 1);
  using Value               = Eigen::Matrix<double, rows, columns, (rows == 1 ? Eigen::RowMajor : Eigen::ColMajor)>;
};
template <class A, class B> using Value = typename std::enable_if_t<Two<A, B>::fit, Two<A, B>>::Value;

template <class A> Stored StoredAs(const A &a) { return {a.data(), a.rows(), a.cols(), a.outerStride(), bool(A::IsRowMajor)}; }

} // namespace product

template <class A, class B> inline product::Value<A, B> operator*(const A &a, const B &b)
{
  product::Value<A, B> c;
  c.resize(a.rows(), b.cols());
  product::Of(product::StoredAs(a), product::StoredAs(b), c.data());
  return c;
}

} // namespace hhtdae

#endif
