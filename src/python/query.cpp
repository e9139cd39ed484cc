/* Snapshots and analyses: query.h, analyses.h */
#include "functions.h"
#include "hhtdae/analyses.h"
#include "hhtdae/query.h"

namespace hhtdae
{
namespace python
{

namespace
{

/* A snapshot whose contents can be destroyed before PetscFinalize() */
struct Held {
  std::unique_ptr<Snapshot> now = std::make_unique<Snapshot>();
  py::object                ts; /* a reference to the run that the snapshot reads, so that the TS exists even if the run is closed */

  Snapshot &get()
  {
    if (!now) throw py::value_error("the snapshot has been closed");
    return *now;
  }
};

py::dict Out(const Motion &x)
{
  using py::literals::operator""_a;
  return py::dict("position"_a = FromVector(x.position), "velocity"_a = FromVector(x.velocity), "acceleration"_a = FromVector(x.acceleration),
                  "axes"_a = FromMatrix(x.axes), "angular_velocity"_a = FromVector(x.angular_velocity),
                  "angular_acceleration"_a = FromVector(x.angular_acceleration));
}

void Take(Held &h, py::object ts, py::object t)
{
  h.get();
  h.ts = FromTS(ToTS(ts));
  Check(t.is_none() ? h.now->take(ToTS(ts)) : h.now->take(ToTS(ts), t.cast<double>()));
}

} // namespace

void BindQuery(py::module_ &m)
{
  py::class_<Held>(m, "Snapshot")
    .def(py::init<>())
    .def("take", Take)
    .def("close", [](Held &h) {
      h.now.reset();
      h.ts = py::none();
    })
    .def("time", [](Held &h) { return (double)h.get().time(); })
    .def("marker", [](Held &h, py::object i, py::object axes) {
      Motion x;
      Check(h.get().motion(ToHandle<Marker>(i, "marker"), &x, ToHandle<Marker>(axes, "axes")));
      return Out(x);
    })
    .def("relative", [](Held &h, py::object i, py::object to) {
      Motion x;
      Check(h.get().relativeMotion(ToHandle<Marker>(i, "marker"), ToHandle<Marker>(to, "to"), &x));
      return Out(x);
    })
    .def("body", [](Held &h, py::object b) {
      Motion x;
      Check(h.get().motion(ToHandle<Body>(b, "body"), &x));
      return Out(x);
    })
    .def("modes", [](Held &h, py::object b) {
      std::vector<double> x;
      Check(h.get().modes(ToHandle<Body>(b, "flexible body"), &x));
      return FromDoubles(x.data(), {(py::ssize_t)x.size()});
    })
    .def("load", [](Held &h, py::object e, py::object on, py::object axes) {
      Load x;
      Check(h.get().load(ToHandle<Element>(e, "element"), ToHandle<Marker>(on, "on"), &x, ToHandle<Marker>(axes, "axes")));
      return py::make_tuple(FromVector(x.force), FromVector(x.moment));
    })
    .def("value", [](Held &h, py::object measure) {
      double x = 0;
      Check(h.get().value(ToMeasure(measure), &x));
      return x;
    })
    .def("energy", [](Held &h) {
      double kinetic = 0, potential = 0;
      Check(h.get().energy(&kinetic, &potential));
      return py::make_tuple(kinetic, potential);
    });
  m.def("euler", [](py::object axes) {
    Motion x;
    x.axes = ToMatrix(axes, "axes");
    return FromVector(x.euler());
  });
  m.def("bryant", [](py::object axes) {
    Motion x;
    x.axes = ToMatrix(axes, "axes");
    return FromVector(x.bryant());
  });
  m.def("static_equilibrium", [](py::object ts, double t) { Check(StaticEquilibrium(ToTS(ts), t)); });
  m.def("assemble_at", [](py::object ts, double t) { Check(AssembleAt(ToTS(ts), t)); });
  m.def("kinematics", [](py::object ts, double t) { Check(Kinematics(ToTS(ts), t)); });
  m.def("set_velocity", [](py::object ts, py::object body, py::object velocity, py::object angular) {
    const Vector3 v = velocity.is_none() ? Vector3(Vector3::Zero()) : ToVector(velocity, "velocity"), w = angular.is_none() ? Vector3(Vector3::Zero()) : ToVector(angular, "angular_velocity");
    Check(SetVelocity(ToTS(ts), ToHandle<Body>(body, "body"), velocity.is_none() ? nullptr : &v, angular.is_none() ? nullptr : &w));
  });
}

} // namespace python
} // namespace hhtdae
