/* Reads an input deck of CalculiX: keywords with their parameters, lines of data, at the end materials by sections. */
#include "flexible/calculix.h"
#include <algorithm>
#include <cmath>
#include <fstream>

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

bool IsNumber(const std::string &text, double *value)
{
  std::string plain = text;
  for (char &c : plain)
    if (c == 'D' || c == 'd') c = 'e';
  char *end;
  *value = std::strtod(plain.c_str(), &end);
  return !plain.empty() && !*end && std::isfinite(*value);
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
  readFile(file, "", 0);
  endElement();
  assignMaterials();
}

void Deck::fail(const std::string &file, long number, const std::string &why)
{
  if (error.empty()) error = file + ", line " + std::to_string(number) + ": " + why;
}

void Deck::readFile(const std::string &file, const std::string &from, int depth)
{
  std::ifstream in(file);
  std::string   line, more;
  long          number = 0;
  if (!in || depth > 20) {
    if (error.empty())
      error = (from.empty() ? "" : from + ": ") + "cannot read the deck " + file +
              (in ? ": files are included in one another more than 20 deep (one includes itself?)"
                  : ": there is no such file, or no right to read it");
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
void Deck::include(const std::string &file, long number, int depth)
{
  const std::string name   = parameter_["INPUT"],
                    folder = file.find('/') == std::string::npos ? "" : file.substr(0, file.rfind('/') + 1);
  const std::string beside = !name.empty() && name[0] == '/' ? name : folder + name;
  keyword_.clear();
  readFile(std::ifstream(beside) ? beside : name, file + ", line " + std::to_string(number), depth + 1);
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
    good = good && (part[k].empty() || IsNumber(part[k], &x[(Eigen::Index)k - 1]));
  if (!good) return fail(file, number, "is not \"node, x, y, z\"");
  const Label label = std::stoll(part[0]);
  node[label]       = x;
  if (!into_nset_.empty()) nsets[into_nset_].member.push_back(label);
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

/* The element whose numbers have been gathered is complete */
void Deck::endElement()
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

void Deck::setLine(const std::string &file, long number, const std::vector<std::string> &part,
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

void Deck::materialLine(const std::string &file, long number, const std::vector<std::string> &part)
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

void Deck::assignMaterials()
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

} // namespace calculix
} // namespace hhtdae
