/* Nodes that a reduction keeps for markers, forces and contact: which ones, how the modes move and turn them. */
#ifndef HHTDAE_FLEXIBLE_KEPT_NODES_H
#define HHTDAE_FLEXIBLE_KEPT_NODES_H

#include "hhtdae/flexible.h"
#include "modes.h"

namespace hhtdae
{

/* Own nodes, from 0, of each label of a list that is the same on all ranks; -1: another rank has it. who: "Reduction::nodes", for the
   error if no rank has it. Collective */
PetscErrorCode FindLabels(const FeModel &model, const std::vector<PetscInt> &label, const std::string &who, std::vector<PetscInt> *own);

/* Labels of all nodes that are to be kept, ascending, on all ranks, and which of them are own nodes, by FindLabels() */
struct KeptNodes {
  std::vector<PetscInt> label, own;
};
PetscErrorCode ResolveKeptNodes(const FeModel &model, const Reduction &reduction, KeptNodes *kept);

/* Fills body->nodes from the modes x at own dofs */
PetscErrorCode FillNodes(const FeModel &model, const KeptNodes &kept, const MatrixXd &x, ModalBody *body);

} // namespace hhtdae

#endif
