#include "scene/output/vtp.h"
#include "scene/output/base64.h"
#include <cstdint>
#include <cstdio>
#include <cstring>

namespace hhtdae
{

namespace
{

bool BigEndian()
{
  const std::uint16_t one = 1;
  unsigned char       first;
  std::memcpy(&first, &one, 1);
  return first == 0;
}

/* Appends a DataArray element: the number of bytes, then the bytes */
template <class T> void Array(std::string &out, const char *type, const char *name, const char *more, const std::vector<T> &values)
{
  const std::uint64_t        bytes = values.size() * sizeof(T);
  std::vector<unsigned char> raw(sizeof bytes + bytes);
  std::memcpy(raw.data(), &bytes, sizeof bytes);
  if (bytes) std::memcpy(raw.data() + sizeof bytes, values.data(), bytes);
  out += std::string("<DataArray type=\"") + type + "\" Name=\"" + name + "\"" + more + " format=\"binary\">" + Base64(raw.data(), raw.size()) + "</DataArray>\n";
}

void AddCells(std::string &out, const char *name, const PolyData::Cells &c)
{
  out += std::string("<") + name + ">\n";
  Array(out, "Int32", "connectivity", "", c.point);
  Array(out, "Int32", "offsets", "", c.end);
  out += std::string("</") + name + ">\n";
}

} // namespace

std::string XMLText(const std::string &text)
{
  std::string out;
  for (char c : text) {
    if (c == '&') out += "&amp;";
    else if (c == '<') out += "&lt;";
    else if (c == '"') out += "&quot;";
    else out += c;
  }
  return out;
}

PetscErrorCode WriteVTP(const std::string &file, const PolyData &d)
{
  static_assert(sizeof(int) == 4 && sizeof(float) == 4, "the types that the file names");
  std::string out;
  PetscFunctionBegin;
  out = std::string("<?xml version=\"1.0\"?>\n<VTKFile type=\"PolyData\" version=\"1.0\" byte_order=\"") + (BigEndian() ? "BigEndian" : "LittleEndian") +
        "\" header_type=\"UInt64\">\n<PolyData>\n<Piece NumberOfPoints=\"" + std::to_string(d.points.size() / 3) + "\" NumberOfVerts=\"0\" NumberOfLines=\"" +
        std::to_string(d.lines.end.size()) + "\" NumberOfStrips=\"0\" NumberOfPolys=\"" + std::to_string(d.polygons.end.size()) + "\">\n";
  out += "<CellData Scalars=\"speed\">\n";
  Array(out, "Int32", "body", "", d.body);
  Array(out, "Float32", "speed", "", d.speed);
  out += "</CellData>\n<Points>\n";
  Array(out, "Float32", "points", " NumberOfComponents=\"3\"", d.points);
  out += "</Points>\n";
  AddCells(out, "Lines", d.lines);
  AddCells(out, "Polys", d.polygons);
  out += "</Piece>\n</PolyData>\n</VTKFile>\n";
  FILE *f = std::fopen(file.c_str(), "wb");
  PetscCheck(f, PETSC_COMM_SELF, PETSC_ERR_FILE_OPEN, "cannot write the frame %s: does its directory exist?", file.c_str());
  const bool written = std::fwrite(out.data(), 1, out.size(), f) == out.size();
  const bool closed  = std::fclose(f) == 0;
  PetscCheck(written && closed, PETSC_COMM_SELF, PETSC_ERR_FILE_WRITE, "writing the frame %s failed", file.c_str());
  PetscFunctionReturn(0);
}

} // namespace hhtdae
