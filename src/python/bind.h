/* Common part of the sources of the Python module: conversion of PETSc's objects and small arrays, errors as Python exceptions. */
#ifndef HHTDAE_PYTHON_BIND_H
#define HHTDAE_PYTHON_BIND_H

#include "hhtdae/types.h"
#include <petscts.h>
#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>
#include <string>
#include <vector>

namespace hhtdae
{
namespace python
{

namespace py = pybind11;

/* Raises hhtdae.Error, with the message of the innermost error, if code is an error of PETSc. The pending exception of a
   Python function, Call(), becomes its cause. */
void Check(PetscErrorCode code);

/* Conversion from petsc4py's objects (borrowed references), and to new ones that share ownership */
TS         ToTS(py::handle x);
Vec        ToVec(py::handle x);
Mat        ToMat(py::handle x);
IS         ToIS(py::handle x);
MPI_Comm   ToComm(py::handle x);
py::object FromTS(TS x);
py::object FromVec(Vec x);
py::object FromMat(Mat x);
py::object FromIS(IS x);

/* Converts x to a plain value. The error message names `what` and describes the required type, `wanted` */
template <class T> T To(py::handle x, const std::string &what, const char *wanted)
{
  try {
    return x.cast<T>();
  } catch (const py::cast_error &) {
    throw py::type_error(what + " must be " + wanted + ", is " + py::repr(x).cast<std::string>());
  }
}

/* Arrays of one or two dimensions; the error message for a wrong shape names `what` */
using Array = py::array_t<double, py::array::c_style | py::array::forcecast>;
Array           ToArray(py::handle x, const std::string &what);
Vector3         ToVector(py::handle x, const std::string &what);
Matrix3         ToMatrix(py::handle x, const std::string &what);
Eigen::VectorXd ToEigen(py::handle x, const std::string &what);
py::array       FromDoubles(const double *x, std::vector<py::ssize_t> shape);
template <class M> py::array FromMatrix(const M &x)
{
  const Eigen::Matrix<typename M::Scalar, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor> rows = x;
  return FromDoubles(rows.data(), {(py::ssize_t)rows.rows(), (py::ssize_t)rows.cols()});
}
inline py::array FromVector(const Vector3 &x) { return FromDoubles(x.data(), {3}); }

/* Calls a Python function from a callback of PETSc. An exception is stored for Check(), which makes it the cause of
   hhtdae.Error, and a std::runtime_error with its text is thrown. */
py::object Call(py::handle f, const py::tuple &arguments);
/* Stores Python's present exception and throws as Call() does */
[[noreturn]] void Keep();
/* For callbacks from C++ that do more than Call(): also stores exceptions of conversions */
template <class F> auto Keeping(F f) -> decltype(f())
{
  try {
    return f();
  } catch (py::error_already_set &e) {
    e.restore();
  }
  Keep();
}
/* Raises the exception that Call() has stored, if there is one */
void PassOn();
/* For calls from Python without PETSc in between: an exception of a Python function called within is raised unchanged */
template <class F> auto Directly(F f)
{
  try {
    return f();
  } catch (const std::runtime_error &) {
    PassOn();
    throw;
  }
}
/* For callbacks that PETSc calls: exceptions are stored as by Call(), and an error code of PETSc is returned */
template <class F> PetscErrorCode Guarded(F f)
{
  py::gil_scoped_acquire gil;
  PetscFunctionBegin;
  try {
    PetscCall(f());
  } catch (const std::exception &e) {
    SETERRQ(PETSC_COMM_SELF, PETSC_ERR_USER, "A Python function has failed: %s", e.what());
  }
  PetscFunctionReturn(0);
}

/* Runs Python's signal handlers; an exception of one, usually KeyboardInterrupt, becomes an error of PETSc */
PetscErrorCode CheckSignals();

/* Attaches `contents` to a PETSc object, which then destroys them; how a container does this depends on PETSC_VERSION */
template <class T> PetscErrorCode OwnedBy(PetscObject owner, const char name[], T *contents)
{
  PetscContainer box;
  PetscFunctionBegin;
  PetscCall(PetscContainerCreate(PetscObjectComm(owner), &box));
  PetscCall(PetscContainerSetPointer(box, contents));
#if PETSC_VERSION_LT(3, 23, 0)
  PetscCall(PetscContainerSetUserDestroy(box, [](void *x) -> PetscErrorCode { return delete static_cast<T *>(x), PetscErrorCode(0); }));
#else
  PetscCall(PetscContainerSetCtxDestroy(box, [](void **x) -> PetscErrorCode { return delete static_cast<T *>(*x), PETSC_SUCCESS; }));
#endif
  PetscCall(PetscObjectCompose(owner, name, (PetscObject)box));
  PetscCall(PetscContainerDestroy(&box));
  PetscFunctionReturn(0);
}

/* Each adds a part of the module */
void BindIntegrator(py::module_ &m);
void BindCallbacks(py::module_ &m);
void BindFunctions(py::module_ &m);
void BindScene(py::module_ &m);
void BindRecorder(py::module_ &m);
void BindQuery(py::module_ &m);
void BindLinearize(py::module_ &m);
void BindMechanism(py::module_ &m);

} // namespace python
} // namespace hhtdae

#endif
