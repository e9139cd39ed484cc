/* Everything the reduction refuses, each with its error message; on one rank */
#include "box_model.h"
#include "flexible/diagnose.h"
#include "reduction_cases.h"
#include <petsc/private/petscimpl.h>

using namespace hhtest;
using namespace hhtdae;

namespace
{

/* Number of PETSc objects on a communicator */
PetscInt objects(MPI_Comm comm)
{
  MPI_Comm          inner;
  PetscMPIInt       tag, found;
  PetscCommCounter *counter;
  must(PetscCommDuplicate(comm, &inner, &tag));
  MPI_Comm_get_attr(inner, Petsc_Counter_keyval, &counter, &found);
  const PetscInt count = counter->refcount - 1;
  must(PetscCommDestroy(&inner));
  return count;
}

/* The message of the error with which the reduction must end; it must leave no solver or matrix behind */
std::string failure(const FeModel &model, const Reduction &reduction)
{
  ErrorTrap      trap;
  ReducedBody    body;
  const PetscInt before = objects(model.comm);
  const bool     failed = Reduce(model, reduction, &body) != 0;
  EXPECT_TRUE(failed);
  EXPECT_EQ(objects(model.comm), before) << trap.message;
  if (failed) std::printf("[ MESSAGE  ] %s\n", trap.message.c_str());
  return failed ? trap.message : "";
}

#define EXPECT_REDUCTION_SAYS(message, part) EXPECT_NE((message).find(part), std::string::npos) << (message)

void setEntry(Mat A, PetscInt i, PetscInt j, double value, InsertMode mode = INSERT_VALUES)
{
  must(MatSetOption(A, MAT_NEW_NONZERO_LOCATION_ERR, PETSC_FALSE));
  must(MatSetValue(A, i, j, value, mode));
  must(MatAssemblyBegin(A, MAT_FINAL_ASSEMBLY));
  must(MatAssemblyEnd(A, MAT_FINAL_ASSEMBLY));
}

void clearNode(Mat A, PetscInt node)
{
  const PetscInt rows[3] = {3 * node, 3 * node + 1, 3 * node + 2};
  must(MatZeroRowsColumns(A, 3, rows, 0., nullptr, nullptr));
}

/* Two blocks of two bricks that share only an edge along z: a hinge */
Box hinge()
{
  Box box     = {{4, 2, 2}, {0.4, 0.2, 0.2}};
  box.present = [](int i, int j, int) { return (i < 2) == (j == 0); };
  return box;
}

} // namespace

/* ---- errors of the model ---- */

#if defined(PETSC_USE_LOG) && PETSC_VERSION_LT(3, 20, 0)
TEST(ReductionErrors, LeaveNoStageOfTheLog)
{
  PetscStageLog log;
  int           before, after;
  FeModel       model(PETSC_COMM_SELF);
  Reduction     reduction;
  BoxBuilder({{2, 1, 1}, {1, 1, 1}}, &model);
  reduction.attachments = {{"nowhere"}};
  must(PetscLogGetStageLog(&log));
  if (!log) GTEST_SKIP() << "nothing is logged";
  must(PetscStageLogGetCurrent(log, &before));
  EXPECT_NE(failure(model, reduction), "");
  must(PetscStageLogGetCurrent(log, &after));
  EXPECT_EQ(after, before);
}
#endif

TEST(ReductionErrors, NoMatrices)
{
  FeModel empty(PETSC_COMM_SELF);
  EXPECT_REDUCTION_SAYS(failure(empty, Reduction()), "read a mesh or matrices first");
}

/* Geometric stiffening needs an attachment that holds the body, and elements for the stress */
TEST(ReductionErrors, Stiffening)
{
  Made      m(bar());
  Reduction r  = both();
  r.stiffening = true;
  r.attachments.clear();
  EXPECT_REDUCTION_SAYS(failure(m.model, r), "geometric stiffening needs an attachment");
  r = both();
  r.stiffening = true;
  m.model.elements.clear();
  EXPECT_REDUCTION_SAYS(failure(m.model, r), "geometric stiffening needs elements");
}

TEST(ReductionErrors, MassOfANode)
{
  Made none(bar());
  clearNode(none.model.M, 17);
  const std::string zero = failure(none.model, both());
  EXPECT_REDUCTION_SAYS(zero, "no mass or a negative one");
  EXPECT_REDUCTION_SAYS(zero, "18"); /* labels count from 1 */
  Made less(bar());
  for (int c = 0; c < 3; c++) setEntry(less.model.M, 3 * 20 + c, 3 * 20 + c, -1.);
  EXPECT_REDUCTION_SAYS(failure(less.model, both()), "M: 21;");
}

TEST(ReductionErrors, FormOfTheMass)
{
  Made m(bar());
  setEntry(m.model.M, 30, 31, 1e-3);
  setEntry(m.model.M, 31, 30, 1e-3);
  EXPECT_REDUCTION_SAYS(failure(m.model, both()), "3 x 3 identity");
  Made unequal(bar());
  setEntry(unequal.model.M, 30, 30, 1.);
  EXPECT_REDUCTION_SAYS(failure(unequal.model, both()), "node(s): 11;");
}

TEST(ReductionErrors, NodeWithoutStiffness)
{
  Made m(bar());
  clearNode(m.model.K, 13);
  const std::string message = failure(m.model, both());
  EXPECT_REDUCTION_SAYS(message, "1 node(s) of the FE model have no stiffness: 14");
}

TEST(ReductionErrors, Parts)
{
  Box box     = bar();
  box.present = [](int i, int, int) { return i != 2 && i != 3; };
  Made              m(box);
  const std::string message = failure(m.model, both());
  EXPECT_REDUCTION_SAYS(message, "falls into 2 parts");
  EXPECT_REDUCTION_SAYS(message, "27 nodes with node 1; 27 nodes with node 28");
  /* tied to one attachment both blocks are one body */
  Reduction joined;
  m.builder.addSet("all ends", [](const Vector3 &x) { return x[0] < 1e-9 || x[0] > 0.5 - 1e-9; });
  joined.attachments = {attach("all ends")};
  joined.modes       = 3;
  ReducedBody body;
  must(Reduce(m.model, joined, &body));
  EXPECT_EQ(body.modal.modes(), 3);
}

TEST(ReductionErrors, Mechanism)
{
  Made      m(hinge());
  Reduction held;
  held.attachments          = {attach("left")};
  const std::string message = failure(m.model, held);
  EXPECT_REDUCTION_SAYS(message, "mechanism");
  /* the far edge of the second block moves most: its nodes, at x = 0.4, y = 0.2, have the highest numbers */
  EXPECT_REDUCTION_SAYS(message, std::to_string(m.model.nodes));
  held.attachments[0].tie = Tie::Average;
  EXPECT_REDUCTION_SAYS(failure(m.model, held), std::to_string(m.model.nodes));
  Reduction free;
  EXPECT_REDUCTION_SAYS(failure(m.model, free), "mechanism");
  free.attachments = {attach("left")};
  free.method      = Method::FreeFree;
  EXPECT_REDUCTION_SAYS(failure(m.model, free), "mechanism");
  /* with both ends held the hinge is a joint between two rigid attachments, which is detected in the reduced pair */
  EXPECT_REDUCTION_SAYS(failure(m.model, both()), "mechanism");
}

TEST(ReductionErrors, Supports)
{
  Made spring(bar());
  setEntry(spring.model.K, 3 * 40, 3 * 40, 1e4, ADD_VALUES); /* soft: the diagonal of K is about 1e9 */
  const std::string message = failure(spring.model, both());
  EXPECT_REDUCTION_SAYS(message, "not free of supports");
  EXPECT_REDUCTION_SAYS(message, "41");
  Made           clamped(bar());
  const PetscInt rows[3] = {0, 1, 2};
  must(MatZeroRowsColumns(clamped.model.K, 3, rows, 1e9, nullptr, nullptr));
  setEntry(clamped.model.K, 0, 3, -1., ADD_VALUES); /* a remaining coupling, so that it does not count as a separate part */
  setEntry(clamped.model.K, 3, 0, -1., ADD_VALUES);
  EXPECT_REDUCTION_SAYS(failure(clamped.model, both()), "supports");
}

TEST(ReductionErrors, WrongCoordinates)
{
  Made m(bar());
  for (std::size_t i = 0; i < m.model.coordinates.size(); i += 3) m.model.coordinates[i] *= 1000; /* mm in a model in m */
  EXPECT_REDUCTION_SAYS(failure(m.model, both()), "correct the coordinates");
}

TEST(ReductionErrors, NotSymmetric)
{
  Made m(bar());
  setEntry(m.model.K, 3, 7, 1e8, ADD_VALUES);
  EXPECT_REDUCTION_SAYS(failure(m.model, both()), "K of the FE model is not symmetric");
}

TEST(ReductionErrors, NotANumber)
{
  Made m(bar());
  setEntry(m.model.K, 3, 3, std::nan(""));
  EXPECT_REDUCTION_SAYS(failure(m.model, both()), "not numbers");
  Made n(bar());
  n.model.coordinates[5] = INFINITY;
  EXPECT_REDUCTION_SAYS(failure(n.model, both()), "finite coordinates");
}

/* Poisson's ratio above one half means a negative bulk modulus */
TEST(ReductionErrors, NegativeStiffness)
{
  Box box              = bar();
  box.material.poisson = 0.51;
  Made m(box);
  EXPECT_REDUCTION_SAYS(failure(m.model, both()), "negative");
}

TEST(ReductionErrors, MassOnALine)
{
  Made m(bar());
  for (PetscInt i = 0; i < m.model.own; i++) m.model.coordinates[3 * i + 1] = m.model.coordinates[3 * i + 2] = 0;
  Reduction r;
  EXPECT_REDUCTION_SAYS(failure(m.model, r), "on one line");
}

/* ---- errors of attachments and of what is asked for ---- */

TEST(ReductionErrors, Attachments)
{
  Made m(bar());
  m.builder.addSet("none", [](const Vector3 &) { return false; });
  m.builder.addSet("node", [](const Vector3 &x) { return x.norm() < 1e-9; });
  m.builder.addSet("line", [](const Vector3 &x) { return x[0] < 1e-9 && x[1] < 1e-9; });
  m.builder.addSet("half", [](const Vector3 &x) { return x[0] < 0.25; });
  m.builder.addSet("all", [](const Vector3 &) { return true; });
  auto with = [&](const std::vector<Attachment> &attachments) {
    Reduction r;
    r.attachments = attachments;
    return failure(m.model, r);
  };
  EXPECT_REDUCTION_SAYS(with({attach("nowhere")}), "no node set 'nowhere'; its sets are: all, half, left");
  EXPECT_REDUCTION_SAYS(with({attach("none")}), "empty");
  EXPECT_REDUCTION_SAYS(with({attach("node")}), "single node has no rotation");
  EXPECT_REDUCTION_SAYS(with({attach("node", Tie::Average)}), "three nodes");
  EXPECT_REDUCTION_SAYS(with({attach("line")}), "without stiffness");
  EXPECT_REDUCTION_SAYS(with({attach("line", Tie::Average)}), "not defined");
  EXPECT_REDUCTION_SAYS(with({attach("left"), attach("half")}), "left and half overlap: node 1 ");
  EXPECT_REDUCTION_SAYS(with({attach("half", Tie::Average), attach("left")}), "left and half overlap");
  EXPECT_REDUCTION_SAYS(with({attach("left"), attach("left")}), "two attachments of the name left");
  EXPECT_REDUCTION_SAYS(with({attach("all")}), "nothing is left to deform");
  Attachment named = attach("again", Tie::Average);
  named.set        = "left";
  EXPECT_REDUCTION_SAYS(with({attach("left", Tie::Average), named}), "depend on each other");
  named.set = "right";
  named.weights.assign(8, 1.);
  EXPECT_REDUCTION_SAYS(with({named}), "8 weights for 9 nodes");
  named.weights.assign(9, 1.);
  named.weights[3] = -1;
  EXPECT_REDUCTION_SAYS(with({named}), "positive");
  named.weights.assign(9, 0.);
  EXPECT_REDUCTION_SAYS(with({named}), "not all zero");
  named.weights[0] = named.weights[1] = 1;
  EXPECT_REDUCTION_SAYS(with({named}), "on a line");
  named.weights.assign(9, 1.);
  named.tie = Tie::Rigid;
  EXPECT_REDUCTION_SAYS(with({named}), "weights are for averages");
  named.weights.clear();
  named.at_given = true;
  named.position = Vector3(NAN, 0, 0);
  EXPECT_REDUCTION_SAYS(with({named}), "not finite");
  EXPECT_REDUCTION_SAYS(with({Attachment()}), "no name");
  /* averaging attachments may share nodes */
  Reduction   r;
  ReducedBody body;
  r.attachments = {attach("left", Tie::Average), attach("half", Tie::Average)};
  must(Reduce(m.model, r, &body));
  EXPECT_EQ(body.modal.modes(), 12 + 20 - 6);
}

TEST(ReductionErrors, WhatIsAskedFor)
{
  Made      m(bar());
  Reduction r = both();
  r.modes     = -7;
  EXPECT_REDUCTION_SAYS(failure(m.model, r), "-7");
  r       = both();
  r.modes = PETSC_DEFAULT;
  EXPECT_REDUCTION_SAYS(failure(m.model, r), "max_frequency, which is not set");
  r               = both();
  r.max_frequency = -1;
  EXPECT_REDUCTION_SAYS(failure(m.model, r), "max_frequency is -1");
  r      = both(4);
  r.keep = {0, 10};
  EXPECT_REDUCTION_SAYS(failure(m.model, r), "mode 10, but there are 10 elastic modes");
  r.keep = {-1};
  EXPECT_REDUCTION_SAYS(failure(m.model, r), "mode -1");
}
