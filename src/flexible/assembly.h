/* K and M of a model from its elements, and values of nodes on other ranks. */
#ifndef HHTDAE_FLEXIBLE_ASSEMBLY_H
#define HHTDAE_FLEXIBLE_ASSEMBLY_H

#include "hhtdae/flexible.h"
#include <petscsf.h>

namespace hhtdae
{

/*
  The nodes of a rank's elements, by a number of their own: sorted by global number, whoever owns them. The star forest
  has a model's own nodes as roots and these as leaves.
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
  PetscErrorCode setUp(const FeModel &model, const std::vector<FeElement> &elements); /* of these alone */
  PetscInt       place(PetscInt number) const; /* among global */
  /* width values per node, from the owners to all who need them, and summed back to the owners */
  PetscErrorCode bring(int width, const double *own, double *here) const;
  PetscErrorCode add(int width, const double *here, double *own) const;
};

/*
  Makes model->K and model->M from elements, materials and coordinates. tags: the elements' numbers in the mesh, for
  messages. -fe_mass_points stiffness takes the mass at the stiffness' points instead of integrating it exactly, as
  CalculiX does.
*/
PetscErrorCode AssembleElements(FeModel *model, const std::vector<PetscInt> &tags);

} // namespace hhtdae

#endif
