/*
  Checks of a binary matrix file of PETSc that MatLoad() does not make: with a column out of range it writes beyond the ends of
  arrays, or the first product reads there.

  The file contains, big-endian: identifier, rows, columns, entries; entries of each row; columns of all entries, row after row;
  their values. Every rank reads the lengths of all rows, in blocks, and the columns and values of its own rows.
*/
#include "flexible/exchange.h"
#include "flexible/import.h"
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <memory>

namespace hhtdae
{

namespace
{

constexpr std::size_t buffer_entries = 1 << 16; /* entries read at a time */

/* Reads consecutive numbers of a file through a buffer */
template <class T> class Numbers
{
public:
  Numbers(const std::string &file, PetscInt64 offset, PetscDataType type)
      : in_(std::fopen(file.c_str(), "rb"), std::fclose), type_(type)
  {
    good_ = in_ && !std::fseek(in_.get(), (long)offset, SEEK_SET);
  }
  /* false at the end of the file */
  bool next(T *value)
  {
    if (at_ == buffer_.size() && !refill()) return false;
    *value = buffer_[at_++];
    return true;
  }

private:
  bool refill()
  {
    buffer_.resize(buffer_entries);
    buffer_.resize(good_ ? std::fread(buffer_.data(), sizeof(T), buffer_entries, in_.get()) : 0);
    at_ = 0;
#if !defined(PETSC_WORDS_BIGENDIAN)
    good_ = good_ && !PetscByteSwap(buffer_.data(), type_, (PetscInt)buffer_.size());
#endif
    return good_ && !buffer_.empty();
  }

  std::unique_ptr<FILE, int (*)(FILE *)> in_;
  PetscDataType                          type_;
  bool                                   good_;
  std::vector<T>                         buffer_;
  std::size_t                            at_ = 0;
};

/* Lengths of this rank's rows, and the number of entries before them */
std::string ReadLengths(const FeModel &model, const MatrixFile &m, std::vector<PetscInt> *own, PetscInt64 *first)
{
  Numbers<PetscInt> lengths(m.file, 4 + 3 * (PetscInt64)sizeof(PetscInt), PETSC_INT);
  PetscInt64        all = 0;
  for (PetscInt64 row = 0; row < m.rows; row++) {
    PetscInt length;
    if (!lengths.next(&length)) return "it is truncated";
    if (length < 0 || length > m.rows)
      return "row " + std::to_string(row + 1) + " has an impossible number of entries, " + std::to_string(length);
    if (row == 3 * (PetscInt64)model.first) *first = all;
    if (row >= 3 * (PetscInt64)model.first && row < 3 * (PetscInt64)(model.first + model.own)) own->push_back(length);
    all += length;
  }
  return all == m.entries ? ""
                          : "its rows have " + std::to_string(all) + " entries, its head promises " + std::to_string(m.entries);
}

std::string CheckRows(const FeModel &model, const MatrixFile &m)
{
  std::vector<PetscInt> own;
  PetscInt64            first = 0;
  const std::string     error = ReadLengths(model, m, &own, &first);
  if (!error.empty()) return error;
  const PetscInt64     word = sizeof(PetscInt), columns_at = 4 + (3 + m.rows) * word,
                   values_at = columns_at + m.entries * word;
  Numbers<PetscInt>    columns(m.file, columns_at + first * word, PETSC_INT);
  Numbers<PetscScalar> values(m.file, values_at + first * (PetscInt64)sizeof(PetscScalar), PETSC_SCALAR);
  for (std::size_t r = 0; r < own.size(); r++) {
    const auto row    = [&] { return "row " + std::to_string(3 * model.first + (PetscInt)r + 1); };
    PetscInt   before = -1;
    for (PetscInt k = 0; k < own[r]; k++) {
      PetscInt    column;
      PetscScalar value;
      if (!columns.next(&column) || !values.next(&value)) return "it is truncated";
      if (column < 0 || column >= m.rows)
        return row() + " has an entry in column " + std::to_string((PetscInt64)column + 1) + " of " + std::to_string(m.rows);
      if (column <= before) return row() + " has columns that are not ascending";
      if (!std::isfinite(value)) return row() + " has an entry that is not a finite number";
      before = column;
    }
  }
  return "";
}

} // namespace

PetscErrorCode CheckBinary(const FeModel &model, const MatrixFile &matrix)
{
  PetscFunctionBegin;
  std::string error = CheckRows(model, matrix);
  if (!error.empty()) error = "cannot read the matrix " + matrix.file + ": " + error;
  PetscCall(Agree(model.comm, error, PETSC_ERR_FILE_UNEXPECTED));
  PetscFunctionReturn(0);
}

} // namespace hhtdae
