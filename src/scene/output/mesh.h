/* The mesh of an animation, whose points are fixed to bodies. It is the same on every rank; only the first rank uses it. */
#ifndef HHTDAE_SCENE_OUTPUT_MESH_H
#define HHTDAE_SCENE_OUTPUT_MESH_H

#include "scene/scene_data.h"

namespace hhtdae
{

struct Mesh {
  struct Point {
    PetscInt body; /* -1: ground */
    Vector3  s;    /* position relative to the centre of mass, body axes */
  };
  struct Cells {
    std::vector<PetscInt> body, point, end; /* body of each cell; points of all cells; end of each cell's points in `point` */
    void close(PetscInt b)
    {
      body.push_back(b);
      end.push_back((PetscInt)point.size());
    }
  };
  std::vector<Point> point;
  Cells              lines, polygons;
};

/* The mesh of the user's shapes and lines. Bodies without these have lines from the centre of mass to the markers and an
   octahedron with its corners at the ends of the axes of the ellipsoid that has the body's inertia */
Mesh MakeMesh(const SceneData &s);

} // namespace hhtdae

#endif
