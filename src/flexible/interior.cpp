/* The interior problem: K and M of the free dofs, bordered by the rows of averages. */
#include "interior.h"
#include <algorithm>
#include <cmath>

namespace hhtdae
{

std::vector<PetscInt> FreeDofs(const FeModel &model, const std::vector<Tied> &tied)
{
  std::vector<char>     held(model.own, 0);
  std::vector<PetscInt> dofs;
  for (const Tied &t : tied)
    if (t.tie == Tie::Rigid)
      for (PetscInt i : t.node) held[i] = 1;
  for (PetscInt i = 0; i < model.own; i++)
    for (int c = 0; c < 3 && !held[i]; c++) dofs.push_back(3 * i + c);
  return dofs;
}

static PetscErrorCode SubMatrix(const FeModel &model, Mat A, const std::vector<PetscInt> &dof, Mat *sub)
{
  IS                    is;
  std::vector<PetscInt> global(dof);

  PetscFunctionBegin;
  for (PetscInt &d : global) d += 3 * model.first;
  PetscCall(ISCreateGeneral(model.comm, (PetscInt)global.size(), global.data(), PETSC_COPY_VALUES, &is));
  PetscCall(MatCreateSubMatrix(A, is, is, MAT_INITIAL_MATRIX, sub));
  PetscCall(ISDestroy(&is));
  PetscFunctionReturn(0);
}

PetscErrorCode CreateEmpty(MPI_Comm comm, PetscInt rows, PetscInt cols, Mat *A)
{
  PetscFunctionBegin;
  PetscCall(MatCreate(comm, A));
  PetscCall(MatSetSizes(*A, rows, cols, PETSC_DETERMINE, PETSC_DETERMINE));
  PetscCall(MatSetType(*A, MATAIJ));
  PetscFunctionReturn(0);
}

/* Places the multipliers of an average on the rank with most of its nodes */
static PetscErrorCode PlaceMultipliers(const FeModel &model, const std::vector<Tied> &tied, Interior *in,
                                       PetscInt *mine, std::vector<PetscInt> *global)
{
  PetscMPIInt rank, size;

  PetscFunctionBegin;
  PetscCallMPI(MPI_Comm_rank(model.comm, &rank));
  PetscCallMPI(MPI_Comm_size(model.comm, &size));
  std::vector<PetscInt> count(size + 1, 0);
  for (const Tied &t : tied)
    if (t.tie == Tie::Average) count[t.owner + 1] += 6;
  *mine = count[rank + 1];
  for (PetscMPIInt r = 0; r < size; r++) count[r + 1] += count[r];
  std::vector<PetscInt> next(count);
  for (const Tied &t : tied)
    for (int k = 0; k < 6 && t.tie == Tie::Average; k++) {
      in->row.push_back(t.owner == rank ? (PetscInt)in->dof.size() + next[t.owner] - count[t.owner] : -1);
      global->push_back(next[t.owner]++);
    }
  PetscFunctionReturn(0);
}

/* Scales rows of averages to the size of entries of K, so that pivots are comparable */
static PetscErrorCode ScaleRows(const FeModel &model, const std::vector<Tied> &tied, const BodyScales &scales,
                                VectorXd *scale)
{
  std::vector<double> squares;
  const double        size = scales.stiff * scales.mass / (double)model.nodes;

  PetscFunctionBegin;
  for (const Tied &t : tied)
    for (int k = 0; k < 6 && t.tie == Tie::Average; k++) {
      squares.push_back(0);
      for (const auto &row : t.row) squares.back() += row.row(k).squaredNorm();
    }
  PetscCallMPI(
      MPI_Allreduce(MPI_IN_PLACE, squares.data(), (PetscMPIInt)squares.size(), MPI_DOUBLE, MPI_SUM, model.comm));
  scale->resize((Eigen::Index)squares.size());
  for (std::size_t k = 0; k < squares.size(); k++) (*scale)[k] = size / std::sqrt(squares[k]);
  PetscFunctionReturn(0);
}

/* The scaled C^T in the free dofs, with six columns for each average */
static PetscErrorCode CreateCt(const FeModel &model, const std::vector<Tied> &tied, const Interior &in, PetscInt mine,
                               const std::vector<PetscInt> &global, Mat *Ct)
{
  std::vector<PetscInt> place(3 * model.own, -1), entries(in.dof.size(), 0), off(in.dof.size());
  PetscInt              begin, average = 0;

  PetscFunctionBegin;
  for (std::size_t i = 0; i < in.dof.size(); i++) place[in.dof[i]] = (PetscInt)i;
  for (const Tied &t : tied)
    for (PetscInt n : t.node)
      for (int c = 0; c < 3 && t.tie == Tie::Average; c++) entries[place[3 * n + c]] += 6;
  PetscCall(CreateEmpty(model.comm, (PetscInt)in.dof.size(), mine, Ct));
  for (std::size_t i = 0; i < entries.size(); i++) { /* PETSc refuses to preallocate more entries than there are columns */
    off[i]     = std::min(entries[i], (PetscInt)global.size() - mine);
    entries[i] = std::min(entries[i], mine);
  }
  PetscCall(MatSeqAIJSetPreallocation(*Ct, 0, entries.data()));
  PetscCall(MatMPIAIJSetPreallocation(*Ct, 0, entries.data(), 0, off.data()));
  PetscCall(MatSetOption(*Ct, MAT_NEW_NONZERO_ALLOCATION_ERR, PETSC_FALSE));
  PetscCall(MatGetOwnershipRange(*Ct, &begin, nullptr));
  for (const Tied &t : tied) {
    if (t.tie != Tie::Average) continue;
    for (std::size_t i = 0; i < t.node.size(); i++)
      for (int c = 0; c < 3; c++) {
        const PetscInt                    row   = begin + place[3 * t.node[i] + c];
        const Eigen::Matrix<double, 6, 1> value = t.row[i].col(c).cwiseProduct(in.scale.segment<6>(6 * average));
        PetscCall(MatSetValues(*Ct, 1, &row, 6, &global[6 * average], value.data(), INSERT_VALUES));
      }
    average++;
  }
  PetscCall(MatAssemblyBegin(*Ct, MAT_FINAL_ASSEMBLY));
  PetscCall(MatAssemblyEnd(*Ct, MAT_FINAL_ASSEMBLY));
  PetscFunctionReturn(0);
}

static PetscErrorCode Bordered(MPI_Comm comm, Mat *A, Mat upper, Mat lower, Mat corner)
{
  Mat blocks[4] = {*A, upper, lower, corner}, nest, all;

  PetscFunctionBegin;
  PetscCall(MatCreateNest(comm, 2, nullptr, 2, nullptr, blocks, &nest));
  PetscCall(MatConvert(nest, MATAIJ, MAT_INITIAL_MATRIX, &all));
  PetscCall(MatDestroy(&nest));
  PetscCall(MatDestroy(A));
  *A = all;
  PetscFunctionReturn(0);
}

static PetscErrorCode AddMultipliers(const FeModel &model, const std::vector<Tied> &tied, const BodyScales &scales,
                                     Interior *in)
{
  PetscInt              mine = 0;
  std::vector<PetscInt> global;
  Mat                   Ct, C, zero;

  PetscFunctionBegin;
  PetscCall(PlaceMultipliers(model, tied, in, &mine, &global));
  in->pencil.multipliers = (PetscInt)global.size();
  in->rows               = (PetscInt)in->dof.size() + mine;
  if (global.empty()) PetscFunctionReturn(0);
  PetscCall(ScaleRows(model, tied, scales, &in->scale));
  PetscCall(CreateCt(model, tied, *in, mine, global, &Ct));
  PetscCall(MatTranspose(Ct, MAT_INITIAL_MATRIX, &C));
  PetscCall(CreateEmpty(model.comm, mine, mine, &zero));
  PetscCall(MatSetUp(zero));
  PetscCall(MatAssemblyBegin(zero, MAT_FINAL_ASSEMBLY));
  PetscCall(MatAssemblyEnd(zero, MAT_FINAL_ASSEMBLY));
  PetscCall(Bordered(model.comm, &in->pencil.K, Ct, C, zero));
  PetscCall(Bordered(model.comm, &in->pencil.M, nullptr, nullptr, zero));
  PetscCall(MatDestroy(&Ct));
  PetscCall(MatDestroy(&C));
  PetscCall(MatDestroy(&zero));
  PetscFunctionReturn(0);
}

PetscErrorCode CreateInterior(const FeModel &model, const std::vector<Tied> &tied, const BodyScales &scales,
                              Interior *in)
{
  PetscInt count;

  PetscFunctionBegin;
  in->dof = FreeDofs(model, tied);
  count   = (PetscInt)in->dof.size();
  PetscCallMPI(MPI_Allreduce(MPI_IN_PLACE, &count, 1, MPIU_INT, MPI_SUM, model.comm));
  PetscCheck(count > 0, model.comm, PETSC_ERR_ARG_WRONG,
             "The attachments hold all nodes of the FE model rigidly: nothing is left to deform");
  PetscCall(SubMatrix(model, model.K, in->dof, &in->pencil.K));
  PetscCall(SubMatrix(model, model.M, in->dof, &in->pencil.M));
  PetscCall(AddMultipliers(model, tied, scales, in));
  in->pencil.modes = count - in->pencil.multipliers;
  PetscCheck(in->pencil.modes >= 0, model.comm, PETSC_ERR_ARG_WRONG,
             "The averages have more degrees of freedom than the nodes of the FE model");
  PetscFunctionReturn(0);
}

} // namespace hhtdae
