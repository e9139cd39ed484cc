/* A box of 8-node bricks as a finite-element model, assembled in parallel, for tests and benchmarks of the reduction */
#ifndef HHTDAE_TESTS_BOX_MODEL_H
#define HHTDAE_TESTS_BOX_MODEL_H

#include "hhtdae/flexible.h"
#include <algorithm>
#include <cmath>
#include <functional>
#include <stdexcept>

namespace hhtest
{

using hhtdae::FeModel;
using hhtdae::Material;
using hhtdae::Matrix3;
using hhtdae::Vector3;

struct Box {
  int                                n[3];
  double                             size[3];
  Material                           material = {2.1e11, 0.3, 7850};
  std::function<bool(int, int, int)> present  = [](int, int, int) { return true; }; /* whether brick (i, j, k) exists */
  std::function<Vector3(Vector3)>    map      = [](Vector3 x) { return x; };        /* position of nodes */
};

inline void boxMust(PetscErrorCode code)
{
  if (code) throw std::runtime_error("PETSc error " + std::to_string((int)code));
}

constexpr int brick_corner[8][3] = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0},
                                    {0, 0, 1}, {1, 0, 1}, {1, 1, 1}, {0, 1, 1}};

/* K (24 x 24) and m_ij (8 x 8) of one brick by 2 x 2 x 2 integration points; written as loops to keep compilation
   short, since 16 sources include this header */
inline void brickMatrices(const double X[8][3], const Material &m, double K[24][24], double M[8][8])
{
  const double lame  = m.young * m.poisson / ((1 + m.poisson) * (1 - 2 * m.poisson)),
               shear = m.young / (2 * (1 + m.poisson));
  std::fill(&K[0][0], &K[0][0] + 24 * 24, 0);
  std::fill(&M[0][0], &M[0][0] + 8 * 8, 0);
  for (int q = 0; q < 8; q++) {
    double  N[8], dN[8][3], G[8][3];
    Matrix3 J = Matrix3::Zero();
    for (int a = 0; a < 8; a++) {
      double f[3], d[3];
      for (int c = 0; c < 3; c++) {
        const double s = 2 * brick_corner[a][c] - 1, xi = (2 * brick_corner[q][c] - 1) / std::sqrt(3.);
        f[c] = (1 + s * xi) / 2;
        d[c] = s / 2;
      }
      N[a]     = f[0] * f[1] * f[2];
      dN[a][0] = d[0] * f[1] * f[2];
      dN[a][1] = f[0] * d[1] * f[2];
      dN[a][2] = f[0] * f[1] * d[2];
      for (int c = 0; c < 3; c++)
        for (int e = 0; e < 3; e++) J(c, e) += dN[a][c] * X[a][e];
    }
    const double  w       = J.determinant();
    const Matrix3 inverse = J.inverse();
    for (int a = 0; a < 8; a++)
      for (int c = 0; c < 3; c++) G[a][c] = inverse(c, 0) * dN[a][0] + inverse(c, 1) * dN[a][1] + inverse(c, 2) * dN[a][2];
    for (int a = 0; a < 8; a++)
      for (int b = 0; b < 8; b++) {
        M[a][b] += m.density * w * N[a] * N[b];
        const double both = G[a][0] * G[b][0] + G[a][1] * G[b][1] + G[a][2] * G[b][2];
        for (int c = 0; c < 3; c++)
          for (int d = 0; d < 3; d++)
            K[3 * a + c][3 * b + d] += w * (lame * G[a][c] * G[b][d] + shear * (G[b][c] * G[a][d] + (c == d ? both : 0)));
      }
  }
}

class BoxBuilder
{
public:
  BoxBuilder(const Box &box, FeModel *model) : box_(box), model_(*model)
  {
    number();
    divide();
    place();
    assemble();
    addSet("left", [](const Vector3 &x) { return x[0] < 1e-9; });
    addSet("right", [this](const Vector3 &x) { return x[0] > box_.size[0] * (1 - 1e-9); });
  }
  /* selects nodes by their positions in the undistorted grid */
  void addSet(const std::string &name, const std::function<bool(const Vector3 &)> &inside)
  {
    std::vector<PetscInt> &set = model_.sets[name];
    set.clear();
    for (PetscInt i = model_.first; i < model_.first + model_.own; i++)
      if (inside(grid(point_[i]))) set.push_back(i);
  }

private:
  const Box             box_;
  FeModel              &model_;
  std::vector<PetscInt> node_;  /* node of each grid point; -1: not used */
  std::vector<PetscInt> point_; /* grid point of each node */

  int     at(int i, int j, int k) const { return (i * (box_.n[1] + 1) + j) * (box_.n[2] + 1) + k; }
  Vector3 grid(PetscInt p) const
  {
    const int k = (int)(p % (box_.n[2] + 1)), j = (int)(p / (box_.n[2] + 1) % (box_.n[1] + 1)),
              i = (int)(p / (box_.n[2] + 1) / (box_.n[1] + 1));
    return Vector3(box_.size[0] * i / box_.n[0], box_.size[1] * j / box_.n[1], box_.size[2] * k / box_.n[2]);
  }
  template <class F> void bricks(const F &f) const
  {
    for (int i = 0; i < box_.n[0]; i++)
      for (int j = 0; j < box_.n[1]; j++)
        for (int k = 0; k < box_.n[2]; k++)
          if (box_.present(i, j, k)) f(i, j, k);
  }
  void number()
  {
    node_.assign((box_.n[0] + 1) * (box_.n[1] + 1) * (box_.n[2] + 1), -1);
    bricks([this](int i, int j, int k) {
      for (const int *c : brick_corner) node_[at(i + c[0], j + c[1], k + c[2])] = 0;
    });
    for (std::size_t p = 0; p < node_.size(); p++)
      if (node_[p] == 0) {
        node_[p] = (PetscInt)point_.size();
        point_.push_back((PetscInt)p);
      }
  }
  void divide()
  {
    PetscInt own  = PETSC_DECIDE, end;
    model_.source = "box";
    model_.nodes  = (PetscInt)point_.size();
    boxMust(PetscSplitOwnership(model_.comm, &own, &model_.nodes));
    boxMust(MPI_Scan(&own, &end, 1, MPIU_INT, MPI_SUM, model_.comm));
    model_.own   = own;
    model_.first = end - own;
  }
  Vector3 position(PetscInt node) const { return box_.map(grid(point_[node])); }
  void    place()
  {
    model_.coordinates.clear();
    model_.label.clear();
    for (PetscInt i = model_.first; i < model_.first + model_.own; i++) {
      const Vector3 x = position(i);
      model_.coordinates.insert(model_.coordinates.end(), x.data(), x.data() + 3);
      model_.label.push_back(i + 1);
    }
  }
  Mat matrix(PetscInt diagonal) const
  {
    Mat A;
    boxMust(MatCreateAIJ(model_.comm, 3 * model_.own, 3 * model_.own, PETSC_DETERMINE, PETSC_DETERMINE, diagonal,
                         nullptr, diagonal, nullptr, &A));
    boxMust(MatSetOption(A, MAT_NEW_NONZERO_ALLOCATION_ERR, PETSC_FALSE));
    return A;
  }
  /* An element belongs to the rank of its first node, which also adds entries to rows of other ranks */
  void assemble()
  {
    model_.K         = matrix(81);
    model_.M         = matrix(27);
    model_.materials = {box_.material};
    bricks([this](int i, int j, int k) {
      hhtdae::FeElement e{};
      e.type = hhtdae::ElementType::Brick8;
      for (int a = 0; a < 8; a++)
        e.node[a] = node_[at(i + brick_corner[a][0], j + brick_corner[a][1], k + brick_corner[a][2])];
      if (e.node[0] < model_.first || e.node[0] >= model_.first + model_.own) return;
      model_.elements.push_back(e);
      addElement(e);
    });
    for (Mat A : {model_.K, model_.M}) {
      boxMust(MatAssemblyBegin(A, MAT_FINAL_ASSEMBLY));
      boxMust(MatAssemblyEnd(A, MAT_FINAL_ASSEMBLY));
    }
  }
  void addElement(const hhtdae::FeElement &e)
  {
    double   X[8][3], K[24][24], M[8][8];
    PetscInt rows[24];
    for (int a = 0; a < 8; a++) {
      const Vector3 x = position(e.node[a]);
      for (int c = 0; c < 3; c++) {
        X[a][c]         = x[c];
        rows[3 * a + c] = 3 * e.node[a] + c;
      }
    }
    brickMatrices(X, box_.material, K, M);
    boxMust(MatSetValues(model_.K, 24, rows, 24, rows, &K[0][0], ADD_VALUES));
    for (int c = 0; c < 3; c++) {
      PetscInt component[8];
      for (int a = 0; a < 8; a++) component[a] = rows[3 * a + c];
      boxMust(MatSetValues(model_.M, 8, component, 8, component, &M[0][0], ADD_VALUES));
    }
  }
};

} // namespace hhtest

#endif
