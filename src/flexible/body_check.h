/* What is wrong with a model that a body is made of, whole or reduced. All functions are collective. */
#ifndef HHTDAE_FLEXIBLE_BODY_CHECK_H
#define HHTDAE_FLEXIBLE_BODY_CHECK_H

#include "hhtdae/flexible.h"

namespace hhtdae
{

/* attachments.cpp: of a whole body, whose averages are frames of their own and may share nodes */
PetscErrorCode CheckAttachments(const FeModel &model, const std::vector<Attachment> &attachments);

/* diagnose_elements.cpp: do the elements make M, and K if it is there? `who` needs them to: "geometric stiffening" */
PetscErrorCode CheckElements(const FeModel &model, const std::string &who);

} // namespace hhtdae

#endif
