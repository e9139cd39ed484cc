/* A distributed directory of a mesh's nodes: each rank stores the nodes with numbers in its range and answers the requests of others. */
#ifndef HHTDAE_FLEXIBLE_MESH_NODES_H
#define HHTDAE_FLEXIBLE_MESH_NODES_H

#include "flexible/mesh_file.h"

namespace hhtdae
{

/* The index of a node is its position, from 0, in the order of the numbers in the file */
class MeshNodes
{
public:
  explicit MeshNodes(MPI_Comm comm) : comm_(comm) {}
  PetscInt count() const { return offset_.back(); }

  /* Moves the file's points into the directory, and replaces node numbers in cells and members by indices. Collective, as are all functions */
  PetscErrorCode build(const std::string &file, MeshFile *mesh);
  /* Points and regions of the nodes with these indices; regions as pairs (position in `index`, region) */
  PetscErrorCode ask(const std::vector<PetscInt> &index, std::vector<MeshPoint> *points,
                     std::vector<MeshMember> *regions) const;

private:
  MPI_Comm                comm_;
  std::vector<MeshPoint>  points_; /* sorted */
  std::vector<MeshMember> members_;
  std::vector<PetscInt>   offset_; /* index of each rank's first node; at the end the number of nodes */

  PetscErrorCode collect(const std::string &file, MeshFile *mesh, PetscInt64 range);
  PetscErrorCode resolve(const std::string &file, MeshFile *mesh, PetscInt64 range) const;
  PetscErrorCode keepMembers(MeshFile *mesh);
  int            rankOf(PetscInt index) const;
};

} // namespace hhtdae

#endif
