/* Callbacks of the integrator implemented by Python functions: longest step, names of rows, change of coordinates,
   rotations. The TS owns the Python functions. */
#include "bind.h"
#include "../scene/guard.h"
#include "hhtdae/hhtdae.h"

namespace hhtdae
{
namespace python
{

namespace
{

/* Python functions that a TS owns */
struct Functions {
  std::vector<py::object> f;
  ~Functions()
  {
    if (!Py_IsInitialized()) {
      for (py::object &x : f) x.release();
      return;
    }
    py::gil_scoped_acquire gil;
    f.clear();
  }
};

PetscErrorCode LongestStep(TS ts, PetscReal t, Vec U, Vec V, Vec A, PetscReal *h, void *ctx)
{
  PetscFunctionBegin;
  PetscCall(OnAllRanks(PetscObjectComm((PetscObject)ts), Guarded([&] {
    *h = Call(static_cast<Functions *>(ctx)->f[0], py::make_tuple(FromTS(ts), t, FromVec(U), FromVec(V), FromVec(A))).cast<double>();
    return PetscErrorCode(0);
  })));
  PetscFunctionReturn(0);
}

PetscErrorCode RowName(TS, PetscInt row, char name[], size_t len, void *ctx)
{
  PetscFunctionBegin;
  PetscCall(Guarded([&] {
    const std::string is = Call(static_cast<Functions *>(ctx)->f[0], py::make_tuple(row)).cast<std::string>();
    PetscCall(PetscStrncpy(name, is.c_str(), len));
    return PetscErrorCode(0);
  }));
  PetscFunctionReturn(0);
}

PetscErrorCode Test(TS ts, PetscReal t, Vec U, Vec V, PetscBool *change, void *ctx)
{
  PetscFunctionBegin;
  PetscCall(OnAllRanks(PetscObjectComm((PetscObject)ts), Guarded([&] {
    *change = Call(static_cast<Functions *>(ctx)->f[0], py::make_tuple(FromTS(ts), t, FromVec(U), FromVec(V))).cast<bool>() ? PETSC_TRUE : PETSC_FALSE;
    return PetscErrorCode(0);
  })));
  PetscFunctionReturn(0);
}

PetscErrorCode Map(TS ts, PetscReal t, Vec U, Vec V, Vec A, void *ctx)
{
  PetscFunctionBegin;
  PetscCall(OnAllRanks(PetscObjectComm((PetscObject)ts), Guarded([&] {
    py::object u = FromVec(U), v = V ? FromVec(V) : py::none(), a = A ? FromVec(A) : py::none();
    Call(static_cast<Functions *>(ctx)->f[1], py::make_tuple(FromTS(ts), t, u, v, a));
    return PetscErrorCode(0);
  })));
  PetscFunctionReturn(0);
}

PetscErrorCode Commit(TS ts, void *ctx)
{
  PetscFunctionBegin;
  PetscCall(OnAllRanks(PetscObjectComm((PetscObject)ts), Guarded([&] {
    const py::object &f = static_cast<Functions *>(ctx)->f[2];
    if (!f.is_none()) Call(f, py::make_tuple(FromTS(ts)));
    return PetscErrorCode(0);
  })));
  PetscFunctionReturn(0);
}

PetscErrorCode Refer(TS ts, Vec U, void *ctx)
{
  PetscFunctionBegin;
  PetscCall(OnAllRanks(PetscObjectComm((PetscObject)ts), Guarded([&] {
    Call(static_cast<Functions *>(ctx)->f[0], py::make_tuple(FromTS(ts), FromVec(U)));
    return PetscErrorCode(0);
  })));
  PetscFunctionReturn(0);
}

PetscErrorCode ReferBack(TS ts, void *ctx)
{
  PetscFunctionBegin;
  PetscCall(OnAllRanks(PetscObjectComm((PetscObject)ts), Guarded([&] {
    Call(static_cast<Functions *>(ctx)->f[1], py::make_tuple(FromTS(ts)));
    return PetscErrorCode(0);
  })));
  PetscFunctionReturn(0);
}

} // namespace

void BindCallbacks(py::module_ &m)
{
  m.def("set_step_limit", [](py::object ts, py::object f) {
    auto *own = new Functions{{f}};
    Check(OwnedBy((PetscObject)ToTS(ts), "hhtdae python step limit", own));
    Check(TSHHT3SetStepLimit(ToTS(ts), LongestStep, own));
  });
  m.def("set_row_name", [](py::object ts, py::object f) {
    auto *own = new Functions{{f}};
    Check(OwnedBy((PetscObject)ToTS(ts), "hhtdae python row names", own));
    Check(TSHHT3SetRowName(ToTS(ts), RowName, own));
  });
  m.def("set_coordinate_change", [](py::object ts, py::object test, py::object map, py::object commit) {
    auto *own = new Functions{{test, map, commit}};
    Check(OwnedBy((PetscObject)ToTS(ts), "hhtdae python coordinates", own));
    Check(TSHHT3SetCoordinateChange(ToTS(ts), Test, Map, Commit, own));
  });
  m.def("set_rotations", [](py::object ts, py::object is, py::object refer, py::object back) {
    auto *own = new Functions{{refer, back}};
    Check(OwnedBy((PetscObject)ToTS(ts), "hhtdae python rotations", own));
    Check(TSHHT3SetRotations(ToTS(ts), ToIS(is), Refer, ReferBack, own));
  });
  m.def("get_rotation_factor", [](py::object ts) {
    PetscReal factor = 0;
    Vec       begin  = nullptr;
    Check(TSHHT3GetRotationFactor(ToTS(ts), &factor, &begin));
    return py::make_tuple((double)factor, begin ? FromVec(begin) : py::none());
  });
}

} // namespace python
} // namespace hhtdae
