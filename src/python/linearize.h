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

/* A linearization whose contents can be destroyed before PetscFinalize() */
struct Linearized {
  std::unique_ptr<Linearization> small = std::make_unique<Linearization>();
  py::object                     ts; /* a reference to the run, so that the TS exists even if the run is closed */

  Linearization &get()
  {
    if (!small) throw py::value_error("the linearization has been closed");
    return *small;
  }
};

} // namespace python
} // namespace hhtdae

#endif
