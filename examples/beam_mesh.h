/*
  A straight beam with rectangular section as a finite-element model: a box of equal bricks with 8 or 20 nodes, or each
  of these cut into six tetrahedra with 10. Its axis is the x axis from 0 to its length. Node sets "root" and "tip" are
  its ends. The mesh is written to a file in Gmsh's format, and then read and divided among the ranks like any other mesh.
*/
#ifndef HHTEX_BEAM_MESH_H
#define HHTEX_BEAM_MESH_H

#include <hhtdae/flexible.h>

#include <array>
#include <cstdio>
#include <unistd.h>

namespace hhtex
{

enum class BeamElement { Brick8, Brick20, Tetrahedron10 };

struct SolidBeam {
  double           length = 1, depth = 0.1, width = 0.1; /* along x, y, z */
  int              n[3]    = {10, 1, 1};                 /* bricks along x, y, z */
  BeamElement      element = BeamElement::Brick20;
  hhtdae::Material material;

  double area() const { return depth * width; }
  double Izz() const { return width * depth * depth * depth / 12; } /* bending in the xy plane */
  double Iyy() const { return depth * width * width * width / 12; }
  double shearModulus() const { return material.young / (2 * (1 + material.poisson)); }
  double torsion() const /* constant of a rectangle, to half a percent */
  {
    const double a = std::fmax(depth, width), b = std::fmin(depth, width), r = b / a;
    return a * b * b * b * (1. / 3 - 0.21 * r * (1 - r * r * r * r / 12));
  }
};

/* Nodes stand on a lattice with two steps along each edge of a brick */
class BeamMeshFile
{
public:
  explicit BeamMeshFile(const SolidBeam &beam) : b_(beam) {}

  bool write(const std::string &name)
  {
    out_ = std::fopen(name.c_str(), "w");
    if (!out_) return false;
    std::fprintf(out_,
                 "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$PhysicalNames\n3\n2 1 \"root\"\n2 2 \"tip\"\n3 3 \"beam\"\n"
                 "$EndPhysicalNames\n");
    nodes();
    elements();
    const bool good = !std::ferror(out_);
    return std::fclose(out_) == 0 && good;
  }

private:
  using Place = std::array<int, 3>;
  const SolidBeam b_;
  FILE           *out_   = nullptr;
  long            count_ = 0;

  static Place middle(const Place &p, const Place &q)
  {
    return {(p[0] + q[0]) / 2, (p[1] + q[1]) / 2, (p[2] + q[2]) / 2};
  }
  long tag(const Place &p) const { return 1 + p[2] + (2L * b_.n[2] + 1) * (p[1] + (2L * b_.n[1] + 1) * p[0]); }
  bool used(const Place &p) const
  {
    const int odd = p[0] % 2 + p[1] % 2 + p[2] % 2; /* 1: middle of an edge, 2: of a face, 3: of a brick */
    return b_.element == BeamElement::Tetrahedron10 || odd <= (b_.element == BeamElement::Brick20 ? 1 : 0);
  }
  template <class F> void everyNode(F &&f) const
  {
    for (int i = 0; i <= 2 * b_.n[0]; i++)
      for (int j = 0; j <= 2 * b_.n[1]; j++)
        for (int k = 0; k <= 2 * b_.n[2]; k++)
          if (used({i, j, k})) f(Place{i, j, k});
  }
  void nodes()
  {
    long all = 0;
    everyNode([&](const Place &) { all++; });
    std::fprintf(out_, "$Nodes\n%ld\n", all);
    everyNode([&](const Place &p) {
      std::fprintf(out_, "%ld %.17g %.17g %.17g\n", tag(p), b_.length * p[0] / (2. * b_.n[0]),
                   b_.depth * (p[1] / (2. * b_.n[1]) - 0.5), b_.width * (p[2] / (2. * b_.n[2]) - 0.5));
    });
    std::fprintf(out_, "$EndNodes\n");
  }

  void element(int type, int physical, const std::vector<Place> &corners, const std::vector<std::array<int, 2>> &edges)
  {
    std::fprintf(out_, "%ld %d 2 %d %d", ++count_, type, physical, physical);
    for (const Place &p : corners) std::fprintf(out_, " %ld", tag(p));
    for (const auto &e : edges) std::fprintf(out_, " %ld", tag(middle(corners[e[0]], corners[e[1]])));
    std::fprintf(out_, "\n");
  }
  /* The end face of one brick at an end of the beam, as one or two element faces */
  void face(int physical, const std::vector<Place> &c)
  {
    if (b_.element == BeamElement::Brick8) element(3, physical, c, {});
    if (b_.element == BeamElement::Brick20) element(16, physical, c, {{0, 1}, {1, 2}, {2, 3}, {3, 0}});
    if (b_.element != BeamElement::Tetrahedron10) return;
    element(9, physical, {c[0], c[1], c[2]}, {{0, 1}, {1, 2}, {2, 0}});
    element(9, physical, {c[0], c[2], c[3]}, {{0, 1}, {1, 2}, {2, 0}});
  }
  void brick(const std::vector<Place> &c)
  {
    if (b_.element == BeamElement::Brick8) element(5, 3, c, {});
    if (b_.element == BeamElement::Brick20)
      element(17, 3, c,
              {{0, 1}, {0, 3}, {0, 4}, {1, 2}, {1, 5}, {2, 3}, {2, 6}, {3, 7}, {4, 5}, {4, 7}, {5, 6}, {6, 7}});
    if (b_.element != BeamElement::Tetrahedron10) return;
    /* along the edges from corner 0 to corner 6 in every order of the axes */
    const int paths[6][2] = {{1, 2}, {2, 3}, {3, 7}, {7, 4}, {4, 5}, {5, 1}};
    for (const auto &p : paths)
      element(11, 3, {c[0], c[p[0]], c[p[1]], c[6]}, {{0, 1}, {1, 2}, {2, 0}, {3, 0}, {2, 3}, {1, 3}});
  }
  void elements()
  {
    const int  each = b_.element == BeamElement::Tetrahedron10 ? 6 : 1, face_each = each > 1 ? 2 : 1;
    const long all = (long)b_.n[0] * b_.n[1] * b_.n[2] * each + 2L * b_.n[1] * b_.n[2] * face_each;
    std::fprintf(out_, "$Elements\n%ld\n", all);
    for (int end = 0; end < 2; end++)
      for (int j = 0; j < b_.n[1]; j++)
        for (int k = 0; k < b_.n[2]; k++) {
          const int x = end * 2 * b_.n[0], y = 2 * j, z = 2 * k;
          face(1 + end, {{x, y, z}, {x, y + 2, z}, {x, y + 2, z + 2}, {x, y, z + 2}});
        }
    for (int i = 0; i < b_.n[0]; i++)
      for (int j = 0; j < b_.n[1]; j++)
        for (int k = 0; k < b_.n[2]; k++) {
          const int x = 2 * i, y = 2 * j, z = 2 * k;
          brick({{x, y, z},
                 {x + 2, y, z},
                 {x + 2, y + 2, z},
                 {x, y + 2, z},
                 {x, y, z + 2},
                 {x + 2, y, z + 2},
                 {x + 2, y + 2, z + 2},
                 {x, y + 2, z + 2}});
        }
    std::fprintf(out_, "$EndElements\n");
  }
};

/* The model, with K and M; collective on its communicator */
inline PetscErrorCode ReadSolidBeam(const SolidBeam &beam, hhtdae::FeModel *model)
{
  static int  count = 0; /* several models in one program */
  PetscMPIInt rank;
  char        folder[PETSC_MAX_PATH_LEN];
  int         mark[2] = {(int)getpid(), 1}; /* one name on all ranks; written */
  PetscFunctionBegin;
  PetscCheck(beam.n[0] > 0 && beam.n[1] > 0 && beam.n[2] > 0, model->comm, PETSC_ERR_ARG_OUTOFRANGE,
             "a beam needs one element at least in each direction, not %d, %d, %d", beam.n[0], beam.n[1], beam.n[2]);
  PetscCheck(beam.length > 0 && beam.depth > 0 && beam.width > 0, model->comm, PETSC_ERR_ARG_OUTOFRANGE,
             "length, depth and width of a beam must be positive, not %g, %g, %g", beam.length, beam.depth, beam.width);
  PetscCallMPI(MPI_Comm_rank(model->comm, &rank));
  PetscCall(PetscGetTmp(model->comm, folder, sizeof folder));
  PetscCallMPI(MPI_Bcast(mark, 1, MPI_INT, 0, model->comm));
  const std::string file =
      std::string(folder) + "/beam" + std::to_string(mark[0]) + "_" + std::to_string(count++) + ".msh";
  if (rank == 0) mark[1] = BeamMeshFile(beam).write(file);
  PetscCallMPI(MPI_Bcast(&mark[1], 1, MPI_INT, 0, model->comm));
  PetscCheck(mark[1], model->comm, PETSC_ERR_FILE_WRITE, "cannot write the mesh %s; is the folder full?", file.c_str());
  PetscCall(model->readMesh(file, {{"", beam.material}}));
  PetscCallMPI(MPI_Barrier(model->comm));
  if (rank == 0) std::remove(file.c_str());
  model->source = "beam";
  PetscFunctionReturn(0);
}

} // namespace hhtex

#endif
