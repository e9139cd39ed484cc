/* Functions shared by the import of matrices of other programs: distribution of a model from rank 0, and parallel reading of matrices in text. */
#ifndef HHTDAE_FLEXIBLE_IMPORT_H
#define HHTDAE_FLEXIBLE_IMPORT_H

#include "hhtdae/flexible.h"

namespace hhtdae
{

/* Nodes, sets and elements read on rank 0; empty on other ranks */
struct ReadModel {
  std::vector<PetscInt>                        label;
  std::vector<double>                          coordinates; /* empty: not known */
  std::map<std::string, std::vector<PetscInt>> sets;        /* indices of nodes, in any order */
  std::vector<Material>                        materials;
  std::vector<FeElement>                       elements;
};

/* Fails if the model has been filled already. Collective */
PetscErrorCode CheckUnread(const FeModel &model);

/* Distributes nodes in contiguous ranges; an element goes to the owner of its first node. Collective */
PetscErrorCode HandOut(const ReadModel &read, FeModel *model);

/* The expected number of rows, -1 to take that of the file, and their order in the model */
struct MatrixShape {
  PetscInt                     rows = -1;
  const std::vector<PetscInt> *row =
      nullptr; /* the model's row for row i of the file, on all ranks; null: i */
};

/* Contents of the header of a matrix file, the same on all ranks */
struct MatrixFile {
  std::string file;
  enum Kind { Text, Market, Binary } kind = Text;
  bool       symmetric                    = false; /* Market: one triangle is stored */
  PetscInt64 rows = -1, entries = -1, begin = 0, bytes = 0;
};

PetscErrorCode OpenMatrix(MPI_Comm comm, const std::string &file, MatrixFile *matrix);

/* Checks a binary file of PETSc, which MatLoad() does not: numbers of entries, and of this rank's rows that columns are in range and ascending
   and values finite. Collective */
PetscErrorCode CheckBinary(const FeModel &model, const MatrixFile &matrix);

/* Entries of a matrix in text; largest: the largest row or column number, which is the number of rows if the header does not tell it */
struct Triplets {
  std::vector<PetscInt> i, j;
  std::vector<double>   value;
  PetscInt              largest = -1;
  PetscInt64            entries = 0;
};
/* Reads lines "i j value" of Matrix Market, Abaqus or CalculiX files; one stored triangle is mirrored. Collective */
PetscErrorCode ReadTriplets(MPI_Comm comm, const MatrixFile &matrix, const MatrixShape &shape, Triplets *triplets);

/* Assembles the matrix, distributed as the model's nodes; clears the triplets. Collective */
PetscErrorCode Assemble(const FeModel &model, const std::string &name, Triplets *triplets, Mat *A);

/* Fails if a matrix of which both triangles were given is not symmetric. Collective */
PetscErrorCode CheckSymmetric(MPI_Comm comm, const std::string &name, Mat A);

} // namespace hhtdae

#endif
