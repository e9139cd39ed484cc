/* Reads datasets of a reduced body's file (file.h) and compares their checksums */
#ifndef HHTDAE_FLEXIBLE_FILE_READER_H
#define HHTDAE_FLEXIBLE_FILE_READER_H

#include "flexible/file.h"
#include <cmath>
#include <cstdio>
#include <cstring>
#include <sys/stat.h>
#include <utility>

namespace hhtdae
{
namespace bodyfile
{

/* Every rank reads by itself. The first error is kept, and later calls do nothing; agree() makes it an error of all ranks. */
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
    /* the signature is compared here, because H5Fis_hdf5() of HDF5 1.10 leaves objects of a damaged file open, which causes errors when HDF5 closes */
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

  /* The dataset's dimensions; empty, with an error, if there is no such dataset of this type or its size exceeds the file's */
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
    /* prevents allocations for entries that the file does not have; with one dimension zero the product does not bound the others */
    for (hsize_t e : d)
      if (e > size_) return fail(path + " has " + Text(d) + " entries, which the file does not hold"), none;
    if (Product(d) && (H5Dget_storage_size(set) != Product(d) * sizeof(T) || Product(d) > size_))
      return fail(path + " has " + Text(d) + " entries, which the file does not hold"), none;
    return d;
  }

  /* Reads a whole dataset of these dimensions */
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

  /* Reads this rank's part; agree() adds up the checksums of all parts */
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
    expected_sums_.push_back({path, stored(path) - HashDims(expected, key)});
    sums_.push_back(sum);
  }

  /* A single entry of a dataset of one dimension */
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

  /* Compares the checksums of parts, and makes an error of one rank an error of all. Collective */
  PetscErrorCode agree(MPI_Comm comm)
  {
    PetscFunctionBegin;
    PetscCall(Agree(comm, error, PETSC_ERR_FILE_UNEXPECTED));
    if (!sums_.empty())
      PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, sums_.data(), (PetscMPIInt)sums_.size(), MPI_UINT64_T, MPI_SUM, comm));
    for (std::size_t i = 0; i < sums_.size(); i++)
      if (sums_[i] != expected_sums_[i].second) fail(expected_sums_[i].first + " is damaged: its checksum does not agree");
    sums_.clear();
    expected_sums_.clear();
    PetscCall(Agree(comm, error, PETSC_ERR_FILE_UNEXPECTED));
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
    if (head.fe_nodes < 0 || head.fe_nodes > (int64_t)PETSC_MAX_INT || !std::isfinite(head.elastic_scale) ||
        head.elastic_scale < 0)
      fail("attributes of the file are not possible (fe_nodes, elastic_scale)");
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
  std::vector<std::pair<std::string, uint64_t>> expected_sums_;
  std::vector<uint64_t>                         sums_;
};

} // namespace bodyfile
} // namespace hhtdae

#endif
