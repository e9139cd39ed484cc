/*
  The bodies of this rank: its own, then those of other ranks on which its joints and forces act, then the ground; with their present
  motion, the loads of the elements, and the transformation from perturbations of markers to generalized coordinates.

  The residual of a body is inertia minus load, in space axes, transformed to the coordinates at the end:
  rows of r: m r'' - f;  rows of the rotation: G^T (N - m), N = I w' + w x I w, I = A J A^T (moments about the centre of mass), with
  dA = [G dU] A for rotational coordinates U, see rotation.h.
*/
#ifndef HHTDAE_SCENE_BODIES_H
#define HHTDAE_SCENE_BODIES_H

#include "carrier.h"
#include "euler.h"
#include "frames.h"
#include "rotation.h"
#include "modal_dynamics.h"
#include <petscsys.h>
#include <memory>
#include <vector>

namespace hhtdae
{

/* Attached: the frame of an attachment of a flexible body, which has no coordinates */
enum class BodyKind : unsigned char { Ground, Point, Rigid, Planar, PlanarPoint, Flexible, Attached };

constexpr int max_coordinates = 6; /* of a body, without modal ones */
/* without modal coordinates, which are a third group of a flexible body; see Bodies::modes() */
inline int Coordinates(BodyKind k)
{
  constexpr int n[] = {0, 3, 6, 3, 2, 6, 0};
  return n[(int)k];
}
inline bool TurnsInSpace(BodyKind k) { return k == BodyKind::Rigid || k == BodyKind::Flexible; }
/* Coordinates come in groups whose rows of the matrix have the same columns */
inline int Groups(BodyKind k)
{
  if (k == BodyKind::Attached) return 2;
  return k == BodyKind::Ground ? 0 : TurnsInSpace(k) || k == BodyKind::Planar ? 2 : 1;
}
/* Attachments' frames have groups for velocity and acceleration, too: x, theta, v, w, a, alpha, see projection.h */
constexpr int frame_groups = 6, first_rate_group = 2;
/* group 0: position, group 1: rotation */
inline int GroupSize(BodyKind k, int group)
{
  if (k == BodyKind::Planar || k == BodyKind::PlanarPoint) return group == 0 ? 2 : 1;
  return 3;
}
inline int GroupOffset(BodyKind k, int group) { return group == 0 ? 0 : GroupSize(k, 0); }

/* data that are constant in a step */
struct LocalBody {
  BodyKind kind  = BodyKind::Ground;
  bool     owned = false;
  PetscInt first   = -1; /* local number of the first coordinate */
  PetscInt group = -1;
  PetscInt id    = -1; /* in the scene */
  PetscInt modal   = -1; /* of a flexible body: its number in Bodies::modal */
  PetscInt carrier = -1, place = -1; /* of an attachment's frame: number of its body in Bodies::carriers, and its own number in Carrier::attached */
  double   mass  = 0;
  Matrix3  J;          /* inertia in body axes; planar: J(2,2) */
  Matrix3  C;          /* A = exp([x]) C, or body axes to the axes of the Euler angles */
};

/* present motion and load */
struct BodyMotion {
  Vector3   r, v, w;
  Matrix3   A;
  Matrix3   G;     /* of bodies with rotations in space */
  Vector3   w0;    /* of the same, for the matrix of a step: w at the beginning of the step */
  Vector3   f, m;  /* load: force, moment about the centre of mass */
};

struct LocalMarker {
  PetscInt body;
  Vector3  s; /* from the centre of mass, body axes */
  Matrix3  R; /* axes, in body axes */
};

/* A flexible body: its equations, the load of its attachments on the modes, and storage for its matrix. The last members are the sum of all attachments' contributions to the
   matrix: by position and angles (`rigid`), by the modes to the first six rows (`rigid_modal`, transposed) and vice versa, and modes by modes. */
struct ModalPart {
  using RowMajor = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
  std::unique_ptr<ModalDynamics>           dynamics;
  Eigen::VectorXd                          load;
  ModalGradient                            gradient;
  RowMajor                                 block; /* coordinates x coordinates, and behind them the padding of the modes */
  ModalOuter                               outer;
  Eigen::MatrixXd                          stiffening; /* no rows: no attachment has any */
  Matrix<6, 6>                             rigid;
  Eigen::Matrix<double, Eigen::Dynamic, 6> rigid_modal, modal_rigid; /* no rows: no attachment is in use */
  Eigen::MatrixXd                          unsymmetric; /* modes by modes, what `outer` leaves; no rows: nothing */
};

class Bodies
{
public:
  std::vector<LocalBody>   body; /* own, other ranks', ground */
  std::vector<BodyMotion>  now;
  std::vector<LocalMarker> marker;
  std::vector<ModalPart>   modal;
  std::vector<Carrier>     carriers; /* flexible bodies with attachments in use */
  PetscInt                 own = 0;
  long                     moves      = 0;     /* number of calls of move() */
  bool                     local = false; /* rotations are local vectors, not Euler angles */
  double                   commutator = 0;     /* sv times TSHHT3GetRotationFactor(), in the matrix of a step; else 0 */
  Vector3                  gravity = Vector3::Zero();

  /* motion of all bodies from their coordinates and rates; clears the loads */
  void move(const double *u, const double *v);
  int  modes(PetscInt b) const { return body[b].modal < 0 ? 0 : modal[body[b].modal].dynamics->modes(); }
  int  coordinates(PetscInt b) const { return Coordinates(body[b].kind) + modes(b); }

  /* ---- markers ---- */
  template <bool with_axes = true> Frame<double> frame(PetscInt m) const
  {
    const LocalMarker &k = marker[m];
    const BodyMotion  &b = now[k.body];
    Frame<double>      f;
    f.x.noalias() = b.r + b.A * k.s;
    if constexpr (with_axes) f.R.noalias() = b.A * k.R;
    return f;
  }
  Vector3 angularAcceleration(PetscInt b, const double *v, const double *a) const; /* of all rates and accelerations */
  Vector3 acceleration(PetscInt b, const double *v, const double *a) const;        /* of its origin */
  Twist<double> twist(PetscInt m, const Frame<double> &f) const
  {
    const BodyMotion &b = now[marker[m].body];
    return {b.v + b.w.cross(f.x - b.r), b.w};
  }
  void load(PetscInt m, const Frame<double> &at, const Vector3 &f, const Vector3 &moment)
  {
    BodyMotion &b = now[marker[m].body];
    b.f += f;
    b.m += moment + (at.x - b.r).cross(f);
  }

  /* J, columns (x, theta) of marker m at f, to the coordinates of its body; returns their number. R is 1, 2, 3 or 6; columns.cpp */
  template <int R> int columns(PetscInt m, const Frame<double> &f, const Matrix<R, 6> &J, Matrix<R, 6> &out) const;
  /* Derivative of the rotation vector in a step by that of Newmark's relations: the former has a further term in the angular velocities, TSHHT3GetRotationFactor(). Derivatives
     of the residual by U have to be multiplied by it, rows of moments have not. */
  Matrix3 inStep(const BodyMotion &b) const { return commutator == 0 ? Matrix3(Matrix3::Identity()) : Matrix3(Matrix3::Identity() - commutator * Cross<double>(b.w0)); }
  /* the same for the result of columns() */
  template <int R> void inStep(PetscInt m, Matrix<R, 6> &out) const;
  /* J, columns (v, w) of marker m: adds its derivatives by the coordinates and, times sv, by their velocities to out */
  template <int R> void velocityColumns(PetscInt m, const Frame<double> &f, const double *v, double sv, const Matrix<R, 6> &J, Matrix<R, 6> &out) const;
  /* dw/dU + sv dw/dU' */
  Matrix3 angularVelocityGradient(const BodyMotion &b, const double *rate, double sv) const
  {
    if (local) return sv * Matrix3::Identity();
    return RateGradient(EulerAxes(b.G), Vector3(rate[0], rate[1], rate[2]), b.w) + sv * b.G;
  }

  /* ---- own bodies' rows ---- */
  void residual(const double *u, const double *v, const double *a, double *F);
  /* adds sv dF/dv + sa dF/da + dF/du of body b to B (coordinates x coordinates, row major of leading dimension 6) */
  void jacobian(PetscInt b, const double *u, const double *v, const double *a, double sv, double sa, Eigen::Matrix<double, 6, 6, Eigen::RowMajor> &B) const;
  /* the same of a flexible body, all its coordinates: ModalPart::block */
  void modalJacobian(PetscInt b, const double *u, const double *v, const double *a, double sv, double sa);
  ModalMotion modalMotion(PetscInt b, const double *u, const double *v, const double *a) const; /* without a: q'' is not used */
  /* transfers the loads on attachments' frames to their bodies, after all elements have added theirs */
  void loadCarriers()
  {
    for (Carrier &c : carriers) c.load(*this);
  }
  /* Derivatives of attitude, w and alpha in a step by the rotational coordinates and, times sv and sa, by their velocities and accelerations */
  struct AngularGradient {
    Matrix3 G, w, alpha;
  };
  AngularGradient byAngles(PetscInt b, const double *v, const double *a, double sv, double sa) const;

private:
  Matrix3         momentGradient(PetscInt b, const double *u, const Vector3 &m) const; /* d(G^T m)/dU for fixed m, in a step */
  void modalResidual(PetscInt b, const double *u, const double *v, const double *a, double *row);
};

} // namespace hhtdae

#endif
