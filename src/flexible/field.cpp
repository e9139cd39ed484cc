/*
  The deformed body as a file for ParaView: VTK's XML unstructured grid with raw appended data. Rank 0 writes a single file
  from the parts that the other ranks send one after the other: the pieces of a .pvtu would duplicate or separate the nodes
  between them, and the bytes of a .vtu do not depend on the number of ranks. Rank 0 holds one
  rank's part of one array at a time.
*/
#include "flexible/body_name.h"
#include "flexible/exchange.h"
#include "flexible/node_order.h"
#include "hhtdae/flexible.h"
#include <cerrno>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstring>
#include <limits>

namespace hhtdae
{

namespace
{

/* One array of the file: its description, and this rank's part of the bytes */
struct Array {
  std::string       name;
  const char       *type;
  int               components;
  std::vector<char> bytes;
  PetscInt64        total = 0; /* bytes of all ranks */
};

template <class T> void Add(std::vector<char> *bytes, T value)
{
  const std::size_t at = bytes->size();
  bytes->resize(at + sizeof value);
  std::memcpy(bytes->data() + at, &value, sizeof value);
}

Array MakePoints(const ReducedBody &b, const Vector3 &origin, const Matrix3 &axes)
{
  Array a{"", "Float64", 3, {}};
  for (PetscInt i = 0; i < b.own; i++) {
    const Vector3 x = origin + axes * Eigen::Map<const Vector3>(&b.coordinates[3 * (std::size_t)i]);
    for (int c = 0; c < 3; c++) Add(&a.bytes, x[c]);
  }
  return a;
}

/* Sums over modes in a fixed order, so that results are the same on any number of ranks */
Array MakeDisplacement(const ReducedBody &b, const Eigen::VectorXd &eta, const Matrix3 &axes)
{
  Array           a{"displacement", "Float64", 3, {}};
  Eigen::VectorXd u = Eigen::VectorXd::Zero(3 * b.own);
  for (Eigen::Index k = 0; k < eta.size(); k++)
    for (Eigen::Index i = 0; i < u.size(); i++) u[i] += eta[k] * b.shape(i, k);
  for (PetscInt i = 0; i < b.own; i++) {
    const Vector3 v = axes * u.segment<3>(3 * i);
    for (int c = 0; c < 3; c++) Add(&a.bytes, v[c]);
  }
  return a;
}

/* NaN at nodes without stress modes, which ParaView shows in a separate colour */
Array MakeStress(const ReducedBody &b, const Eigen::VectorXd &eta, const Matrix3 &axes)
{
  Array               a{"stress", "Float64", 6, {}};
  Eigen::VectorXd     s = Eigen::VectorXd::Zero(6 * (Eigen::Index)b.stress.node.size());
  std::vector<double> all(6 * (std::size_t)b.own, std::numeric_limits<double>::quiet_NaN());
  for (Eigen::Index k = 0; k < eta.size() && s.size(); k++)
    for (Eigen::Index i = 0; i < s.size(); i++) s[i] += eta[k] * b.stress.values(i, k);
  for (std::size_t j = 0; j < b.stress.node.size(); j++) {
    const double *v = s.data() + 6 * j;
    Matrix3       t;
    t << v[0], v[3], v[5], v[3], v[1], v[4], v[5], v[4], v[2];
    t                  = (axes * t * axes.transpose()).eval();
    double      *to    = &all[6 * (std::size_t)b.stress.node[j]];
    const double six[] = {t(0, 0), t(1, 1), t(2, 2), t(0, 1), t(1, 2), t(2, 0)};
    std::copy_n(six, 6, to);
  }
  for (double v : all) Add(&a.bytes, v);
  return a;
}

PetscErrorCode MakeVonMises(const ReducedBody &b, const Eigen::VectorXd &eta, Array *a)
{
  std::vector<double> stress, all((std::size_t)b.own, std::numeric_limits<double>::quiet_NaN());
  PetscFunctionBegin;
  PetscCall(VonMises(b, eta, &stress));
  *a = Array{"von_mises", "Float64", 1, {}};
  for (std::size_t j = 0; j < stress.size(); j++) all[(std::size_t)b.stress.node[j]] = stress[j];
  for (double v : all) Add(&a->bytes, v);
  PetscFunctionReturn(0);
}

Array MakeLabels(const ReducedBody &b)
{
  Array a{"label", "Int64", 1, {}};
  for (PetscInt l : b.label) Add<int64_t>(&a.bytes, l);
  return a;
}

/* Connectivity, offsets and types of the elements; without elements every node is a cell. Collective */
PetscErrorCode MakeCells(const ReducedBody &b, bool elements, Array cells[3])
{
  constexpr uint8_t vtk_type[] = {10, 24, 12, 25};
  PetscInt64        begin, all, end = 0;
  PetscFunctionBegin;
  cells[0] = Array{"connectivity", "Int64", 1, {}};
  cells[1] = Array{"offsets", "Int64", 1, {}};
  cells[2] = Array{"types", "UInt8", 1, {}};
  for (const FeElement &e : b.elements) end += FeNodes(e.type);
  PetscCall(RangeOnRank(b.comm, elements ? end : (PetscInt64)b.own, &begin, &all));
  end = begin;
  for (const FeElement &e : b.elements) {
    for (int k = 0; k < FeNodes(e.type); k++) Add<int64_t>(&cells[0].bytes, e.node[GmshPlace(e.type, k)]);
    Add<int64_t>(&cells[1].bytes, end += FeNodes(e.type));
    Add<uint8_t>(&cells[2].bytes, vtk_type[(int)e.type]);
  }
  for (PetscInt i = 0; i < b.own && !elements; i++) {
    Add<int64_t>(&cells[0].bytes, b.first + i);
    Add<int64_t>(&cells[1].bytes, ++end);
    Add<uint8_t>(&cells[2].bytes, 1);
  }
  PetscFunctionReturn(0);
}

std::string Describe(const Array &a, PetscInt64 *offset)
{
  std::string text = std::string("        <DataArray type=\"") + a.type + "\" NumberOfComponents=\"" +
                     std::to_string(a.components) + "\"";
  if (!a.name.empty()) text += " Name=\"" + a.name + "\"";
  if (a.name == "stress") {
    const char *component[] = {"xx", "yy", "zz", "xy", "yz", "zx"};
    for (int c = 0; c < 6; c++) text += " ComponentName" + std::to_string(c) + "=\"" + component[c] + "\"";
  }
  text += " format=\"appended\" offset=\"" + std::to_string(*offset) + "\"/>\n";
  *offset += 8 + a.total;
  return text;
}

std::string Header(const std::vector<Array> &points, const Array cells[3], PetscInt64 nodes, PetscInt64 count)
{
  const uint16_t one    = 1;
  PetscInt64     offset = 0;
  char           little;
  std::memcpy(&little, &one, 1);
  std::string text =
      std::string("<?xml version=\"1.0\"?>\n<VTKFile type=\"UnstructuredGrid\" version=\"1.0\" byte_order=\"") +
      (little ? "LittleEndian" : "BigEndian") +
      "\" header_type=\"UInt64\">\n  <UnstructuredGrid>\n    <Piece NumberOfPoints=\"" + std::to_string(nodes) +
      "\" NumberOfCells=\"" + std::to_string(count) + "\">\n      <Points>\n" + Describe(points[0], &offset) +
      "      </Points>\n      <PointData Vectors=\"displacement\">\n";
  for (std::size_t i = 1; i < points.size(); i++) text += Describe(points[i], &offset);
  text += "      </PointData>\n      <Cells>\n";
  for (int i = 0; i < 3; i++) text += Describe(cells[i], &offset);
  return text + "      </Cells>\n    </Piece>\n  </UnstructuredGrid>\n  <AppendedData encoding=\"raw\">\n_";
}

constexpr std::size_t message_bytes = 1 << 28; /* longest MPI message: counts are ints */

/* Appends an array's bytes, rank after rank, to the file on rank 0. Collective */
PetscErrorCode Append(MPI_Comm comm, FILE *out, const Array &a, bool *good)
{
  PetscMPIInt       rank, size;
  std::vector<char> buffer;
  PetscFunctionBegin;
  PetscCallMPI(MPI_Comm_rank(comm, &rank));
  PetscCallMPI(MPI_Comm_size(comm, &size));
  if (rank) {
    PetscInt64 mine = (PetscInt64)a.bytes.size();
    PetscCallMPI(MPI_Send(&mine, 1, MPIU_INT64, 0, 0, comm));
    for (std::size_t at = 0; at < a.bytes.size(); at += message_bytes)
      PetscCallMPI(MPI_Send(a.bytes.data() + at, (PetscMPIInt)std::min(message_bytes, a.bytes.size() - at), MPI_BYTE, 0,
                            1, comm));
    PetscFunctionReturn(0);
  }
  const uint64_t total = (uint64_t)a.total;
  *good                = *good && std::fwrite(&total, sizeof total, 1, out) == 1 &&
          std::fwrite(a.bytes.data(), 1, a.bytes.size(), out) == a.bytes.size();
  for (PetscMPIInt r = 1; r < size; r++) {
    PetscInt64 theirs;
    PetscCallMPI(MPI_Recv(&theirs, 1, MPIU_INT64, r, 0, comm, MPI_STATUS_IGNORE));
    for (std::size_t at = 0; at < (std::size_t)theirs; at += message_bytes) {
      buffer.resize(std::min(message_bytes, (std::size_t)theirs - at));
      PetscCallMPI(MPI_Recv(buffer.data(), (PetscMPIInt)buffer.size(), MPI_BYTE, r, 1, comm, MPI_STATUS_IGNORE));
      *good = *good && std::fwrite(buffer.data(), 1, buffer.size(), out) == buffer.size();
    }
  }
  PetscFunctionReturn(0);
}

PetscErrorCode SumBytes(MPI_Comm comm, Array *a)
{
  PetscInt64 mine = (PetscInt64)a->bytes.size();
  PetscFunctionBegin;
  PetscCallMPI(MPI_Allreduce(&mine, &a->total, 1, MPIU_INT64, MPI_SUM, comm));
  PetscFunctionReturn(0);
}

/* Why no field of the body can be written, or "" */
std::string ProblemOf(const ReducedBody &b, const Eigen::VectorXd &eta, const Vector3 &origin, const Matrix3 &axes)
{
  const std::string body = BodyName(b);
  if (eta.size() != b.modal.omega.size())
    return std::to_string(eta.size()) + " modal coordinates for the field of " + body + " with " +
           std::to_string(b.modal.omega.size()) + " modes";
  if (!eta.allFinite() || !origin.allFinite() || !axes.allFinite())
    return "a modal coordinate or the pose of " + body + " is not finite";
  if (b.coordinates.size() != 3 * (std::size_t)b.own || b.label.size() != (std::size_t)b.own ||
      b.shape.rows() != 3 * b.own || b.shape.cols() != eta.size())
    return body + " has no modes at its nodes: it has to be reduced with all nodes for a field to be written";
  if (!b.stress.node.empty() && (b.stress.values.rows() != 6 * (Eigen::Index)b.stress.node.size() || b.stress.values.cols() != eta.size()))
    return "the stress modes of " + body + " do not fit its nodes and modes";
  return "";
}

} // namespace

PetscErrorCode WriteField(const ReducedBody &body, const Eigen::VectorXd &eta, const std::string &file,
                          const Vector3 &origin, const Matrix3 &axes)
{
  PetscMPIInt rank;
  PetscInt64  count[3] = {body.own, (PetscInt64)body.elements.size(), (PetscInt64)body.stress.node.size()};
  FILE       *out      = nullptr;
  bool        good     = true;
  std::string error    = ProblemOf(body, eta, origin, axes);
  PetscFunctionBegin;
  PetscCallMPI(MPI_Comm_rank(body.comm, &rank));
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, count, 3, MPIU_INT64, MPI_SUM, body.comm));
  if (error.empty() && !count[0])
    error = BodyName(body) + " has no nodes: it has to be reduced with all nodes for a field to be written";
  PetscCall(Agree(body.comm, error, PETSC_ERR_ARG_INCOMP));
  std::vector<Array> points{MakePoints(body, origin, axes), MakeDisplacement(body, eta, axes), MakeLabels(body)};
  Array              cells[3];
  if (count[2]) {
    Array mises;
    PetscCall(MakeVonMises(body, eta, &mises));
    points.push_back(std::move(mises));
    points.push_back(MakeStress(body, eta, axes));
  }
  PetscCall(MakeCells(body, count[1] > 0, cells));
  for (Array &a : points) PetscCall(SumBytes(body.comm, &a));
  for (Array &a : cells) PetscCall(SumBytes(body.comm, &a));
  if (!rank && !(out = std::fopen(file.c_str(), "wb")))
    error = "cannot write the field into " + file + ": " + std::strerror(errno);
  PetscCall(Agree(body.comm, error, PETSC_ERR_FILE_OPEN));
  if (out) {
    const std::string head = Header(points, cells, count[0], count[1] ? count[1] : count[0]);
    good                   = std::fwrite(head.data(), 1, head.size(), out) == head.size();
  }
  for (const Array &a : points) PetscCall(Append(body.comm, out, a, &good));
  for (const Array &a : cells) PetscCall(Append(body.comm, out, a, &good));
  if (out) {
    good = std::fputs("\n  </AppendedData>\n</VTKFile>\n", out) >= 0 && good;
    good = std::fclose(out) == 0 && good;
  }
  if (!good) error = "writing the field into " + file + " failed (disk full?)";
  PetscCall(Agree(body.comm, error, PETSC_ERR_FILE_WRITE));
  PetscFunctionReturn(0);
}

} // namespace hhtdae
