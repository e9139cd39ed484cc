/* A file with one sequence of bytes of every rank: written beside and renamed when it is whole and on the disk, with a checksum. */
#ifndef HHTDAE_CHECKPOINT_FILE_H
#define HHTDAE_CHECKPOINT_FILE_H

#include <petscsys.h>
#include <string>
#include <vector>

namespace hht3
{

/* Collective. A run that dies while writing keeps the file that was there before. */
PetscErrorCode CheckpointFileWrite(MPI_Comm comm, const std::string &file, const std::vector<char> &mine);

/* Collective; an error where no such file could be written: for before a run, lest it tells at its end */
PetscErrorCode CheckpointFileCheck(MPI_Comm comm, const std::string &file);

/* Collective; an error on all ranks where the file is damaged, not one of these, or of another number of ranks */
PetscErrorCode CheckpointFileRead(MPI_Comm comm, const std::string &file, std::vector<char> &mine);

} // namespace hht3

#endif
