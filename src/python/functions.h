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

/* Handles are objects with the attributes `_id` and `_number`; None is no handle. */
template <class H> H ToHandle(py::handle x, const std::string &what)
{
  H h;
  if (x.is_none()) return h;
  if (!py::hasattr(x, "_id") || !py::hasattr(x, "_number")) throw py::type_error(what + " is " + py::repr(x).cast<std::string>() + ", which is not of a scene");
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
