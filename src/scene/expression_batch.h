/* Rows V - f(...) = 0 of user-defined variables, x' - f(...) = 0 of states, F - f(...) = 0 of user's forces. */
#ifndef HHTDAE_SCENE_EXPRESSION_BATCH_H
#define HHTDAE_SCENE_EXPRESSION_BATCH_H

#include "measures.h"
#include "user_function.h"

namespace hhtdae
{

/* Several expressions as one function of the unknowns */
class LocalFunction
{
public:
  using Gradient = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

  LocalFunction() = default;
  LocalFunction(Localizer &l, const std::string &name, const Expression *e, std::size_t count);

  MeasureSet arguments;

  int  size() const { return (int)pieces_.size(); }
  void value(const Evaluation &e, double *f) const;
  /* values, and df/du + sv df/du' + sa df/du'' in the columns of the arguments */
  void gradient(const Evaluation &e, double *f, Gradient &G) const;

private:
  struct Piece {
    UserFunction f;
    int          first; /* of its arguments */
  };
  std::string        name_; /* "variable speed", for messages */
  std::vector<Piece> pieces_;

  void read(const Evaluation &e, const Piece &p, double *m) const;
  void report(const Evaluation &e, const Piece &p, const double *m, double f) const;
};

class ExpressionBatch : public ReadingBatch<Batch>
{
public:
  enum Kind { Definition, RateOfState };

  explicit ExpressionBatch(const Bodies &b) : bodies_(b) {}
  /* rows of a group of unknowns of this rank */
  void add(Kind kind, LocalFunction f, PetscInt local, PetscInt group)
  {
    all_.push_back({kind, std::move(f), local, group});
  }
  bool empty() const { return all_.empty(); }

  void pattern(Pattern &p) override;
  void residual(Evaluation &e) override;
  void jacobian(Evaluation &e) override;

protected:
  void each(const Visit &visit) override;

private:
  struct Row {
    Kind          kind;
    LocalFunction f;
    PetscInt      local, group;
  };
  const Bodies           &bodies_;
  std::vector<Row>        all_;
  LocalFunction::Gradient G_;
};

} // namespace hhtdae

#endif
