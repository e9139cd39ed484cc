/* Converts descriptions from Python: handles, measures, expressions. */
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

/* Converts a handle, a Python object with the attributes `_id`, `_number` and `_kind`; None gives an empty handle. The
   kind is checked, since bodies and markers both have numbers. */
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

/* Converts the tuple (kind, i, j, frame, component, target) of a measure */
Measure ToMeasure(py::handle x);
/* Converts the tuple (measures, tape) of an expression; the tape is None if the expression is a single measure */
Expression   ToExpression(py::handle x);
TimeFunction ToTimeFunction(py::handle x);

} // namespace python
} // namespace hhtdae

#endif
