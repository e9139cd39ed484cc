#include "scene/output/table.h"
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#if defined(HHTDAE_HDF5)
  #include <hdf5.h>
#endif

namespace hhtdae
{

namespace
{

/* A field of a CSV file, quoted if necessary */
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

PetscErrorCode AppendText(const std::string &file, bool first, const std::string &text, long *end)
{
  PetscFunctionBegin;
  errno     = 0;
  FILE *out = std::fopen(file.c_str(), first ? "w" : "a");
  PetscCheck(out, PETSC_COMM_SELF, PETSC_ERR_FILE_OPEN, "cannot write into %s: %s", file.c_str(), std::strerror(errno));
  struct stat info;
  if (!first && *end > 0 && fstat(fileno(out), &info) == 0 && S_ISREG(info.st_mode) && info.st_size != *end) {
    (void)std::fclose(out);
    SETERRQ(PETSC_COMM_SELF, PETSC_ERR_FILE_WRITE, "%s has %ld bytes, and not the %ld that this run has written: another run or another output writes into it, too. Give each a file of its own", file.c_str(),
            (long)info.st_size, *end);
  }
  const bool written = std::fwrite(text.data(), 1, text.size(), out) == text.size() && std::fflush(out) == 0;
  const int  why     = errno;
  *end               = std::ftell(out);
  const bool closed  = std::fclose(out) == 0;
  PetscCheck(written && closed, PETSC_COMM_SELF, PETSC_ERR_FILE_WRITE, "writing into %s failed: %s", file.c_str(), std::strerror(written ? errno : why));
  PetscFunctionReturn(0);
}

PetscErrorCode ShortenFile(const std::string &file, long end, bool *there)
{
  struct stat info;
  PetscFunctionBegin;
  *there = stat(file.c_str(), &info) == 0;
  if (!*there || !S_ISREG(info.st_mode)) PetscFunctionReturn(0);
  PetscCheck(info.st_size >= end, PETSC_COMM_SELF, PETSC_ERR_FILE_UNEXPECTED,
             "%s is shorter than when the checkpoint was written, %ld bytes in place of %ld: the run cannot go on in it. Give it another name, or remove it", file.c_str(),
             (long)info.st_size, end);
  PetscCheck(truncate(file.c_str(), end) == 0, PETSC_COMM_SELF, PETSC_ERR_FILE_WRITE, "cannot go on in %s: %s", file.c_str(), std::strerror(errno));
  PetscFunctionReturn(0);
}

PetscErrorCode WriteWhole(const std::string &file, const std::string &text)
{
  const std::string part = file + ".part";
  struct stat       info;
  PetscFunctionBegin;
  /* a file that is not regular, such as /dev/null, is written directly and not replaced */
  const bool special = stat(file.c_str(), &info) == 0 && !S_ISREG(info.st_mode);
  const char *name   = special ? file.c_str() : part.c_str();
  errno     = 0;
  FILE *out = std::fopen(name, "w");
  PetscCheck(out, PETSC_COMM_SELF, PETSC_ERR_FILE_OPEN, "cannot write into %s: %s", file.c_str(), std::strerror(errno));
  const bool written = std::fwrite(text.data(), 1, text.size(), out) == text.size() && std::fflush(out) == 0 && (special || fsync(fileno(out)) == 0);
  int        why     = errno;
  const bool closed  = std::fclose(out) == 0;
  if (written && !closed) why = errno;
  const bool renamed = written && closed && (special || std::rename(name, file.c_str()) == 0);
  if (written && closed && !renamed) why = errno;
  if (!renamed && !special) (void)std::remove(name);
  PetscCheck(renamed, PETSC_COMM_SELF, PETSC_ERR_FILE_WRITE, "writing into %s failed: %s", file.c_str(), std::strerror(why));
  PetscFunctionReturn(0);
}

PetscErrorCode SyncFile(const std::string &file)
{
  struct stat info;
  PetscFunctionBegin;
  const int  f    = open(file.c_str(), O_RDONLY);
  const bool good = f >= 0 && fstat(f, &info) == 0 && (!S_ISREG(info.st_mode) || fsync(f) == 0);
  const int  why  = errno;
  if (f >= 0) close(f);
  PetscCheck(good, PETSC_COMM_SELF, PETSC_ERR_FILE_WRITE, "writing into %s failed: %s", file.c_str(), std::strerror(why));
  PetscFunctionReturn(0);
}

PetscErrorCode AppendCSV(const std::string &file, bool first, const TableHead &head, const Block &block, long *end)
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
  PetscCall(AppendText(file, first, text, end));
  PetscFunctionReturn(0);
}

#if defined(HHTDAE_HDF5)

namespace
{

/* Datasets grow in chunks of this many samples. */
constexpr hsize_t chunk = 256;

/* An HDF5 handle that the destructor closes */
class Handle
{
public:
  Handle(hid_t id, herr_t (*close)(hid_t)) : id_(id), close_(close) {}
  ~Handle() { close(); }
  Handle(const Handle &) = delete;
  operator hid_t() const { return id_; }
  bool good() const { return id_ >= 0; }
  bool close() /* false if it fails; closing a file writes the remaining data */
  {
    const bool closed = id_ < 0 || close_(id_) >= 0;
    id_               = -1;
    return closed;
  }

private:
  hid_t id_;
  herr_t (*close_)(hid_t);
};

/* Creates an empty dataset of unlimited length, and the groups that its name contains */
hid_t CreateDataset(hid_t file, const std::string &name)
{
  const hsize_t none = 0, any = H5S_UNLIMITED;
  const Handle  space(H5Screate_simple(1, &none, &any), H5Sclose), layout(H5Pcreate(H5P_DATASET_CREATE), H5Pclose), link(H5Pcreate(H5P_LINK_CREATE), H5Pclose);
  H5Pset_chunk(layout, 1, &chunk);
  H5Pset_create_intermediate_group(link, 1);
  return H5Dcreate2(file, name.c_str(), H5T_NATIVE_DOUBLE, space, link, layout, H5P_DEFAULT);
}

bool SetUnits(hid_t set, const std::string &unit)
{
  const Handle type(H5Tcopy(H5T_C_S1), H5Tclose), space(H5Screate(H5S_SCALAR), H5Sclose);
  H5Tset_size(type, unit.size() + 1);
  const Handle attribute(H5Acreate2(set, "units", type, space, H5P_DEFAULT, H5P_DEFAULT), H5Aclose);
  return attribute.good() && H5Awrite(attribute, type, unit.c_str()) >= 0;
}

hsize_t Length(hid_t set)
{
  const Handle space(H5Dget_space(set), H5Sclose);
  hsize_t      n = 0;
  if (space.good()) H5Sget_simple_extent_dims(space, &n, nullptr);
  return n;
}

bool Append(hid_t set, const std::vector<double> &values)
{
  const hsize_t more = values.size(), before = Length(set), after = before + more;
  if (H5Dset_extent(set, &after) < 0) return false;
  const Handle space(H5Dget_space(set), H5Sclose), part(H5Screate_simple(1, &more, nullptr), H5Sclose);
  return H5Sselect_hyperslab(space, H5S_SELECT_SET, &before, nullptr, &more, nullptr) >= 0 &&
         H5Dwrite(set, H5T_NATIVE_DOUBLE, part, space, H5P_DEFAULT, values.data()) >= 0;
}

bool AppendDataset(hid_t file, bool first, const std::string &name, const std::string *unit, const std::vector<double> &values)
{
  const Handle set(first ? CreateDataset(file, name) : H5Dopen2(file, name.c_str(), H5P_DEFAULT), H5Dclose);
  return set.good() && (!first || !unit || SetUnits(set, *unit)) && Append(set, values);
}

/* Opens or creates a file without HDF5's own error output; the caller reports an error */
hid_t OpenFile(const std::string &file, bool first)
{
  hid_t id;
  H5E_BEGIN_TRY
  {
    id = first ? H5Fcreate(file.c_str(), H5F_ACC_TRUNC, H5P_DEFAULT, H5P_DEFAULT) : H5Fopen(file.c_str(), H5F_ACC_RDWR, H5P_DEFAULT);
  }
  H5E_END_TRY
  return id;
}

} // namespace

/* The file is open only while a block is written, so that a run that is killed at another time leaves a complete file. */
PetscErrorCode AppendHDF5(const std::string &file, bool first, const TableHead &head, const Block &block)
{
  const std::size_t   channels = head.name.size(), samples = block.time.size();
  std::vector<double> column(samples);
  PetscFunctionBegin;
  Handle out(OpenFile(file, first), H5Fclose);
  PetscCheck(out.good(), PETSC_COMM_SELF, PETSC_ERR_FILE_OPEN, "HDF5 cannot write into %s", file.c_str());
  PetscCheck(AppendDataset(out, first, "/time", nullptr, block.time), PETSC_COMM_SELF, PETSC_ERR_FILE_WRITE, "HDF5 cannot write the times into %s", file.c_str());
  for (std::size_t c = 0; c < channels; c++) {
    for (std::size_t s = 0; s < samples; s++) column[s] = block.values[s * channels + c];
    PetscCheck(AppendDataset(out, first, "/" + head.name[c], &head.unit[c], column), PETSC_COMM_SELF, PETSC_ERR_FILE_WRITE,
               "HDF5 cannot write the dataset %s in %s", head.name[c].c_str(), file.c_str());
  }
  PetscCheck(out.close(), PETSC_COMM_SELF, PETSC_ERR_FILE_WRITE, "HDF5 cannot write into %s: is the disk full?", file.c_str());
  PetscFunctionReturn(0);
}

PetscErrorCode ShortenHDF5(const std::string &file, std::size_t rows, const TableHead &head, bool *there)
{
  const hsize_t            length = rows;
  std::vector<std::string> names{"time"};
  struct stat              info;
  PetscFunctionBegin;
  *there = stat(file.c_str(), &info) == 0;
  if (!*there) PetscFunctionReturn(0);
  Handle in(OpenFile(file, false), H5Fclose);
  PetscCheck(in.good(), PETSC_COMM_SELF, PETSC_ERR_FILE_OPEN, "the run cannot go on in %s: HDF5 cannot open it, maybe the last run was killed while it wrote. Give it another name, or remove it",
             file.c_str());
  names.insert(names.end(), head.name.begin(), head.name.end());
  for (const std::string &name : names) {
    const Handle set(H5Dopen2(in, ("/" + name).c_str(), H5P_DEFAULT), H5Dclose);
    PetscCheck(set.good() && Length(set) >= length, PETSC_COMM_SELF, PETSC_ERR_FILE_UNEXPECTED,
               "the run cannot go on in %s: dataset %s has fewer samples than when the checkpoint was written, %zu. Give it another name, or remove it", file.c_str(),
               name.c_str(), rows);
    PetscCheck(H5Dset_extent(set, &length) >= 0, PETSC_COMM_SELF, PETSC_ERR_FILE_WRITE, "HDF5 cannot shorten the dataset %s in %s", name.c_str(), file.c_str());
  }
  PetscFunctionReturn(0);
}

#else

PetscErrorCode AppendHDF5(const std::string &file, bool, const TableHead &, const Block &)
{
  PetscFunctionBegin;
  SETERRQ(PETSC_COMM_SELF, PETSC_ERR_SUP, "cannot write %s: the library was built without HDF5; -scene_csv writes a table without it", file.c_str());
}

PetscErrorCode ShortenHDF5(const std::string &, std::size_t, const TableHead &, bool *there)
{
  *there = false;
  return 0;
}

#endif

} // namespace hhtdae
