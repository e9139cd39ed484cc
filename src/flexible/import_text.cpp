/*
  Reads matrices in text with one entry per line. Every rank reads its own range of the file's bytes, and PETSc sends the entries
  to the owners of their rows: no rank reads more than its share, and the conversion of numbers, which dominates the time, is
  divided among the ranks.
*/
#include "flexible/exchange.h"
#include "flexible/import.h"
#include "flexible/read_text.h"
#include <algorithm>
#include <cctype>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <memory>
#include <sstream>

namespace hhtdae
{

namespace
{

constexpr int64_t binary_id = 1211216; /* PETSc's MAT_FILE_CLASSID */

using File = std::unique_ptr<FILE, int (*)(FILE *)>;

File Open(const std::string &name) { return File(std::fopen(name.c_str(), "rb"), std::fclose); }

int64_t BigEndian(const unsigned char *b, int bytes)
{
  uint64_t v = 0;
  for (int k = 0; k < bytes; k++) v = v << 8 | b[k];
  return bytes == 4 ? (int64_t)(int32_t)(uint32_t)v : (int64_t)v;
}

/* Reads a line, without its line end; false at the end of the file */
bool Line(FILE *in, std::string *line)
{
  int c;
  line->clear();
  while ((c = std::fgetc(in)) != EOF && c != '\n') *line += (char)c;
  return c != EOF || !line->empty();
}

std::string ReadBinaryHead(FILE *in, MatrixFile *m)
{
  const int     word = (int)sizeof(PetscInt);
  unsigned char head[4 + 3 * sizeof(PetscInt)];
  if (std::fread(head, 1, sizeof head, in) != sizeof head) return "it is truncated";
  m->kind            = MatrixFile::Binary;
  m->rows            = BigEndian(head + 4, word);
  m->entries         = BigEndian(head + 4 + 2 * word, word);
  const int64_t cols = BigEndian(head + 4 + word, word);
  if (m->rows < 0 || cols < 0) return "its sizes are not possible (written by a PETSc with other integers?)";
  if (cols != m->rows) return "it has " + std::to_string(m->rows) + " rows and " + std::to_string(cols) + " columns";
  if (m->entries < 0) return "it is stored as a dense matrix, a sparse one is asked for";
  const int64_t most = m->bytes / word; /* bounds rows and entries, so that the sum of their bytes below cannot overflow */
  if (m->rows > most || m->entries > most ||
      m->bytes < (int64_t)sizeof head + word * (m->rows + m->entries) + (int64_t)sizeof(PetscScalar) * m->entries)
    return "it is truncated, or written by a PETSc with other integers or numbers";
  return "";
}

std::string ReadMarketHead(FILE *in, MatrixFile *m)
{
  std::string line, banner, object, format, field, symmetry;
  Line(in, &line);
  for (char &c : line) c = (char)std::tolower((unsigned char)c);
  std::istringstream(line) >> banner >> object >> format >> field >> symmetry;
  if (object != "matrix" || format != "coordinate")
    return "Matrix Market's \"" + object + " " + format + "\" is not a matrix in coordinates";
  if (field != "real" && field != "double" && field != "integer")
    return "Matrix Market's field \"" + field + "\" is not real";
  if (symmetry != "symmetric" && symmetry != "general")
    return "Matrix Market's symmetry \"" + symmetry + "\" is not symmetric or general";
  do {
    if (!Line(in, &line)) return "it ends before the line of sizes";
  } while (line.empty() || line[0] == '%' || line.find_first_not_of(" \t\r") == std::string::npos);
  const std::vector<std::string> sizes = SplitWords(line, false);
  PetscInt64                     size[3];
  bool                           good = sizes.size() == 3;
  for (std::size_t k = 0; k < 3 && good; k++) good = ParseInteger(sizes[k], &size[k]) && size[k] >= 0;
  if (!good) return "its line of sizes is not \"rows columns entries\": " + Quoted(line);
  if (size[0] != size[1])
    return "it has " + std::to_string(size[0]) + " rows and " + std::to_string(size[1]) + " columns";
  m->kind      = MatrixFile::Market;
  m->symmetric = symmetry == "symmetric";
  m->rows      = size[0];
  m->entries   = size[2];
  m->begin     = std::ftell(in);
  return "";
}

std::string ReadHead(MatrixFile *m)
{
  unsigned char     start[14] = {};
  const std::string why       = WhyUnreadable(m->file);
  if (!why.empty()) return why;
  File in = Open(m->file);
  if (!in) return "there is no right to read it";
  if (std::fseek(in.get(), 0, SEEK_END) || (m->bytes = std::ftell(in.get())) < 0) return "it is not a file";
  std::rewind(in.get());
  const std::size_t got = std::fread(start, 1, sizeof start, in.get());
  if (std::ferror(in.get())) return "it is not a file";
  std::rewind(in.get());
  if (!got) return "it is empty";
  if (got >= 4 && BigEndian(start, 4) == binary_id) return ReadBinaryHead(in.get(), m);
  if (got == sizeof start && !std::memcmp(start, "%%MatrixMarket", sizeof start)) return ReadMarketHead(in.get(), m);
  if (std::memchr(start, 0, got)) return "it is neither text nor a matrix of PETSc";
  return "";
}

bool IsSpace(char c) { return std::isspace((unsigned char)c); }

/* The next word of [*at, end), after an optional comma unless it is the first word; *at moves to its end */
const char *Word(const char **at, const char *end, bool first)
{
  while (*at < end && IsSpace(**at)) ++*at;
  if (!first && *at < end && **at == ',') ++*at;
  while (*at < end && IsSpace(**at)) ++*at;
  const char *const word = *at;
  while (*at < end && !IsSpace(**at) && **at != ',') ++*at;
  return word;
}

/* Parses lines, collects their entries, and keeps the first error */
struct EntryCollector {
  const MatrixShape &shape;
  Triplets          *to;
  std::string        error;
  int                lower = 0, upper = 0;

  void take(const char *line, const char *end)
  {
    while (line < end && IsSpace(*line)) line++;
    if (line == end || *line == '%' || *line == '#' || *line == '*' || !error.empty()) return;
    PetscInt64  number[2] = {0, 0};
    double      value     = 0;
    bool        good      = true;
    const char *at        = line;
    for (int k = 0; k < 2; k++) {
      const char *const word = Word(&at, end, k == 0);
      good                   = good && ParseInteger(word, at, &number[k]);
    }
    const char *const word = Word(&at, end, false);
    good                   = good && ParseReal(word, at, &value);
    while (at < end && IsSpace(*at)) at++;
    if (!good || at < end) return fail("is not \"row column value\", or its value is not a finite number", line, end);
    const PetscInt64 rows = shape.rows < 0 ? (PetscInt64)PETSC_MAX_INT : (PetscInt64)shape.rows;
    if (number[0] < 1 || number[1] < 1 || number[0] > rows || number[1] > rows)
      return fail("has a row or column that is not among 1 .. " + std::to_string(rows), line, end);
    add((PetscInt)(number[0] - 1), (PetscInt)(number[1] - 1), value);
  }

private:
  void add(PetscInt i, PetscInt j, double value)
  {
    to->entries++;
    to->largest = std::max({to->largest, i, j});
    if (value == 0.0) return; /* CalculiX also writes the zeros of the pattern */
    (i > j ? lower : upper) |= i != j;
    if (shape.row) {
      i = (*shape.row)[(std::size_t)i];
      j = (*shape.row)[(std::size_t)j];
    }
    to->i.push_back(i);
    to->j.push_back(j);
    to->value.push_back(value);
  }

  void fail(const std::string &why, const char *line, const char *end)
  {
    error = "the line " + Quoted(std::string(line, end)) + " " + why;
  }
};

/* Parses the lines that begin in bytes [begin, end) of the file */
std::string ReadLines(const std::string &name, PetscInt64 begin, PetscInt64 end, bool first, EntryCollector *to)
{
  File              in = Open(name);
  std::vector<char> buffer(1 << 22);
  std::string       carry;
  bool              inside = first; /* false until the end of the line that the rank before reads */
  PetscInt64        at     = first ? begin : begin - 1;
  if (begin >= end) return "";
  if (!in || std::fseek(in.get(), (long)at, SEEK_SET)) return "this rank cannot open it";
  while (to->error.empty()) {
    const std::size_t got = std::fread(buffer.data(), 1, buffer.size(), in.get());
    const char       *p = buffer.data(), *stop = p + got;
    if (!got) break;
    for (const char *newline; p < stop && (newline = (const char *)std::memchr(p, '\n', (std::size_t)(stop - p)));
         p = newline + 1) {
      if (inside) {
        carry.append(p, newline);
        to->take(carry.data(), carry.data() + carry.size());
      }
      carry.clear();
      inside = true;
      if (at + (newline + 1 - buffer.data()) >= end) return to->error;
    }
    if (inside) carry.append(p, stop);
    at += (PetscInt64)got;
  }
  if (std::ferror(in.get())) return "reading it failed";
  if (inside && to->error.empty()) to->take(carry.data(), carry.data() + carry.size());
  return to->error;
}

/* Adds the transposed off-diagonal entries */
void Mirror(Triplets *t)
{
  const std::size_t n = t->i.size();
  for (std::size_t k = 0; k < n; k++) {
    if (t->i[k] == t->j[k]) continue;
    t->i.push_back(t->j[k]);
    t->j.push_back(t->i[k]);
    t->value.push_back(t->value[k]);
  }
}

} // namespace

PetscErrorCode OpenMatrix(MPI_Comm comm, const std::string &file, MatrixFile *matrix)
{
  PetscMPIInt rank;
  std::string error;
  PetscFunctionBegin;
  PetscCallMPI(MPI_Comm_rank(comm, &rank));
  matrix->file = file;
  if (!rank) {
    error = ReadHead(matrix);
    if (error.empty() && matrix->rows > PETSC_MAX_INT) error = "it has more rows than this build of PETSc can count";
    if (!error.empty()) error = "cannot read the matrix " + file + ": " + error;
  }
  PetscCall(Agree(comm, error, PETSC_ERR_FILE_UNEXPECTED));
  PetscInt64 all[6] = {matrix->kind, matrix->symmetric, matrix->rows, matrix->entries, matrix->begin, matrix->bytes};
  PetscCallMPI(MPI_Bcast(all, 6, MPIU_INT64, 0, comm));
  matrix->kind      = (MatrixFile::Kind)all[0];
  matrix->symmetric = all[1];
  matrix->rows      = all[2];
  matrix->entries   = all[3];
  matrix->begin     = all[4];
  matrix->bytes     = all[5];
  PetscFunctionReturn(0);
}

PetscErrorCode ReadTriplets(MPI_Comm comm, const MatrixFile &m, const MatrixShape &shape, Triplets *triplets)
{
  MatrixShape known = shape;
  PetscMPIInt rank, size;
  PetscInt64  count;
  std::string error;
  PetscFunctionBegin;
  PetscCallMPI(MPI_Comm_rank(comm, &rank));
  PetscCallMPI(MPI_Comm_size(comm, &size));
  if (known.rows < 0) known.rows = (PetscInt)m.rows;
  EntryCollector   to{known, triplets, "", 0, 0};
  const PetscInt64 begin = m.begin + PartBegin(m.bytes - m.begin, size, rank),
                   end   = m.begin + PartBegin(m.bytes - m.begin, size, rank + 1);
  error                  = ReadLines(m.file, begin, end, rank == 0, &to);
  if (!error.empty()) error = "cannot read the matrix " + m.file + ": " + error;
  PetscCall(Agree(comm, error, PETSC_ERR_FILE_UNEXPECTED));
  PetscCallMPI(MPI_Allreduce(&triplets->entries, &count, 1, MPIU_INT64, MPI_SUM, comm));
  PetscCheck(m.kind != MatrixFile::Market || count == m.entries, comm, PETSC_ERR_FILE_UNEXPECTED,
             "cannot read the matrix %s: it has %lld entries, its head promises %lld (truncated?)", m.file.c_str(),
             (long long)count, (long long)m.entries);
  PetscCheck(count, comm, PETSC_ERR_FILE_UNEXPECTED, "cannot read the matrix %s: there are no entries", m.file.c_str());
  int      triangle[2] = {to.lower, to.upper};
  PetscInt largest     = triplets->largest;
  triplets->entries    = count;
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, triangle, 2, MPI_INT, MPI_MAX, comm));
  PetscCallMPI(MPI_Allreduce(&largest, &triplets->largest, 1, MPIU_INT, MPI_MAX, comm));
  const bool both = triangle[0] && triangle[1];
  PetscCheck(!m.symmetric || !both, comm, PETSC_ERR_FILE_UNEXPECTED,
             "cannot read the matrix %s: it is said to be symmetric, but has entries in both triangles",
             m.file.c_str());
  PetscCheck(m.kind != MatrixFile::Market || m.symmetric || triangle[0] == triangle[1], comm, PETSC_ERR_FILE_UNEXPECTED,
             "cannot read the matrix %s: it is not symmetric: its head calls it general, and it has entries in one triangle alone; say symmetric there, or give both",
             m.file.c_str());
  if (!both && m.kind == MatrixFile::Text) Mirror(triplets);
  if (m.symmetric) Mirror(triplets);
  PetscFunctionReturn(0);
}

/* Number of off-diagonal entries of all ranks; *twice: some diagonal entry was given more than once, Assemble() having added one zero to each row */
static PetscErrorCode CountEntries(const FeModel &model, const Triplets &t, PetscInt64 *off, PetscBool *twice)
{
  Vec        count;
  PetscReal  most;
  PetscInt64 mine = 0;
  PetscFunctionBegin;
  PetscCall(VecCreateMPI(model.comm, 3 * model.own, 3 * model.nodes, &count));
  for (std::size_t k = 0; k < t.i.size(); k++)
    if (t.i[k] != t.j[k])
      mine++;
    else
      PetscCall(VecSetValue(count, t.i[k], 1, ADD_VALUES));
  PetscCall(VecAssemblyBegin(count));
  PetscCall(VecAssemblyEnd(count));
  PetscCall(VecMax(count, nullptr, &most));
  PetscCall(VecDestroy(&count));
  PetscCallMPI(MPI_Allreduce(&mine, off, 1, MPIU_INT64, MPI_SUM, model.comm));
  *twice = (PetscBool)(most > 2.5);
  PetscFunctionReturn(0);
}

PetscErrorCode Assemble(const FeModel &model, const std::string &name, Triplets *t, Mat *A)
{
  PetscInt64 off;
  PetscBool  twice;
  MatInfo    info;
  PetscFunctionBegin;
  for (PetscInt row = 3 * model.first; row < 3 * (model.first + model.own);
       row++) { /* solvers need all diagonal entries in the pattern */
    t->i.push_back(row);
    t->j.push_back(row);
    t->value.push_back(0);
  }
  PetscCall(MatCreate(model.comm, A));
  PetscCall(PetscObjectSetName((PetscObject)*A, name.c_str()));
  PetscCall(MatSetSizes(*A, 3 * model.own, 3 * model.own, 3 * model.nodes, 3 * model.nodes));
  PetscCall(MatSetBlockSize(*A, 3));
  PetscCall(MatSetType(*A, MATAIJ));
  PetscCall(CountEntries(model, *t, &off, &twice)); /* before MatSetPreallocationCOO(), which may change the index arrays */
  PetscCall(MatSetPreallocationCOO(*A, (PetscInt)t->i.size(), t->i.data(), t->j.data()));
  PetscCall(MatGetInfo(*A, MAT_GLOBAL_SUM, &info));
  /* PETSc would add up repeated entries */
  PetscCheck(!twice && info.nz_used == (double)(off + 3 * (PetscInt64)model.nodes), model.comm,
             PETSC_ERR_FILE_UNEXPECTED, "cannot read the matrix %s: an entry stands in it twice", name.c_str());
  PetscCall(MatSetValuesCOO(*A, t->value.data(), INSERT_VALUES));
  PetscCall(MatSetOption(*A, MAT_SYMMETRIC, PETSC_TRUE));
  *t = Triplets();
  PetscFunctionReturn(0);
}

PetscErrorCode CheckSymmetric(MPI_Comm comm, const std::string &name, Mat A)
{
  Mat       T;
  PetscReal size, difference;
  PetscFunctionBegin;
  PetscCall(MatNorm(A, NORM_FROBENIUS, &size));
  PetscCall(MatTranspose(A, MAT_INITIAL_MATRIX, &T));
  PetscCall(MatAXPY(T, -1, A, DIFFERENT_NONZERO_PATTERN));
  PetscCall(MatNorm(T, NORM_FROBENIUS, &difference));
  PetscCall(MatDestroy(&T));
  PetscCheck(std::isfinite(size), comm, PETSC_ERR_FP, "the matrix %s has entries that are not finite numbers",
             name.c_str());
  PetscCheck(difference <= 1e-8 * size, comm, PETSC_ERR_ARG_WRONG,
             "the matrix %s is not symmetric: |A - A^T| = %g |A| (both triangles are needed; one alone does in text without a head and in Matrix Market files that say symmetric)",
             name.c_str(), (double)(difference / size));
  PetscFunctionReturn(0);
}

} // namespace hhtdae
