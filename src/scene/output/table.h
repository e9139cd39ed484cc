/* Files of sampled channels: blocks of samples are appended, so that a run that breaks off leaves what it had. */
#ifndef HHTDAE_SCENE_OUTPUT_TABLE_H
#define HHTDAE_SCENE_OUTPUT_TABLE_H

#include <petscsys.h>
#include <string>
#include <vector>

namespace hhtdae
{

/* Samples of all channels, one after the other in time; on the first rank */
struct Block {
  std::vector<double> time, values; /* values[sample * channels + channel] */
};

struct TableHead {
  std::vector<std::string> name, unit; /* of the channels */
};

/* first: begins the file anew. *end: its length then. */
PetscErrorCode AppendText(const std::string &file, bool first, const std::string &text, long *end);
PetscErrorCode AppendCSV(const std::string &file, bool first, const TableHead &head, const Block &block, long *end);
PetscErrorCode AppendHDF5(const std::string &file, bool first, const TableHead &head, const Block &block);

/* Where a run goes on that was recorded up to so many bytes or rows: what was written later is dropped. *there: whether the file is; a
   run may be resumed with another one, which then begins there. A file that is too short is an error. */
PetscErrorCode ShortenFile(const std::string &file, long end, bool *there);
PetscErrorCode ShortenHDF5(const std::string &file, std::size_t rows, const TableHead &head, bool *there);

} // namespace hhtdae

#endif
