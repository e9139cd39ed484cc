/* A work vector that is released at the end of its scope, also if an error ends it. Vectors that every step may need are taken from a
   list of spare ones, which live as long as the run. */
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

  /* A new vector of zeros */
  PetscErrorCode like(Vec other) { return VecDuplicate(other, &v_); }

  /* A vector of any values, from `spare` if it has one; it returns there at the end of the scope. Creating a vector takes 3 % of the
     instructions of a step of a small mechanism. */
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
