/*
  Attachments of flexible bodies. Joints, forces and markers act on a frame that is an explicit function of the body's floating frame and its modes:

    x = r + A (s + xi),   R = A exp([phi]),   (xi, phi) = Psi eta

  and so are its velocity and acceleration, so that an attachment has no unknowns and no equations. With geometric stiffening each of the six motions
  is reduced by (eta^T B eta)/2 with a matrix B for each: a force or moment F along it then adds F B to the stiffness of the modes, by the derivative of its work.

  Elements put their loads on the frame (a local body of kind Attached); load() transfers them to the body and its modes. Matrix contributions of elements are
  derivatives by the frame's motion (x, theta, v, w, a, alpha); projection.h transforms them to the body's coordinates with the derivatives from linearize().
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

/* exp([phi]) and its left differential, dR = [J dphi] R; s = |phi|^2 */
struct SmallTurn {
  Vector3 phi;
  double  a, b, as, bs, ass, bss; /* J = 1 + a [phi] + b [phi]^2 and its first and second derivatives by s */

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

/* Motion of the point by the deformation in body axes, translation and rotation vector, and its derivatives by the modes */
struct AttachedPoint {
  Eigen::Matrix<double, 6, 1>              motion;
  Eigen::Matrix<double, 6, Eigen::Dynamic> by_modes;

  AttachedPoint(const ModalAttachment &a, const Eigen::Ref<const Eigen::VectorXd> &eta);
};

/*
  Derivatives of a frame's motion: of x, theta, v, w, a, alpha in this order. By the body's position they are 1, 0, sv, 0, sa, 0. x, v and a depend on the
  translations of the point alone, theta, w and alpha on its rotations: by the modes they are motion times these shapes, and with geometric stiffening bend times
  the rows (B eta')^T and bend_rate times (B eta'')^T.
*/
struct FrameGradient {
  std::array<Matrix3, 6> angles, motion, bend, bend_rate;
};

/* A flexible body with those of its attachments that are in use. Products with the modes are computed for all attachments at once: with n attachments,
   columns 3k.. are the translations, columns 3(n + k).. the rotations of attachment k. */
class Carrier
{
public:
  struct Attached {
    PetscInt               body; /* local number of the frame */
    const ModalAttachment *attachment;
    Vector3                s; /* undeformed, from the centre of mass, body axes */
    SmallTurn              turn;
    Vector3                arm;            /* frame's origin relative to the body's origin, space axes */
    Vector3                velocity, spin; /* of the frame relative to the body, space axes */
    FrameGradient          gradient;
  };
  PetscInt              body = -1; /* local number */
  std::vector<Attached> attached;
  Eigen::MatrixXd       shapes;          /* padded modes x 6n: derivatives of the motions by the modes at the present deformation */
  Eigen::MatrixXd       bend, bend_rate; /* columns B eta', B eta''; empty: no attachment has geometric stiffening */

  void    finish(int modes); /* after all attachments have been added */
  int     count() const { return (int)attached.size(); }
  int     column(int k, int part) const { return 3 * (k + part * count()); } /* part 0: translation, 1: rotation */
  bool    stiffens() const { return !stiffening_.empty(); }
  Vector3 motion(int k, int part) const { return motion_.segment<3>(column(k, part)); }

  void move(Bodies &B, const double *u, const double *v);
  void load(Bodies &B); /* transfers the frames' loads to the body and its modes */
  void acceleration(const Bodies &B, int k, const double *v, const double *a, Vector3 &linear, Vector3 &angular) const;
  /* gradients of all frames; accelerations: also those of accelerations */
  void linearize(const Bodies &B, const double *v, const double *a, double sv, double sa, bool accelerations);
  /* derivatives of (x, theta) of a frame by position, small rotation and modes of the body */
  Eigen::Matrix<double, 6, Eigen::Dynamic> jacobian(const Bodies &B, int k) const;
  /* K: geometric stiffness of the modes by the loads, held fixed in space */
  void stiffen(Eigen::MatrixXd &K) const;

private:
  int                                  modes_ = 0;
  Eigen::MatrixXd                      rest_;                            /* shapes undeformed, if that differs */
  Eigen::VectorXd                      motion_, rate_, load_;            /* of all points, by columns */
  Eigen::VectorXd                      scratch_, modes_now_, rates_now_; /* padded */
  std::vector<const Eigen::MatrixXd *> stiffening_;                      /* of each column, null: none; empty: of all */

  void    bendShapes(const double *eta);
  void    linearizeAcceleration(const Bodies &B, int k, const double *v, const double *a, double sv, double sa);
  Vector3 secondOf(const double *v, const double *a, int k, int part) const;
};

} // namespace hhtdae

#endif
