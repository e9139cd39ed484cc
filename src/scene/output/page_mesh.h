/*
  Surfaces in a page whose nodes move individually: whole finite-element bodies. For each frame every rank gives the positions
  of its nodes, and the stress there if it is known. The first rank subtracts the nearest rigid motion, which becomes the
  motion of an additional body in the page, so that deformations remain.
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
  Surface                  surface;        /* on the first rank: undeformed points in the initial pose, in space axes; without modes */
  bool                     stress = false; /* whether there is a von Mises stress at every node */
  std::vector<PetscMPIInt> nodes;          /* number of nodes of each rank, in the order of the surface's nodes */
  std::vector<Marker>      frames;         /* markers on the frames of the extension's attachments */

  /* Appends 3 coordinates for each of this rank's nodes, then their stress. u: the extension's own coordinates. Collective */
  virtual PetscErrorCode values(const double *u, std::vector<double> &mine) = 0;

  std::size_t perNode() const { return stress ? 4 : 3; }
};

/* The rigid motion X_k -> origin + R X_k that is nearest, in the mean square, to the motion of points from X to x; X is
   relative to the mean of the points. Not finite if the points are not. */
struct RigidFit {
  Vector3 origin;
  Matrix3 R;
};
RigidFit FitRigid(const Eigen::Matrix3Xd &X, const Eigen::Map<const Eigen::Matrix3Xd> &x);

} // namespace hhtdae

#endif
