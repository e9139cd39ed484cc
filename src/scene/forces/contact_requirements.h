/* Checks of the contact law of contacts and stops */
#ifndef HHTDAE_SCENE_FORCES_CONTACT_REQUIREMENTS_H
#define HHTDAE_SCENE_FORCES_CONTACT_REQUIREMENTS_H

#include "requirements.h"
#include "scene/kernels/contact_law.h"

namespace hhtdae
{

inline const ContactLaw &CheckedLaw(ElementBuilder &e, const ContactLaw &law)
{
  RequirePositive(e, "stiffness", law.stiffness);
  RequireNotNegative(e, "damping", law.damping);
  RequireNotNegative(e, "friction coefficient", law.friction);
  RequirePositive(e, "slip velocity", law.slip_velocity);
  e.require(std::isfinite(law.exponent) && law.exponent >= 1,
            "exponent is " + Show(law.exponent) + ", must be 1 or more (Hertz: 1.5)");
  return law;
}

} // namespace hhtdae

#endif
