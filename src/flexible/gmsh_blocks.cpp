/*
  Finds the sections of a Gmsh file, and the blocks of nodes and elements in them.

  In a text file the lines are indexed first: each rank counts the line ends in its share of chunks of 64 KiB,
  so that any line can be found afterwards by scanning one chunk. The positions of blocks of nodes and elements then follow from their
  headers.
*/
#include "flexible/exchange.h"
#include "flexible/gmsh_file.h"

namespace hhtdae
{

namespace gmsh
{

/* ---- lines ---- */

PetscErrorCode GmshFile::indexLines()
{
  const Size chunks = (file_.size + chunk - 1) / chunk, from = chunks * rank_ / size_,
             to = chunks * (rank_ + 1) / size_;
  std::vector<PetscInt> mine(to - from), all;
  std::vector<Size>     marks, all_marks;
  PetscFunctionBegin;
  for (Size c = from; c < to; c++) {
    const char *a = file_.begin + c * chunk, *b = std::min(end_, a + chunk);
    mine[c - from] = (PetscInt)std::count(a, b, '\n');
    for (const char *p = a; p < b && (p = static_cast<const char *>(std::memchr(p, '$', b - p))); p++)
      if (p == file_.begin || p[-1] == '\n') marks.push_back(p - file_.begin);
  }
  PetscCall(GatherAll(comm_, mine, &all));
  PetscCall(GatherAll(comm_, marks, &all_marks));
  lines_.assign(chunks + 1, 0);
  for (Size c = 0; c < chunks; c++) lines_[c + 1] = lines_[c] + all[c];
  for (Size m : all_marks) {
    const char *p = file_.begin + m;
    section_.emplace(lineAt(p), nextLine(p) - file_.begin);
  }
  PetscFunctionReturn(0);
}

const char *GmshFile::line(Size k) const
{
  if (k == 0) return file_.begin;
  if (k > lines_.back()) Fail("it ends too early");
  const Size  c = std::lower_bound(lines_.begin(), lines_.end(), k) - lines_.begin() - 1;
  const char *p = file_.begin + c * chunk;
  for (Size left = k - lines_[c]; left; left--) p = nextLine(p);
  return p;
}

Size GmshFile::lineOf(Size offset) const
{
  const Size c = offset / chunk;
  return lines_[c] + std::count(file_.begin + c * chunk, file_.begin + offset, '\n');
}

/* ---- sections of binary files: a '$' may be data, so that sections with binary data are traversed ---- */

void GmshFile::findSections()
{
  const char *p = file_.begin;
  while (p < end_) {
    while (p < end_ && *p != '$') p++; /* line ends, or the binary number of $MeshFormat */
    if (p >= end_) return;
    const std::string name = lineAt(p), stop = "$End" + name.substr(1);
    p = nextLine(p);
    section_.emplace(name, p - file_.begin);
    if (name == "$Nodes") p = walkNodes(p);
    if (name == "$Elements") p = walkElements(p);
    const void *e = memmem(p, end_ - p, stop.data(), stop.size());
    if (!e) Fail("%s has no end: the file is cut off", name.c_str());
    p = nextLine(static_cast<const char *>(e));
  }
}

const char *GmshFile::walkNodes(const char *p)
{
  if (!msh4_) {
    Words words(p, end_);
    Block block;
    block.count = words.integer();
    block.place = nextLine(words.at()) - file_.begin;
    nodes_.push_back(block);
    Bytes bytes(file_.begin + block.place, end_);
    bytes.skip(NonNegative(block.count), 28);
    return bytes.at();
  }
  Bytes          bytes(p, end_);
  const PetscInt count = bytes.integer8();
  bytes.skip(3, 8);
  for (PetscInt b = 0; b < count; b++) {
    Block block;
    block.dim            = bytes.small();
    block.entity         = bytes.small();
    const int parametric = bytes.get<int>();
    if (block.dim < 0 || block.dim > 3) Fail("$Nodes is damaged");
    block.extra = parametric ? block.dim : 0;
    block.count = bytes.integer8();
    block.place = bytes.at() - file_.begin;
    bytes.skip(block.count, 8 + 8 * (3 + (Size)block.extra));
    nodes_.push_back(block);
  }
  return bytes.at();
}

const char *GmshFile::walkElements(const char *p)
{
  if (msh4_) {
    Bytes          bytes(p, end_);
    const PetscInt count = bytes.integer8();
    bytes.skip(3, 8);
    for (PetscInt b = 0; b < count; b++) {
      Block block;
      block.dim    = bytes.small();
      block.entity = bytes.small();
      block.type   = bytes.small();
      block.count  = bytes.integer8();
      block.place  = bytes.at() - file_.begin;
      bytes.skip(block.count, 8 * (1 + KindOfType(block.type).nodes));
      elements_.push_back(block);
    }
    return bytes.at();
  }
  Words    words(p, end_);
  PetscInt left = words.integer();
  Bytes    bytes(nextLine(words.at()), end_);
  while (left > 0) {
    Block block;
    block.type  = bytes.get<int>();
    block.count = bytes.get<int>();
    block.extra = bytes.get<int>();
    block.place = bytes.at() - file_.begin;
    if (block.count < 1 || block.extra < 0) Fail("$Elements is damaged");
    bytes.skip(block.count, 4 * (1 + (Size)block.extra + KindOfType(block.type).nodes));
    elements_.push_back(block);
    left -= block.count;
  }
  return bytes.at();
}

/* ---- blocks ---- */

void GmshFile::blocks()
{
  for (const char *name : {"$Nodes", "$Elements"})
    if (!section_.count(name)) Fail("there is no section %s", name);
  if (!binary_) {
    textBlocks("$Nodes", nodes_, true);
    textBlocks("$Elements", elements_, false);
  }
  /* all ranks create regions in the same order */
  if (msh4_)
    for (const Block &b : elements_) regionOf(b.dim, b.entity);
}

void GmshFile::textBlocks(const char *name, std::vector<Block> &list, bool nodes)
{
  Size  at = lineOf(section_[name]);
  Words words(line(at), end_);
  Block block;
  block.count = words.integer();
  block.place = at + 1;
  if (!msh4_) {
    at = block.place + NonNegative(block.count);
    list.push_back(block);
  } else {
    const PetscInt count = block.count;
    at++;
    for (PetscInt b = 0; b < count; b++) {
      Words header(line(at), end_);
      block.dim    = header.small();
      block.entity = header.small();
      block.type   = header.small();
      block.count  = header.integer();
      block.place  = at + 1;
      at += 1 + NonNegative(block.count) * (nodes ? 2 : 1);
      list.push_back(block);
    }
  }
  if (lineAt(line(at)) != "$End" + std::string(name + 1))
    Fail("%s is not laid out as Gmsh writes it, one node or element to a line, or it is damaged: line %zu should be "
         "$End%s",
         name, at + 1, name + 1);
}

} // namespace gmsh

} // namespace hhtdae
