/* Axes of the Euler angles of a scene's bodies: choice of axes that keep a given motion away from the singularity, and
   the change to other axes */
#ifndef HHTDAE_BENCH_SCENE_AXES_H
#define HHTDAE_BENCH_SCENE_AXES_H

#include "scene/runtime.h"

#include <algorithm>
#include <cmath>
#include <vector>

namespace hhtbench
{

/* Attitudes of one body during its motion: the third axis of space in body axes. The axis from which theta is measured
   must not come near it */
using Attitudes = std::vector<hhtdae::Vector3>;

/* A monitor that collects the attitudes of all bodies with Euler angles */
struct AttitudeWatch {
  hhtdae::Runtime        &R;
  std::vector<Attitudes> &path; /* one entry per body */
};

inline PetscErrorCode WatchAttitudes(TS, PetscInt, PetscReal, Vec U, void *ctx)
{
  AttitudeWatch &w = *static_cast<AttitudeWatch *>(ctx);
  const double  *u;

  PetscFunctionBegin;
  PetscCall(VecGetArrayRead(U, &u));
  for (PetscInt b = 0; b < w.R.bodies.own; b++) {
    const hhtdae::LocalBody &k = w.R.bodies.body[b];
    hhtdae::Matrix3          A;
    hhtdae::EulerAxes        e;
    if (!hhtdae::TurnsInSpace(k.kind)) continue;
    hhtdae::EulerFrame(u + k.first + 3, A, e);
    w.path[b].push_back((A * k.C).row(2).transpose());
  }
  PetscCall(VecRestoreArrayRead(U, &u));
  PetscFunctionReturn(0);
}

/* From many directions on a half sphere, chooses the body-fixed direction that stays farthest from the third axis of
   space and its opposite, as z axis of the Euler angles' axes; returns these axes as a quaternion, and the smallest
   |sin theta| */
inline double ChooseAxes(const Attitudes &path, double *quaternion)
{
  hhtdae::Vector3 best  = hhtdae::Vector3::UnitZ();
  double          worst = 2.;
  const int       tried = 500;
  for (int k = 0; k < tried; k++) {
    const double          z = (k + .5) / tried, r = std::sqrt(1. - z * z), angle = 2.399963229728653 * k;
    const hhtdae::Vector3 c(r * std::cos(angle), r * std::sin(angle), z);
    double                near = 0.;
    for (const hhtdae::Vector3 &up : path) near = std::max(near, std::abs(up.dot(c)));
    if (near >= worst) continue;
    worst = near;
    best  = c;
  }
  /* the rotation from `best`, which is in the upper half space, to z */
  const Eigen::Vector4d q = Eigen::Vector4d(1. + best[2], best[1], -best[0], 0.).normalized();
  for (int i = 0; i < 4; i++) quaternion[i] = q[i];
  return std::sqrt(1. - worst * worst);
}

/* Converts an attitude and an angular velocity to Euler angles about these axes and their rates */
inline void ToAxes(const hhtdae::BodyMotion &b, const hhtdae::Matrix3 &axes, double *eps, double *rate)
{
  hhtdae::Matrix3       A;
  hhtdae::EulerAxes     e;
  const hhtdae::Vector3 w      = b.w;
  const hhtdae::Vector3 angles = hhtdae::EulerAngles(b.A * axes.transpose());
  hhtdae::EulerFrame(angles.data(), A, e);
  const hhtdae::Vector3 rates = hhtdae::EulerRates(e, w);
  for (int i = 0; i < 3; i++) {
    eps[i]  = angles(i);
    rate[i] = rates(i);
  }
}

} // namespace hhtbench

#endif
