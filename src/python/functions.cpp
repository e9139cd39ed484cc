/* Tapes, functions of time, measures and expressions. */
#include "functions.h"
#include <map>

namespace hhtdae
{
namespace python
{

namespace
{

using TapePointer = std::shared_ptr<Tape>;

TapePointer MakeTape(py::list operations, py::list constants, py::list parameters, py::list tables, py::list functions, py::list outputs, int arguments)
{
  auto tape = std::make_shared<Tape>();
  for (py::handle o : operations) {
    const py::tuple t = py::reinterpret_borrow<py::tuple>(o);
    tape->operations.push_back({t[0].cast<int>(), t[1].cast<int>(), t[2].cast<int>(), t[3].cast<int>()});
  }
  for (py::handle x : constants) tape->constants.push_back(x.cast<double>());
  for (py::handle x : parameters) tape->parameters.push_back(x.cast<Parameter>());
  for (py::handle x : tables) tape->tables.push_back(x.cast<TimeFunction>());
  for (py::handle x : functions) {
    const py::tuple t = py::reinterpret_borrow<py::tuple>(x);
    Tape::Function  f{py::object(t[0]).ptr(), py::object(t[1]).ptr(), {}};
    for (py::handle k : py::object(t[2])) f.operands.push_back(k.cast<int>());
    tape->functions.push_back(f);
  }
  for (py::handle x : outputs) tape->outputs.push_back(x.cast<int>());
  tape->arguments = arguments;
  return tape;
}

py::array EvaluateTape(const Tape &tape, Array x)
{
  if (x.size() < tape.arguments) throw py::value_error("the function has " + std::to_string(tape.arguments) + " arguments, not " + std::to_string(x.size()));
  std::vector<double> out(tape.outputs.size());
  Directly([&] { tape.evaluate(x.data(), out.data()); });
  return FromDoubles(out.data(), {(py::ssize_t)out.size()});
}

/* The value of the first output and its derivatives by the arguments */
py::tuple DifferentiateTape(const Tape &tape, Array x)
{
  const int         n = tape.arguments;
  std::vector<Real> u(Real::most);
  if (n > Real::most || x.size() < n) throw py::value_error("a function of at most 16 arguments, all of them given, can be differentiated");
  for (int k = 0; k < n; k++) u[k] = Real(x.data()[k], n, k);
  const Real          y = Directly([&] { return tape(u.data()); });
  std::vector<double> g(n, 0.0);
  for (int k = 0; k < y.derivatives().size(); k++) g[k] = y.derivatives()(k);
  return py::make_tuple(y.value(), FromDoubles(g.data(), {(py::ssize_t)n}));
}

TimeFunction::Value Values(py::handle f, double t)
{
  py::gil_scoped_acquire gil;
  const Array x = ToArray(Call(f, py::make_tuple(t)), "what a function of time returned");
  if (x.size() != 3) throw std::runtime_error("a function of time must return its value and its first and second derivative");
  return {x.data()[0], x.data()[1], x.data()[2]};
}

TimeFunction Right(TimeFunction f)
{
  if (!f.error().empty()) throw py::value_error(f.error());
  return f;
}

} // namespace

Measure ToMeasure(py::handle x)
{
  static const std::map<std::string, Measure::Kind> kinds{{"time", Measure::Time}, {"displacement", Measure::Displacement}, {"distance", Measure::Distance},
    {"velocity", Measure::Velocity}, {"rate", Measure::Rate}, {"acceleration", Measure::Acceleration}, {"angle", Measure::Angle},
    {"angular_velocity", Measure::AngularVelocity}, {"angular_acceleration", Measure::AngularAcceleration}, {"multiplier", Measure::Multiplier},
    {"joint_force", Measure::JointForce}, {"joint_moment", Measure::JointMoment}, {"force", Measure::Component}, {"variable", Measure::Value},
    {"state", Measure::StateValue}, {"modal", Measure::Modal}, {"element_force", Measure::ElementForce}, {"element_moment", Measure::ElementMoment},
    {"kinetic_energy", Measure::KineticEnergy}, {"potential_energy", Measure::PotentialEnergy}};
  const py::tuple   t    = py::reinterpret_borrow<py::tuple>(x);
  const std::string kind = t[0].cast<std::string>();
  Measure           m;
  m.kind      = kinds.at(kind);
  m.i         = ToHandle<Marker>(t[1], kind + ": marker i");
  m.j         = ToHandle<Marker>(t[2], kind + ": marker j");
  m.frame     = ToHandle<Marker>(t[3], kind + ": frame");
  m.component = t[4].cast<int>();
  const Element target = ToHandle<Element>(t[5], kind + ": target", true); /* Python has checked the kind of the target */
  m.target             = target.id;
  m.scene              = target.scene;
  return m;
}

Expression ToExpression(py::handle x)
{
  const py::tuple      t = py::reinterpret_borrow<py::tuple>(x);
  std::vector<Measure> measures;
  for (py::handle m : py::object(t[0])) measures.push_back(ToMeasure(m));
  if (py::object(t[1]).is_none()) return Expression(measures.at(0));
  const TapePointer tape = py::object(t[1]).cast<TapePointer>();
  return Expression(std::move(measures), [tape](const Real *m) { return (*tape)(m); });
}

TimeFunction ToTimeFunction(py::handle x) { return x.cast<TimeFunction>(); }

void BindFunctions(py::module_ &m)
{
  py::class_<Parameter>(m, "Parameter").def_property_readonly("value", &Parameter::value);
  py::dict operations;
#define HHTDAE_OPERATION(name, operands) operations[#name] = py::make_tuple((int)Tape::op_##name, operands);
  HHTDAE_TAPE_OPERATIONS(HHTDAE_OPERATION)
#undef HHTDAE_OPERATION
  m.attr("operations") = operations;
  py::class_<Tape, TapePointer>(m, "Tape")
    .def(py::init(&MakeTape))
    .def("__len__", [](const Tape &t) { return t.operations.size(); })
    .def("__call__", EvaluateTape)
    .def("differentiate", DifferentiateTape)
    .def("time_function", [](TapePointer tape) { return TimeFunction::formula([tape](const TimeFunction::Number &t) { return (*tape)(t); }); });
  py::class_<TimeFunction>(m, "TimeFunction")
    .def(py::init([](double c) { return Right(TimeFunction(c)); }))
    .def("__call__", [](const TimeFunction &f, double t) {
      const TimeFunction::Value v = Directly([&] { return f(t); });
      return py::make_tuple(v.f, v.f1, v.f2);
    })
    .def_static("polynomial", [](Array c) { return Right(TimeFunction::polynomial({c.data(), c.data() + c.size()})); })
    .def_static("harmonic", [](double a, double w, double p, double o) { return Right(TimeFunction::harmonic(a, w, p, o)); })
    .def_static("step", [](double a, double b, double c, double d) { return Right(TimeFunction::step(a, b, c, d)); })
    .def_static("step5", [](double a, double b, double c, double d) { return Right(TimeFunction::step5(a, b, c, d)); })
    .def_static("spline", [](Array t, Array x) { return Right(TimeFunction::spline({t.data(), t.data() + t.size()}, {x.data(), x.data() + x.size()})); })
    .def_static("values", [](py::object f) { return TimeFunction::values([p = f.ptr()](double t) { return Values(p, t); }); });
}

} // namespace python
} // namespace hhtdae
