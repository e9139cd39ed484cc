/*
  What a scene's description says of its elements, kept beside the scene: the loads of some elements follow from their
  components and markers only together with a radius, a ratio or a frame, which no channel gives.

    Element e = specs.add(scene, "", SpherePlane{...});   in place of scene.add()
*/
#ifndef HHTDAE_TESTS_BALANCE_SPECS_H
#define HHTDAE_TESTS_BALANCE_SPECS_H

#include "hhtdae/scene.h"
#include <any>
#include <map>

namespace hhtest
{

class Specs
{
public:
  template <class Spec> hhtdae::Element add(hhtdae::Scene &scene, const std::string &name, const Spec &spec)
  {
    const hhtdae::Element e = scene.add(name, spec);
    keep(e, spec);
    return e;
  }
  template <class Spec> void keep(hhtdae::Element e, const Spec &spec) { all_[e.id] = spec; }
  /* null: the element was added without specs, or is of another type */
  template <class Spec> const Spec *of(PetscInt element) const
  {
    const auto at = all_.find(element);
    return at == all_.end() ? nullptr : std::any_cast<Spec>(&at->second);
  }

private:
  std::map<PetscInt, std::any> all_;
};

} // namespace hhtest

#endif
