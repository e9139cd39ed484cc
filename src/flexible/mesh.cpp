/*
  FeModel::readMesh: from a Gmsh file to distributed nodes, elements, sets, K and M.

  Each rank parses its share of the file (mesh_file.cpp). The graph of cells that share a face is divided by a
  PetscPartitioner (partitioner.cpp), and a DMPlex with the cells and all their nodes, including middle ones, is distributed
  accordingly. A PetscSection with one dof on each node numbers the nodes and determines their owners. No rank ever holds
  the whole mesh.

  The DMPlex has no faces and edges, and PETSc can partition such a mesh on one rank only, so that the graph is built here. In
  return one mesh may contain tetrahedra and bricks, linear and quadratic, and the nodes are exactly those of the file.
*/
#include "flexible/assembly.h"
#include "flexible/element_shapes.h"
#include "flexible/exchange.h"
#include "flexible/mesh_nodes.h"
#include "flexible/partitioner.h"
#include <algorithm>
#include <array>
#include <petscdmplex.h>

namespace hhtdae
{

namespace
{

/* ---- cells that share faces ---- */

struct FaceRecord {
  PetscInt corner[4], cell, tag;
  bool     sameFace(const FaceRecord &o) const { return std::equal(corner, corner + 4, o.corner); }
  bool     operator<(const FaceRecord &o) const
  {
    return sameFace(o) ? cell < o.cell : std::lexicographical_compare(corner, corner + 4, o.corner, o.corner + 4);
  }
};

struct FaceLink {
  PetscInt cell, neighbour, tag;
  bool     operator<(const FaceLink &o) const { return cell != o.cell ? cell < o.cell : neighbour < o.neighbour; }
};

template <class Shape> void AddFaces(const MeshCell &cell, PetscInt number, std::vector<std::vector<FaceRecord>> &out)
{
  for (int f = 0; f < Shape::faces; f++) {
    FaceRecord record{{-1, -1, -1, -1}, number, cell.tag};
    for (int i = 0; i < Shape::perface; i++) record.corner[i] = cell.node[Shape::face[f][i]];
    std::sort(record.corner, record.corner + Shape::perface);
    if (std::unique(record.corner, record.corner + Shape::perface) - record.corner < 3) continue; /* degenerated to an edge or a point */
    out[record.corner[0] % out.size()].push_back(record);
  }
}

std::vector<FaceLink> LinksOf(const FaceRecord *from, const FaceRecord *to)
{
  std::vector<FaceLink> links;
  for (const FaceRecord *a = from; a < to; a++)
    for (const FaceRecord *b = from; b < to; b++)
      if (a != b) links.push_back({a->cell, b->cell, b->tag});
  return links;
}

const char *const overlapping =
    ", so that they overlap (msh 2.2 writes an element of two physical groups twice; msh 4.1 does not)";

/* Global numbers of the neighbours of this rank's cells */
PetscErrorCode CellGraph(MPI_Comm comm, const std::string &file, const std::vector<MeshCell> &cells,
                         std::vector<PetscInt> &start, std::vector<PetscInt> &adjacent)
{
  PetscMPIInt              size, rank;
  std::vector<PetscInt>    counts;
  std::vector<FaceRecord>  faces;
  std::vector<FaceLink>    links;
  std::vector<std::size_t> unused;
  std::string              problem;
  PetscFunctionBegin;
  PetscCallMPI(MPI_Comm_size(comm, &size));
  PetscCallMPI(MPI_Comm_rank(comm, &rank));
  PetscCall(GatherAll(comm, std::vector<PetscInt>{(PetscInt)cells.size()}, &counts));
  std::vector<PetscInt> offset(size + 1, 0);
  for (int r = 0; r < size; r++) offset[r + 1] = offset[r] + counts[r];
  {
    std::vector<std::vector<FaceRecord>> out(size);
    for (std::size_t c = 0; c < cells.size(); c++)
      fe::WithShape(cells[c].type,
                    [&](auto shape) { AddFaces<decltype(shape)>(cells[c], offset[rank] + (PetscInt)c, out); });
    PetscCall(Exchange(comm, out, &faces, &unused));
  }
  std::sort(faces.begin(), faces.end());
  {
    std::vector<std::vector<FaceLink>> out(size);
    for (std::size_t a = 0, b; a < faces.size(); a = b) {
      for (b = a + 1; b < faces.size() && faces[b].sameFace(faces[a]); b++) {
      }
      if (b - a > 2 && problem.empty())
        problem = "mesh " + file + ": elements " + std::to_string(faces[a].tag) + ", " +
                  std::to_string(faces[a + 1].tag) + " and " + std::to_string(faces[a + 2].tag) +
                  " share one face" + overlapping;
      if (b - a > 2) continue; /* the number of links would grow with the square of that of the elements */
      for (const FaceLink &l : LinksOf(&faces[a], &faces[a] + (b - a)))
        out[std::upper_bound(offset.begin(), offset.end(), l.cell) - offset.begin() - 1].push_back(l);
    }
    std::vector<FaceRecord>().swap(faces);
    PetscCall(Agree(comm, problem));
    PetscCall(Exchange(comm, out, &links, &unused));
  }
  std::sort(links.begin(), links.end());
  start.assign(cells.size() + 1, 0);
  adjacent.clear();
  for (std::size_t k = 0; k < links.size(); k++) {
    const PetscInt cell = links[k].cell - offset[rank];
    if (k && links[k].cell == links[k - 1].cell && links[k].neighbour == links[k - 1].neighbour && problem.empty())
      problem = "mesh " + file + ": elements " + std::to_string(cells[cell].tag) + " and " +
                std::to_string(links[k].tag) +
                " share more than one face" + overlapping;
    start[cell + 1]++;
    adjacent.push_back(links[k].neighbour);
  }
  for (std::size_t c = 0; c < cells.size(); c++) start[c + 1] += start[c];
  PetscCall(Agree(comm, problem));
  PetscFunctionReturn(0);
}

/* ---- the distributed mesh ---- */

struct PointData { /* a, b, c of a cell: tag, region, type; a of a node: its index in the directory */
  PetscInt a, b, c;
};

/* Builds a DMPlex with cells and their nodes as points; the point SF identifies nodes shared by cells of several ranks */
PetscErrorCode BuildPlex(MPI_Comm comm, const MeshFile &mesh, PetscInt nodes, DM *dm, std::vector<PointData> *data)
{
  const PetscInt        cells = (PetscInt)mesh.cells.size();
  std::vector<PetscInt> used, cone;
  PetscLayout           layout;
  PetscSF               sf;
  PetscFunctionBegin;
  for (const MeshCell &c : mesh.cells) used.insert(used.end(), c.node, c.node + FeNodes(c.type));
  std::sort(used.begin(), used.end());
  used.erase(std::unique(used.begin(), used.end()), used.end());
  const PetscInt count = (PetscInt)used.size();

  PetscCall(DMCreate(comm, dm));
  PetscCall(DMSetType(*dm, DMPLEX));
  PetscCall(DMSetDimension(*dm, 3));
  PetscCall(DMPlexSetChart(*dm, 0, cells + count));
  for (PetscInt c = 0; c < cells; c++) PetscCall(DMPlexSetConeSize(*dm, c, FeNodes(mesh.cells[c].type)));
  PetscCall(DMSetUp(*dm));
  data->assign(cells + count + 1, {});
  for (PetscInt c = 0; c < cells; c++) {
    const MeshCell &cell = mesh.cells[c];
    cone.clear();
    for (int i = 0; i < FeNodes(cell.type); i++)
      cone.push_back(cells + (PetscInt)(std::lower_bound(used.begin(), used.end(), cell.node[i]) - used.begin()));
    PetscCall(DMPlexSetCone(*dm, c, cone.data()));
    (*data)[c] = {cell.tag, cell.region, (PetscInt)cell.type};
  }
  for (PetscInt v = 0; v < count; v++) (*data)[cells + v] = {used[v], 0, 0};
  PetscCall(DMPlexSymmetrize(*dm));
  PetscCall(DMPlexStratify(*dm));
  /* PETSc cannot infer the cell type from ten or twenty vertices; set it */
  PetscCall(DMCreateLabel(*dm, "celltype"));
  for (PetscInt c = 0; c < cells; c++) {
    const ElementType t = mesh.cells[c].type;
    PetscCall(DMPlexSetCellType(*dm, c,
                                t == ElementType::Brick8 || t == ElementType::Brick20 ? DM_POLYTOPE_HEXAHEDRON
                                                                                      : DM_POLYTOPE_TETRAHEDRON));
  }
  for (PetscInt v = 0; v < count; v++) PetscCall(DMPlexSetCellType(*dm, cells + v, DM_POLYTOPE_POINT));

  PetscCall(PetscLayoutCreate(comm, &layout));
  PetscCall(PetscLayoutSetSize(layout, nodes));
  PetscCall(PetscLayoutSetBlockSize(layout, 1));
  PetscCall(PetscLayoutSetUp(layout));
  used.reserve(1);
  PetscCall(PetscSFCreateByMatchingIndices(layout, count, used.data(), nullptr, cells, count, used.data(), nullptr,
                                           cells, nullptr, &sf));
  PetscCall(DMSetPointSF(*dm, sf));
  PetscCall(PetscSFDestroy(&sf));
  PetscCall(PetscLayoutDestroy(&layout));
  PetscFunctionReturn(0);
}

/* Moves every cell to the rank of its part, with its nodes and the data of both */
PetscErrorCode DistributePlex(MPI_Comm comm, const std::vector<PetscInt> &rank_of, DM *dm, std::vector<PointData> *data)
{
  const PetscInt   cells = (PetscInt)rank_of.size();
  PetscMPIInt      size;
  PetscPartitioner shell;
  PetscSF          migration;
  DM               moved;
  PetscInt         start, end;
  PetscFunctionBegin;
  PetscCallMPI(MPI_Comm_size(comm, &size));
  if (size == 1) PetscFunctionReturn(0);
  std::vector<PetscInt> count(size, 0), offset(size + 1, 0), order(cells + 1);
  for (PetscInt r : rank_of) count[r]++;
  for (int r = 0; r < size; r++) offset[r + 1] = offset[r] + count[r];
  for (PetscInt c = 0; c < cells; c++) order[offset[rank_of[c]]++] = c;

  PetscCall(PetscPartitionerCreate(comm, &shell));
  PetscCall(PetscPartitionerSetType(shell, PETSCPARTITIONERSHELL));
  PetscCall(PetscPartitionerShellSetPartition(shell, size, count.data(), order.data()));
  PetscCall(DMPlexSetPartitioner(*dm, shell));
  PetscCall(PetscPartitionerDestroy(&shell));
  PetscCall(DMPlexDistribute(*dm, 0, &migration, &moved));
  PetscCheck(moved, comm, PETSC_ERR_PLIB, "DMPlexDistribute() did not distribute the mesh");
  PetscCall(DMDestroy(dm));
  *dm = moved;
  PetscCall(DMPlexGetChart(*dm, &start, &end));
  std::vector<PointData>        here(end + 1);
  const detail::Type<PointData> type;
  PetscCall(PetscSFBcastBegin(migration, type.type, data->data(), here.data(), MPI_REPLACE));
  PetscCall(PetscSFBcastEnd(migration, type.type, data->data(), here.data(), MPI_REPLACE));
  PetscCall(PetscSFDestroy(&migration));
  data->swap(here);
  PetscFunctionReturn(0);
}

/* Global numbers of the points that are nodes of this rank's cells; own nodes are model->first to model->first + model->own - 1 */
PetscErrorCode NumberNodes(DM dm, FeModel *model, std::vector<PetscInt> *number, std::vector<bool> *own)
{
  PetscInt     start, end, first, last;
  PetscSection section, global;
  PetscFunctionBegin;
  PetscCall(DMPlexGetChart(dm, &start, &end));
  PetscCall(DMPlexGetDepthStratum(dm, 0, &first, &last));
  PetscCall(PetscSectionCreate(PetscObjectComm((PetscObject)dm), &section));
  PetscCall(PetscSectionSetChart(section, start, end));
  for (PetscInt p = first; p < last; p++) PetscCall(PetscSectionSetDof(section, p, 1));
  PetscCall(PetscSectionSetUp(section));
  PetscCall(DMSetLocalSection(dm, section));
  PetscCall(PetscSectionDestroy(&section));
  PetscCall(DMGetGlobalSection(dm, &global));
  number->assign(end, -1);
  own->assign(end, false);
  model->own = 0;
  for (PetscInt p = first; p < last; p++) {
    PetscInt at;
    PetscCall(PetscSectionGetOffset(global, p, &at));
    (*own)[p]    = at >= 0;
    (*number)[p] = at >= 0 ? at : -(at + 1);
    if (at >= 0) model->own++;
  }
  PetscCallMPI(MPI_Scan(&model->own, &model->first, 1, MPIU_INT, MPI_SUM, model->comm));
  model->first -= model->own;
  PetscCallMPI(MPI_Allreduce(&model->own, &model->nodes, 1, MPIU_INT, MPI_SUM, model->comm));
  PetscFunctionReturn(0);
}

/* ---- materials ---- */

PetscErrorCode CheckMaterials(MPI_Comm comm, const std::map<std::string, Material> &materials)
{
  PetscFunctionBegin;
  PetscCheck(!materials.empty(), comm, PETSC_ERR_ARG_WRONG,
             "no material is given: name one for each physical volume, or \"\" for all");
  for (const auto &m : materials) {
    PetscCheck(m.second.young > 0, comm, PETSC_ERR_ARG_OUTOFRANGE,
               "material \"%s\": Young's modulus %g must be positive", m.first.c_str(), m.second.young);
    PetscCheck(m.second.poisson > -1 && m.second.poisson < .5, comm, PETSC_ERR_ARG_OUTOFRANGE,
               "material \"%s\": Poisson's ratio %g must be between -1 and 0.5", m.first.c_str(), m.second.poisson);
    PetscCheck(m.second.density > 0, comm, PETSC_ERR_ARG_OUTOFRANGE, "material \"%s\": density %g must be positive",
               m.first.c_str(), m.second.density);
    PetscCheck(PetscIsNormalReal(m.second.young) && PetscIsNormalReal(m.second.density), comm, PETSC_ERR_ARG_OUTOFRANGE,
               "material \"%s\": Young's modulus and density must be finite", m.first.c_str());
  }
  PetscFunctionReturn(0);
}

std::string VolumeNames(const MeshFile &mesh)
{
  std::string names;
  for (const MeshGroup &g : mesh.groups)
    if (g.dim == 3) names += (names.empty() ? "\"" : ", \"") + g.name + "\"";
  return names.empty() ? "none" : names;
}

/* Index of the material of every region of volumes, or -1 if none is given */
PetscErrorCode MaterialsOfRegions(MPI_Comm comm, const std::string &file, const MeshFile &mesh,
                                  const std::map<std::string, Material> &materials, std::vector<PetscInt> *of)
{
  PetscFunctionBegin;
  for (const auto &m : materials) {
    bool known = m.first.empty();
    for (const MeshGroup &g : mesh.groups) known = known || (g.dim == 3 && g.name == m.first);
    PetscCheck(known, comm, PETSC_ERR_ARG_WRONG,
               "mesh %s: there is a material for \"%s\", but no such physical volume; there are: %s", file.c_str(),
               m.first.c_str(), VolumeNames(mesh).c_str());
  }
  of->assign(mesh.regions.size(), -1);
  for (std::size_t r = 0; r < mesh.regions.size(); r++) {
    if (mesh.regions[r].dim != 3) continue;
    for (int g : mesh.regions[r].groups) {
      const auto found = materials.find(mesh.groups[g].name);
      if (found == materials.end()) continue;
      const PetscInt m = (PetscInt)std::distance(materials.begin(), found);
      PetscCheck((*of)[r] < 0 || (*of)[r] == m, comm, PETSC_ERR_ARG_WRONG,
                 "mesh %s: volume %d is in physical volumes with two materials, of which \"%s\" is one", file.c_str(),
                 mesh.regions[r].tag, found->first.c_str());
      (*of)[r] = m;
    }
    if ((*of)[r] < 0 && materials.count("")) (*of)[r] = 0; /* "" comes first in a map */
  }
  PetscFunctionReturn(0);
}

PetscErrorCode CheckCells(MPI_Comm comm, const std::string &file, const MeshFile &mesh,
                          const std::vector<PetscInt> &material)
{
  long long   count = (long long)mesh.cells.size(), all;
  std::string problem;
  PetscFunctionBegin;
  PetscCallMPI(MPI_Allreduce(&count, &all, 1, MPI_LONG_LONG, MPI_SUM, comm));
  PetscCheck(all, comm, PETSC_ERR_FILE_UNEXPECTED,
             "mesh %s: none of its %lld elements is a volume element; make a mesh of volumes (gmsh -3), and where "
             "there are physical groups, "
             "volumes have to be in one",
             file.c_str(), (long long)mesh.elements);
  for (const MeshCell &c : mesh.cells)
    if (material[c.region] < 0) {
      const MeshRegion &region = mesh.regions[c.region];
      problem =
          "mesh " + file + ": element " + std::to_string(c.tag) + " has no material: " +
          (region.groups.empty() ? "it is in no physical volume"
                                 : "none is given for physical volume \"" + mesh.groups[region.groups[0]].name + "\"") +
          "; physical volumes: " + VolumeNames(mesh) + "; the material \"\" serves all others";
      break;
    }
  PetscCall(Agree(comm, problem, PETSC_ERR_ARG_WRONG));
  PetscFunctionReturn(0);
}

/* ---- filling the model ---- */

PetscErrorCode FillElements(DM dm, const std::vector<PointData> &data, const std::vector<PetscInt> &number,
                            const std::vector<PetscInt> &material, FeModel *model, std::vector<PetscInt> *tags)
{
  PetscInt        start, end;
  const PetscInt *cone;
  PetscFunctionBegin;
  PetscCall(DMPlexGetHeightStratum(dm, 0, &start, &end));
  model->elements.clear();
  for (PetscInt c = start; c < end; c++) {
    PetscInt cone_size;
    PetscCall(DMPlexGetConeSize(dm, c, &cone_size));
    if (!cone_size) continue; /* on a rank without cells the stratum of height 0 may contain nodes */
    FeElement e{};
    e.type     = (ElementType)data[c].c;
    e.material = material[data[c].b];
    PetscCall(DMPlexGetCone(dm, c, &cone));
    for (int i = 0; i < FeNodes(e.type); i++) e.node[i] = number[cone[i]];
    model->elements.push_back(e);
    tags->push_back(data[c].a);
  }
  PetscFunctionReturn(0);
}

/* Names of the node sets of groups. In Gmsh numbers and names of groups are unique for each dimension only, so that a surface and a volume may share a name. A common set
   would tie an attachment to the whole body instead of its surface; shared names get the dimension as a prefix. */
std::vector<std::string> SetNames(const MeshFile &mesh)
{
  static const char *const kind[] = {"point ", "curve ", "surface ", "volume "};
  std::vector<std::string> names;
  for (const MeshGroup &g : mesh.groups) {
    bool shared = false;
    for (const MeshGroup &other : mesh.groups) shared = shared || (other.name == g.name && other.dim != g.dim);
    names.push_back((shared ? kind[g.dim] : "") + g.name);
  }
  return names;
}

PetscErrorCode FillNodesAndSets(const MeshFile &mesh, const MeshNodes &nodes, const std::vector<PointData> &data,
                                const std::vector<PetscInt> &number, const std::vector<bool> &own, FeModel *model)
{
  std::vector<PetscInt>          index(model->own);
  std::vector<MeshPoint>         points;
  std::vector<MeshMember>        regions;
  const std::vector<std::string> names = SetNames(mesh);
  PetscFunctionBegin;
  for (std::size_t p = 0; p < own.size(); p++)
    if (own[p]) index[number[p] - model->first] = data[p].a;
  PetscCall(nodes.ask(index, &points, &regions));
  model->coordinates.clear();
  model->label.clear();
  for (const MeshPoint &p : points) {
    model->coordinates.insert(model->coordinates.end(), p.x, p.x + 3);
    model->label.push_back(p.tag);
  }
  model->sets.clear();
  for (const std::string &name : names) model->sets[name];
  for (const MeshMember &m : regions)
    for (int g : mesh.regions[m.region].groups) model->sets[names[g]].push_back(model->first + m.node);
  for (auto &s : model->sets) {
    std::sort(s.second.begin(), s.second.end());
    s.second.erase(std::unique(s.second.begin(), s.second.end()), s.second.end());
  }
  PetscFunctionReturn(0);
}

} // namespace

PetscErrorCode FeModel::readMesh(const std::string &file, const std::map<std::string, Material> &materials_by_name)
{
  MeshFile               mesh;
  MeshNodes              mesh_nodes(comm);
  std::vector<PetscInt>  material, start, adjacent, rank_of, number, tags;
  std::vector<PointData> data;
  std::vector<bool>      mine;
  DM                     dm;
  PetscFunctionBegin;
  PetscCall(CheckMaterials(comm, materials_by_name));
  PetscCall(ReadGmsh(comm, file, &mesh));
  PetscCall(MaterialsOfRegions(comm, file, mesh, materials_by_name, &material));
  PetscCall(CheckCells(comm, file, mesh, material));
  PetscCall(mesh_nodes.build(file, &mesh));
  PetscCall(CellGraph(comm, file, mesh.cells, start, adjacent));
  PetscCall(PartitionCells(comm, start, adjacent, &rank_of));
  PetscCall(BuildPlex(comm, mesh, mesh_nodes.count(), &dm, &data));
  std::vector<MeshCell>().swap(mesh.cells);
  PetscCall(DistributePlex(comm, rank_of, &dm, &data));

  source = file;
  materials.clear();
  for (const auto &m : materials_by_name) materials.push_back(m.second);
  PetscCall(NumberNodes(dm, this, &number, &mine));
  PetscCall(FillElements(dm, data, number, material, this, &tags));
  PetscCall(DMDestroy(&dm));
  PetscCall(FillNodesAndSets(mesh, mesh_nodes, data, number, mine, this));
  PetscCall(AssembleElements(this, tags));
  PetscFunctionReturn(0);
}

} // namespace hhtdae
