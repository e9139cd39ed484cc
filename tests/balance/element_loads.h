/*
  The forces and moments by which an element acts on bodies, from what its channels say and what the headers joints.h
  and forces.h promise of them: the reaction on i's body, its opposite on j's; the components of a force element in
  their axes. Nothing of the scene's own kernels is used.
*/
#ifndef HHTDAE_TESTS_BALANCE_ELEMENT_LOADS_H
#define HHTDAE_TESTS_BALANCE_ELEMENT_LOADS_H

#include "balance/specs.h"
#include "scene/model.h"

namespace hhtest
{

using hhtdae::Marker;
using hhtdae::Matrix3;
using hhtdae::Vector3;

/* A body as its channels show it, in space axes */
struct Pose {
  Vector3 r = Vector3::Zero(), v = Vector3::Zero(), a = Vector3::Zero(); /* centre of mass */
  Matrix3 A = Matrix3::Identity();
  Vector3 w = Vector3::Zero(), alpha = Vector3::Zero();
};

/* A force at a point and a moment, on a body; -1: the ground */
struct Load {
  PetscInt body;
  Vector3  at, force, moment;
};

/* Values of the channels of one element */
struct Reading {
  Vector3 force = Vector3::Zero(), moment = Vector3::Zero(); /* joints and motions: on i's body, in space axes, about i */
  std::vector<double> component;                             /* components of a force, or multipliers of a coupler */
};

class ElementLoads
{
public:
  ElementLoads(const hhtdae::SceneData &scene, const Specs &specs, const std::vector<Pose> &body)
      : scene_(scene), specs_(specs), body_(body)
  {
  }

  /* Whether the loads of an element can be computed: false for types that this file does not know, or that need a
     description which is not in `specs` */
  static bool known(const hhtdae::SceneData &scene, const Specs &specs, PetscInt element);
  static bool couples(const hhtdae::SceneData &scene,
                      PetscInt                 element); /* gears, racks and couplers: from multipliers */

  void add(PetscInt element, const Reading &r, std::vector<Load> &loads) const;

private:
  struct Place {
    Vector3 x, v;
    Matrix3 R;
  };
  const hhtdae::SceneData &scene_;
  const Specs             &specs_;
  const std::vector<Pose> &body_;

  Place    at(Marker m) const;
  PetscInt bodyOf(Marker m) const { return scene_.markers[(std::size_t)m.id].body; }

  void    pair(const hhtdae::ElementData &e, const Vector3 &x, const Vector3 &f, const Vector3 &m,
               std::vector<Load> &loads) const;
  void    coupler(PetscInt element, double multiplier, std::vector<Load> &loads) const;
  void    along(const hhtdae::ElementData &e, double pull, std::vector<Load> &loads) const;
  void    friction(const hhtdae::ElementData &e, const Reading &r, std::vector<Load> &loads) const;
  void    contact(PetscInt element, const Reading &r, std::vector<Load> &loads) const;
  void    user(PetscInt element, const Reading &r, std::vector<Load> &loads) const;
  void    six(const hhtdae::ElementData &e, const Reading &r, bool mean, std::vector<Load> &loads) const;
  Vector3 touch(PetscInt element) const;
};

} // namespace hhtest

#endif
