/* CalculiX, as rank 0 reads it: what of an input deck is needed, and the model that it makes with the rows of the
 * stored matrices. */
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

std::string Trim(const std::string &text); /* without blanks and quotation marks at the ends */
bool        IsLabel(const std::string &text);

/* Numbers of nodes of CalculiX' solid elements, and ours among them */
struct Kind {
  int         nodes;
  bool        kept;
  ElementType type;
};

struct DeckElement {
  FeElement          element;
  std::vector<Label> node; /* CalculiX' order */
};

/* first, first + step .. last, of which only those labels count that the deck has */
struct DeckRange {
  Label first, last, step;
};

/* A set of labels, with its name as it was written first */
struct DeckSet {
  std::string            name;
  std::vector<DeckRange> member;

  void add(Label l) /* labels that follow one another take one place */
  {
    if (!member.empty() && member.back().step == 1 && member.back().last == l - 1)
      member.back().last = l;
    else
      member.push_back({l, l, 1});
  }
};

/* Elements and nodes that sets may name, all together: a small file can ask for more than memory holds, by ranges, sets of
   sets and files that are included again and again. */
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

/* Those of the sorted labels that are in the set; false: more than the budget allows */
bool Expand(const DeckSet &set, const std::vector<Label> &labels, Budget *budget, std::vector<Label> *found);

struct DeckMaterial {
  Material            material;
  std::vector<double> elastic;
  bool                isotropic = true;
};

/* What of an input deck is needed here; keywords that are not known are passed over */
class Deck
{
public:
  std::string                            error;
  std::unordered_map<Label, Vector3>     node;
  std::map<std::string, DeckSet>         nsets, elsets; /* by name in capitals */
  std::unordered_map<Label, DeckElement> element;
  std::set<Label>                        used; /* nodes of elements */
  std::vector<Material>                  materials;
  PetscInt64  bytes    = 0; /* of all files, each as often as it is included */
  std::size_t left_out = 0; /* elements of kinds that are not kept, or of other materials than isotropic ones */

  void read(const std::string &file);

private:
  std::string                                      deck_; /* the first file */
  std::string                                      keyword_, type_, into_nset_, into_elset_;
  bool                                             generate_ = false, known_type_ = false;
  Kind                                             kind_{};
  std::vector<Label>                               pending_; /* an element that goes on in the next line */
  std::string                                      material_;
  std::map<std::string, DeckMaterial>              material_data_;
  std::vector<std::pair<std::string, std::string>> sections_; /* set of elements, material */
  std::map<std::string, std::string>               parameter_;
  std::map<std::pair<dev_t, ino_t>, int>           times_;      /* how often each file has been read */
  std::size_t                                      ranges_ = 0; /* of sets that are part of others */

  void               fail(const std::string &file, long number, const std::string &why);
  void               fail(const std::string &why);
  std::string        whyNot(const std::string &file, int depth);
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

/* Nodes, sets and elements of stem.inp and stem.dof, and the model's row for each row of the matrices; says what is
 * wrong, or nothing */
std::string ReadJob(const std::string &stem, ReadModel *read, std::vector<PetscInt> *row, PetscInt64 *left_out);

} // namespace calculix
} // namespace hhtdae

#endif
