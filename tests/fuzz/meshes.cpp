/* Gmsh meshes, format 4.1 and 2.2, text and binary. */
#include "fe_mesh.h"
#include "fe_models.h"
#include "hhtdae/flexible.h"
#include <sstream>

namespace hhtfuzz
{

namespace
{

using namespace hhtdae;

void ReadMesh(const std::string &folder, Answer *a)
{
  FeModel model(PETSC_COMM_SELF);
  a->code = model.readMesh(folder + "/box.msh", {{"", Material{2., 0.3, 7.}}});
  if (!a->code) a->nonsense = Nonsense(model);
}

/* Marks every number that is read: in format 4.1 only the first number of the heads of nodes and elements is read */
std::string MarkedMesh(const std::string &text)
{
  std::istringstream in(text);
  std::string        line, section, out;
  while (std::getline(in, line)) {
    const bool begins = line[0] == '$', numbers = section == "$Nodes" || section == "$Elements" || section == "$Entities";
    if (begins) section = line;
    if (begins || !numbers)
      out += line + "\n";
    else if (section != "$Entities" && out.back() == '\n' && out.size() >= section.size() + 1 &&
             !out.compare(out.size() - section.size() - 1, section.size(), section))
      out += mark + line + "\n"; /* the head */
    else
      out += Marked(line) + "\n";
  }
  return out;
}

hhtest::MeshBox Box(ElementType type, bool two)
{
  hhtest::MeshBox box;
  box.type = type;
  box.nx   = two ? 2 : 1;
  box.ny = box.nz = 1;
  box.two         = two;
  return box;
}

std::vector<Input> GoodText()
{
  std::vector<Input> good;
  for (bool four : {true, false}) {
    for (ElementType t : {ElementType::Brick8, ElementType::Tetrahedron4, ElementType::Tetrahedron10, ElementType::Brick20})
      good.push_back({{{"box.msh", MarkedMesh(hhtest::MeshWriter(Box(t, false)).text(four))}}});
    good.push_back({{{"box.msh", MarkedMesh(hhtest::MeshWriter(Box(ElementType::Brick8, true)).text(four))}}});
  }
  return good;
}

/* Converts the numbers of a text to bytes */
class Converter
{
public:
  Converter(std::istream *in, std::string *out) : in_(*in), out_(*out) {}
  template <class From, class To> From put()
  {
    From v{};
    in_ >> v;
    add((To)v);
    return v;
  }
  long        size() { return put<long, std::uint64_t>(); }
  long        integer() { return put<long, int>(); }
  void        real() { put<double, double>(); }
  long        skip()
  {
    long v = 0;
    in_ >> v;
    return v;
  }
  template <class T> void add(T v) { out_.append(reinterpret_cast<const char *>(&v), sizeof v); }
  template <class F> void times(long n, F f)
  {
    for (long k = 0; k < n; k++) f();
  }

private:
  std::istream &in_;
  std::string  &out_;
};

void Entities(Converter c)
{
  long count[4];
  for (long &n : count) n = c.size();
  for (int dim = 0; dim < 4; dim++)
    c.times(count[dim], [&] {
      c.integer();
      c.times(dim ? 6 : 3, [&] { c.real(); });
      c.times(c.size(), [&] { c.integer(); });
      if (dim) c.times(c.size(), [&] { c.integer(); });
    });
}

void Nodes4(Converter c)
{
  const long blocks = c.size();
  c.times(3, [&] { c.size(); });
  c.times(blocks, [&] {
    c.times(3, [&] { c.integer(); });
    const long n = c.size();
    c.times(n, [&] { c.size(); });
    c.times(3 * n, [&] { c.real(); });
  });
}

void Elements4(Converter c)
{
  const std::map<long, int> nodes = {{15, 1}, {2, 3}, {3, 4}, {4, 4}, {5, 8}};
  const long                blocks = c.size();
  c.times(3, [&] { c.size(); });
  c.times(blocks, [&] {
    c.times(2, [&] { c.integer(); });
    const long type = c.integer();
    const long n    = c.size();
    c.times(n * (1 + nodes.at(type)), [&] { c.size(); });
  });
}

void Nodes2(Converter c, std::string *out)
{
  const long n = c.skip();
  *out += std::to_string(n) + "\n";
  c.times(n, [&] {
    c.integer();
    c.times(3, [&] { c.real(); });
  });
}

/* A block for each element */
void Elements2(Converter c, std::string *out)
{
  const std::map<long, int> nodes = {{15, 1}, {2, 3}, {3, 4}, {4, 4}, {5, 8}};
  const long                n     = c.skip();
  *out += std::to_string(n) + "\n";
  c.times(n, [&] {
    const long label = c.skip(), type = c.skip(), tags = c.skip();
    for (long v : {type, 1L, tags, label}) c.add((int)v);
    c.times(tags + nodes.at(type), [&] { c.integer(); });
  });
}

std::string BinaryMesh(const std::string &text, bool four)
{
  std::istringstream in(text);
  std::string        line, out;
  Converter          c(&in, &out);
  while (std::getline(in, line)) {
    if (line == "4.1 0 8" || line == "2.2 0 8") {
      out += line.replace(4, 1, "1") + "\n";
      c.add((int)1);
      out += "\n";
      continue;
    }
    out += line + "\n";
    if (line == "$Entities") Entities(c);
    if (line == "$Nodes") four ? Nodes4(c) : Nodes2(c, &out);
    if (line == "$Elements") four ? Elements4(c) : Elements2(c, &out);
    if (line == "$Entities" || line == "$Nodes" || line == "$Elements") {
      std::getline(in, line);
      out += "\n";
    }
  }
  return out;
}

std::vector<Input> GoodBinary()
{
  std::vector<Input> good;
  for (bool four : {true, false})
    for (ElementType t : {ElementType::Brick8, ElementType::Tetrahedron4})
      good.push_back({{{"box.msh", BinaryMesh(hhtest::MeshWriter(Box(t, false)).text(four), four), true}}});
  return good;
}

const Register text({"gmsh", GoodText, DamageFiles, ReadMesh}), binary({"gmshbinary", GoodBinary, DamageFiles, ReadMesh});

} // namespace

} // namespace hhtfuzz
