/* Text files of results. */
#ifndef HHTDAE_SCENE_OUTPUT_FILES_H
#define HHTDAE_SCENE_OUTPUT_FILES_H

#include <petscsys.h>
#include <string>

namespace hhtdae
{

/* first: begins a new file. *end: expected length of the file before (0: not known), its length after; an unexpected length is an error, because another process writes into it. */
PetscErrorCode AppendText(const std::string &file, bool first, const std::string &text, long *end);
/* Truncates a file to the length at a checkpoint. *there: whether the file exists; a run may be resumed with another file, which then begins
   at the checkpoint. A file that is too short is an error. */
PetscErrorCode ShortenFile(const std::string &file, long end, bool *there);
/* Writes a temporary file and renames it when it is complete and on the disk, so that an existing file is replaced only then. */
PetscErrorCode WriteWhole(const std::string &file, const std::string &text);
PetscErrorCode SyncFile(const std::string &file);

} // namespace hhtdae

#endif
