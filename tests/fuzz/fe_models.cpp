/* Whether a finite-element model that was read is possible */
#include "fe_models.h"
#include "hhtdae/flexible.h"
#include <algorithm>
#include <cmath>

namespace hhtfuzz
{

namespace
{

using namespace hhtdae;

std::string NonsenseMatrix(const char *name, Mat A, PetscInt rows)
{
  PetscInt m = 0, n = 0;
  if (!A || MatGetSize(A, &m, &n) || m != rows || n != rows) return std::string(name) + " is not there, or not square";
  for (PetscInt i = 0; i < m; i++) {
    PetscInt           count;
    const PetscInt    *column;
    const PetscScalar *value;
    if (MatGetRow(A, i, &count, &column, &value)) return std::string(name) + " has a row that cannot be had";
    for (PetscInt k = 0; k < count; k++) {
      if (column[k] < 0 || column[k] >= n || (k && column[k] <= column[k - 1])) return std::string(name) + " has impossible columns";
      if (!std::isfinite(value[k])) return std::string(name) + " has entries that are not finite";
    }
    if (MatRestoreRow(A, i, &count, &column, &value)) return std::string(name) + " has a row that cannot be had";
  }
  return "";
}

std::string NonsenseNodes(const FeModel &m)
{
  if (m.nodes < 1 || m.own != m.nodes || m.first) return "numbers of nodes";
  if (!m.coordinates.empty() && (PetscInt)m.coordinates.size() != 3 * m.nodes) return "not three coordinates for each node";
  for (double x : m.coordinates)
    if (!std::isfinite(x)) return "coordinates that are not finite";
  std::vector<PetscInt> labels = m.label;
  std::sort(labels.begin(), labels.end());
  if ((PetscInt)labels.size() != m.nodes || labels.front() < 0 ||
      std::adjacent_find(labels.begin(), labels.end()) != labels.end())
    return "labels that are missing, negative or there twice";
  for (const auto &set : m.sets)
    for (std::size_t k = 0; k < set.second.size(); k++)
      if (set.second[k] < 0 || set.second[k] >= m.nodes || (k && set.second[k] <= set.second[k - 1]))
        return "a set with impossible members";
  return "";
}

std::string NonsenseElements(const FeModel &m)
{
  for (const Material &s : m.materials)
    if (!(s.young > 0 && s.poisson > -1 && s.poisson < .5 && s.density >= 0) || !std::isfinite(s.young) ||
        !std::isfinite(s.density))
      return "an impossible material";
  for (const FeElement &e : m.elements) {
    if ((unsigned)e.type > 3 || e.material < 0 || e.material >= (PetscInt)m.materials.size()) return "an impossible element";
    for (int k = 0; k < FeNodes(e.type); k++)
      if (e.node[k] < 0 || e.node[k] >= m.nodes) return "an element with an impossible node";
  }
  return "";
}

} // namespace

std::string Nonsense(const FeModel &m)
{
  std::string why = NonsenseNodes(m);
  if (why.empty()) why = NonsenseElements(m);
  if (why.empty()) why = NonsenseMatrix("K", m.K, 3 * m.nodes);
  if (why.empty()) why = NonsenseMatrix("M", m.M, 3 * m.nodes);
  return why;
}

} // namespace hhtfuzz
