/*
  The door for CalculiX. A deck without supports whose step is

    *STEP
    *FREQUENCY, SOLVER=MATRIXSTORAGE
    *END STEP

  makes ccx 2.20 write, for a job "stem",
    stem.dof   a line "node.direction" for each row of the matrices; supports and dependent unknowns of constraints are
  left out stem.sti   lines "i j value" of the stiffness matrix, upper triangle by columns, 14 digits, zeros of the
  pattern too stem.mas   the same of the mass matrix Nodes, sets, elements and materials come from the deck stem.inp,
  which rank 0 reads; the matrices are read by all ranks. Elements serve stress and pictures, so those of other kinds
  than tetrahedra and bricks of linear or quadratic shape are not kept.
*/
#include "flexible/exchange.h"
#include "flexible/import.h"
#include "flexible/node_order.h"
#include <algorithm>
#include <cmath>
#include <fstream>
#include <set>
#include <unordered_map>

namespace hhtdae
{

namespace
{

using Label = long long;

std::string Upper(std::string text)
{
  for (char &c : text) c = (char)std::toupper((unsigned char)c);
  return text;
}

std::string Trim(const std::string &text)
{
  const std::size_t from = text.find_first_not_of(" \t\r\""), to = text.find_last_not_of(" \t\r\"");
  return from == std::string::npos ? "" : text.substr(from, to - from + 1);
}

std::vector<std::string> Split(const std::string &line)
{
  std::vector<std::string> part;
  std::size_t              from = 0, comma;
  while ((comma = line.find(',', from)) != std::string::npos) {
    part.push_back(Trim(line.substr(from, comma - from)));
    from = comma + 1;
  }
  const std::string last = Trim(line.substr(from));
  if (!last.empty()) part.push_back(last);
  return part;
}

bool IsLabel(const std::string &text)
{
  return !text.empty() && text.find_first_not_of("0123456789") == std::string::npos && text.size() < 18;
}

bool IsNumber(const std::string &text, double *value)
{
  std::string plain = text;
  for (char &c : plain)
    if (c == 'D' || c == 'd') c = 'e';
  char *end;
  *value = std::strtod(plain.c_str(), &end);
  return !plain.empty() && !*end && std::isfinite(*value);
}

/* Numbers of nodes of CalculiX' solid elements, and ours among them */
struct Kind {
  int         nodes;
  bool        kept;
  ElementType type;
};

bool SolidKind(const std::string &name, Kind *kind)
{
  static const std::map<std::string, Kind> known = {
      {"C3D4", {4, true, ElementType::Tetrahedron4}},     {"C3D10", {10, true, ElementType::Tetrahedron10}},
      {"C3D10T", {10, true, ElementType::Tetrahedron10}}, {"C3D8", {8, true, ElementType::Brick8}},
      {"C3D8R", {8, true, ElementType::Brick8}},          {"C3D8I", {8, true, ElementType::Brick8}},
      {"C3D20", {20, true, ElementType::Brick20}},        {"C3D20R", {20, true, ElementType::Brick20}},
      {"C3D6", {6, false, ElementType::Brick8}},          {"C3D15", {15, false, ElementType::Brick20}}};
  const auto found = known.find(name);
  if (found == known.end()) return false;
  *kind = found->second;
  return true;
}

struct DeckElement {
  FeElement          element;
  std::vector<Label> node; /* CalculiX' order */
};

/* A set of labels, with its name as it was written first */
struct DeckSet {
  std::string        name;
  std::vector<Label> member;
};

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
  std::size_t left_out = 0; /* elements of kinds that are not kept, or of other materials than isotropic ones */

  void read(const std::string &file)
  {
    readFile(file, "", 0);
    endElement();
    assignMaterials();
  }

private:
  std::string                                      keyword_, type_, into_nset_, into_elset_;
  bool                                             generate_ = false, known_type_ = false;
  Kind                                             kind_{};
  std::vector<Label>                               pending_; /* an element that goes on in the next line */
  std::string                                      material_;
  std::map<std::string, DeckMaterial>              material_data_;
  std::vector<std::pair<std::string, std::string>> sections_; /* set of elements, material */
  std::map<std::string, std::string>               parameter_;

  void fail(const std::string &file, long number, const std::string &why)
  {
    if (error.empty()) error = file + ", line " + std::to_string(number) + ": " + why;
  }

  void readFile(const std::string &file, const std::string &from, int depth)
  {
    std::ifstream in(file);
    std::string   line, more;
    long          number = 0;
    if (!in || depth > 20) {
      if (error.empty())
        error = (from.empty() ? "" : from + ": ") + "cannot read the deck " + file +
                ": there is no such file, or no right to read it";
      return;
    }
    while (error.empty() && std::getline(in, line)) {
      number++;
      if (line.compare(0, 2, "**") == 0 || Trim(line).empty()) continue;
      if (Trim(line)[0] != '*') {
        data(file, number, Split(line));
        continue;
      }
      while (Trim(line).back() == ',' && std::getline(in, more)) {
        number++;
        line = Trim(line) + more;
      }
      keyword(file, number, Trim(line));
      if (keyword_ == "INCLUDE") include(file, number, depth);
    }
    if (error.empty() && in.bad()) error = "reading " + file + " failed";
  }

  /* beside the deck, else where the program runs */
  void include(const std::string &file, long number, int depth)
  {
    const std::string name   = parameter_["INPUT"],
                      folder = file.find('/') == std::string::npos ? "" : file.substr(0, file.rfind('/') + 1);
    const std::string beside = !name.empty() && name[0] == '/' ? name : folder + name;
    keyword_.clear();
    readFile(std::ifstream(beside) ? beside : name, file + ", line " + std::to_string(number), depth + 1);
  }

  void keyword(const std::string &file, long number, const std::string &line)
  {
    const std::vector<std::string> part = Split(line);
    endElement();
    keyword_ = Upper(part[0].substr(1));
    keyword_.erase(
        std::remove_if(keyword_.begin(), keyword_.end(), [](char c) { return std::isspace((unsigned char)c); }),
        keyword_.end());
    parameter_.clear();
    for (std::size_t k = 1; k < part.size(); k++) {
      const std::size_t equal = part[k].find('=');
      std::string       name  = Upper(Trim(part[k].substr(0, equal)));
      parameter_[name]        = equal == std::string::npos ? "" : Trim(part[k].substr(equal + 1));
    }
    into_nset_  = parameter_.count("NSET") ? open(&nsets, parameter_["NSET"]) : "";
    into_elset_ = parameter_.count("ELSET") && (keyword_ == "ELSET" || keyword_ == "ELEMENT")
                      ? open(&elsets, parameter_["ELSET"])
                      : "";
    generate_   = parameter_.count("GENERATE");
    if (keyword_ == "ELEMENT") {
      type_       = Upper(parameter_["TYPE"]);
      known_type_ = SolidKind(type_, &kind_);
    } else if (keyword_ == "MATERIAL") {
      material_ = Upper(parameter_["NAME"]);
      material_data_[material_];
    } else if (keyword_ == "ELASTIC") {
      const std::string type = Upper(parameter_["TYPE"]);
      if (!type.empty() && type.compare(0, 3, "ISO")) material_data_[material_].isotropic = false;
    } else if (keyword_ == "SOLIDSECTION")
      sections_.push_back({Upper(parameter_["ELSET"]), Upper(parameter_["MATERIAL"])});
    else if (keyword_ == "SYSTEM" ||
             (keyword_ == "NODE" && parameter_.count("SYSTEM") && Upper(parameter_["SYSTEM"]) != "R"))
      fail(file, number, "coordinates in another system (*SYSTEM) are not read: write them in the global one");
  }

  static std::string open(std::map<std::string, DeckSet> *sets, const std::string &name)
  {
    const std::string key = Upper(name);
    DeckSet          &set = (*sets)[key];
    if (set.name.empty()) set.name = name;
    return key;
  }

  void data(const std::string &file, long number, const std::vector<std::string> &part)
  {
    if (keyword_ == "NODE")
      nodeLine(file, number, part);
    else if (keyword_ == "ELEMENT")
      elementLine(file, number, part);
    else if (keyword_ == "NSET")
      setLine(file, number, part, &nsets, into_nset_);
    else if (keyword_ == "ELSET")
      setLine(file, number, part, &elsets, into_elset_);
    else if (keyword_ == "ELASTIC" || keyword_ == "DENSITY")
      materialLine(file, number, part);
  }

  void nodeLine(const std::string &file, long number, const std::vector<std::string> &part)
  {
    Vector3 x    = Vector3::Zero();
    bool    good = !part.empty() && IsLabel(part[0]) && std::stoll(part[0]) <= (Label)PETSC_MAX_INT;
    for (std::size_t k = 1; k < part.size() && k < 4; k++)
      good = good && (part[k].empty() || IsNumber(part[k], &x[(Eigen::Index)k - 1]));
    if (!good) return fail(file, number, "is not \"node, x, y, z\"");
    const Label label = std::stoll(part[0]);
    node[label]       = x;
    if (!into_nset_.empty()) nsets[into_nset_].member.push_back(label);
  }

  void elementLine(const std::string &file, long number, const std::vector<std::string> &part)
  {
    if (!known_type_) endElement();
    for (const std::string &p : part) {
      if (!IsLabel(p)) {
        if (known_type_) fail(file, number, "has \"" + p + "\" in place of the number of an element or node");
        return;
      }
      pending_.push_back(std::stoll(p));
    }
    if (known_type_ && (int)pending_.size() > kind_.nodes) endElement();
  }

  /* The element whose numbers have been gathered is complete */
  void endElement()
  {
    if (pending_.empty()) return;
    const Label label = pending_[0];
    if (keyword_ == "ELEMENT" && known_type_ && (int)pending_.size() != kind_.nodes + 1 && error.empty())
      error = "element " + std::to_string(label) + " of type " + type_ + " has " + std::to_string(pending_.size() - 1) +
              " nodes in place of " + std::to_string(kind_.nodes);
    used.insert(pending_.begin() + 1, pending_.end());
    if (!into_elset_.empty()) elsets[into_elset_].member.push_back(label);
    if (known_type_) {
      DeckElement &e = element[label];
      e.node.assign(pending_.begin() + 1, pending_.end());
      e.element = FeElement{kind_.type, kind_.kept ? -1 : -2, {}};
    }
    pending_.clear();
  }

  void setLine(const std::string &file, long number, const std::vector<std::string> &part,
               std::map<std::string, DeckSet> *sets, const std::string &into)
  {
    if (into.empty()) return fail(file, number, "belongs to a set without a name");
    std::vector<Label> *member = &(*sets)[into].member;
    if (generate_) {
      const bool good = part.size() >= 2 && part.size() <= 3 && IsLabel(part[0]) && IsLabel(part[1]) &&
                        (part.size() == 2 || IsLabel(part[2]));
      const Label first = good ? std::stoll(part[0]) : 0, last = good ? std::stoll(part[1]) : 0,
                  step = good && part.size() == 3 ? std::stoll(part[2]) : 1;
      if (!good || step < 1 || last > (Label)PETSC_MAX_INT) return fail(file, number, "is not \"first, last, step\"");
      for (Label l = first; l <= last; l += step) member->push_back(l);
      return;
    }
    for (const std::string &p : part) {
      if (p.empty()) continue;
      if (IsLabel(p))
        member->push_back(std::stoll(p));
      else if (!sets->count(Upper(p)) || Upper(p) == into)
        return fail(file, number, "names the set " + p + ", which is not there");
      else {
        const std::vector<Label> other = (*sets)[Upper(p)].member;
        member->insert(member->end(), other.begin(), other.end());
      }
    }
  }

  void materialLine(const std::string &file, long number, const std::vector<std::string> &part)
  {
    DeckMaterial       &m = material_data_[material_];
    std::vector<double> value;
    for (const std::string &p : part) {
      double v = 0;
      if (!p.empty() && !IsNumber(p, &v)) return fail(file, number, "has \"" + p + "\" in place of a number");
      value.push_back(v);
    }
    if (keyword_ == "DENSITY" && !value.empty()) m.material.density = value[0];
    if (keyword_ == "ELASTIC") m.elastic.insert(m.elastic.end(), value.begin(), value.end());
    /* a second line: it depends on the temperature, or on directions */
    if (keyword_ == "ELASTIC" && (m.elastic.size() > 3 || m.elastic.size() < 2)) m.isotropic = false;
    if (keyword_ == "ELASTIC" && m.isotropic) {
      m.material.young   = m.elastic[0];
      m.material.poisson = m.elastic[1];
    }
  }

  void assignMaterials()
  {
    std::map<std::string, PetscInt> number;
    for (const auto &section : sections_) {
      const auto data = material_data_.find(section.second);
      const auto set  = elsets.find(section.first);
      if (data == material_data_.end() || set == elsets.end() || !data->second.isotropic ||
          data->second.material.young <= 0)
        continue;
      const auto place = number.emplace(section.second, (PetscInt)materials.size());
      if (place.second) materials.push_back(data->second.material);
      for (Label l : set->second.member) {
        const auto e = element.find(l);
        if (e != element.end() && e->second.element.material == -1) e->second.element.material = place.first->second;
      }
    }
    for (const auto &e : element) left_out += e.second.element.material < 0;
  }
};

/* Rows of the stored matrices: node and direction, in the order of the file */
std::string ReadUnknowns(const std::string &file, std::vector<std::pair<Label, int>> *unknown)
{
  std::ifstream in(file);
  std::string   line;
  if (!in)
    return "cannot read " + file +
           ": there is no such file, or no right to read it (ccx writes it with *FREQUENCY, SOLVER=MATRIXSTORAGE)";
  while (std::getline(in, line)) {
    const std::string text = Trim(line);
    const std::size_t dot  = text.find('.');
    if (text.empty()) continue;
    if (dot == std::string::npos || !IsLabel(text.substr(0, dot)) || !IsLabel(text.substr(dot + 1)))
      return file + ": \"" + text + "\" is not \"node.direction\"";
    const Label direction = std::stoll(text.substr(dot + 1));
    if (direction < 1 || direction > 3)
      return file + ": \"" + text + "\" is not a translation: solid elements alone can be read";
    unknown->push_back({std::stoll(text.substr(0, dot)), (int)direction});
  }
  return unknown->empty() ? file + " has no unknowns" : "";
}

constexpr const char *no_supports = " Supports and constraints (*BOUNDARY, *EQUATION, *MPC, *RIGID BODY, *TIE) have to "
                                    "be left out of the deck whose matrices are "
                                    "stored; attachments take their place";

/* Places of nodes in the model, in the order of their labels, and rows of the unknowns; says what does not fit */
std::string Number(const Deck &deck, const std::vector<std::pair<Label, int>> &unknown, ReadModel *read,
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
             " is not in the deck: CalculiX makes nodes of its own for beams, shells and plane elements, which are not "
             "read";
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

/* Sets of nodes, and sets of elements as sets of their nodes where no set of nodes has the name */
void CollectSets(const Deck &deck, const std::unordered_map<Label, PetscInt> &place, ReadModel *read)
{
  const auto add = [&](const std::string &name, Label l) {
    const auto found = place.find(l);
    if (found != place.end()) read->sets[name].push_back(found->second);
  };
  for (const auto &set : deck.nsets) {
    read->sets[set.second.name];
    for (Label l : set.second.member) add(set.second.name, l);
  }
  for (const auto &set : deck.elsets) {
    if (deck.nsets.count(set.first)) continue;
    read->sets[set.second.name];
    for (Label l : set.second.member) {
      const auto e = deck.element.find(l);
      if (e == deck.element.end()) continue;
      for (Label n : e->second.node) add(set.second.name, n);
    }
  }
}

/* In the order of their labels */
void CollectElements(const Deck &deck, const std::unordered_map<Label, PetscInt> &place, ReadModel *read)
{
  std::vector<Label> labels;
  for (const auto &e : deck.element)
    if (e.second.element.material >= 0) labels.push_back(e.first);
  std::sort(labels.begin(), labels.end());
  for (Label l : labels) {
    const DeckElement &from = deck.element.at(l);
    FeElement          e    = from.element;
    for (int k = 0; k < FeNodes(e.type); k++) e.node[GmshPlace(e.type, k)] = place.at(from.node[(std::size_t)k]);
    read->elements.push_back(e);
  }
  read->materials = deck.materials;
}

std::string ReadDeck(const std::string &stem, ReadModel *read, std::vector<PetscInt> *row, PetscInt64 *left_out)
{
  Deck                                deck;
  std::vector<std::pair<Label, int>>  unknown;
  std::unordered_map<Label, PetscInt> place;
  deck.read(stem + ".inp");
  if (!deck.error.empty()) return deck.error;
  std::string error = ReadUnknowns(stem + ".dof", &unknown);
  if (error.empty() && (error = Number(deck, unknown, read, &place, row)).size()) error = stem + ".dof: " + error;
  if (!error.empty()) return error;
  CollectSets(deck, place, read);
  CollectElements(deck, place, read);
  *left_out = (PetscInt64)deck.left_out;
  return "";
}

/* Both matrices have all rows; a file that ends early has not */
PetscErrorCode ReadMatrix(const FeModel &model, const std::string &file, const std::vector<PetscInt> &row, Mat *A)
{
  MatrixFile  head;
  MatrixShape shape;
  Triplets    triplets;
  PetscFunctionBegin;
  shape.rows = 3 * model.nodes;
  shape.row  = row.empty() ? nullptr : &row;
  PetscCall(OpenMatrix(model.comm, file, &head));
  PetscCheck(head.kind == MatrixFile::Text, model.comm, PETSC_ERR_FILE_UNEXPECTED, "%s is not a matrix of CalculiX",
             file.c_str());
  PetscCall(ReadTriplets(model.comm, head, shape, &triplets));
  PetscCheck(triplets.largest == shape.rows - 1, model.comm, PETSC_ERR_FILE_UNEXPECTED,
             "%s ends with row %" PetscInt_FMT " of %" PetscInt_FMT
             " (truncated, or of another run than the .dof file)",
             file.c_str(), triplets.largest + 1, shape.rows);
  PetscCall(Assemble(model, file, &triplets, A));
  PetscFunctionReturn(0);
}

} // namespace

PetscErrorCode FeModel::readCalculix(const std::string &given)
{
  const bool            deck = given.size() > 4 && given.compare(given.size() - 4, 4, ".inp") == 0;
  const std::string     stem = deck ? given.substr(0, given.size() - 4) : given;
  ReadModel             read;
  std::vector<PetscInt> row;
  std::string           error;
  PetscInt64            head[2] = {0, 0}; /* rows to be renumbered, elements that are not kept */
  PetscMPIInt           rank;
  PetscFunctionBegin;
  PetscCall(CheckUnread(*this));
  PetscCallMPI(MPI_Comm_rank(comm, &rank));
  if (!rank) {
    error     = ReadDeck(stem, &read, &row, &head[1]);
    bool same = true;
    for (std::size_t i = 0; i < row.size(); i++) same = same && row[i] == (PetscInt)i;
    if (same) row.clear(); /* as a rule */
    head[0] = (PetscInt64)row.size();
  }
  PetscCall(Agree(comm, error, PETSC_ERR_FILE_UNEXPECTED));
  PetscCallMPI(MPI_Bcast(head, 2, MPIU_INT64, 0, comm));
  row.resize((std::size_t)head[0]);
  PetscCallMPI(MPI_Bcast(row.data(), (PetscMPIInt)row.size(), MPIU_INT, 0, comm));
  PetscCall(HandOut(read, this));
  source = "CalculiX " + stem;
  if (head[1])
    PetscCall(PetscInfo(nullptr,
                        "%lld elements of %s have no stress: of another kind, or without an isotropic material\n",
                        (long long)head[1], stem.c_str()));
  PetscCall(ReadMatrix(*this, stem + ".sti", row, &K));
  PetscCall(ReadMatrix(*this, stem + ".mas", row, &M));
  PetscFunctionReturn(0);
}

} // namespace hhtdae
