/* Nodes that a reduction keeps for markers, forces and contact, with their translations and rotations in the modes. */
#ifndef HHTDAE_FLEXIBLE_KEPT_NODES_H
#define HHTDAE_FLEXIBLE_KEPT_NODES_H

#include "hhtdae/flexible.h"
#include "modes.h"

namespace hhtdae
{

/* For each label of a list that is the same on all ranks: the own node, counted from the first own node, or -1 if another rank owns it. who: the origin of the labels, as
   "Reduction::nodes", for the error if no rank has one. Collective */
PetscErrorCode FindLabels(const FeModel &model, const std::vector<PetscInt> &label, const std::string &who, std::vector<PetscInt> *own);

/* Labels of all nodes to be kept, ascending, on all ranks; own: result of FindLabels() */
struct KeptNodes {
  std::vector<PetscInt> label, own;
};
PetscErrorCode ResolveKeptNodes(const FeModel &model, const Reduction &reduction, KeptNodes *kept);

/* Sets body->nodes from the modes x at own dofs */
PetscErrorCode FillNodes(const FeModel &model, const KeptNodes &kept, const MatrixXd &x, ModalBody *body);

} // namespace hhtdae

#endif
