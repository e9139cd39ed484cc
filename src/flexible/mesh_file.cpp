/*
  Reads Gmsh files in parallel: every rank maps the file (gmsh_source.cpp), finds the positions of nodes and elements
  (gmsh_blocks.cpp), and parses its own share of them (gmsh_share.cpp).

  PETSc's own reader is not used because it keeps the whole mesh on the first rank, drops the numbers of nodes, and returns the middle nodes
  as coordinates of cells only.
*/
#include "flexible/mesh_file.h"
#include "flexible/exchange.h"
#include "flexible/gmsh_file.h"
#include <stdexcept>

namespace hhtdae
{

namespace gmsh
{

GmshFile::GmshFile(MPI_Comm comm, const std::string &name, MeshFile &mesh) : comm_(comm), name_(name), mesh_(mesh)
{
  MPI_Comm_rank(comm, &rank_);
  MPI_Comm_size(comm, &size_);
}

/* Calls f(); an exception on one rank becomes an error on all ranks */
template <class F> PetscErrorCode GmshFile::attempt(F &&f)
{
  std::string problem;
  PetscFunctionBegin;
  try {
    f();
  } catch (const std::exception &e) {
    problem = "mesh " + name_ + ": " + e.what();
  }
  PetscCall(Agree(comm_, problem));
  PetscFunctionReturn(0);
}

void GmshFile::header()
{
  const char *p = file_.begin;
  if (lineAt(p).compare(0, 11, "$MeshFormat")) Fail("it does not begin with $MeshFormat: it is no mesh of Gmsh");
  Words          words(nextLine(p), end_);
  const double   version = words.real();
  const PetscInt kind = words.integer(), size = words.integer();
  if (kind != 0 && kind != 1) Fail("its kind of file is %lld: 0 is text, 1 binary", (long long)kind);
  if (std::abs(version - 4.1) > 1e-6 && std::abs(version - 2.2) > 1e-6)
    Fail("its format is %g; 4.1 and 2.2 are read (gmsh -format msh41)", version);
  msh4_   = version > 4;
  binary_ = kind == 1;
  if (size != 8) Fail("its size of data is %d, not 8", (int)size);
  if (!binary_) return;
  Bytes bytes(nextLine(words.at()), end_);
  if (bytes.get<int>() != 1) Fail("it was written on a machine with the other order of bytes");
}

PetscErrorCode GmshFile::read()
{
  PetscFunctionBegin;
  PetscCall(attempt([&] {
    file_.open(name_);
    end_ = file_.begin + file_.size;
    header();
  }));
  if (!binary_) PetscCall(indexLines());
  PetscCall(attempt([&] {
    if (binary_) findSections();
    physicalNames();
    entities();
    blocks();
    share();
  }));
  if (!msh4_) PetscCall(regionsOfGroups());
  std::sort(mesh_.members.begin(), mesh_.members.end());
  mesh_.members.erase(std::unique(mesh_.members.begin(), mesh_.members.end()), mesh_.members.end());
  PetscFunctionReturn(0);
}

/* ---- groups and regions, read by all ranks, as they are few ---- */

int GmshFile::addGroup(int dim, int tag)
{
  const auto found = group_.find({dim, tag});
  if (found != group_.end()) return found->second;
  mesh_.groups.push_back({dim, tag, std::to_string(tag)});
  return group_[{dim, tag}] = (int)mesh_.groups.size() - 1;
}

void GmshFile::physicalNames()
{
  const auto at = section_.find("$PhysicalNames");
  if (at == section_.end()) return;
  Words          words(file_.begin + at->second, end_);
  const PetscInt count = words.integer();
  for (PetscInt k = 0; k < count; k++) {
    const int dim = words.small(), tag = words.small();
    if (dim < 0 || dim > 3) Fail("a physical group has %d dimensions", dim);
    mesh_.groups[addGroup(dim, tag)].name = words.quoted();
  }
  expectEnd(words, "$EndPhysicalNames");
}

void GmshFile::expectEnd(Words words, const char *name) const
{
  const std::string word = words.word();
  if (word != name) Fail("'%s' stands where %s should be: the section has more or fewer entries than it announces", word.substr(0, 40).c_str(), name);
}

void GmshFile::addRegion(int dim, int tag, const std::vector<int> &physical)
{
  MeshRegion region{dim, tag, {}};
  for (int p : physical)
    if (p) region.groups.push_back(addGroup(dim, std::abs(p))); /* the sign is an orientation */
  region_[{dim, tag}] = (int)mesh_.regions.size();
  mesh_.regions.push_back(region);
}

template <class Source, class Int, class Count, class Real>
Source GmshFile::entitiesFrom(Source s, bool partitioned, Int integer, Count count_of, Real real)
{
  PetscInt count[4];
  if (partitioned) {
    count_of(s);                                          /* partitions */
    for (Size i = NonNegative(count_of(s)); i > 0; i--) { /* ghost entities and their partitions */
      integer(s);
      integer(s);
    }
  }
  for (PetscInt &c : count) NonNegative(c = count_of(s));
  for (int dim = 0; dim < 4; dim++)
    for (PetscInt k = 0; k < count[dim]; k++) {
      const int tag = integer(s);
      if (partitioned) {
        integer(s); /* dimension and tag of the parent entity */
        integer(s);
        for (Size i = NonNegative(count_of(s)); i > 0; i--) integer(s);
      }
      for (int i = 0; i < (dim ? 6 : 3); i++) real(s);
      std::vector<int> physical;
      for (Size i = NonNegative(count_of(s)); i > 0; i--) physical.push_back(integer(s));
      if (dim)
        for (Size i = NonNegative(count_of(s)); i > 0; i--) integer(s);
      addRegion(dim, tag, physical);
    }
  return s;
}

/* In a partitioned mesh elements belong to entities of the partitions, which have the groups of their parent entities */
void GmshFile::entities()
{
  if (!msh4_) return;
  entitiesOf("$Entities", false);
  entitiesOf("$PartitionedEntities", true);
}

void GmshFile::entitiesOf(const char *section, bool partitioned)
{
  const auto at = section_.find(section);
  if (at == section_.end()) return;
  const char *p = file_.begin + at->second;
  if (binary_)
    entitiesFrom(
        Bytes(p, end_), partitioned, [](Bytes &b) { return b.small(); }, [](Bytes &b) { return b.integer8(); },
        [](Bytes &b) { b.get<double>(); });
  else
    expectEnd(entitiesFrom(
                  Words(p, end_), partitioned, [](Words &w) { return w.small(); }, [](Words &w) { return w.integer(); },
                  [](Words &w) { w.real(); }),
              ("$End" + std::string(section + 1)).c_str());
}

int GmshFile::regionOf(int dim, int tag)
{
  const auto found = region_.find({dim, tag});
  if (found != region_.end()) return found->second;
  addRegion(dim, tag, {});
  return (int)mesh_.regions.size() - 1;
}

/* msh 2: only the elements show which physical groups exist; collects them and renumbers the provisional regions */
PetscErrorCode GmshFile::regionsOfGroups()
{
  struct Physical {
    int  tag, dim;
    bool operator<(const Physical &o) const { return tag != o.tag ? tag < o.tag : dim < o.dim; }
    bool operator==(const Physical &o) const { return tag == o.tag && dim == o.dim; }
  };
  std::vector<Physical> mine(physical_.size()), all;
  std::vector<PetscInt> number;
  PetscFunctionBegin;
  for (const auto &p : physical_) mine[p.second] = {p.first.second, p.first.first};
  PetscCall(GatherAll(comm_, mine, &all));
  std::sort(all.begin(), all.end());
  all.erase(std::unique(all.begin(), all.end()), all.end());
  for (const Physical &p : all) addRegion(p.dim, p.tag, {p.tag});
  for (const Physical &p : mine)
    number.push_back((PetscInt)(std::lower_bound(all.begin(), all.end(), p) - all.begin()));
  for (MeshCell &c : mesh_.cells) c.region = number[c.region];
  for (MeshMember &m : mesh_.members) m.region = number[m.region];
  PetscFunctionReturn(0);
}

} // namespace gmsh

PetscErrorCode ReadGmsh(MPI_Comm comm, const std::string &file, MeshFile *mesh)
{
  gmsh::GmshFile reader(comm, file, *mesh);
  PetscFunctionBegin;
  PetscCall(reader.read());
  PetscFunctionReturn(0);
}

} // namespace hhtdae
