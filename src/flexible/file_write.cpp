/* The file of a reduced body is written; its layout is in file.h. */
#include "hhtdae/flexible.h"

#if defined(HHTDAE_HDF5)
#include "flexible/file.h"
#include "flexible/modal_check.h"
#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

namespace hhtdae
{

using namespace bodyfile;

namespace
{

/* ---- datasets ---- */

/* Before it takes the place of another file */
bool OnDisk(const std::string &name)
{
  const int  file = open(name.c_str(), O_RDONLY);
  const bool good = file >= 0 && fsync(file) == 0;
  if (file >= 0) close(file);
  return good;
}

class Writer
{
public:
  Writer(MPI_Comm comm, const std::string &name) : comm_(comm), name_(name), part_(name + ".part")
  {
    struct stat info;
    MPI_Comm_rank(comm, &rank_);
    MPI_Comm_size(comm, &size_);
    if (!rank_ && !stat(name.c_str(), &info) && !S_ISREG(info.st_mode)) part_ = name; /* a device is written to, not replaced */
  }
  ~Writer()
  {
    if (file_ >= 0) H5Fclose(file_);
    if (!rank_ && !complete_ && made_ && part_ != name_) std::remove(part_.c_str());
  }
  Writer(const Writer &) = delete;

  void open()
  {
    if (rank_) return;
    Handle access(H5Pcreate(H5P_FILE_ACCESS), H5Pclose), creation(H5Pcreate(H5P_FILE_CREATE), H5Pclose);
    H5Pset_libver_bounds(access, H5F_LIBVER_V18, H5F_LIBVER_LATEST); /* structures with checksums */
    H5Pset_obj_track_times(creation, 0);                             /* the same body, the same bytes */
    file_ = H5Fcreate(part_.c_str(), H5F_ACC_TRUNC, creation, access);
    made_ = file_ >= 0;
    if (!made_)
      error_ = "cannot write the reduced body to " + name_ +
               ": the file cannot be made (folder missing, or no right to write)";
  }

  /* The same on all ranks, written as rank 0 has it */
  template <class T> void put(const std::string &path, const Dims &dims, const std::vector<T> &data)
  {
    if (rank_ || !error_.empty()) return;
    const uint64_t key = Fnv(path), sum = HashEntries(data.data(), data.size(), key, 0) + HashDims(dims, key);
    Handle         space(H5Screate_simple((int)dims.size(), dims.data(), nullptr), H5Sclose),
        set(create<T>(path, space), H5Dclose);
    if (!set.good() ||
        (!data.empty() && H5Dwrite(set, MemoryType(T()), H5S_ALL, H5S_ALL, H5P_DEFAULT, data.data()) < 0))
      return fail(path);
    seal(path, set, sum);
  }

  /* Every rank has a part, get(row, out) copies rows [row, row + count) of it */
  template <class T, class Get>
  PetscErrorCode putParts(const std::string &path, const Dims &dims, const Cut &cut, Get get)
  {
    const uint64_t key  = Fnv(path);
    uint64_t       mine = 0, sum = 0;
    PetscInt64     largest = (PetscInt64)(cut.own * cut.width), most;
    std::vector<T> part;
    PetscFunctionBegin;
    PetscCallMPI(MPI_Allreduce(&largest, &most, 1, MPIU_INT64, MPI_MAX, comm_));
    const hsize_t step = std::max<hsize_t>(1, block_entries / std::max<hsize_t>(1, (hsize_t)most));
    Handle        space(rank_ ? -1 : H5Screate_simple((int)dims.size(), dims.data(), nullptr), H5Sclose);
    Handle        set(rank_ || !error_.empty() ? -1 : create<T>(path, space), H5Dclose);
    if (!rank_ && error_.empty() && !set.good()) fail(path);
    for (hsize_t row = 0; row < cut.rows; row += step) {
      const hsize_t count = std::min(step, cut.rows - row);
      part.resize(count * cut.own * cut.width);
      get(row, count, part.data());
      for (hsize_t r = 0; r < count; r++)
        mine += HashEntries(part.data() + r * cut.own * cut.width, cut.own * cut.width, key,
                            ((row + r) * cut.all + cut.first) * cut.width);
      PetscCall(pass(path, set, space, dims.size(), row, count, cut, &part));
    }
    PetscCallMPI(MPI_Reduce(&mine, &sum, 1, MPI_UINT64_T, MPI_SUM, 0, comm_));
    if (!rank_ && error_.empty()) seal(path, set, sum + HashDims(dims, key));
    PetscFunctionReturn(0);
  }

  /* Attributes, and the file under its own name. Collective */
  PetscErrorCode finish(const Head &head)
  {
    PetscFunctionBegin;
    if (!rank_ && error_.empty()) {
      const bool good = WriteText(file_, "format", format_name) && WriteAttribute(file_, "version", head.version) &&
                        WriteText(file_, "program", head.program) && WriteText(file_, "source", head.source) &&
                        WriteText(file_, "method", head.method) && WriteText(file_, "units", head.units) &&
                        WriteText(file_, "name", head.name) && WriteAttribute(file_, "fe_nodes", head.fe_nodes) &&
                        WriteAttribute(file_, "elastic_scale", head.elastic_scale) &&
                        WriteChecksum(file_, total_ + head.hash());
      const bool closed = H5Fclose(file_) >= 0;
      file_             = -1;
      if (!good || !closed)
        fail("/");
      else if (part_ != name_ && (!OnDisk(part_) || std::rename(part_.c_str(), name_.c_str())))
        error_ = "cannot write the reduced body to " + name_ + ": " + std::strerror(errno);
      complete_ = error_.empty();
    }
    PetscCall(Agree(comm_, error_, PETSC_ERR_FILE_WRITE));
    PetscFunctionReturn(0);
  }

private:
  template <class T> hid_t create(const std::string &path, hid_t space)
  {
    Handle link(H5Pcreate(H5P_LINK_CREATE), H5Pclose), layout(H5Pcreate(H5P_DATASET_CREATE), H5Pclose);
    if (path.rfind('/') > 0) {
      const std::string group = path.substr(0, path.rfind('/'));
      if (H5Lexists(file_, group.c_str(), H5P_DEFAULT) <= 0) {
        Handle properties(H5Pcreate(H5P_GROUP_CREATE), H5Pclose);
        H5Pset_obj_track_times(properties, 0);
        Handle made(H5Gcreate2(file_, group.c_str(), H5P_DEFAULT, properties, H5P_DEFAULT), H5Gclose);
      }
    }
    H5Pset_obj_track_times(layout, 0);
    H5Pset_alloc_time(layout, H5D_ALLOC_TIME_EARLY);
    H5Pset_fill_time(layout, H5D_FILL_TIME_NEVER);
    return H5Dcreate2(file_, path.c_str(), FileType(T()), space, link, layout, H5P_DEFAULT);
  }

  /* Rows [row, row + count) of all ranks' parts go to rank 0, one rank after the other */
  template <class T>
  PetscErrorCode pass(const std::string &path, hid_t set, hid_t space, std::size_t rank, hsize_t row, hsize_t count,
                      const Cut &cut, std::vector<T> *part)
  {
    PetscInt64 where[2] = {(PetscInt64)cut.first, (PetscInt64)cut.own};
    PetscFunctionBegin;
    if (rank_) {
      PetscCallMPI(MPI_Send(where, 2, MPIU_INT64, 0, 0, comm_));
      PetscCallMPI(MPI_Send(part->data(), (PetscMPIInt)part->size(), MpiType(T()), 0, 1, comm_));
      PetscFunctionReturn(0);
    }
    for (PetscMPIInt r = 0; r < size_; r++) {
      if (r) {
        PetscCallMPI(MPI_Recv(where, 2, MPIU_INT64, r, 0, comm_, MPI_STATUS_IGNORE));
        part->resize(count * (hsize_t)where[1] * cut.width);
        PetscCallMPI(MPI_Recv(part->data(), (PetscMPIInt)part->size(), MpiType(T()), r, 1, comm_, MPI_STATUS_IGNORE));
      }
      if (!error_.empty() || part->empty()) continue;
      const Dims start  = coordinates(rank, row, (hsize_t)where[0], 0),
                 extent = coordinates(rank, count, (hsize_t)where[1], cut.width);
      Handle memory(H5Screate_simple((int)rank, extent.data(), nullptr), H5Sclose);
      H5Sselect_hyperslab(space, H5S_SELECT_SET, start.data(), nullptr, extent.data(), nullptr);
      if (H5Dwrite(set, MemoryType(T()), memory, space, H5P_DEFAULT, part->data()) < 0) fail(path);
    }
    PetscFunctionReturn(0);
  }

  static Dims coordinates(std::size_t rank, hsize_t row, hsize_t node, hsize_t entry)
  {
    if (rank == 1) return {node};
    if (rank == 2) return {node, entry};
    return {row, node, entry};
  }

  void seal(const std::string &path, hid_t set, uint64_t sum)
  {
    if (!WriteChecksum(set, sum)) return fail(path);
    total_ += DatasetShare(path, sum);
  }

  void fail(const std::string &path)
  {
    if (error_.empty())
      error_ = "cannot write the reduced body to " + name_ + ": writing " + path + " failed (disk full?)";
  }

  MPI_Comm    comm_;
  PetscMPIInt rank_, size_;
  std::string name_, part_, error_;
  hid_t       file_ = -1;
  bool        made_ = false, complete_ = false;
  uint64_t    total_ = 0;
};

/* ---- the body ---- */

std::vector<double> Flat(const Eigen::Ref<const Eigen::MatrixXd> &m)
{
  std::vector<double> v;
  v.reserve((std::size_t)m.size());
  for (Eigen::Index j = 0; j < m.cols(); j++)
    for (Eigen::Index i = 0; i < m.rows(); i++) v.push_back(m(i, j));
  return v;
}

/* What is wrong with the sizes of a modal body; "" if nothing is */
std::string Inconsistent(const ModalBody &m)
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
  const auto           append = [](std::vector<double> *v, const std::vector<double> &more) {
    v->insert(v->end(), more.begin(), more.end());
  };
  out->put<double>("/modal/mass", {1}, {m.mass});
  out->put("/modal/center", {3}, Flat(m.center));
  out->put("/modal/moments", {3, 3}, Flat(m.moments.transpose()));
  out->put("/modal/omega", {n}, Flat(m.omega));
  out->put("/modal/first", {n, 3}, Flat(m.first));
  for (const auto &c : m.moment) append(&moment, Flat(c));
  out->put("/modal/moment", {3, n, 3}, moment);
  if (m.quadratic[0].size()) {
    std::vector<double> quadratic;
    for (const auto &q : m.quadratic) append(&quadratic, Flat(q.transpose()));
    out->put("/modal/quadratic", {6, n, n}, quadratic);
  }
  if (m.stiffening[0].size()) {
    std::vector<double> own, loads;
    for (const auto &B : m.stiffening) append(&own, Flat(B));
    for (const auto &at : m.attachments)
      for (const auto &B : at.stiffening) append(&loads, Flat(B));
    out->put("/modal/stiffening", {6, n, n}, own);
    out->put("/attachments/stiffening", {6 * a, n, n}, loads);
  }
  for (const auto &at : m.attachments) {
    names.insert(names.end(), at.name.begin(), at.name.end());
    names.push_back(0);
    append(&position, Flat(at.position));
    append(&translation, Flat(at.translation));
    append(&rotation, Flat(at.rotation));
  }
  out->put("/attachments/name", {names.size()}, names);
  out->put("/attachments/position", {a, 3}, position);
  out->put("/attachments/translation", {a, n, 3}, translation);
  out->put("/attachments/rotation", {a, n, 3}, rotation);
  PutKept(out, m);
  PutLoads(out, m);
}

/* How many nodes there are on all ranks, and what of them is kept */
struct Kept {
  PetscInt64 nodes = 0, first = 0, stressed = 0, first_stressed = 0, elements = 0, first_element = 0;
  bool       coordinates = false, shape = false;
};

/* A body that can be written: sizes agree, numbers are finite. Collective */
PetscErrorCode CheckBody(const ReducedBody &b, Kept *kept)
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
  const std::string sizes = Inconsistent(b.modal), numbers = NotFinite(b.modal);
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

PetscErrorCode PutNodes(Writer *out, const ReducedBody &b, const Kept &kept)
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

PetscErrorCode PutElements(Writer *out, const ReducedBody &b, const Kept &kept)
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

PetscErrorCode PutStress(Writer *out, const ReducedBody &b, const Kept &kept)
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
  Quiet  quiet;
  Writer out(comm, file);
  Kept   kept;
  Head   head;
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
