/*
  Reference solutions of y' = f(t,y): the explicit midpoint rule extrapolated to order 20 (Gragg, Bulirsch and Stoer) in
  long double on a fixed grid of steps. Results on the grid are kept, so that a reference at many times costs one pass.
*/
#ifndef HHTEX_EXTRAPOLATION_H
#define HHTEX_EXTRAPOLATION_H

#include <cmath>
#include <functional>
#include <utility>
#include <vector>

namespace hhtex
{

class Extrapolation
{
public:
  using State = std::vector<long double>;
  using Rhs   = std::function<void(long double t, const long double *y, long double *f)>;

  Extrapolation(Rhs f, long double t0, long double step, State y0)
      : f_(std::move(f)), t0_(t0), step_(step), grid_{std::move(y0)}
  {
  }

  /* y(t) for t >= t0 */
  State at(long double t)
  {
    const auto k = static_cast<size_t>(std::floor((t - t0_) / step_));
    while (grid_.size() <= k) grid_.push_back(advance(t0_ + step_ * (grid_.size() - 1), step_, grid_.back()));
    const long double tk = t0_ + step_ * k;
    return t > tk ? advance(tk, t - tk, grid_[k]) : grid_[k];
  }

private:
  static constexpr int columns_ = 10;
  Rhs                  f_;
  long double          t0_, step_;
  std::vector<State>   grid_;

  /* The midpoint rule with an even number of substeps: its error has even powers of the substep only */
  State midpoint(long double t, long double H, const State &y, int substeps) const
  {
    const long double h = H / substeps;
    const size_t      n = y.size();
    State             previous(y), current(n), f(n);
    f_(t, y.data(), f.data());
    for (size_t i = 0; i < n; i++) current[i] = y[i] + h * f[i];
    for (int m = 1; m < substeps; m++) {
      f_(t + m * h, current.data(), f.data());
      for (size_t i = 0; i < n; i++) {
        const long double next = previous[i] + 2.L * h * f[i];
        previous[i]            = current[i];
        current[i]             = next;
      }
    }
    return current;
  }

  State advance(long double t, long double H, const State &y) const
  {
    State table[columns_];
    for (int j = 0; j < columns_; j++) {
      table[j] = midpoint(t, H, y, 2 * (j + 1));
      for (int k = j; k > 0; k--) { /* Aitken and Neville: table[k-1] becomes one column better */
        const long double ratio = static_cast<long double>(j + 1) / k;
        for (size_t i = 0; i < y.size(); i++)
          table[k - 1][i] = table[k][i] + (table[k][i] - table[k - 1][i]) / (ratio * ratio - 1.L);
      }
    }
    return table[0];
  }
};

} // namespace hhtex

#endif
