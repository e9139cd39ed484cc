/* What a checkpoint is made of: whether it belongs to the run that reads it (checkpoint_identity.cpp), the matrices and what their solvers keep
   (checkpoint_matrix.cpp), and the file (checkpoint_file.cpp). */
#ifndef HHTDAE_CHECKPOINT_PARTS_H
#define HHTDAE_CHECKPOINT_PARTS_H

#include "linear/archive.h"
#include "integrator/state.h"
#include <string>

namespace hht3
{

/* What must be the same in both runs, rank by rank */
struct Identity {
  PetscInt      N, n, extra, extra_n; /* unknowns of all ranks and of this one; entries of the application's own likewise */
  PetscInt      form, order;          /* order: the largest one */
  Parameters    p;
  std::uint64_t roles;
};

PetscErrorCode IdentifyRun(TS ts, Identity *id);
PetscErrorCode CheckIdentity(TS ts, const char file[], const Identity &was);

/* Options that the run may change, at the cost of repeating the uninterrupted one no more: for comparison and for the message */
PetscErrorCode OptionsInWords(TS ts, std::string *text);

/* The residual by which a problem is told: at the last state, with accelerations that leave the inertia forces in it */
PetscErrorCode TellingResidual(TS ts, Vec F);
PetscErrorCode CheckTellingResidual(TS ts, const char file[], Vec was, Vec is);

/* Where they cannot be restored the run makes new ones */
PetscErrorCode SaveMatrices(TS ts, Archive &a);
PetscErrorCode LoadMatrices(TS ts, Archive &a);

/* A file with one sequence of bytes of every rank: written beside and renamed when it is whole and on the disk, with a checksum. Collective.
   A run that dies while writing keeps the file that was there before. */
PetscErrorCode CheckpointFileWrite(MPI_Comm comm, const std::string &file, const std::vector<char> &mine);

/* Collective; an error where no such file could be written: for before a run, lest it tells at its end */
PetscErrorCode CheckpointFileCheck(MPI_Comm comm, const std::string &file);

/* Collective; an error on all ranks where the file is damaged, not one of these, or of another number of ranks */
PetscErrorCode CheckpointFileRead(MPI_Comm comm, const std::string &file, std::vector<char> &mine);

} // namespace hht3

#endif
