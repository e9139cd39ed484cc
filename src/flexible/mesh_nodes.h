/* The directory of a mesh's nodes: each rank keeps those with numbers in its range, and answers the others. */
#ifndef HHTDAE_FLEXIBLE_MESH_NODES_H
#define HHTDAE_FLEXIBLE_MESH_NODES_H

#include "flexible/mesh_file.h"

namespace hhtdae
{

/* Nodes of the file are counted in the order of their numbers, from 0: their index */
class MeshNodes
{
public:
  explicit MeshNodes(MPI_Comm comm) : comm_(comm) {}
  PetscInt count() const { return offset_.back(); }

  /* Takes the file's points, and replaces numbers of nodes in cells and members by indices. Collective, as are all */
  PetscErrorCode build(const std::string &file, MeshFile *mesh);
  /* Points and regions of nodes; regions as pairs (place among the nodes asked for, region) */
  PetscErrorCode ask(const std::vector<PetscInt> &index, std::vector<MeshPoint> *points,
                     std::vector<MeshMember> *regions) const;

private:
  MPI_Comm                comm_;
  std::vector<MeshPoint>  points_; /* sorted */
  std::vector<MeshMember> members_;
  std::vector<PetscInt>   offset_; /* index of each rank's first */

  PetscErrorCode collect(const std::string &file, MeshFile *mesh, PetscInt64 range);
  PetscErrorCode resolve(const std::string &file, MeshFile *mesh, PetscInt64 range) const;
  PetscErrorCode keepMembers(MeshFile *mesh);
  int            home(PetscInt index) const;
};

} // namespace hhtdae

#endif
