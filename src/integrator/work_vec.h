/* A work vector that goes with its scope, which an error may end too. */
#ifndef HHTDAE_INTEGRATOR_WORK_VEC_H
#define HHTDAE_INTEGRATOR_WORK_VEC_H

#include <petscvec.h>

namespace hht3
{

class WorkVec
{
public:
  WorkVec() = default;
  ~WorkVec() { PetscCallAbort(PETSC_COMM_SELF, VecDestroy(&v_)); }
  WorkVec(const WorkVec &)            = delete;
  WorkVec &operator=(const WorkVec &) = delete;

  PetscErrorCode like(Vec other) { return VecDuplicate(other, &v_); }
  operator Vec() const { return v_; }

private:
  Vec v_ = nullptr;
};

} // namespace hht3

#endif
