#include "checkpoint_parts.h"
#include "linear/hash.h"
#include <cerrno>
#include <cstdint>
#include <cstdio>
#include <cstring>
#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

namespace hht3
{

namespace
{

/* Header and checksum are in the byte order of the machine. On a machine of the other byte order the checksum does not
   match, so that the file is refused. */
struct Header {
  char         magic[8];
  std::int32_t version, ranks;
};

constexpr char         magic[8] = {'h', 'h', 't', 'd', 'a', 'e', 'c', 'p'};
constexpr std::int32_t version  = 16;

/* Files of versions 1 to 3 began with this number and their version, big-endian */
constexpr unsigned char old_magic[4] = {0x00, 0x12, 0x7b, 0xaa};

constexpr size_t message = 1 << 26; /* largest number of bytes in one message, as MPI counts in int */

/* The file, which rank 0 opens. After an error its functions do nothing, so that the messages between the ranks still
   match. */
struct Stream {
  std::FILE *f = nullptr;
  Hash       sum;
  int        error = 0; /* errno */

  void open(const char *name, const char *mode)
  {
    f = std::fopen(name, mode);
    if (!f) error = errno;
  }
  void write(const void *x, size_t n)
  {
    if (error || !n) return;
    sum.add(x, n);
    if (std::fwrite(x, 1, n, f) != n) error = errno ? errno : EIO;
  }
  void read(void *x, size_t n)
  {
    if (error || !n) return;
    if (std::fread(x, 1, n, f) != n) error = EIO;
    else sum.add(x, n);
  }
  /* Closes the file when all its bytes are on the disk */
  void finish()
  {
    if (f && !error && (std::fflush(f) || fsync(fileno(f)))) error = errno;
    if (f && std::fclose(f) && !error) error = errno;
    f = nullptr;
  }
};

std::string Directory(const std::string &file)
{
  const size_t slash = file.find_last_of('/');
  return slash == std::string::npos ? "." : slash ? file.substr(0, slash) : "/";
}

/* Makes a rename permanent: it is on the disk only when its directory is */
void SyncDirectory(const std::string &file)
{
  const std::string dir = Directory(file);
  const int         d   = open(dir.c_str(), O_RDONLY | O_DIRECTORY);
  if (d < 0) return; /* some file systems do not open directories */
  (void)fsync(d);
  close(d);
}

/* All ranks' bytes, one rank after the other, through a buffer on rank 0 */
PetscErrorCode WriteAll(MPI_Comm comm, const std::vector<std::uint64_t> &sizes, const std::vector<char> &mine, Stream &out)
{
  std::vector<char> buffer;
  PetscMPIInt       rank;

  PetscFunctionBegin;
  PetscCallMPI(MPI_Comm_rank(comm, &rank));
  if (rank) {
    for (size_t at = 0; at < mine.size(); at += message)
      PetscCallMPI(MPI_Send(mine.data() + at, (int)PetscMin(message, mine.size() - at), MPI_CHAR, 0, 0, comm));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  out.write(mine.data(), mine.size());
  for (size_t r = 1; r < sizes.size(); r++)
    for (size_t at = 0; at < sizes[r]; at += message) {
      buffer.resize(PetscMin(message, sizes[r] - at));
      PetscCallMPI(MPI_Recv(buffer.data(), (int)buffer.size(), MPI_CHAR, (int)r, 0, comm, MPI_STATUS_IGNORE));
      out.write(buffer.data(), buffer.size());
    }
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode ReadAll(MPI_Comm comm, const std::vector<std::uint64_t> &sizes, std::vector<char> &mine, Stream &in)
{
  std::vector<char> buffer;
  std::uint64_t     size;
  PetscMPIInt       rank;

  PetscFunctionBegin;
  PetscCallMPI(MPI_Comm_rank(comm, &rank));
  PetscCallMPI(MPI_Scatter(sizes.data(), 1, MPI_UINT64_T, &size, 1, MPI_UINT64_T, 0, comm));
  mine.resize(size);
  if (rank) {
    for (size_t at = 0; at < size; at += message)
      PetscCallMPI(MPI_Recv(mine.data() + at, (int)PetscMin(message, size - at), MPI_CHAR, 0, 0, comm, MPI_STATUS_IGNORE));
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  in.read(mine.data(), size);
  for (size_t r = 1; r < sizes.size(); r++)
    for (size_t at = 0; at < sizes[r]; at += message) {
      buffer.assign(PetscMin(message, sizes[r] - at), 0);
      in.read(buffer.data(), buffer.size());
      PetscCallMPI(MPI_Send(buffer.data(), (int)buffer.size(), MPI_CHAR, (int)r, 0, comm));
    }
  PetscFunctionReturn(PETSC_SUCCESS);
}

/* Rank 0's verdict on a file, before its contents are distributed */
enum Verdict : int { Fine, Unreadable, Foreign, Old, Ranks };

/* Reads the header and the sizes of the ranks' parts. Header and sizes are trusted only if the checksum is right. */
Verdict Examine(const char *name, PetscMPIInt ranks, Header &h, std::vector<std::uint64_t> &sizes)
{
  Stream            in;
  std::uint64_t     sum, total = sizeof(Header) + sizeof(sum);
  std::vector<char> buffer(1 << 16);
  struct stat       info;

  in.open(name, "rb");
  if (!in.f) return Unreadable;
  Verdict verdict = Foreign;
  if (fstat(fileno(in.f), &info) || !S_ISREG(info.st_mode)) info.st_size = 0;
  std::uint64_t left = (std::uint64_t)info.st_size;
  if (left > total) {
    in.read(&h, sizeof h);
    for (left -= total; left && !in.error; left -= PetscMin(left, buffer.size())) in.read(buffer.data(), PetscMin(left, buffer.size()));
    const std::uint64_t right = in.sum.sum;
    in.read(&sum, sizeof sum);
    if (!in.error && sum == right) {
      if (!std::memcmp(h.magic, old_magic, 4)) verdict = Old;
      else if (!std::memcmp(h.magic, magic, 8)) verdict = h.version == version ? Fine : Old;
    }
  }
  if (verdict == Fine && h.ranks != ranks) verdict = Ranks;
  if (verdict == Fine) {
    std::rewind(in.f);
    in.read(&h, sizeof h);
    in.read(sizes.data(), sizes.size() * sizeof(sizes[0]));
    for (const std::uint64_t s : sizes) total += s + sizeof(s);
    if (in.error || total != (std::uint64_t)info.st_size) verdict = Foreign;
  }
  std::fclose(in.f);
  return verdict;
}

} // namespace

PetscErrorCode CheckpointFileWrite(MPI_Comm comm, const std::string &file, const std::vector<char> &mine)
{
  const std::string          part = file + ".part";
  const std::uint64_t        size = mine.size();
  std::vector<std::uint64_t> sizes;
  PetscMPIInt                rank, ranks;
  Stream                     out;
  struct stat                info;

  PetscFunctionBegin;
  PetscCallMPI(MPI_Comm_rank(comm, &rank));
  PetscCallMPI(MPI_Comm_size(comm, &ranks));
  sizes.resize(ranks);
  PetscCallMPI(MPI_Gather(&size, 1, MPI_UINT64_T, sizes.data(), 1, MPI_UINT64_T, 0, comm));
  if (rank == 0) {
    Header h = {};
    std::memcpy(h.magic, magic, sizeof magic);
    h.version = version;
    h.ranks   = (std::int32_t)sizes.size();
    if (!stat(file.c_str(), &info) && !S_ISREG(info.st_mode)) out.error = EINVAL; /* the rename would replace a device */
    else out.open(part.c_str(), "wb");
    out.write(&h, sizeof h);
    out.write(sizes.data(), sizes.size() * sizeof(sizes[0]));
  }
  PetscCall(WriteAll(comm, sizes, mine, out));
  if (rank == 0) {
    const std::uint64_t sum = out.sum.sum;
    out.write(&sum, sizeof sum);
    const bool opened = out.f != nullptr;
    out.finish();
    if (!out.error && std::rename(part.c_str(), file.c_str())) out.error = errno;
    if (!out.error) SyncDirectory(file);
    else if (opened) std::remove(part.c_str());
  }
  PetscCallMPI(MPI_Bcast(&out.error, 1, MPI_INT, 0, comm));
  PetscCheck(!out.error, comm, PETSC_ERR_FILE_WRITE, "Cannot write the checkpoint %s: %s", file.c_str(),
             out.error == EINVAL ? "it exists and is not a regular file" : std::strerror(out.error));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode CheckpointFileCheck(MPI_Comm comm, const std::string &file)
{
  const std::string dir = Directory(file);
  PetscMPIInt       rank;
  int               error = 0;
  struct stat       info;

  PetscFunctionBegin;
  PetscCallMPI(MPI_Comm_rank(comm, &rank));
  if (rank == 0) {
    if (!stat(file.c_str(), &info) && !S_ISREG(info.st_mode)) error = EINVAL;
    else if (stat(dir.c_str(), &info)) error = errno;
    else if (!S_ISDIR(info.st_mode)) error = ENOTDIR;
    else if (access(dir.c_str(), W_OK | X_OK)) error = errno;
  }
  PetscCallMPI(MPI_Bcast(&error, 1, MPI_INT, 0, comm));
  PetscCheck(!error, comm, PETSC_ERR_FILE_OPEN, "No checkpoint can be written to %s (-ts_hhtdae_checkpoint): %s %s", file.c_str(), error == EINVAL ? "it" : ("directory " + dir + ":").c_str(),
             error == EINVAL ? "exists and is not a regular file" : std::strerror(error));
  PetscFunctionReturn(PETSC_SUCCESS);
}

PetscErrorCode CheckpointFileRead(MPI_Comm comm, const std::string &file, std::vector<char> &mine)
{
  std::vector<std::uint64_t> sizes;
  PetscMPIInt                rank, ranks;
  Header                     h = {};
  int                        found[4] = {Fine, 0, 0, 0};
  Stream                     in;

  PetscFunctionBegin;
  PetscCallMPI(MPI_Comm_rank(comm, &rank));
  PetscCallMPI(MPI_Comm_size(comm, &ranks));
  sizes.resize(ranks);
  if (rank == 0) {
    found[0] = Examine(file.c_str(), ranks, h, sizes);
    found[1] = std::memcmp(h.magic, old_magic, 4) ? h.version : h.magic[7];
    found[2] = h.ranks;
  }
  PetscCallMPI(MPI_Bcast(found, 4, MPI_INT, 0, comm));
  PetscCheck(found[0] != Unreadable, comm, PETSC_ERR_FILE_OPEN, "Cannot open the checkpoint %s", file.c_str());
  PetscCheck(found[0] != Foreign, comm, PETSC_ERR_FILE_UNEXPECTED, "%s is not a checkpoint of TSHHT3, or it is damaged or not complete", file.c_str());
  PetscCheck(found[0] != Old, comm, PETSC_ERR_FILE_UNEXPECTED,
             "Checkpoint %s is of version %d, this library reads version %d: go on with the library that wrote it, or start anew", file.c_str(), found[1], (int)version);
  PetscCheck(found[0] != Ranks, comm, PETSC_ERR_FILE_UNEXPECTED, "Checkpoint %s was written on %d ranks, this run has %d: resume on as many ranks", file.c_str(),
             found[2], ranks);
  if (rank == 0) {
    in.open(file.c_str(), "rb");
    if (in.f) std::fseek(in.f, (long)(sizeof(Header) + sizes.size() * sizeof(sizes[0])), SEEK_SET);
  }
  PetscCall(ReadAll(comm, sizes, mine, in));
  if (in.f) std::fclose(in.f);
  PetscCallMPI(MPI_Bcast(&in.error, 1, MPI_INT, 0, comm));
  PetscCheck(!in.error, comm, PETSC_ERR_FILE_READ, "Cannot read the checkpoint %s: %s", file.c_str(), std::strerror(in.error));
  PetscFunctionReturn(PETSC_SUCCESS);
}

} // namespace hht3
