/* Files of sampled channels. Blocks of samples are appended, so that an aborted run leaves the earlier ones. */
#ifndef HHTDAE_SCENE_OUTPUT_TABLE_H
#define HHTDAE_SCENE_OUTPUT_TABLE_H

#include "scene/output/files.h"
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
PetscErrorCode AppendCSV(const std::string &file, bool first, const TableHead &head, const Block &block, long *end);
PetscErrorCode AppendHDF5(const std::string &file, bool first, const TableHead &head, const Block &block);

/* ShortenFile() by rows */
PetscErrorCode ShortenHDF5(const std::string &file, std::size_t rows, const TableHead &head, bool *there);

} // namespace hhtdae

#endif
