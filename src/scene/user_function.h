/* Values and derivatives of a user's function for plain numbers as arguments; exceptions that it throws contain its name. */
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
  /* H: second derivatives, a symmetric matrix, by central differences of the gradient; reach: step of the difference for each argument */
  void   curvature(const double *m, const double *reach, double *H) const;

private:
  std::string                name_; /* such as "variable speed", for messages */
  RealFunction<const Real *> f_;
  int                        count_ = 0;

  Real call(const Real *m) const;
};

} // namespace hhtdae

#endif
