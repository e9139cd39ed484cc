/*
  Reads Gmsh files in parallel: every rank maps the file and parses its own share of nodes and elements.

  PETSc's own reader keeps the whole mesh on the first rank, drops the numbers of nodes, and hands over the middle nodes
  as coordinates of cells only; that is why the file is read here.

  In a text file the lines have to be found first: each rank counts the ends of lines in its share of blocks of 64 KiB,
  so that any line can be found afterwards by reading one block. Blocks of nodes and elements then follow from their
  headers alone.
*/
#include "flexible/mesh_file.h"
#include "flexible/exchange.h"
#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstdarg>
#include <cstring>
#include <fcntl.h>
#include <limits>
#include <map>
#include <set>
#include <stdexcept>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

namespace hhtdae
{

namespace
{

using Size = std::size_t;

[[noreturn]] void Fail(const char *format, ...) __attribute__((format(printf, 1, 2)));
void              Fail(const char *format, ...)
{
  char    text[1024];
  va_list arguments;
  va_start(arguments, format);
  std::vsnprintf(text, sizeof text, format, arguments);
  va_end(arguments);
  throw std::runtime_error(text);
}

/* What a rank does by itself; its failure becomes everyone's */
template <class F> PetscErrorCode Attempt(MPI_Comm comm, const std::string &file, F &&f)
{
  std::string problem;
  PetscFunctionBegin;
  try {
    f();
  } catch (const std::exception &e) {
    problem = "mesh " + file + ": " + e.what();
  }
  PetscCall(Agree(comm, problem));
  PetscFunctionReturn(0);
}

class Mapping
{
public:
  const char *begin = nullptr;
  Size        size  = 0;

  Mapping()                = default;
  Mapping(const Mapping &) = delete;
  ~Mapping()
  {
    if (begin) munmap(const_cast<char *>(begin), size);
  }
  void open(const std::string &file)
  {
    const int   handle = ::open(file.c_str(), O_RDONLY);
    struct stat about;
    if (handle < 0) Fail("there is no such file, or it cannot be read (%s)", std::strerror(errno));
    if (fstat(handle, &about) || !S_ISREG(about.st_mode) || about.st_size == 0) {
      close(handle);
      Fail("it is empty or no plain file");
    }
    size            = (Size)about.st_size;
    void *const map = mmap(nullptr, size, PROT_READ, MAP_PRIVATE, handle, 0);
    close(handle);
    if (map == MAP_FAILED) Fail("it cannot be mapped into memory (%s)", std::strerror(errno));
    begin = static_cast<const char *>(map);
  }
};

/* ---- text ---- */

class Words
{
public:
  Words(const char *at, const char *end) : at_(at), end_(end) {}
  const char *at() const { return at_; }

  PetscInt integer()
  {
    long long  value = 0;
    const auto r     = std::from_chars(skip(), end_, value);
    if (r.ec != std::errc() || (r.ptr < end_ && !std::isspace((unsigned char)*r.ptr)))
      Fail("an integer is expected at '%s'", here().c_str());
    if (value > std::numeric_limits<PetscInt>::max() || value < std::numeric_limits<PetscInt>::min())
      Fail("the number %lld does not fit PetscInt; configure PETSc with 64-bit indices", value);
    at_ = r.ptr;
    return (PetscInt)value;
  }
  double real()
  {
    double value = 0;
    auto   r     = std::from_chars(skip(), end_, value);
    if (r.ec == std::errc::result_out_of_range)
      value = 0; /* too small for a double, or too large */
    else if (r.ec != std::errc() || !std::isfinite(value))
      Fail("a finite number is expected at '%s'", here().c_str());
    at_ = r.ptr;
    return value;
  }
  std::string quoted()
  {
    const char *a = static_cast<const char *>(std::memchr(at_, '"', end_ - at_));
    const char *b = a ? static_cast<const char *>(std::memchr(a + 1, '"', end_ - a - 1)) : nullptr;
    if (!b) Fail("a name in quotes is expected at '%s'", here().c_str());
    at_ = b + 1;
    return std::string(a + 1, b);
  }
  std::string here() const
  {
    std::string s(at_, std::min(end_, at_ + 40));
    return s.substr(0, s.find('\n'));
  }

private:
  const char *at_, *end_;
  const char *skip()
  {
    while (at_ < end_ && std::isspace((unsigned char)*at_)) at_++;
    if (at_ < end_ && *at_ == '+') at_++;
    return at_;
  }
};

/* ---- binary ---- */

class Bytes
{
public:
  Bytes(const char *at, const char *end) : at_(at), end_(end) {}
  const char *at() const { return at_; }
  void        skip(Size count, Size each)
  {
    if (each && count > (Size)(end_ - at_) / each) Fail("it ends too early");
    at_ += count * each;
  }
  template <class T> T get()
  {
    const char *from = at_;
    T           value;
    skip(1, sizeof(T));
    std::memcpy(&value, from, sizeof(T));
    return value;
  }
  PetscInt integer8()
  {
    const unsigned long long v = get<unsigned long long>();
    if (v > (unsigned long long)std::numeric_limits<PetscInt>::max())
      Fail("the number %llu does not fit PetscInt; configure PETSc with 64-bit indices", v);
    return (PetscInt)v;
  }

private:
  const char *at_, *end_;
};

/* ---- Gmsh's elements ---- */

struct Kind {
  int dim, nodes;
};

Kind KindOfType(int type)
{
  static const std::map<int, Kind> kinds = {
      {1, {1, 2}},   {2, {2, 3}},   {3, {2, 4}},   {4, {3, 4}},   {5, {3, 8}},   {6, {3, 6}},   {7, {3, 5}},
      {8, {1, 3}},   {9, {2, 6}},   {10, {2, 9}},  {11, {3, 10}}, {12, {3, 27}}, {13, {3, 18}}, {14, {3, 14}},
      {15, {0, 1}},  {16, {2, 8}},  {17, {3, 20}}, {18, {3, 15}}, {19, {3, 13}}, {20, {2, 9}},  {21, {2, 10}},
      {22, {2, 12}}, {23, {2, 15}}, {24, {2, 15}}, {25, {2, 21}}, {26, {1, 4}},  {27, {1, 5}},  {28, {1, 6}},
      {29, {3, 20}}, {30, {3, 35}}, {31, {3, 56}}, {92, {3, 64}}, {93, {3, 125}}};
  const auto found = kinds.find(type);
  if (found == kinds.end()) Fail("element type %d of Gmsh is unknown here", type);
  return found->second;
}

ElementType TypeOf(int type, PetscInt element)
{
  switch (type) {
  case 4:
    return ElementType::Tetrahedron4;
  case 11:
    return ElementType::Tetrahedron10;
  case 5:
    return ElementType::Brick8;
  case 17:
    return ElementType::Brick20;
  }
  static const std::map<int, const char *> names = {{6, "prism"},   {18, "prism"},   {13, "prism"},
                                                    {7, "pyramid"}, {14, "pyramid"}, {19, "pyramid"}};
  const auto                               name  = names.find(type);
  Fail("element %lld is a %s with %d nodes (type %d of Gmsh); there are tetrahedra with 4 or 10 nodes and bricks with "
       "8 or 20%s",
       (long long)element, name == names.end() ? "solid" : name->second, KindOfType(type).nodes, type,
       type == 12 ? ": let Gmsh make them with Mesh.SecondOrderIncomplete = 1" : "");
}

/* ---- the file ---- */

/* Nodes or elements that follow one header */
struct Block {
  int dim = 0, entity = 0, type = 0, extra = 0; /* extra: parametric coordinates of nodes, tags of elements of msh 2 */
  PetscInt count = 0;
  Size     place = 0; /* line or offset of the first */
};

class GmshFile
{
public:
  GmshFile(MPI_Comm comm, const std::string &name, MeshFile &mesh) : comm_(comm), name_(name), mesh_(mesh)
  {
    MPI_Comm_rank(comm, &rank_);
    MPI_Comm_size(comm, &size_);
  }

  PetscErrorCode read()
  {
    PetscFunctionBegin;
    PetscCall(Attempt(comm_, name_, [&] {
      file_.open(name_);
      end_ = file_.begin + file_.size;
      header();
    }));
    if (!binary_) PetscCall(indexLines());
    PetscCall(Attempt(comm_, name_, [&] {
      if (binary_) findSections();
      physicalNames();
      entities();
      blocks();
      share();
    }));
    if (!four_) PetscCall(regionsOfGroups());
    std::sort(mesh_.members.begin(), mesh_.members.end());
    mesh_.members.erase(std::unique(mesh_.members.begin(), mesh_.members.end()), mesh_.members.end());
    PetscFunctionReturn(0);
  }

private:
  static constexpr Size chunk = 1 << 16;

  MPI_Comm                           comm_;
  std::string                        name_;
  MeshFile                          &mesh_;
  PetscMPIInt                        rank_, size_;
  Mapping                            file_;
  const char                        *end_    = nullptr;
  bool                               binary_ = false, four_ = false;
  std::vector<Size>                  lines_;   /* ends of lines before each chunk */
  std::map<std::string, Size>        section_; /* offset of its first byte, after the line with the name */
  std::vector<Block>                 nodes_, elements_;
  std::map<std::pair<int, int>, int> group_, region_; /* by dimension and tag */

  const char *nextLine(const char *p) const
  {
    const char *e = static_cast<const char *>(std::memchr(p, '\n', end_ - p));
    return e ? e + 1 : end_;
  }
  std::string lineAt(const char *p) const
  {
    std::string s(p, nextLine(p));
    while (!s.empty() && std::isspace((unsigned char)s.back())) s.pop_back();
    return s;
  }

  void header()
  {
    const char *p = file_.begin;
    if (lineAt(p).compare(0, 11, "$MeshFormat")) Fail("it does not begin with $MeshFormat: it is no mesh of Gmsh");
    Words          words(nextLine(p), end_);
    const double   version = words.real();
    const PetscInt kind = words.integer(), size = words.integer();
    if (std::abs(version - 4.1) > 1e-6 && std::abs(version - 2.2) > 1e-6)
      Fail("its format is %g; 4.1 and 2.2 are read (gmsh -format msh41)", version);
    four_   = version > 4;
    binary_ = kind == 1;
    if (size != 8) Fail("its size of data is %d, not 8", (int)size);
    if (!binary_) return;
    Bytes bytes(nextLine(words.at()), end_);
    if (bytes.get<int>() != 1) Fail("it was written on a machine with the other order of bytes");
  }

  /* -- lines -- */

  PetscErrorCode indexLines()
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
  const char *line(Size k) const
  {
    if (k == 0) return file_.begin;
    if (k > lines_.back()) Fail("it ends too early");
    const Size  c = std::lower_bound(lines_.begin(), lines_.end(), k) - lines_.begin() - 1;
    const char *p = file_.begin + c * chunk;
    for (Size left = k - lines_[c]; left; left--) p = nextLine(p);
    return p;
  }
  Size lineOf(Size offset) const
  {
    const Size c = offset / chunk;
    return lines_[c] + std::count(file_.begin + c * chunk, file_.begin + offset, '\n');
  }

  /* -- sections of binary files: '$' may be anything, so that those with data are walked through -- */

  void findSections()
  {
    const char *p = file_.begin;
    while (p < end_) {
      while (p < end_ && *p != '$') p++; /* the end of a line, or the one of $MeshFormat */
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
  const char *walkNodes(const char *p)
  {
    if (!four_) {
      Words words(p, end_);
      Block block;
      block.count = words.integer();
      block.place = nextLine(words.at()) - file_.begin;
      nodes_.push_back(block);
      Bytes bytes(file_.begin + block.place, end_);
      bytes.skip(checked(block.count), 28);
      return bytes.at();
    }
    Bytes          bytes(p, end_);
    const PetscInt count = bytes.integer8();
    bytes.skip(3, 8);
    for (PetscInt b = 0; b < count; b++) {
      Block block;
      block.dim            = bytes.get<int>();
      block.entity         = bytes.get<int>();
      const int parametric = bytes.get<int>();
      if (block.dim < 0 || block.dim > 3) Fail("$Nodes is damaged");
      block.extra = parametric ? block.dim : 0;
      block.count = bytes.integer8();
      block.place = bytes.at() - file_.begin;
      bytes.skip(block.count, 8 + 8 * (3 + block.extra));
      nodes_.push_back(block);
    }
    return bytes.at();
  }
  const char *walkElements(const char *p)
  {
    if (four_) {
      Bytes          bytes(p, end_);
      const PetscInt count = bytes.integer8();
      bytes.skip(3, 8);
      for (PetscInt b = 0; b < count; b++) {
        Block block;
        block.dim    = bytes.get<int>();
        block.entity = bytes.get<int>();
        block.type   = bytes.get<int>();
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
  static Size checked(PetscInt count)
  {
    if (count < 0) Fail("it announces %lld entries", (long long)count);
    return (Size)count;
  }

  /* -- names and entities: small, and read by all ranks -- */

  int addGroup(int dim, int tag)
  {
    const auto found = group_.find({dim, tag});
    if (found != group_.end()) return found->second;
    mesh_.groups.push_back({dim, tag, std::to_string(tag)});
    return group_[{dim, tag}] = (int)mesh_.groups.size() - 1;
  }
  void physicalNames()
  {
    const auto at = section_.find("$PhysicalNames");
    if (at == section_.end()) return;
    Words          words(file_.begin + at->second, end_);
    const PetscInt count = words.integer();
    for (PetscInt k = 0; k < count; k++) {
      const int dim = (int)words.integer(), tag = (int)words.integer();
      mesh_.groups[addGroup(dim, tag)].name = words.quoted();
    }
  }
  void addRegion(int dim, int tag, const std::vector<int> &physical)
  {
    MeshRegion region{dim, tag, {}};
    for (int p : physical)
      if (p) region.groups.push_back(addGroup(dim, std::abs(p))); /* a sign is one of orientation */
    region_[{dim, tag}] = (int)mesh_.regions.size();
    mesh_.regions.push_back(region);
  }
  void entities()
  {
    const auto at = section_.find("$Entities");
    if (!four_ || at == section_.end()) return;
    const char *p = file_.begin + at->second;
    if (binary_)
      entitiesFrom(
          Bytes(p, end_), [](Bytes &b) { return b.get<int>(); }, [](Bytes &b) { return b.integer8(); },
          [](Bytes &b) { b.get<double>(); });
    else
      entitiesFrom(
          Words(p, end_), [](Words &w) { return (int)w.integer(); }, [](Words &w) { return w.integer(); },
          [](Words &w) { w.real(); });
  }
  template <class Source, class Int, class Count, class Real>
  void entitiesFrom(Source s, Int integer, Count many, Real real)
  {
    PetscInt count[4];
    for (PetscInt &c : count) c = many(s);
    for (int dim = 0; dim < 4; dim++)
      for (PetscInt k = 0; k < count[dim]; k++) {
        const int tag = integer(s);
        for (int i = 0; i < (dim ? 6 : 3); i++) real(s);
        std::vector<int> physical;
        for (PetscInt i = many(s); i > 0; i--) physical.push_back(integer(s));
        if (dim)
          for (PetscInt i = many(s); i > 0; i--) integer(s);
        addRegion(dim, tag, physical);
      }
  }
  int regionOf(int dim, int tag)
  {
    const auto found = region_.find({dim, tag});
    if (found != region_.end()) return found->second;
    addRegion(dim, tag, {});
    return (int)mesh_.regions.size() - 1;
  }

  /* -- blocks -- */

  void blocks()
  {
    for (const char *name : {"$Nodes", "$Elements"})
      if (!section_.count(name)) Fail("there is no section %s", name);
    if (!binary_) {
      textBlocks("$Nodes", nodes_, true);
      textBlocks("$Elements", elements_, false);
    }
    /* the same regions on all ranks, in the same order */
    if (four_)
      for (const Block &b : elements_) regionOf(b.dim, b.entity);
  }
  void textBlocks(const char *name, std::vector<Block> &list, bool nodes)
  {
    Size  at = lineOf(section_[name]);
    Words words(line(at), end_);
    Block block;
    block.count = words.integer();
    block.place = at + 1;
    if (!four_) {
      at = block.place + checked(block.count);
      list.push_back(block);
    } else {
      const PetscInt count = block.count;
      at++;
      for (PetscInt b = 0; b < count; b++) {
        Words header(line(at), end_);
        block.dim    = (int)header.integer();
        block.entity = (int)header.integer();
        block.type   = (int)header.integer();
        block.count  = header.integer();
        block.place  = at + 1;
        at += 1 + checked(block.count) * (nodes ? 2 : 1);
        list.push_back(block);
      }
    }
    if (lineAt(line(at)) != "$End" + std::string(name + 1))
      Fail("%s is not laid out as Gmsh writes it, one node or element to a line, or it is damaged: line %zu should be "
           "$End%s",
           name, at + 1, name + 1);
  }

  /* -- this rank's share -- */

  template <class F> void ofMine(const std::vector<Block> &list, F &&f)
  {
    Size total = 0, before = 0;
    for (const Block &b : list) total += b.count;
    const Size from = total * rank_ / size_, to = total * (rank_ + 1) / size_;
    for (const Block &b : list) {
      const Size a = std::max(from, before), e = std::min(to, before + b.count);
      if (a < e) f(b, a - before, e - before);
      before += b.count;
    }
  }
  void share()
  {
    for (const Block &b : elements_) mesh_.elements += b.count;
    ofMine(nodes_,
           [&](const Block &b, Size from, Size to) { binary_ ? binaryNodes(b, from, to) : textNodes(b, from, to); });
    ofMine(elements_, [&](const Block &b, Size from, Size to) {
      binary_ ? binaryElements(b, from, to) : textElements(b, from, to);
    });
  }
  void addPoint(PetscInt tag, double x, double y, double z)
  {
    if (tag < 1) Fail("a node has the number %lld; they begin with 1", (long long)tag);
    if (!std::isfinite(x) || !std::isfinite(y) || !std::isfinite(z))
      Fail("the coordinates of node %lld are not finite", (long long)tag);
    mesh_.points.push_back({tag, {x, y, z}});
  }
  void textNodes(const Block &b, Size from, Size to)
  {
    if (!four_) {
      Words w(line(b.place + from), end_);
      for (Size k = from; k < to; k++) {
        const PetscInt tag = w.integer();
        const double   x = w.real(), y = w.real(), z = w.real();
        addPoint(tag, x, y, z);
      }
      return;
    }
    const char *at = line(b.place + b.count + from);
    Words       tags(line(b.place + from), end_);
    for (Size k = from; k < to; k++) {
      Words        w(at, end_);
      const double x = w.real(), y = w.real(), z = w.real();
      addPoint(tags.integer(), x, y, z);
      at = nextLine(w.at()); /* parametric coordinates may follow */
    }
  }
  void binaryNodes(const Block &b, Size from, Size to)
  {
    const char *p = file_.begin + b.place;
    for (Size k = from; k < to; k++) {
      Bytes    coordinates(four_ ? p + 8 * (Size)b.count + 8 * (3 + b.extra) * k : p + 28 * k + 4, end_);
      PetscInt tag;
      if (four_)
        tag = Bytes(p + 8 * k, end_).integer8();
      else
        tag = Bytes(p + 28 * k, end_).get<int>();
      const double x = coordinates.get<double>(), y = coordinates.get<double>(), z = coordinates.get<double>();
      addPoint(tag, x, y, z);
    }
  }
  /* region: of msh 2 the physical group, until all ranks know all of them */
  template <class Next> void addElement(int type, PetscInt tag, PetscInt region, bool grouped, Next &&next)
  {
    const Kind kind = KindOfType(type);
    if (kind.dim == 3) {
      MeshCell cell{};
      cell.tag    = tag;
      cell.region = region;
      cell.type   = TypeOf(type, tag);
      for (int i = 0; i < kind.nodes; i++) cell.node[i] = next();
      mesh_.cells.push_back(cell);
      if (grouped)
        for (int i = 0; i < kind.nodes; i++) mesh_.members.push_back({cell.node[i], region});
      return;
    }
    for (int i = 0; i < kind.nodes; i++) {
      const PetscInt node = next();
      if (grouped) mesh_.members.push_back({node, region});
    }
  }
  bool grouped(int region) const { return !mesh_.regions[region].groups.empty(); }
  /* msh 2: regions are numbered 4 tag + dimension for the time being */
  static PetscInt provisional(int dim, PetscInt physical) { return 4 * std::abs(physical) + dim; }

  void textElements(const Block &b, Size from, Size to)
  {
    const char *at     = line(b.place + from);
    const int   region = four_ ? regionOf(b.dim, b.entity) : -1;
    for (Size k = from; k < to; k++) {
      const char *const stop = nextLine(at);
      Words             w(at, stop);
      const PetscInt    tag  = w.integer();
      const auto        next = [&] { return w.integer(); };
      if (four_)
        addElement(b.type, tag, region, grouped(region), next);
      else {
        const int type = (int)w.integer();
        PetscInt  tags = w.integer(), physical = 0;
        for (PetscInt t = 0; t < tags; t++) {
          const PetscInt value = w.integer();
          if (t == 0) physical = value;
        }
        addElement(type, tag, provisional(KindOfType(type).dim, physical), physical != 0, next);
      }
      at = stop;
    }
  }
  void binaryElements(const Block &b, Size from, Size to)
  {
    const Kind kind = KindOfType(b.type);
    const Size size = four_ ? 8 * (1 + kind.nodes) : 4 * (1 + b.extra + kind.nodes);
    Bytes      w(file_.begin + b.place + size * from, end_);
    const int  region = four_ ? regionOf(b.dim, b.entity) : -1;
    for (Size k = from; k < to; k++) {
      if (four_) {
        const PetscInt tag = w.integer8();
        addElement(b.type, tag, region, grouped(region), [&] { return w.integer8(); });
        continue;
      }
      const PetscInt tag      = w.get<int>();
      PetscInt       physical = 0;
      for (int t = 0; t < b.extra; t++) {
        const int value = w.get<int>();
        if (t == 0) physical = value;
      }
      addElement(b.type, tag, provisional(kind.dim, physical), physical != 0, [&] { return (PetscInt)w.get<int>(); });
    }
  }

  /* msh 2: which physical groups there are shows in the elements only */
  PetscErrorCode regionsOfGroups()
  {
    std::set<PetscInt>    seen;
    std::vector<PetscInt> mine, all;
    PetscFunctionBegin;
    for (const MeshCell &c : mesh_.cells) seen.insert(c.region);
    for (const MeshMember &m : mesh_.members) seen.insert(m.region);
    mine.assign(seen.begin(), seen.end());
    PetscCall(GatherAll(comm_, mine, &all));
    std::sort(all.begin(), all.end());
    all.erase(std::unique(all.begin(), all.end()), all.end());
    for (PetscInt r : all) addRegion((int)(r % 4), (int)(r / 4), {(int)(r / 4)});
    const auto final = [&](PetscInt &r) { r = std::lower_bound(all.begin(), all.end(), r) - all.begin(); };
    for (MeshCell &c : mesh_.cells) final(c.region);
    for (MeshMember &m : mesh_.members) final(m.region);
    PetscFunctionReturn(0);
  }
};

} // namespace

PetscErrorCode ReadGmsh(MPI_Comm comm, const std::string &file, MeshFile *mesh)
{
  GmshFile reader(comm, file, *mesh);
  PetscFunctionBegin;
  PetscCall(reader.read());
  PetscFunctionReturn(0);
}

} // namespace hhtdae
