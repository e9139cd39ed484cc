#include "scene/output/table.h"
#include <cstdio>

#if defined(HHTDAE_HDF5)
  #include <petscviewerhdf5.h>
#endif

namespace hhtdae
{

namespace
{

/* A field of a CSV file; quoted where it has to be */
std::string Field(const std::string &text)
{
  if (text.find_first_of(",\"\n\r") == std::string::npos) return text;
  std::string quoted = "\"";
  for (char c : text) {
    if (c == '"') quoted += '"';
    quoted += c;
  }
  return quoted + '"';
}

} // namespace

PetscErrorCode AppendCSV(const std::string &file, bool first, const TableHead &head, const Block &block)
{
  const std::size_t channels = head.name.size();
  std::string       text;
  char              number[40];
  PetscFunctionBegin;
  if (first) {
    text = "time";
    for (std::size_t c = 0; c < channels; c++) text += "," + Field(head.unit[c].empty() ? head.name[c] : head.name[c] + " [" + head.unit[c] + "]");
    text += "\n";
  }
  for (std::size_t s = 0; s < block.time.size(); s++) {
    std::snprintf(number, sizeof number, "%.17g", block.time[s]);
    text += number;
    for (std::size_t c = 0; c < channels; c++) {
      std::snprintf(number, sizeof number, ",%.17g", block.values[s * channels + c]);
      text += number;
    }
    text += "\n";
  }
  FILE *out = std::fopen(file.c_str(), first ? "w" : "a");
  PetscCheck(out, PETSC_COMM_SELF, PETSC_ERR_FILE_OPEN, "cannot write the channels into %s", file.c_str());
  const bool written = std::fwrite(text.data(), 1, text.size(), out) == text.size();
  const bool closed  = std::fclose(out) == 0;
  PetscCheck(written && closed, PETSC_COMM_SELF, PETSC_ERR_FILE_WRITE, "writing the channels into %s failed", file.c_str());
  PetscFunctionReturn(0);
}

#if defined(HHTDAE_HDF5)

namespace
{

/* Datasets grow in chunks of this many samples. */
constexpr hsize_t chunk = 256;

/* A new dataset without samples, its length unlimited; groups in its name are made on the way */
hid_t CreateDataset(hid_t file, const std::string &name)
{
  const hsize_t none = 0, any = H5S_UNLIMITED;
  const hid_t   space = H5Screate_simple(1, &none, &any), layout = H5Pcreate(H5P_DATASET_CREATE), link = H5Pcreate(H5P_LINK_CREATE);
  H5Pset_chunk(layout, 1, &chunk);
  H5Pset_create_intermediate_group(link, 1);
  const hid_t set = H5Dcreate2(file, name.c_str(), H5T_NATIVE_DOUBLE, space, link, layout, H5P_DEFAULT);
  H5Pclose(link);
  H5Pclose(layout);
  H5Sclose(space);
  return set;
}

bool Append(hid_t set, const std::vector<double> &values)
{
  const hsize_t more = values.size();
  hsize_t       before, after;
  hid_t         space = H5Dget_space(set);
  H5Sget_simple_extent_dims(space, &before, nullptr);
  H5Sclose(space);
  after = before + more;
  if (H5Dset_extent(set, &after) < 0) return false;
  space            = H5Dget_space(set);
  const hid_t part = H5Screate_simple(1, &more, nullptr);
  const bool  good = H5Sselect_hyperslab(space, H5S_SELECT_SET, &before, nullptr, &more, nullptr) >= 0 &&
                    H5Dwrite(set, H5T_NATIVE_DOUBLE, part, space, H5P_DEFAULT, values.data()) >= 0;
  H5Sclose(part);
  H5Sclose(space);
  return good;
}

PetscErrorCode AppendDataset(PetscViewer viewer, const std::string &file, bool first, const std::string &name, const char *unit,
                             const std::vector<double> &values)
{
  hid_t id;
  PetscFunctionBegin;
  PetscCall(PetscViewerHDF5GetFileId(viewer, &id));
  const hid_t set = first ? CreateDataset(id, name) : H5Dopen2(id, name.c_str(), H5P_DEFAULT);
  PetscCheck(set >= 0, PETSC_COMM_SELF, PETSC_ERR_LIB, "HDF5 cannot make the dataset %s in %s", name.c_str(), file.c_str());
  const bool good = Append(set, values);
  H5Dclose(set);
  PetscCheck(good, PETSC_COMM_SELF, PETSC_ERR_FILE_WRITE, "HDF5 cannot write the dataset %s in %s", name.c_str(), file.c_str());
  if (first && unit) PetscCall(PetscViewerHDF5WriteAttribute(viewer, name.c_str(), "units", PETSC_STRING, unit));
  PetscFunctionReturn(0);
}

} // namespace

/* The file is open only while a block is written: a run that is killed leaves a file that is whole. */
PetscErrorCode AppendHDF5(const std::string &file, bool first, const TableHead &head, const Block &block)
{
  const std::size_t   channels = head.name.size(), samples = block.time.size();
  std::vector<double> column(samples);
  PetscViewer         viewer;
  PetscFunctionBegin;
  PetscCall(PetscViewerHDF5Open(PETSC_COMM_SELF, file.c_str(), first ? FILE_MODE_WRITE : FILE_MODE_APPEND, &viewer));
  PetscCall(AppendDataset(viewer, file, first, "/time", nullptr, block.time));
  for (std::size_t c = 0; c < channels; c++) {
    for (std::size_t s = 0; s < samples; s++) column[s] = block.values[s * channels + c];
    PetscCall(AppendDataset(viewer, file, first, "/" + head.name[c], head.unit[c].c_str(), column));
  }
  PetscCall(PetscViewerDestroy(&viewer));
  PetscFunctionReturn(0);
}

#else

PetscErrorCode AppendHDF5(const std::string &file, bool, const TableHead &, const Block &)
{
  PetscFunctionBegin;
  SETERRQ(PETSC_COMM_SELF, PETSC_ERR_SUP, "cannot write %s: the library was built without HDF5; -scene_csv writes a table without it", file.c_str());
}

#endif

} // namespace hhtdae
