/* A Gmsh file as it stands on disk, each rank with a share of its nodes and elements. */
#ifndef HHTDAE_FLEXIBLE_MESH_FILE_H
#define HHTDAE_FLEXIBLE_MESH_FILE_H

#include "hhtdae/flexible.h"
#include <string>
#include <vector>

namespace hhtdae
{

struct MeshGroup { /* physical group */
  int         dim, tag;
  std::string name; /* its number if the file has no name */
};

struct MeshRegion { /* the elements of one entity of the geometry (msh 4), or of one physical group (msh 2) */
  int              dim, tag;
  std::vector<int> groups; /* among MeshFile::groups */
};

struct MeshPoint {
  PetscInt tag;
  double   x[3];
};

struct MeshCell {
  PetscInt    tag, region;
  ElementType type;
  PetscInt    node[20]; /* tags */
};

struct MeshMember { /* a node of an element of a region with groups */
  PetscInt node, region;
  bool     operator<(const MeshMember &o) const { return node != o.node ? node < o.node : region < o.region; }
  bool     operator==(const MeshMember &o) const { return node == o.node && region == o.region; }
};

struct MeshFile {
  std::vector<MeshGroup>  groups;  /* the same on all ranks */
  std::vector<MeshRegion> regions; /* likewise */
  std::vector<MeshPoint>  points;  /* this rank's share, as are the following */
  std::vector<MeshCell>   cells;
  std::vector<MeshMember> members;
  PetscInt                elements = 0; /* of any dimension, in the file */
};

/* msh 4.1 and 2.2, text and binary. Collective */
PetscErrorCode ReadGmsh(MPI_Comm comm, const std::string &file, MeshFile *mesh);

} // namespace hhtdae

#endif
