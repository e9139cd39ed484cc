/*
  Conversion between elements of a scene and Python's dictionaries of their fields. Each kind lists its fields once, in

    template <class F> void Fields(SpringDamper &s, F &f) { f("i", s.i); f("stiffness", s.stiffness); ... }

  Reader sets the fields from a dictionary. Writer writes them to a dictionary, with which tests compare Python's classes.
*/
#ifndef HHTDAE_PYTHON_FIELDS_H
#define HHTDAE_PYTHON_FIELDS_H

#include "functions.h"
#include <functional>
#include <map>
#include <memory>
#include <optional>

namespace hhtdae
{
namespace python
{

template <class F> void Fields(ContactLaw &l, F &f)
{
  f("stiffness", l.stiffness), f("exponent", l.exponent), f("damping", l.damping), f("friction", l.friction), f("slip_velocity", l.slip_velocity);
}
template <class F> void Fields(Coupler::Term &t, F &f) { f("i", t.i), f("j", t.j), f("rotation", t.rotation), f("factor", t.factor); }

class Reader
{
public:
  Reader(const py::dict &fields, std::string who) : fields_(fields), who_(std::move(who)) {}
  template <class T> void operator()(const char *name, T &x)
  {
    if (!fields_.contains(name)) return;
    const py::object given = fields_[name];
    if (given.is_none()) return;
    read(given, x, who_ + ": " + name);
  }

private:
  const py::dict &fields_;
  std::string     who_;

  static void read(py::handle g, double &x, const std::string &w) { x = To<double>(g, w, "a number"); }
  static void read(py::handle g, int &x, const std::string &w) { x = To<int>(g, w, "a whole number"); }
  static void read(py::handle g, PetscInt64 &x, const std::string &w) { x = To<PetscInt64>(g, w, "a whole number"); }
  static void read(py::handle g, bool &x, const std::string &w)
  {
    /* NumPy's bool is accepted, too; a number indicates that arguments were confused */
    if (!py::isinstance<py::bool_>(g) && std::string(py::str(py::type::of(g).attr("__name__"))).rfind("bool", 0) != 0)
      throw py::type_error(w + " must be True or False, not " + std::string(py::repr(g)));
    x = g.cast<bool>();
  }
  static void read(py::handle g, std::string &x, const std::string &w) { x = To<std::string>(g, w, "a text"); }
  static void read(py::handle g, Body &x, const std::string &w) { x = ToHandle<Body>(g, w); }
  static void read(py::handle g, Marker &x, const std::string &w) { x = ToHandle<Marker>(g, w); }
  static void read(py::handle g, Element &x, const std::string &w) { x = ToHandle<Element>(g, w); }
  static void read(py::handle g, Vector3 &x, const std::string &w) { x = ToVector(g, w); }
  static void read(py::handle g, TimeFunction &x, const std::string &) { x = ToTimeFunction(g); }
  static void read(py::handle g, Expression &x, const std::string &) { x = ToExpression(g); }
  static void read(py::handle g, ForceLaw &x, const std::string &)
  {
    const auto tape = g.cast<std::shared_ptr<Tape>>();
    x               = [tape](const Real &l, const Real &v) {
      const Real u[2] = {l, v};
      return (*tape)(u);
    };
  }
  static void read(py::handle g, MotionOf &x, const std::string &w)
  {
    const std::string name = To<std::string>(g, w, "a text");
    if (name == "displacement") x = MotionOf::Displacement;
    else if (name == "velocity") x = MotionOf::Velocity;
    else if (name == "acceleration") x = MotionOf::Acceleration;
    else throw py::value_error(w + " is '" + name + "', must be 'displacement', 'velocity' or 'acceleration'");
  }
  template <class T> static void read(py::handle g, std::vector<T> &x, const std::string &w)
  {
    x.clear();
    for (py::handle one : g) {
      x.emplace_back();
      read(one, x.back(), w);
    }
  }
  template <class T> static auto read(py::handle g, T &x, const std::string &w) -> decltype(Fields(x, std::declval<Reader &>()))
  {
    const py::dict fields = py::reinterpret_borrow<py::dict>(g);
    Reader         reader(fields, w);
    Fields(x, reader);
  }
};

/* Writes the default values of a kind; None for a field whose value is not a plain one */
class Writer
{
public:
  py::dict fields;

  void operator()(const char *name, double &x) { fields[name] = x; }
  void operator()(const char *name, int &x) { fields[name] = x; }
  void operator()(const char *name, bool &x) { fields[name] = x; }
  void operator()(const char *name, Vector3 &x) { fields[name] = FromVector(x); }
  void operator()(const char *name, MotionOf &) { fields[name] = "displacement"; }
  void operator()(const char *name, ContactLaw &x)
  {
    Writer w;
    Fields(x, w);
    fields[name] = w.fields;
  }
  template <class T> void operator()(const char *name, T &) { fields[name] = py::none(); }
};

/* The functions that Python's Scene.add() uses for a kind of element */
struct Kind {
  std::function<Element(Scene &, const std::string &name, const py::dict &fields)>   add;
  /* describe() returns the fields, or None if the element is absent; it is called anew when parameters have changed */
  std::function<Element(Scene &, const std::string &name, py::handle describe)>      again;
  std::function<py::dict()>                                                          defaults;
};
using Kinds = std::map<std::string, Kind>;

template <class Spec> Spec Read(const py::dict &fields, const std::string &kind, const std::string &name)
{
  Spec   s{};
  Reader reader(fields, kind + " " + name);
  Fields(s, reader);
  return s;
}

/* Calls a description at once; the returned function gives this result the first time. So an exception is raised before
   the scene has recorded an incomplete part */
template <class F> auto Called(F read)
{
  using Part          = decltype(read());
  const auto describe = [read] {
    py::gil_scoped_acquire gil;
    return Keeping(read);
  };
  auto first = std::make_shared<std::unique_ptr<Part>>(std::make_unique<Part>(describe()));
  return [describe, first]() -> Part {
    if (!*first) return describe();
    const std::unique_ptr<Part> x = std::move(*first);
    return *x;
  };
}

template <class Spec> void Register(Kinds &kinds, const std::string &kind)
{
  kinds[kind] = {
    [kind](Scene &scene, const std::string &name, const py::dict &fields) { return scene.add(name, Read<Spec>(fields, kind, name)); },
    [kind](Scene &scene, const std::string &name, py::handle describe) {
      return scene.add(name, Called([kind, name, describe]() -> std::optional<Spec> {
        const py::object fields = Call(describe, py::tuple());
        if (fields.is_none()) return {};
        return Read<Spec>(py::dict(fields), kind, name);
      }));
    },
    [] {
      Spec   s{};
      Writer w;
      Fields(s, w);
      return w.fields;
    }};
}

void RegisterJoints(Kinds &kinds);
void RegisterForces(Kinds &kinds);

} // namespace python
} // namespace hhtdae

#endif
