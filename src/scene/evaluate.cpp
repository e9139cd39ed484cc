/* Residual and Jacobian of the scene: exchange of unknowns between ranks, motion of the bodies, terms of the elements,
   then inertia terms of the bodies. */
#include "guard.h"
#include "runtime.h"
#include <algorithm>

namespace hhtdae
{

/* local: the local unknowns and their derivatives. On one rank these are the given arrays, else copies in which other
   ranks' values follow the own ones */
PetscErrorCode LocalState(Runtime &R, const double *u, const double *v, const double *a, const double *local[3])
{
  const double *own[3] = {u, v, a};
  PetscFunctionBegin;
  if (R.size == 1) {
    std::copy(own, own + 3, local);
    PetscFunctionReturn(0);
  }
  const int            width  = R.uses_acceleration ? 3 : 2;
  std::vector<double> *all[3] = {&R.u, &R.v, &R.a};
  for (PetscInt i : R.boundary)
    for (int k = 0; k < width; k++) R.send[(std::size_t)width * i + k] = own[k][i];
  PetscCall(PetscSFBcastBegin(R.sf, R.unit, R.send.data(), R.receive.data(), MPI_REPLACE));
  for (int k = 0; k < 3; k++) std::copy(own[k], own[k] + R.n, all[k]->begin());
  PetscCall(PetscSFBcastEnd(R.sf, R.unit, R.send.data(), R.receive.data(), MPI_REPLACE));
  for (std::size_t i = 0; i < R.others.size(); i++)
    for (int k = 0; k < width; k++) (*all[k])[R.n + i] = R.receive[width * i + k];
  for (int k = 0; k < 3; k++) local[k] = all[k]->data();
  PetscFunctionReturn(0);
}

/* V: velocities at the beginning of the step whose Newton matrix is computed next */
PetscErrorCode NoteBeginning(Runtime &R, Vec V)
{
  const double *v, *local[3];
  PetscFunctionBegin;
  PetscCall(VecGetArrayRead(V, &v));
  PetscCall(LocalState(R, v, v, v, local));
  for (std::size_t b = 0; b < R.bodies.body.size(); b++) {
    const LocalBody &k = R.bodies.body[b];
    if (TurnsInSpace(k.kind)) R.bodies.now[b].w0 = Eigen::Map<const Vector3>(local[1] + k.first + 3);
  }
  PetscCall(VecRestoreArrayRead(V, &v));
  PetscFunctionReturn(0);
}

PetscErrorCode LocalMotion(Runtime &R, const double *u, const double *v, const double *a, std::vector<double> &room, const double *local[3])
{
  const bool exchange_apart = R.size > 1 && !R.uses_acceleration;
  PetscFunctionBegin;
  if (exchange_apart) {
    PetscCall(LocalState(R, a, a, a, local));
    room.assign(local[0], local[0] + R.u.size());
  }
  PetscCall(LocalState(R, u, v, a, local));
  if (exchange_apart) local[2] = room.data();
  PetscFunctionReturn(0);
}

PetscErrorCode Residual(Runtime &R, double t, Vec U, Vec V, Vec A, Vec F)
{
  const double *u, *v, *a, *local[3];
  double       *f;
  PetscFunctionBegin;
  PetscCall(VecGetArrayRead(U, &u));
  PetscCall(VecGetArrayRead(V, &v));
  PetscCall(VecGetArrayRead(A, &a));
  PetscCall(LocalState(R, u, v, a, local));
  PetscCall(VecGetArrayWrite(F, &f));
  std::fill(f, f + R.n, 0.0);
  const PetscErrorCode failed = Guarded([&] {
    R.bodies.move(local[0], local[1]);
    R.bodies.gravity = R.scene.gravityAt(t);
    Evaluation e{t, local[0], local[1], local[2], R.bodies, R.n, f};
    for (auto &b : R.batches) b->residual(e);
    R.bodies.loadCarriers();
    R.bodies.residual(local[0], local[1], local[2], f);
    R.bad_element = AllFinite(f, R.n) ? -1 : BadElement(R, e, f);
    return PetscErrorCode(0);
  });
  PetscCall(VecRestoreArrayWrite(F, &f));
  PetscCall(VecRestoreArrayRead(U, &u));
  PetscCall(VecRestoreArrayRead(V, &v));
  PetscCall(VecRestoreArrayRead(A, &a));
  PetscCall(OnAllRanks(R.scene.comm, failed));
  PetscFunctionReturn(0);
}

namespace
{

/* Adds the nine diagonal blocks of a flexible body, ModalPart::block, to the matrix */
void ModalBlocks(Runtime &R, PetscInt b, const Evaluation &e, const Slot *&slot)
{
  const int size[3] = {3, 3, R.bodies.modes(b)}, at[3] = {0, 3, 6};
  R.bodies.modalJacobian(b, e.u, e.v, e.a, e.sv, e.sa);
  const auto &B = R.bodies.modal[R.bodies.body[b].modal].block;
  for (int g = 0; g < 3; g++)
    for (int h = 0; h < 3; h++) e.sink.add(*slot++, B.block(at[g], at[h], size[g], size[h]), size[g], size[h]);
}

void BodyBlocks(Runtime &R, const Evaluation &e)
{
  const Slot *slot = R.body_slot.data();
  for (PetscInt b = 0; b < R.bodies.own; b++) {
    Eigen::Matrix<double, 6, 6, Eigen::RowMajor> B;
    const BodyKind                               kind = R.bodies.body[b].kind;
    if (kind == BodyKind::Attached) continue;
    if (kind == BodyKind::Flexible) {
      ModalBlocks(R, b, e, slot);
      continue;
    }
    R.bodies.jacobian(b, e.u, e.v, e.a, e.sv, e.sa, B);
    for (int g = 0; g < Groups(kind); g++) {
      const int size = GroupSize(kind, g), at = GroupOffset(kind, g);
      e.sink.add(*slot++, B.block(at, at, size, size), size, size);
    }
  }
}

void AddAll(Runtime &R, Evaluation &e)
{
  R.projection.begin(e.sink);
  for (auto &b : R.batches) b->jacobian(e);
  R.bodies.loadCarriers();
  R.projection.finish(e);
  BodyBlocks(R, e);
}

/* SEQAIJ and MPIAIJ are filled in place; other types are converted from the AIJ matrix R.J */
PetscErrorCode Fill(Runtime &R, Evaluation &e, Mat aij)
{
  Mat       diagonal = aij, off = nullptr;
  PetscInt  n;
  PetscFunctionBegin;
  if (R.size > 1) PetscCall(MatMPIAIJGetSeqAIJ(aij, &diagonal, &off, nullptr));
  MatInfo info;
  PetscCall(MatSeqAIJGetArrayWrite(diagonal, &e.sink.diagonal));
  PetscCall(MatGetInfo(diagonal, MAT_LOCAL, &info));
  n = (PetscInt)info.nz_used;
  std::fill(e.sink.diagonal, e.sink.diagonal + n, 0.0);
  if (off) {
    PetscCall(MatSeqAIJGetArrayWrite(off, &e.sink.off));
    PetscCall(MatGetInfo(off, MAT_LOCAL, &info));
    std::fill(e.sink.off, e.sink.off + (PetscInt)info.nz_used, 0.0);
  }
  const PetscErrorCode failed = Guarded([&] {
    R.bodies.move(e.u, e.v);
    R.bodies.gravity = R.scene.gravityAt(e.t);
    AddAll(R, e);
    return PetscErrorCode(0);
  });
  PetscCall(MatSeqAIJRestoreArrayWrite(diagonal, &e.sink.diagonal));
  if (off) PetscCall(MatSeqAIJRestoreArrayWrite(off, &e.sink.off));
  PetscCall(OnAllRanks(R.scene.comm, failed));
  PetscCall(MatAssemblyBegin(aij, MAT_FINAL_ASSEMBLY));
  PetscCall(MatAssemblyEnd(aij, MAT_FINAL_ASSEMBLY));
  PetscFunctionReturn(0);
}

} // namespace

PetscErrorCode Jacobian(Runtime &R, double t, Vec U, Vec V, Vec A, double sv, double sa, Mat J)
{
  const double *u, *v, *a, *local[3];
  PetscBool     ours;
  PetscFunctionBegin;
  PetscCall(VecGetArrayRead(U, &u));
  PetscCall(VecGetArrayRead(V, &v));
  PetscCall(VecGetArrayRead(A, &a));
  PetscCall(LocalState(R, u, v, a, local));
  Evaluation e{t, local[0], local[1], local[2], R.bodies, R.n, nullptr, sv, sa};
  PetscCall(PetscObjectTypeCompareAny((PetscObject)J, &ours, MATSEQAIJ, MATMPIAIJ, ""));
  if (ours) {
    PetscCall(Fill(R, e, J));
  } else {
    MatType type;
    PetscCall(Fill(R, e, R.J));
    PetscCall(MatGetType(J, &type));
    PetscCall(MatConvert(R.J, type, MAT_REUSE_MATRIX, &J));
  }
  PetscCall(VecRestoreArrayRead(U, &u));
  PetscCall(VecRestoreArrayRead(V, &v));
  PetscCall(VecRestoreArrayRead(A, &a));
  PetscFunctionReturn(0);
}

Runtime::~Runtime()
{
  PetscBool gone = PETSC_FALSE;
  if (PetscFinalized(&gone) || gone) return; /* PetscFinalize() has been called */
  for (IS &is : roles) PetscCallAbort(PETSC_COMM_SELF, ISDestroy(&is));
  PetscCallAbort(PETSC_COMM_SELF, MatDestroy(&J));
  PetscCallAbort(PETSC_COMM_SELF, VecDestroy(&axes));
  for (Vec &x : tolerance) PetscCallAbort(PETSC_COMM_SELF, VecDestroy(&x));
  for (Vec &x : start_state) PetscCallAbort(PETSC_COMM_SELF, VecDestroy(&x));
  PetscCallAbort(PETSC_COMM_SELF, PetscSFDestroy(&sf));
  PetscCallAbort(PETSC_COMM_SELF, PetscSFDestroy(&axes_sf));
  if (unit != MPI_DATATYPE_NULL) MPI_Type_free(&unit);
}

} // namespace hhtdae
