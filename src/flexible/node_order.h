/* Orders of an element's nodes: Gmsh's order is used here, corners first, then middle nodes of edges; VTK, Abaqus and CalculiX order the middle nodes differently. */
#ifndef HHTDAE_FLEXIBLE_NODE_ORDER_H
#define HHTDAE_FLEXIBLE_NODE_ORDER_H

#include "hhtdae/flexible.h"

namespace hhtdae
{

/* Node k in the order of VTK, Abaqus and CalculiX is node GmshPlace(type, k) in Gmsh's order */
constexpr int GmshPlace(ElementType type, int k)
{
  constexpr int tetrahedron[] = {0, 1, 2, 3, 4, 5, 6, 7, 9, 8};
  constexpr int brick[]       = {0, 1, 2, 3, 4, 5, 6, 7, 8, 11, 13, 9, 16, 18, 19, 17, 10, 12, 14, 15};
  if (type == ElementType::Tetrahedron10) return tetrahedron[k];
  if (type == ElementType::Brick20) return brick[k];
  return k;
}

} // namespace hhtdae

#endif
