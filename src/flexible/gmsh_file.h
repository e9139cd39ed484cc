/* One Gmsh file while it is read: where its sections, blocks and lines stand, and what goes from them to the MeshFile. */
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
/* A number of entries, which must not be negative */
Size Checked(PetscInt count);
/* Fails for solids that bodies are not made of */
ElementType TypeOf(int type, PetscInt element);

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
  bool                               binary_ = false, four_ = false;
  std::vector<Size>                  lines_;   /* ends of lines before each chunk */
  std::map<std::string, Size>        section_; /* offset of its first byte, after the line with the name */
  std::vector<Block>                 nodes_, elements_;
  std::map<std::pair<int, int>, int> group_, region_; /* by dimension and tag */
  std::map<std::pair<int, int>, int> physical_;       /* msh 2: number of each group in this rank's share */

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

  /* the whole: mesh_file.cpp */
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
  template <class F> void ofMine(const std::vector<Block> &list, F &&f);
  void                    share();
  void                    addPoint(PetscInt tag, double x, double y, double z);
  void                    textNodes(const Block &b, Size from, Size to);
  void                    binaryNodes(const Block &b, Size from, Size to);
  template <class Next> void addElement(int type, PetscInt tag, PetscInt region, bool grouped, Next &&next);
  bool                       grouped(int region) const { return !mesh_.regions[region].groups.empty(); }
  PetscInt                   provisional(int dim, PetscInt physical);
  void                       textElements(const Block &b, Size from, Size to);
  void                       binaryElements(const Block &b, Size from, Size to);
};

} // namespace gmsh

} // namespace hhtdae

#endif
