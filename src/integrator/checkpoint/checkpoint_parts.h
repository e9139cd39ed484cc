/* Parts of a checkpoint: the identity of the run (checkpoint_identity.cpp), the matrices and the state of their solvers
   (checkpoint_matrix.cpp), and the file (checkpoint_file.cpp). */
#ifndef HHTDAE_CHECKPOINT_PARTS_H
#define HHTDAE_CHECKPOINT_PARTS_H

#include "linear/archive.h"
#include "integrator/state.h"
#include <string>

namespace hht3
{

/* Must be the same in both runs, on each rank */
struct Identity {
  PetscInt      N, n, extra, extra_n; /* number of unknowns on all ranks and on this one; of entries of the application's vector likewise */
  PetscInt      form, order;          /* order: the largest order of the run */
  Parameters    p;
  std::uint64_t roles;
};

PetscErrorCode IdentifyRun(TS ts, Identity *id);
PetscErrorCode CheckIdentity(TS ts, const char file[], const Identity &was);

/* A text with the options that a resumed run may change, although it then does not repeat the uninterrupted one: for
   comparison and for the message */
PetscErrorCode OptionsInWords(TS ts, std::string *text);

/* The residual by which the problem is recognized: at the last state, but with accelerations 2 A + 1, so that inertia
   forces show in it */
PetscErrorCode TellingResidual(TS ts, Vec F);
PetscErrorCode CheckTellingResidual(TS ts, const char file[], Vec was, Vec is);

/* Matrices that cannot be restored are made again by the run */
PetscErrorCode SaveMatrices(TS ts, Archive &a);
PetscErrorCode LoadMatrices(TS ts, Archive &a);

/* Collective; writes a file with a checksum and one sequence of bytes from each rank. It is written as file.part and
   renamed when it is complete and on the disk, so that a run that dies while writing leaves the file from before. */
PetscErrorCode CheckpointFileWrite(MPI_Comm comm, const std::string &file, const std::vector<char> &mine);

/* Collective; error if the file could not be written. Called before a run, so that the user does not learn it only at
   the end. */
PetscErrorCode CheckpointFileCheck(MPI_Comm comm, const std::string &file);

/* Collective; error on all ranks if the file is damaged, is no checkpoint, or is from another number of ranks */
PetscErrorCode CheckpointFileRead(MPI_Comm comm, const std::string &file, std::vector<char> &mine);

} // namespace hht3

#endif
