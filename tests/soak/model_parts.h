/* Reduced parts for the flexible bodies of the models: made once, from box meshes in memory */
#ifndef HHTDAE_SOAK_MODEL_PARTS_H
#define HHTDAE_SOAK_MODEL_PARTS_H

#include "box_model.h"
#include <memory>
#include <string>
#include <vector>

namespace soak
{

using ReducedPart = std::shared_ptr<const hhtdae::ModalBody>;

struct PartPlan {
  hhtest::Box box;
  bool        middle; /* with a third attachment, in the middle of the top */
  int         modes;
};

inline PetscErrorCode MakePart(const PartPlan &plan, const std::string &name, ReducedPart *part)
{
  hhtdae::FeModel     model(PETSC_COMM_SELF);
  hhtdae::Reduction   reduction;
  hhtdae::ReducedBody body;
  PetscFunctionBegin;
  hhtest::BoxBuilder builder(plan.box, &model);
  const double      *size       = plan.box.size;
  const double       half       = 1.01 * size[0] / plan.box.n[0];
  reduction.attachments         = {hhtdae::Attachment(), hhtdae::Attachment()};
  reduction.attachments[0].name = "left";
  reduction.attachments[1].name = "right";
  if (plan.middle) {
    builder.addSet("middle", [&](const hhtdae::Vector3 &x) {
      return std::abs(x[0] - size[0] / 2) < half && x[2] > 0.99 * size[2];
    });
    reduction.attachments.emplace_back();
    reduction.attachments.back().name = "middle";
    reduction.attachments.back().tie  = hhtdae::Tie::Average;
  }
  reduction.modes     = plan.modes;
  reduction.all_nodes = false;
  PetscCall(hhtdae::Reduce(model, reduction, &body));
  body.modal.name = name;
  *part           = std::make_shared<hhtdae::ModalBody>(body.modal);
  PetscFunctionReturn(0);
}

/* with 6 to 20 modes, including those of the attachments */
inline PetscErrorCode MakeParts(std::vector<ReducedPart> *parts)
{
  const hhtdae::Material      steel{2.1e11, 0.3, 7850}, plastic{2e9, 0.38, 1100}, rubber{2e7, 0.45, 1200};
  const std::vector<PartPlan> plans = {{{{8, 1, 1}, {1, 0.06, 0.04}, steel}, false, 6},
                                       {{{8, 1, 1}, {0.8, 0.05, 0.03}, plastic}, false, 4},
                                       {{{8, 2, 1}, {0.6, 0.2, 0.02}, steel}, true, 8},
                                       {{{8, 1, 1}, {0.5, 0.1, 0.08}, rubber}, true, 2}};
  PetscFunctionBegin;
  parts->resize(plans.size());
  for (std::size_t k = 0; k < plans.size(); k++)
    PetscCall(MakePart(plans[k], "part " + std::to_string(k), &(*parts)[k]));
  PetscFunctionReturn(0);
}

} // namespace soak

#endif
