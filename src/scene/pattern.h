/*
  The sparsity pattern by groups of unknowns. The rows of a group (the position of a body, its angles, the rows of a constraint
  kernel's instance) have the same columns, so that a block of the matrix is given by one offset and one stride, and elements add to the
  arrays of the matrix without searching.
*/
#ifndef HHTDAE_SCENE_PATTERN_H
#define HHTDAE_SCENE_PATTERN_H

#include <petscmat.h>
#include <vector>

namespace hhtdae
{

struct Group {
  PetscInt global; /* number of its first unknown */
  PetscInt local;  /* its number among the local unknowns: own, then other ranks' */
  PetscInt size;
  bool     own;
  PetscInt frame = -1; /* local body, if the group is part of the motion of an attachment's frame; its blocks go to projection.h */
  int      at    = 0;  /* first column in the frame's motion */
};

/* Position of a block: entry (r, c) is at base + r stride + c in the array of the diagonal part, or of the off-diagonal part of an MPIAIJ matrix */
struct Slot {
  PetscInt base   = -1; /* -1: the rows belong to another rank */
  PetscInt stride = 0;
  bool     off = false, diagonal = false; /* diagonal: entry (r, r) at base + r stride, no others */
  bool     frame = false;                 /* a block of an attachment's frame, in the array of the projection */

  Slot column(PetscInt c) const { return {base < 0 ? base : base + c, stride, off, diagonal, frame}; }
};

class Pattern
{
public:
  std::vector<Group> group;

  PetscInt addGroup(PetscInt global, PetscInt local, PetscInt size, bool own)
  {
    group.push_back({global, local, size, own});
    return (PetscInt)group.size() - 1;
  }
  PetscInt addFrameGroup(PetscInt frame, int at)
  {
    group.push_back({-1, -1, 3, false, frame, at});
    return (PetscInt)group.size() - 1;
  }
  /* requests a block and returns the number of its slot, which is known after build(). Group -1: no block, adding to its slot does nothing */
  PetscInt need(PetscInt row, PetscInt column, bool diagonal = false)
  {
    request_.push_back({column < 0 ? -1 : row, column, diagonal});
    return (PetscInt)request_.size() - 1;
  }
  /* entries that no element requests are not stored, even on the diagonal: multipliers have none */
  void build(PetscInt start, PetscInt n);
  Slot slot(PetscInt number) const { return slot_[number]; }
  /* calls f(number, row, column) for all requested blocks of attachments' frames; put() sets the slot of such a block, after build() */
  template <class F> void ofFrames(F f) const
  {
    for (std::size_t q = 0; q < request_.size(); q++)
      if (toFrame(request_[q])) f((PetscInt)q, request_[q].row, request_[q].column);
  }
  void put(PetscInt number, const Slot &s) { slot_[number] = s; }
  void release(); /* frees everything but the groups */

  /* rows i of the diagonal part (columns from `start`) and of the off-diagonal part (global columns) */
  std::vector<PetscInt> di, dj, oi, oj;

  /* SEQAIJ or MPIAIJ with this pattern; other types get it through MatConvert by the caller */
  PetscErrorCode createMat(MPI_Comm comm, PetscInt n, Mat *A) const;

private:
  struct Request {
    PetscInt row, column;
    bool     diagonal; /* only entries (r, r), unless another request needs all */
  };
  bool toFrame(const Request &r) const { return r.row >= 0 && (group[r.row].frame >= 0 || group[r.column].frame >= 0); }
  std::vector<Request> request_;
  std::vector<Slot>    slot_;
};

/* Adds blocks to the arrays of a matrix */
struct Sink {
  double *diagonal, *off, *frame = nullptr; /* of the matrix, of the projection */

  /* rows, columns: of the block at (0, 0) of B; blocks of three columns are the common ones */
  template <class Block> void add(const Slot &s, const Block &B, int rows, int columns) const
  {
    if (s.base < 0) return;
    double *p = (s.frame ? frame : s.off ? off : diagonal) + s.base;
    if (s.diagonal) {
      for (int r = 0; r < rows && r < columns; r++, p += s.stride) *p += B(r, r);
    } else if (columns == 3) {
      for (int r = 0; r < rows; r++, p += s.stride)
        for (int c = 0; c < 3; c++) p[c] += B(r, c);
    } else {
      for (int r = 0; r < rows; r++, p += s.stride)
        for (int c = 0; c < columns; c++) p[c] += B(r, c);
    }
  }
};

} // namespace hhtdae

#endif
