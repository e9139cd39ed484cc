/* The extension module hhtdae._flexible: FE models, reduction, stress. It is separate from _core, so that rigid scenes do not load SLEPc. */
#include "bind.h"
#include "hhtdae/flexible.h"
#include "hhtdae/modes.h"
#include "functions.h"
#include "linearize.h"
#include <memory>

namespace hhtdae
{
namespace python
{

namespace
{

std::string Text(const py::dict &d, const char *name) { return d[name].cast<std::string>(); }

Material ToMaterial(py::handle x)
{
  const py::tuple t = py::tuple(py::reinterpret_borrow<py::object>(x));
  return {t[0].cast<double>(), t[1].cast<double>(), t[2].cast<double>()};
}

Attachment ToAttachment(py::handle x)
{
  const py::dict d = py::reinterpret_borrow<py::dict>(x);
  Attachment     a;
  a.name = Text(d, "name");
  a.set  = Text(d, "set");
  a.tie  = Text(d, "tie") == "average" ? Tie::Average : Tie::Rigid;
  if (!d["position"].is_none()) {
    a.at_given = true;
    a.position = ToVector(d["position"], "attachment " + a.name + ": position");
  }
  if (!d["weights"].is_none()) {
    const Array w = ToArray(d["weights"], "attachment " + a.name + ": weights");
    a.weights.assign(w.data(), w.data() + w.size());
  }
  return a;
}

/* Converts the tuple (name, set, follows), or (name, {label: force}) */
LoadCase ToLoad(py::handle x)
{
  const py::tuple t = py::reinterpret_borrow<py::tuple>(x);
  LoadCase        l;
  l.name = t[0].cast<std::string>();
  if (t.size() == 3) {
    l.surface = t[1].cast<std::string>();
    l.follows = t[2].cast<bool>();
    return l;
  }
  for (auto force : py::dict(t[1])) {
    const Vector3 f = ToVector(force.second, "load case " + l.name + ": force");
    l.node.push_back(force.first.cast<PetscInt>());
    l.force.insert(l.force.end(), f.data(), f.data() + 3);
  }
  return l;
}

Reduction ToReduction(const py::dict &d)
{
  Reduction         r;
  const std::string method = Text(d, "method");
  for (py::handle a : py::object(d["attachments"])) r.attachments.push_back(ToAttachment(a));
  r.method        = method == "craig_bampton" ? Method::CraigBampton : method == "free_free" ? Method::FreeFree : Method::Static;
  r.modes         = d["modes"].is_none() ? PETSC_DEFAULT : d["modes"].cast<PetscInt>();
  r.max_frequency = d["max_frequency"].cast<double>();
  r.keep_below    = d["keep_below"].cast<double>();
  for (py::handle k : py::object(d["keep"])) r.keep.push_back(k.cast<PetscInt>());
  for (py::handle s : py::object(d["node_sets"])) r.node_sets.push_back(s.cast<std::string>());
  for (py::handle k : py::object(d["nodes"])) r.nodes.push_back(k.cast<PetscInt>());
  for (py::handle l : py::object(d["loads"])) r.loads.push_back(ToLoad(l));
  r.stiffening = d["stiffening"].cast<bool>();
  r.all_nodes  = d["all_nodes"].cast<bool>();
  r.progress   = d["progress"].cast<bool>();
  return r;
}

std::vector<PetscInt> Integers(py::object x)
{
  std::vector<PetscInt> all;
  for (py::handle k : x) all.push_back(k.cast<PetscInt>());
  return all;
}

py::array Out(const std::vector<PetscInt> &x) { return py::array_t<PetscInt>((py::ssize_t)x.size(), x.data()); }
py::array Out(const std::vector<double> &x, py::ssize_t width)
{
  return width == 1 ? FromDoubles(x.data(), {(py::ssize_t)x.size()}) : FromDoubles(x.data(), {(py::ssize_t)x.size() / width, width});
}

/* The tuple (types, materials, nodes) of elements; node numbers are padded with -1 */
py::tuple Elements(const std::vector<FeElement> &all)
{
  static const char *const names[] = {"tetrahedron4", "tetrahedron10", "brick8", "brick20"};
  py::list                 types;
  py::array_t<PetscInt>    materials((py::ssize_t)all.size()), nodes({(py::ssize_t)all.size(), (py::ssize_t)20});
  for (std::size_t e = 0; e < all.size(); e++) {
    types.append(names[(int)all[e].type]);
    materials.mutable_at(e) = all[e].material;
    for (int k = 0; k < 20; k++) nodes.mutable_at(e, k) = k < FeNodes(all[e].type) ? all[e].node[k] : -1;
  }
  return py::make_tuple(types, materials, nodes);
}

void BindModel(py::module_ &m)
{
  py::class_<FeModel, std::shared_ptr<FeModel>>(m, "FeModel")
    .def(py::init([](py::object comm) { return std::make_shared<FeModel>(ToComm(comm)); }))
    .def("read_mesh", [](FeModel &f, const std::string &file, py::dict materials) {
      std::map<std::string, Material> all;
      for (auto x : materials) all[x.first.cast<std::string>()] = ToMaterial(x.second);
      Check(f.readMesh(file, all));
    })
    .def("read_calculix", [](FeModel &f, const std::string &stem) { Check(f.readCalculix(stem)); })
    .def("read_matrices", [](FeModel &f, const std::string &K, const std::string &M, const std::string &nodes, const std::string &sets) {
      Check(f.readMatrices(K, M, nodes, sets));
    })
    .def("set_matrices", [](FeModel &f, py::object K, py::object M, Array x) { Check(f.setMatrices(ToMat(K), ToMat(M), {x.data(), x.data() + x.size()})); })
    .def("add_set", [](FeModel &f, const std::string &name, py::object nodes) { Check(f.addSet(name, Integers(nodes))); })
    .def_readonly("nodes", &FeModel::nodes)
    .def_readonly("own", &FeModel::own)
    .def_readonly("first", &FeModel::first)
    .def_property_readonly("coordinates", [](const FeModel &f) { return Out(f.coordinates, 3); })
    .def_property_readonly("label", [](const FeModel &f) { return Out(f.label); })
    .def_property_readonly("sets", [](const FeModel &f) {
      py::dict all;
      for (const auto &s : f.sets) all[s.first.c_str()] = Out(s.second);
      return all;
    })
    .def_property_readonly("elements", [](const FeModel &f) { return Elements(f.elements); })
    .def_property_readonly("K", [](const FeModel &f) { return f.K ? FromMat(f.K) : py::none(); })
    .def_property_readonly("M", [](const FeModel &f) { return f.M ? FromMat(f.M) : py::none(); });
}

void BindReduced(py::module_ &m)
{
  py::class_<ReducedBody, std::shared_ptr<ReducedBody>>(m, "ReducedBody")
    .def(py::init<>())
    .def("save", [](const ReducedBody &b, const std::string &file) { Check(b.save(file)); })
    .def("load", [](ReducedBody &b, py::object comm, const std::string &file) { Check(b.load(ToComm(comm), file)); })
    .def("modal", [](const ReducedBody &b) { return std::make_shared<ModalBody>(b.modal); })
    .def("frequencies", [](const ReducedBody &b) {
      std::vector<double> f;
      for (const ReducedMode &x : b.mode) f.push_back(x.frequency);
      return Out(f, 1);
    })
    .def("residuals", [](const ReducedBody &b) {
      std::vector<double> f;
      for (const ReducedMode &x : b.mode) f.push_back(x.residual);
      return Out(f, 1);
    })
    .def_readonly("source", &ReducedBody::source)
    .def_readonly("method", &ReducedBody::method)
    .def_property_readonly("coordinates", [](const ReducedBody &b) { return Out(b.coordinates, 3); })
    .def_property_readonly("label", [](const ReducedBody &b) { return Out(b.label); })
    .def_property_readonly("elements", [](const ReducedBody &b) { return Elements(b.elements); })
    .def_property_readonly("shape", [](const ReducedBody &b) { return FromMatrix(b.shape); })
    .def_property_readonly("stress_nodes", [](const ReducedBody &b) { return Out(b.stress.node); })
    .def_property_readonly("stress", [](const ReducedBody &b) { return FromMatrix(b.stress.values); })
    .def("von_mises", [](const ReducedBody &b, py::object eta) {
      std::vector<double> s;
      Check(VonMises(b, ToEigen(eta, "modal coordinates"), &s));
      return Out(s, 1);
    })
    .def("write_field", [](const ReducedBody &b, py::object eta, const std::string &file, py::object origin, py::object axes) {
      Check(WriteField(b, ToEigen(eta, "modal coordinates"), file, ToVector(origin, "origin"), ToMatrix(axes, "axes")));
    });
  py::class_<HotSpots>(m, "HotSpots")
    .def(py::init([](const ReducedBody &b) { return std::make_unique<HotSpots>(b); }), py::keep_alive<1, 2>())
    .def("add", [](HotSpots &h, double t, py::object eta) { Check(h.add(t, ToEigen(eta, "modal coordinates"))); })
    .def("highest", [](const HotSpots &h, PetscInt count, double distance) {
      std::vector<HotSpot> spots;
      py::list             out;
      Check(h.highest(count, distance, &spots));
      for (const HotSpot &s : spots) out.append(py::make_tuple(s.label, FromVector(s.position), s.stress, s.time));
      return out;
    });
  m.def("reduce", [](const FeModel &model, py::dict d) {
    auto body = std::make_shared<ReducedBody>();
    Check(Reduce(model, ToReduction(d), body.get()));
    return body;
  });
  m.def("add_stress_modes", [](const FeModel &model, ReducedBody &b) { Check(AddStressModes(model, &b)); });
  m.def("show", [](Scene &scene, py::object comm, py::object body, const ReducedBody &shown, const std::string &unit) {
    auto        surface = std::make_shared<Surface>();
    PetscMPIInt size, same;
    MPI_Comm_size(shown.comm, &size);
    MPI_Comm_compare(ToComm(comm), shown.comm, &same);
    if (size > 1 && same != MPI_IDENT && same != MPI_CONGRUENT)
      throw py::value_error("the body of the surface is distributed over other ranks than the scene; reduce or load it on the communicator of the scene, or on one rank");
    Check(MakeSurface(shown, surface.get()));
    surface->stress_unit = unit;
    scene.surface(ToHandle<Body>(body, "the body of a surface"), surface);
  });
  m.def("load_modal_body", [](py::object comm, const std::string &file) {
    auto body = std::make_shared<ModalBody>();
    Check(LoadModalBody(ToComm(comm), file, body.get()));
    return body;
  });
}

void BindFull(py::module_ &m)
{
  py::class_<FullFeBody>(m, "FullFeBody")
    .def(py::init<>())
    .def("add", [](FullFeBody &f, Scene &scene, const std::string &name, const FeModel &model, py::dict d) {
      FullBody b;
      b.law               = Text(d, "law") == "small" ? FeLaw::Small : FeLaw::Large;
      b.position          = ToVector(d["position"], name + ": position");
      b.rotation          = ToMatrix(d["rotation"], name + ": rotation");
      b.velocity          = ToVector(d["velocity"], name + ": velocity");
      b.angular_velocity  = ToVector(d["angular_velocity"], name + ": angular velocity");
      b.mass_damping      = d["mass_damping"].cast<double>();
      b.stiffness_damping = d["stiffness_damping"].cast<double>();
      for (py::handle a : py::object(d["attachments"])) b.attachments.push_back(ToAttachment(a));
      Check(f.add(scene, name, model, b));
    })
    .def("attachment", [](const FullFeBody &f, const std::string &name) {
      const Body b = f.attachment(name);
      return py::make_tuple(b.id, b.scene);
    })
    .def("positions", [](const FullFeBody &f, py::object ts, double t) {
      std::vector<double> x;
      Check(f.positions(ToTS(ts), t, &x));
      return Out(x, 3);
    })
    .def("write_field", [](const FullFeBody &f, py::object ts, double t, const std::string &file) { Check(f.writeField(ToTS(ts), t, file)); });
  m.def("slowest_modes", [](Linearized &of, PetscInt count, double shift) {
    std::vector<Mode> modes;
    py::list          out;
    Check(SlowestModes(of.get(), count, &modes, shift));
    for (Mode &x : modes) out.append(py::cast(std::move(x)));
    return out;
  });
}

} // namespace

} // namespace python
} // namespace hhtdae

PYBIND11_MODULE(_flexible, m)
{
  pybind11::module_::import("hhtdae._core"); /* registers the types that _flexible uses */
  hhtdae::python::BindModel(m);
  hhtdae::python::BindReduced(m);
  hhtdae::python::BindFull(m);
}
