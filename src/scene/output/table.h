/* Files of sampled channels. Blocks of samples are appended, so that the files of an aborted run contain all blocks written before. */
#ifndef HHTDAE_SCENE_OUTPUT_TABLE_H
#define HHTDAE_SCENE_OUTPUT_TABLE_H

#include "scene/output/files.h"
#include <string>
#include <vector>

namespace hhtdae
{

/* Samples of all channels in the order of time; on the first rank */
struct Block {
  std::vector<double> time, values; /* values[sample * channels + channel] */
};

struct TableHead {
  std::vector<std::string> name, unit; /* of the channels */
};

/* Append a block; first: begins a new file. *end: as in AppendText() */
PetscErrorCode AppendCSV(const std::string &file, bool first, const TableHead &head, const Block &block, long *end);
PetscErrorCode AppendHDF5(const std::string &file, bool first, const TableHead &head, const Block &block);

/* The same as ShortenFile(), with the length as a number of samples */
PetscErrorCode ShortenHDF5(const std::string &file, std::size_t rows, const TableHead &head, bool *there);

} // namespace hhtdae

#endif
