/* The vehicle's frame in the page of a run: its surface, coloured by stress. */
#ifndef HHTEX_ATV_SURFACE_H
#define HHTEX_ATV_SURFACE_H

#include "atv_model.h"

#include <hhtdae/flexible.h>

namespace hhtex
{

inline PetscErrorCode ShowAtvFrame(const ReducedBody &body, Atv *atv)
{
  auto surface = std::make_shared<Surface>();
  PetscFunctionBeginUser;
  PetscCall(MakeSurface(body, surface.get()));
  surface->stress_unit = "Pa";
  atv->scene.surface(atv->frame, surface);
  atv->scene.output().page_title = "An all-terrain vehicle on four shaker posts";
  PetscFunctionReturn(0);
}

} // namespace hhtex

#endif
