/* Small models for the tests of the reduction */
#ifndef HHTDAE_TEST_REDUCTION_CASES_H
#define HHTDAE_TEST_REDUCTION_CASES_H

#include "box_model.h"
#include "support.h"

namespace hhtest
{

using namespace hhtdae;

inline Box bar(int nx = 6, int ny = 2, int nz = 2)
{
  Box box = {{nx, ny, nz}, {0.5, 0.06, 0.08}};
  return box;
}

inline Attachment attach(const std::string &set, Tie tie = Tie::Rigid)
{
  Attachment a;
  a.name = set;
  a.tie  = tie;
  return a;
}

inline Reduction both(PetscInt modes = 4, Tie tie = Tie::Rigid)
{
  Reduction r;
  r.attachments = {attach("left", tie), attach("right", tie)};
  r.modes       = modes;
  return r;
}

struct Made {
  FeModel    model;
  BoxBuilder builder;
  explicit Made(const Box &box) : model(PETSC_COMM_SELF), builder(box, &model) {}
};

} // namespace hhtest

#endif
