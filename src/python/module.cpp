/* The extension module hhtdae._core, which the package's Python sources use; it is not part of the public interface. */
#include "bind.h"

PYBIND11_MODULE(_core, m)
{
  using namespace hhtdae::python;
  m.doc() = "C++ part of the package hhtdae; its Python sources say what is meant for use";
  BindIntegrator(m);
  BindCallbacks(m);
  BindFunctions(m);
  BindScene(m);
  BindRecorder(m);
  BindQuery(m);
  BindLinearize(m);
  BindMechanism(m);
}
