/* Writes a reduced body to its file, with file_writer.h; the layout is described in file.h. */
#include "hhtdae/flexible.h"

#if defined(HHTDAE_HDF5)
#include "flexible/file_writer.h"
#include "flexible/modal_check.h"
#include <algorithm>

namespace hhtdae
{

using namespace bodyfile;

namespace
{

std::vector<double> Flat(const Eigen::Ref<const Eigen::MatrixXd> &m)
{
  std::vector<double> v;
  v.reserve((std::size_t)m.size());
  for (Eigen::Index j = 0; j < m.cols(); j++)
    for (Eigen::Index i = 0; i < m.rows(); i++) v.push_back(m(i, j));
  return v;
}

/* A description of inconsistent sizes in a modal body, or "" */
std::string SizeProblem(const ModalBody &m)
{
  const Eigen::Index n = m.omega.size();
  if (m.first.cols() != n)
    return "first moments of " + std::to_string(m.first.cols()) + " modes among " + std::to_string(n);
  for (const auto &c : m.moment)
    if (c.cols() != n) return "second moments of " + std::to_string(c.cols()) + " modes among " + std::to_string(n);
  for (const auto &q : m.quadratic)
    if ((q.size() || m.quadratic[0].size()) && (q.rows() != n || q.cols() != n))
      return "quadratic invariants of another size than the modes";
  const bool stiffened = m.stiffening[0].size() > 0;
  const auto square    = [&](const std::array<Eigen::MatrixXd, 6> &all) {
    return std::all_of(all.begin(), all.end(), [&](const Eigen::MatrixXd &B) { return stiffened ? B.rows() == n && B.cols() == n : B.size() == 0; });
  };
  if (!square(m.stiffening)) return "stiffening of another size than the modes";
  for (const auto &a : m.attachments) {
    if (!square(a.stiffening)) return "stiffening of attachment " + a.name + " of another size than the modes, or without that by angular velocities";
    if (a.translation.cols() != n || a.rotation.cols() != n)
      return "modes of attachment " + a.name + " are not as many as the body's";
    if (a.name.find('\0') != std::string::npos) return "a name with a zero inside";
  }
  for (const auto &a : m.nodes)
    if (a.translation.cols() != n || a.rotation.cols() != n) return "modes of kept node " + std::to_string(a.label) + " are not as many as the body's";
  for (const auto &l : m.loads) {
    const Eigen::Index f = l.modal_gradient.rows();
    if (l.modal.size() != n || l.moment_gradient.cols() != n || l.modal_gradient.cols() != f || l.force_gradient.cols() != f || (f && f != n))
      return "load case " + l.name + " of another size than the modes, or with one gradient alone of force and work";
    if (l.name.find('\0') != std::string::npos) return "a name with a zero inside";
  }
  return "";
}

void Append(std::vector<double> *v, const std::vector<double> &more) { v->insert(v->end(), more.begin(), more.end()); }

void PutKept(Writer *out, const ModalBody &m)
{
  const hsize_t        k = m.nodes.size(), n = (hsize_t)m.omega.size();
  std::vector<int64_t> label;
  std::vector<uint8_t> turns;
  std::vector<double>  position, translation, rotation;
  if (!k) return;
  for (const ModalNode &a : m.nodes) {
    label.push_back(a.label);
    turns.push_back(a.turns);
    Append(&position, Flat(a.position));
    Append(&translation, Flat(a.translation));
    Append(&rotation, Flat(a.rotation));
  }
  out->put("/kept/label", {k}, label);
  out->put("/kept/position", {k, 3}, position);
  out->put("/kept/turns", {k}, turns);
  out->put("/kept/translation", {k, n, 3}, translation);
  out->put("/kept/rotation", {k, n, 3}, rotation);
}

void PutLoads(Writer *out, const ModalBody &m)
{
  const hsize_t        l = m.loads.size(), n = (hsize_t)m.omega.size();
  std::vector<uint8_t> names, follows;
  std::vector<double>  force, moment, modal, by_moment, by_force, by_modal;
  hsize_t              f = 0;
  if (!l) return;
  for (const ModalLoadCase &c : m.loads) {
    names.insert(names.end(), c.name.begin(), c.name.end());
    names.push_back(0);
    follows.push_back(c.modal_gradient.size() > 0);
    f += follows.back();
    Append(&force, Flat(c.force));
    Append(&moment, Flat(c.moment));
    Append(&modal, Flat(c.modal));
    Append(&by_moment, Flat(c.moment_gradient));
    Append(&by_force, Flat(c.force_gradient));
    Append(&by_modal, Flat(c.modal_gradient.transpose()));
  }
  out->put("/loads/name", {names.size()}, names);
  out->put("/loads/force", {l, 3}, force);
  out->put("/loads/moment", {l, 3}, moment);
  out->put("/loads/modal", {l, n}, modal);
  out->put("/loads/moment_gradient", {l, n, 3}, by_moment);
  out->put("/loads/follows", {l}, follows);
  if (!f) return;
  out->put("/loads/force_gradient", {f, n, 3}, by_force);
  out->put("/loads/modal_gradient", {f, n, n}, by_modal);
}

void PutModal(Writer *out, const ModalBody &m)
{
  const hsize_t        n = (hsize_t)m.omega.size(), a = m.attachments.size();
  std::vector<double>  moment, position, translation, rotation;
  std::vector<uint8_t> names;
  out->put<double>("/modal/mass", {1}, {m.mass});
  out->put("/modal/center", {3}, Flat(m.center));
  out->put("/modal/moments", {3, 3}, Flat(m.moments.transpose()));
  out->put("/modal/omega", {n}, Flat(m.omega));
  out->put("/modal/first", {n, 3}, Flat(m.first));
  for (const auto &c : m.moment) Append(&moment, Flat(c));
  out->put("/modal/moment", {3, n, 3}, moment);
  if (m.quadratic[0].size()) {
    std::vector<double> quadratic;
    for (const auto &q : m.quadratic) Append(&quadratic, Flat(q.transpose()));
    out->put("/modal/quadratic", {6, n, n}, quadratic);
  }
  if (m.stiffening[0].size()) {
    std::vector<double> own, loads;
    for (const auto &B : m.stiffening) Append(&own, Flat(B));
    for (const auto &at : m.attachments)
      for (const auto &B : at.stiffening) Append(&loads, Flat(B));
    out->put("/modal/stiffening", {6, n, n}, own);
    out->put("/attachments/stiffening", {6 * a, n, n}, loads);
  }
  for (const auto &at : m.attachments) {
    names.insert(names.end(), at.name.begin(), at.name.end());
    names.push_back(0);
    Append(&position, Flat(at.position));
    Append(&translation, Flat(at.translation));
    Append(&rotation, Flat(at.rotation));
  }
  out->put("/attachments/name", {names.size()}, names);
  out->put("/attachments/position", {a, 3}, position);
  out->put("/attachments/translation", {a, n, 3}, translation);
  out->put("/attachments/rotation", {a, n, 3}, rotation);
  PutKept(out, m);
  PutLoads(out, m);
}

/* Numbers of nodes, nodes with stress and elements on all ranks, and this rank's first ones; whether coordinates and shapes are stored */
struct StoredParts {
  PetscInt64 nodes = 0, first = 0, stressed = 0, first_stressed = 0, elements = 0, first_element = 0;
  bool       coordinates = false, shape = false;
};

/* Checks that sizes agree and numbers are finite. Collective */
PetscErrorCode CheckBody(const ReducedBody &b, StoredParts *kept)
{
  const Eigen::Index n = b.modal.omega.size();
  std::string        error;
  PetscFunctionBegin;
  PetscCall(RangeOnRank(b.comm, b.own, &kept->first, &kept->nodes));
  PetscCall(RangeOnRank(b.comm, (PetscInt64)b.stress.node.size(), &kept->first_stressed, &kept->stressed));
  PetscCall(RangeOnRank(b.comm, (PetscInt64)b.elements.size(), &kept->first_element, &kept->elements));
  int some[2] = {!b.coordinates.empty(), b.shape.size() > 0};
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, some, 2, MPI_INT, MPI_MAX, b.comm));
  kept->coordinates = some[0];
  kept->shape       = some[1];
  const auto wrong  = [&error](bool is, const std::string &why) {
    if (is && error.empty()) error = "the reduced body cannot be written: " + why;
  };
  const std::string sizes = SizeProblem(b.modal), numbers = NotFinite(b.modal);
  wrong(!sizes.empty(), sizes);
  wrong(!numbers.empty(), "numbers that are not finite: " + numbers);
  const std::string impossible = sizes.empty() && numbers.empty() ? Impossible(b.modal) : "";
  wrong(!impossible.empty(), "it has " + impossible);
  wrong(!b.mode.empty() && (Eigen::Index)b.mode.size() != n,
        std::to_string(b.mode.size()) + " frequencies and residuals for " + std::to_string(n) + " modes");
  for (const ReducedMode &m : b.mode)
    wrong(!std::isfinite(m.frequency) || !std::isfinite(m.residual) || m.frequency < 0,
          "a mode's frequency or residual is not finite, or the frequency negative");
  wrong(!std::isfinite(b.elastic_scale) || b.elastic_scale < 0, "elastic_scale is negative or not finite");
  for (PetscInt l : b.label) wrong(l < 0, "a node has a negative label");
  wrong(b.own < 0 || (b.own && b.first != kept->first),
        "its first node is " + std::to_string(b.first) + ", the ranks before have " + std::to_string(kept->first));
  const std::size_t own = (std::size_t)std::max<PetscInt>(0, b.own);
  if (kept->coordinates)
    wrong(b.coordinates.size() != 3 * own || b.label.size() != own,
          "coordinates and labels are not those of its own nodes");
  if (kept->shape)
    wrong(b.shape.rows() != 3 * (Eigen::Index)own || b.shape.cols() != n,
          "its shape is not that of its own nodes and its modes");
  wrong(!kept->coordinates && (kept->shape || kept->elements || kept->stressed),
        "shape, elements or stress without nodes");
  wrong(!b.stress.node.empty() &&
            (b.stress.values.rows() != 6 * (Eigen::Index)b.stress.node.size() || b.stress.values.cols() != n),
        "its stress modes are not those of its nodes with stress and its modes");
  for (std::size_t i = 0; i < b.stress.node.size(); i++)
    wrong(b.stress.node[i] < 0 || b.stress.node[i] >= b.own || (i && b.stress.node[i] <= b.stress.node[i - 1]),
          "its nodes with stress are not ascending places among its own nodes");
  for (const FeElement &e : b.elements) {
    wrong((unsigned)e.type > 3, "an element of unknown type");
    wrong(e.material < 0, "an element without a material");
    for (int k = 0; (unsigned)e.type <= 3 && k < FeNodes(e.type); k++)
      wrong(e.node[k] < 0 || e.node[k] >= kept->nodes, "an element's node that is not there");
  }
  wrong(!Finite(b.coordinates), "a coordinate is not finite");
  wrong(!b.shape.allFinite(), "a mode at the nodes is not finite");
  wrong(!b.stress.values.allFinite(), "a stress mode is not finite");
  PetscCall(Agree(b.comm, error, PETSC_ERR_ARG_INCOMP));
  PetscFunctionReturn(0);
}

PetscErrorCode PutNodes(Writer *out, const ReducedBody &b, const StoredParts &kept)
{
  const hsize_t N = (hsize_t)kept.nodes, n = (hsize_t)b.modal.omega.size(), own = (hsize_t)b.own,
                first = (hsize_t)kept.first;
  PetscFunctionBegin;
  if (!kept.coordinates) PetscFunctionReturn(0);
  PetscCall(
      out->putParts<double>("/nodes/coordinates", {N, 3}, {1, own, first, N, 3}, [&b](hsize_t, hsize_t, double *to) {
        std::copy(b.coordinates.begin(), b.coordinates.end(), to);
      }));
  PetscCall(out->putParts<int64_t>("/nodes/label", {N}, {1, own, first, N, 1}, [&b](hsize_t, hsize_t, int64_t *to) {
    std::copy(b.label.begin(), b.label.end(), to);
  }));
  if (kept.shape)
    PetscCall(out->putParts<double>("/nodes/shape", {n, N, 3}, {n, own, first, N, 3},
                                    [&b, own](hsize_t row, hsize_t count, double *to) {
                                      std::copy_n(b.shape.data() + row * 3 * own, count * 3 * own, to);
                                    }));
  PetscFunctionReturn(0);
}

PetscErrorCode PutElements(Writer *out, const ReducedBody &b, const StoredParts &kept)
{
  const hsize_t        E = (hsize_t)kept.elements, own = b.elements.size(), first = (hsize_t)kept.first_element;
  std::vector<int64_t> node;
  PetscInt64           begin, all;
  PetscFunctionBegin;
  if (!E) PetscFunctionReturn(0);
  for (const FeElement &e : b.elements) node.insert(node.end(), e.node, e.node + FeNodes(e.type));
  PetscCall(RangeOnRank(b.comm, (PetscInt64)node.size(), &begin, &all));
  PetscCall(out->putParts<uint8_t>("/elements/type", {E}, {1, own, first, E, 1}, [&b](hsize_t, hsize_t, uint8_t *to) {
    for (const FeElement &e : b.elements) *to++ = (uint8_t)e.type;
  }));
  PetscCall(
      out->putParts<int64_t>("/elements/material", {E}, {1, own, first, E, 1}, [&b](hsize_t, hsize_t, int64_t *to) {
        for (const FeElement &e : b.elements) *to++ = e.material;
      }));
  PetscCall(
      out->putParts<int64_t>("/elements/node", {(hsize_t)all}, {1, node.size(), (hsize_t)begin, (hsize_t)all, 1},
                             [&node](hsize_t, hsize_t, int64_t *to) { std::copy(node.begin(), node.end(), to); }));
  PetscFunctionReturn(0);
}

PetscErrorCode PutStress(Writer *out, const ReducedBody &b, const StoredParts &kept)
{
  const hsize_t S = (hsize_t)kept.stressed, n = (hsize_t)b.modal.omega.size(), own = b.stress.node.size(),
                first = (hsize_t)kept.first_stressed;
  PetscFunctionBegin;
  if (!S) PetscFunctionReturn(0);
  PetscCall(out->putParts<int64_t>("/stress/node", {S}, {1, own, first, S, 1}, [&](hsize_t, hsize_t, int64_t *to) {
    for (PetscInt i : b.stress.node) *to++ = kept.first + i;
  }));
  PetscCall(out->putParts<double>("/stress/values", {n, S, 6}, {n, own, first, S, 6},
                                  [&b, own](hsize_t row, hsize_t count, double *to) {
                                    std::copy_n(b.stress.values.data() + row * 6 * own, count * 6 * own, to);
                                  }));
  PetscFunctionReturn(0);
}

} // namespace

PetscErrorCode ReducedBody::save(const std::string &file) const
{
  Quiet       quiet;
  Writer      out(comm, file);
  StoredParts kept;
  Head        head;
  PetscFunctionBegin;
  PetscCall(CheckBody(*this, &kept));
  out.open();
  PutModal(&out, modal);
  if (!mode.empty()) {
    std::vector<double> frequency, residual;
    for (const ReducedMode &m : mode) {
      frequency.push_back(m.frequency);
      residual.push_back(m.residual);
    }
    out.put("/modes/frequency", {frequency.size()}, frequency);
    out.put("/modes/residual", {residual.size()}, residual);
  }
  PetscCall(PutNodes(&out, *this, kept));
  PetscCall(PutElements(&out, *this, kept));
  PetscCall(PutStress(&out, *this, kept));
  head.source        = source;
  head.method        = method;
  head.units         = units;
  head.name          = modal.name;
  head.fe_nodes      = fe_nodes;
  head.elastic_scale = elastic_scale;
  PetscCall(out.finish(head));
  PetscFunctionReturn(0);
}

} // namespace hhtdae

#else

namespace hhtdae
{

PetscErrorCode ReducedBody::save(const std::string &file) const
{
  PetscFunctionBegin;
  SETERRQ(comm, PETSC_ERR_SUP, "cannot write the reduced body to %s: the library was built without HDF5", file.c_str());
}

} // namespace hhtdae

#endif
