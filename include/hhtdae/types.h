/* Handles and small types that the scene's headers share. */
#ifndef HHTDAE_TYPES_H
#define HHTDAE_TYPES_H

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <petscsys.h>

namespace hhtdae
{

using Vector3 = Eigen::Vector3d;
using Matrix3 = Eigen::Matrix3d;

/* Handles: cheap to copy, valid in the scene that made them. A default one refers to nothing. */
struct Body {
  PetscInt id = -2; /* -1: ground */
};
struct Marker {
  PetscInt id = -1;
};
struct Element { /* joint, motion or force */
  PetscInt id = -1;
};
struct Variable {
  PetscInt id = -1;
};
struct State {
  PetscInt id = -1;
};

} // namespace hhtdae

#endif
