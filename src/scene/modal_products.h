/*
  The invariants quadratic in the modes, N_cd = int phi_c phi_d^T, packed for the operations in the equations of motion:
  products with coordinates and rates, and linear combinations with varying factors.

  N_dc is the transpose of N_cd. In terms of symmetric and skew parts, N_cd = S + K and N_dc = S - K, half of each matrix
  says all, and of S_zz nothing is left where the three diagonal ones add up to the identity, as they do for orthonormal
  modes: products read four matrices' worth of numbers once for all vectors, in place of nine for each vector. A step with
  a body of many modes spends its time on reading them.

  Vectors are padded with zeros to padded() entries.
*/
#ifndef HHTDAE_SCENE_MODAL_PRODUCTS_H
#define HHTDAE_SCENE_MODAL_PRODUCTS_H

#include <Eigen/Core>
#include <array>
#include <vector>

namespace hhtdae
{

class ModalProducts
{
public:
  using Columns = Eigen::Matrix<double, Eigen::Dynamic, 9>; /* column 3 c + d for N_cd */

  static int padded(int modes) { return (modes + 3) / 4 * 4; }

  /* quadratic: xx, yy, zz, xy, yz, zx; null: there are none, and only outer products can be asked for */
  ModalProducts(int modes, const std::array<Eigen::MatrixXd, 6> *quadratic);

  /* Products with a vector x: adds S x for xx, yy, zz, xy, yz, zx to `symmetric`, unless it is null, and K x for
     xy, yz, zx to `skew`, both of leading dimension padded(), zero at first */
  struct Task {
    const double *x;
    double       *symmetric, *skew;
  };
  void apply(const Task *task, int count) const;

  /* Adds sum_cd L_cd N_cd + left right^T to `out`, row by row at the distance ld. The product of the last two (leading
     dimension padded(), `rank` columns) must be symmetric; half of it is computed, and where columns of `right` are zero,
     nothing. */
  void combine(const Eigen::Matrix3d &L, const double *left, const double *right, int rank, double *out, int ld) const;

  /* y = A^T x and y = A x with `rows` a multiple of four and as many columns as wanted */
  static void transposedTimes(int rows, int columns, const double *A, const double *x, double *y);
  static void transposedTimes(int rows, int columns, const double *A, const double *const x[2], double *const y[2]); /* of two vectors */
  static void times(int rows, int columns, const double *A, const double *x, double *y);

private:
  int                 padded_, symmetric_ = 0, skew_ = 0;
  bool                identity_ = false; /* S_zz is 1 - S_xx - S_yy and not stored */
  std::vector<double> value_;            /* modal_products.cpp */
  void                pack(const std::array<Eigen::MatrixXd, 6> &N);
};

} // namespace hhtdae

#endif
