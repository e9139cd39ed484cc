/*
  Import of CalculiX' matrices. A deck without supports whose step is

    *STEP
    *FREQUENCY, SOLVER=MATRIXSTORAGE
    *END STEP

  makes ccx 2.20 write, for a job "stem",
    stem.dof   a line "node.direction" for each row of the matrices; supports and dependent unknowns of constraints are
               left out
    stem.sti   lines "i j value" of the stiffness matrix, upper triangle by columns, 14 digits, including zeros of the pattern
    stem.mas   the same for the mass matrix
  Nodes, sets, elements and materials come from the deck stem.inp. Rank 0 reads it and stem.dof and distributes ranges of
  nodes; the matrices, which are most of the bytes, are read by all ranks, a part of the file each. Elements are used for
  stress and pictures only, so that those other than linear and quadratic tetrahedra and bricks are dropped.
*/
#include "flexible/calculix.h"
#include "flexible/exchange.h"
#include <exception>
#include <fstream>

namespace hhtdae
{

namespace
{

/* Converts exceptions, as that of a deck too large for the memory, to an error message: ending rank 0 alone would leave the others waiting */
std::string ReadSafely(const std::string &stem, ReadModel *read, std::vector<PetscInt> *row, PetscInt64 *left_out)
{
  try {
    return calculix::ReadJob(stem, read, row, left_out);
  } catch (const std::exception &e) {
    return "reading " + stem + ".inp and " + stem + ".dof failed: " + e.what();
  }
}

/* Refuses a file that does not end with a line end: if it was truncated within the last line, a number there has lost digits */
std::string CheckEnd(const std::string &file)
{
  std::ifstream in(file, std::ios::binary);
  in.seekg(-1, std::ios::end);
  return in.get() == '\n' ? "" : file + " ends within a line (truncated?): ccx ends each line";
}

/* Reads a matrix, and checks that it has entries up to the last row: a truncated file has not */
PetscErrorCode ReadMatrix(const FeModel &model, const std::string &file, const std::vector<PetscInt> &row, Mat *A)
{
  MatrixFile  head;
  MatrixShape shape;
  Triplets    triplets;
  PetscMPIInt rank;
  PetscFunctionBegin;
  PetscCallMPI(MPI_Comm_rank(model.comm, &rank));
  shape.rows = 3 * model.nodes;
  shape.row  = row.empty() ? nullptr : &row;
  PetscCall(OpenMatrix(model.comm, file, &head));
  PetscCheck(head.kind == MatrixFile::Text, model.comm, PETSC_ERR_FILE_UNEXPECTED, "%s is not a matrix of CalculiX",
             file.c_str());
  PetscCall(ReadTriplets(model.comm, head, shape, &triplets));
  PetscCheck(triplets.largest == shape.rows - 1, model.comm, PETSC_ERR_FILE_UNEXPECTED,
             "%s ends with row %" PetscInt_FMT " of %" PetscInt_FMT
             " (truncated, or of another run than the .dof file)",
             file.c_str(), triplets.largest + 1, shape.rows);
  PetscCall(Agree(model.comm, rank ? "" : CheckEnd(file), PETSC_ERR_FILE_UNEXPECTED));
  PetscCall(Assemble(model, file, &triplets, A));
  PetscFunctionReturn(0);
}

} // namespace

PetscErrorCode FeModel::readCalculix(const std::string &given)
{
  const bool            deck = given.size() > 4 && given.compare(given.size() - 4, 4, ".inp") == 0;
  const std::string     stem = deck ? given.substr(0, given.size() - 4) : given;
  ReadModel             read;
  std::vector<PetscInt> row;
  std::string           error;
  PetscInt64            head[2] = {0, 0}; /* rows to be renumbered, elements that are not kept */
  PetscMPIInt           rank;
  PetscFunctionBegin;
  PetscCall(CheckUnread(*this));
  PetscCallMPI(MPI_Comm_rank(comm, &rank));
  if (!rank) {
    error     = ReadSafely(stem, &read, &row, &head[1]);
    bool same = true;
    for (std::size_t i = 0; i < row.size(); i++) same = same && row[i] == (PetscInt)i;
    if (same) row.clear(); /* the usual case: no renumbering */
    head[0] = (PetscInt64)row.size();
  }
  PetscCall(Agree(comm, error, PETSC_ERR_FILE_UNEXPECTED));
  PetscCallMPI(MPI_Bcast(head, 2, MPIU_INT64, 0, comm));
  row.resize((std::size_t)head[0]);
  PetscCallMPI(MPI_Bcast(row.data(), (PetscMPIInt)row.size(), MPIU_INT, 0, comm));
  PetscCall(HandOut(read, this));
  source = "CalculiX " + stem;
  if (head[1])
    PetscCall(PetscInfo(nullptr,
                        "%lld elements of %s have no stress: of another kind, or without an isotropic material\n",
                        (long long)head[1], stem.c_str()));
  PetscCall(ReadMatrix(*this, stem + ".sti", row, &K));
  PetscCall(ReadMatrix(*this, stem + ".mas", row, &M));
  PetscFunctionReturn(0);
}

} // namespace hhtdae
