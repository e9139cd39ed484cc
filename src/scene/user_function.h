/* A function that the user gives, of plain numbers: values and derivatives, with its name in what it throws. */
#ifndef HHTDAE_SCENE_USER_FUNCTION_H
#define HHTDAE_SCENE_USER_FUNCTION_H

#include "hhtdae/functions.h"
#include <string>

namespace hhtdae
{

class UserFunction
{
public:
  UserFunction() = default;
  UserFunction(std::string name, const Expression &e) : name_(std::move(name)), f_(e.f), count_((int)e.arguments.size()) {}

  int    arguments() const { return count_; }
  double value(const double *m) const;
  double gradient(const double *m, double *g) const; /* returns the value */
  /* second derivatives, symmetric, row by row: central differences of the gradient over `reach` of each argument */
  void   curvature(const double *m, const double *reach, double *H) const;

private:
  std::string                name_; /* "variable speed", for messages */
  RealFunction<const Real *> f_;
  int                        count_ = 0;

  Real call(const Real *m) const;
};

} // namespace hhtdae

#endif
