/*
  The equations of motion of a flexible body in its floating frame of reference, from the invariants of modal.h.

  With y = X + u the position of a particle from the frame's origin, s = u' its velocity of deformation, a0 = r'' - g, all in body
  axes, and L = [alpha] + [w][w], a particle's acceleration less gravity is a0 + L y + 2 w x s + u''. Its virtual work with
  dr + dtheta x y + sum phi_k deta_k gives the rows of r (force f), of a turn (moment n about the frame's origin) and of the modes
  (h). All integrals over the body come from

    c = int y = P eta,   b_cd,k = int phi_k,c y_d,   int y_c y_e,   int y_c s_e = b_ec . eta',   int y_c u''_e = b_ec . eta''

  where int stands for the integral over the mass. Shabana, Dynamics of Multibody Systems, ch. 5, in other words.
*/
#ifndef HHTDAE_SCENE_MODAL_DYNAMICS_H
#define HHTDAE_SCENE_MODAL_DYNAMICS_H

#include "hhtdae/modal.h"
#include "modal_products.h"
#include <memory>

namespace hhtdae
{

/* Motion of a flexible body: axes, angular velocity and acceleration in space axes, r'' - g, modal coordinates */
struct ModalMotion {
  Matrix3                           A;
  Vector3                           w, alpha, a0;
  Eigen::Map<const Eigen::VectorXd> eta, rate, acceleration;
};

/* (f, n) and its derivatives and those of h in space axes by a0, a turn of the body, w and alpha; and of (f, n) by the modal
   coordinates, d/deta + sv d/deta' + sa d/deta'' */
struct ModalGradient {
  Vector3                                   f, n;
  Eigen::Matrix<double, 6, 12>              rigid;
  Eigen::Matrix<double, Eigen::Dynamic, 12> modal_rigid;
  Eigen::Matrix<double, Eigen::Dynamic, 6>  rigid_modal; /* transposed */
};

/* A symmetric matrix modes x modes as the product left right^T, with ModalDynamics::padded() rows each */
struct ModalOuter {
  Eigen::MatrixXd left, right;
};

struct ModalEnergy {
  double  kinetic, elastic;
  Vector3 momentum, angular; /* space axes; angular about the frame's origin, moving with it: int y x x' */
  Vector3 center;            /* of mass from the frame's origin, space axes */
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
  /* modal: dh by the modal coordinates in the same sense, row by row at the distance ld; it has padded() rows and columns, and is
     zero at first. What is given as `more` adds to it. */
  void        gradient(const ModalMotion &q, double sv, double sa, const ModalOuter &more, ModalGradient &G, double *modal, int ld);
  ModalEnergy energy(const ModalMotion &q, const Vector3 &v); /* v: of the frame's origin; accelerations are not used */

private:
  using Columns  = ModalProducts::Columns;
  using Vectors3 = Eigen::Matrix<double, Eigen::Dynamic, 3>;
  std::shared_ptr<const ModalBody> body_;
  int                              m_;
  bool                             linear_, quadratic_; /* invariants of first and second order in the modes are used */
  Eigen::VectorXd                  damping_, stiffness_;
  ModalProducts                    products_;
  Vectors3                         first_;              /* int phi */
  Columns                          moment_, b_, rate_;  /* column 3 c + d: int phi_c X_d; b_cd; N_cd eta' */
  Vectors3                         skew_rate_, skew_acc_; /* (N_cd - N_dc)/2 by eta' and eta'' for xy, yz, zx */
  Eigen::MatrixXd                  x_, y_;              /* padded: eta, eta', eta''; products with each, side by side */
  Matrix3                          I2_, V_, W_;         /* int y y^T, int y s^T, int y u''^T */
  Vector3                          c_, p_, pa_;         /* int y, int s, int u'' */

  enum class For { Force, Gradient, Energy };
  void integrals(const ModalMotion &q, For what);
  void products(const ModalMotion &q, For what);
  void addProducts(int vector, Columns &to) const; /* N_cd x */
};

} // namespace hhtdae

#endif
