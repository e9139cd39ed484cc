/* Surfaces of flexible bodies in a page: coding of the mesh and its modes, and the stress at its nodes. */
#ifndef HHTDAE_SCENE_OUTPUT_PAGE_SURFACE_H
#define HHTDAE_SCENE_OUTPUT_PAGE_SURFACE_H

#include "hhtdae/modal.h"
#include "hhtdae/output.h"
#include "scene/output/page_bytes.h"

namespace hhtdae
{

/* What is wrong with a surface, as text; empty if nothing */
std::string SurfaceFault(const Surface &s, const ModalBody &m);

/*
    u32 nodes, triangles, modes
    f32 coordinates relative to the undeformed centre of mass, in planes;  u32 nodes of the triangles, in planes
    f32 step of every mode;  codes of each mode, its x, y, z one after the other: u16 in zigzag order, in planes; displacement = step * code

  A given force deflects the body in mode k in proportion to 1/omega_k^2. The codes are coarser for faster modes by that factor, so that the errors of
  displacements are equal for all modes. The largest code is 8,191 for the slowest mode, and at least 31 for the others.
*/
PageBytes EncodeSurface(const Surface &s, const ModalBody &m);

inline bool HasStress(const Surface &s) { return s.stress.size() > 0; }
/* von Mises stress, nodes x frames, for modal coordinates eta, modes x frames */
void SurfaceStress(const Surface &s, const Eigen::MatrixXf &eta, Eigen::MatrixXf *von_mises);

} // namespace hhtdae

#endif
