/*
  Attachments of flexible bodies. The markers of joints and forces are on a frame that is an explicit function of the body's
  floating frame and its modes:

    x = r + A (s + xi),   R = A exp([phi]),   (xi, phi) = Psi eta

  Its velocity and acceleration are explicit functions, too, so that an attachment has neither unknowns nor equations. With
  geometric stiffening each of the six components of (xi, phi) is reduced by (eta^T B eta)/2, with its own matrix B. A force
  or moment F along a component then adds F B to the stiffness of the modes, which follows from its virtual work.

  Elements add their loads to the frame, which is a local body of kind Attached; load() transfers them to the flexible body
  and its modes. The elements' contributions to the matrix are derivatives by the frame's motion (x, theta, v, w, a, alpha);
  projection.h transforms them to the body's coordinates with the derivatives that linearize() computes.
*/
#ifndef HHTDAE_SCENE_CARRIER_H
#define HHTDAE_SCENE_CARRIER_H

#include "frames.h"
#include "hhtdae/modal.h"
#include <array>
#include <petscsys.h>
#include <vector>

namespace hhtdae
{

class Bodies;

/* The rotation R = exp([phi]) and its left tangent operator J, dR = [J dphi] R; s = |phi|^2 */
struct SmallTurn {
  Vector3 phi;
  double  a, b, as, bs, ass, bss; /* J = 1 + a [phi] + b [phi]^2; as, bs, ass, bss: first and second derivatives of a and b by s */

  explicit SmallTurn(const Vector3 &phi = Vector3::Zero());
  Matrix3 rotation() const { return Matrix3::Identity() + (1 - b * phi.squaredNorm()) * Cross<double>(phi) + a * square(); }
  Matrix3 J() const { return Matrix3::Identity() + a * Cross<double>(phi) + b * square(); }
  Matrix3 momentGradient(const Vector3 &n) const;     /* d(J^T n)/dphi */
  Matrix3 rateGradient(const Vector3 &y) const;       /* d(J y)/dphi for fixed y */
  Matrix3 rate(const Vector3 &c) const;               /* J' for phi' = c */
  Matrix3 rateOfRateGradient(const Vector3 &c) const; /* d(J' c)/dphi for fixed c = phi' */

private:
  Matrix3 square() const { return phi * phi.transpose() - phi.squaredNorm() * Matrix3::Identity(); }
};

/* Displacement of an attachment's point by the deformation, translation and rotation vector in body axes, and its derivatives by the modes */
struct AttachedPoint {
  Eigen::Matrix<double, 6, 1>              motion;
  Eigen::Matrix<double, 6, Eigen::Dynamic> by_modes;

  AttachedPoint(const ModalAttachment &a, const Eigen::Ref<const Eigen::VectorXd> &eta);
};

/*
  Derivatives of a frame's motion, of x, theta, v, w, a, alpha in this order. Derivatives by the position of the body are 1,
  0, sv, 0, sa, 0; those by its rotational coordinates are `angles`. x, v and a depend on the translational shapes of the
  point only, theta, w and alpha on the rotational shapes only. Their derivatives by the modes are `motion` times these
  shapes, plus, with geometric stiffening, `bend` times the rows (B eta')^T and `bend_rate` times (B eta'')^T.
*/
struct FrameGradient {
  std::array<Matrix3, 6> angles, motion, bend, bend_rate;
};

/* A flexible body with those of its attachments that are in use. Products with the modes are computed for all n
   attachments at once: the three columns from 3k on are the translations of attachment k, the three columns from 3(n + k)
   on its rotations. */
class Carrier
{
public:
  struct Attached {
    PetscInt               body; /* local number of the frame */
    const ModalAttachment *attachment;
    Vector3                s; /* undeformed point relative to the centre of mass, body axes */
    SmallTurn              turn;
    Vector3                arm;            /* frame's origin relative to the body's origin, space axes */
    Vector3                velocity, spin; /* velocity and angular velocity of the frame relative to the body, space axes */
    FrameGradient          gradient;
  };
  PetscInt              body = -1; /* local number of the flexible body */
  std::vector<Attached> attached;
  Eigen::MatrixXd       shapes;          /* padded modes x 6n: derivatives of (xi, phi) by the modes at the present deformation */
  Eigen::MatrixXd       bend, bend_rate; /* columns B eta', B eta''; empty if no attachment has geometric stiffening */

  void    finish(int modes); /* after all attachments have been added */
  int     count() const { return (int)attached.size(); }
  int     column(int k, int part) const { return 3 * (k + part * count()); } /* part 0: translation, 1: rotation */
  bool    stiffens() const { return !stiffening_.empty(); }
  Vector3 motion(int k, int part) const { return motion_.segment<3>(column(k, part)); }

  void move(Bodies &B, const double *u, const double *v);
  void load(Bodies &B); /* transfers the frames' loads to the body and its modes */
  void acceleration(const Bodies &B, int k, const double *v, const double *a, Vector3 &linear, Vector3 &angular) const;
  /* Computes Attached::gradient of all frames; accelerations: also derivatives of a and alpha */
  void linearize(const Bodies &B, const double *v, const double *a, double sv, double sa, bool accelerations);
  /* Derivatives of (x, theta) of frame k by the position, a small rotation in space axes, and the modes of the body */
  Eigen::Matrix<double, 6, Eigen::Dynamic> jacobian(const Bodies &B, int k) const;
  /* K: geometric stiffness of the modes due to the present loads, which stay fixed in space */
  void stiffen(Eigen::MatrixXd &K) const;

private:
  int                                  modes_ = 0;
  Eigen::MatrixXd                      rest_;                            /* shapes of the undeformed body; only with geometric stiffening */
  /* (xi, phi), its rate, and the loads of all attachments, in the order of the columns of `shapes` */
  Eigen::VectorXd                      motion_, rate_, load_;
  Eigen::VectorXd                      scratch_, modes_now_, rates_now_; /* padded vectors of modal coordinates */
  std::vector<const Eigen::MatrixXd *> stiffening_;                      /* B of each column, null if it has none; empty if no column has one */

  void    bendShapes(const double *eta);
  void    linearizeAcceleration(const Bodies &B, int k, const double *v, const double *a, double sv, double sa);
  Vector3 secondOf(const double *v, const double *a, int k, int part) const;
};

} // namespace hhtdae

#endif
