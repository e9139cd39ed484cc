/*
  The equations of motion of a flexible body in its floating frame of reference, from the invariants of modal.h.

  Let y = X + u be the position of a particle relative to the frame's origin, s = u' its velocity of deformation, a0 = r'' - g, all in body
  axes, and L = [alpha] + [w][w]. The particle's acceleration minus gravity is a0 + L y + 2 w x s + u''. Its virtual work for the virtual
  displacement dr + dtheta x y + sum phi_k deta_k gives the rows of the position (force f), of the rotation (moment n about the frame's
  origin) and of the modes (h). All integrals over the body follow from

    c = int y = P eta,   b_cd,k = int phi_k,c y_d,   int y_c y_e,   int y_c s_e = b_ec . eta',   int y_c u''_e = b_ec . eta''

  where int is the integral over the mass. These are the equations of Shabana, Dynamics of Multibody Systems, ch. 5, in another notation.
*/
#ifndef HHTDAE_SCENE_MODAL_DYNAMICS_H
#define HHTDAE_SCENE_MODAL_DYNAMICS_H

#include "hhtdae/modal.h"
#include "modal_products.h"
#include <memory>

namespace hhtdae
{

/* Motion of a flexible body: axes A of the floating frame; angular velocity w, angular acceleration alpha and a0 = r'' -
   g in space axes; modal coordinates and their derivatives */
struct ModalMotion {
  Matrix3                           A;
  Vector3                           w, alpha, a0;
  Eigen::Map<const Eigen::VectorXd> eta, rate, acceleration;
};

/* f and n in space axes, and derivatives of f, n and h. `rigid` and `modal_rigid`: derivatives of (f, n) and of h by a0,
   a rotation of the body, w and alpha. `rigid_modal`: derivatives of (f, n) by the modal coordinates, d/deta + sv d/deta'
   + sa d/deta'' */
struct ModalGradient {
  Vector3                                   f, n;
  Eigen::Matrix<double, 6, 12>              rigid;
  Eigen::Matrix<double, Eigen::Dynamic, 12> modal_rigid;
  Eigen::Matrix<double, Eigen::Dynamic, 6>  rigid_modal; /* stored transposed */
};

/* A symmetric matrix, modes x modes, as the product left right^T of matrices with ModalDynamics::padded() rows */
struct ModalOuter {
  Eigen::MatrixXd left, right;
};

struct ModalEnergy {
  double  kinetic, elastic;
  /* space axes; angular: moment of momentum about the frame's present origin, int y x x' with the particle's velocity x'
     in space */
  Vector3 momentum, angular;
  Vector3 center;            /* centre of mass relative to the frame's origin, space axes */
};

class ModalDynamics
{
public:
  /* damping: 2 zeta omega of each mode */
  ModalDynamics(std::shared_ptr<const ModalBody> body, ModalMass mass, const Eigen::VectorXd &damping);

  int              modes() const { return m_; }
  int              padded() const { return ModalProducts::padded(m_); }
  const ModalBody &body() const { return *body_; }

  void        force(const ModalMotion &q, Vector3 &f, Vector3 &n, Eigen::Ref<Eigen::VectorXd> h);
  /* Computes G, and `modal` = dh/deta + sv dh/deta' + sa dh/deta'' + `more`, stored by rows with leading dimension ld.
     `modal` has padded() rows and columns, which the caller sets to zero. */
  void        gradient(const ModalMotion &q, double sv, double sa, const ModalOuter &more, ModalGradient &G, double *modal, int ld);
  ModalEnergy energy(const ModalMotion &q, const Vector3 &v); /* v: velocity of the frame's origin; accelerations are not used */

private:
  using Columns  = ModalProducts::Columns;
  using Vectors3 = Eigen::Matrix<double, Eigen::Dynamic, 3>;
  std::shared_ptr<const ModalBody> body_;
  int                              m_;
  bool                             linear_, quadratic_; /* whether invariants of first and second order in the modes are used */
  Eigen::VectorXd                  damping_, stiffness_;
  ModalProducts                    products_;
  Vectors3                         first_;              /* int phi */
  Columns                          moment_, b_, rate_;  /* columns 3 c + d: int phi_c X_d; b_cd; N_cd eta' */
  Vectors3                         skew_rate_, skew_acc_; /* columns xy, yz, zx: (N_cd - N_dc)/2 times eta', and times eta'' */
  Eigen::MatrixXd                  x_, y_;              /* padded columns eta, eta', eta''; the products with each of them, side by side */
  Matrix3                          I2_, V_, W_;         /* int y y^T, int y s^T, int y u''^T */
  Vector3                          c_, p_, pa_;         /* int y, int s, int u'' */

  enum class For { Force, Gradient, Energy };
  void integrals(const ModalMotion &q, For what);
  void products(const ModalMotion &q, For what);
  void addProducts(int vector, Columns &to) const; /* adds N_cd x, x the given column of x_, to column 3 c + d */
};

} // namespace hhtdae

#endif
