/*
  An extension is a set of unknowns that another library adds to a scene, such as the nodes of a whole finite-element body:
  coordinates, with their mass and forces, and multipliers of holonomic constraints between these coordinates and bodies. Each
  rank has a part of the unknowns, whose numbers follow those of the scene's own unknowns on the rank.
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
  virtual PetscInt coordinates() const        = 0; /* number on this rank */
  /* number on this rank; numbered after the coordinates; their rows are holonomic constraints */
  virtual PetscInt multipliers() const                                                        = 0;
  virtual void     initial(double *u, double *v) const = 0; /* initial coordinates and velocities of this rank */
  virtual void     startFrom(const double *u, const double *v)                                = 0; /* sets the initial coordinates and velocities */
  virtual void     localize(Localizer &l, std::vector<std::unique_ptr<Batch>> &batches) const = 0;
  virtual bool     vectors() const { return false; } /* whether each three consecutive coordinates are a vector in space axes */
  /* The mesh that a page (output/page.cpp) shows, with at most most_nodes nodes; null if the shape is not known. Collective */
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
