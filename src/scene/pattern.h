/*
  The sparsity pattern in groups of unknowns. The rows of a group (the position of a body, its angles, the rows of an instance of a constraint
  kernel) have nonzeros in the same columns. So one offset and one stride locate a block in the arrays of the matrix, and elements add to these
  arrays without searching.
*/
#ifndef HHTDAE_SCENE_PATTERN_H
#define HHTDAE_SCENE_PATTERN_H

#include <petscmat.h>
#include <vector>

namespace hhtdae
{

struct Group {
  PetscInt global; /* global number of the first unknown */
  PetscInt local;  /* number of the first unknown among the local ones: own, then other ranks' */
  PetscInt size;
  bool     own;
  PetscInt frame = -1; /* local number of the frame, if the group is part of the motion of an attachment's frame; projection.h handles its blocks */
  int      at    = 0;  /* first column in the frame's motion (x, theta, v, w, a, alpha) */
};

/* Position of a block: entry (r, c) is at base + r stride + c in the array of the diagonal part or, if `off`, of the
   off-diagonal part of an MPIAIJ matrix */
struct Slot {
  PetscInt base   = -1; /* -1: the rows belong to another rank */
  PetscInt stride = 0;
  bool     off = false, diagonal = false; /* diagonal: only entries (r, r) are stored, at base + r stride */
  bool     frame = false;                 /* the block belongs to an attachment's frame and is in the array of the projection */

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
  /* Requests a block and returns the number of its slot; slot() returns the slot after build(). With column = -1 there is
     no block, and adding to the slot does nothing */
  PetscInt need(PetscInt row, PetscInt column, bool diagonal = false)
  {
    request_.push_back({column < 0 ? -1 : row, column, diagonal});
    return (PetscInt)request_.size() - 1;
  }
  /* Entries that no element requests are not stored. Rows of multipliers have no entry on the diagonal. */
  void build(PetscInt start, PetscInt n);
  Slot slot(PetscInt number) const { return slot_[number]; }
  /* Calls f(number, row, column) for all requested blocks of attachments' frames; put() sets the slot of such a block, after build() */
  template <class F> void ofFrames(F f) const
  {
    for (std::size_t q = 0; q < request_.size(); q++)
      if (toFrame(request_[q])) f((PetscInt)q, request_[q].row, request_[q].column);
  }
  void put(PetscInt number, const Slot &s) { slot_[number] = s; }
  void release(); /* frees everything but the groups */

  /* CSR arrays of the diagonal part (columns relative to `start`) and of the off-diagonal part (global columns) */
  std::vector<PetscInt> di, dj, oi, oj;

  /* Creates a SEQAIJ or MPIAIJ matrix with this pattern; for other types the caller converts it with MatConvert() */
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
  double *diagonal, *off, *frame = nullptr; /* arrays of the diagonal and off-diagonal part of the matrix, and of the projection */

  /* Adds the leading rows x columns entries of B. Most blocks have three columns: these have a loop of fixed length */
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
