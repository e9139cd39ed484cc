/* CalculiX input on rank 0: the deck's nodes, sets, elements and materials, and the model that they form with the rows of the stored matrices. */
#ifndef HHTDAE_FLEXIBLE_CALCULIX_H
#define HHTDAE_FLEXIBLE_CALCULIX_H

#include "flexible/import.h"
#include <algorithm>
#include <set>
#include <sys/types.h>
#include <unordered_map>

namespace hhtdae
{
namespace calculix
{

using Label = long long;

std::string Trim(const std::string &text); /* removes blanks and quotation marks at both ends */
bool        IsLabel(const std::string &text);

/* A solid element of CalculiX */
struct Kind {
  int         nodes;
  bool        kept; /* false for wedges, which are read but not part of the model */
  ElementType type;
};

struct DeckElement {
  FeElement          element;
  std::vector<Label> node; /* in CalculiX' order */
};

/* The labels first, first + step .. last; those that do not exist in the deck are ignored */
struct DeckRange {
  Label first, last, step;
};

/* A set of labels, with its name as first written in the deck */
struct DeckSet {
  std::string            name;
  std::vector<DeckRange> member;

  void add(Label l) /* consecutive labels are stored as one range */
  {
    if (!member.empty() && member.back().step == 1 && member.back().last == l - 1)
      member.back().last = l;
    else
      member.push_back({l, l, 1});
  }
};

/* Bound on the number of set members for a deck of `bytes` bytes: by ranges, sets of sets and repeated inclusion a small file can define more
   members than memory holds. */
class Budget
{
public:
  explicit Budget(PetscInt64 bytes) : left_(100000 + bytes) {}
  bool spend(std::size_t n)
  {
    left_ -= std::min(left_ + 1, (PetscInt64)n);
    return left_ >= 0;
  }

private:
  PetscInt64 left_;
};

/* The labels, of a sorted list, that belong to the set; false if the budget is exceeded */
bool Expand(const DeckSet &set, const std::vector<Label> &labels, Budget *budget, std::vector<Label> *found);

struct DeckMaterial {
  Material            material;
  std::vector<double> elastic;
  bool                isotropic = true;
};

/* The parts of an input deck that a model needs; unknown keywords are skipped */
class Deck
{
public:
  std::string                            error;
  std::unordered_map<Label, Vector3>     node;
  std::map<std::string, DeckSet>         nsets, elsets; /* by name in capitals */
  std::unordered_map<Label, DeckElement> element;
  std::set<Label>                        used; /* nodes of elements */
  std::vector<Material>                  materials;
  PetscInt64                             bytes    = 0; /* size of all files, counted each time they are included */
  std::size_t                            left_out = 0; /* elements that are not part of the model: wedges, and those without isotropic material */

  void read(const std::string &file);

private:
  std::string                                      deck_; /* the first file */
  std::string                                      keyword_, type_, into_nset_, into_elset_;
  bool                                             generate_ = false, known_type_ = false;
  Kind                                             kind_{};
  std::vector<Label>                               pending_; /* numbers of an element that continues on the next line */
  std::string                                      material_;
  std::map<std::string, DeckMaterial>              material_data_;
  std::vector<std::pair<std::string, std::string>> sections_; /* set of elements, material */
  std::map<std::string, std::string>               parameter_;
  std::map<std::pair<dev_t, ino_t>, int>           inclusions_; /* number of times each file has been read */
  std::size_t                                      ranges_ = 0; /* ranges copied from sets to others that include them */

  void               fail(const std::string &file, long number, const std::string &why);
  void               fail(const std::string &why);
  std::string        inclusionProblem(const std::string &file, int depth);
  void               readFile(const std::string &file, const std::string &from, int depth);
  void               include(const std::string &file, long number, int depth);
  void               keyword(const std::string &file, long number, const std::string &line);
  static std::string open(std::map<std::string, DeckSet> *sets, const std::string &name);
  void               data(const std::string &file, long number, const std::vector<std::string> &part);
  void               nodeLine(const std::string &file, long number, const std::vector<std::string> &part);
  void               elementLine(const std::string &file, long number, const std::vector<std::string> &part);
  void               endElement();
  void               setLine(const std::string &file, long number, const std::vector<std::string> &part,
                             std::map<std::string, DeckSet> *sets, const std::string &into);
  bool               rangeLine(const std::vector<std::string> &part, DeckSet *set);
  void               materialLine(const std::string &file, long number, const std::vector<std::string> &part);
  void               checkMaterials();
  void               assignMaterials();
};

/* Reads nodes, sets and elements from stem.inp and stem.dof; row: the model's row for each row of the stored matrices. Returns an error message, or "" */
std::string ReadJob(const std::string &stem, ReadModel *read, std::vector<PetscInt> *row, PetscInt64 *left_out);

} // namespace calculix
} // namespace hhtdae

#endif
