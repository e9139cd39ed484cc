/* Assigns global numbers to all unknowns; every rank makes the same computation. */
#include "extension.h"
#include "model.h"

namespace hhtdae
{

/* The owner of an element is the owner of its first movable body */
PetscMPIInt OwnerOf(const Model &M, const StoreBase &s, PetscInt e)
{
  if (M.size == 1) return 0;
  for (int k = 0; k < s.markers(); k++) {
    const PetscInt b = M.scene.markers[s.marker(e, k)].body;
    if (b >= 0) return M.number.owner[b];
  }
  return 0;
}

BodyKind KindOf(const SceneData &s, const BodyData &b)
{
  if (s.planar) return b.point ? BodyKind::PlanarPoint : BodyKind::Planar;
  if (b.flexible) return BodyKind::Flexible;
  return b.point ? BodyKind::Point : BodyKind::Rigid;
}

PetscInt CoordinatesOf(const SceneData &s, const BodyData &b)
{
  if (b.carrier >= 0) return 0; /* the frame of an attachment has no coordinates */
  return Coordinates(KindOf(s, b)) + (b.flexible ? b.flexible->model->modes() : 0);
}

namespace
{

/* Calls f(owner, number of unknowns, reference to the number of the first unknown) for everything that has unknowns, in
   the order of the numbers within a rank */
template <class F> void Visit(Model &M, F f)
{
  SceneData &s = M.scene;
  Numbering &N = M.number;
  for (std::size_t b = 0; b < s.bodies.size(); b++) f(N.owner.empty() ? 0 : N.owner[b], (int)CoordinatesOf(s, s.bodies[b]), N.body[b]);
  for (StoreBase *store : s.order)
    for (PetscInt e = 0; e < store->size(); e++) f(OwnerOf(M, *store, e), store->unknowns(e), store->start[e]);
  for (std::size_t i = 0; i < s.variables.size(); i++) f(N.variable_owner[i], 1, N.variable[i]);
  for (std::size_t i = 0; i < s.states.size(); i++) f(N.state_owner[i], 1, N.state[i]);
}

} // namespace

PetscErrorCode Number(Model &M)
{
  SceneData &s = M.scene;
  Numbering &N = M.number;
  PetscFunctionBegin;
  N.body.assign(s.bodies.size(), -1);
  N.variable.assign(s.variables.size(), -1);
  N.state.assign(s.states.size(), -1);
  N.variable_owner.clear();
  N.state_owner.clear();
  for (const ExpressionData &v : s.variables) N.variable_owner.push_back(OwnerOf(M, v.expression));
  for (const ExpressionData &x : s.states) N.state_owner.push_back(OwnerOf(M, x.expression));
  for (StoreBase *store : s.order) store->start.assign(store->size(), -1);

  N.first.assign(M.size + 1, 0);
  for (auto &x : s.extensions) {
    const PetscInt mine = x->unknowns();
    x->start.assign(M.size, 0);
    PetscCallMPI(MPI_Allgather(&mine, 1, MPIU_INT, x->start.data(), 1, MPIU_INT, s.comm));
    for (PetscMPIInt r = 0; r < M.size; r++) N.first[r + 1] += x->start[r];
  }
  Visit(M, [&](PetscMPIInt owner, int count, PetscInt &) { N.first[owner + 1] += count; });
  for (PetscMPIInt r = 0; r < M.size; r++) N.first[r + 1] += N.first[r];
  std::vector<PetscInt> next(N.first.begin(), N.first.end() - 1);
  Visit(M, [&](PetscMPIInt owner, int count, PetscInt &number) {
    number = count ? next[owner] : -1;
    next[owner] += count;
  });
  for (auto &x : s.extensions)
    for (PetscMPIInt r = 0; r < M.size; r++) {
      const PetscInt count = x->start[r];
      x->start[r]          = next[r];
      next[r] += count;
    }
  M.start = N.first[M.rank];
  M.n     = N.first[M.rank + 1] - M.start;
  PetscFunctionReturn(0);
}

} // namespace hhtdae
