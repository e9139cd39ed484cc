/* Text files of results. */
#ifndef HHTDAE_SCENE_OUTPUT_FILES_H
#define HHTDAE_SCENE_OUTPUT_FILES_H

#include <petscsys.h>
#include <string>

namespace hhtdae
{

/* Appends text; first: begins a new file. *end: on entry the expected length of the file (0: not known), on return its
   length. Another length than expected is an error, because another process writes to the file. */
PetscErrorCode AppendText(const std::string &file, bool first, const std::string &text, long *end);
/* Truncates a file to `end`, its length at a checkpoint; a shorter file is an error. *there: whether the file exists; if
   not, the run is resumed with another file, which begins at the checkpoint. */
PetscErrorCode ShortenFile(const std::string &file, long end, bool *there);
/* Writes a temporary file and renames it when it is complete and on the disk, so that an existing file is never replaced by an incomplete one. */
PetscErrorCode WriteWhole(const std::string &file, const std::string &text);
PetscErrorCode SyncFile(const std::string &file);

} // namespace hhtdae

#endif
