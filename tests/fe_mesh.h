/*
  Meshes of a box for tests of finite elements, written as Gmsh writes them, and models read from them.

  The box is divided into nx x ny x nz bricks, or each of these into six tetrahedra. Physical groups: volumes "solid",
  and with `two` for the half of higher x "other"; surfaces "left" and "right", at the ends in x; the point "corner" at
  the origin.
*/
#ifndef HHTDAE_TESTS_FE_MESH_H
#define HHTDAE_TESTS_FE_MESH_H

#include "flexible/element_shapes.h"
#include "support.h"

#include <array>
#include <cstdlib>
#include <fstream>
#include <map>
#include <sstream>
#include <unistd.h>

namespace hhtest
{

using hhtdae::ElementType;
using hhtdae::FeModel;
using hhtdae::Material;
using hhtdae::Vector3;
using Materials = std::map<std::string, Material>;

struct MeshBox {
  ElementType                             type = ElementType::Brick8;
  int                                     nx = 2, ny = 2, nz = 2;
  double                                  lx = 1, ly = 1, lz = 1;
  bool                                    two = false;
  std::function<Vector3(const Vector3 &)> map = [](const Vector3 &x) { return x; };

  bool quadratic() const { return type == ElementType::Tetrahedron10 || type == ElementType::Brick20; }
  bool bricks() const { return type == ElementType::Brick8 || type == ElementType::Brick20; }
};

using Lattice = std::array<int, 3>;

struct BoxCell {
  std::vector<Lattice> node;
  bool                 other;
};

inline Lattice plus(const Lattice &a, const Lattice &b) { return {a[0] + b[0], a[1] + b[1], a[2] + b[2]}; }
inline Lattice middle(const Lattice &a, const Lattice &b)
{
  return {(a[0] + b[0]) / 2, (a[1] + b[1]) / 2, (a[2] + b[2]) / 2};
}

/* Corner nodes, then middle nodes of edges; corners have even lattice coordinates */
template <class Shape> void addCell(const std::vector<Lattice> &corners, bool other, std::vector<BoxCell> &cells)
{
  BoxCell cell{corners, other};
  for (int i = Shape::corners; i < Shape::nodes; i++) {
    const auto &e = Shape::edge[i - Shape::corners];
    cell.node.push_back(middle(corners[e[0]], corners[e[1]]));
  }
  cells.push_back(cell);
}

template <class Shape> std::vector<BoxCell> cellsOf(const MeshBox &box)
{
  std::vector<BoxCell> cells;
  for (int k = 0; k < box.nz; k++)
    for (int j = 0; j < box.ny; j++)
      for (int i = 0; i < box.nx; i++) {
        const Lattice o{2 * i, 2 * j, 2 * k};
        const bool    other = box.two && 2 * i >= box.nx;
        if (Shape::corners == 8) {
          std::vector<Lattice> c;
          for (int v = 0; v < 8; v++) {
            const Vector3 x = Shape::place(v);
            c.push_back(plus(o, {(int)x[0] + 1, (int)x[1] + 1, (int)x[2] + 1}));
          }
          addCell<Shape>(c, other, cells);
          continue;
        }
        const int order[6][3] = {{0, 1, 2}, {1, 2, 0}, {2, 0, 1}, {0, 2, 1}, {1, 0, 2}, {2, 1, 0}};
        for (int t = 0; t < 6; t++) { /* one for each order of the three axes */
          std::vector<Lattice> c{o};
          for (int s = 0; s < 3; s++) {
            Lattice step{0, 0, 0};
            step[order[t][s]] = 2;
            c.push_back(plus(c.back(), step));
          }
          if (t >= 3) std::swap(c[1], c[2]);
          addCell<Shape>(c, other, cells);
        }
      }
  return cells;
}

/* Faces, with middle nodes, of the cells whose corners all have this x */
template <class Shape> std::vector<std::vector<Lattice>> facesAt(const std::vector<BoxCell> &cells, int x)
{
  std::vector<std::vector<Lattice>> faces;
  for (const BoxCell &c : cells)
    for (int f = 0; f < Shape::faces; f++) {
      std::vector<Lattice> face;
      bool                 all = true;
      for (int i = 0; i < Shape::perface; i++) {
        face.push_back(c.node[Shape::face[f][i]]);
        all = all && face.back()[0] == x;
      }
      if (!all) continue;
      if (Shape::nodes > Shape::corners)
        for (int i = 0; i < Shape::perface; i++) face.push_back(middle(face[i], face[(i + 1) % Shape::perface]));
      faces.push_back(face);
    }
  return faces;
}

class MeshWriter
{
public:
  explicit MeshWriter(const MeshBox &box) : box_(box)
  {
    hhtdae::fe::WithShape(box.type, [&](auto shape) {
      using Shape = decltype(shape);
      cells_      = cellsOf<Shape>(box);
      left_       = facesAt<Shape>(cells_, 0);
      right_      = facesAt<Shape>(cells_, 2 * box.nx);
    });
    for (const BoxCell &c : cells_)
      for (const Lattice &l : c.node) used_[tag(l)] = l;
    static const int volume[] = {4, 11, 5, 17}, surface[] = {2, 9, 3, 16};
    volume_ = volume[(int)box.type], surface_ = surface[(int)box.type];
  }
  /* The numbering of nodes has gaps */
  long tag(const Lattice &l) const { return 1 + l[0] + (2L * box_.nx + 1) * (l[1] + (2L * box_.ny + 1) * l[2]); }

  std::string text(bool four) const { return header(four) + nodes(four) + elements(four); }

private:
  MeshBox                               box_;
  std::vector<BoxCell>              cells_;
  std::vector<std::vector<Lattice>> left_, right_;
  std::map<long, Lattice>           used_;
  int                               volume_, surface_;

  std::string header(bool four) const
  {
    std::ostringstream s;
    s << "$MeshFormat\n" << (four ? "4.1" : "2.2") << " 0 8\n$EndMeshFormat\n";
    s << "$PhysicalNames\n" << (box_.two ? 5 : 4) << "\n0 1 \"corner\"\n2 1 \"left\"\n2 2 \"right\"\n3 1 \"solid\"\n";
    if (box_.two) s << "3 2 \"other\"\n";
    s << "$EndPhysicalNames\n";
    if (!four) return s.str();
    s << "$Entities\n1 0 2 " << (box_.two ? 2 : 1) << "\n1 0 0 0 1 1 \n7 0 0 0 0 1 1 1 1 0 \n8 1 0 0 1 1 1 1 2 0 \n";
    s << "5 0 0 0 1 1 1 1 1 2 7 8 \n";
    if (box_.two) s << "6 0 0 0 1 1 1 1 2 0 \n";
    s << "$EndEntities\n";
    return s.str();
  }
  Vector3 at(const Lattice &l) const
  {
    return box_.map(
        Vector3(box_.lx * l[0] / (2. * box_.nx), box_.ly * l[1] / (2. * box_.ny), box_.lz * l[2] / (2. * box_.nz)));
  }
  std::string point(long t, const Vector3 &x, bool four) const
  {
    return four ? hhtest::text("%.17g %.17g %.17g\n", x[0], x[1], x[2])
                : hhtest::text("%ld %.17g %.17g %.17g\n", t, x[0], x[1], x[2]);
  }
  /* in two blocks, with one node that belongs to no element */
  std::string nodes(bool four) const
  {
    const long  unused = 1000000;
    std::string tags, places, s = "$Nodes\n";
    for (const auto &u : used_) {
      tags += std::to_string(u.first) + "\n";
      places += point(u.first, at(u.second), four);
    }
    if (four) {
      s += hhtest::text("2 %zu 1 %ld\n3 5 0 %zu\n", used_.size() + 1, unused, used_.size()) + tags + places;
      s += hhtest::text("0 1 0 1\n%ld\n9 9 9\n", unused);
    } else
      s += hhtest::text("%zu\n", used_.size() + 1) + places + point(unused, Vector3(9, 9, 9), false);
    return s + "$EndNodes\n";
  }
  std::string elements(bool four) const
  {
    std::string s     = "$Elements\n";
    long        count = 0, halves[2] = {0, 0};
    for (const BoxCell &c : cells_) halves[c.other]++;
    const long all = 1 + (long)left_.size() + (long)right_.size() + (long)cells_.size();
    const auto add = [&](int type, int physical, int entity, const std::vector<Lattice> &nodes) {
      s += four ? hhtest::text("%ld", ++count) : hhtest::text("%ld %d 2 %d %d", ++count, type, physical, entity);
      for (const Lattice &l : nodes) s += " " + std::to_string(tag(l));
      s += four ? " \n" : "\n";
    };
    const auto block = [&](int dim, int entity, int type, long n) {
      if (four) s += hhtest::text("%d %d %d %ld\n", dim, entity, type, n);
    };
    s += four ? hhtest::text("%d %ld 1 %ld\n", box_.two ? 5 : 4, all, all) : hhtest::text("%ld\n", all);
    block(0, 1, 15, 1);
    add(15, 1, 1, {{0, 0, 0}});
    block(2, 7, surface_, (long)left_.size());
    for (const auto &f : left_) add(surface_, 1, 7, f);
    block(2, 8, surface_, (long)right_.size());
    for (const auto &f : right_) add(surface_, 2, 8, f);
    for (int half = 0; half < (box_.two ? 2 : 1); half++) {
      block(3, 5 + half, volume_, halves[half]);
      for (const BoxCell &c : cells_)
        if (c.other == (bool)half) add(volume_, 1 + half, 5 + half, c.node);
    }
    return s + "$EndElements\n";
  }
};

/* A file written by the first rank and visible to all ranks, removed by the destructor */
class MeshFile
{
public:
  std::string name;

  MeshFile(MPI_Comm comm, const std::string &text, const std::string &end = ".msh") : comm_(comm)
  {
    int pid = (int)getpid(), rank;
    MPI_Comm_rank(comm, &rank);
    MPI_Bcast(&pid, 1, MPI_INT, 0, comm);
    static int  count = 0;
    const char *dir   = std::getenv("TMPDIR");
    name              = hhtest::text("%s/hhtdae_test_%d_%d%s", dir ? dir : "/tmp", pid, count++, end.c_str());
    mine_             = rank == 0;
    if (mine_) std::ofstream(name, std::ios::binary) << text;
    MPI_Barrier(comm);
  }
  ~MeshFile()
  {
    MPI_Barrier(comm_);
    if (mine_) std::remove(name.c_str());
  }
  MeshFile(const MeshFile &) = delete;

private:
  MPI_Comm comm_;
  bool     mine_;
};

inline const Material &softSteel()
{
  static const Material m{2., 0.3, 7.};
  return m;
}

inline PetscErrorCode readText(FeModel &model, const std::string &text,
                               const Materials &materials = {{"", softSteel()}})
{
  MeshFile file(model.comm, text);
  return model.readMesh(file.name, materials);
}

inline PetscErrorCode readBox(FeModel &model, const MeshBox &box, const Materials &materials = {{"", softSteel()}},
                              bool four = true)
{
  return readText(model, MeshWriter(box).text(four), materials);
}

/* A field of displacements at the nodes of this rank */
template <class F> Vec fieldOf(const FeModel &model, F &&f)
{
  Vec          u;
  PetscScalar *a;
  must(MatCreateVecs(model.K, &u, nullptr));
  must(VecGetArray(u, &a));
  for (PetscInt n = 0; n < model.own; n++) {
    const Vector3 v = f(Vector3(Eigen::Map<const Vector3>(&model.coordinates[3 * n])));
    for (int d = 0; d < 3; d++) a[3 * n + d] = v[d];
  }
  must(VecRestoreArray(u, &a));
  return u;
}

inline Vec product(Mat A, Vec x)
{
  Vec y;
  must(VecDuplicate(x, &y));
  must(MatMult(A, x, y));
  return y;
}

inline double dot(Vec a, Vec b)
{
  PetscScalar d;
  must(VecDot(a, b, &d));
  return d;
}

} // namespace hhtest

#endif
