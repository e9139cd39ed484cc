/* A reduced body made by hand for tests of its file, stress and pictures; its numbers are smooth functions of the
   indices, so that a misplaced entry is noticed */
#ifndef HHTDAE_TESTS_REDUCED_BODY_H
#define HHTDAE_TESTS_REDUCED_BODY_H

#include "hhtdae/flexible.h"
#include "support.h"
#include <fstream>
#include <sstream>
#include <unistd.h>

namespace hhtest
{

using namespace hhtdae;

inline double Number(double a, double b = 0, double c = 0)
{
  return std::sin(1 + 12.9898 * a + 78.233 * b + 37.719 * c);
}

inline Eigen::MatrixXd Numbers(Eigen::Index rows, Eigen::Index cols, double seed)
{
  return Eigen::MatrixXd::NullaryExpr(
      rows, cols, [seed](Eigen::Index i, Eigen::Index j) { return Number(seed, (double)i, (double)j); });
}

/* A row of 8-node bricks along x, with a 4-node tetrahedron in place of the last one; stress at two of three nodes */
struct HandMade {
  ReducedBody body;
  PetscInt    bricks, nodes;

  explicit HandMade(MPI_Comm comm, PetscInt bricks_ = 5, PetscInt modes = 4) : bricks(bricks_), nodes(4 * (bricks_ + 1))
  {
    PetscMPIInt rank, size;
    MPI_Comm_rank(comm, &rank);
    MPI_Comm_size(comm, &size);
    modal(modes);
    body.comm          = comm;
    body.source        = "by hand";
    body.method        = "none";
    body.units         = "m, kg, s";
    body.fe_nodes      = nodes;
    body.elastic_scale = 1e9;
    body.first         = nodes * rank / size;
    body.own           = nodes * (rank + 1) / size - body.first;
    body.shape.resize(3 * body.own, modes);
    for (PetscInt i = 0; i < body.own; i++) node(i);
    body.stress.values.resize(6 * (Eigen::Index)body.stress.node.size(), modes);
    for (std::size_t s = 0; s < body.stress.node.size(); s++)
      for (int c = 0; c < 6; c++)
        for (PetscInt k = 0; k < modes; k++)
          body.stress.values(6 * (Eigen::Index)s + c, k) = 1e6 * Number(body.first + body.stress.node[s], c, k + 0.5);
    for (PetscInt e = bricks * rank / size; e < bricks * (rank + 1) / size; e++) element(e);
  }

private:
  void modal(PetscInt n)
  {
    ModalBody &m = body.modal;
    m.name       = "row of bricks";
    m.mass       = 7.5;
    m.center     = Vector3(2.5, 0.5, 0.25);
    m.moments    = Numbers(3, 3, 1) * Numbers(3, 3, 1).transpose();
    m.omega      = Eigen::VectorXd::LinSpaced(n, 100, 900);
    m.first      = Numbers(3, n, 2);
    for (int c = 0; c < 3; c++) m.moment[(std::size_t)c] = Numbers(3, n, 3 + c);
    for (int p = 0; p < 6; p++) m.quadratic[(std::size_t)p] = Numbers(n, n, 6 + p);
    for (std::size_t p = 0; p < 2; p++) m.quadratic[p] = (m.quadratic[p] + m.quadratic[p].transpose()).eval();
    m.quadratic[2] = Eigen::MatrixXd::Identity(n, n) - m.quadratic[0] - m.quadratic[1];
    const auto symmetric = [n](double seed) { return Eigen::MatrixXd(Numbers(n, n, seed) + Numbers(n, n, seed).transpose()); };
    for (int p = 0; p < 6; p++) m.stiffening[(std::size_t)p] = symmetric(50 + p);
    for (const char *name : {"hub", "tip of the row"}) {
      ModalAttachment a;
      for (int p = 0; p < 6; p++) a.stiffening[(std::size_t)p] = symmetric(60 + p + 10 * (double)m.attachments.size());
      a.name        = name;
      a.position    = Numbers(3, 1, 20 + (double)a.name.size());
      a.translation = Numbers(3, n, 30 + (double)a.name.size());
      a.rotation    = Numbers(3, n, 40 + (double)a.name.size());
      m.attachments.push_back(a);
    }
    for (int k = 0; k < 3; k++) { /* the last one has no rotation */
      ModalNode a;
      a.label       = 1000 + 9 * k;
      a.position    = Numbers(3, 1, 80 + k);
      a.translation = Numbers(3, n, 83 + k);
      a.turns       = k < 2;
      a.rotation    = a.turns ? Numbers(3, n, 86 + k) : Eigen::MatrixXd(Eigen::MatrixXd::Zero(3, n));
      m.nodes.push_back(a);
    }
    for (const char *name : {"wind", "pressure", "weight of snow"}) {
      const double  seed = 90 + 10 * (double)m.loads.size();
      ModalLoadCase l;
      l.name            = name;
      l.force           = Numbers(3, 1, seed);
      l.moment          = Numbers(3, 1, seed + 1);
      l.modal           = Numbers(n, 1, seed + 2);
      l.moment_gradient = Numbers(3, n, seed + 3);
      if (m.loads.size() == 1 && n) {
        l.force_gradient = Numbers(3, n, seed + 4);
        l.modal_gradient = Numbers(n, n, seed + 5);
      }
      m.loads.push_back(l);
    }
    for (PetscInt k = 0; k < n; k++) body.mode.push_back({m.omega[k] / (2 * PETSC_PI), 1e-9 * (k + 1)});
  }

  void node(PetscInt i)
  {
    const PetscInt g = body.first + i, corner = g % 4;
    body.coordinates.insert(body.coordinates.end(),
                            {(double)(g / 4), corner == 1 || corner == 2 ? 1.0 : 0.0, corner > 1 ? 0.5 : 0.0});
    body.label.push_back(1000 + 3 * g);
    if (g % 3) body.stress.node.push_back(i);
    for (int c = 0; c < 3; c++)
      for (PetscInt k = 0; k < body.modal.modes(); k++) body.shape(3 * i + c, k) = 0.01 * Number(g, c, k);
  }

  void element(PetscInt e)
  {
    FeElement brick{ElementType::Brick8, 0, {}};
    for (PetscInt k = 0; k < 8; k++) brick.node[k] = 4 * e + k;
    if (e + 1 < bricks)
      body.elements.push_back(brick);
    else
      body.elements.push_back({ElementType::Tetrahedron4, 1, {4 * e, 4 * e + 1, 4 * e + 2, 4 * e + 5}});
  }
};

/* A file name that is removed by the destructor; all ranks get the same name if they ask for names in the same order */
class Scratch
{
public:
  std::string name;

  Scratch(MPI_Comm comm, const std::string &end) : comm_(comm)
  {
    int id = (int)getpid();
    MPI_Bcast(&id, 1, MPI_INT, 0, comm);
    name = testing::TempDir() + "hhtflexible" + std::to_string(id) + "_" + end;
  }
  explicit Scratch(const std::string &end) : Scratch(PETSC_COMM_SELF, end) {}
  ~Scratch()
  {
    MPI_Barrier(comm_);
    std::remove(name.c_str());
  }
  Scratch(const Scratch &) = delete;
  void        write(const std::string &text) const { std::ofstream(name, std::ios::binary) << text; }
  bool        exists() const { return std::ifstream(name).good(); }
  std::string text() const
  {
    std::ifstream     in(name, std::ios::binary);
    std::stringstream all;
    all << in.rdbuf();
    return all.str();
  }

private:
  MPI_Comm comm_;
};

inline bool Same(const ModalBody &a, const ModalBody &b)
{
  bool same = a.name == b.name && a.mass == b.mass && a.center == b.center && a.moments == b.moments &&
              a.omega == b.omega && a.first == b.first && a.moment == b.moment &&
              a.attachments.size() == b.attachments.size();
  for (std::size_t p = 0; p < 6; p++)
    same = same && a.quadratic[p].rows() == b.quadratic[p].rows() && a.quadratic[p].cols() == b.quadratic[p].cols() &&
           a.quadratic[p] == b.quadratic[p];
  const auto alike = [](const std::array<Eigen::MatrixXd, 6> &x, const std::array<Eigen::MatrixXd, 6> &y) {
    return std::equal(x.begin(), x.end(), y.begin(), [](const Eigen::MatrixXd &B, const Eigen::MatrixXd &C) { return B.rows() == C.rows() && B.cols() == C.cols() && B == C; });
  };
  same = same && alike(a.stiffening, b.stiffening);
  for (std::size_t i = 0; same && i < a.attachments.size(); i++)
    same = alike(a.attachments[i].stiffening, b.attachments[i].stiffening) && a.attachments[i].name == b.attachments[i].name && a.attachments[i].position == b.attachments[i].position &&
           a.attachments[i].translation == b.attachments[i].translation &&
           a.attachments[i].rotation == b.attachments[i].rotation;
  const auto matrix = [](const Eigen::MatrixXd &x, const Eigen::MatrixXd &y) { return x.rows() == y.rows() && x.cols() == y.cols() && x == y; };
  same = same && a.nodes.size() == b.nodes.size() && a.loads.size() == b.loads.size();
  for (std::size_t i = 0; same && i < a.nodes.size(); i++)
    same = a.nodes[i].label == b.nodes[i].label && a.nodes[i].turns == b.nodes[i].turns && a.nodes[i].position == b.nodes[i].position &&
           matrix(a.nodes[i].translation, b.nodes[i].translation) && matrix(a.nodes[i].rotation, b.nodes[i].rotation);
  for (std::size_t i = 0; same && i < a.loads.size(); i++)
    same = a.loads[i].name == b.loads[i].name && a.loads[i].force == b.loads[i].force && a.loads[i].moment == b.loads[i].moment && a.loads[i].modal == b.loads[i].modal &&
           matrix(a.loads[i].moment_gradient, b.loads[i].moment_gradient) && matrix(a.loads[i].modal_gradient, b.loads[i].modal_gradient) &&
           a.loads[i].force_gradient.size() == b.loads[i].force_gradient.size() && (!a.loads[i].force_gradient.size() || a.loads[i].force_gradient == b.loads[i].force_gradient);
  return same;
}

inline bool SameMatrix(const Eigen::MatrixXd &a, const Eigen::MatrixXd &b)
{
  return a.rows() == b.rows() && a.cols() == b.cols() && a == b;
}

/* Equality to the last bit, with the same distribution; the distribution of elements may differ, they are compared by number */
inline bool Same(const ReducedBody &a, const ReducedBody &b)
{
  bool same = Same(a.modal, b.modal) && a.source == b.source && a.method == b.method && a.units == b.units &&
              a.fe_nodes == b.fe_nodes && a.elastic_scale == b.elastic_scale && a.mode.size() == b.mode.size() &&
              a.own == b.own && a.first == b.first && a.coordinates == b.coordinates && a.label == b.label &&
              SameMatrix(a.shape, b.shape) && a.stress.node == b.stress.node &&
              SameMatrix(a.stress.values, b.stress.values);
  for (std::size_t k = 0; same && k < a.mode.size(); k++)
    same = a.mode[k].frequency == b.mode[k].frequency && a.mode[k].residual == b.mode[k].residual;
  return same;
}

inline bool SameElements(const std::vector<FeElement> &a, const std::vector<FeElement> &b)
{
  bool same = a.size() == b.size();
  for (std::size_t e = 0; same && e < a.size(); e++)
    same = a[e].type == b[e].type && a[e].material == b[e].material &&
           std::equal(a[e].node, a[e].node + FeNodes(a[e].type), b[e].node);
  return same;
}

} // namespace hhtest

#endif
