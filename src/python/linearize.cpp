/* Small motions: linearize.h */
#include "linearize.h"
#include "functions.h"
#include <pybind11/complex.h>

namespace hhtdae
{
namespace python
{

namespace
{

using Complex = std::complex<double>;

py::array Out(const Complex *x, py::ssize_t n) { return py::array_t<Complex>(n, x); }

py::list Modes(Linearized &l)
{
  std::vector<Mode> all;
  py::list          out;
  Check(l.get().modes(&all));
  for (Mode &m : all) out.append(py::cast(std::move(m)));
  return out;
}

py::tuple Part(Linearized &l, const Mode &mode, py::object body)
{
  BodyPart p;
  Check(l.get().part(mode, ToHandle<Body>(body, "body"), &p));
  return py::make_tuple(Out(p.displacement.data(), 3), Out(p.rotation.data(), 3), p.share);
}

/* Converts the tuple (marker, force, moment, element, acceleration of the ground), the excitation for an input of 1 */
Excitation ToExcitation(py::handle x)
{
  const py::tuple t = py::reinterpret_borrow<py::tuple>(x);
  Excitation      e;
  e.at     = ToHandle<Marker>(t[0], "an excitation's marker");
  e.load   = ToVector(t[1], "an excitation's force");
  e.moment = ToVector(t[2], "an excitation's moment");
  e.driven = ToHandle<Element>(t[3], "an excitation's motion");
  e.ground = ToVector(t[4], "an excitation's acceleration of the ground");
  return e;
}

py::array Response(Linearized &l, py::object in, py::object out, Array circular)
{
  std::vector<Complex> x;
  Check(l.get().response(ToExcitation(in), ToMeasure(out), {circular.data(), circular.data() + circular.size()}, &x));
  return Out(x.data(), (py::ssize_t)x.size());
}

py::tuple States(Linearized &l, py::list in, py::list out)
{
  std::vector<Excitation> inputs;
  std::vector<Measure>    outputs;
  StateSpace              s;
  for (py::handle x : in) inputs.push_back(ToExcitation(x));
  for (py::handle x : out) outputs.push_back(ToMeasure(x));
  Check(l.get().stateSpace(inputs, outputs, &s));
  return py::make_tuple(FromDoubles(s.A.data(), {s.states, s.states}), FromDoubles(s.B.data(), {s.states, s.inputs}),
                        FromDoubles(s.C.data(), {s.outputs, s.states}), FromDoubles(s.D.data(), {s.outputs, s.inputs}));
}

py::dict HowSteady(Linearized &l)
{
  using py::literals::operator""_a;
  Steadiness s;
  Check(l.get().steadiness(&s));
  return py::dict("body"_a = s.body, "elastic"_a = s.elastic, "change"_a = s.change, "elastic_change"_a = s.elastic_change, "square_rate"_a = s.square_rate, "rounding"_a = s.rounding, "spin"_a = s.spin,
                  "turning"_a = s.turning);
}

/* Copies of M, C and K, since the library destroys its own with the linearization */
py::tuple Operators(Linearized &l)
{
  Mat        M[3], copy;
  py::object out[3];
  Check(l.get().operators(&M[0], &M[1], &M[2]));
  for (int k = 0; k < 3; k++) {
    Check(MatDuplicate(M[k], MAT_COPY_VALUES, &copy));
    out[k] = FromMat(copy);
    Check(PetscObjectDereference((PetscObject)copy)); /* out[k] owns the matrix */
  }
  return py::make_tuple(out[0], out[1], out[2]);
}

} // namespace

void BindLinearize(py::module_ &m)
{
  py::class_<Mode>(m, "Mode", "A natural mode: a motion that goes as exp(value t)")
    .def_readonly("value", &Mode::value, "eigenvalue, 1/s; of a conjugate pair the one with a positive imaginary part")
    .def_property_readonly("frequency", &Mode::frequency, "undamped natural frequency, cycles per unit of time")
    .def_property_readonly("damping_ratio", &Mode::dampingRatio, "ratio of critical damping")
    .def_property_readonly("shape", [](const Mode &x) { return Out(x.shape.data(), (py::ssize_t)x.shape.size()); }, "complex amplitudes of this rank's unknowns")
    .def("__repr__", [](const Mode &x) {
      char text[80];
      snprintf(text, sizeof text, "<mode of %.6g Hz, damping ratio %.3g>", x.frequency(), x.dampingRatio());
      return std::string(text);
    });
  py::class_<Linearized>(m, "Linearization")
    .def(py::init<>())
    .def("take", [](Linearized &l, py::object ts, py::object t, py::object axes) {
      const Body of = axes.is_none() ? Body() : ToHandle<Body>(axes, "axes");
      l.ts          = FromTS(ToTS(ts));
      Check(t.is_none() ? l.get().take(ToTS(ts), of) : l.get().take(ToTS(ts), t.cast<double>(), of));
    })
    .def_property_readonly("ts", [](Linearized &l) { return l.get(), l.ts; })
    .def("close", [](Linearized &l) {
      l.small.reset();
      l.ts = py::none();
    })
    .def("modes", Modes)
    .def("part", Part)
    .def("value", [](Linearized &l, const Mode &mode, py::object measure) {
      Complex x;
      Check(l.get().value(mode, ToMeasure(measure), &x));
      return x;
    })
    .def("response", Response)
    .def("state_space", States)
    .def("steadiness", HowSteady)
    .def("operators", Operators)
    .def("animate", [](Linearized &l, const Mode &mode, const std::string &prefix, double amplitude, int frames) {
      Check(l.get().animate(mode, prefix, amplitude, frames));
    });
}

} // namespace python
} // namespace hhtdae
