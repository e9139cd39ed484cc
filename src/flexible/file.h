/*
  The HDF5 file of a reduced body. All numbers are little-endian. There are n modes, a attachments, N nodes, S nodes with
  stress, E elements.

    attributes of /
      format         text "hhtdae reduced body"
      version        int64, 4; a reader refuses newer ones. Version 1 had force residuals, |K x - omega^2 M x| / |K x|, version 2 no stiffening,
                     version 3 neither kept nodes nor loads
      program        text: name and version of the program that wrote the file
      source, method, units, name   text: provenance; name is the body's
      fe_nodes       int64: nodes of the finite-element model
      elastic_scale  float64: largest elastic eigenvalue kept
      checksum       uint64, over the attributes above and the checksums of all datasets
    /modal           ModalBody of hhtdae/modal.h, the part that a scene needs
      mass           float64 {1}
      center         float64 {3}
      moments        float64 {3, 3}
      omega          float64 {n}
      first          float64 {n, 3}
      moment         float64 {3, n, 3}      component of X, mode, component of phi
      quadratic      float64 {6, n, n}      xx yy zz xy yz zx; absent if not known
      stiffening     float64 {6, n, n}      by angular velocities, likewise
    /modes           absent if not known
      frequency      float64 {n}            cycles per unit of time
      residual       float64 {n}            in the norm of the stiffness, ReducedMode of hhtdae/flexible.h; negative:
                                            not known (version 1: another norm, read as not known)
    /attachments
      name           uint8 {characters}     each name ends with a zero
      position       float64 {a, 3}
      translation    float64 {a, n, 3}
      rotation       float64 {a, n, 3}
      stiffening     float64 {6 a, n, n}    by forces and moments; absent if /modal/stiffening is
    /kept            nodes for markers; absent if there are none, k of them
      label          int64 {k}              ascending
      position       float64 {k, 3}
      turns          uint8 {k}              0: no rotation is known, and that below is zero
      translation    float64 {k, n, 3}
      rotation       float64 {k, n, 3}
    /loads           load cases, ModalLoadCase of hhtdae/modal.h; absent if there are none, l of them, f that follow the surface
      name           uint8 {characters}     each name ends with a zero
      force          float64 {l, 3}
      moment         float64 {l, 3}
      modal          float64 {l, n}
      moment_gradient float64 {l, n, 3}
      follows        uint8 {l}
      force_gradient float64 {f, n, 3}
      modal_gradient float64 {f, n, n}
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
  added as if they were entries before the first. A sum does not depend on the order of summation, and so not on the number of
  ranks; one changed entry always changes it. The file's own structures have HDF5's checksums (superblock 2, object
  headers 2).

  Rank 0 writes; the others send it their parts of a few modes at a time. So no rank holds more of the shape
  than its own part and one of these, no parallel build of HDF5 is needed, and a full disk is an error on all ranks instead of a
  deadlock. The file appears under its name when it is complete. All ranks read, each its own part. The bytes of the
  file do not depend on the number of ranks.
*/
#ifndef HHTDAE_FLEXIBLE_FILE_H
#define HHTDAE_FLEXIBLE_FILE_H

#include "flexible/exchange.h"
#include "hhtdae/flexible.h"
#include "linear/hash.h"
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <hdf5.h>

namespace hhtdae
{

/* Declarations shared by file_write.cpp and file_read.cpp */
namespace bodyfile
{

constexpr const char *format_name    = "hhtdae reduced body";
constexpr int64_t     format_version = 4;
constexpr const char *program_name   = "hhtdae 0.1.0";
constexpr hsize_t     block_entries  = 1 << 22; /* entries of one message to rank 0 */

using Dims = std::vector<hsize_t>;

inline uint64_t Fnv(const std::string &text) { return Hash().add(text.data(), text.size()).sum; }

inline uint64_t EntryHash(uint64_t bits, uint64_t key, uint64_t index)
{
  return HashMix(bits ^ HashMix(key + index * 0x9e3779b97f4a7c15ull));
}

inline uint64_t Bits(double v)
{
  uint64_t b;
  std::memcpy(&b, &v, sizeof b);
  return b;
}
inline uint64_t Bits(int64_t v) { return (uint64_t)v; }
inline uint64_t Bits(uint8_t v) { return v; }

template <class T> inline uint64_t HashEntries(const T *v, hsize_t count, uint64_t key, uint64_t index)
{
  uint64_t sum = 0;
  for (hsize_t i = 0; i < count; i++) sum += EntryHash(Bits(v[i]), key, index + i);
  return sum;
}

inline uint64_t HashDims(const Dims &dims, uint64_t key)
{
  uint64_t sum = 0;
  for (std::size_t d = 0; d < dims.size(); d++) sum += EntryHash(dims[d], key, ~(uint64_t)d);
  return sum;
}

inline hsize_t Product(const Dims &dims)
{
  hsize_t p = 1;
  for (hsize_t d : dims) p *= d;
  return p;
}

inline std::string Text(const Dims &dims)
{
  std::string text;
  for (hsize_t d : dims) text += (text.empty() ? "" : " x ") + std::to_string(d);
  return text;
}

inline hid_t        FileType(double) { return H5T_IEEE_F64LE; }
inline hid_t        FileType(int64_t) { return H5T_STD_I64LE; }
inline hid_t        FileType(uint8_t) { return H5T_STD_U8LE; }
inline hid_t        MemoryType(double) { return H5T_NATIVE_DOUBLE; }
inline hid_t        MemoryType(int64_t) { return H5T_NATIVE_INT64; }
inline hid_t        MemoryType(uint8_t) { return H5T_NATIVE_UINT8; }
inline MPI_Datatype MpiType(double) { return MPI_DOUBLE; }
inline MPI_Datatype MpiType(int64_t) { return MPI_INT64_T; }
inline MPI_Datatype MpiType(uint8_t) { return MPI_UINT8_T; }

/* Suppresses HDF5's error messages during its lifetime */
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

/* An HDF5 identifier that is closed at the end of its scope */
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

template <class T> inline bool WriteAttribute(hid_t object, const char *name, T value)
{
  Handle space(H5Screate(H5S_SCALAR), H5Sclose),
      attribute(H5Acreate2(object, name, FileType(value), space, H5P_DEFAULT, H5P_DEFAULT), H5Aclose);
  return attribute.good() && H5Awrite(attribute, MemoryType(value), &value) >= 0;
}

inline bool WriteChecksum(hid_t object, uint64_t value)
{
  Handle space(H5Screate(H5S_SCALAR), H5Sclose),
      attribute(H5Acreate2(object, "checksum", H5T_STD_U64LE, space, H5P_DEFAULT, H5P_DEFAULT), H5Aclose);
  return attribute.good() && H5Awrite(attribute, H5T_NATIVE_UINT64, &value) >= 0;
}

inline bool WriteText(hid_t object, const char *name, const std::string &value)
{
  Handle type(H5Tcopy(H5T_C_S1), H5Tclose), space(H5Screate(H5S_SCALAR), H5Sclose);
  H5Tset_size(type, value.size() + 1);
  H5Tset_cset(type, H5T_CSET_UTF8);
  Handle attribute(H5Acreate2(object, name, type, space, H5P_DEFAULT, H5P_DEFAULT), H5Aclose);
  return attribute.good() && H5Awrite(attribute, type, value.c_str()) >= 0;
}

/* Reads a scalar attribute; false if it is missing or of another class */
inline bool ReadScalar(hid_t object, const char *name, H5T_class_t kind, hid_t memory, void *value)
{
  if (H5Aexists(object, name) <= 0) return false;
  Handle attribute(H5Aopen(object, name, H5P_DEFAULT), H5Aclose);
  if (!attribute.good()) return false;
  Handle type(H5Aget_type(attribute), H5Tclose), space(H5Aget_space(attribute), H5Sclose);
  return H5Tget_class(type) == kind && H5Sget_simple_extent_npoints(space) == 1 &&
         H5Aread(attribute, memory, value) >= 0;
}

inline bool ReadText(hid_t object, const char *name, std::string *value)
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

/* Attributes of the whole file; their hash is part of the file's checksum */
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

inline uint64_t DatasetShare(const std::string &path, uint64_t checksum) { return EntryHash(checksum, Fnv(path), 0); }

/* All datasets that a file may have */
const char *const every_dataset[] = {"/modal/mass",           "/modal/center",         "/modal/moments",
                                     "/modal/omega",          "/modal/first",          "/modal/moment",
                                     "/modal/quadratic",      "/modes/frequency",      "/modes/residual",
                                     "/attachments/name",     "/attachments/position", "/attachments/translation",
                                     "/attachments/rotation", "/nodes/coordinates",    "/nodes/label",
                                     "/nodes/shape",          "/elements/type",        "/elements/material",
                                     "/elements/node",        "/stress/node",          "/stress/values",
                                     "/modal/stiffening",     "/attachments/stiffening",
                                     "/kept/label",           "/kept/position",       "/kept/turns",
                                     "/kept/translation",     "/kept/rotation",       "/loads/name",
                                     "/loads/force",          "/loads/moment",        "/loads/modal",
                                     "/loads/moment_gradient", "/loads/follows",      "/loads/force_gradient",
                                     "/loads/modal_gradient"};

/* A rank's part of a dataset that is divided along one dimension: `rows` entries of the first dimension (1 if there is none), own of `all`, from `first` on, of the middle one,
   and `width` of the last */
struct Cut {
  hsize_t rows, own, first, all, width;
};

using Modes3 = Eigen::Matrix<double, 3, Eigen::Dynamic>;

inline bool Finite(const std::vector<double> &v)
{
  for (double x : v)
    if (!std::isfinite(x)) return false;
  return true;
}

/* The first part of the modal body with numbers that are not finite, or "" */
inline std::string NotFinite(const ModalBody &m)
{
  if (!std::isfinite(m.mass)) return "mass";
  if (!m.center.allFinite()) return "centre of mass";
  if (!m.moments.allFinite()) return "moments";
  if (!m.omega.allFinite()) return "frequencies";
  bool good = m.first.allFinite();
  for (const auto &c : m.moment) good = good && c.allFinite();
  for (const auto &q : m.quadratic) good = good && q.allFinite();
  if (!good) return "inertia invariants";
  const auto finite = [](const std::array<Eigen::MatrixXd, 6> &all) { return std::all_of(all.begin(), all.end(), [](const Eigen::MatrixXd &B) { return B.allFinite(); }); };
  if (!finite(m.stiffening)) return "stiffening";
  for (const auto &a : m.attachments)
    if (!a.position.allFinite() || !a.translation.allFinite() || !a.rotation.allFinite() || !finite(a.stiffening)) return "attachment " + a.name;
  for (const auto &a : m.nodes)
    if (!a.position.allFinite() || !a.translation.allFinite() || !a.rotation.allFinite()) return "kept node " + std::to_string(a.label);
  for (const auto &l : m.loads)
    if (!l.force.allFinite() || !l.moment.allFinite() || !l.modal.allFinite() || !l.moment_gradient.allFinite() || !l.force_gradient.allFinite() || !l.modal_gradient.allFinite())
      return "load case " + l.name;
  return "";
}

} // namespace bodyfile

} // namespace hhtdae

#endif
