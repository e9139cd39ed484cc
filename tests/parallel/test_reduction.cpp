/* Reductions on all ranks together and on each rank alone */
#include "box_model.h"
#include "fe_mesh.h"
#include "hhtdae/flexible.h"
#include "scene/model.h"
#include "support.h"
#include <algorithm>
#include <numeric>

using namespace hhtest;
using namespace hhtdae;

namespace
{

Box bar(bool symmetric)
{
  Box box = {{9, 2, 2}, {0.5, 0.08, 0.08}};
  if (!symmetric)
    box.map = [](Vector3 x) {
      return Vector3(x[0] + 1, x[1] * (1 - x[0]) + 0.3 * x[0] * x[0], x[2] * (1 + 0.4 * x[0]));
    };
  return box;
}

Reduction reductionOf(Tie left, Tie right, Method method)
{
  Reduction r;
  r.attachments.resize(2);
  r.attachments[0].name = "left";
  r.attachments[0].tie  = left;
  r.attachments[1].name = "right";
  r.attachments[1].tie  = right;
  r.modes               = 9;
  r.method              = method;
  return r;
}

struct Made {
  FeModel    model;
  BoxBuilder builder;
  Made(MPI_Comm comm, const Box &box) : model(comm), builder(box, &model) {}
};

double off(const Eigen::MatrixXd &a, const Eigen::MatrixXd &b)
{
  return a.size() ? (a - b).cwiseAbs().maxCoeff() / b.cwiseAbs().maxCoeff() : 0.;
}

/* Difference between the mode shapes of all ranks and those of one rank, node by node */
double shapeOff(const ReducedBody &all, const ReducedBody &self)
{
  double worst = 0, most = self.shape.size() ? self.shape.cwiseAbs().maxCoeff() : 1.;
  for (PetscInt i = 0; i < 3 * all.own; i++)
    worst = std::max(worst, (all.shape.row(i) - self.shape.row(3 * all.first + i)).cwiseAbs().maxCoeff());
  MPI_Allreduce(MPI_IN_PLACE, &worst, 1, MPI_DOUBLE, MPI_MAX, all.comm);
  return worst / most;
}

void compare(const char *name, const Box &box, const Reduction &r)
{
  Made        together(PETSC_COMM_WORLD, box), alone(PETSC_COMM_SELF, box);
  ReducedBody a, s;
  must(Reduce(together.model, r, &a));
  must(Reduce(alone.model, r, &s));
  ASSERT_EQ(a.modal.modes(), s.modal.modes());
  ASSERT_GT(a.modal.modes(), 0);
  const double omega     = (a.modal.omega - s.modal.omega).cwiseQuotient(s.modal.omega).cwiseAbs().maxCoeff();
  double       quadratic = 0, moment = 0, motion = 0, stiffening = 0;
  for (int p = 0; p < 6; p++)
    quadratic = std::max(quadratic, (a.modal.quadratic[p] - s.modal.quadratic[p]).cwiseAbs().maxCoeff());
  for (int c = 0; c < 3; c++) moment = std::max(moment, off(a.modal.moment[c], s.modal.moment[c]));
  for (std::size_t k = 0; k < r.attachments.size(); k++) {
    motion = std::max(motion, off(a.modal.attachments[k].translation, s.modal.attachments[k].translation));
    motion = std::max(motion, off(a.modal.attachments[k].rotation, s.modal.attachments[k].rotation));
    for (int c = 0; c < 6; c++) stiffening = std::max(stiffening, off(a.modal.attachments[k].stiffening[c], s.modal.attachments[k].stiffening[c]));
  }
  for (int p = 0; p < 6; p++) stiffening = std::max(stiffening, off(a.modal.stiffening[p], s.modal.stiffening[p]));
  EXPECT_EQ(s.modal.stiffening[0].size() > 0, r.stiffening);
  int rank, size;
  MPI_Comm_rank(PETSC_COMM_WORLD, &rank);
  MPI_Comm_size(PETSC_COMM_WORLD, &size);
  const double shape = shapeOff(a, s);
  if (rank == 0)
    MEASURED("%-28s %d ranks, %d modes: omega %.1e, quadratic %.1e, moment %.1e, attachments %.1e, shape %.1e, stiffening %.1e", name,
             size, (int)a.modal.modes(), omega, quadratic, moment, motion, shape, stiffening);
  EXPECT_LT(omega, 1e-10);
  EXPECT_LT(quadratic, 1e-6);
  EXPECT_LT(moment, 1e-6);
  EXPECT_LT(motion, 1e-6);
  EXPECT_LT(shape, 1e-6);
  EXPECT_LT(stiffening, 1e-6);
  /* equal to the last bit on all ranks */
  double first = a.modal.omega[0], least, most;
  first += a.modal.quadratic[3].sum() + a.modal.attachments.size() + a.modal.moment[1].sum() + a.mode[0].residual + a.modal.stiffening[4].sum();
  MPI_Allreduce(&first, &least, 1, MPI_DOUBLE, MPI_MIN, PETSC_COMM_WORLD);
  MPI_Allreduce(&first, &most, 1, MPI_DOUBLE, MPI_MAX, PETSC_COMM_WORLD);
  EXPECT_EQ(least, most);
}

/* The error message, which must be the same on every rank */
std::string failure(const FeModel &model, const Reduction &reduction)
{
  ErrorTrap   trap;
  ReducedBody body;
  EXPECT_NE(Reduce(model, reduction, &body), 0);
  /* the first rank alone prints an error of a communicator */
  char text[512] = "";
  std::snprintf(text, sizeof text, "%s", trap.message.c_str());
  MPI_Bcast(text, sizeof text, MPI_CHAR, 0, PETSC_COMM_WORLD);
  return text;
}

#define EXPECT_SAYS(message, part) EXPECT_NE((message).find(part), std::string::npos) << (message)

} // namespace

TEST(ReductionRanks, Rigid) { compare("rigid", bar(false), reductionOf(Tie::Rigid, Tie::Rigid, Method::CraigBampton)); }
TEST(ReductionRanks, Average)
{
  compare("average", bar(false), reductionOf(Tie::Average, Tie::Average, Method::CraigBampton));
}
TEST(ReductionRanks, Mixed)
{
  Reduction r  = reductionOf(Tie::Rigid, Tie::Average, Method::CraigBampton);
  r.stiffening = true;
  compare("rigid and average", bar(false), r);
}
TEST(ReductionRanks, Static) { compare("static", bar(false), reductionOf(Tie::Average, Tie::Rigid, Method::Static)); }
TEST(ReductionRanks, FreeFree)
{
  compare("free-free", bar(false), reductionOf(Tie::Rigid, Tie::Average, Method::FreeFree));
}
TEST(ReductionRanks, FreeFreeWithoutAttachments)
{
  Reduction r;
  r.modes = 12;
  compare("free-free, no attachments", bar(false), r);
}
/* Bending frequencies are double: the modes are rotated to a unique choice, which is the same on any number of ranks */
TEST(ReductionRanks, EqualFrequencies)
{
  compare("square section", bar(true), reductionOf(Tie::Rigid, Tie::Rigid, Method::CraigBampton));
}
TEST(ReductionRanks, EqualFrequenciesFree)
{
  Reduction r;
  r.modes = 12;
  compare("square section, free-free", bar(true), r);
}

/* An attachment whose nodes are on several ranks */
TEST(ReductionRanks, AttachmentOnAllRanks)
{
  for (Tie tie : {Tie::Rigid, Tie::Average}) {
    Reduction r = reductionOf(Tie::Rigid, Tie::Rigid, Method::CraigBampton);
    r.attachments.resize(1);
    r.attachments[0].name = "floor";
    r.attachments[0].tie  = tie;
    Made        together(PETSC_COMM_WORLD, bar(false)), alone(PETSC_COMM_SELF, bar(false));
    ReducedBody a, s;
    for (Made *m : {&together, &alone}) m->builder.addSet("floor", [](const Vector3 &x) { return x[2] < 1e-9; });
    for (int k = 0; k < 30; k++) r.attachments[0].weights.push_back(1 + 0.1 * k);
    if (tie == Tie::Rigid) r.attachments[0].weights.clear();
    must(Reduce(together.model, r, &a));
    must(Reduce(alone.model, r, &s));
    EXPECT_LT((a.modal.omega - s.modal.omega).cwiseQuotient(s.modal.omega).cwiseAbs().maxCoeff(), 1e-10);
    EXPECT_LT(shapeOff(a, s), 1e-6);
  }
}

/* The global numbers of a mesh's nodes depend on the partition; weights belong to labels, which do not. Here the
   default position of the attachment is the weighted centroid of an end whose nodes differ only by their positions */
TEST(ReductionRanks, WeightsGoByLabels)
{
  MeshBox box{ElementType::Brick20, 7, 2, 2};
  FeModel together(PETSC_COMM_WORLD), alone(PETSC_COMM_SELF);
  must(readBox(together, box));
  must(readBox(alone, box));
  std::vector<std::pair<PetscInt, Vector3>> nodes;
  for (PetscInt n : alone.sets["right"]) nodes.push_back({alone.label[n], Eigen::Map<const Vector3>(&alone.coordinates[3 * n])});
  std::sort(nodes.begin(), nodes.end(), [](const auto &a, const auto &b) { return a.first < b.first; });
  Attachment right;
  right.name       = "right";
  right.tie        = Tie::Average;
  Vector3 centroid = Vector3::Zero();
  double  sum      = 0;
  for (const auto &n : nodes) {
    right.weights.push_back(1 + sum);
    centroid += right.weights.back() * n.second;
    sum += 0.3 + 0.01 * sum;
  }
  centroid /= std::accumulate(right.weights.begin(), right.weights.end(), 0.);
  ReducedBody a, s;
  Reduction   r;
  r.attachments = {Attachment{"left"}, right};
  r.modes       = 4;
  must(Reduce(together, r, &a));
  must(Reduce(alone, r, &s));
  EXPECT_LT((a.modal.attachments[1].position - centroid).norm(), 1e-12);
  EXPECT_LT((s.modal.attachments[1].position - centroid).norm(), 1e-12);
  EXPECT_LT((a.modal.omega - s.modal.omega).cwiseQuotient(s.modal.omega).cwiseAbs().maxCoeff(), 1e-8);
  Scene      scene(PETSC_COMM_WORLD);
  FullFeBody fe;
  FullBody   b;
  b.attachments = {right};
  must(fe.add(scene, "whole", together, b));
  EXPECT_LT((DataOf(scene).frame(scene.marker(fe.attachment("right"))).x - centroid).norm(), 1e-12);
}

TEST(ReductionRanks, ErrorsOnAllRanks)
{
  Box parts     = bar(false);
  parts.present = [](int i, int, int) { return i != 4; };
  Made            apart(PETSC_COMM_WORLD, parts);
  const Reduction r = reductionOf(Tie::Rigid, Tie::Rigid, Method::CraigBampton);
  EXPECT_SAYS(failure(apart.model, r),
              "falls into 2 parts that nothing holds together: 45 nodes with node 1; 45 nodes with node 46");

  Box hinge     = {{4, 2, 2}, {0.4, 0.2, 0.2}};
  hinge.present = [](int i, int j, int) { return (i < 2) == (j == 0); };
  Made      swings(PETSC_COMM_WORLD, hinge);
  Reduction held;
  held.attachments.resize(1);
  held.attachments[0].name = "left";
  for (const char *far : {" 31,", " 32,", " 33,"}) EXPECT_SAYS(failure(swings.model, held), far); /* an edge that moves as a whole */
  held.attachments.clear();
  EXPECT_SAYS(failure(swings.model, held), "mechanism");

  Made     spring(PETSC_COMM_WORLD, bar(false));
  PetscInt row = 3 * 40, rank_row = row >= 3 * spring.model.first && row < 3 * (spring.model.first + spring.model.own);
  if (rank_row) must(MatSetValue(spring.model.K, row, row, 1e5, ADD_VALUES));
  must(MatAssemblyBegin(spring.model.K, MAT_FINAL_ASSEMBLY));
  must(MatAssemblyEnd(spring.model.K, MAT_FINAL_ASSEMBLY));
  EXPECT_SAYS(failure(spring.model, r), "most at node(s) 41:");

  Made massless(PETSC_COMM_WORLD, bar(false));
  row = 3 * 70;
  for (int c = 0; c < 3; c++)
    if (row >= 3 * massless.model.first && row < 3 * (massless.model.first + massless.model.own))
      must(MatSetValue(massless.model.M, row + c, row + c, -1., INSERT_VALUES));
  must(MatAssemblyBegin(massless.model.M, MAT_FINAL_ASSEMBLY));
  must(MatAssemblyEnd(massless.model.M, MAT_FINAL_ASSEMBLY));
  EXPECT_SAYS(failure(massless.model, r), "M: 71;");

  Made      right(PETSC_COMM_WORLD, bar(false));
  Reduction overlap = r;
  right.builder.addSet("half", [](const Vector3 &x) { return x[0] > 0.3; });
  overlap.attachments[0].name = "half";
  EXPECT_SAYS(failure(right.model, overlap), "half and right overlap: node 82 ");
}
