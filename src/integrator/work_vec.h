/* A work vector that goes with its scope, which an error may end too. What every step may ask for is taken from spare ones, which stay with the run. */
#ifndef HHTDAE_INTEGRATOR_WORK_VEC_H
#define HHTDAE_INTEGRATOR_WORK_VEC_H

#include <petscvec.h>
#include <vector>

namespace hht3
{

class WorkVec
{
public:
  WorkVec() = default;
  ~WorkVec()
  {
    if (spare_) spare_->push_back(v_);
    else PetscCallAbort(PETSC_COMM_SELF, VecDestroy(&v_));
  }
  WorkVec(const WorkVec &)            = delete;
  WorkVec &operator=(const WorkVec &) = delete;

  /* of zeros */
  PetscErrorCode like(Vec other) { return VecDuplicate(other, &v_); }

  /* of any values, from the spare ones if there are any, to which it goes back: a vector of its own is 3 % of the instructions of a small mechanism */
  PetscErrorCode like(Vec other, std::vector<Vec> &spare)
  {
    PetscFunctionBegin;
    if (spare.empty()) PetscCall(like(other));
    else {
      v_ = spare.back();
      spare.pop_back();
    }
    spare_ = &spare;
    PetscFunctionReturn(PETSC_SUCCESS);
  }
  operator Vec() const { return v_; }

private:
  Vec               v_     = nullptr;
  std::vector<Vec> *spare_ = nullptr;
};

} // namespace hht3

#endif
