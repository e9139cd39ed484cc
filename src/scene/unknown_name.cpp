/* Names of unknowns and of their equations, for messages of the integrator. */
#include "extension.h"
#include "model.h"
#include "start.h"
#include <algorithm>

namespace hhtdae
{

namespace
{

std::string NameOfCoordinate(const SceneData &s, const BodyData &b, PetscInt k)
{
  static const char *const position[] = {"x", "y", "z"};
  const int                positions = s.planar ? 2 : 3, all = Coordinates(KindOf(s, b));
  const std::string        of = " of body " + b.name;
  if (k < positions) return position[k] + of;
  if (s.planar) return "angle" + of;
  return k < all ? "rotation " + std::to_string(k - positions + 1) + of : "mode " + std::to_string(k - all + 1) + of;
}

/* Name of the k-th multiplier of a constraint, dropped ones not counted, or of the k-th force state; row: number of the
   part's first row in the element */
std::string NameOfPart(const SceneData &s, PetscInt element, const Part &p, PetscInt k, int row)
{
  const ElementData &e = s.elements[element];
  if (!p.store->isConstraint()) return "component " + std::to_string(row + k + 1) + " of " + e.type + " " + e.name;
  DescribedRows d;
  p.store->describe(s, p.index, s.start.time, d);
  int r = 0;
  for (const unsigned char active = p.store->active(p.index); r < p.store->rows(); r++)
    if (active >> r & 1 && k-- == 0) break;
  return RowName(s, element, row + r, d.name);
}

std::string NameOfElement(const SceneData &s, PetscInt row)
{
  for (std::size_t e = 0; e < s.elements.size(); e++) {
    int before[2] = {0, 0}; /* numbers of rows of previous parts: of forces (0) and of constraints (1) */
    for (const Part &p : s.elements[e].parts) {
      const PetscInt k = p.index < (PetscInt)p.store->start.size() ? row - p.store->start[p.index] : -1; /* elements added after the set-up have no unknowns */
      int           &n = before[p.store->isConstraint()];
      if (k >= 0 && k < p.store->unknowns(p.index)) return NameOfPart(s, (PetscInt)e, p, k, n);
      n += p.store->rows();
    }
  }
  return "";
}

/* Unknowns of extensions are the last ones of every rank */
std::string NameOfExtension(const Model &M, PetscInt row)
{
  const std::vector<PetscInt> &first = M.number.first;
  const PetscMPIInt            rank  = (PetscMPIInt)(std::upper_bound(first.begin(), first.end(), row) - first.begin()) - 1;
  const Extension             *of    = nullptr;
  for (const auto &x : M.scene.extensions)
    if (rank < M.size && row >= x->start[rank]) of = x.get();
  return of ? of->nameOf(rank, row - of->start[rank]) : "";
}

} // namespace

std::string UnknownName(const Model &M, PetscInt row)
{
  const SceneData &s = M.scene;
  for (std::size_t b = 0; b < M.number.body.size(); b++) {
    const PetscInt k = row - M.number.body[b];
    if (M.number.body[b] >= 0 && k >= 0 && k < CoordinatesOf(s, s.bodies[b])) return NameOfCoordinate(s, s.bodies[b], k);
  }
  for (std::size_t i = 0; i < M.number.variable.size(); i++)
    if (M.number.variable[i] == row) return "variable " + s.variables[i].name;
  for (std::size_t i = 0; i < M.number.state.size(); i++)
    if (M.number.state[i] == row) return "state " + s.states[i].name;
  const std::string element = NameOfElement(s, row);
  return element.empty() ? NameOfExtension(M, row) : element;
}

} // namespace hhtdae
