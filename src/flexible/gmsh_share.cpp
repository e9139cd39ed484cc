/* Parses a rank's share of the nodes and elements of a Gmsh file; Gmsh's element types. */
#include "flexible/gmsh_file.h"

namespace hhtdae
{

namespace gmsh
{

/* ---- types of elements ---- */

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

Size NonNegative(PetscInt count)
{
  if (count < 0) Fail("it announces %lld entries", (long long)count);
  return (Size)count;
}

/* ---- shares ---- */

template <class F> void GmshFile::forOwnShare(const std::vector<Block> &list, F &&f)
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

void GmshFile::share()
{
  for (const Block &b : elements_) {
    if (b.count > std::numeric_limits<PetscInt>::max() - mesh_.elements)
      Fail("it has more elements than this build of PETSc can count");
    mesh_.elements += b.count;
  }
  forOwnShare(nodes_,
              [&](const Block &b, Size from, Size to) { binary_ ? binaryNodes(b, from, to) : textNodes(b, from, to); });
  forOwnShare(elements_, [&](const Block &b, Size from, Size to) {
    binary_ ? binaryElements(b, from, to) : textElements(b, from, to);
  });
}

void GmshFile::addPoint(PetscInt tag, double x, double y, double z)
{
  if (tag < 1) Fail("a node has the number %lld; they begin with 1", (long long)tag);
  if (!std::isfinite(x) || !std::isfinite(y) || !std::isfinite(z))
    Fail("the coordinates of node %lld are not finite", (long long)tag);
  mesh_.points.push_back({tag, {x, y, z}});
}

void GmshFile::textNodes(const Block &b, Size from, Size to)
{
  const char *at = line(b.place + (msh4_ ? b.count : 0) + from);
  Words       tags(line(b.place + from), msh4_ ? line(b.place + b.count) : end_);
  for (Size k = from; k < to; k++) {
    const char *const stop = nextLine(at);
    Words             w(at, stop);
    const PetscInt    tag = msh4_ ? tags.integer() : w.integer();
    const double      x = w.real(), y = w.real(), z = w.real();
    for (int i = 0; i < 3 && msh4_ && b.type && !w.ended(); i++) w.real(); /* parametric coordinates */
    w.finish();
    addPoint(tag, x, y, z);
    at = stop;
  }
}

void GmshFile::binaryNodes(const Block &b, Size from, Size to)
{
  const char *p = file_.begin + b.place;
  for (Size k = from; k < to; k++) {
    Bytes    coordinates(msh4_ ? p + 8 * (Size)b.count + 8 * (3 + b.extra) * k : p + 28 * k + 4, end_);
    PetscInt tag;
    if (msh4_)
      tag = Bytes(p + 8 * k, end_).integer8();
    else
      tag = Bytes(p + 28 * k, end_).get<int>();
    const double x = coordinates.get<double>(), y = coordinates.get<double>(), z = coordinates.get<double>();
    addPoint(tag, x, y, z);
  }
}

/* region: in msh 2 the provisional number of the physical group, until the groups of all ranks are known */
template <class Next>
void GmshFile::addElement(int type, PetscInt tag, PetscInt region, bool grouped, Next &&next)
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

/* msh 2: numbers physical groups in the order in which this rank finds them; regionsOfGroups() replaces the numbers */
PetscInt GmshFile::provisionalRegion(int dim, PetscInt physical)
{
  if (std::abs((PetscInt64)physical) > std::numeric_limits<int>::max())
    Fail("there is a physical group %lld, which is no number of 32 bits", (long long)physical);
  const int number = (int)physical_.size();
  return physical_.emplace(std::make_pair(dim, std::abs((int)physical)), number).first->second;
}

void GmshFile::textElements(const Block &b, Size from, Size to)
{
  const char *at     = line(b.place + from);
  const int   region = msh4_ ? regionOf(b.dim, b.entity) : -1;
  for (Size k = from; k < to; k++) {
    const char *const stop = nextLine(at);
    Words             w(at, stop);
    const PetscInt    tag  = w.integer();
    const auto        next = [&] { return w.integer(); };
    if (msh4_)
      addElement(b.type, tag, region, grouped(region), next);
    else {
      const int type = w.small();
      PetscInt  tags = w.integer(), physical = 0;
      for (PetscInt t = 0; t < tags; t++) {
        const PetscInt value = w.integer();
        if (t == 0) physical = value;
      }
      addElement(type, tag, provisionalRegion(KindOfType(type).dim, physical), physical != 0, next);
    }
    w.finish();
    at = stop;
  }
}

void GmshFile::binaryElements(const Block &b, Size from, Size to)
{
  const Kind kind = KindOfType(b.type);
  const Size size = msh4_ ? 8 * (1 + kind.nodes) : 4 * (1 + b.extra + kind.nodes);
  Bytes      w(file_.begin + b.place + size * from, end_);
  const int  region = msh4_ ? regionOf(b.dim, b.entity) : -1;
  for (Size k = from; k < to; k++) {
    if (msh4_) {
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
    addElement(b.type, tag, provisionalRegion(kind.dim, physical), physical != 0, [&] { return (PetscInt)w.get<int>(); });
  }
}

} // namespace gmsh

} // namespace hhtdae
