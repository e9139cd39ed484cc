/* Reads an input deck of CalculiX: keywords with their parameters, data lines, and finally the materials of elements by *SOLID SECTION. */
#include "flexible/calculix.h"
#include "flexible/read_text.h"
#include <algorithm>
#include <fstream>
#include <sys/stat.h>

namespace hhtdae
{
namespace calculix
{

namespace
{

std::string Upper(std::string text)
{
  for (char &c : text) c = (char)std::toupper((unsigned char)c);
  return text;
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

} // namespace

std::string Trim(const std::string &text)
{
  const std::size_t from = text.find_first_not_of(" \t\r\""), to = text.find_last_not_of(" \t\r\"");
  return from == std::string::npos ? "" : text.substr(from, to - from + 1);
}

bool IsLabel(const std::string &text)
{
  return !text.empty() && text.find_first_not_of("0123456789") == std::string::npos && text.size() < 18;
}

void Deck::read(const std::string &file)
{
  deck_ = file;
  readFile(file, "", 0);
  endElement();
  checkMaterials();
  if (error.empty()) assignMaterials();
}

void Deck::fail(const std::string &file, long number, const std::string &why)
{
  if (error.empty()) error = file + ", line " + std::to_string(number) + ": " + why;
}

void Deck::fail(const std::string &why)
{
  if (error.empty()) error = deck_ + ": " + why;
}

/* Bounds on *INCLUDE: files that include others several times multiply with each level */
constexpr int max_inclusions = 16, max_include_depth = 20;

std::string Deck::inclusionProblem(const std::string &file, int depth)
{
  struct stat       about;
  const std::string why = WhyUnreadable(file);
  if (!why.empty()) return why;
  if (depth > max_include_depth)
    return "files are included in one another more than " + std::to_string(max_include_depth) +
           " deep (one includes itself?)";
  if (stat(file.c_str(), &about)) return "there is no such file";
  bytes += (PetscInt64)about.st_size;
  if (++inclusions_[{about.st_dev, about.st_ino}] > max_inclusions)
    return "it is included more than " + std::to_string(max_inclusions) + " times (it includes itself?)";
  return "";
}

void Deck::readFile(const std::string &file, const std::string &from, int depth)
{
  std::ifstream in;
  std::string   line, more, why = inclusionProblem(file, depth);
  long          number = 0;
  if (why.empty()) in.open(file);
  if (why.empty() && !in) why = "it cannot be opened";
  if (!why.empty()) {
    if (error.empty()) error = (from.empty() ? "" : from + ": ") + "cannot read the deck " + file + ": " + why;
    return;
  }
  while (error.empty() && std::getline(in, line)) {
    number++;
    if (line.compare(0, 2, "**") == 0 || Trim(line).empty()) continue;
    if (Trim(line)[0] != '*') {
      data(file, number, Split(line));
      continue;
    }
    line = Trim(line);
    while (line.back() == ',' && std::getline(in, more)) {
      number++;
      line += Trim(more);
    }
    keyword(file, number, line);
    if (keyword_ == "INCLUDE") include(file, number, depth);
  }
  if (error.empty() && in.bad()) error = "reading " + file + " failed";
}

/* Includes a file relative to the including one or, if there is none, relative to the working directory */
void Deck::include(const std::string &file, long number, int depth)
{
  const std::string name   = parameter_["INPUT"],
                    folder = file.find('/') == std::string::npos ? "" : file.substr(0, file.rfind('/') + 1);
  const std::string beside = !name.empty() && name[0] == '/' ? name : folder + name;
  keyword_.clear();
  readFile(WhyUnreadable(beside) == "there is no such file" ? name : beside, file + ", line " + std::to_string(number), depth + 1);
}

void Deck::keyword(const std::string &file, long number, const std::string &line)
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

std::string Deck::open(std::map<std::string, DeckSet> *sets, const std::string &name)
{
  const std::string key = Upper(name);
  DeckSet          &set = (*sets)[key];
  if (set.name.empty()) set.name = name;
  return key;
}

void Deck::data(const std::string &file, long number, const std::vector<std::string> &part)
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

void Deck::nodeLine(const std::string &file, long number, const std::vector<std::string> &part)
{
  Vector3 x    = Vector3::Zero();
  bool    good = !part.empty() && IsLabel(part[0]) && std::stoll(part[0]) <= (Label)PETSC_MAX_INT;
  for (std::size_t k = 1; k < part.size() && k < 4; k++)
    good = good && (part[k].empty() || ParseReal(part[k], &x[(Eigen::Index)k - 1]));
  if (!good) return fail(file, number, "is not \"node, x, y, z\"");
  const Label label = std::stoll(part[0]);
  node[label]       = x;
  if (!into_nset_.empty()) nsets[into_nset_].add(label);
}

void Deck::elementLine(const std::string &file, long number, const std::vector<std::string> &part)
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

/* Stores the element whose numbers are in pending_ */
void Deck::endElement()
{
  if (pending_.empty()) return;
  const Label label = pending_[0];
  if (keyword_ == "ELEMENT" && known_type_ && (int)pending_.size() != kind_.nodes + 1)
    fail("element " + std::to_string(label) + " of type " + type_ + " has " + std::to_string(pending_.size() - 1) +
         " nodes in place of " + std::to_string(kind_.nodes));
  used.insert(pending_.begin() + 1, pending_.end());
  if (!into_elset_.empty()) elsets[into_elset_].add(label);
  if (known_type_) {
    if (element.count(label)) fail("element " + std::to_string(label) + " is there twice");
    DeckElement &e = element[label];
    e.node.assign(pending_.begin() + 1, pending_.end());
    e.element = FeElement{kind_.type, kind_.kept ? -1 : -2, {}};
  }
  pending_.clear();
}

/* A line "first, last, step" of *NSET or *ELSET with GENERATE */
bool Deck::rangeLine(const std::vector<std::string> &part, DeckSet *set)
{
  Label number[3] = {0, 0, 1};
  if (part.size() < 2 || part.size() > 3) return false;
  for (std::size_t k = 0; k < part.size(); k++) {
    if (!IsLabel(part[k])) return false;
    number[k] = std::stoll(part[k]);
  }
  if (number[2] < 1 || number[1] > (Label)PETSC_MAX_INT || number[0] > number[1]) return false;
  set->member.push_back({number[0], number[1], number[2]});
  return true;
}

void Deck::setLine(const std::string &file, long number, const std::vector<std::string> &part,
                   std::map<std::string, DeckSet> *sets, const std::string &into)
{
  if (into.empty()) return fail(file, number, "belongs to a set without a name");
  DeckSet *set = &(*sets)[into];
  if (generate_) {
    if (!rangeLine(part, set)) fail(file, number, "is not \"first, last, step\"");
    return;
  }
  for (const std::string &p : part) {
    if (p.empty()) continue;
    if (IsLabel(p))
      set->add(std::stoll(p));
    else if (!sets->count(Upper(p)) || Upper(p) == into)
      return fail(file, number, "names the set " + p + ", which is not there");
    else {
      const std::vector<DeckRange> &other = (*sets)[Upper(p)].member;
      ranges_ += other.size();
      if (!Budget(bytes).spend(ranges_)) return fail(file, number, "makes sets of sets with more members than a deck of this length can mean");
      set->member.insert(set->member.end(), other.begin(), other.end());
    }
  }
}

void Deck::materialLine(const std::string &file, long number, const std::vector<std::string> &part)
{
  DeckMaterial       &m = material_data_[material_];
  std::vector<double> value;
  for (const std::string &p : part) {
    double v = 0;
    if (!p.empty() && !ParseReal(p, &v)) return fail(file, number, "has \"" + p + "\" in place of a number");
    value.push_back(v);
  }
  if (keyword_ == "DENSITY" && !value.empty()) m.material.density = value[0];
  if (keyword_ == "ELASTIC") m.elastic.insert(m.elastic.end(), value.begin(), value.end());
  /* more than two constants and a temperature: a temperature-dependent or anisotropic material */
  if (keyword_ == "ELASTIC" && (m.elastic.size() > 3 || m.elastic.size() < 2)) m.isotropic = false;
  if (keyword_ == "ELASTIC" && m.isotropic) {
    m.material.young   = m.elastic[0];
    m.material.poisson = m.elastic[1];
  }
}

void Deck::checkMaterials()
{
  for (const auto &m : material_data_) {
    const Material &material = m.second.material;
    const bool      elastic  = m.second.isotropic && !m.second.elastic.empty();
    std::string     why;
    if (elastic && !(material.young > 0)) why = "a modulus of elasticity that is not positive";
    if (elastic && !(material.poisson > -1 && material.poisson < .5)) why = "a Poisson's ratio that is not between -1 and 0.5";
    if (material.density < 0) why = "a negative density";
    if (!why.empty()) fail("material " + m.first + " has " + why);
  }
}

void Deck::assignMaterials()
{
  std::map<std::string, PetscInt> number;
  std::vector<Label>              labels, members;
  Budget                          budget(bytes);
  for (const auto &e : element) labels.push_back(e.first);
  std::sort(labels.begin(), labels.end());
  for (const auto &section : sections_) {
    const auto data = material_data_.find(section.second);
    const auto set  = elsets.find(section.first);
    if (data == material_data_.end() || set == elsets.end() || !data->second.isotropic ||
        data->second.material.young <= 0)
      continue;
    const auto place = number.emplace(section.second, (PetscInt)materials.size());
    if (place.second) materials.push_back(data->second.material);
    if (!Expand(set->second, labels, &budget, &members))
      return fail("sets of elements that *SOLID SECTION names have more members than a deck of this length can mean");
    for (Label l : members) {
      FeElement &e = element.at(l).element;
      if (e.material == -1) e.material = place.first->second;
    }
  }
  for (const auto &e : element) left_out += e.second.element.material < 0;
}

bool Expand(const DeckSet &set, const std::vector<Label> &labels, Budget *budget, std::vector<Label> *found)
{
  found->clear();
  for (const DeckRange &r : set.member) {
    const auto from = std::lower_bound(labels.begin(), labels.end(), r.first),
               to   = std::upper_bound(from, labels.end(), r.last);
    const auto candidates = (std::size_t)((r.last - r.first) / r.step) + 1, there = (std::size_t)(to - from);
    if (!budget->spend(std::min(candidates, there) + 1)) return false;
    if (there <= candidates) {
      for (auto l = from; l != to; ++l)
        if ((*l - r.first) % r.step == 0) found->push_back(*l);
    } else
      for (Label l = r.first; l <= r.last; l += r.step)
        if (std::binary_search(from, to, l)) found->push_back(l);
  }
  std::sort(found->begin(), found->end());
  found->erase(std::unique(found->begin(), found->end()), found->end());
  return true;
}

} // namespace calculix
} // namespace hhtdae
