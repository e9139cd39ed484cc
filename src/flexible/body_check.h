/* What is wrong with a model that a body is made of, whole or reduced. All functions are collective. */
#ifndef HHTDAE_FLEXIBLE_BODY_CHECK_H
#define HHTDAE_FLEXIBLE_BODY_CHECK_H

#include "hhtdae/flexible.h"

namespace hhtdae
{

/* attachments.cpp: of a whole body, whose averages are frames of their own and may share nodes */
PetscErrorCode CheckAttachments(const FeModel &model, const std::vector<Attachment> &attachments);

/* attachments.cpp: weights of own nodes of an average, counted from the first own node, 1 if none are given. They are given in the order of the labels of
   all nodes of the set: global numbers depend on how the mesh is divided among the ranks. Their number has been checked. */
PetscErrorCode WeightsOfNodes(const FeModel &model, const Attachment &a, const std::vector<PetscInt> &node, std::vector<double> *weight);

/* diagnose_elements.cpp: do the elements make M, and K if it is there? `who` needs them to: "geometric stiffening" */
PetscErrorCode CheckElements(const FeModel &model, const std::string &who);

} // namespace hhtdae

#endif
