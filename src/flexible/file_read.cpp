/* Reads a reduced body from its file, with file_reader.h; the layout is described in file.h. */
#include "hhtdae/flexible.h"

#if defined(HHTDAE_HDF5)
#include "flexible/file_reader.h"
#include "flexible/modal_check.h"
#include <algorithm>

namespace hhtdae
{

using namespace bodyfile;

namespace
{

Modes3 ThreeRows(const std::vector<double> &v, hsize_t begin, hsize_t n)
{
  return Eigen::Map<const Modes3>(v.data() + begin * 3 * n, 3, (Eigen::Index)n);
}

/* Reads names that end with a zero each; an error if there are not `count` of them */
std::vector<std::string> GetNames(Reader *in, const std::string &path, hsize_t count, const std::string &of)
{
  std::vector<std::string> all;
  const Dims               characters = in->dims<uint8_t>(path);
  if (!in->error.empty()) return all;
  const auto names = in->get<uint8_t>(path, {characters[0]});
  if (!in->error.empty()) return all;
  if ((hsize_t)std::count(names.begin(), names.end(), 0) != count || (count && names.back())) {
    in->fail(path + " does not have a name for each " + of);
    return all;
  }
  for (auto name = names.begin(); name != names.end(); ++name) {
    const auto end = std::find(name, names.end(), 0);
    all.emplace_back(name, end);
    name = end;
  }
  return all;
}

void GetKept(Reader *in, hsize_t n, ModalBody *m)
{
  if (!in->has("/kept/label")) return;
  const Dims labels = in->dims<int64_t>("/kept/label");
  if (!in->error.empty()) return;
  const hsize_t k        = labels[0];
  const auto    label    = in->get<int64_t>("/kept/label", {k});
  const auto    turns    = in->get<uint8_t>("/kept/turns", {k});
  const auto    position = in->get<double>("/kept/position", {k, 3}), translation = in->get<double>("/kept/translation", {k, n, 3}),
             rotation = in->get<double>("/kept/rotation", {k, n, 3});
  if (!in->error.empty()) return;
  for (hsize_t i = 0; i < k; i++) {
    ModalNode node;
    if (label[i] < 0 || label[i] > (int64_t)PETSC_MAX_INT) return in->fail("/kept/label has an impossible number, " + std::to_string(label[i]));
    if (turns[i] > 1) return in->fail("/kept/turns has " + std::to_string(turns[i]) + ", must be 0 or 1");
    node.label       = (PetscInt)label[i];
    node.turns       = turns[i] != 0;
    node.position    = Eigen::Map<const Vector3>(position.data() + 3 * i);
    node.translation = ThreeRows(translation, i, n);
    node.rotation    = ThreeRows(rotation, i, n);
    m->nodes.push_back(node);
  }
}

void GetLoads(Reader *in, hsize_t n, ModalBody *m)
{
  if (!in->has("/loads/force")) return;
  const Dims forces = in->dims<double>("/loads/force");
  if (!in->error.empty()) return;
  const hsize_t l         = forces[0];
  const auto    names     = GetNames(in, "/loads/name", l, "load case");
  const auto    follows   = in->get<uint8_t>("/loads/follows", {l});
  const auto    force     = in->get<double>("/loads/force", {l, 3}), moment = in->get<double>("/loads/moment", {l, 3}),
             modal = in->get<double>("/loads/modal", {l, n}), by_moment = in->get<double>("/loads/moment_gradient", {l, n, 3});
  if (!in->error.empty()) return;
  for (uint8_t f : follows)
    if (f > 1) return in->fail("/loads/follows has " + std::to_string(f) + ", must be 0 or 1");
  const hsize_t       f = (hsize_t)std::count(follows.begin(), follows.end(), 1);
  std::vector<double> by_force, by_modal;
  if (f) {
    by_force = in->get<double>("/loads/force_gradient", {f, n, 3});
    by_modal = in->get<double>("/loads/modal_gradient", {f, n, n});
  }
  if (!in->error.empty()) return;
  const Eigen::Index modes = (Eigen::Index)n;
  for (hsize_t i = 0, at = 0; i < l; i++) {
    ModalLoadCase c;
    c.name            = names[i];
    c.force           = Eigen::Map<const Vector3>(force.data() + 3 * i);
    c.moment          = Eigen::Map<const Vector3>(moment.data() + 3 * i);
    c.modal           = Eigen::Map<const Eigen::VectorXd>(modal.data() + n * i, modes);
    c.moment_gradient = ThreeRows(by_moment, i, n);
    if (follows[i]) {
      c.force_gradient = ThreeRows(by_force, at, n);
      c.modal_gradient = Eigen::Map<const Eigen::MatrixXd>(by_modal.data() + at++ * n * n, modes, modes).transpose();
    }
    m->loads.push_back(c);
  }
}

void GetAttachments(Reader *in, hsize_t n, ModalBody *m)
{
  const Dims positions = in->dims<double>("/attachments/position");
  if (!in->error.empty()) return;
  const hsize_t a        = positions[0];
  const auto    names    = GetNames(in, "/attachments/name", a, "attachment");
  const auto    position = in->get<double>("/attachments/position", {a, 3}),
             translation = in->get<double>("/attachments/translation", {a, n, 3}),
             rotation    = in->get<double>("/attachments/rotation", {a, n, 3});
  if (!in->error.empty()) return;
  for (hsize_t i = 0; i < a; i++) {
    ModalAttachment at;
    at.name        = names[i];
    at.position    = Eigen::Map<const Vector3>(position.data() + 3 * i);
    at.translation = ThreeRows(translation, i, n);
    at.rotation    = ThreeRows(rotation, i, n);
    m->attachments.push_back(at);
  }
}

/* The matrices are symmetric, so that storage by rows or columns makes no difference */
void GetStiffening(Reader *in, hsize_t n, ModalBody *m)
{
  if (!in->has("/modal/stiffening") || !in->error.empty()) return;
  const hsize_t a   = m->attachments.size();
  const auto    own = in->get<double>("/modal/stiffening", {6, n, n}), loads = in->get<double>("/attachments/stiffening", {6 * a, n, n});
  if (!in->error.empty()) return;
  const auto fill = [&](const std::vector<double> &from, hsize_t begin, std::array<Eigen::MatrixXd, 6> *to) {
    for (hsize_t p = 0; p < 6; p++) (*to)[p] = Eigen::Map<const Eigen::MatrixXd>(from.data() + (begin + p) * n * n, (Eigen::Index)n, (Eigen::Index)n);
  };
  fill(own, 0, &m->stiffening);
  for (hsize_t i = 0; i < a; i++) fill(loads, 6 * i, &m->attachments[i].stiffening);
}

void GetModal(Reader *in, ModalBody *m)
{
  const Dims modes = in->dims<double>("/modal/omega");
  if (!in->error.empty()) return;
  const hsize_t n    = modes[0];
  const auto    mass = in->get<double>("/modal/mass", {1}), center = in->get<double>("/modal/center", {3}),
             moments = in->get<double>("/modal/moments", {3, 3}), omega = in->get<double>("/modal/omega", {n}),
             first = in->get<double>("/modal/first", {n, 3}), moment = in->get<double>("/modal/moment", {3, n, 3});
  std::vector<double> quadratic;
  if (in->has("/modal/quadratic")) quadratic = in->get<double>("/modal/quadratic", {6, n, n});
  GetAttachments(in, n, m);
  GetStiffening(in, n, m);
  GetKept(in, n, m);
  GetLoads(in, n, m);
  if (!in->error.empty()) return;
  m->name    = in->head.name;
  m->mass    = mass[0];
  m->center  = Eigen::Map<const Vector3>(center.data());
  m->moments = Eigen::Map<const Matrix3>(moments.data()).transpose();
  m->omega   = Eigen::Map<const Eigen::VectorXd>(omega.data(), (Eigen::Index)n);
  m->first   = ThreeRows(first, 0, n);
  for (hsize_t c = 0; c < 3; c++) m->moment[c] = ThreeRows(moment, c, n);
  for (hsize_t p = 0; p < 6 && !quadratic.empty(); p++)
    m->quadratic[p] =
        Eigen::Map<const Eigen::MatrixXd>(quadratic.data() + p * n * n, (Eigen::Index)n, (Eigen::Index)n).transpose();
  const std::string bad = NotFinite(*m);
  if (!bad.empty()) return in->fail("numbers that are not finite: " + bad);
  const std::string impossible = Impossible(*m);
  if (!impossible.empty()) in->fail("it has " + impossible);
}

void GetModes(Reader *in, hsize_t n, ReducedBody *b)
{
  if (!in->has("/modes/frequency")) return;
  const auto frequency = in->get<double>("/modes/frequency", {n}), residual = in->get<double>("/modes/residual", {n});
  if (!in->error.empty()) return;
  if (!Finite(frequency) || !Finite(residual)) return in->fail("a mode's frequency or residual is not finite");
  for (double f : frequency)
    if (f < 0) return in->fail("a mode's frequency is negative");
  const bool known = in->head.version >= 2; /* version 1 had residuals of forces, a different quantity */
  for (hsize_t k = 0; k < n; k++) b->mode.push_back({frequency[k], known ? residual[k] : -1.});
}

void GetNodes(Reader *in, PetscMPIInt rank, PetscMPIInt size, hsize_t n, hsize_t *N, ReducedBody *b)
{
  *N = 0;
  if (!in->has("/nodes/coordinates")) return;
  const Dims nodes = in->dims<double>("/nodes/coordinates");
  if (!in->error.empty()) return;
  *N                       = nodes[0];
  b->first                 = (PetscInt)PartBegin((PetscInt64)*N, size, rank);
  b->own                   = (PetscInt)PartBegin((PetscInt64)*N, size, rank + 1) - b->first;
  const hsize_t        own = (hsize_t)b->own, first = (hsize_t)b->first;
  std::vector<int64_t> label(own);
  b->coordinates.resize(3 * own);
  in->part("/nodes/coordinates", {*N, 3}, {1, own, first, *N, 3}, b->coordinates.data());
  in->part("/nodes/label", {*N}, {1, own, first, *N, 1}, label.data());
  for (int64_t l : label)
    if (l < 0 || l > (int64_t)PETSC_MAX_INT) return in->fail("/nodes/label has an impossible number, " + std::to_string(l));
  b->label.assign(label.begin(), label.end());
  if (in->has("/nodes/shape")) {
    const Dims shape = in->dims<double>("/nodes/shape");
    if (!in->error.empty()) return;
    if (shape != Dims{n, *N, 3})
      return in->fail("/nodes/shape has " + Text(shape) + " entries in place of " + Text({n, *N, 3}));
    b->shape.resize(3 * (Eigen::Index)own, (Eigen::Index)n);
    in->part("/nodes/shape", {n, *N, 3}, {n, own, first, *N, 3}, b->shape.data());
  }
  if (!Finite(b->coordinates) || !b->shape.allFinite()) in->fail("numbers that are not finite: nodes");
}

/* Reads this rank's elements and their nodes. Collective */
PetscErrorCode GetElements(Reader *in, MPI_Comm comm, PetscMPIInt rank, PetscMPIInt size, hsize_t N, ReducedBody *b)
{
  std::vector<uint8_t> type;
  std::vector<int64_t> material, node;
  PetscInt64           begin = 0, all = 0, mine = 0;
  PetscFunctionBegin;
  if (!in->has("/elements/type")) PetscFunctionReturn(0);
  const Dims    elements = in->dims<uint8_t>("/elements/type");
  const hsize_t E = elements.empty() ? 0 : elements[0], first = (hsize_t)PartBegin((PetscInt64)E, size, rank),
                own = (hsize_t)PartBegin((PetscInt64)E, size, rank + 1) - first;
  type.resize(own);
  material.resize(own);
  in->part("/elements/type", {E}, {1, own, first, E, 1}, type.data());
  in->part("/elements/material", {E}, {1, own, first, E, 1}, material.data());
  for (uint8_t t : type)
    if (t > 3)
      in->fail("/elements/type has an unknown type, " + std::to_string(t));
    else
      mine += FeNodes((ElementType)t);
  PetscCall(in->agree(comm));
  PetscCall(RangeOnRank(comm, mine, &begin, &all));
  node.resize((std::size_t)mine);
  in->part("/elements/node", {(hsize_t)all}, {1, (hsize_t)mine, (hsize_t)begin, (hsize_t)all, 1}, node.data());
  PetscCall(in->agree(comm));
  const int64_t *next = node.data();
  for (hsize_t e = 0; e < own; e++) {
    FeElement element{(ElementType)type[e], (PetscInt)material[e], {}};
    if (material[e] < 0 || material[e] > (int64_t)PETSC_MAX_INT)
      in->fail("/elements/material has an impossible number, " + std::to_string(material[e]));
    for (int k = 0; k < FeNodes(element.type); k++, next++) {
      if (*next < 0 || *next >= (int64_t)N)
        in->fail("/elements/node has a node that is not there, " + std::to_string(*next));
      element.node[k] = (PetscInt)*next;
    }
    b->elements.push_back(element);
  }
  PetscCall(in->agree(comm));
  PetscFunctionReturn(0);
}

/* Index of the first node with stress whose number is at least `from`, by bisection */
hsize_t FirstStressed(Reader *in, hsize_t S, int64_t from)
{
  hsize_t low = 0, high = S;
  while (low < high && in->error.empty()) {
    const hsize_t middle = low + (high - low) / 2;
    if (in->entry("/stress/node", middle) < from)
      low = middle + 1;
    else
      high = middle;
  }
  return low;
}

PetscErrorCode GetStress(Reader *in, MPI_Comm comm, hsize_t n, ReducedBody *b)
{
  PetscInt64 begin, all;
  PetscFunctionBegin;
  if (!in->has("/stress/node")) PetscFunctionReturn(0);
  const Dims    nodes = in->dims<int64_t>("/stress/node");
  const hsize_t S = nodes.empty() ? 0 : nodes[0], first = FirstStressed(in, S, b->first),
                own = std::max(first, FirstStressed(in, S, (int64_t)b->first + b->own)) - first;
  std::vector<int64_t> node(own);
  PetscCall(in->agree(comm));
  PetscCall(RangeOnRank(comm, (PetscInt64)own, &begin, &all));
  if (all != (PetscInt64)S || begin != (PetscInt64)first) in->fail("/stress/node is not ascending among the nodes");
  const Dims values = in->dims<double>("/stress/values");
  if (in->error.empty() && values != Dims{n, S, 6})
    in->fail("/stress/values has " + Text(values) + " entries in place of " + Text({n, S, 6}));
  PetscCall(in->agree(comm));
  in->part("/stress/node", {S}, {1, own, first, S, 1}, node.data());
  b->stress.values.resize(6 * (Eigen::Index)own, (Eigen::Index)n);
  in->part("/stress/values", {n, S, 6}, {n, own, first, S, 6}, b->stress.values.data());
  PetscCall(in->agree(comm));
  for (std::size_t i = 0; i < own; i++) {
    const int64_t place = node[i] - b->first;
    if (place < 0 || place >= b->own || (i && node[i] <= node[i - 1]))
      in->fail("/stress/node is not ascending among the nodes");
    b->stress.node.push_back((PetscInt)place);
  }
  if (!b->stress.values.allFinite()) in->fail("numbers that are not finite: stress modes");
  PetscCall(in->agree(comm));
  PetscFunctionReturn(0);
}

/* Reads the whole body */
PetscErrorCode LoadBody(MPI_Comm comm, const std::string &file, ReducedBody *b)
{
  Quiet       quiet;
  Reader      in(file);
  PetscMPIInt rank, size;
  hsize_t     n, N = 0;
  PetscFunctionBegin;
  PetscCallMPI(MPI_Comm_rank(comm, &rank));
  PetscCallMPI(MPI_Comm_size(comm, &size));
  b->comm = comm;
  in.open();
  PetscCall(in.agree(comm));
  GetModal(&in, &b->modal);
  n = (hsize_t)b->modal.omega.size();
  GetModes(&in, n, b);
  PetscCall(in.agree(comm));
  GetNodes(&in, rank, size, n, &N, b);
  PetscCall(in.agree(comm));
  PetscCall(GetElements(&in, comm, rank, size, N, b));
  PetscCall(GetStress(&in, comm, n, b));
  b->source        = in.head.source;
  b->method        = in.head.method;
  b->units         = in.head.units;
  b->fe_nodes      = (PetscInt)in.head.fe_nodes;
  b->elastic_scale = in.head.elastic_scale;
  PetscFunctionReturn(0);
}

} // namespace

/* The body stays as it was if the file is refused. */
PetscErrorCode ReducedBody::load(MPI_Comm c, const std::string &file)
{
  ReducedBody body;
  PetscFunctionBegin;
  PetscCall(LoadBody(c, file, &body));
  *this = std::move(body);
  PetscFunctionReturn(0);
}

PetscErrorCode LoadModalBody(MPI_Comm comm, const std::string &file, ModalBody *body)
{
  Quiet     quiet;
  Reader    in(file);
  ModalBody modal;
  PetscFunctionBegin;
  in.open();
  PetscCall(in.agree(comm));
  GetModal(&in, &modal);
  PetscCall(in.agree(comm));
  *body = std::move(modal);
  PetscFunctionReturn(0);
}

} // namespace hhtdae

#else

namespace hhtdae
{

PetscErrorCode ReducedBody::load(MPI_Comm c, const std::string &file)
{
  PetscFunctionBegin;
  SETERRQ(c, PETSC_ERR_SUP, "cannot read the reduced body from %s: the library was built without HDF5", file.c_str());
}

PetscErrorCode LoadModalBody(MPI_Comm comm, const std::string &file, ModalBody *)
{
  PetscFunctionBegin;
  SETERRQ(comm, PETSC_ERR_SUP, "cannot read the reduced body from %s: the library was built without HDF5",
          file.c_str());
}

} // namespace hhtdae

#endif
