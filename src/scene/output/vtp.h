/* VTK's XML file of polygonal data, binary in base64, as in the document "VTK File Formats". */
#ifndef HHTDAE_SCENE_OUTPUT_VTP_H
#define HHTDAE_SCENE_OUTPUT_VTP_H

#include <petscsys.h>
#include <string>
#include <vector>

namespace hhtdae
{

struct PolyData {
  struct Cells {
    std::vector<int> point, end;
  };
  std::vector<float> points; /* x, y, z of each point */
  Cells              lines, polygons;
  std::vector<int>   body;  /* body of each line, then of each polygon; -1: ground */
  std::vector<float> speed; /* speed of that body's centre of mass */
};

PetscErrorCode WriteVTP(const std::string &file, const PolyData &data);
std::string    XMLText(const std::string &text);

} // namespace hhtdae

#endif
