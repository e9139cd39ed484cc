/*
  Unknowns that another library adds to a scene: coordinates, with their own mass and forces, and holonomic constraints between them and
  bodies. Each rank has a part of them; their numbers follow those of the scene's own unknowns on the rank.
*/
#ifndef HHTDAE_SCENE_EXTENSION_H
#define HHTDAE_SCENE_EXTENSION_H

#include "scene_data.h"

namespace hhtdae
{

class PageMesh; /* output/page_mesh.h */

class Extension
{
public:
  virtual ~Extension()                        = default;
  virtual PetscInt coordinates() const        = 0; /* of this rank */
  virtual PetscInt multipliers() const                                                        = 0; /* of this rank, numbered after its coordinates; their rows are holonomic constraints */
  virtual void     initial(double *u, double *v) const = 0; /* own coordinates */
  virtual void     startFrom(const double *u, const double *v)                                = 0; /* sets the initial coordinates and velocities */
  virtual void     localize(Localizer &l, std::vector<std::unique_ptr<Batch>> &batches) const = 0;
  virtual bool     vectors() const { return false; } /* coordinates are consecutive triples, vectors in space axes */
  /* The mesh that a page shows, of at most most_nodes nodes; null if the shape is not known. Collective */
  virtual PetscErrorCode pageMesh(std::size_t most_nodes, std::unique_ptr<PageMesh> *) const
  {
    (void)most_nodes;
    return 0;
  }
  virtual const std::string &bodyName() const                                 = 0; /* unique among the bodies of the scene */
  virtual std::string        nameOf(PetscMPIInt rank, PetscInt unknown) const = 0; /* name of an unknown of a rank, for messages */
  PetscInt         unknowns() const { return coordinates() + multipliers(); }

  std::vector<PetscInt> start; /* global number of the first unknown on every rank; numbering.cpp */
};

} // namespace hhtdae

#endif
