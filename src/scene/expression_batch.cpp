#include "expression_batch.h"
#include <cmath>
#include <sstream>
#include <stdexcept>

namespace hhtdae
{

constexpr int kComponents = 6; /* of a user's force, at most */

LocalFunction::LocalFunction(Localizer &l, const std::string &name, const Expression *e, std::size_t count)
    : name_(name)
{
  for (std::size_t c = 0; c < count; c++) {
    pieces_.push_back({e[c].f, arguments.size(), (int)e[c].arguments.size()});
    for (const Measure &m : e[c].arguments) arguments.place(l, m);
  }
}

/* What -info tells of the step that fails for it */
void LocalFunction::report(const Evaluation &e, int piece, const Real *m, double f) const
{
  std::ostringstream text;
  for (int k = 0; k < pieces_[piece].count; k++) text << (k ? ", " : "") << m[k].value();
  PetscCallAbort(PETSC_COMM_SELF, PetscInfo(nullptr, "%s is %g at t = %g, its arguments are (%s)\n", name_.c_str(), f,
                                            e.t, text.str().c_str()));
}

/* The user's function, with its name in what it throws */
Real LocalFunction::call(const Piece &p, const Real *m) const
{
  try {
    return p.f(m);
  } catch (const std::exception &e) {
    throw std::runtime_error(name_ + ": " + e.what());
  }
}

void LocalFunction::value(const Evaluation &e, double *f) const
{
  Real m[Real::most];
  for (int c = 0; c < size(); c++) {
    const Piece &p = pieces_[c];
    for (int k = 0; k < p.count; k++) m[k] = Real(arguments.value(p.first + k, e));
    f[c] = call(p, m).value();
    if (!std::isfinite(f[c])) report(e, c, m, f[c]);
  }
}

void LocalFunction::gradient(const Evaluation &e, double *f, Gradient &G) const
{
  Real m[Real::most];
  G.setZero(size(), arguments.columns().width);
  for (int c = 0; c < size(); c++) {
    const Piece &p = pieces_[c];
    for (int k = 0; k < p.count; k++) m[k] = Real(arguments.value(p.first + k, e), p.count, k);
    const Real x = call(p, m);
    f[c]         = x.value();
    if (x.derivatives().size() == 0) continue; /* a constant */
    if (x.derivatives().size() != p.count)
      throw std::runtime_error(name_ + " came back with " + std::to_string(x.derivatives().size()) + " derivatives for " + std::to_string(p.count) +
                               " arguments: make its value from the arguments, or from plain numbers");
    for (int k = 0; k < p.count; k++) arguments.addGradient(p.first + k, e, x.derivatives()(k), G.row(c).data());
  }
}

void ExpressionBatch::pattern(Pattern &p)
{
  for (Row &r : all_) {
    r.f.arguments.connect(bodies_, p);
    request_.push_back(p.need(r.group, r.group));
    for (const Columns::Part &c : r.f.arguments.columns().parts) request_.push_back(p.need(r.group, c.group));
  }
}

void ExpressionBatch::residual(Evaluation &e)
{
  double f[kComponents];
  for (const Row &r : all_) {
    const double *x = r.kind == RateOfState ? e.v : e.u;
    r.f.value(e, f);
    for (int c = 0; c < r.f.size(); c++) e.row(r.local + c, x[r.local + c] - f[c]);
  }
}

void ExpressionBatch::jacobian(Evaluation &e)
{
  const Slot *slot = slot_.data();
  double      f[kComponents];
  for (const Row &r : all_) {
    const int n = r.f.size();
    r.f.gradient(e, f, G_);
    const LocalFunction::Gradient one = (r.kind == RateOfState ? e.sv : 1.0) * LocalFunction::Gradient::Identity(n, n);
    e.sink.add(*slot++, one, n, n);
    G_ = -G_;
    for (const Columns::Part &c : r.f.arguments.columns().parts)
      e.sink.add(*slot++, G_.middleCols(c.start, c.size), n, c.size);
  }
}

void ExpressionBatch::accept(Bodies &B)
{
  for (Row &r : all_) r.f.arguments.accept(B);
}

bool ExpressionBatch::limitsSteps() const
{
  return std::any_of(all_.begin(), all_.end(), [](const Row &r) { return r.f.arguments.limitsSteps(); });
}

double ExpressionBatch::longestStep(const Evaluation &e) const
{
  double least = std::numeric_limits<double>::infinity();
  for (const Row &r : all_) least = std::min(least, r.f.arguments.longestStep(e));
  return least;
}

PetscInt ExpressionBatch::memory() const
{
  PetscInt n = 0;
  for (const Row &r : all_) n += r.f.arguments.memory();
  return n;
}

void ExpressionBatch::copyMemory(double *x, bool in)
{
  for (Row &r : all_) {
    r.f.arguments.copyMemory(x, in);
    x += r.f.arguments.memory();
  }
}

} // namespace hhtdae
