/*
  A linear elastic block of 8-node bricks, held by Lagrange multipliers, distributed over all processes:

    M u'' + C u' + K u + Phi^T lambda = f,   Phi u = 0,   C = a M + b K

  Every process numbers the displacements of its grid nodes first and then the multipliers at these nodes.
*/
#ifndef HHTDAE_EXAMPLES_ELASTICBLOCK_MODEL_H
#define HHTDAE_EXAMPLES_ELASTICBLOCK_MODEL_H

#include "elasticblock_brick.h"
#include <petscdmda.h>
#include <petscts.h>
#include <vector>

namespace elasticblock
{

enum Support { CLAMPED, HINGED };
enum Load { GRAVITY, TIP };

struct Options {
  PetscInt  n[3]    = {40, 4, 4};      /* bricks along x, y, z */
  PetscReal size[3] = {1.0, 0.1, 0.1}; /* edges [m] */
  Material  steel   = {2.1e11, 0.3, 7850};
  PetscReal a = 0, b = 0;    /* Rayleigh damping [1/s], [s] */
  PetscReal force   = -1000; /* total tip load along z [N] */
  PetscReal gravity = -9.81; /* along z [m/s^2] */
  Support   support = CLAMPED;
  Load      load    = TIP;
  PetscBool lumped  = PETSC_FALSE;
};

struct Model {
  Options               options;
  DM                    grid;
  std::vector<PetscInt> first_node_dof, shift; /* of every process: its first displacement in the grid's numbering, and
                                                  how many multipliers come before it */
  PetscInt multipliers;                        /* on this process */
  Mat      M, C, S, J;                         /* one pattern; S = [K Phi^T; Phi 0], C = NULL without damping */
  Vec      f, work;
  IS       constraints; /* rows of the multipliers */
};

inline PetscErrorCode options_read(Options *o)
{
  const char *const supports[] = {"clamped", "hinged", "Support", "", NULL}, *const loads[] = {"gravity", "tip", "Load",
                                                                                               "", NULL};
  PetscInt  count = 3;
  PetscBool sized;

  PetscFunctionBeginUser;
  PetscOptionsBegin(PETSC_COMM_WORLD, NULL, "Elastic block", "");
  PetscCall(PetscOptionsInt("-nx", "bricks along x", "", o->n[0], &o->n[0], NULL));
  PetscCall(PetscOptionsInt("-ny", "bricks along y", "", o->n[1], &o->n[1], NULL));
  PetscCall(PetscOptionsInt("-nz", "bricks along z", "", o->n[2], &o->n[2], NULL));
  PetscCall(PetscOptionsRealArray("-size", "edges along x, y, z [m]", "", o->size, &count, &sized));
  PetscCall(PetscOptionsReal("-E", "Young's modulus [Pa]", "", o->steel.E, &o->steel.E, NULL));
  PetscCall(PetscOptionsReal("-nu", "Poisson's ratio", "", o->steel.nu, &o->steel.nu, NULL));
  PetscCall(PetscOptionsReal("-rho", "density [kg/m^3]", "", o->steel.rho, &o->steel.rho, NULL));
  PetscCall(PetscOptionsReal("-damping_mass", "Rayleigh damping, factor of M [1/s]", "", o->a, &o->a, NULL));
  PetscCall(PetscOptionsReal("-damping_stiffness", "Rayleigh damping, factor of K [s]", "", o->b, &o->b, NULL));
  PetscCall(PetscOptionsReal("-force", "total load on the face x = size, along z [N]", "", o->force, &o->force, NULL));
  PetscCall(PetscOptionsReal("-gravity", "acceleration along z [m/s^2]", "", o->gravity, &o->gravity, NULL));
  PetscCall(PetscOptionsEnum("-support", "face x = 0 clamped, or its lower edge hinged", "", supports,
                             (PetscEnum)o->support, (PetscEnum *)&o->support, NULL));
  PetscCall(PetscOptionsEnum("-load", "applied suddenly at the start", "", loads, (PetscEnum)o->load,
                             (PetscEnum *)&o->load, NULL));
  PetscCall(PetscOptionsBool("-lumped", "mass on the nodes", "", o->lumped, &o->lumped, NULL));
  PetscOptionsEnd();
  for (int d = 0; d < 3; ++d)
    PetscCheck(o->n[d] > 0 && o->size[d] > 0, PETSC_COMM_WORLD, PETSC_ERR_USER,
               "The block needs at least one brick and a positive edge along %c", "xyz"[d]);
  PetscCheck(!sized || count == 3, PETSC_COMM_WORLD, PETSC_ERR_USER, "-size takes three numbers, x,y,z");
  PetscFunctionReturn(0);
}

/* ---- numbering ---- */

inline bool is_held(const Options &o, PetscInt i, PetscInt k) { return i == 0 && (o.support == CLAMPED || k == 0); }

/* From a displacement's number in the grid to its row in the whole system */
inline PetscInt row_of(const Model &m, PetscInt dof)
{
  size_t owner = 0;
  while (owner + 1 < m.shift.size() && dof >= m.first_node_dof[owner + 1]) ++owner;
  return dof + m.shift[owner];
}

inline PetscErrorCode model_number(Model *m)
{
  const Options  &o = m->options;
  PetscInt        x0[3], w[3], before, first;
  const PetscInt *ranges;
  PetscMPIInt     ranks;
  Vec             v;

  PetscFunctionBeginUser;
  PetscCall(DMDACreate3d(PETSC_COMM_WORLD, DM_BOUNDARY_NONE, DM_BOUNDARY_NONE, DM_BOUNDARY_NONE, DMDA_STENCIL_BOX,
                         o.n[0] + 1, o.n[1] + 1, o.n[2] + 1, PETSC_DECIDE, PETSC_DECIDE, PETSC_DECIDE, 3, 1, NULL, NULL,
                         NULL, &m->grid));
  PetscCall(DMSetFromOptions(m->grid));
  PetscCall(DMSetUp(m->grid));
  PetscCall(DMDAGetCorners(m->grid, &x0[0], &x0[1], &x0[2], &w[0], &w[1], &w[2]));
  m->multipliers = 0;
  for (PetscInt k = x0[2]; k < x0[2] + w[2]; ++k)
    for (PetscInt j = x0[1]; j < x0[1] + w[1]; ++j) m->multipliers += is_held(o, x0[0], k) ? 3 : 0;
  PetscCallMPI(MPI_Comm_size(PETSC_COMM_WORLD, &ranks));
  m->shift.resize(ranks);
  before = 0;
  PetscCallMPI(MPI_Exscan(&m->multipliers, &before, 1, MPIU_INT, MPI_SUM, PETSC_COMM_WORLD));
  PetscCallMPI(MPI_Allgather(&before, 1, MPIU_INT, m->shift.data(), 1, MPIU_INT, PETSC_COMM_WORLD));
  PetscCall(DMGetGlobalVector(m->grid, &v));
  PetscCall(VecGetOwnershipRanges(v, &ranges));
  m->first_node_dof.assign(ranges, ranges + ranks);
  PetscCall(DMRestoreGlobalVector(m->grid, &v));

  PetscMPIInt rank;
  PetscCallMPI(MPI_Comm_rank(PETSC_COMM_WORLD, &rank));
  first = m->first_node_dof[rank] + m->shift[rank] + 3 * w[0] * w[1] * w[2];
  PetscCall(ISCreateStride(PETSC_COMM_WORLD, m->multipliers, first, 1, &m->constraints));
  PetscFunctionReturn(0);
}

/* Rows of the three displacements of the nodes of this process and its neighbours, and of its first multiplier */
struct Rows {
  PetscInt              x0[3], w[3], g0[3], gw[3]; /* owned nodes, and with the neighbours' */
  std::vector<PetscInt> row;
  PetscInt              first_multiplier;

  PetscInt local(PetscInt i, PetscInt j, PetscInt k) const
  {
    return i - g0[0] + gw[0] * (j - g0[1] + gw[1] * (k - g0[2]));
  }
  PetscInt operator()(PetscInt i, PetscInt j, PetscInt k) const { return row[3 * local(i, j, k)]; }
};

inline PetscErrorCode rows_create(const Model &m, Rows *r)
{
  ISLocalToGlobalMapping map;
  const PetscInt        *dofs;
  PetscInt               n;

  PetscFunctionBeginUser;
  PetscCall(DMDAGetCorners(m.grid, &r->x0[0], &r->x0[1], &r->x0[2], &r->w[0], &r->w[1], &r->w[2]));
  PetscCall(DMDAGetGhostCorners(m.grid, &r->g0[0], &r->g0[1], &r->g0[2], &r->gw[0], &r->gw[1], &r->gw[2]));
  PetscCall(DMGetLocalToGlobalMapping(m.grid, &map));
  PetscCall(ISLocalToGlobalMappingGetSize(map, &n));
  PetscCall(ISLocalToGlobalMappingGetIndices(map, &dofs));
  r->row.resize(n);
  for (PetscInt i = 0; i < n; ++i) r->row[i] = row_of(m, dofs[i]);
  PetscCall(ISLocalToGlobalMappingRestoreIndices(map, &dofs));
  PetscCall(ISStrideGetInfo(m.constraints, &r->first_multiplier, NULL));
  PetscFunctionReturn(0);
}

/* ---- assembly ---- */

/* A node couples with up to 27 nodes and its own multipliers; a multiplier with one displacement */
inline PetscErrorCode model_create_matrix(const Model &m, const Rows &r, Mat *A)
{
  const PetscInt        local = 3 * r.w[0] * r.w[1] * r.w[2] + m.multipliers;
  std::vector<PetscInt> here, away;

  PetscFunctionBeginUser;
  for (PetscInt k = r.x0[2]; k < r.x0[2] + r.w[2]; ++k)
    for (PetscInt j = r.x0[1]; j < r.x0[1] + r.w[1]; ++j)
      for (PetscInt i = r.x0[0]; i < r.x0[0] + r.w[0]; ++i) {
        const PetscInt node[3] = {i, j, k};
        PetscInt       all = 3, own = 3;
        for (int d = 0; d < 3; ++d) {
          const PetscInt low = PetscMax(node[d] - 1, 0), high = PetscMin(node[d] + 1, m.options.n[d]);
          all *= high - low + 1;
          own *= PetscMin(high, r.x0[d] + r.w[d] - 1) - PetscMax(low, r.x0[d]) + 1;
        }
        here.insert(here.end(), 3, own + (is_held(m.options, i, k) ? 1 : 0));
        away.insert(away.end(), 3, all - own);
      }
  here.insert(here.end(), m.multipliers, 2);
  away.insert(away.end(), m.multipliers, 0);
  PetscCall(MatCreate(PETSC_COMM_WORLD, A));
  PetscCall(MatSetSizes(*A, local, local, PETSC_DETERMINE, PETSC_DETERMINE));
  PetscCall(MatSetType(*A, MATAIJ));
  PetscCall(MatSeqAIJSetPreallocation(*A, 0, here.data()));
  PetscCall(MatMPIAIJSetPreallocation(*A, 0, here.data(), 0, away.data()));
  PetscFunctionReturn(0);
}

/* Every brick is added by the process that owns its lowest corner */
inline PetscErrorCode add_bricks(const Model &m, const Rows &r, const BrickMatrix &brick, Mat A)
{
  PetscFunctionBeginUser;
  for (PetscInt k = r.x0[2]; k < PetscMin(r.x0[2] + r.w[2], m.options.n[2]); ++k)
    for (PetscInt j = r.x0[1]; j < PetscMin(r.x0[1] + r.w[1], m.options.n[1]); ++j)
      for (PetscInt i = r.x0[0]; i < PetscMin(r.x0[0] + r.w[0], m.options.n[0]); ++i) {
        PetscInt rows[DOFS];
        for (int node = 0; node < NODES; ++node)
          for (int d = 0; d < 3; ++d)
            rows[3 * node + d] = r(i + (node & 1), j + ((node >> 1) & 1), k + (node >> 2)) + d;
        PetscCall(MatSetValues(A, DOFS, rows, DOFS, rows, brick.data(), ADD_VALUES));
      }
  PetscFunctionReturn(0);
}

/* value = 1: adds Phi and its transpose; 0: only adds their entries to the pattern, so that all matrices have the same pattern */
inline PetscErrorCode add_constraints(const Model &m, const Rows &r, PetscScalar value, Mat A)
{
  PetscInt lambda = r.first_multiplier;

  PetscFunctionBeginUser;
  if (r.x0[0] > 0) PetscFunctionReturn(0);
  for (PetscInt k = r.x0[2]; k < r.x0[2] + r.w[2]; ++k)
    for (PetscInt j = r.x0[1]; j < r.x0[1] + r.w[1]; ++j)
      for (int d = 0; d < 3 && is_held(m.options, 0, k); ++d, ++lambda) {
        PetscCall(MatSetValue(A, lambda, r(0, j, k) + d, value, ADD_VALUES));
        PetscCall(MatSetValue(A, r(0, j, k) + d, lambda, value, ADD_VALUES));
        PetscCall(MatSetValue(A, lambda, lambda, 0.0, ADD_VALUES));
      }
  PetscFunctionReturn(0);
}

inline PetscErrorCode model_assemble(const Model &m, const Rows &r, const BrickMatrix &brick, PetscScalar constraint,
                                     Mat *A)
{
  PetscFunctionBeginUser;
  PetscCall(model_create_matrix(m, r, A));
  PetscCall(add_bricks(m, r, brick, *A));
  PetscCall(add_constraints(m, r, constraint, *A));
  PetscCall(MatAssemblyBegin(*A, MAT_FINAL_ASSEMBLY));
  PetscCall(MatAssemblyEnd(*A, MAT_FINAL_ASSEMBLY));
  PetscFunctionReturn(0);
}

/* The tip load is a uniform traction: a node takes the quarter of each face that it belongs to */
inline PetscErrorCode model_load(Model *m, const Rows &r)
{
  const Options &o = m->options;

  PetscFunctionBeginUser;
  PetscCall(MatCreateVecs(m->M, &m->work, &m->f));
  PetscCall(VecZeroEntries(m->work));
  for (PetscInt k = r.x0[2]; k < r.x0[2] + r.w[2]; ++k)
    for (PetscInt j = r.x0[1]; j < r.x0[1] + r.w[1]; ++j)
      for (PetscInt i = r.x0[0]; i < r.x0[0] + r.w[0]; ++i) {
        const PetscReal edges = (j == 0 || j == o.n[1] ? 0.5 : 1.0) * (k == 0 || k == o.n[2] ? 0.5 : 1.0);
        const PetscReal tip   = i == o.n[0] ? o.force * edges / (PetscReal)(o.n[1] * o.n[2]) : 0;
        PetscCall(VecSetValue(m->work, r(i, j, k) + 2, o.load == GRAVITY ? o.gravity : tip, INSERT_VALUES));
      }
  PetscCall(VecAssemblyBegin(m->work));
  PetscCall(VecAssemblyEnd(m->work));
  if (o.load == GRAVITY)
    PetscCall(MatMult(m->M, m->work, m->f));
  else
    PetscCall(VecCopy(m->work, m->f));
  PetscFunctionReturn(0);
}

inline PetscErrorCode model_create(const Options &options, Model *m)
{
  const double h[3] = {options.size[0] / options.n[0], options.size[1] / options.n[1], options.size[2] / options.n[2]};
  BrickMatrix  K, M, C;
  Rows         rows;

  PetscFunctionBeginUser;
  m->options = options;
  brick_matrices(options.steel, h, options.lumped, K, M);
  PetscCall(model_number(m));
  PetscCall(rows_create(*m, &rows));
  PetscCall(model_assemble(*m, rows, K, 1.0, &m->S));
  PetscCall(model_assemble(*m, rows, M, 0.0, &m->M));
  m->C = NULL;
  if (options.a != 0 || options.b != 0) {
    for (int i = 0; i < DOFS * DOFS; ++i) C[i] = options.a * M[i] + options.b * K[i];
    PetscCall(model_assemble(*m, rows, C, 0.0, &m->C));
  }
  PetscCall(MatDuplicate(m->S, MAT_COPY_VALUES, &m->J));
  PetscCall(model_load(m, rows));
  PetscFunctionReturn(0);
}

inline PetscErrorCode model_destroy(Model *m)
{
  PetscFunctionBeginUser;
  for (Mat *A : {&m->M, &m->C, &m->S, &m->J}) PetscCall(MatDestroy(A));
  PetscCall(VecDestroy(&m->f));
  PetscCall(VecDestroy(&m->work));
  PetscCall(ISDestroy(&m->constraints));
  PetscCall(DMDestroy(&m->grid));
  PetscFunctionReturn(0);
}

/* ---- the equations ---- */

inline PetscErrorCode residual(TS, PetscReal, Vec U, Vec V, Vec A, Vec F, void *ctx)
{
  const Model *m = (const Model *)ctx;

  PetscFunctionBeginUser;
  PetscCall(MatMult(m->S, U, F));
  if (m->C) PetscCall(MatMultAdd(m->C, V, F, F));
  PetscCall(MatMultAdd(m->M, A, F, F));
  PetscCall(VecAXPY(F, -1.0, m->f));
  PetscFunctionReturn(0);
}

inline PetscErrorCode jacobian(TS, PetscReal, Vec, Vec, Vec, PetscReal v, PetscReal a, Mat J, Mat P, void *ctx)
{
  const Model *m = (const Model *)ctx;

  PetscFunctionBeginUser;
  PetscCall(MatCopy(m->S, P, SAME_NONZERO_PATTERN));
  if (m->C) PetscCall(MatAXPY(P, v, m->C, SAME_NONZERO_PATTERN));
  PetscCall(MatAXPY(P, a, m->M, SAME_NONZERO_PATTERN));
  if (J != P) {
    PetscCall(MatAssemblyBegin(J, MAT_FINAL_ASSEMBLY));
    PetscCall(MatAssemblyEnd(J, MAT_FINAL_ASSEMBLY));
  }
  PetscFunctionReturn(0);
}

} // namespace elasticblock
#endif
