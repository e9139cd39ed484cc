/* The surface of a mesh: faces that belong to one element only. */
#ifndef HHTDAE_FLEXIBLE_SURFACE_H
#define HHTDAE_FLEXIBLE_SURFACE_H

#include "hhtdae/flexible.h"

namespace hhtdae
{

/* From all elements of a mesh: global numbers of the corner nodes on its surface, sorted, and triangles by indices in this list, counter-clockwise from outside */
void OuterTriangles(const std::vector<FeElement> &elements, std::vector<PetscInt> *node, std::vector<int> *triangle);

/* Reduces a surface to at most max_nodes nodes, or 6: the nodes on one side of the body in one cell of a grid are replaced by one of them. point: 3 coordinates of each node.
   *kept: indices of the remaining nodes, ascending; *triangle: the remaining triangles, by indices in *kept. */
void ThinSurface(const std::vector<double> &point, std::size_t max_nodes, std::vector<std::size_t> *kept, std::vector<int> *triangle);

} // namespace hhtdae

#endif
