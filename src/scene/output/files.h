/* Text files of results. */
#ifndef HHTDAE_SCENE_OUTPUT_FILES_H
#define HHTDAE_SCENE_OUTPUT_FILES_H

#include <petscsys.h>
#include <string>

namespace hhtdae
{

/* first: begins the file anew. *end: its length, before (0: not known) and then; another length than that before is an error: somebody else writes into it. */
PetscErrorCode AppendText(const std::string &file, bool first, const std::string &text, long *end);
/* Where a run goes on that was recorded up to so many bytes: what was written later is dropped. *there: whether the file is; a run may be resumed
   with another one, which then begins there. A file that is too short is an error. */
PetscErrorCode ShortenFile(const std::string &file, long end, bool *there);
/* Written beside, and renamed when it is whole and on the disk: the file that was there before is lost only then. */
PetscErrorCode WriteWhole(const std::string &file, const std::string &text);
PetscErrorCode SyncFile(const std::string &file);

} // namespace hhtdae

#endif
