/* The state of a run that a snapshot has taken, of which its questions are asked (query.cpp, query_measures.cpp). */
#ifndef HHTDAE_SCENE_SNAPSHOT_H
#define HHTDAE_SCENE_SNAPSHOT_H

#include "guard.h"
#include "hhtdae/query.h"
#include "runtime.h"
#include <algorithm>

namespace hhtdae
{

/* The run, and the unknowns of this rank and of its neighbours at the time asked for */
struct Snapshot::Work {
  Runtime            *R = nullptr;
  double              t = 0;
  std::vector<double> u, v, a;
  long                moved = -1; /* which move of the bodies was to this state */
  std::vector<CountedAngle> counted; /* as the run had them when the state was taken, after so many accepted states */
  long                      accepts = 0;
  std::vector<Matrix3>      references; /* of the bodies' rotations then; the run has others once it has gone on */

  Evaluation at() const { return Evaluation{t, u.data(), v.data(), a.data(), R->bodies, R->n}; }
  /* The bodies, where somebody else may have moved them */
  void move()
  {
    if (moved == R->bodies.moves) return;
    exchangeReferences();
    R->bodies.move(u.data(), v.data());
    exchangeReferences();
    moved = R->bodies.moves;
  }
  void exchangeReferences()
  {
    for (std::size_t b = 0; b < references.size(); b++) std::swap(R->bodies.body[b].C, references[b]);
  }
  const SceneData &scene() const { return R->scene; }
  PetscMPIInt      owner(PetscInt body) const { return R->number.owner.empty() ? 0 : R->number.owner[body]; }

  /* What was described after the run was made has no place in it */
  PetscErrorCode hasBody(PetscInt body) const;
  PetscErrorCode hasElement(PetscInt element) const;
  PetscErrorCode load(PetscInt element, PetscInt on, Load *x);
  PetscErrorCode motion(PetscInt marker, Motion *x);
  PetscErrorCode scalar(PetscMPIInt owner, PetscInt global, double *x);
  PetscErrorCode component(const ElementData &e, PetscInt row, bool constraint, double *x);
  PetscErrorCode ofMarkers(const Measure &m, double *x);
  PetscErrorCode angle(PetscInt i, PetscInt j, double *x);
  PetscErrorCode checkMemory(PetscInt element);
};

/* Numbers that one rank computes, on all of them; what goes wrong there goes wrong everywhere */
template <class F> PetscErrorCode FromOwner(const Runtime &R, PetscMPIInt owner, double *x, int n, const F &compute)
{
  std::vector<double> all(n + 1, 0);
  PetscFunctionBegin;
  if (R.rank == owner) {
    all[n] = (double)Guarded([&] {
      compute(all.data());
      return PetscErrorCode(0);
    });
  }
  if (R.size > 1) PetscCallMPI(MPI_Bcast(all.data(), n + 1, MPI_DOUBLE, owner, R.scene.comm));
  PetscCheck(all[n] == 0, R.scene.comm, (PetscErrorCode)all[n], "rank %d could not answer a question to the run, see there", owner);
  std::copy(all.begin(), all.end() - 1, x);
  PetscFunctionReturn(0);
}

#define CHECK_TAKEN(w) PetscCheck((w).R, PETSC_COMM_SELF, PETSC_ERR_ORDER, "Snapshot: nothing has been taken, call take() first")
#define CHECK_MARKER(w, m, what) \
  PetscCheck((w).scene().valid(m) && (w).scene().markers[(m).id].body >= -1, (w).scene().comm, PETSC_ERR_ARG_WRONG, "Snapshot: %s is not a marker of this scene", what)

} // namespace hhtdae

#endif
