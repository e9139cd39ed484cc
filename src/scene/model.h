/* A description that is fixed, with the numbers of its unknowns: what all runs of a scene share. */
#ifndef HHTDAE_SCENE_MODEL_H
#define HHTDAE_SCENE_MODEL_H

#include "scene_data.h"

namespace hhtdae
{

/* Numbers of all unknowns of the scene, known on every rank; within a rank: bodies, multipliers and force states kernel by
   kernel, variables, states */
struct Numbering {
  std::vector<PetscMPIInt> owner;    /* of bodies; empty on one rank */
  std::vector<PetscInt>    first;    /* of ranks, and the total */
  std::vector<PetscInt>    body;     /* first coordinate */
  std::vector<PetscInt>    variable, state;
  std::vector<PetscMPIInt> variable_owner, state_owner;
};

struct Model {
  SceneData   scene; /* once compiled: assembled, in equilibrium if that was asked for, without redundant rows */
  bool        compiled = false;
  bool        continues = false; /* from where another run was, at this time, with its owners of bodies */
  double      left      = 0;     /* by that run's tolerance, of misfits of positions: parts of the scene's size */
  double      begin     = 0, first = 0; /* first: where the first of these runs began */
  PetscMPIInt rank = 0, size = 1;
  Numbering   number;
  std::vector<Matrix3> described; /* attitudes of the bodies, before assembly and equilibrium moved them */
  std::vector<double>  turned;    /* what this rank's elements and functions remember of the way to equilibrium: angles over full turns, points on curves */
  PetscInt             n = 0, start = 0; /* own unknowns, global number of the first */
};

struct SceneAccess {
  static std::shared_ptr<Model> &model(Scene &s) { return s.model_; }
  static const std::shared_ptr<Model> &model(const Scene &s) { return s.model_; }
  static void record(Scene &s, std::function<void(Scene &)> call) /* notes what another library adds */
  {
    if (s.recording()) s.record(std::move(call));
  }
};
/* The model of a scene, whether it has been compiled or not; what has been is not to be changed */
inline const Model &ModelOf(const Scene &scene) { return *SceneAccess::model(scene); }
inline SceneData   &DataOf(Scene &scene) { return SceneAccess::model(scene)->scene; }
inline const SceneData &DataOf(const Scene &scene) { return SceneAccess::model(scene)->scene; }

/* partition.cpp: owners of bodies, METIS */
PetscErrorCode Partition(SceneData &s, PetscMPIInt size, std::vector<PetscMPIInt> &owner);
/* numbering.cpp */
PetscMPIInt    OwnerOf(const Model &M, const StoreBase &s, PetscInt e);
PetscErrorCode Number(Model &M);
BodyKind       KindOf(const SceneData &s, const BodyData &b);
PetscInt       CoordinatesOf(const SceneData &s, const BodyData &b); /* modal ones too */
/* unknown_name.cpp: by its global number, for messages; the same on every rank */
std::string UnknownName(const Model &M, PetscInt row);
/* expressions.cpp: variables, states, user's forces */
PetscMPIInt OwnerOf(const Model &M, const Expression &e);
/* check.cpp: everything that is wrong with the description, as one error */
PetscErrorCode CheckDescription(SceneData &s);
PetscErrorCode CheckUnchanged(const SceneData &s, const StartPolicy &start);

} // namespace hhtdae

#endif
