/*
  Unknowns that a scene gets from another library: coordinates of a kind that it does not know, with mass and forces of their own,
  and holonomic constraints between them and bodies. Every rank has its part; the numbers are behind those of the scene on each rank.
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
  virtual PetscInt multipliers() const        = 0; /* of this rank, behind its coordinates; their rows are holonomic constraints */
  virtual void     initial(double *u, double *v) const = 0; /* own coordinates */
  virtual void     startFrom(const double *u, const double *v) = 0; /* these become the initial coordinates and velocities */
  virtual void     localize(Localizer &l, std::vector<std::unique_ptr<Batch>> &batches) const = 0;
  virtual bool     vectors() const { return false; } /* the coordinates are vectors in space axes, three behind one another */
  /* What a page shows of it, at most so many nodes; none where its shape is not known. Collective */
  virtual PetscErrorCode pageMesh(std::size_t most_nodes, std::unique_ptr<PageMesh> *) const
  {
    (void)most_nodes;
    return 0;
  }
  virtual const std::string &bodyName() const = 0; /* one that no other body of the scene has */
  virtual std::string nameOf(PetscMPIInt rank, PetscInt unknown) const = 0; /* of the unknowns of a rank, for messages */
  PetscInt         unknowns() const { return coordinates() + multipliers(); }

  std::vector<PetscInt> start; /* global number of the first unknown on every rank; numbering.cpp */
};

} // namespace hhtdae

#endif
