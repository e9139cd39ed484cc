/* Access to the unknowns of a node of a finite-element body in a rank's vectors. */
#ifndef HHTDAE_FLEXIBLE_FULL_NODES_H
#define HHTDAE_FLEXIBLE_FULL_NODES_H

#include "flexible/full_body.h"
#include "scene/output/energy.h"
#include "scene/small_matrix.h"

namespace hhtdae
{

struct NodePlace {
  PetscInt local, group;
};

inline NodePlace PlaceNode(const FullExtension &x, Localizer &l, PetscInt node)
{
  const PetscInt number = x.number(node);
  const PetscInt group  = l.group(number, 3);
  return {l.local(number), group};
}

inline Eigen::Map<const Vector3> At(const double *u, const NodePlace &n) { return Eigen::Map<const Vector3>(u + n.local); }

/* Adds a vector to the rows of a node, if this rank owns them */
inline void AddRows(Evaluation &ev, const NodePlace &n, const Vector3 &f)
{
  if (n.local >= ev.n) return;
  for (int c = 0; c < 3; c++) ev.F[n.local + c] += f(c);
}

} // namespace hhtdae

#endif
