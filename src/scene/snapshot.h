/* The state of a run that a snapshot has stored, and from which it answers queries (query.cpp, query_measures.cpp). */
#ifndef HHTDAE_SCENE_SNAPSHOT_H
#define HHTDAE_SCENE_SNAPSHOT_H

#include "guard.h"
#include "hhtdae/query.h"
#include "runtime.h"
#include <algorithm>

namespace hhtdae
{

/* The data that a state needs besides its unknowns: reference attitudes of rotations, memories of elements, angles
   over full turns, and values of parameters. The run itself replaces its own with every accepted step. */
struct Origin {
  std::vector<Matrix3>      references; /* LocalBody::C of all bodies on this rank */
  std::vector<double>       memories;   /* of all batches; empty if no element has memory */
  std::vector<CountedAngle> counted;
  std::vector<double>       parameters;
  long                      accepted_states = 0; /* Runtime::accepted_states when the data were stored */

  void take(Runtime &R)
  {
    counted         = R.queried_angles;
    parameters      = ParametersNow(R.scene);
    accepted_states = R.accepted_states;
    references.clear();
    for (const LocalBody &b : R.bodies.body) references.push_back(b.C);
    memories.resize(R.has_memory ? Memories(R) : 0);
    if (R.has_memory) CopyMemories(R, memories.data(), false);
  }
};

/* During the lifetime of this object the run has the references and memories, and the scene the parameters, of an Origin */
class CountFrom
{
public:
  CountFrom(Runtime &R, Origin &o) : R_(R), origin_(o), now_(o.memories.size()), parameters_(R.scene, o.parameters)
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
  std::vector<double> now_; /* memories of the run, restored by the destructor */
  WithParameters      parameters_;

  void exchange()
  {
    for (std::size_t b = 0; b < origin_.references.size(); b++) std::swap(R_.bodies.body[b].C, origin_.references[b]);
  }
};

/* The run, and the local unknowns at the time of the snapshot */
struct Snapshot::Work {
  Runtime            *R = nullptr;
  double              t = 0;
  std::vector<double> u, v, a;
  long                moved = -1; /* value of Bodies::moves when the bodies were moved to this state */
  Origin              origin;

  Evaluation at() const { return Evaluation{t, u.data(), v.data(), a.data(), R->bodies, R->n}; }
  /* Moves the bodies to this state unless they already are at it */
  void move()
  {
    if (moved == R->bodies.moves) return;
    const CountFrom then(*R, origin);
    R->bodies.move(u.data(), v.data());
    moved = R->bodies.moves;
  }
  const SceneData &scene() const { return R->scene; }
  PetscMPIInt      owner(PetscInt body) const { return R->number.owner.empty() ? 0 : R->number.owner[body]; }

  /* An error if the body or element was described after the run was made */
  PetscErrorCode hasBody(PetscInt body) const;
  PetscErrorCode hasElement(PetscInt element) const;
  PetscErrorCode load(PetscInt element, PetscInt on, Load *x);
  PetscErrorCode motion(PetscInt marker, Motion *x);
  PetscErrorCode scalar(PetscMPIInt owner, PetscInt global, double *x);
  PetscErrorCode component(const ElementData &e, PetscInt row, bool constraint, double *x);
  PetscErrorCode ofMarkers(const Measure &m, double *x);
  PetscErrorCode angle(PetscInt i, PetscInt j, double *x);
};

/* Computes n numbers on the owner and sends them to all ranks; an error on the owner is raised on all ranks */
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
  PetscCheck(all[n] == 0, R.scene.comm, (PetscErrorCode)all[n], "rank %d could not evaluate a query; its error message has the reason", owner);
  std::copy(all.begin(), all.end() - 1, x);
  PetscFunctionReturn(0);
}

#define CHECK_TAKEN(w) PetscCheck((w).R, PETSC_COMM_SELF, PETSC_ERR_ORDER, "Snapshot: nothing has been taken, call take() first")
#define CHECK_MARKER(w, m, what) \
  PetscCheck((w).scene().valid(m) && (w).scene().markers[(m).id].body >= -1, (w).scene().comm, PETSC_ERR_ARG_WRONG, "Snapshot: %s is not a marker of this scene", what)

} // namespace hhtdae

#endif
