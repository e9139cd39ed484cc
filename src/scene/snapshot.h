/* The state of a run that a snapshot has taken, of which its questions are asked (query.cpp, query_measures.cpp). */
#ifndef HHTDAE_SCENE_SNAPSHOT_H
#define HHTDAE_SCENE_SNAPSHOT_H

#include "guard.h"
#include "hhtdae/query.h"
#include "runtime.h"
#include <algorithm>

namespace hhtdae
{

/* What the unknowns of a state count from: attitudes that rotations refer to, what elements remember of accepted steps, and angles over full turns.
   The run has others once it has gone on. */
struct Origin {
  std::vector<Matrix3>      references; /* of this rank's bodies, then those of others */
  std::vector<double>       memories;   /* of all batches; empty where no element remembers */
  std::vector<CountedAngle> counted;
  long                      accepts = 0; /* accepted states before it */

  void take(Runtime &R)
  {
    counted = R.asked;
    accepts = R.accepts;
    references.clear();
    for (const LocalBody &b : R.bodies.body) references.push_back(b.C);
    memories.resize(R.remembers ? Memories(R) : 0);
    if (R.remembers) CopyMemories(R, memories.data(), false);
  }
};

/* The run counts from there while this lives, and as before after that */
class CountFrom
{
public:
  CountFrom(Runtime &R, Origin &o) : R_(R), origin_(o), now_(o.memories.size())
  {
    if (!now_.empty()) CopyMemories(R_, now_.data(), false);
    exchange();
    if (!now_.empty()) CopyMemories(R_, origin_.memories.data(), true);
  }
  ~CountFrom()
  {
    exchange();
    if (!now_.empty()) CopyMemories(R_, now_.data(), true);
  }
  CountFrom(const CountFrom &) = delete;

private:
  Runtime            &R_;
  Origin             &origin_;
  std::vector<double> now_; /* memories of the run */

  void exchange()
  {
    for (std::size_t b = 0; b < origin_.references.size(); b++) std::swap(R_.bodies.body[b].C, origin_.references[b]);
  }
};

/* The run, and the unknowns of this rank and of its neighbours at the time asked for */
struct Snapshot::Work {
  Runtime            *R = nullptr;
  double              t = 0;
  std::vector<double> u, v, a;
  long                moved = -1; /* which move of the bodies was to this state */
  Origin              origin;

  Evaluation at() const { return Evaluation{t, u.data(), v.data(), a.data(), R->bodies, R->n}; }
  /* The bodies, where somebody else may have moved them */
  void move()
  {
    if (moved == R->bodies.moves) return;
    const CountFrom then(*R, origin);
    R->bodies.move(u.data(), v.data());
    moved = R->bodies.moves;
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
