/*
  The bodies on this rank: its own, then copies of other ranks' bodies on which its joints and forces act, then the ground. Contains their present
  motion, the loads of the elements, and the transformation from perturbations of markers to generalized coordinates.

  The residual of a body is inertia force minus load, computed in space axes and then transformed to its coordinates. Rows of
  the position r: m r'' - f. Rows of the rotation: G^T (N - m), N = I w' + w x I w, I = A J A^T, with moments about the centre
  of mass and dA = [G dU] A for rotational coordinates U, see rotation.h.
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

constexpr int max_coordinates = 6; /* largest number of coordinates of a body, not counting modal coordinates */
/* Number of coordinates without modal coordinates; these are the third group of a flexible body, see Bodies::modes() */
inline int Coordinates(BodyKind k)
{
  constexpr int n[] = {0, 3, 6, 3, 2, 6, 0};
  return n[(int)k];
}
inline bool TurnsInSpace(BodyKind k) { return k == BodyKind::Rigid || k == BodyKind::Flexible; }
/* Number of groups of coordinates. The rows of a group have nonzeros in the same columns of the matrix (pattern.h) */
inline int Groups(BodyKind k)
{
  if (k == BodyKind::Attached) return 2;
  return k == BodyKind::Ground ? 0 : TurnsInSpace(k) || k == BodyKind::Planar ? 2 : 1;
}
/* Attachments' frames also have groups for velocity and acceleration: x, theta, v, w, a, alpha, see projection.h */
constexpr int frame_groups = 6, first_rate_group = 2;
/* group 0: position, group 1: rotation */
inline int GroupSize(BodyKind k, int group)
{
  if (k == BodyKind::Planar || k == BodyKind::PlanarPoint) return group == 0 ? 2 : 1;
  return 3;
}
inline int GroupOffset(BodyKind k, int group) { return group == 0 ? 0 : GroupSize(k, 0); }

/* Data of a body that are constant during a step */
struct LocalBody {
  BodyKind kind  = BodyKind::Ground;
  bool     owned = false;
  PetscInt first   = -1; /* local number of the first coordinate */
  PetscInt group = -1;
  PetscInt id    = -1; /* in the scene */
  PetscInt modal   = -1; /* number of a flexible body in Bodies::modal */
  /* for the frame of an attachment: number of its flexible body in Bodies::carriers, and of the frame in
     Carrier::attached */
  PetscInt carrier = -1, place = -1;
  double   mass  = 0;
  Matrix3  J;          /* inertia in body axes; planar bodies use J(2,2) only */
  Matrix3  C;          /* reference attitude: A = exp([x]) C for local rotation vectors x, A = A313(eps) C for Euler angles eps */
};

/* Present motion of a body, and the loads on it */
struct BodyMotion {
  Vector3   r, v, w;
  Matrix3   A;
  Matrix3   G;     /* dA = [G dU] A, rotation.h; only for bodies with rotations in space */
  Vector3   w0;    /* w at the beginning of the step, for the Newton matrix of that step (inStep()); only for the same bodies */
  Vector3   f, m;  /* sum of the loads: force, moment about the centre of mass */
};

struct LocalMarker {
  PetscInt body;
  Vector3  s; /* position relative to the centre of mass, body axes */
  Matrix3  R; /* axes, in body axes */
};

/* A flexible body: its equations of motion, the load of its attachments on the modes, and storage for its diagonal
   blocks. The members from `outer` on are the sums of all attachments' contributions to these blocks: `rigid` has the six
   coordinates of the floating frame as rows and columns, `rigid_modal` (stored transposed) and `modal_rigid` couple these
   with the modes, and `outer`, `stiffening` and `unsymmetric` add to the part modes by modes. */
struct ModalPart {
  using RowMajor = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
  std::unique_ptr<ModalDynamics>           dynamics;
  Eigen::VectorXd                          load;
  ModalGradient                            gradient;
  RowMajor                                 block; /* coordinates x coordinates, extended by the padding of the modes */
  ModalOuter                               outer;
  Eigen::MatrixXd                          stiffening; /* geometric stiffness; no rows if no attachment has any */
  Matrix<6, 6>                             rigid;
  Eigen::Matrix<double, Eigen::Dynamic, 6> rigid_modal, modal_rigid; /* no rows if no attachment is in use */
  /* unsymmetric remainder of the modes by modes part, whose symmetric part is in `outer`; no rows if there is none */
  Eigen::MatrixXd                          unsymmetric;
};

class Bodies
{
public:
  std::vector<LocalBody>   body; /* own bodies, copies of other ranks' bodies, ground */
  std::vector<BodyMotion>  now;
  std::vector<LocalMarker> marker;
  std::vector<ModalPart>   modal;
  std::vector<Carrier>     carriers; /* flexible bodies with attachments in use */
  PetscInt                 own = 0; /* number of own bodies */
  long                     moves      = 0;     /* number of calls of move() */
  bool                     local = false; /* rotations are local vectors, not Euler angles */
  /* sv times the factor of TSHHT3GetRotationFactor() while the Newton matrix of a step is computed; else 0 */
  double                   commutator = 0;
  Vector3                  gravity = Vector3::Zero();

  /* Sets the motion of all bodies from their coordinates and velocities; clears the loads */
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
  Vector3 angularAcceleration(PetscInt b, const double *v, const double *a) const; /* v, a: all local velocities and accelerations */
  /* acceleration of the centre of mass, or of the origin of the floating frame */
  Vector3 acceleration(PetscInt b, const double *v, const double *a) const;
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

  /* Transforms derivatives J by (x, theta) of marker m, whose frame is f, to derivatives by the coordinates of its body
     (out); returns the number of these. R is 1, 2, 3 or 6; columns.cpp */
  template <int R> int columns(PetscInt m, const Frame<double> &f, const Matrix<R, 6> &J, Matrix<R, 6> &out) const;
  /* Derivative of the rotation vector of a step by the vector that Newmark's relations give: the rotation vector has a
     further term in the angular velocities, TSHHT3GetRotationFactor(). Derivatives of the residual by rotational
     coordinates are multiplied by this matrix from the right; the rows G^T m of moments are not affected. */
  Matrix3 inStep(const BodyMotion &b) const { return commutator == 0 ? Matrix3(Matrix3::Identity()) : Matrix3(Matrix3::Identity() - commutator * Cross<double>(b.w0)); }
  /* Multiplies the result of columns() by inStep() */
  template <int R> void inStep(PetscInt m, Matrix<R, 6> &out) const;
  /* J: derivatives by (v, w) of marker m. Adds to `out` the resulting derivatives by the coordinates and, times sv, by their velocities */
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
  /* The same for a flexible body and all its coordinates; the result is ModalPart::block */
  void modalJacobian(PetscInt b, const double *u, const double *v, const double *a, double sv, double sa);
  ModalMotion modalMotion(PetscInt b, const double *u, const double *v, const double *a) const; /* a may be null: accelerations are then not used */
  /* transfers the loads on attachments' frames to their bodies, after all elements have added theirs */
  void loadCarriers()
  {
    for (Carrier &c : carriers) c.load(*this);
  }
  /* Derivatives of the rotation (G), of w and of alpha in a step by the rotational coordinates, plus sv and sa times the
     derivatives by their velocities and accelerations */
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
