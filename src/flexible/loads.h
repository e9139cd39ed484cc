/* Load cases of a reduction: nodal forces and pressure on a surface, projected on the modes (ModalLoadCase of hhtdae/modal.h). */
#ifndef HHTDAE_FLEXIBLE_LOADS_H
#define HHTDAE_FLEXIBLE_LOADS_H

#include "diagnose.h"
#include "modes.h"
#include "scene/small_matrix.h"

namespace hhtdae
{

/* This rank's part of a load case */
struct ResolvedLoad {
  struct NodeForce {
    PetscInt node; /* own node, counted from the first own node */
    Vector3  force;
  };
  struct ElementFace {
    std::size_t element;
    int         face;
  };
  std::vector<NodeForce>   forces;
  std::vector<ElementFace> faces;
};

/* Finds nodes and faces, and checks the load cases, before any work is done */
PetscErrorCode ResolveLoads(const FeModel &model, const std::vector<LoadCase> &loads, std::vector<ResolvedLoad> *resolved);

/* Sets body->loads from the modes x at own dofs */
PetscErrorCode FillLoads(const FeModel &model, const std::vector<LoadCase> &loads, const std::vector<ResolvedLoad> &resolved, const BodyScales &scales,
                         const MatrixXd &x, ModalBody *body);

} // namespace hhtdae

#endif
