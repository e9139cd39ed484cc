/*
  Files of reduced bodies: bytes changed anywhere, which HDF5's checksums or ours find; and files of which HDF5 itself has
  nothing to say, with other numbers, sizes and kinds of numbers and right checksums over them.
*/
#include "flexible/file.h"
#include "fuzz.h"
#include "reduced_body.h"

namespace hhtfuzz
{

namespace
{

using namespace hhtdae;
using namespace hhtdae::bodyfile;

bool PositiveBody(const ModalBody &m)
{
  bool good = m.mass > 0 && NotFinite(m).empty() && (m.moments - m.moments.transpose()).norm() <= 1e-8 * m.moments.norm();
  for (Eigen::Index k = 0; k < m.omega.size(); k++) good = good && m.omega[k] > 0;
  good = good && m.inertia().diagonal().minCoeff() >= -1e-8 * m.moments.norm();
  for (const ModalNode &a : m.nodes) good = good && a.label >= 0 && a.translation.cols() == m.modes() && a.rotation.cols() == m.modes() && (a.turns || a.rotation.isZero(0));
  for (const ModalLoadCase &l : m.loads) {
    const Eigen::Index f = l.modal_gradient.rows();
    good = good && !l.name.empty() && l.modal.size() == m.modes() && l.moment_gradient.cols() == m.modes() && l.force_gradient.cols() == f && (!f || f == m.modes());
  }
  return good && m.first.cols() == m.omega.size();
}

std::string Nonsense(const ReducedBody &b)
{
  const Eigen::Index n = b.modal.omega.size();
  if (!PositiveBody(b.modal)) return "an impossible modal body";
  for (const ReducedMode &m : b.mode)
    if (!(m.frequency >= 0) || !std::isfinite(m.residual)) return "an impossible frequency or residual";
  if (b.own < 0 || (std::size_t)b.own != b.label.size() || (PetscInt)b.coordinates.size() != 3 * b.own) return "nodes";
  for (PetscInt l : b.label)
    if (l < 0) return "a negative label";
  if (!Finite(b.coordinates) || !b.shape.allFinite() || !b.stress.values.allFinite()) return "numbers that are not finite";
  if (b.shape.size() && (b.shape.rows() != 3 * b.own || b.shape.cols() != n)) return "a shape of another size";
  for (const FeElement &e : b.elements) {
    if ((unsigned)e.type > 3 || e.material < 0) return "an impossible element";
    for (int k = 0; k < FeNodes(e.type); k++)
      if (e.node[k] < 0 || e.node[k] >= b.own) return "an element with an impossible node";
  }
  for (PetscInt i : b.stress.node)
    if (i < 0 || i >= b.own) return "stress at an impossible node";
  return "";
}

void ReadBody(const std::string &folder, Answer *a)
{
  ReducedBody    body;
  ModalBody      modal;
  PetscErrorCode code = body.load(PETSC_COMM_SELF, folder + "/body.h5");
  if (!code) a->nonsense = Nonsense(body);
  if (LoadModalBody(PETSC_COMM_SELF, folder + "/body.h5", &modal)) {
    if (!code) a->nonsense = "the modal body alone is refused, the whole file is not";
  } else if (!PositiveBody(modal))
    a->nonsense = "an impossible modal body, read alone";
  a->code = code && a->nonsense.empty() ? code : (PetscErrorCode)0;
}

std::vector<Input> Good()
{
  std::vector<Input> good;
  for (PetscInt modes : {4, 0}) {
    hhtest::HandMade made(PETSC_COMM_SELF, 2, modes);
    if (!modes) made.body.modal.attachments.clear();
    hhtest::Scratch file("fuzz.h5");
    hhtest::must(made.body.save(file.name));
    good.push_back({{{"body.h5", file.text(), true}}});
  }
  return good;
}

/* ---- other contents with right checksums ---- */

class Rewriter
{
public:
  Rewriter(const std::string &file, Random *random) : file_(H5Fopen(file.c_str(), H5F_ACC_RDWR, H5P_DEFAULT), H5Fclose), r_(*random) {}

  void change()
  {
    const std::string path = every_dataset[r_.below(sizeof every_dataset / sizeof *every_dataset)];
    if (r_.chance(0.15)) return attribute();
    if (H5Lexists(file_, path.substr(0, path.rfind('/')).c_str(), H5P_DEFAULT) <= 0 ||
        H5Lexists(file_, path.c_str(), H5P_DEFAULT) <= 0)
      return;
    Handle set(H5Dopen2(file_, path.c_str(), H5P_DEFAULT), H5Dclose), type(H5Dget_type(set), H5Tclose);
    if (H5Tequal(type, H5T_IEEE_F64LE) > 0) dataset<double>(path, &set);
    if (H5Tequal(type, H5T_STD_I64LE) > 0) dataset<int64_t>(path, &set);
    if (H5Tequal(type, H5T_STD_U8LE) > 0) dataset<uint8_t>(path, &set);
  }
  /* Writes the checksum that the reader computes */
  void seal()
  {
    Head head;
    ReadText(file_, "program", &head.program);
    ReadText(file_, "source", &head.source);
    ReadText(file_, "method", &head.method);
    ReadText(file_, "units", &head.units);
    ReadText(file_, "name", &head.name);
    ReadScalar(file_, "version", H5T_INTEGER, H5T_NATIVE_INT64, &head.version);
    ReadScalar(file_, "fe_nodes", H5T_INTEGER, H5T_NATIVE_INT64, &head.fe_nodes);
    ReadScalar(file_, "elastic_scale", H5T_FLOAT, H5T_NATIVE_DOUBLE, &head.elastic_scale);
    std::uint64_t sum = head.hash(), share;
    for (const char *path : every_dataset) {
      const std::string name = path;
      if (H5Lexists(file_, name.substr(0, name.rfind('/')).c_str(), H5P_DEFAULT) <= 0 ||
          H5Lexists(file_, path, H5P_DEFAULT) <= 0)
        continue;
      Handle set(H5Dopen2(file_, path, H5P_DEFAULT), H5Dclose);
      if (ReadScalar(set, "checksum", H5T_INTEGER, H5T_NATIVE_UINT64, &share)) sum += DatasetShare(path, share);
    }
    rewrite(file_, "checksum", H5T_NATIVE_UINT64, &sum);
  }

  /* Numbers that no valid body has */
  void absurd()
  {
    static const std::vector<std::pair<std::string, double>> values = {
        {"/modal/mass", -7.5},     {"/modal/mass", 0},       {"/modal/omega", -100},    {"/modal/omega", 0},
        {"/modal/mass", NAN},      {"/modal/omega", NAN},    {"/modal/omega", INFINITY}, {"/modal/center", INFINITY},
        {"/modal/moments", 1e6},   {"/modal/moments", NAN},  {"/modal/quadratic", 5},   {"/modal/first", NAN},
        {"/modes/frequency", -16}, {"/nodes/shape", NAN},    {"/attachments/rotation", INFINITY}, {"/stress/values", NAN},
        {"/modes/residual", NAN},  {"/modal/moment", -INFINITY}, {"/nodes/coordinates", NAN}, {"/attachments/position", NAN}};
    const auto         &one = r_.of(values);
    Handle              set(H5Dopen2(file_, one.first.c_str(), H5P_DEFAULT), H5Dclose);
    const Dims          dims = extent(set);
    std::vector<double> data(Product(dims));
    H5Dread(set, H5T_NATIVE_DOUBLE, H5S_ALL, H5S_ALL, H5P_DEFAULT, data.data());
    data[one.first == "/modal/moments" || one.first == "/modal/quadratic" ? 1 : r_.below(data.size())] = one.second;
    H5Dwrite(set, H5T_NATIVE_DOUBLE, H5S_ALL, H5S_ALL, H5P_DEFAULT, data.data());
    sum(one.first, set, dims, data);
  }

private:
  Handle  file_;
  Random &r_;

  static Dims extent(hid_t set)
  {
    Handle space(H5Dget_space(set), H5Sclose);
    Dims   dims((std::size_t)H5Sget_simple_extent_ndims(space));
    H5Sget_simple_extent_dims(space, dims.data(), nullptr);
    return dims;
  }

  static void rewrite(hid_t object, const char *name, hid_t memory, const void *value)
  {
    Handle attribute(H5Aopen(object, name, H5P_DEFAULT), H5Aclose);
    if (attribute.good()) H5Awrite(attribute, memory, value);
  }

  double extreme(double)
  {
    static const std::vector<double> values = {0, -0., -1, 1, -7.5, 1e308, -1e308, 1e-320, NAN, INFINITY, -INFINITY, 1e17};
    return r_.of(values);
  }
  int64_t extreme(int64_t)
  {
    static const std::vector<int64_t> values = {0, -1, 1, 11, 12, 1000000, INT32_MAX, (int64_t)INT32_MAX + 1, INT32_MIN, INT64_MAX,
                                                INT64_MIN, (int64_t)1 << 32};
    return r_.of(values);
  }
  uint8_t extreme(uint8_t) { return (uint8_t)r_.below(256); }

  void attribute()
  {
    const double  real  = extreme(0.);
    const int64_t whole = extreme((int64_t)0);
    switch (r_.below(3)) {
    case 0:
      return rewrite(file_, "fe_nodes", H5T_NATIVE_INT64, &whole);
    case 1:
      return rewrite(file_, "version", H5T_NATIVE_INT64, &whole);
    default:
      return rewrite(file_, "elastic_scale", H5T_NATIVE_DOUBLE, &real);
    }
  }

  template <class T> void dataset(const std::string &path, Handle *set)
  {
    const Dims     dims = extent(*set);
    std::vector<T> data(Product(dims));
    if (!data.empty()) H5Dread(*set, MemoryType(T()), H5S_ALL, H5S_ALL, H5P_DEFAULT, data.data());
    for (std::size_t k = 1 + r_.below(3); k > 0 && !data.empty(); k--) data[r_.below(data.size())] = extreme(T());
    if (r_.chance(0.7)) {
      if (!data.empty()) H5Dwrite(*set, MemoryType(T()), H5S_ALL, H5S_ALL, H5P_DEFAULT, data.data());
      return sum(path, *set, dims, data);
    }
    set->close();
    H5Ldelete(file_, path.c_str(), H5P_DEFAULT);
    if (r_.chance(0.9)) make(path, dims, data);
  }

  /* A dataset with other dimensions, some of them zero and some beyond any file size, or with another type of numbers */
  template <class T> void make(const std::string &path, Dims dims, std::vector<T> data)
  {
    if (r_.chance(0.3)) dims.push_back(1 + r_.below(3));
    if (r_.chance(0.2) && dims.size() > 1) dims.pop_back();
    hsize_t &one = dims[r_.below(dims.size())];
    one          = r_.chance(0.5) ? r_.below(2 * (std::size_t)one + 2) : 0;
    const bool empty = Product(dims) == 0;
    if (empty)
      for (hsize_t &d : dims)
        if (d && r_.chance(0.5)) d = r_.chance(0.5) ? 2147483647 : 1000000;
    if (Product(dims) > 100000) return;
    data.resize(Product(dims));
    Handle      space(H5Screate_simple((int)dims.size(), dims.data(), nullptr), H5Sclose);
    const hid_t kinds[] = {FileType(T()), FileType(T()), FileType(T()), H5T_IEEE_F32LE, H5T_STD_I32BE, H5T_IEEE_F64BE};
    Handle      layout(H5Pcreate(H5P_DATASET_CREATE), H5Pclose);
    H5Pset_alloc_time(layout, H5D_ALLOC_TIME_EARLY);
    Handle set(H5Dcreate2(file_, path.c_str(), kinds[r_.below(6)], space, H5P_DEFAULT, layout, H5P_DEFAULT), H5Dclose);
    if (!set.good()) return;
    if (!data.empty()) H5Dwrite(set, MemoryType(T()), H5S_ALL, H5S_ALL, H5P_DEFAULT, data.data());
    WriteChecksum(set, HashEntries(data.data(), data.size(), Fnv(path), 0) + HashDims(dims, Fnv(path)));
  }

  template <class T> void sum(const std::string &path, hid_t set, const Dims &dims, const std::vector<T> &data)
  {
    const std::uint64_t key = Fnv(path), value = HashEntries(data.data(), data.size(), key, 0) + HashDims(dims, key);
    rewrite(set, "checksum", H5T_NATIVE_UINT64, &value);
  }
};

Input Damage(const std::vector<Input> &good, Random &r)
{
  Input input = r.of(good);
  if (r.chance(0.4)) {
    DamageBytes(&input.files[0].text, r);
    return input;
  }
  Quiet           quiet;
  hhtest::Scratch file("rewritten.h5");
  if (r.chance(0.3)) {
    input        = good.front(); /* this one has modes */
    input.refuse = true;
  }
  file.write(input.files[0].text);
  {
    Rewriter rewriter(file.name, &r);
    if (input.refuse)
      rewriter.absurd();
    else
      for (std::size_t k = 1 + r.below(2); k > 0; k--) rewriter.change();
    if (r.chance(0.95)) rewriter.seal();
  }
  input.files[0].text = file.text();
  return input;
}

const Register bodies({"body", Good, Damage, ReadBody});

} // namespace

} // namespace hhtfuzz
