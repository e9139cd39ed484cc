#include "bind.h"
#include <petsc4py/petsc4py.h>
#include <utility>

namespace hhtdae
{
namespace python
{

namespace
{

/* The exception of a Python function that PETSc has called, until Check() raises it. One variable suffices, since one
   thread at a time holds Python's lock */
PyObject *pending_ = nullptr;

/* Imports petsc4py's table of C functions; each shared object must do this once */
void Petsc4Py()
{
  static bool done = false;
  if (done) return;
  if (import_petsc4py() < 0) throw py::error_already_set();
  done = true;
}

template <class T> py::object New(T x, PyObject *(*make)(T))
{
  Petsc4Py();
  PyObject *o = make(x);
  if (!o) throw py::error_already_set();
  return py::reinterpret_steal<py::object>(o);
}

template <class T> T Get(py::handle x, T (*get)(PyObject *))
{
  Petsc4Py();
  T got = get(x.ptr());
  if (PyErr_Occurred()) throw py::error_already_set();
  return got;
}

} // namespace

void Check(PetscErrorCode code)
{
  if (code == 0) { /* PETSc has recovered from the error; the stored exception must not become the cause of a later one */
    Py_CLEAR(pending_);
    return;
  }
  if (PyErr_Occurred()) {
    Py_CLEAR(pending_);
    throw py::error_already_set();
  }
  py::object cause = pending_ ? py::reinterpret_steal<py::object>(pending_) : py::none();
  pending_         = nullptr;
  const char *text;
  char       *specific;
  PetscErrorMessage(code, &text, &specific);
  py::module_::import("hhtdae._errors").attr("fail")((int)code, text ? text : "", specific ? specific : "", cause);
}

TS       ToTS(py::handle x) { Petsc4Py(); return Get<TS>(x, PyPetscTS_Get); }
Vec      ToVec(py::handle x) { Petsc4Py(); return Get<Vec>(x, PyPetscVec_Get); }
Mat      ToMat(py::handle x) { Petsc4Py(); return Get<Mat>(x, PyPetscMat_Get); }
IS       ToIS(py::handle x) { Petsc4Py(); return Get<IS>(x, PyPetscIS_Get); }
MPI_Comm ToComm(py::handle x) { Petsc4Py(); return Get<MPI_Comm>(x, PyPetscComm_Get); }

py::object FromTS(TS x) { Petsc4Py(); return New<TS>(x, PyPetscTS_New); }
py::object FromVec(Vec x) { Petsc4Py(); return New<Vec>(x, PyPetscVec_New); }
py::object FromMat(Mat x) { Petsc4Py(); return New<Mat>(x, PyPetscMat_New); }
py::object FromIS(IS x) { Petsc4Py(); return New<IS>(x, PyPetscIS_New); }

Array ToArray(py::handle x, const std::string &what)
{
  try {
    return Array(py::reinterpret_borrow<py::object>(x));
  } catch (py::error_already_set &e) {
    /* other exceptions, such as KeyboardInterrupt, can also occur while NumPy reads a list */
    if (!e.matches(PyExc_TypeError) && !e.matches(PyExc_ValueError)) throw;
  }
  throw py::type_error(what + " must be numbers, is " + py::repr(x).cast<std::string>());
}

Vector3 ToVector(py::handle x, const std::string &what)
{
  const Array a = ToArray(x, what);
  if (a.ndim() != 1 || a.size() != 3) throw py::value_error(what + " must be three numbers, is " + py::repr(x).cast<std::string>());
  return Vector3(a.data()[0], a.data()[1], a.data()[2]);
}

Matrix3 ToMatrix(py::handle x, const std::string &what)
{
  const Array a = ToArray(x, what);
  if (a.ndim() != 2 || a.shape(0) != 3 || a.shape(1) != 3) throw py::value_error(what + " must be a 3 x 3 matrix, is " + py::repr(x).cast<std::string>());
  Matrix3 M;
  for (int r = 0; r < 3; r++)
    for (int c = 0; c < 3; c++) M(r, c) = a.at(r, c);
  return M;
}

Eigen::VectorXd ToEigen(py::handle x, const std::string &what)
{
  const Array a = ToArray(x, what);
  if (a.ndim() != 1) throw py::value_error(what + " must be one row of numbers");
  return Eigen::Map<const Eigen::VectorXd>(a.data(), a.size());
}

py::array FromDoubles(const double *x, std::vector<py::ssize_t> shape) { return py::array_t<double>(std::move(shape), x); }

void Keep()
{
  PyObject *type, *value, *trace;
  PyErr_Fetch(&type, &value, &trace);
  PyErr_NormalizeException(&type, &value, &trace);
  if (trace) PyException_SetTraceback(value, trace);
  std::string text = py::str(py::handle(type).attr("__name__")).cast<std::string>() + ": " + py::str(value).cast<std::string>();
  Py_XDECREF(type);
  Py_XDECREF(trace);
  Py_XSETREF(pending_, value);
  throw std::runtime_error(text);
}

py::object Call(py::handle f, const py::tuple &arguments)
{
  PyObject *result = PyObject_CallObject(f.ptr(), arguments.ptr());
  if (!result) Keep();
  return py::reinterpret_steal<py::object>(result);
}

void PassOn()
{
  if (!pending_) return;
  const py::object value = py::reinterpret_steal<py::object>(std::exchange(pending_, nullptr));
  PyErr_SetObject((PyObject *)Py_TYPE(value.ptr()), value.ptr());
  throw py::error_already_set();
}

PetscErrorCode CheckSignals()
{
  py::gil_scoped_acquire gil;
  PetscFunctionBegin;
  if (PyErr_CheckSignals()) SETERRQ(PETSC_COMM_SELF, PETSC_ERR_USER, "Interrupted by a signal");
  PetscFunctionReturn(0);
}

} // namespace python
} // namespace hhtdae
