/* Writes datasets of a reduced body's file (file.h) with their checksums */
#ifndef HHTDAE_FLEXIBLE_FILE_WRITER_H
#define HHTDAE_FLEXIBLE_FILE_WRITER_H

#include "flexible/file.h"
#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

namespace hhtdae
{
namespace bodyfile
{

/* Flushes a file to disk, before it replaces another one */
inline bool Flush(const std::string &name)
{
  const int  file = open(name.c_str(), O_RDONLY);
  const bool good = file >= 0 && fsync(file) == 0;
  if (file >= 0) close(file);
  return good;
}

/* Rank 0 writes, under a temporary name until the file is complete. The first error is kept, and later calls do nothing. */
class Writer
{
public:
  Writer(MPI_Comm comm, const std::string &name) : comm_(comm), name_(name), part_(name + ".part")
  {
    struct stat info;
    MPI_Comm_rank(comm, &rank_);
    MPI_Comm_size(comm, &size_);
    if (!rank_ && !stat(name.c_str(), &info) && !S_ISREG(info.st_mode)) part_ = name; /* a device is written directly */
  }
  ~Writer()
  {
    if (file_ >= 0) H5Fclose(file_);
    if (!rank_ && !complete_ && created_ && part_ != name_) std::remove(part_.c_str());
  }
  Writer(const Writer &) = delete;

  void open()
  {
    if (rank_) return;
    Handle access(H5Pcreate(H5P_FILE_ACCESS), H5Pclose), creation(H5Pcreate(H5P_FILE_CREATE), H5Pclose);
    H5Pset_libver_bounds(access, H5F_LIBVER_V18, H5F_LIBVER_LATEST); /* structures with checksums */
    H5Pset_obj_track_times(creation, 0);                             /* equal bodies give equal bytes */
    file_    = H5Fcreate(part_.c_str(), H5F_ACC_TRUNC, creation, access);
    created_ = file_ >= 0;
    if (!created_)
      error_ = "cannot write the reduced body to " + name_ +
               ": the file cannot be made (folder missing, or no right to write)";
  }

  /* Writes data that are the same on all ranks */
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

  /* Writes data of which every rank has a part; get(row, count, out) copies rows [row, row + count) of it */
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
      PetscCall(sendRows(path, set, space, dims.size(), row, count, cut, &part));
    }
    PetscCallMPI(MPI_Reduce(&mine, &sum, 1, MPI_UINT64_T, MPI_SUM, 0, comm_));
    if (!rank_ && error_.empty()) seal(path, set, sum + HashDims(dims, key));
    PetscFunctionReturn(0);
  }

  /* Writes the attributes and renames the file to its final name. Collective */
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
      else if (part_ != name_ && (!Flush(part_) || std::rename(part_.c_str(), name_.c_str())))
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

  /* Sends rows [row, row + count) of all ranks' parts to rank 0, which writes them one rank after the other */
  template <class T>
  PetscErrorCode sendRows(const std::string &path, hid_t set, hid_t space, std::size_t rank, hsize_t row, hsize_t count,
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
  hid_t       file_    = -1;
  bool        created_ = false, complete_ = false;
  uint64_t    total_ = 0;
};

} // namespace bodyfile
} // namespace hhtdae

#endif
