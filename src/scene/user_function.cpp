#include "user_function.h"
#include <algorithm>
#include <stdexcept>

namespace hhtdae
{

Real UserFunction::call(const Real *m) const
{
  try {
    return f_(m);
  } catch (const std::exception &e) {
    throw std::runtime_error(name_ + ": " + e.what());
  }
}

double UserFunction::value(const double *m) const
{
  Real x[Real::most];
  for (int k = 0; k < count_; k++) x[k] = Real(m[k]);
  return call(x).value();
}

double UserFunction::gradient(const double *m, double *g) const
{
  Real x[Real::most];
  for (int k = 0; k < count_; k++) x[k] = Real(m[k], count_, k);
  const Real f = call(x);
  std::fill(g, g + count_, 0.0);
  if (f.derivatives().size() == 0) return f.value(); /* a constant */
  if (f.derivatives().size() != count_)
    throw std::runtime_error(name_ + " came back with " + std::to_string(f.derivatives().size()) + " derivatives for " + std::to_string(count_) +
                             " arguments: make its value from the arguments, or from plain numbers");
  std::copy(f.derivatives().data(), f.derivatives().data() + count_, g);
  return f.value();
}

void UserFunction::curvature(const double *m, const double *reach, double *H) const
{
  double x[Real::most], up[Real::most], down[Real::most];
  std::copy(m, m + count_, x);
  std::fill(H, H + count_ * count_, 0.0);
  for (int l = 0; l < count_; l++) {
    x[l] = m[l] + reach[l];
    gradient(x, up);
    x[l] = m[l] - reach[l];
    gradient(x, down);
    x[l] = m[l];
    for (int k = 0; k < count_; k++) {
      const double half = 0.25 * (up[k] - down[k]) / reach[l];
      H[k * count_ + l] += half;
      H[l * count_ + k] += half;
    }
  }
}

} // namespace hhtdae
