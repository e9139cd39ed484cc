/*
  The invariants that are quadratic in the modes, N_cd = int phi_c phi_d^T, packed for the operations in the equations of motion:
  products with coordinates and rates, and linear combinations with varying factors.

  N_dc is the transpose of N_cd. With the symmetric and skew-symmetric parts N_cd = S + K and N_dc = S - K, only half of each matrix is
  stored. S_zz is not stored if S_xx + S_yy + S_zz is the identity, as for orthonormal modes. Products then read the numbers of four full
  matrices once for all vectors, instead of nine matrices for each vector. With a body of many modes, memory bandwidth for these
  matrices determines the time of a step.

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

  /* quadratic: N_cd for cd = xx, yy, zz, xy, yz, zx; null if there are none, then combine() adds outer products only */
  ModalProducts(int modes, const std::array<Eigen::MatrixXd, 6> *quadratic);

  /* Products with a vector x: apply() adds S x for xx, yy, zz, xy, yz, zx to the columns of `symmetric`, unless it is null, and K x for
     xy, yz, zx to those of `skew`. Both have leading dimension padded(); the caller sets them to zero. */
  struct Task {
    const double *x;
    double       *symmetric, *skew;
  };
  void apply(const Task *task, int count) const;

  /* Adds sum_cd L_cd N_cd + left right^T to `out`, stored by rows with leading dimension ld. left and right have leading dimension
     padded() and `rank` columns; their product must be symmetric, since only half of it is computed. Zero columns of `right` are skipped. */
  void combine(const Eigen::Matrix3d &L, const double *left, const double *right, int rank, double *out, int ld) const;

  /* y = A^T x and y = A x for a matrix A stored by columns; `rows` must be a multiple of four */
  static void transposedTimes(int rows, int columns, const double *A, const double *x, double *y);
  static void transposedTimes(int rows, int columns, const double *A, const double *const x[2], double *const y[2]); /* for two vectors x */
  static void times(int rows, int columns, const double *A, const double *x, double *y);

private:
  int                 padded_, symmetric_ = 0, skew_ = 0;
  bool                identity_ = false; /* S_zz is 1 - S_xx - S_yy and not stored */
  std::vector<double> value_;            /* modal_products.cpp */
  void                pack(const std::array<Eigen::MatrixXd, 6> &N);
};

} // namespace hhtdae

#endif
