/* The contents of a Gmsh file, each rank with a share of its nodes and elements. */
#ifndef HHTDAE_FLEXIBLE_MESH_FILE_H
#define HHTDAE_FLEXIBLE_MESH_FILE_H

#include "hhtdae/flexible.h"
#include <string>
#include <vector>

namespace hhtdae
{

struct MeshGroup { /* physical group */
  int         dim, tag;
  std::string name; /* its number if the file does not name it */
};

struct MeshRegion { /* the elements of one geometric entity (msh 4), or of one physical group (msh 2) */
  int              dim, tag;
  std::vector<int> groups; /* indices in MeshFile::groups */
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

struct MeshMember { /* a node of an element in a region that belongs to groups */
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
  PetscInt                elements = 0; /* number of elements of any dimension in the whole file */
};

/* Reads msh 4.1 and 2.2, text and binary. Collective */
PetscErrorCode ReadGmsh(MPI_Comm comm, const std::string &file, MeshFile *mesh);

} // namespace hhtdae

#endif
