/* What the doors for matrices of other programs share: a model on rank 0 that is handed out, and matrices in text read
 * by all ranks. */
#ifndef HHTDAE_FLEXIBLE_IMPORT_H
#define HHTDAE_FLEXIBLE_IMPORT_H

#include "hhtdae/flexible.h"

namespace hhtdae
{

/* Nodes, sets and elements as rank 0 has read them; empty on the others */
struct ReadModel {
  std::vector<PetscInt>                        label;
  std::vector<double>                          coordinates; /* empty: not known */
  std::map<std::string, std::vector<PetscInt>> sets;        /* places among the nodes, in any order */
  std::vector<Material>                        materials;
  std::vector<FeElement>                       elements;
};

/* A model may be read once. Collective */
PetscErrorCode CheckUnread(const FeModel &model);

/* Contiguous ranges of nodes to the ranks; an element goes to the owner of its first node. Collective */
PetscErrorCode HandOut(const ReadModel &read, FeModel *model);

/* Rows of a matrix that is to have them; -1: as the file says */
struct MatrixShape {
  PetscInt                     rows = -1;
  const std::vector<PetscInt> *row =
      nullptr; /* the row that number i of the file has in the model, on all ranks; null: i */
};

/* What the beginning of a file of a matrix tells, the same on all ranks */
struct MatrixFile {
  std::string file;
  enum Kind { Text, Market, Binary } kind = Text;
  bool       symmetric                    = false; /* Market: one triangle is stored */
  PetscInt64 rows = -1, entries = -1, begin = 0, bytes = 0;
};

PetscErrorCode OpenMatrix(MPI_Comm comm, const std::string &file, MatrixFile *matrix);

/* Numbers of entries, columns and values of this rank's rows in a file of PETSc's, which MatLoad() takes as they are: columns
   have to be in the matrix and ascending, values finite. Collective */
PetscErrorCode CheckBinary(const FeModel &model, const MatrixFile &matrix);

/* Rows "i j value" in Matrix Market's, Abaqus' or CalculiX' way; the largest number of a row, if the shape is not known
 */
struct Triplets {
  std::vector<PetscInt> i, j;
  std::vector<double>   value;
  PetscInt              largest = -1;
  PetscInt64            entries = 0;
};
/* Lines "i j value" in Matrix Market's, Abaqus' or CalculiX' way; one triangle in the file becomes two. Collective */
PetscErrorCode ReadTriplets(MPI_Comm comm, const MatrixFile &matrix, const MatrixShape &shape, Triplets *triplets);

/* The matrix with both triangles, rank's rows as the model has its nodes; the triplets are used up. Collective */
PetscErrorCode Assemble(const FeModel &model, const std::string &name, Triplets *triplets, Mat *A);

/* A symmetric matrix whose triangles were both given. Collective */
PetscErrorCode CheckSymmetric(MPI_Comm comm, const std::string &name, Mat A);

} // namespace hhtdae

#endif
