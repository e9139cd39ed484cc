/* Common part of joints between two markers: an ElementBuilder that knows the markers and checks that moments can act on the bodies of
   markers whose axes are used. */
#ifndef HHTDAE_SCENE_JOINT_BUILDER_H
#define HHTDAE_SCENE_JOINT_BUILDER_H

#include "scene/scene_data.h"
#include <cmath>
#include <cstdio>

namespace hhtdae
{

class JointBuilder : public ElementBuilder
{
public:
  JointBuilder(Scene &scene, const std::string &name, const char *type, Marker i, Marker j)
      : ElementBuilder(scene, name, type, ElementData::Joint, i, j), marker_{i, j}
  {
    if (!good()) return;
    const PetscInt body_i = body(0), body_j = body(1);
    require(body_i != body_j, "both markers are on " + this->scene().bodyName(body_i) + ", must be on two bodies");
  }

  Frame<double> start(int k) const { return frame(marker_[k]); }
  double        startDistance() const { return (start(0).x - start(1).x).norm(); }

  void spatialOnly()
  {
    require(!planar(),
            "not for planar scenes; these have revolute, translational and fixed joints, point distances, points on "
            "curves, rolling discs, gears, racks, couplers and user constraints");
  }
  void positive(const char *what, double value)
  {
    require(std::isfinite(value) && value > 0,
            std::string(what) + " is " + Show(value) + ", must be positive and finite");
  }

  /* Adds the rows of kernel K. If they depend on the axes of a marker, it must be possible that moments act on its body. */
  template <class K> void rows(const typename K::Data &data = {})
  {
    for (int k = 0; k < 2 && good(); k++) {
      if (!Depends(K::depends, 2 * k + 1) || body(k) < 0) continue;
      if (scene().turnless(body(k)))
        require(false, std::string("marker ") + (k == 0 ? "i" : "j") + " is on " + scene().turnlessName(body(k)) + ", must be on a rigid body or the ground");
    }
    if (good()) constrain<K>({marker_[0], marker_[1]}, data);
  }

  /* Adds rows for axes that stay parallel or antiparallel, as described */
  template <class K> void branchRows()
  {
    if (good()) rows<K>(K::branch(start(0), start(1)));
  }
  /* Adds rows for all three axes. It is an error if the axes of i are nearer to a cyclic permutation of those of j, which
     indicates a mistake in the description (SceneCheck.MarkersWithOtherAxes) */
  template <class K> void orientationRows()
  {
    if (!good()) return;
    double     least_cosine;
    const auto data = K::branch(start(0), start(1), &least_cosine);
    require(least_cosine > -0.25, "the axes of markers i and j are not parallel at the start: x_i, y_i and z_i must be along x_j, y_j and z_j, or two of them opposite");
    rows<K>(data);
  }

private:
  Marker   marker_[2];
  PetscInt body(int k) const { return scene().markers[marker_[k].id].body; }
};

} // namespace hhtdae

#endif
