/* The parallel reader of one Gmsh file: positions of its sections, blocks and lines, and the conversion to a MeshFile. */
#ifndef HHTDAE_FLEXIBLE_GMSH_FILE_H
#define HHTDAE_FLEXIBLE_GMSH_FILE_H

#include "flexible/gmsh_source.h"
#include "flexible/mesh_file.h"
#include <map>
#include <utility>

namespace hhtdae
{

namespace gmsh
{

/* ---- types of elements: gmsh_share.cpp ---- */

struct Kind {
  int dim, nodes;
};

Kind KindOfType(int type);
/* Converts a number of entries; fails if it is negative */
Size NonNegative(PetscInt count);
/* The element type for a type of Gmsh; fails for unsupported solids */
ElementType TypeOf(int type, PetscInt element);

/* ---- the file ---- */

/* The nodes or elements that follow one header */
struct Block {
  int      dim = 0, entity = 0, type = 0, extra = 0; /* extra: number of parametric coordinates of a node, or of tags of an element in msh 2 */
  PetscInt count = 0;
  Size     place = 0; /* of the first: number of its line in text files, offset in binary ones */
};

class GmshFile
{
public:
  GmshFile(MPI_Comm comm, const std::string &name, MeshFile &mesh);
  PetscErrorCode read();

private:
  static constexpr Size chunk = 1 << 16;

  MPI_Comm                           comm_;
  std::string                        name_;
  MeshFile                          &mesh_;
  PetscMPIInt                        rank_, size_;
  Mapping                            file_;
  const char                        *end_    = nullptr;
  bool                               binary_ = false, msh4_ = false;
  std::vector<Size>                  lines_;   /* number of line ends before each chunk */
  std::map<std::string, Size>        section_; /* offset of the first byte after the line with the name */
  std::vector<Block>                 nodes_, elements_;
  std::map<std::pair<int, int>, int> group_, region_; /* indices by dimension and tag */
  std::map<std::pair<int, int>, int> physical_;       /* msh 2: provisional number of each group of this rank's share */

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

  /* header and error handling: mesh_file.cpp */
  template <class F> PetscErrorCode attempt(F &&f);
  void                              header();

  /* lines of text: gmsh_blocks.cpp */
  PetscErrorCode indexLines();
  const char    *line(Size k) const;
  Size           lineOf(Size offset) const;

  /* blocks of nodes and elements: gmsh_blocks.cpp */
  void        findSections();
  const char *walkNodes(const char *p);
  const char *walkElements(const char *p);
  void        blocks();
  void        textBlocks(const char *name, std::vector<Block> &list, bool nodes);

  /* groups and regions: mesh_file.cpp */
  int  addGroup(int dim, int tag);
  void physicalNames();
  void expectEnd(Words words, const char *name) const;
  void addRegion(int dim, int tag, const std::vector<int> &physical);
  void entities();
  void entitiesOf(const char *section, bool partitioned);
  template <class Source, class Int, class Count, class Real>
  Source         entitiesFrom(Source s, bool partitioned, Int integer, Count many, Real real);
  int            regionOf(int dim, int tag);
  PetscErrorCode regionsOfGroups();

  /* this rank's share of nodes and elements: gmsh_share.cpp */
  template <class F> void    forOwnShare(const std::vector<Block> &list, F &&f);
  void                       share();
  void                       addPoint(PetscInt tag, double x, double y, double z);
  void                       textNodes(const Block &b, Size from, Size to);
  void                       binaryNodes(const Block &b, Size from, Size to);
  template <class Next> void addElement(int type, PetscInt tag, PetscInt region, bool grouped, Next &&next);
  bool                       grouped(int region) const { return !mesh_.regions[region].groups.empty(); }
  PetscInt                   provisionalRegion(int dim, PetscInt physical);
  void                       textElements(const Block &b, Size from, Size to);
  void                       binaryElements(const Block &b, Size from, Size to);
};

} // namespace gmsh

} // namespace hhtdae

#endif
