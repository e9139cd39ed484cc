#include "expression_batch.h"
#include <cmath>
#include <sstream>

namespace hhtdae
{

constexpr int max_user_components = 6; /* largest number of components of a user's force */

LocalFunction::LocalFunction(Localizer &l, const std::string &name, const Expression *e, std::size_t count)
    : name_(name)
{
  for (std::size_t c = 0; c < count; c++) {
    pieces_.push_back({UserFunction(name, e[c]), arguments.size()});
    for (const Measure &m : e[c].arguments) arguments.place(l, m);
  }
}

/* With -info, reports a non-finite value, which makes the step fail */
void LocalFunction::report(const Evaluation &e, const Piece &p, const double *m, double f) const
{
  std::ostringstream text;
  for (int k = 0; k < p.f.arguments(); k++) text << (k ? ", " : "") << m[k];
  PetscCallAbort(PETSC_COMM_SELF, PetscInfo(nullptr, "%s is %g at t = %g, its arguments are (%s)\n", name_.c_str(), f,
                                            e.t, text.str().c_str()));
}

void LocalFunction::read(const Evaluation &e, const Piece &p, double *m) const
{
  for (int k = 0; k < p.f.arguments(); k++) m[k] = arguments.value(p.first + k, e);
}

void LocalFunction::value(const Evaluation &e, double *f) const
{
  double m[Real::most];
  for (int c = 0; c < size(); c++) {
    const Piece &p = pieces_[c];
    read(e, p, m);
    f[c] = p.f.value(m);
    if (!std::isfinite(f[c])) report(e, p, m, f[c]);
  }
}

void LocalFunction::gradient(const Evaluation &e, double *f, Gradient &G) const
{
  double m[Real::most], g[Real::most];
  G.setZero(size(), arguments.columns().width);
  for (int c = 0; c < size(); c++) {
    const Piece &p = pieces_[c];
    read(e, p, m);
    f[c] = p.f.gradient(m, g);
    for (int k = 0; k < p.f.arguments(); k++) arguments.addGradient(p.first + k, e, g[k], G.row(c).data());
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
  double f[max_user_components];
  for (const Row &r : all_) {
    const double *x = r.kind == RateOfState ? e.v : e.u;
    r.f.value(e, f);
    for (int c = 0; c < r.f.size(); c++) e.row(r.local + c, x[r.local + c] - f[c]);
  }
}

void ExpressionBatch::jacobian(Evaluation &e)
{
  const Slot *slot = slot_.data();
  double      f[max_user_components];
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

void ExpressionBatch::each(const Visit &visit)
{
  for (Row &r : all_)
    for (LocalMeasure &m : r.f.arguments.all()) visit(m);
}

} // namespace hhtdae
