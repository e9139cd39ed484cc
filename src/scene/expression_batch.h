/* Rows V - f(...) = 0 of user-defined variables, x' - f(...) = 0 of first-order states, F - f(...) = 0 of users' force states. */
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
  /* Values f, and G = df/du + sv df/du' + sa df/du'' with the columns of `arguments` */
  void gradient(const Evaluation &e, double *f, Gradient &G) const;

private:
  struct Piece {
    UserFunction f;
    int          first; /* number of its first argument in `arguments` */
  };
  std::string        name_; /* such as "variable speed", for messages */
  std::vector<Piece> pieces_;

  void read(const Evaluation &e, const Piece &p, double *m) const;
  void report(const Evaluation &e, const Piece &p, const double *m, double f) const;
};

class ExpressionBatch : public ReadingBatch<Batch>
{
public:
  enum Kind { Definition, RateOfState };

  explicit ExpressionBatch(const Bodies &b) : bodies_(b) {}
  /* Adds the rows of one group of this rank's unknowns, from local number `local` on */
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
