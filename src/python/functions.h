/* Readers of what Python describes: fields of elements, measures, expressions. */
#ifndef HHTDAE_PYTHON_FUNCTIONS_H
#define HHTDAE_PYTHON_FUNCTIONS_H

#include "bind.h"
#include "hhtdae/scene.h"
#include "tape.h"

namespace hhtdae
{
namespace python
{

template <class H> const char *const kind_of = "";
template <> inline const char *const kind_of<Body>    = "body";
template <> inline const char *const kind_of<Marker>  = "marker";
template <> inline const char *const kind_of<Element> = "element";

/* Handles are objects with the attributes `_id`, `_number` and `_kind`; None is no handle. A body is no marker, though both have numbers. */
template <class H> H ToHandle(py::handle x, const std::string &what, bool any_kind = false)
{
  H h;
  if (x.is_none()) return h;
  const bool known = py::hasattr(x, "_id") && py::hasattr(x, "_number") && py::hasattr(x, "_kind");
  if (!known || (!any_kind && x.attr("_kind").cast<std::string>() != kind_of<H>))
    throw py::type_error(what + " must be a scene's " + kind_of<H> + ", is " + py::repr(x).cast<std::string>());
  h.id    = x.attr("_id").cast<PetscInt>();
  h.scene = x.attr("_number").cast<PetscInt>();
  return h;
}

/* A measure's tuple: kind, i, j, frame, component, target */
Measure ToMeasure(py::handle x);
/* An expression's tuple: measures, tape or None for the measure itself */
Expression   ToExpression(py::handle x);
TimeFunction ToTimeFunction(py::handle x);

} // namespace python
} // namespace hhtdae

#endif
