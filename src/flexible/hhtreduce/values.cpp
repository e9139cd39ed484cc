/* Parses the values of hhtreduce's options; functions return an error message, or "" */
#include "options.h"
#include <cctype>
#include <cmath>
#include <cstdlib>
#include <fstream>
#include <sstream>

namespace hhtreduce
{

using namespace hhtdae;

std::vector<std::string> Split(const std::string &text, char separator)
{
  std::vector<std::string> part;
  std::size_t              from = 0, to;
  while ((to = text.find(separator, from)) != std::string::npos) {
    part.push_back(text.substr(from, to - from));
    from = to + 1;
  }
  part.push_back(text.substr(from));
  return part;
}

bool Number(const std::string &text, double *value)
{
  char *end;
  *value = std::strtod(text.c_str(), &end);
  while (std::isspace((unsigned char)*end)) end++;
  return !text.empty() && end != text.c_str() && !*end && std::isfinite(*value);
}

std::string ParseMaterials(const std::string &text, std::map<std::string, Material> *materials)
{
  for (const std::string &part : Split(text, ';')) {
    if (part.empty()) continue;
    const std::size_t        colon  = part.rfind(':');
    const std::string        name   = colon == std::string::npos ? "" : part.substr(0, colon);
    std::vector<std::string> number = Split(colon == std::string::npos ? part : part.substr(colon + 1), ',');
    Material                 m;
    if (number.size() != 3 || !Number(number[0], &m.young) || !Number(number[1], &m.poisson) ||
        !Number(number[2], &m.density))
      return "-material \"" + part + "\" is not E,nu,rho or name:E,nu,rho";
    if (!(m.young > 0) || !(m.poisson > -1 && m.poisson < 0.5) || !(m.density > 0))
      return "-material \"" + part + "\" is not possible: E and rho are above 0, nu is between -1 and 0.5";
    if (!materials->emplace(name, m).second) return "-material gives \"" + name + "\" twice";
  }
  return materials->empty() ? "-material is empty" : "";
}

/* Commas separate attachments, and also coordinates after an @ */
std::string ParseAttachments(const std::string &text, std::vector<Attachment> *attachments)
{
  std::vector<std::string> part = Split(text, ',');
  for (std::size_t i = 0; i < part.size(); i++) {
    Attachment               a;
    const std::size_t        at    = part[i].find('@');
    std::vector<std::string> field = Split(part[i].substr(0, at), ':');
    if (field[0].empty()) return "-attach has an attachment without a name in \"" + part[i] + "\"";
    if (field.size() > 3 || (field.size() == 3 && field[2] != "rigid" && field[2] != "average"))
      return "-attach \"" + part[i] + "\" is not name:set[:rigid|:average][@x,y,z]";
    a.name = field[0];
    a.set  = field.size() > 1 ? field[1] : "";
    a.tie  = field.size() == 3 && field[2] == "average" ? Tie::Average : Tie::Rigid;
    if (at != std::string::npos) {
      a.at_given = i + 2 < part.size() && Number(part[i].substr(at + 1), &a.position[0]) &&
                   Number(part[i + 1], &a.position[1]) && Number(part[i + 2], &a.position[2]);
      if (!a.at_given) return "-attach " + a.name + ": three numbers x,y,z have to follow the @";
      i += 2;
    }
    for (const Attachment &b : *attachments)
      if (b.name == a.name) return "-attach gives " + a.name + " twice";
    attachments->push_back(a);
  }
  return "";
}

std::string ParseNumbers(const std::string &text, std::vector<PetscInt> *numbers)
{
  for (const std::string &part : Split(text, ',')) {
    char      *end, *last;
    const long from = std::strtol(part.c_str(), &end, 10);
    const long to   = *end == '-' ? std::strtol(end + 1, &last, 10) : from;
    if (end == part.c_str() || from < 0 || to < from || to > 2147483647 || (*end == '-' ? last == end + 1 || *last : *end))
      return "\"" + part + "\" is not a number from 0 up or a range as 5-9";
    if (to - from > 1000000) return "\"" + part + "\" is a range of more than a million numbers";
    for (long k = from; k <= to; k++) numbers->push_back((PetscInt)k);
  }
  return "";
}

std::string ParsePressures(const std::string &text, std::vector<LoadCase> *loads)
{
  for (const std::string &part : Split(text, ',')) {
    const std::vector<std::string> field = Split(part, ':');
    LoadCase                       l;
    if (field.size() < 2 || field.size() > 3 || field[0].empty() || field[1].empty() || (field.size() == 3 && field[2] != "follows" && field[2] != "fixed"))
      return "-pressure \"" + part + "\" is not name:set[:follows|:fixed]";
    l.name    = field[0];
    l.surface = field[1];
    l.follows = field.size() < 3 || field[2] == "follows";
    loads->push_back(l);
  }
  return "";
}

/* Reads lines "label fx fy fz"; empty lines and comments after a # are skipped */
std::string ReadLoads(const std::string &text, std::vector<LoadCase> *loads)
{
  for (const std::string &part : Split(text, ',')) {
    const std::size_t colon = part.find(':');
    LoadCase          l;
    if (!colon || colon == std::string::npos || colon + 1 == part.size()) return "-load \"" + part + "\" is not name:file";
    l.name                 = part.substr(0, colon);
    const std::string file = part.substr(colon + 1);
    std::ifstream     in(file);
    std::string       line, word;
    if (!in) return "-load " + l.name + ": " + file + " cannot be read";
    for (long number = 1; std::getline(in, line); number++) {
      std::istringstream  words(line.substr(0, line.find('#')));
      std::vector<double> x;
      double              value = 0;
      bool                good = true;
      while (words >> word) {
        good = good && Number(word, &value);
        x.push_back(value);
      }
      if (x.empty()) continue;
      if (!good || x.size() != 4 || x[0] < 0 || x[0] != std::floor(x[0]) || x[0] > 2147483647.) return file + ", line " + std::to_string(number) + " is not \"label fx fy fz\"";
      l.node.push_back((PetscInt)x[0]);
      l.force.insert(l.force.end(), x.begin() + 1, x.end());
    }
    if (l.node.empty()) return "-load " + l.name + ": " + file + " has no forces";
    loads->push_back(l);
  }
  return "";
}

} // namespace hhtreduce
