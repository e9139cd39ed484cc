/*
  The file of a reduced body, HDF5. All numbers are little-endian; n modes, a attachments, N nodes, S nodes with stress,
  E elements.

    attributes of /
      format         text "hhtdae reduced body"
      version        int64, 1; a reader refuses a newer one
      program        text: what wrote the file
      source, method, units, name   text: provenance; name is the body's
      fe_nodes       int64: nodes of the finite-element model
      elastic_scale  float64: largest elastic eigenvalue kept
      checksum       uint64, over the attributes above and the checksums of all datasets
    /modal           what a scene takes, ModalBody of hhtdae/modal.h
      mass           float64 {1}
      center         float64 {3}
      moments        float64 {3, 3}
      omega          float64 {n}
      first          float64 {n, 3}
      moment         float64 {3, n, 3}      component of X, mode, component of phi
      quadratic      float64 {6, n, n}      xx yy zz xy yz zx; absent if not known
    /modes           absent if not known
      frequency      float64 {n}            cycles per unit of time
      residual       float64 {n}
    /attachments
      name           uint8 {characters}     each name ends with a zero
      position       float64 {a, 3}
      translation    float64 {a, n, 3}
      rotation       float64 {a, n, 3}
    /nodes           absent if the nodes are not kept
      coordinates    float64 {N, 3}
      label          int64 {N}
      shape          float64 {n, N, 3}      absent if the modes at the nodes are not kept
    /elements        absent if there are none
      type           uint8 {E}              0 tetrahedron with 4 nodes, 1 with 10, 2 brick with 8, 3 with 20
      material       int64 {E}
      node           int64 {nodes of all}   places among the nodes, element after element, each in the order of Gmsh
    /stress          absent if there are no stress modes
      node           int64 {S}              places among the nodes, ascending
      values         float64 {n, S, 6}      xx yy zz xy yz zx

  Every dataset has an attribute checksum (uint64): the sum, modulo 2^64, over all entries of Mix(bits ^ Mix(key + index
  * odd)), where index is the entry's place in the dataset in C order, bits its 64 bits (uint8 widened), key the 64-bit
  FNV-1a hash of the dataset's path, odd = 0x9e3779b97f4a7c15 and Mix the finalizer of splitmix64; the dimensions are
  added as if they were entries before the first. A sum does not ask in which order, and so on how many ranks, it is
  taken; one changed entry always changes it. The file's own structures have HDF5's checksums (superblock 2, object
  headers 2).

  Rank 0 writes; the others send it their parts of a few modes at a time, so that no rank ever holds more of the shape
  than its own and one such part, any build of HDF5 serves, and a full disk is an error on all ranks instead of ranks
  that wait. The file appears under its name when it is complete. All ranks read, each its own part. The bytes of the
  file do not depend on the number of ranks.
*/
#include "flexible/agree.h"
#include "hhtdae/flexible.h"
#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstring>
#include <sys/stat.h>

#if defined(HHTDAE_HDF5)
#include <hdf5.h>

namespace hhtdae
{

namespace
{

constexpr const char *format_name    = "hhtdae reduced body";
constexpr int64_t     format_version = 1;
constexpr const char *program_name   = "hhtdae 0.1.0";
constexpr hsize_t     block_entries  = 1 << 22; /* of one part that is sent to be written */

using Dims = std::vector<hsize_t>;

uint64_t Mix(uint64_t x)
{
  x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9ull;
  x = (x ^ (x >> 27)) * 0x94d049bb133111ebull;
  return x ^ (x >> 31);
}

uint64_t Fnv(const std::string &text)
{
  uint64_t h = 0xcbf29ce484222325ull;
  for (unsigned char c : text) h = (h ^ c) * 0x100000001b3ull;
  return h;
}

uint64_t EntryHash(uint64_t bits, uint64_t key, uint64_t index)
{
  return Mix(bits ^ Mix(key + index * 0x9e3779b97f4a7c15ull));
}

uint64_t Bits(double v)
{
  uint64_t b;
  std::memcpy(&b, &v, sizeof b);
  return b;
}
uint64_t Bits(int64_t v) { return (uint64_t)v; }
uint64_t Bits(uint8_t v) { return v; }

template <class T> uint64_t HashEntries(const T *v, hsize_t count, uint64_t key, uint64_t index)
{
  uint64_t sum = 0;
  for (hsize_t i = 0; i < count; i++) sum += EntryHash(Bits(v[i]), key, index + i);
  return sum;
}

uint64_t HashDims(const Dims &dims, uint64_t key)
{
  uint64_t sum = 0;
  for (std::size_t d = 0; d < dims.size(); d++) sum += EntryHash(dims[d], key, ~(uint64_t)d);
  return sum;
}

hsize_t Product(const Dims &dims)
{
  hsize_t p = 1;
  for (hsize_t d : dims) p *= d;
  return p;
}

std::string Text(const Dims &dims)
{
  std::string text;
  for (hsize_t d : dims) text += (text.empty() ? "" : " x ") + std::to_string(d);
  return text;
}

hid_t        FileType(double) { return H5T_IEEE_F64LE; }
hid_t        FileType(int64_t) { return H5T_STD_I64LE; }
hid_t        FileType(uint8_t) { return H5T_STD_U8LE; }
hid_t        MemoryType(double) { return H5T_NATIVE_DOUBLE; }
hid_t        MemoryType(int64_t) { return H5T_NATIVE_INT64; }
hid_t        MemoryType(uint8_t) { return H5T_NATIVE_UINT8; }
MPI_Datatype MpiType(double) { return MPI_DOUBLE; }
MPI_Datatype MpiType(int64_t) { return MPI_INT64_T; }
MPI_Datatype MpiType(uint8_t) { return MPI_UINT8_T; }

/* HDF5 says nothing of its own while it lives */
class Quiet
{
public:
  Quiet()
  {
    H5open();
    H5Eget_auto2(H5E_DEFAULT, &print_, &data_);
    H5Eset_auto2(H5E_DEFAULT, nullptr, nullptr);
  }
  ~Quiet() { H5Eset_auto2(H5E_DEFAULT, print_, data_); }
  Quiet(const Quiet &) = delete;

private:
  H5E_auto2_t print_ = nullptr;
  void       *data_  = nullptr;
};

/* An HDF5 identifier that is closed with its scope */
class Handle
{
public:
  Handle(hid_t id, herr_t (*close)(hid_t)) : id_(id), close_(close) {}
  ~Handle()
  {
    if (id_ >= 0) close_(id_);
  }
  Handle(const Handle &) = delete;
       operator hid_t() const { return id_; }
  bool good() const { return id_ >= 0; }
  bool close()
  {
    const herr_t status = id_ >= 0 ? close_(id_) : -1;
    id_                 = -1;
    return status >= 0;
  }

private:
  hid_t id_;
  herr_t (*close_)(hid_t);
};

/* ---- attributes ---- */

template <class T> bool WriteAttribute(hid_t object, const char *name, T value)
{
  Handle space(H5Screate(H5S_SCALAR), H5Sclose),
      attribute(H5Acreate2(object, name, FileType(value), space, H5P_DEFAULT, H5P_DEFAULT), H5Aclose);
  return attribute.good() && H5Awrite(attribute, MemoryType(value), &value) >= 0;
}

bool WriteChecksum(hid_t object, uint64_t value)
{
  Handle space(H5Screate(H5S_SCALAR), H5Sclose),
      attribute(H5Acreate2(object, "checksum", H5T_STD_U64LE, space, H5P_DEFAULT, H5P_DEFAULT), H5Aclose);
  return attribute.good() && H5Awrite(attribute, H5T_NATIVE_UINT64, &value) >= 0;
}

bool WriteText(hid_t object, const char *name, const std::string &value)
{
  Handle type(H5Tcopy(H5T_C_S1), H5Tclose), space(H5Screate(H5S_SCALAR), H5Sclose);
  H5Tset_size(type, value.size() + 1);
  H5Tset_cset(type, H5T_CSET_UTF8);
  Handle attribute(H5Acreate2(object, name, type, space, H5P_DEFAULT, H5P_DEFAULT), H5Aclose);
  return attribute.good() && H5Awrite(attribute, type, value.c_str()) >= 0;
}

/* A scalar of the class and size that is asked for */
bool ReadScalar(hid_t object, const char *name, H5T_class_t kind, hid_t memory, void *value)
{
  if (H5Aexists(object, name) <= 0) return false;
  Handle attribute(H5Aopen(object, name, H5P_DEFAULT), H5Aclose);
  if (!attribute.good()) return false;
  Handle type(H5Aget_type(attribute), H5Tclose), space(H5Aget_space(attribute), H5Sclose);
  return H5Tget_class(type) == kind && H5Sget_simple_extent_npoints(space) == 1 &&
         H5Aread(attribute, memory, value) >= 0;
}

bool ReadText(hid_t object, const char *name, std::string *value)
{
  if (H5Aexists(object, name) <= 0) return false;
  Handle attribute(H5Aopen(object, name, H5P_DEFAULT), H5Aclose);
  if (!attribute.good()) return false;
  Handle            type(H5Aget_type(attribute), H5Tclose), space(H5Aget_space(attribute), H5Sclose);
  const std::size_t length = H5Tget_size(type);
  if (H5Tget_class(type) != H5T_STRING || H5Tis_variable_str(type) > 0 || H5Sget_simple_extent_npoints(space) != 1 ||
      length > (1 << 20))
    return false;
  std::vector<char> text(length + 1, '\0');
  if (H5Aread(attribute, type, text.data()) < 0) return false;
  *value = text.data();
  return true;
}

/* What belongs to the file as a whole; its hash goes into the file's checksum */
struct Head {
  std::string program = program_name, source, method, units, name;
  int64_t     version = format_version, fe_nodes = 0;
  double      elastic_scale = 0;

  uint64_t hash() const
  {
    return EntryHash((uint64_t)version, Fnv("version"), 0) + Fnv(program) * 3 + Fnv(source) * 5 + Fnv(method) * 7 +
           Fnv(units) * 11 + Fnv(name) * 13 + EntryHash((uint64_t)fe_nodes, Fnv("fe_nodes"), 0) +
           EntryHash(Bits(elastic_scale), Fnv("elastic_scale"), 0);
  }
};

uint64_t DatasetShare(const std::string &path, uint64_t checksum) { return EntryHash(checksum, Fnv(path), 0); }

/* All datasets that there may be */
const char *const every_dataset[] = {"/modal/mass",           "/modal/center",         "/modal/moments",
                                     "/modal/omega",          "/modal/first",          "/modal/moment",
                                     "/modal/quadratic",      "/modes/frequency",      "/modes/residual",
                                     "/attachments/name",     "/attachments/position", "/attachments/translation",
                                     "/attachments/rotation", "/nodes/coordinates",    "/nodes/label",
                                     "/nodes/shape",          "/elements/type",        "/elements/material",
                                     "/elements/node",        "/stress/node",          "/stress/values"};

/* ---- writing ---- */

/* A dataset cut along one dimension: all of the first (1 if there is none), own of the middle one, all of the last */
struct Cut {
  hsize_t rows, own, first, all, width;
};

class Writer
{
public:
  Writer(MPI_Comm comm, const std::string &name) : comm_(comm), name_(name), part_(name + ".part")
  {
    MPI_Comm_rank(comm, &rank_);
    MPI_Comm_size(comm, &size_);
  }
  ~Writer()
  {
    if (file_ >= 0) H5Fclose(file_);
    if (!rank_ && !complete_ && made_) std::remove(part_.c_str());
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
      else if (std::rename(part_.c_str(), name_.c_str()))
        error_ = "cannot write the reduced body to " + name_ + ": " + std::strerror(errno);
      complete_ = error_.empty();
    }
    PetscCall(RaiseTogether(comm_, PETSC_ERR_FILE_WRITE, error_));
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

/* ---- reading ---- */

/* Every rank reads for itself; errors are kept, what follows the first one does nothing, and all ranks come together at
 * the end. */
class Reader
{
public:
  std::string error;
  Head        head;

  explicit Reader(const std::string &name) : name_(name) {}
  ~Reader()
  {
    if (file_ >= 0) H5Fclose(file_);
  }
  Reader(const Reader &) = delete;

  void open()
  {
    struct stat status;
    FILE       *in;
    char        start[8] = {};
    if (stat(name_.c_str(), &status)) return fail("there is no such file");
    if (!S_ISREG(status.st_mode)) return fail("it is not a file");
    if (!(in = std::fopen(name_.c_str(), "rb"))) return fail("there is no right to read it");
    const std::size_t got = std::fread(start, 1, sizeof start, in);
    std::fclose(in);
    size_ = (hsize_t)status.st_size;
    /* H5Fis_hdf5() of HDF5 1.10 leaves something open in a damaged file, which its end then complains of */
    if (got < sizeof start || std::memcmp(start, "\x89HDF\r\n\x1a\n", sizeof start))
      return fail("it is not an HDF5 file, or its beginning is damaged");
    file_ = H5Fopen(name_.c_str(), H5F_ACC_RDONLY, H5P_DEFAULT);
    if (file_ < 0) return fail("the file is truncated or damaged");
    readHead();
  }

  bool has(const std::string &path) const
  {
    if (file_ < 0 || !error.empty()) return false;
    const std::string group = path.substr(0, path.rfind('/'));
    return (group.empty() || H5Lexists(file_, group.c_str(), H5P_DEFAULT) > 0) &&
           H5Lexists(file_, path.c_str(), H5P_DEFAULT) > 0;
  }

  /* The dataset's dimensions, for those of `dims` that are 0 on entry with `open` */
  template <class T> Dims dims(const std::string &path)
  {
    Dims none;
    if (!error.empty()) return none;
    if (!has(path)) return fail("there is no " + path), none;
    Handle set(H5Dopen2(file_, path.c_str(), H5P_DEFAULT), H5Dclose);
    if (!set.good()) return fail(path + " is damaged"), none;
    Handle    space(H5Dget_space(set), H5Sclose), type(H5Dget_type(set), H5Tclose);
    const int rank = H5Sget_simple_extent_ndims(space);
    if (rank < 1 || rank > 3 || H5Tequal(type, FileType(T())) <= 0)
      return fail(path + " is not of the kind that it has to be"), none;
    Dims d((std::size_t)rank);
    H5Sget_simple_extent_dims(space, d.data(), nullptr);
    for (hsize_t e : d)
      if (e > (hsize_t)PETSC_MAX_INT) return fail(path + " is larger than this build of PETSc can count"), none;
    /* no memory is asked for entries that the file does not have */
    if (Product(d) && (H5Dget_storage_size(set) != Product(d) * sizeof(T) || Product(d) > size_))
      return fail(path + " has " + Text(d) + " entries, which the file does not hold"), none;
    return d;
  }

  /* All of a dataset with these dimensions */
  template <class T> std::vector<T> get(const std::string &path, const Dims &expected)
  {
    std::vector<T> data;
    const Dims     found = dims<T>(path);
    if (!error.empty()) return data;
    if (found != expected) return fail(path + " has " + Text(found) + " entries in place of " + Text(expected)), data;
    data.resize(Product(expected));
    const Dims start(expected.size(), 0);
    if (!slab(path, start, expected, data.data())) return {};
    const uint64_t key = Fnv(path);
    if (HashEntries(data.data(), data.size(), key, 0) + HashDims(expected, key) != stored(path))
      fail(path + " is damaged: its checksum does not agree");
    return data;
  }

  /* This rank's part; its share of the checksum waits for those of the others */
  template <class T> void part(const std::string &path, const Dims &expected, const Cut &cut, T *data)
  {
    const Dims found = dims<T>(path);
    if (!error.empty()) return;
    if (found != expected) return fail(path + " has " + Text(found) + " entries in place of " + Text(expected));
    Dims              start(expected.size(), 0), count = expected;
    const std::size_t cutting = expected.size() == 3 ? 1 : 0;
    start[cutting]            = cut.first;
    count[cutting]            = cut.own;
    if (!slab(path, start, count, data)) return;
    const uint64_t key = Fnv(path);
    uint64_t       sum = 0;
    for (hsize_t r = 0; r < cut.rows; r++)
      sum +=
          HashEntries(data + r * cut.own * cut.width, cut.own * cut.width, key, (r * cut.all + cut.first) * cut.width);
    pending_.push_back({path, stored(path) - HashDims(expected, key)});
    sums_.push_back(sum);
  }

  /* Single entries of a dataset of one dimension */
  int64_t entry(const std::string &path, hsize_t i)
  {
    int64_t value = 0;
    slab(path, {i}, {1}, &value);
    return value;
  }

  void fail(const std::string &why)
  {
    if (error.empty()) error = "cannot read the reduced body from " + name_ + ": " + why;
  }

  /* Errors of one rank become those of all, checksums of parts are completed. Collective */
  PetscErrorCode agree(MPI_Comm comm)
  {
    PetscFunctionBegin;
    PetscCall(RaiseTogether(comm, PETSC_ERR_FILE_UNEXPECTED, error));
    if (!sums_.empty())
      PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, sums_.data(), (PetscMPIInt)sums_.size(), MPI_UINT64_T, MPI_SUM, comm));
    for (std::size_t i = 0; i < sums_.size(); i++)
      if (sums_[i] != pending_[i].second) fail(pending_[i].first + " is damaged: its checksum does not agree");
    sums_.clear();
    pending_.clear();
    PetscCall(RaiseTogether(comm, PETSC_ERR_FILE_UNEXPECTED, error));
    PetscFunctionReturn(0);
  }

private:
  void readHead()
  {
    std::string format;
    uint64_t    checksum = 0, sum = 0;
    if (!ReadText(file_, "format", &format) || format != format_name)
      return fail("it is an HDF5 file, but not one of a reduced body");
    if (!ReadScalar(file_, "version", H5T_INTEGER, H5T_NATIVE_INT64, &head.version))
      return fail("its version is not given");
    if (head.version > format_version)
      return fail("it has version " + std::to_string(head.version) + " of the format, this program knows version " +
                  std::to_string(format_version) + ": a newer hhtdae is needed");
    const bool good = head.version >= 1 && ReadText(file_, "program", &head.program) &&
                      ReadText(file_, "source", &head.source) && ReadText(file_, "method", &head.method) &&
                      ReadText(file_, "units", &head.units) && ReadText(file_, "name", &head.name) &&
                      ReadScalar(file_, "fe_nodes", H5T_INTEGER, H5T_NATIVE_INT64, &head.fe_nodes) &&
                      ReadScalar(file_, "elastic_scale", H5T_FLOAT, H5T_NATIVE_DOUBLE, &head.elastic_scale) &&
                      ReadScalar(file_, "checksum", H5T_INTEGER, H5T_NATIVE_UINT64, &checksum);
    if (!good) return fail("attributes of the file are missing or damaged");
    sum = head.hash();
    for (const char *path : every_dataset)
      if (has(path)) sum += DatasetShare(path, stored(path));
    if (sum != checksum) fail("the file is damaged: its checksum does not agree");
    if (head.fe_nodes < 0 || !std::isfinite(head.elastic_scale)) fail("attributes of the file are not possible");
  }

  uint64_t stored(const std::string &path)
  {
    uint64_t value = 0;
    Handle   set(H5Dopen2(file_, path.c_str(), H5P_DEFAULT), H5Dclose);
    if (!set.good() || !ReadScalar(set, "checksum", H5T_INTEGER, H5T_NATIVE_UINT64, &value)) fail(path + " is damaged");
    return value;
  }

  template <class T> bool slab(const std::string &path, const Dims &start, const Dims &count, T *data)
  {
    if (!error.empty()) return false;
    if (!Product(count)) return true;
    Handle set(H5Dopen2(file_, path.c_str(), H5P_DEFAULT), H5Dclose);
    Handle space(set.good() ? H5Dget_space(set) : -1, H5Sclose),
        memory(H5Screate_simple((int)count.size(), count.data(), nullptr), H5Sclose);
    if (!space.good() || H5Sselect_hyperslab(space, H5S_SELECT_SET, start.data(), nullptr, count.data(), nullptr) < 0 ||
        H5Dread(set, MemoryType(T()), memory, space, H5P_DEFAULT, data) < 0)
      fail(path + " cannot be read");
    return error.empty();
  }

  std::string                                   name_;
  hid_t                                         file_ = -1;
  hsize_t                                       size_ = 0;
  std::vector<std::pair<std::string, uint64_t>> pending_;
  std::vector<uint64_t>                         sums_;
};

/* ---- the body ---- */

using Modes3 = Eigen::Matrix<double, 3, Eigen::Dynamic>;

std::vector<double> Flat(const Eigen::Ref<const Eigen::MatrixXd> &m)
{
  std::vector<double> v;
  v.reserve((std::size_t)m.size());
  for (Eigen::Index j = 0; j < m.cols(); j++)
    for (Eigen::Index i = 0; i < m.rows(); i++) v.push_back(m(i, j));
  return v;
}

bool Finite(const std::vector<double> &v)
{
  for (double x : v)
    if (!std::isfinite(x)) return false;
  return true;
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
  for (const auto &a : m.attachments) {
    if (a.translation.cols() != n || a.rotation.cols() != n)
      return "modes of attachment " + a.name + " are not as many as the body's";
    if (a.name.find('\0') != std::string::npos) return "a name with a zero inside";
  }
  return "";
}

/* Numbers of the modal body that are not finite */
std::string NotFinite(const ModalBody &m)
{
  if (!std::isfinite(m.mass)) return "mass";
  if (!m.center.allFinite()) return "centre of mass";
  if (!m.moments.allFinite()) return "moments";
  if (!m.omega.allFinite()) return "frequencies";
  bool good = m.first.allFinite();
  for (const auto &c : m.moment) good = good && c.allFinite();
  for (const auto &q : m.quadratic) good = good && q.allFinite();
  if (!good) return "inertia invariants";
  for (const auto &a : m.attachments)
    if (!a.position.allFinite() || !a.translation.allFinite() || !a.rotation.allFinite()) return "attachment " + a.name;
  return "";
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
}

Modes3 ThreeRows(const std::vector<double> &v, hsize_t begin, hsize_t n)
{
  return Eigen::Map<const Modes3>(v.data() + begin * 3 * n, 3, (Eigen::Index)n);
}

void GetAttachments(Reader *in, hsize_t n, ModalBody *m)
{
  const Dims characters = in->dims<uint8_t>("/attachments/name"), positions = in->dims<double>("/attachments/position");
  if (!in->error.empty()) return;
  const hsize_t a        = positions[0];
  const auto    names    = in->get<uint8_t>("/attachments/name", {characters[0]});
  const auto    position = in->get<double>("/attachments/position", {a, 3}),
             translation = in->get<double>("/attachments/translation", {a, n, 3}),
             rotation    = in->get<double>("/attachments/rotation", {a, n, 3});
  if (!in->error.empty()) return;
  if ((hsize_t)std::count(names.begin(), names.end(), 0) != a || (a && names.back()))
    return in->fail("/attachments/name does not have a name for each attachment");
  auto name = names.begin();
  for (hsize_t i = 0; i < a; i++) {
    ModalAttachment at;
    for (; *name; ++name) at.name += (char)*name;
    ++name;
    at.position    = Eigen::Map<const Vector3>(position.data() + 3 * i);
    at.translation = ThreeRows(translation, i, n);
    at.rotation    = ThreeRows(rotation, i, n);
    m->attachments.push_back(at);
  }
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
  if (!bad.empty()) in->fail("numbers that are not finite: " + bad);
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
  PetscCall(Place(b.comm, b.own, &kept->first, &kept->nodes));
  PetscCall(Place(b.comm, (PetscInt64)b.stress.node.size(), &kept->first_stressed, &kept->stressed));
  PetscCall(Place(b.comm, (PetscInt64)b.elements.size(), &kept->first_element, &kept->elements));
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
  wrong(!b.mode.empty() && (Eigen::Index)b.mode.size() != n,
        std::to_string(b.mode.size()) + " frequencies and residuals for " + std::to_string(n) + " modes");
  for (const ReducedMode &m : b.mode)
    wrong(!std::isfinite(m.frequency) || !std::isfinite(m.residual), "a mode's frequency or residual is not finite");
  wrong(!std::isfinite(b.elastic_scale), "elastic_scale is not finite");
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
    for (int k = 0; (unsigned)e.type <= 3 && k < FeNodes(e.type); k++)
      wrong(e.node[k] < 0 || e.node[k] >= kept->nodes, "an element's node that is not there");
  }
  wrong(!Finite(b.coordinates), "a coordinate is not finite");
  wrong(!b.shape.allFinite(), "a mode at the nodes is not finite");
  wrong(!b.stress.values.allFinite(), "a stress mode is not finite");
  PetscCall(RaiseTogether(b.comm, PETSC_ERR_ARG_INCOMP, error));
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
  PetscCall(Place(b.comm, (PetscInt64)node.size(), &begin, &all));
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

void GetModes(Reader *in, hsize_t n, ReducedBody *b)
{
  if (!in->has("/modes/frequency")) return;
  const auto frequency = in->get<double>("/modes/frequency", {n}), residual = in->get<double>("/modes/residual", {n});
  if (!in->error.empty()) return;
  if (!Finite(frequency) || !Finite(residual)) return in->fail("a mode's frequency or residual is not finite");
  for (hsize_t k = 0; k < n; k++) b->mode.push_back({frequency[k], residual[k]});
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

/* Elements of this rank, and where their nodes are. Collective */
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
  PetscCall(Place(comm, mine, &begin, &all));
  node.resize((std::size_t)mine);
  in->part("/elements/node", {(hsize_t)all}, {1, (hsize_t)mine, (hsize_t)begin, (hsize_t)all, 1}, node.data());
  PetscCall(in->agree(comm));
  const int64_t *next = node.data();
  for (hsize_t e = 0; e < own; e++) {
    FeElement element{(ElementType)type[e], (PetscInt)material[e], {}};
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

/* First of the nodes with stress that is not before node `from` */
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
  PetscCall(Place(comm, (PetscInt64)own, &begin, &all));
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

/* Damage that HDF5 or the allocation of memory meets must not end the program */
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

PetscErrorCode ReducedBody::save(const std::string &file) const
{
  PetscFunctionBegin;
  SETERRQ(comm, PETSC_ERR_SUP, "cannot write the reduced body to %s: the library was built without HDF5", file.c_str());
}

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
