/* Checks of a finite-element model for a whole or a reduced body. All functions are collective. */
#ifndef HHTDAE_FLEXIBLE_BODY_CHECK_H
#define HHTDAE_FLEXIBLE_BODY_CHECK_H

#include "hhtdae/flexible.h"

namespace hhtdae
{

/* attachments.cpp: for a whole body, in which averaging attachments may share nodes with others, because each is a frame of its own */
PetscErrorCode CheckAttachments(const FeModel &model, const std::vector<Attachment> &attachments);

/* attachments.cpp: weights of an average for own nodes, which are counted from the first own node; 1 if none are given. a.weights follows the order of the labels of
   all nodes of the set, because global numbers depend on the distribution of the mesh over the ranks; its length must have been checked. */
PetscErrorCode WeightsOfNodes(const FeModel &model, const Attachment &a, const std::vector<PetscInt> &node, std::vector<double> *weight);

/* diagnose_elements.cpp: checks that the elements yield M, and K if it exists. who: the feature that needs this, as "geometric stiffening", for messages */
PetscErrorCode CheckElements(const FeModel &model, const std::string &who);

} // namespace hhtdae

#endif
