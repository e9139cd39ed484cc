/* Fixtures for tests of "hhtconstraint": matrices of bricks held by multipliers */
#ifndef TESTS_CONSTRAINT_FIXTURE_H
#define TESTS_CONSTRAINT_FIXTURE_H

#include "linear/constraint.h"
#include "linear/linear.h"
#include "bench/linear_matrices.h"
#include "view_text.h"
#include <gtest/gtest.h>
#include <hhtdae/hhtdae.h>
#include <petscksp.h>
#include <string>
#include <vector>

#define OK(call)       ASSERT_EQ((call), 0)
#define OK_VALUE(call) EXPECT_EQ((call), 0) /* for functions that return a value */

namespace
{

/* Bricks with multipliers at one face; unknowns 0 to coordinates - 1 belong to nodes of three unknowns */
class ConstraintPC : public testing::Test
{
protected:
  Mat      A = NULL;
  KSP      ksp = NULL;
  Vec      b = NULL, x = NULL;
  PetscInt n = 0, coordinates = 0;

  void create(const Triplets &e, PetscInt of_them_coordinates)
  {
    n           = e.n;
    coordinates = of_them_coordinates;
    OK(create_matrix(e, &A));
    OK(MatCreateVecs(A, &x, &b));
    OK(VecSetRandom(b, NULL));
  }
  void bricks(PetscInt size) { create(block(size, size, size, true), 3 * (size + 1) * (size + 1) * (size + 1)); }
  /* with the positions of all nodes; the bricks have the size 1/nx */
  void bar(PetscInt nx, PetscInt ny, PetscInt nz, bool clamped = true)
  {
    create(block(nx, ny, nz, clamped), 3 * (nx + 1) * (ny + 1) * (nz + 1));
    nodes(3);
    place([&](PetscInt node, double place[3]) {
      place[0] = (double)(node % (nx + 1)) / (double)nx;
      place[1] = (double)(node / (nx + 1) % (ny + 1)) / (double)nx;
      place[2] = (double)(node / (nx + 1) / (ny + 1)) / (double)nx;
    });
  }
  template <class Place> void place(Place at)
  {
    Vec          positions;
    PetscScalar *place;
    OK(MatCreateVecs(A, &positions, NULL));
    OK(VecGetArray(positions, &place));
    for (PetscInt i = 0; i < coordinates; i += 3) at(i / 3, place + i);
    OK(VecRestoreArray(positions, &place));
    OK(PetscObjectCompose((PetscObject)A, LINEAR_POSITIONS, (PetscObject)positions));
    OK(VecDestroy(&positions));
  }
  PetscInt iterationsWith(const char aggregate[])
  {
    OK_VALUE(PetscOptionsSetValue(NULL, "-pc_hhtconstraint_aggregate", aggregate));
    solver(KSPCG, 1e-6);
    EXPECT_GT(solve(), 0);
    const PetscInt its = iterations();
    OK_VALUE(PetscOptionsClearValue(NULL, "-pc_hhtconstraint_aggregate"));
    OK_VALUE(KSPDestroy(&ksp));
    return its;
  }
  void TearDown() override
  {
    OK(KSPDestroy(&ksp));
    OK(VecDestroy(&b));
    OK(VecDestroy(&x));
    OK(MatDestroy(&A));
  }
  void nodes(PetscInt size)
  {
    IS is;
    OK(ISCreateStride(PETSC_COMM_SELF, coordinates, 0, 1, &is));
    OK(ISSetBlockSize(is, size));
    OK(PetscObjectCompose((PetscObject)A, LINEAR_NODES, (PetscObject)is));
    OK(ISDestroy(&is));
  }
  void solver(const char type[], PetscReal rtol)
  {
    PC pc;
    OK(KSPCreate(PETSC_COMM_SELF, &ksp));
    OK(KSPSetType(ksp, type));
    OK(KSPSetOperators(ksp, A, A));
    OK(KSPSetTolerances(ksp, rtol, 0, PETSC_DEFAULT, 500));
    OK(KSPGetPC(ksp, &pc));
    OK(PCSetType(pc, PCHHTCONSTRAINT));
  }
  KSPConvergedReason solve()
  {
    KSPConvergedReason reason = KSP_CONVERGED_ITERATING;
    EXPECT_EQ(KSPSolve(ksp, b, x), 0);
    EXPECT_EQ(KSPGetConvergedReason(ksp, &reason), 0);
    return reason;
  }
  /* largest entries of b - A y, in rows of coordinates and of constraints */
  void left(Vec y, double *of_coordinates, double *of_constraints)
  {
    const PetscScalar *r;
    Vec                w;
    OK(VecDuplicate(b, &w));
    OK(MatMult(A, y, w));
    OK(VecAYPX(w, -1, b));
    OK(VecGetArrayRead(w, &r));
    *of_coordinates = *of_constraints = 0;
    for (PetscInt i = 0; i < n; i++) {
      double &most = i < coordinates ? *of_coordinates : *of_constraints;
      most         = std::max(most, std::abs(r[i]));
    }
    OK(VecRestoreArrayRead(w, &r));
    OK(VecDestroy(&w));
  }
  PetscInt iterations()
  {
    PetscInt its = 0;
    EXPECT_EQ(KSPGetIterationNumber(ksp, &its), 0);
    return its;
  }
  std::string view()
  {
    return ViewText([this](PetscViewer viewer) { return KSPView(ksp, viewer); });
  }

public:
  double worst_on_the_way = 0;
  static PetscErrorCode watch(KSP ksp, PetscInt, PetscReal, void *ctx)
  {
    auto  *t = static_cast<ConstraintPC *>(ctx);
    Vec    y;
    double forces, constraints;
    PetscFunctionBegin;
    PetscCall(VecDuplicate(t->b, &y));
    PetscCall(KSPBuildSolution(ksp, y, NULL));
    t->left(y, &forces, &constraints);
    t->worst_on_the_way = std::max(t->worst_on_the_way, constraints);
    PetscCall(VecDestroy(&y));
    PetscFunctionReturn(0);
  }
};

/* A body with an expensive factorization, and the choice of its solver */
class LargeBody : public ConstraintPC
{
protected:
  static constexpr PetscInt side = 17; /* bricks along each edge; with 15 a factorization is chosen */
  LinearChoice              choice;

  void choose(bool positions, const char *options = NULL, bool rough = true)
  {
    constexpr PetscInt nodes_of_side = side + 1;
    create(block(side, side, side, true), 3 * nodes_of_side * nodes_of_side * nodes_of_side);
    nodes(3);
    if (positions) {
      place([&](PetscInt node, double place[3]) {
        place[0] = node % nodes_of_side;
        place[1] = node / nodes_of_side % nodes_of_side;
        place[2] = node / nodes_of_side / nodes_of_side;
      });
    }
    if (options) { OK(PetscOptionsInsertString(NULL, options)); }
    OK(KSPCreate(PETSC_COMM_SELF, &ksp));
    OK(LinearDefaults(ksp, &choice));
    choice.may_be_rough = (PetscBool)rough;
    OK(KSPSetFromOptions(ksp));
    OK(KSPSetOperators(ksp, A, A));
    OK(LinearChoose(ksp, A, PETSC_TRUE, &choice));
    if (options) { OK(PetscOptionsClear(NULL)); }
  }
  bool isConstraint()
  {
    PC        pc;
    PetscBool is = PETSC_FALSE;
    EXPECT_EQ(KSPGetPC(ksp, &pc), 0);
    EXPECT_EQ(PetscObjectTypeCompare((PetscObject)pc, PCHHTCONSTRAINT, &is), 0);
    return is;
  }
  /* norm of b - A x relative to that of b */
  double leftOf()
  {
    PetscReal all = 0;
    double    forces = 0, constraints = 0;
    EXPECT_EQ(VecNorm(b, NORM_INFINITY, &all), 0);
    left(x, &forces, &constraints);
    return std::max(forces, constraints) / all;
  }
};

} // namespace

#endif
