/* Linearizations and modes, for the sources that use them */
#ifndef HHTDAE_PYTHON_LINEARIZE_H
#define HHTDAE_PYTHON_LINEARIZE_H

#include "bind.h"
#include "hhtdae/linearize.h"
#include <memory>

namespace hhtdae
{
namespace python
{

/* A linearization that can be emptied, before PETSc ends */
struct Linearized {
  std::unique_ptr<Linearization> small = std::make_unique<Linearization>();
  py::object                     ts; /* a reference of its own to the run, which may be closed */

  Linearization &get()
  {
    if (!small) throw py::value_error("the linearization has been closed");
    return *small;
  }
};

} // namespace python
} // namespace hhtdae

#endif
