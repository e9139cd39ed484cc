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
#include <memory>

namespace hhtdae
{

/* Motion of a flexible body: axes, angular velocity and acceleration in space axes, r'' - g, modal coordinates */
struct ModalMotion {
  Matrix3                           A;
  Vector3                           w, alpha, a0;
  Eigen::Map<const Eigen::VectorXd> eta, rate, acceleration;
};

/* Derivatives of (f, n) and h in space axes by a0, a turn of the body, w and alpha; and by the modal coordinates,
   d/deta + sv d/deta' + sa d/deta'' */
struct ModalGradient {
  Eigen::Matrix<double, 6, 12>             rigid;
  Eigen::Matrix<double, Eigen::Dynamic, 12> modal_rigid;
  Eigen::Matrix<double, 6, Eigen::Dynamic> rigid_modal;
  Eigen::MatrixXd                          modal;
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
  const ModalBody &body() const { return *body_; }

  void        force(const ModalMotion &q, Vector3 &f, Vector3 &n, Eigen::Ref<Eigen::VectorXd> h);
  void        gradient(const ModalMotion &q, double sv, double sa, ModalGradient &G);
  ModalEnergy energy(const ModalMotion &q, const Vector3 &v); /* v: of the frame's origin; accelerations are not used */

private:
  std::shared_ptr<const ModalBody> body_;
  int                              m_;
  bool                             linear_, quadratic_; /* invariants of first and second order in the modes are used */
  Eigen::VectorXd                  damping_, stiffness_;
  Eigen::Matrix<double, Eigen::Dynamic, 9> b_, n_rate_, n_acc_; /* column 3 c + d: b_cd; N_cd eta'; N_cd eta'' */
  Matrix3                          I2_, V_, W_;                 /* int y y^T, int y s^T, int y u''^T */
  Vector3                          c_, p_, pa_;                 /* int y, int s, int u'' */

  void integrals(const ModalMotion &q);
  void products(const Eigen::Ref<const Eigen::VectorXd> &x, Eigen::Matrix<double, Eigen::Dynamic, 9> &out) const; /* adds N_cd x */
  /* sum_cd L_cd N_cd */
  void addQuadratic(const Matrix3 &L, double factor, Eigen::MatrixXd &out) const;
};

} // namespace hhtdae

#endif
