/* The mesh of an animation, whose points are fixed to bodies. The same on every rank; only the first one uses it. */
#ifndef HHTDAE_SCENE_OUTPUT_MESH_H
#define HHTDAE_SCENE_OUTPUT_MESH_H

#include "scene/scene_data.h"

namespace hhtdae
{

struct Mesh {
  struct Point {
    PetscInt body; /* -1: ground */
    Vector3  s;    /* from the centre of mass, body axes */
  };
  struct Cells {
    std::vector<PetscInt> body, point, end; /* of each cell: its body; points of all cells; where those of each cell end */
    void close(PetscInt b)
    {
      body.push_back(b);
      end.push_back((PetscInt)point.size());
    }
  };
  std::vector<Point> point;
  Cells              lines, polygons;
};

/* Shapes and lines of the user; for bodies that have none, lines from the centre of mass to the markers and an octahedron on the
   axes of the ellipsoid that has the body's inertia */
Mesh MakeMesh(const SceneData &s);

} // namespace hhtdae

#endif
