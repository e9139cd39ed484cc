/* Assembly of K and M from the elements of a model, and exchange of nodal values with other ranks. */
#ifndef HHTDAE_FLEXIBLE_ASSEMBLY_H
#define HHTDAE_FLEXIBLE_ASSEMBLY_H

#include "hhtdae/flexible.h"
#include <petscsf.h>

namespace hhtdae
{

/*
  The nodes of a rank's elements, owned by any rank, with local numbers in the order of their global numbers. In the star forest the
  model's nodes on their owners are the roots, these the leaves.
*/
class ElementNodes
{
public:
  std::vector<PetscInt> global; /* global numbers, sorted */
  PetscSF               sf = nullptr;

  ElementNodes() = default;
  ~ElementNodes();
  ElementNodes(const ElementNodes &) = delete;
  PetscErrorCode setUp(const FeModel &model) { return setUp(model, model.elements); }
  PetscErrorCode setUp(const FeModel &model, const std::vector<FeElement> &elements); /* only the nodes of these elements */
  PetscInt       place(PetscInt number) const;                                        /* local number of a global one */
  /* `width` values per node: bring() copies them from the owners to the ranks that need them, add() sums them on the owners */
  PetscErrorCode bring(int width, const double *own, double *here) const;
  PetscErrorCode add(int width, const double *here, double *own) const;
};

/*
  Assembles model->K and model->M from elements, materials and coordinates. tags: the elements' numbers in the mesh, for
  messages. -fe_mass_points stiffness integrates the mass at the points of the stiffness, as CalculiX does, instead of exactly.
*/
PetscErrorCode AssembleElements(FeModel *model, const std::vector<PetscInt> &tags);

} // namespace hhtdae

#endif
