/* Converts nodes, sets and elements of a CalculiX deck to the numbering of the model, and finds the rows of its matrices. */
#include "flexible/calculix.h"
#include "flexible/node_order.h"
#include "flexible/read_text.h"
#include <algorithm>
#include <fstream>

namespace hhtdae
{
namespace calculix
{

namespace
{

/* Node and direction of each row of the stored matrices, in the order of the file */
std::string ReadUnknowns(const std::string &file, std::vector<std::pair<Label, int>> *unknown)
{
  std::string   line, why = WhyUnreadable(file);
  std::ifstream in(file);
  if (!why.empty())
    return "cannot read " + file + ": " + why + " (ccx writes it with *FREQUENCY, SOLVER=MATRIXSTORAGE)";
  while (std::getline(in, line)) {
    const std::string text = Trim(line);
    const std::size_t dot  = text.find('.');
    if (text.empty()) continue;
    if (dot == std::string::npos || !IsLabel(text.substr(0, dot)) || !IsLabel(text.substr(dot + 1)))
      return file + ": " + Quoted(text) + " is not \"node.direction\"";
    const Label direction = std::stoll(text.substr(dot + 1));
    if (direction < 1 || direction > 3)
      return file + ": " + Quoted(text) + " is not a translation: solid elements alone can be read";
    unknown->push_back({std::stoll(text.substr(0, dot)), (int)direction});
  }
  return unknown->empty() ? file + " has no unknowns" : "";
}

constexpr const char *no_supports = " Supports and constraints (*BOUNDARY, *EQUATION, *MPC, *RIGID BODY, *TIE) have to "
                                    "be left out of the deck whose matrices are "
                                    "stored; attachments take their place";

/* Numbers the nodes by ascending label and finds the model's row of each unknown; returns an error message, or "" */
std::string NumberNodes(const Deck &deck, const std::vector<std::pair<Label, int>> &unknown, ReadModel *read,
                        std::unordered_map<Label, PetscInt> *place, std::vector<PetscInt> *row)
{
  std::map<Label, int> directions;
  for (const auto &u : unknown) {
    int &have = directions[u.first];
    if (have & (1 << u.second))
      return "node " + std::to_string(u.first) + " has direction " + std::to_string(u.second) + " twice";
    have |= 1 << u.second;
    if (!deck.node.count(u.first))
      return "node " + std::to_string(u.first) +
             " is not in the deck: CalculiX makes nodes of its own for beams, shells, plane elements and C3D8I, which are not "
             "read; take C3D20 or C3D10 where bricks bend";
  }
  for (const auto &d : directions) {
    for (int c = 1; c <= 3; c++)
      if (!(d.second & (1 << c)))
        return "node " + std::to_string(d.first) + " has no unknown in direction " + std::to_string(c) + "." +
               no_supports;
    const Vector3 &x = deck.node.at(d.first);
    place->emplace(d.first, (PetscInt)read->label.size());
    read->label.push_back((PetscInt)d.first);
    read->coordinates.insert(read->coordinates.end(), x.data(), x.data() + 3);
  }
  for (Label l : deck.used)
    if (!place->count(l)) return "node " + std::to_string(l) + " of an element has no unknowns." + no_supports;
  for (const auto &u : unknown) row->push_back(3 * place->at(u.first) + u.second - 1);
  return "";
}

template <class Map> std::vector<Label> SortedLabels(const Map &map)
{
  std::vector<Label> labels;
  for (const auto &entry : map) labels.push_back(entry.first);
  std::sort(labels.begin(), labels.end());
  return labels;
}

/* Adds node sets, and element sets as sets of their nodes unless a node set has the same name; returns an error message, or "" */
std::string CollectSets(const Deck &deck, const std::unordered_map<Label, PetscInt> &place, ReadModel *read)
{
  const std::vector<Label> nodes = SortedLabels(place), elements = SortedLabels(deck.element);
  const char *const        too_many = "the deck's sets have more members than a deck of this length can mean";
  Budget                   budget(deck.bytes);
  std::vector<Label>       members;
  for (const auto &set : deck.nsets) {
    if (!Expand(set.second, nodes, &budget, &members)) return too_many;
    std::vector<PetscInt> &to = read->sets[set.second.name];
    for (Label l : members) to.push_back(place.at(l));
  }
  for (const auto &set : deck.elsets) {
    if (deck.nsets.count(set.first)) continue;
    if (!Expand(set.second, elements, &budget, &members)) return too_many;
    std::vector<PetscInt> &to = read->sets[set.second.name];
    for (Label l : members)
      for (Label n : deck.element.at(l).node) {
        const auto found = place.find(n);
        if (found != place.end()) to.push_back(found->second);
      }
    std::sort(to.begin(), to.end());
    to.erase(std::unique(to.begin(), to.end()), to.end());
  }
  return "";
}

/* Adds the elements in the order of their labels */
void CollectElements(const Deck &deck, const std::unordered_map<Label, PetscInt> &place, ReadModel *read)
{
  for (Label l : SortedLabels(deck.element)) {
    const DeckElement &from = deck.element.at(l);
    if (from.element.material < 0) continue;
    FeElement          e    = from.element;
    for (int k = 0; k < FeNodes(e.type); k++) e.node[GmshPlace(e.type, k)] = place.at(from.node[(std::size_t)k]);
    read->elements.push_back(e);
  }
  read->materials = deck.materials;
}

} // namespace

std::string ReadJob(const std::string &stem, ReadModel *read, std::vector<PetscInt> *row, PetscInt64 *left_out)
{
  Deck                                deck;
  std::vector<std::pair<Label, int>>  unknown;
  std::unordered_map<Label, PetscInt> place;
  deck.read(stem + ".inp");
  if (!deck.error.empty()) return deck.error;
  std::string error = ReadUnknowns(stem + ".dof", &unknown);
  if (error.empty() && (error = NumberNodes(deck, unknown, read, &place, row)).size()) error = stem + ".dof: " + error;
  if (!error.empty()) return error;
  error = CollectSets(deck, place, read);
  if (!error.empty()) return stem + ".inp: " + error;
  CollectElements(deck, place, read);
  *left_out = (PetscInt64)deck.left_out;
  return "";
}

} // namespace calculix
} // namespace hhtdae
