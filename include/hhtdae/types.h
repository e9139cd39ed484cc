/* Handles and small types that the scene's headers share. */
#ifndef HHTDAE_TYPES_H
#define HHTDAE_TYPES_H

/* Programs and the library exchange Eigen matrices, so both must allocate, align and free them alike, whatever instruction set
   (-mavx, -march=native) or sanitizer a program is compiled with. The CMake package and pkg-config define the same macros. */
#if !defined(EIGEN_CORE_H) && !defined(EIGEN_CORE_MODULE_H)
  #if !defined(EIGEN_MAX_ALIGN_BYTES)
    #define EIGEN_MAX_ALIGN_BYTES 16
  #endif
  #if !defined(EIGEN_MALLOC_ALREADY_ALIGNED)
    #define EIGEN_MALLOC_ALREADY_ALIGNED 1
  #endif
#endif
#include <Eigen/Core>
#include <Eigen/Geometry>
#include <petscsys.h>
#if EIGEN_MAX_STATIC_ALIGN_BYTES != 16 || EIGEN_MAX_ALIGN_BYTES != 16 || !EIGEN_MALLOC_ALREADY_ALIGNED
  #error "Eigen was included with another alignment than that of the hhtdae library: compile with -DEIGEN_MAX_ALIGN_BYTES=16 -DEIGEN_MALLOC_ALREADY_ALIGNED=1, or include hhtdae's headers first"
#endif

namespace hhtdae
{

using Vector3 = Eigen::Vector3d;
using Matrix3 = Eigen::Matrix3d;

/* Handles are cheap to copy and valid only in the scene that made them; `scene` is its number. A default-constructed handle refers to nothing. */
struct Body {
  PetscInt id    = -2; /* -1: ground */
  PetscInt scene = 0;
};
struct Marker {
  PetscInt id    = -1;
  PetscInt scene = 0;
};
struct Element { /* joint, motion or force */
  PetscInt id    = -1;
  PetscInt scene = 0;
};
struct Variable {
  PetscInt id    = -1;
  PetscInt scene = 0;
};
struct State {
  PetscInt id    = -1;
  PetscInt scene = 0;
};

} // namespace hhtdae

#endif
