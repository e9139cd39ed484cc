/*
  A tape is a function written in Python that expressions.py has traced as a list of operations on numbers. It is evaluated without
  Python, for plain numbers, for numbers with derivatives (dual.h), and for those of time functions.
*/
#ifndef HHTDAE_PYTHON_TAPE_H
#define HHTDAE_PYTHON_TAPE_H

#include "hhtdae/scene.h"
#include <memory>
#include <pybind11/pybind11.h>
#include <vector>

namespace hhtdae
{
namespace python
{

/* Name in Python, and number of operands, which are a, b, c in this order. For constant, argument, parameter, table and function, c is an index. */
#define HHTDAE_TAPE_OPERATIONS(X)                                                                                                       \
  X(constant, 0) X(argument, 0) X(parameter, 0) X(add, 2) X(subtract, 2) X(multiply, 2) X(divide, 2) X(negate, 1) X(power, 2)            \
  X(sin, 1) X(cos, 1) X(tan, 1) X(asin, 1) X(acos, 1) X(atan, 1) X(atan2, 2) X(sinh, 1) X(cosh, 1) X(tanh, 1) X(exp, 1) X(log, 1)        \
  X(log10, 1) X(sqrt, 1) X(cbrt, 1) X(hypot, 2) X(abs, 1) X(minimum, 2) X(maximum, 2) X(less, 2) X(less_equal, 2) X(equal, 2)            \
  X(logical_and, 2) X(logical_or, 2) X(logical_not, 1) X(where, 3) X(table, 1) X(table_rate, 1) X(table_curvature, 1) X(function, 0)

class Tape
{
public:
  enum Code {
#define HHTDAE_CODE(name, operands) op_##name,
    HHTDAE_TAPE_OPERATIONS(HHTDAE_CODE)
#undef HHTDAE_CODE
  };
  struct Operation {
    int code, a, b, c;
  };
  /* A Python function that is called at every evaluation; a borrowed reference, since the Python scene owns the function */
  struct Function {
    PyObject        *value, *gradient; /* gradient: None for central differences */
    std::vector<int> operands;
  };

  std::vector<Operation>    operations;
  std::vector<double>       constants;
  std::vector<Parameter>    parameters;
  std::vector<TimeFunction> tables;
  std::vector<Function>     functions;
  std::vector<int>          outputs;
  int                       arguments = 0;

  /* out: one value for each output */
  void evaluate(const double *arguments, double *out) const;
  Real operator()(const Real *arguments) const;                                         /* returns the first output */
  TimeFunction::Number operator()(const TimeFunction::Number &t) const;

private:
  template <class N> N run(const N *arguments) const; /* the first output */
  template <class N> void run(const N *arguments, std::vector<N> &x) const;
};

} // namespace python
} // namespace hhtdae

#endif
