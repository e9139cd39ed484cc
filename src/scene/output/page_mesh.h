/*
  Surfaces in a page whose nodes move each by itself: whole finite-element bodies. Of a frame every rank gives the places of its nodes, and what stress
  is there; the first rank takes a rigid motion out of them, that of a body of its own in the page, so that what is left are deformations.
*/
#ifndef HHTDAE_SCENE_OUTPUT_PAGE_MESH_H
#define HHTDAE_SCENE_OUTPUT_PAGE_MESH_H

#include "hhtdae/output.h"
#include "hhtdae/types.h"
#include "scene/output/page_bytes.h"
#include <petscsys.h>
#include <string>
#include <vector>

namespace hhtdae
{

/* The mesh of an extension, made for a page on all ranks */
class PageMesh
{
public:
  virtual ~PageMesh() = default;

  std::string              name;
  Surface                  surface;        /* on the first rank: points at the start without deformation, in space axes; no modes */
  bool                     stress = false; /* whether there is a von Mises stress at every node */
  std::vector<PetscMPIInt> nodes;          /* of each rank, in the order of the surface's nodes */
  std::vector<Marker>      frames;         /* markers on the frames of its attachments */

  /* Appends 3 coordinates for each of this rank's nodes, then their stress. u: the extension's own coordinates. Collective */
  virtual PetscErrorCode values(const double *u, std::vector<double> &mine) = 0;

  std::size_t perNode() const { return stress ? 4 : 3; }
};

/* The rigid motion X_k -> origin + R X_k nearest to the motion of the points in the mean square; X: relative to their mean. Not finite if the points are not. */
struct RigidFit {
  Vector3 origin;
  Matrix3 R;
};
RigidFit FitRigid(const Eigen::Matrix3Xd &X, const Eigen::Map<const Eigen::Matrix3Xd> &x);

} // namespace hhtdae

#endif
