/* The surface of a mesh, from faces that belong to one element alone. */
#ifndef HHTDAE_FLEXIBLE_SURFACE_H
#define HHTDAE_FLEXIBLE_SURFACE_H

#include "hhtdae/flexible.h"

namespace hhtdae
{

/* Of all elements of a mesh: global numbers of the corners on its surface, sorted, and triangles by their places, counter-clockwise from outside */
void OuterTriangles(const std::vector<FeElement> &elements, std::vector<PetscInt> *node, std::vector<int> *triangle);

/* Nodes of a surface, 3 coordinates each, thinned until there are no more than `most`, or 6: those on one side of the body in one cell of a grid become one. What it
   leaves: places of the nodes among those given, in their order, and the triangles by these. */
void ThinSurface(const std::vector<double> &point, std::size_t most, std::vector<std::size_t> *kept, std::vector<int> *triangle);

} // namespace hhtdae

#endif
