/* Checks of numbers and markers when forces are added, with error messages that say what to do */
#ifndef HHTDAE_SCENE_FORCES_REQUIREMENTS_H
#define HHTDAE_SCENE_FORCES_REQUIREMENTS_H

#include "scene/scene_data.h"
#include <cmath>
#include <string>

namespace hhtdae
{

inline void RequireFinite(ElementBuilder &e, const std::string &what, double x)
{
  e.require(std::isfinite(x), what + " is " + Show(x) + ", must be finite");
}

inline void RequireNotNegative(ElementBuilder &e, const std::string &what, double x)
{
  e.require(std::isfinite(x) && x >= 0, what + " is " + Show(x) + ", must be finite and not negative");
}

inline void RequirePositive(ElementBuilder &e, const std::string &what, double x)
{
  e.require(std::isfinite(x) && x > 0, what + " is " + Show(x) + ", must be finite and positive");
}

inline std::string Component(const std::string &what, int k) { return what + " " + "xyz"[k]; }

inline void RequireFinite(ElementBuilder &e, const std::string &what, const Vector3 &x)
{
  for (int k = 0; k < 3; k++) RequireFinite(e, Component(what, k), x(k));
}

inline void RequireNotNegative(ElementBuilder &e, const std::string &what, const Vector3 &x)
{
  for (int k = 0; k < 3; k++) RequireNotNegative(e, Component(what, k), x(k));
}

/* The markers must be on different bodies, since action and reaction on one body cancel */
inline void RequireTwoBodies(ElementBuilder &e, Marker i, Marker j)
{
  if (!e.good()) return;
  const PetscInt b = e.scene().markers[i.id].body;
  e.require(b != e.scene().markers[j.id].body,
            "both markers are on " + e.scene().bodyName(b) + ", where its action and reaction cancel");
}

inline bool OnPoint(const ElementBuilder &e, Marker m) { return e.scene().turnless(e.scene().markers[m.id].body); }

/* It must be possible that a moment acts on the body of m */
inline void RequireTurning(ElementBuilder &e, Marker m, const char *marker)
{
  if (!e.good()) return;
  if (OnPoint(e, m))
    e.require(false, std::string("marker ") + marker + " is on " + e.scene().turnlessName(e.scene().markers[m.id].body) +
                       ", which takes no moment; use a rigid body");
}

/* The same for a contact, which is also allowed at a node of a flexible body without rotation: its shape rotates with the
   floating frame of the body */
inline void RequireNoPoint(ElementBuilder &e, Marker m, const char *marker)
{
  const PetscInt b = e.good() ? e.scene().markers[m.id].body : -1;
  if (b >= 0 && e.scene().bodies[b].point) RequireTurning(e, m, marker);
}

} // namespace hhtdae

#endif
