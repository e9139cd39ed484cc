/* The data that all runs of a scene share: the description after its set-up, and the numbering of unknowns. */
#ifndef HHTDAE_SCENE_MODEL_H
#define HHTDAE_SCENE_MODEL_H

#include "scene_data.h"

namespace hhtdae
{

/* Global numbers of all unknowns, the same on every rank. Their order within a rank is: coordinates of bodies, multipliers and force states kernel by
   kernel, variables, first-order states, unknowns of extensions. */
struct Numbering {
  std::vector<PetscMPIInt> owner;    /* owner of each body; empty on one rank */
  std::vector<PetscInt>    first;    /* first unknown of each rank, and the total number */
  std::vector<PetscInt>    body;     /* first coordinate of each body */
  std::vector<PetscInt>    variable, state;
  std::vector<PetscMPIInt> variable_owner, state_owner;
};

struct Model {
  SceneData            scene; /* when `compiled`: assembled, with -scene_equilibrium in equilibrium, and without redundant rows */
  bool        compiled = false;
  bool                 continues        = false;   /* whether the run continues another one from its state; it has the same owners of bodies */
  /* violation of constraints, relative to the mechanism's size, that is accepted because of the tolerance of the
     continued run */
  double               inherited_misfit = 0;
  /* times at which this run begins, and at which the first run of the chain of continued runs began */
  double               begin = 0, first_begin = 0;
  PetscMPIInt rank = 0, size = 1;
  Numbering   number;
  std::vector<Matrix3> described; /* attitudes of the bodies before assembly and equilibrium rotated them */
  std::vector<double>  start_memories;   /* memories of this rank's elements and functions after equilibrium: angles over full turns, points on curves */
  PetscInt             n = 0, start = 0; /* number of own unknowns, and global number of the first */
};

struct SceneAccess {
  static std::shared_ptr<Model> &model(Scene &s) { return s.model_; }
  static const std::shared_ptr<Model> &model(const Scene &s) { return s.model_; }
  /* records a call by which another library adds to the scene, so that the call is repeated when the scene is described
     anew */
  static void                          record(Scene &s, std::function<void(Scene &)> call)
  {
    if (s.recording()) s.record(std::move(call));
  }
};
/* The model of a scene, compiled or not; a compiled one must not be changed */
inline const Model &ModelOf(const Scene &scene) { return *SceneAccess::model(scene); }
inline SceneData   &DataOf(Scene &scene) { return SceneAccess::model(scene)->scene; }
inline const SceneData &DataOf(const Scene &scene) { return SceneAccess::model(scene)->scene; }

/* partition.cpp: chooses the owners of bodies by METIS */
PetscErrorCode Partition(SceneData &s, PetscMPIInt size, std::vector<PetscMPIInt> &owner);
/* numbering.cpp */
PetscMPIInt    OwnerOf(const Model &M, const StoreBase &s, PetscInt e);
PetscErrorCode Number(Model &M);
BodyKind       KindOf(const SceneData &s, const BodyData &b);
PetscInt       CoordinatesOf(const SceneData &s, const BodyData &b); /* number of coordinates, including modal ones */
/* unknown_name.cpp: name of an unknown by its global number, for messages; the same on every rank */
std::string UnknownName(const Model &M, PetscInt row);
/* expressions.cpp: the owner of a variable or state with this expression */
PetscMPIInt OwnerOf(const Model &M, const Expression &e);
/* check.cpp. CheckDescription(): one error with all mistakes in the description. CheckUnchanged(): an error if anything was added since setUp() */
PetscErrorCode CheckDescription(SceneData &s);
PetscErrorCode CheckUnchanged(const SceneData &s);

} // namespace hhtdae

#endif
