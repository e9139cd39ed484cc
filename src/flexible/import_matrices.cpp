/* Models from matrices in memory or in files of Matrix Market, Abaqus or PETSc, with nodes and sets in text files. */
#include "flexible/exchange.h"
#include "flexible/import.h"
#include "flexible/read_text.h"
#include <algorithm>
#include <cmath>
#include <fstream>
#include <unordered_map>

namespace hhtdae
{

namespace
{

/* Distributes consecutive parts of rank 0's data, counts[r] entries to rank r. Collective */
template <class T>
PetscErrorCode Scatter(MPI_Comm comm, const std::vector<T> &data, const std::vector<PetscMPIInt> &counts,
                       PetscMPIInt own, std::vector<T> *part)
{
  std::vector<PetscMPIInt> begin(counts.size() + 1, 0);
  MPI_Datatype             type;
  PetscFunctionBegin;
  for (std::size_t r = 0; r < counts.size(); r++) begin[r + 1] = begin[r] + counts[r];
  part->resize((std::size_t)own);
  PetscCallMPI(MPI_Type_contiguous((int)sizeof(T), MPI_BYTE, &type));
  PetscCallMPI(MPI_Type_commit(&type));
  PetscCallMPI(MPI_Scatterv(data.data(), counts.data(), begin.data(), type, part->data(), own, type, 0, comm));
  PetscCallMPI(MPI_Type_free(&type));
  PetscFunctionReturn(0);
}

struct Node3 {
  double x[3];
};

/* Sends the members of one set to the owners of the nodes */
PetscErrorCode HandOutSet(MPI_Comm comm, PetscInt nodes, std::string name, std::vector<PetscInt> member, FeModel *model)
{
  PetscMPIInt              rank, size, length = (PetscMPIInt)name.size(), own = 0;
  std::vector<PetscMPIInt> counts;
  PetscFunctionBegin;
  PetscCallMPI(MPI_Comm_rank(comm, &rank));
  PetscCallMPI(MPI_Comm_size(comm, &size));
  PetscCallMPI(MPI_Bcast(&length, 1, MPI_INT, 0, comm));
  name.resize((std::size_t)length);
  PetscCallMPI(MPI_Bcast(&name[0], length, MPI_CHAR, 0, comm));
  std::sort(member.begin(), member.end());
  member.erase(std::unique(member.begin(), member.end()), member.end());
  for (PetscMPIInt r = 0; r < size && !rank; r++) {
    const auto from = std::lower_bound(member.begin(), member.end(), (PetscInt)PartBegin(nodes, size, r)),
               to   = std::lower_bound(member.begin(), member.end(), (PetscInt)PartBegin(nodes, size, r + 1));
    counts.push_back((PetscMPIInt)(to - from));
  }
  PetscCallMPI(MPI_Scatter(counts.data(), 1, MPI_INT, &own, 1, MPI_INT, 0, comm));
  PetscCall(Scatter(comm, member, counts, own, &model->sets[name]));
  PetscFunctionReturn(0);
}

/* Sends each element to the owner of its first node */
PetscErrorCode HandOutElements(MPI_Comm comm, const ReadModel &read, FeModel *model)
{
  PetscMPIInt              rank, size, own = 0;
  std::vector<PetscMPIInt> counts;
  std::vector<FeElement>   sorted;
  PetscFunctionBegin;
  PetscCallMPI(MPI_Comm_rank(comm, &rank));
  PetscCallMPI(MPI_Comm_size(comm, &size));
  if (!rank) {
    std::vector<PetscInt>    begin;
    std::vector<std::size_t> place;
    for (PetscMPIInt r = 0; r <= size; r++) begin.push_back((PetscInt)PartBegin(model->nodes, size, r));
    counts.assign((std::size_t)size, 0);
    std::vector<PetscMPIInt> owner;
    for (const FeElement &e : read.elements) {
      owner.push_back((PetscMPIInt)(std::upper_bound(begin.begin(), begin.end(), e.node[0]) - begin.begin() - 1));
      counts[(std::size_t)owner.back()]++;
    }
    place.assign((std::size_t)size, 0);
    for (std::size_t r = 1; r < place.size(); r++) place[r] = place[r - 1] + (std::size_t)counts[r - 1];
    sorted.resize(read.elements.size());
    for (std::size_t e = 0; e < owner.size(); e++) sorted[place[(std::size_t)owner[e]]++] = read.elements[e];
  }
  PetscCallMPI(MPI_Scatter(counts.data(), 1, MPI_INT, &own, 1, MPI_INT, 0, comm));
  PetscCall(Scatter(comm, sorted, counts, own, &model->elements));
  PetscFunctionReturn(0);
}

std::string BadLine(const std::string &file, long number, const std::string &line, const std::string &why)
{
  return file + ", line " + std::to_string(number) + ": " + Quoted(line) + " " + why;
}

bool Blank(const std::string &line)
{
  const std::vector<std::string> words = SplitWords(line, true);
  return words.empty() || words[0][0] == '#' || words[0][0] == '%';
}

/* Reads lines "label x y z" */
std::string ReadNodes(const std::string &file, ReadModel *read)
{
  std::string   line, why = WhyUnreadable(file);
  std::ifstream in(file);
  long          number = 0;
  if (!why.empty()) return "cannot read the nodes " + file + ": " + why;
  while (std::getline(in, line)) {
    number++;
    if (Blank(line)) continue;
    const std::vector<std::string> word  = SplitWords(line, true);
    PetscInt64                     label = 0;
    double                         x[3];
    if (word.size() != 4 || !ParseInteger(word[0], &label) || !ParseReal(word[1], &x[0]) || !ParseReal(word[2], &x[1]) ||
        !ParseReal(word[3], &x[2]))
      return BadLine(file, number, line, "is not \"label x y z\" with finite coordinates");
    if (label < 0 || label > (PetscInt64)PETSC_MAX_INT) return BadLine(file, number, line, "has an impossible label");
    read->label.push_back((PetscInt)label);
    read->coordinates.insert(read->coordinates.end(), x, x + 3);
  }
  if (read->label.empty()) return "cannot read the nodes " + file + ": there are none";
  std::vector<PetscInt> sorted = read->label;
  std::sort(sorted.begin(), sorted.end());
  const auto twice = std::adjacent_find(sorted.begin(), sorted.end());
  return twice == sorted.end() ? "" : file + ": two nodes have the label " + std::to_string(*twice);
}

/* Reads lines "name label label ..."; several lines with one name are one set */
std::string ReadSets(const std::string &file, ReadModel *read)
{
  std::string                            line, why = WhyUnreadable(file);
  std::ifstream                          in(file);
  std::unordered_map<PetscInt, PetscInt> place;
  long                                   number = 0;
  if (!why.empty()) return "cannot read the sets " + file + ": " + why;
  for (std::size_t i = 0; i < read->label.size(); i++) place.emplace(read->label[i], (PetscInt)i);
  while (std::getline(in, line)) {
    number++;
    if (Blank(line)) continue;
    const std::vector<std::string> word = SplitWords(line, false);
    auto                          &set  = read->sets[word[0]];
    for (std::size_t k = 1; k < word.size(); k++) {
      PetscInt64 label = 0;
      if (!ParseInteger(word[k], &label))
        return BadLine(file, number, line, "has " + Quoted(word[k]) + " in place of a node's label");
      const auto found = label < 0 || label > (PetscInt64)PETSC_MAX_INT ? place.end() : place.find((PetscInt)label);
      if (found == place.end()) return BadLine(file, number, line, "names node " + word[k] + ", which is not there");
      set.push_back(found->second);
    }
  }
  return "";
}

PetscErrorCode LoadBinary(const FeModel &model, const std::string &file, const MatrixFile &head, Mat *A)
{
  PetscViewer viewer;
  PetscFunctionBegin;
  PetscCall(CheckBinary(model, head));
  PetscCall(PetscViewerCreate(model.comm, &viewer));
  PetscCall(PetscViewerSetType(viewer, PETSCVIEWERBINARY));
  PetscCall(PetscViewerBinarySetSkipInfo(viewer, PETSC_TRUE));
  PetscCall(PetscViewerFileSetMode(viewer, FILE_MODE_READ));
  PetscCall(PetscViewerFileSetName(viewer, file.c_str()));
  PetscCall(MatCreate(model.comm, A));
  PetscCall(MatSetSizes(*A, 3 * model.own, 3 * model.own, 3 * model.nodes, 3 * model.nodes));
  PetscCall(MatSetBlockSize(*A, 3));
  PetscCall(MatSetType(*A, MATAIJ));
  PetscCall(MatLoad(*A, viewer));
  PetscCall(PetscViewerDestroy(&viewer));
  PetscCall(CheckSymmetric(model.comm, file, *A));
  PetscCall(MatSetOption(*A, MAT_SYMMETRIC, PETSC_TRUE));
  PetscFunctionReturn(0);
}

/* Checks type, size and distribution of a matrix, and its symmetry. Collective */
PetscErrorCode CheckMatrix(MPI_Comm comm, const char *name, Mat A)
{
  PetscInt  rows, cols, own, own_cols;
  PetscBool sparse;
  int       bad;
  PetscFunctionBegin;
  PetscCheck(A, comm, PETSC_ERR_ARG_NULL, "the %s matrix is not given", name);
  PetscCall(MatGetSize(A, &rows, &cols));
  PetscCall(MatGetLocalSize(A, &own, &own_cols));
  PetscCall(PetscObjectBaseTypeCompareAny((PetscObject)A, &sparse, MATSEQAIJ, MATMPIAIJ, ""));
  PetscCheck(sparse, comm, PETSC_ERR_ARG_WRONG,
             "the %s matrix is not of type AIJ with both triangles: convert it with MatConvert()", name);
  PetscCheck(rows == cols && rows % 3 == 0 && rows > 0, comm, PETSC_ERR_ARG_SIZ,
             "the %s matrix has %" PetscInt_FMT " rows and %" PetscInt_FMT " columns: not three for each node", name,
             rows, cols);
  bad = own % 3 != 0 || own != own_cols;
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &bad, 1, MPI_INT, MPI_MAX, comm));
  PetscCheck(!bad, comm, PETSC_ERR_ARG_SIZ,
             "the %s matrix is divided among the ranks within a node: use MatSetSizes() with multiples of three rows",
             name);
  PetscCall(CheckSymmetric(comm, name, A));
  PetscFunctionReturn(0);
}

/* Reads nodes and sets on rank 0 and compares their number with the rows; errors are raised on all ranks */
PetscErrorCode ReadLists(MPI_Comm comm, PetscInt rows, const std::string &nodes, const std::string &sets,
                         const std::string &stiffness, ReadModel *read)
{
  PetscMPIInt rank;
  std::string error;
  PetscFunctionBegin;
  PetscCallMPI(MPI_Comm_rank(comm, &rank));
  if (!rank) {
    if (!nodes.empty()) error = ReadNodes(nodes, read);
    if (error.empty() && !nodes.empty() && 3 * (PetscInt64)read->label.size() != rows)
      error = nodes + " has " + std::to_string(read->label.size()) + " nodes, but " + stiffness + " has " +
              std::to_string(rows) + " rows: three for each node are needed, without supports";
    for (PetscInt i = 0; i < rows / 3 && nodes.empty(); i++) read->label.push_back(i + 1);
    if (error.empty() && !sets.empty()) error = ReadSets(sets, read);
  }
  PetscCall(Agree(comm, error, PETSC_ERR_FILE_UNEXPECTED));
  PetscFunctionReturn(0);
}

} // namespace

PetscErrorCode CheckUnread(const FeModel &model)
{
  PetscFunctionBegin;
  PetscCheck(!model.K && !model.M && !model.nodes, model.comm, PETSC_ERR_ARG_WRONGSTATE,
             "the finite-element model has been filled already, from %s: take a new one", model.source.c_str());
  PetscFunctionReturn(0);
}

PetscErrorCode HandOut(const ReadModel &read, FeModel *model)
{
  MPI_Comm                 comm = model->comm;
  PetscMPIInt              rank, size;
  std::vector<PetscMPIInt> counts;
  std::vector<Node3>       all, part;
  PetscInt head[4] = {(PetscInt)read.label.size(), (PetscInt)read.coordinates.size(), (PetscInt)read.sets.size(),
                      (PetscInt)read.materials.size()};
  PetscFunctionBegin;
  PetscCallMPI(MPI_Comm_rank(comm, &rank));
  PetscCallMPI(MPI_Comm_size(comm, &size));
  PetscCallMPI(MPI_Bcast(head, 4, MPIU_INT, 0, comm));
  model->nodes = head[0];
  model->first = (PetscInt)PartBegin(model->nodes, size, rank);
  model->own   = (PetscInt)PartBegin(model->nodes, size, rank + 1) - model->first;
  for (PetscMPIInt r = 0; r < size; r++)
    counts.push_back((PetscMPIInt)(PartBegin(model->nodes, size, r + 1) - PartBegin(model->nodes, size, r)));
  PetscCall(Scatter(comm, read.label, counts, (PetscMPIInt)model->own, &model->label));
  if (head[1]) {
    for (std::size_t i = 0; i < read.label.size(); i++)
      all.push_back({{read.coordinates[3 * i], read.coordinates[3 * i + 1], read.coordinates[3 * i + 2]}});
    PetscCall(Scatter(comm, all, counts, (PetscMPIInt)model->own, &part));
    for (const Node3 &n : part) model->coordinates.insert(model->coordinates.end(), n.x, n.x + 3);
  }
  auto set = read.sets.begin();
  for (PetscInt s = 0; s < head[2]; s++)
    if (rank)
      PetscCall(HandOutSet(comm, model->nodes, "", {}, model));
    else {
      PetscCall(HandOutSet(comm, model->nodes, set->first, set->second, model));
      ++set;
    }
  model->materials = read.materials;
  model->materials.resize((std::size_t)head[3]);
  PetscCallMPI(
      MPI_Bcast(model->materials.data(), (PetscMPIInt)((std::size_t)head[3] * sizeof(Material)), MPI_BYTE, 0, comm));
  PetscCall(HandOutElements(comm, read, model));
  PetscFunctionReturn(0);
}

PetscErrorCode FeModel::readMatrices(const std::string &stiffness, const std::string &mass,
                                     const std::string &node_file, const std::string &set_file)
{
  const std::string names[2] = {stiffness, mass};
  MatrixFile        files[2];
  Triplets          triplets[2];
  ReadModel         read;
  PetscInt          rows[2];
  PetscFunctionBegin;
  PetscCall(CheckUnread(*this));
  for (int k = 0; k < 2; k++) {
    PetscCall(OpenMatrix(comm, names[k], &files[k]));
    if (files[k].kind != MatrixFile::Binary) PetscCall(ReadTriplets(comm, files[k], MatrixShape(), &triplets[k]));
    rows[k] = files[k].rows < 0 ? triplets[k].largest + 1 : (PetscInt)files[k].rows;
  }
  /* without a header the last rows of M may be missing in the file, if nodes have no mass */
  if (files[1].rows < 0) rows[1] = std::max(rows[0], rows[1]);
  PetscCheck(rows[0] == rows[1], comm, PETSC_ERR_ARG_SIZ, "%s has %" PetscInt_FMT " rows, but %s has %" PetscInt_FMT,
             stiffness.c_str(), rows[0], mass.c_str(), rows[1]);
  PetscCheck(rows[0] % 3 == 0, comm, PETSC_ERR_ARG_SIZ,
             "%s has %" PetscInt_FMT
             " rows, which is not three for each node: matrices of solid elements without supports are needed",
             stiffness.c_str(), rows[0]);
  PetscCheck(files[0].kind == MatrixFile::Binary || triplets[0].entries >= rows[0], comm, PETSC_ERR_FILE_UNEXPECTED,
             "%s has %" PetscInt_FMT " rows, but %lld entries only: there are rows without any", stiffness.c_str(),
             rows[0], (long long)triplets[0].entries);
  PetscCall(ReadLists(comm, rows[0], node_file, set_file, stiffness, &read));
  PetscCall(HandOut(read, this));
  source = stiffness + ", " + mass;
  for (int k = 0; k < 2; k++) {
    Mat *A = k ? &M : &K;
    if (files[k].kind == MatrixFile::Binary)
      PetscCall(LoadBinary(*this, names[k], files[k], A));
    else
      PetscCall(Assemble(*this, names[k], &triplets[k], A));
    if (files[k].kind != MatrixFile::Binary && !files[k].symmetric) PetscCall(CheckSymmetric(comm, names[k], *A));
  }
  PetscFunctionReturn(0);
}

PetscErrorCode FeModel::setMatrices(Mat stiffness, Mat mass, const std::vector<double> &x)
{
  PetscInt rows, mass_rows, own_rows, begin, own_mass;
  int      state[4];
  PetscFunctionBegin;
  PetscCall(CheckUnread(*this));
  PetscCall(CheckMatrix(comm, "stiffness", stiffness));
  PetscCall(CheckMatrix(comm, "mass", mass));
  PetscCall(MatGetSize(stiffness, &rows, nullptr));
  PetscCall(MatGetSize(mass, &mass_rows, nullptr));
  PetscCall(MatGetLocalSize(stiffness, &own_rows, nullptr));
  PetscCall(MatGetLocalSize(mass, &own_mass, nullptr));
  PetscCall(MatGetOwnershipRange(stiffness, &begin, nullptr));
  PetscCheck(rows == mass_rows, comm, PETSC_ERR_ARG_SIZ,
             "the stiffness matrix has %" PetscInt_FMT " rows, the mass matrix %" PetscInt_FMT, rows, mass_rows);
  state[0] = own_rows != own_mass;
  state[1] = !x.empty();
  state[2] = x.size() != (std::size_t)own_rows;
  state[3] = 0;
  for (double v : x) state[3] |= !std::isfinite(v);
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, state, 4, MPI_INT, MPI_MAX, comm));
  PetscCheck(!state[0], comm, PETSC_ERR_ARG_SIZ, "stiffness and mass matrix are divided among the ranks differently");
  PetscCheck(!state[1] || !state[2], comm, PETSC_ERR_ARG_SIZ,
             "coordinates are three for each node that a rank has rows of, or none on all ranks");
  PetscCheck(!state[3], comm, PETSC_ERR_FP, "a coordinate is not a finite number");
  PetscCall(PetscObjectReference((PetscObject)stiffness));
  PetscCall(PetscObjectReference((PetscObject)mass));
  K           = stiffness;
  M           = mass;
  nodes       = rows / 3;
  own         = own_rows / 3;
  first       = begin / 3;
  coordinates = x;
  source      = "matrices in memory";
  label.clear();
  for (PetscInt i = 0; i < own; i++) label.push_back(first + i);
  PetscFunctionReturn(0);
}

} // namespace hhtdae
