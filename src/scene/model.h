/* What all runs of a scene share: the description after its set-up, and the numbering of unknowns. */
#ifndef HHTDAE_SCENE_MODEL_H
#define HHTDAE_SCENE_MODEL_H

#include "scene_data.h"

namespace hhtdae
{

/* Global numbers of all unknowns, known on every rank; order within a rank: bodies, multipliers and force states kernel by
   kernel, variables, first-order states */
struct Numbering {
  std::vector<PetscMPIInt> owner;    /* of bodies; empty on one rank */
  std::vector<PetscInt>    first;    /* first unknown of each rank, and the total number */
  std::vector<PetscInt>    body;     /* first coordinate of each body */
  std::vector<PetscInt>    variable, state;
  std::vector<PetscMPIInt> variable_owner, state_owner;
};

struct Model {
  SceneData            scene; /* once compiled: assembled, in equilibrium with -scene_equilibrium, without redundant rows */
  bool        compiled = false;
  bool                 continues        = false;   /* the run continues another one from its state, with the same owners of bodies */
  double               inherited_misfit = 0;       /* violation of constraints, relative to the mechanism's size, that the tolerance of the continued run allows */
  double               begin = 0, first_begin = 0; /* times at which this run, and the first of the continued runs, begins */
  PetscMPIInt rank = 0, size = 1;
  Numbering   number;
  std::vector<Matrix3> described; /* attitudes of the bodies, before assembly and equilibrium moved them */
  std::vector<double>  start_memories;   /* memories of this rank's elements and functions after equilibrium: angles over full turns, points on curves */
  PetscInt             n = 0, start = 0; /* own unknowns, global number of the first */
};

struct SceneAccess {
  static std::shared_ptr<Model> &model(Scene &s) { return s.model_; }
  static const std::shared_ptr<Model> &model(const Scene &s) { return s.model_; }
  static void                          record(Scene &s, std::function<void(Scene &)> call) /* records the call by which another library adds to the scene, for describing it anew */
  {
    if (s.recording()) s.record(std::move(call));
  }
};
/* The model of a scene, compiled or not; a compiled one must not be changed */
inline const Model &ModelOf(const Scene &scene) { return *SceneAccess::model(scene); }
inline SceneData   &DataOf(Scene &scene) { return SceneAccess::model(scene)->scene; }
inline const SceneData &DataOf(const Scene &scene) { return SceneAccess::model(scene)->scene; }

/* partition.cpp: owners of bodies, METIS */
PetscErrorCode Partition(SceneData &s, PetscMPIInt size, std::vector<PetscMPIInt> &owner);
/* numbering.cpp */
PetscMPIInt    OwnerOf(const Model &M, const StoreBase &s, PetscInt e);
PetscErrorCode Number(Model &M);
BodyKind       KindOf(const SceneData &s, const BodyData &b);
PetscInt       CoordinatesOf(const SceneData &s, const BodyData &b); /* number, with modal coordinates */
/* unknown_name.cpp: name of an unknown by its global number, for messages; the same on every rank */
std::string UnknownName(const Model &M, PetscInt row);
/* expressions.cpp: owner of a variable or state with this expression */
PetscMPIInt OwnerOf(const Model &M, const Expression &e);
/* check.cpp: one error with everything that is wrong with the description */
PetscErrorCode CheckDescription(SceneData &s);
PetscErrorCode CheckUnchanged(const SceneData &s);

} // namespace hhtdae

#endif
