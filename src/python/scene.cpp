/* The scene: bodies, markers, elements, variables, parameters, channels, runs. */
#include "fields.h"

namespace hhtdae
{
namespace python
{

namespace
{

using ScenePointer = std::shared_ptr<Scene>;

const Kinds &AllKinds()
{
  static const Kinds kinds = [] {
    Kinds k;
    RegisterJoints(k);
    RegisterForces(k);
    return k;
  }();
  return kinds;
}

template <class H> py::tuple Out(const H &h) { return py::make_tuple(h.id, h.scene); }

Element AddElement(Scene &scene, const std::string &kind, const std::string &name, py::object fields)
{
  const Kind &k = AllKinds().at(kind);
  return py::isinstance<py::dict>(fields) ? k.add(scene, name, py::dict(fields)) : k.again(scene, name, fields);
}

/* Sets mass, pose and velocities from the fields of Python's RigidBody, PointMass or FlexibleBody */
template <class B> void Moving(const py::dict &d, const std::string &name, B &b)
{
  b.position    = ToVector(d["position"], name + ": position");
  b.velocity    = ToVector(d["velocity"], name + ": velocity");
  b.fixed_start = To<bool>(d["fixed_start"], name + ": fixed_start", "True or False");
}
template <class B> void Turning(const py::dict &d, const std::string &name, B &b)
{
  b.rotation         = ToMatrix(d["rotation"], name + ": rotation");
  b.angular_velocity = ToVector(d["angular_velocity"], name + ": angular velocity");
}

RigidBody ToRigid(const py::dict &d, const std::string &name)
{
  RigidBody b;
  Moving(d, name, b);
  Turning(d, name, b);
  b.mass    = To<double>(d["mass"], name + ": mass", "a number");
  b.inertia = ToMatrix(d["inertia"], name + ": inertia");
  b.center  = ToVector(d["center"], name + ": center");
  return b;
}

PointMass ToPoint(const py::dict &d, const std::string &name)
{
  PointMass b;
  Moving(d, name, b);
  b.mass = To<double>(d["mass"], name + ": mass", "a number");
  return b;
}

FlexibleBody ToFlexible(const py::dict &d, const std::string &name)
{
  FlexibleBody b;
  Moving(d, name, b);
  Turning(d, name, b);
  const std::string mass = d["mass"].cast<std::string>();
  b.mass                 = mass == "full" ? ModalMass::Full : mass == "partial" ? ModalMass::Partial : ModalMass::Constant;
  b.model                = d["model"].cast<std::shared_ptr<ModalBody>>();
  for (py::handle band : py::object(d["damping"])) {
    const py::tuple t = py::tuple(py::reinterpret_borrow<py::object>(band));
    b.damping.push_back({t[0].cast<double>(), t[1].cast<double>()});
  }
  if (!d["ratios"].is_none()) b.ratios = ToEigen(d["ratios"], name + ": ratios");
  if (!d["deformation"].is_none()) b.deformation = ToEigen(d["deformation"], name + ": deformation");
  if (!d["deformation_rate"].is_none()) b.deformation_rate = ToEigen(d["deformation_rate"], name + ": deformation rate");
  return b;
}

template <class Spec> Body AddBody(Scene &s, const std::string &name, py::object given, Spec (*read)(const py::dict &, const std::string &))
{
  if (py::isinstance<py::dict>(given)) return s.add(name, read(py::dict(given), name));
  return s.add(name, Called([name, read, f = py::handle(given)] {
    return read(py::dict(Call(f, py::tuple())), name);
  }));
}

/* Converts a place: position and axes, given now or by a function that is called whenever parameters have changed */
Place ToPlace(py::handle x)
{
  const py::tuple t = py::reinterpret_borrow<py::tuple>(x);
  return Place(ToVector(t[0], "a marker's position"), ToMatrix(t[1], "a marker's axes"));
}
Marker AddMarker(Scene &s, py::object body, py::object place, const std::string &name, bool at)
{
  const Body b = ToHandle<Body>(body, "a marker's body");
  if (py::isinstance<py::tuple>(place)) {
    const Place p = ToPlace(place);
    return at ? s.markerAt(b, p.position, p.axes, name) : s.marker(b, p.position, p.axes, name);
  }
  const auto describe = Called([f = py::handle(place)] {
    return ToPlace(Call(f, py::tuple()));
  });
  return at ? s.markerAt(b, describe, name) : s.marker(b, describe, name);
}

void SetGravity(Scene &s, py::object g)
{
  if (!PyCallable_Check(g.ptr())) return s.gravity(ToVector(g, "gravity"));
  s.gravity(Called([f = py::handle(g)] {
    return ToVector(Call(f, py::tuple()), "gravity");
  }));
}

py::object NewRun(Scene &s, py::object from)
{
  TS ts = nullptr;
  Check(from.is_none() ? s.createTS(&ts) : s.createTS(&ts, ToTS(from)));
  py::object run = FromTS(ts);
  Check(TSDestroy(&ts));
  return run;
}

/* Releases Python's lock, so that other threads continue. A callback may destroy the TS of the Python object, so that a
   reference to it is held here. */
void Solve(Scene &s, py::object ts)
{
  const py::object held = FromTS(ToTS(ts));
  TS               run  = ToTS(held);
  PetscErrorCode   code;
  {
    py::gil_scoped_release others;
    code = s.solve(run);
  }
  Check(code);
}

py::array Sample(Scene &s, py::object ts, double t)
{
  std::vector<double> x;
  Check(s.sample(ToTS(ts), t, x));
  return FromDoubles(x.data(), {(py::ssize_t)x.size()});
}

/* Numbers of the Python part in the checkpoints of a run of a scene */
std::vector<double> &NotesOf(py::object ts)
{
  std::vector<double> *notes = nullptr;
  PetscErrorCode (*get)(TS, std::vector<double> **);
  Check(PetscObjectQueryFunction((PetscObject)ToTS(ts), "HHTSceneNotes_C", &get));
  Check(get(ToTS(ts), &notes));
  return *notes;
}

void SetStart(Scene &s, const std::string &assembly, const std::string &redundant, const std::string &rotations, bool equilibrium, bool view, double tolerance,
              double time, double angle_tol)
{
  StartPolicy &p = s.start();
  p.assembly     = assembly == "off" ? Assembly::Off : assembly == "report" ? Assembly::Report : Assembly::Project;
  p.redundant    = redundant == "drop" ? Redundant::Drop : redundant == "refuse" ? Redundant::Refuse : Redundant::Keep;
  p.rotations    = rotations == "local" ? Rotations::Local : Rotations::Euler313;
  p.equilibrium  = equilibrium;
  p.view         = view;
  p.tolerance    = tolerance;
  p.time         = time;
  p.angle_tol    = angle_tol;
}

void SetPage(Scene &s, const std::string &file, const std::string &title, double dt, int frames, int nodes)
{
  OutputSettings &o = s.output();
  if (!(dt >= 0) || frames <= 0 || nodes <= 0) throw py::value_error("output(): page_dt must not be negative, page_frames and page_nodes must be positive");
  o.page            = file;
  o.page_title      = title;
  o.page_dt         = dt;
  o.page_frames     = frames;
  o.page_nodes      = nodes;
}

void SetOutput(Scene &s, const std::string &file, const std::string &csv, double dt, const std::string &animation, double animation_dt, py::object balance)
{
  OutputSettings &o = s.output();
  o.file            = file;
  o.csv             = csv;
  o.dt              = dt;
  o.animation       = animation;
  o.animation_dt    = animation_dt;
  o.balance         = !py::isinstance<py::bool_>(balance) || balance.cast<bool>();
  o.balance_file    = py::isinstance<py::str>(balance) ? balance.cast<std::string>() : "";
}

Shape ToShape(const std::string &kind, py::object size, py::object position, py::object axes, int colour)
{
  return {kind == "box" ? Shape::Box : kind == "cylinder" ? Shape::Cylinder : Shape::Sphere, ToVector(size, "a shape's size"),
          ToVector(position, "a shape's position"), ToMatrix(axes, "a shape's axes"), colour};
}

} // namespace

void BindScene(py::module_ &m)
{
  m.def("kinds", [] {
    py::dict all;
    for (const auto &k : AllKinds()) all[k.first.c_str()] = k.second.defaults();
    return all;
  });
  m.def("notes", [](py::object ts) {
    py::list all;
    for (double x : NotesOf(ts)) all.append(x);
    return all;
  });
  m.def("set_notes", [](py::object ts, py::list all) {
    std::vector<double> &notes = NotesOf(ts);
    notes.clear();
    for (py::handle x : all) notes.push_back(x.cast<double>());
  });
  py::class_<ModalBody, std::shared_ptr<ModalBody>>(m, "ModalBody")
    .def_readonly("name", &ModalBody::name)
    .def_readonly("mass", &ModalBody::mass)
    .def_property_readonly("center", [](const ModalBody &b) { return FromVector(b.center); })
    .def_property_readonly("inertia", [](const ModalBody &b) { return FromMatrix(b.inertia()); })
    .def_property_readonly("omega", [](const ModalBody &b) { return FromDoubles(b.omega.data(), {(py::ssize_t)b.omega.size()}); })
    .def_property_readonly("attachments", [](const ModalBody &b) {
      py::dict all;
      for (const ModalAttachment &a : b.attachments) all[a.name.c_str()] = FromVector(a.position);
      return all;
    });
  /* Bodies, markers, elements and gravity may be described by Python functions; their exceptions, including
     KeyboardInterrupt, are raised unchanged */
  py::class_<Scene, ScenePointer>(m, "Scene")
    .def(py::init([](py::object comm, bool planar) { return std::make_shared<Scene>(ToComm(comm), planar ? Space::Planar : Space::Spatial); }))
    .def("ground", [](Scene &s) { return Out(s.ground()); })
    .def("rigid_body", [](Scene &s, const std::string &n, py::object d) { return Out(Directly([&] { return AddBody(s, n, d, ToRigid); })); })
    .def("point_mass", [](Scene &s, const std::string &n, py::object d) { return Out(Directly([&] { return AddBody(s, n, d, ToPoint); })); })
    .def("flexible_body", [](Scene &s, const std::string &n, py::object d) { return Out(Directly([&] { return AddBody(s, n, d, ToFlexible); })); })
    .def("attachment", [](Scene &s, py::object body, const std::string &name) { return Out(s.attachment(ToHandle<Body>(body, "the flexible body"), name)); })
    .def("node", [](Scene &s, py::object body, PetscInt label) { return Out(s.node(ToHandle<Body>(body, "the flexible body"), label)); })
    .def("marker", [](Scene &s, py::object b, py::object p, const std::string &n, bool at) { return Out(Directly([&] { return AddMarker(s, b, p, n, at); })); })
    .def("element", [](Scene &s, const std::string &kind, const std::string &name, py::object fields) {
      return Out(Directly([&] { return AddElement(s, kind, name, fields); }));
    })
    .def("variable", [](Scene &s, const std::string &name, py::object e, double initial) { return Out(s.variable(name, ToExpression(e), initial)); })
    .def("state", [](Scene &s, const std::string &name, py::object e, double initial) { return Out(s.state(name, ToExpression(e), initial)); })
    .def("gravity", [](Scene &s, py::object g) { Directly([&] { SetGravity(s, g); }); })
    .def("ground_acceleration", [](Scene &s, py::object x, py::object y, py::object z) { s.groundAcceleration(ToTimeFunction(x), ToTimeFunction(y), ToTimeFunction(z)); })
    .def("parameter", [](Scene &s, const std::string &name, double value) { return s.parameter(name, value); })
    .def("set", [](Scene &s, const std::string &name, double value) { Check(s.set(name, value)); })
    .def("channel", [](Scene &s, const std::string &name, py::object e, const std::string &unit) { s.channel(name, ToExpression(e), unit); })
    .def("shape", [](Scene &s, py::object b, const std::string &kind, py::object size, py::object position, py::object axes, int colour) {
      s.shape(ToHandle<Body>(b, "a shape's body"), ToShape(kind, size, position, axes, colour));
    })
    .def("line", [](Scene &s, py::list markers) {
      std::vector<Marker> all;
      for (py::handle x : markers) all.push_back(ToHandle<Marker>(x, "a line's marker"));
      s.line(all);
    })
    .def("start", SetStart)
    .def("output", SetOutput)
    .def("page", SetPage)
    .def("set_up", [](Scene &s) { Check(s.setUp()); })
    .def("create_ts", NewRun)
    .def("solve", Solve)
    .def("sample", Sample)
    .def("view", [](Scene &s, py::object comm, const std::string &file) {
      PetscViewer viewer;
      if (file.empty()) return Check(s.view(PETSC_VIEWER_STDOUT_(ToComm(comm))));
      Check(PetscViewerASCIIOpen(ToComm(comm), file.c_str(), &viewer));
      const PetscErrorCode code = s.view(viewer);
      Check(PetscViewerDestroy(&viewer));
      Check(code);
    });
}

} // namespace python
} // namespace hhtdae
